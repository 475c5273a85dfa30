"""How much faster than time, and than its definition, the motion chip runs.

Three axes move without pause between random targets within 100,000 microsteps, at the module's default
registers.  All figures are of this run on this machine; the ratios are what to compare.

    python benchmarks/bench_chips.py
"""

from __future__ import annotations

import sys
import tracemalloc
from pathlib import Path
from random import Random
from time import process_time

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from chips.oracle import Oracle
from tmcm34x.chips.ramp import brake_factor
from tmcm34x.chips.registers import BY_NAME, FIELDS, at_target
from tmcm34x.chips.tmc429 import Tmc429
from tmcm34x.clock import HZ

FAR = 100_000
P_MUL, P_DIV = brake_factor(1000, 7, 3)
REGISTERS = {
    "V_MIN": 1,
    "V_MAX": 1000,
    "RAMP_DIV": 7,
    "PULSE_DIV": 3,
    "USRS": 6,
    "PMUL": P_MUL,
    "PDIV": P_DIV,
    "A_MAX": 1000,
}


def prepared() -> Tmc429:
    chip = Tmc429()
    words: dict[str, int] = {}
    for name, value in REGISTERS.items():
        register, field = FIELDS[name]
        words[register.name] = field.put(words.get(register.name, 0), value)
    for motor in range(3):
        for name, word in words.items():
            chip.transfer(BY_NAME[name].write(word, motor))
    return chip


def move(chip: Tmc429, motor: int, random: Random) -> None:
    chip.transfer(BY_NAME["X_TARGET"].write(random.randint(-FAR, FAR), motor))


def arriving(chip: Tmc429, until: int) -> int:
    """Each axis gets a new target when it has come to rest at the old one; the number of moves."""
    random = Random(343)
    moves = 3
    for motor in range(3):
        move(chip, motor, random)
    while (due := chip.next_event()) <= until:
        chip.advance(due)
        status = chip.read_status()
        for motor in range(3):
            if status & at_target(motor) and chip.velocity(motor) == 0:
                moves += 1
                move(chip, motor, random)
    chip.advance(until)
    return moves


def interrupted(chip: Tmc429, until: int) -> int:
    """A random axis gets a new target about once a second, wherever it is; the number of moves."""
    random = Random(343)
    moves = 0
    while chip.now < until:
        move(chip, random.randrange(3), random)
        moves += 1
        after = chip.now + random.randrange(2 * HZ // 3)
        while (due := chip.next_event()) <= after:
            chip.advance(due)
        chip.advance(after)
    return moves


def timed(run, seconds: int) -> tuple[float, int]:
    """How many times real time, the best of three; and the number of moves."""
    best, moves = 0.0, 0
    for _ in range(3):
        chip = prepared()
        start = process_time()
        moves = run(chip, seconds * HZ)
        best = max(best, seconds / (process_time() - start))
    return best, moves


def oracle_speed() -> float:
    """How many times real time three axes of the definition run."""
    oracle = Oracle(
        v_min=1, v_max=1000, ramp_div=7, pulse_div=3, p_mul=P_MUL, p_div=P_DIV, a_max=1000, x_target=50_000
    )
    ticks = 100_000
    start = process_time()
    for _ in range(ticks):
        oracle.tick()
    return ticks * 32 / HZ / (process_time() - start) / 3


def main() -> None:
    definition = oracle_speed()
    for name, run in (("new target on arrival", arriving), ("new target under way", interrupted)):
        speed, moves = timed(run, 300)
        print(
            f"{name:24} {speed:8.0f} x real time {speed / definition:10.0f} x the definition"
            f"   ({moves} moves in 300 s)"
        )
    chip = prepared()
    start = process_time()
    chip.advance(chip.now + 3600 * HZ)
    print(f"{'an hour of rest':24} {(process_time() - start) * 1e6:8.1f} us")
    arriving(chip, chip.now + HZ)
    for motor in range(3):
        chip.transfer(BY_NAME["X_TARGET"].write(chip.position(motor) + 5_000_000, motor))
    chip.advance(chip.now + HZ)
    count = 200_000
    start = process_time()
    for _ in range(count):
        chip.next_event()
        chip.advance(chip.now + 1)
    print(f"{'asking and waiting':24} {(process_time() - start) / count * 1e6:8.2f} us")
    tracemalloc.start()
    chip = prepared()
    arriving(chip, 20 * HZ)
    print(f"{'memory of a chip':24} {tracemalloc.get_traced_memory()[0] / 1024:8.1f} KiB")


if __name__ == "__main__":
    main()
