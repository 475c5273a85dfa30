"""What a snapshot of a busy rig costs: time to save and to load, beside copying by pickle, and its size.

Must: 64 KiB, 3 ms to save and 3 ms to load.

python benchmarks/bench_snapshot.py
"""

from __future__ import annotations

import pickle
import sys
from collections.abc import Callable
from time import process_time

from marks import Marks

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
        start = process_time()
        do()
        times.append(process_time() - start)
    return 1000 * min(times)


def main() -> int:
    """Print the figures; status 1 when one misses its mark."""
    rig, other, marks = busy(), simple_rig(), Marks()
    data, pickled = rig.snapshot(), pickle.dumps(rig)
    save, load = best_ms(rig.snapshot), best_ms(lambda: other.restore(data))
    dump, undump = best_ms(lambda: pickle.dumps(rig)), best_ms(lambda: pickle.loads(pickled))
    marks.at_most("a snapshot of a busy rig", len(data) / 1024, 64, "KiB")
    marks.at_most("saving it", save, 3, "ms")
    marks.at_most("loading it", load, 3, "ms")
    print(
        f"by pickle: {len(pickled) / 1024:.1f} KiB, {dump:.2f} ms to save, {undump:.2f} ms to load; a snapshot takes "
        f"{save / dump:.2f} and {load / undump:.2f} of that"
    )
    return marks.status


if __name__ == "__main__":
    sys.exit(main())
