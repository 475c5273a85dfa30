"""How much faster than time, and than its definition, the motion chip runs.

Three axes move without pause between random targets within 100,000 microsteps, at the module's default
registers.  All figures are of this run on this machine; the ratios are what to compare.

Must: 1,000 times the definition; 10,000 times real time on the compiled core and 3,000 in Python where axes arrive,
half of that where targets change under way; an hour of rest within 1 ms; 1 us for a look at the next event and a clock
further; 24 KiB for a chip.

    python benchmarks/bench_chips.py
"""

from __future__ import annotations

import sys
import tracemalloc
from pathlib import Path
from random import Random
from time import process_time

from core import NAME, mark
from marks import Marks

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


def rest_ms() -> float:
    """Milliseconds that an hour of rest costs."""
    chip = prepared()
    start = process_time()
    chip.advance(chip.now + 3600 * HZ)
    return (process_time() - start) * 1e3


def look_us() -> float:
    """Microseconds to ask for the next event and to go on by one clock, while three axes move."""
    chip = prepared()
    arriving(chip, chip.now + HZ)
    for motor in range(3):
        chip.transfer(BY_NAME["X_TARGET"].write(chip.position(motor) + 5_000_000, motor))
    chip.advance(chip.now + HZ)
    count = 200_000
    start = process_time()
    for _ in range(count):
        chip.next_event()
        chip.advance(chip.now + 1)
    return (process_time() - start) / count * 1e6


def memory_kib() -> float:
    """Memory of a chip that has moved for a while."""
    tracemalloc.start()
    chip = prepared()
    arriving(chip, 20 * HZ)
    return tracemalloc.get_traced_memory()[0] / 1024


def main() -> int:
    """Print the figures; status 1 when one misses its mark."""
    print(f"core: {NAME}")
    marks, definition = Marks(), oracle_speed()
    least = mark(10_000, 3000)
    for name, run, times in (
        ("new target on arrival", arriving, least),
        ("new target under way", interrupted, least / 2),
    ):
        speed, moves = timed(run, 300)
        print(f"{name}: {moves} moves in 300 s")
        marks.at_least("  times real time", speed, times)
        marks.at_least("  times the definition", speed / definition, 1000)
    marks.at_most("an hour of rest", rest_ms(), 1, "ms")
    marks.at_most("asking and waiting", look_us(), 1, "us")
    marks.at_most("memory of a chip", memory_kib(), 24, "KiB")
    return marks.status


if __name__ == "__main__":
    sys.exit(main())
