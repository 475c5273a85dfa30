"""How much work a whole module is: virtual time, rest, telegrams, memory.

All figures are of this run on this machine, in processor time.

Must: three axes at 10,000 times real time with random targets within 100,000 microsteps and 2,500 within 20,000 on the
compiled core, 3,000 and 800 in Python; status 1 when one is missed.

    python benchmarks/bench_module.py
"""

from __future__ import annotations

import random
import sys
import tracemalloc
from time import process_time

from core import NAME, mark

from tmcm34x.board.board import Board
from tmcm34x.board.models import MODELS
from tmcm34x.clock import HZ, Part, run_until
from tmcm34x.firmware.module import FirmwareModule
from tmcm34x.firmware.ports.serial import SerialPort
from tmcm34x.firmware.storage import Eeprom
from tmcm34x.tmcl.datagram import Instruction, pack_request

REACH = 100_000
"""Random targets lie within this many microsteps."""
MOVING: dict[int, tuple[int, float]] = {
    REACH: (2000, mark(10_000, 3000)),
    20_000: (600, mark(2500, 800)),
}
"""Seconds of virtual time, and times real time that must be reached, by how far targets may lie."""
TURNS = 3
REPEAT = 20_000


def switched_on(model: int) -> FirmwareModule:
    module = FirmwareModule(Board(MODELS[model]), Eeprom(model))
    module.power_on()
    return module


def moving(part: Part, module: FirmwareModule, seconds: float, reach: int = REACH) -> tuple[float, int]:
    """Times real time with three axes that get a new random target as soon as they arrive; number of moves.

    part: what is brought through time, the module itself or the bench that it belongs to
    """
    rng = random.Random(343)
    arrived: list[int] = [0, 1, 2]
    ports = [
        SerialPort(module, lambda data, motor=motor: arrived.append(motor) if data[2] == 128 else None)
        for motor in range(3)
    ]
    moves = 0
    start = process_time()
    while module.now < seconds * HZ:
        while arrived:
            motor = arrived.pop()
            moves += 1
            ports[motor].receive(pack_request(1, Instruction(4, 0, motor, rng.randint(-reach, reach))))
            ports[motor].receive(pack_request(1, Instruction(138, 0, 0, 1 << motor)))
        part.advance(part.next_event())
    return module.now / HZ / (process_time() - start), moves


def resting() -> float:
    """Seconds that an hour at rest costs."""
    module = switched_on(343)
    start = process_time()
    run_until(module, 3600 * HZ)
    return process_time() - start


def telegram(instruction: Instruction, *, in_motion: bool) -> float:
    """Seconds from the bytes of a command to the bytes of its reply."""
    module = switched_on(343)
    port = SerialPort(module, lambda data: None)
    if in_motion:
        for motor in range(3):
            module.execute(Instruction(1, 0, motor, 700 + motor))
        run_until(module, HZ)
    data = pack_request(1, instruction)
    best = 1.0
    for _ in range(3):
        start = process_time()
        for _ in range(REPEAT):
            port.receive(data)
        best = min(best, (process_time() - start) / REPEAT)
    return best


def memory(model: int) -> float:
    """Bytes of one module more, after the first."""
    first = switched_on(model)
    tracemalloc.start()
    before, _ = tracemalloc.get_traced_memory()
    modules = [switched_on(model) for _ in range(10)]
    for module in modules:
        module.execute(Instruction(4, 0, 0, 1000))
        run_until(module, HZ)
    after, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert first.powered
    return (after - before) / len(modules)


def best_moving(model: int, reach: int) -> float:
    """Times real time of three axes that move, the best of some turns."""
    modules = [switched_on(model) for _ in range(TURNS)]
    return max(moving(module, module, MOVING[reach][0], reach)[0] for module in modules)


def main() -> int:
    """Print the figures; status 1 when one misses its mark."""
    print(f"core: {NAME}")
    reached = True
    for reach, (_, least) in MOVING.items():
        for model in MODELS:
            factor = best_moving(model, reach)
            reached &= factor >= least
            print(
                f"{MODELS[model].name}: three axes, random moves within {reach:,} microsteps: {factor:,.0f} times real "
                f"time, must: {least:,.0f}{'' if factor >= least else ' MISSED'}"
            )
    print(f"an hour of rest: {resting() * 1e3:.3f} ms")
    for name, instruction in (
        ("GAP 1 (actual position)", Instruction(6, 1)),
        ("GAP 4 (maximum speed)", Instruction(6, 4)),
        ("GGP 66", Instruction(10, 66)),
        ("SAP 4", Instruction(5, 4, 0, 1000)),
        ("MVP ABS", Instruction(4, 0, 0, 100_000)),
    ):
        rest, motion = (telegram(instruction, in_motion=flag) * 1e6 for flag in (False, True))
        print(f"telegram {name}: {rest:.1f} us at rest, {motion:.1f} us while three axes move")
    for model in MODELS:
        print(f"one more {MODELS[model].name}: {memory(model) / 1024:.0f} KiB")
    print("must:", "reached" if reached else "MISSED")
    return 0 if reached else 1


if __name__ == "__main__":
    sys.exit(main())
