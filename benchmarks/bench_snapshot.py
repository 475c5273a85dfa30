"""What a snapshot of a busy rig costs: time to save and to load, beside copying by pickle, and its size.

python benchmarks/bench_snapshot.py
"""

from __future__ import annotations

import pickle
from collections.abc import Callable
from time import perf_counter

from tmcm34x.bench import Rig, simple_rig
from tmcm34x.clock import HZ, run_until
from tmcm34x.tmcl.mnemonic import parse_instruction

REPEAT = 50


def busy() -> Rig:
    rig = simple_rig()
    for motor in range(3):
        rig.modules[0].execute(parse_instruction(f"MVP ABS, {motor}, {200_000 * (motor + 1)}"))
    run_until(rig, HZ)
    return rig


def best_ms(do: Callable[[], object]) -> float:
    times: list[float] = []
    for _ in range(REPEAT):
        start = perf_counter()
        do()
        times.append(perf_counter() - start)
    return 1000 * min(times)


def main() -> None:
    rig, other = busy(), simple_rig()
    data, pickled = rig.snapshot(), pickle.dumps(rig)
    save, load = best_ms(rig.snapshot), best_ms(lambda: other.restore(data))
    dump, undump = best_ms(lambda: pickle.dumps(rig)), best_ms(lambda: pickle.loads(pickled))
    print(f"snapshot of a busy rig: {len(data) / 1024:.1f} KiB (pickled {len(pickled) / 1024:.1f} KiB)")
    print(
        f"save {save:.2f} ms, {save / dump:.2f} of pickling; load {load:.2f} ms, {load / undump:.2f} of unpickling"
    )


main()
