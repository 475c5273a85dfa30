"""How much faster than real time a bench runs.

    python benchmarks/bench_rig.py

Three axes move all the time, with and without switches and loads, driven by commands as a host sends them; then 64
modules on one line are polled in turn, as on a CAN bus of 1 Mbit/s, where a request and its answer take 0.22 ms.
"""

from __future__ import annotations

import sys
import time

from bench_module import moving
from marks import Marks

from tmcm34x.bench import Rig, build, simple_rig
from tmcm34x.bench.description import parse
from tmcm34x.clock import HZ, MS
from tmcm34x.firmware.ports.can import CanPort
from tmcm34x.tmcl.datagram import Instruction

SECONDS = 500
BARE, LOADED = 1000, 500
"""Times real time that must be reached."""
AXIS = """
[[module.axis]]
load = { kind = "carriage", mass_kg = 1, friction_n = 3, low = -401, high = 401, force = [[-400, 0], [0, 20], [80, 0]] }
switch.left = { position = -400.0, hysteresis = 0.05 }
switch.right = { position = 400.0, hysteresis = 0.05 }
switch.reference = { position = 5.0, width = 1.0, hysteresis = 0.05 }
switch.bounce_ms = {bounce}
encoder = { lines = 1000 }
"""


def full(bounce: float = 0.0) -> Rig:
    """A module with three loaded axes, three switches and an encoder on each."""
    axes = AXIS.replace("{bounce}", str(bounce)) * 3
    return build(parse("[[module]]\n" + axes + "[module.spi]\nSPI_SEL0 = { kind = 'tmcm323' }\n"))


def shuttle(rig: Rig) -> float:
    """Send three axes to random places, each to the next as soon as it is there; returns times real time."""
    module = rig.modules[0]
    for motor in range(3):
        module.execute(Instruction(5, 13, motor, 1))  # the reference switch must not stop it
    return moving(rig, module, SECONDS)[0]


def homing(rig: Rig) -> float:
    """Reference searches of three axes at once, again and again; returns times real time."""
    module = rig.modules[0]
    for motor in range(3):
        module.execute(Instruction(5, 193, motor, 3))
    start = time.process_time()
    for _ in range(3):
        for motor in range(3):
            module.execute(Instruction(13, 0, motor))
        while any(axis.search for axis in module.axes):
            rig.advance(rig.next_event())
    return rig.now / HZ / (time.process_time() - start)


def poll(count: int) -> float:
    """Ask modules on one line in turn, all of them moving; returns seconds of work per answer."""
    rig = build(parse("".join(f"[[module]]\naddress = {n}\n" for n in range(count))))
    answers: list[bytes] = []
    ports = [CanPort(module, lambda identifier, data: answers.append(data)) for module in rig.modules]
    for module in rig.modules:
        module.execute(Instruction(1, 0, 0, 100))
    request = bytes((6, 1, 0, 0, 0, 0, 0))
    rounds = 20
    start = time.process_time()
    for _ in range(rounds):
        for n, port in enumerate(ports):
            rig.next_event()
            rig.advance(rig.now + MS * 22 // 100)
            port.receive_frame(n, request)
    took = time.process_time() - start
    assert len(answers) >= rounds
    return took / rounds / count


def main() -> int:
    """Print the figures; status 1 when one misses its mark."""
    marks = Marks()
    bare, loaded, bouncing = (shuttle(rig) for rig in (simple_rig(), full(), full(1.0)))
    marks.at_least("random moves, bare motors", bare, BARE, "times")
    marks.at_least("random moves, switches and loads", loaded, LOADED, "times")
    print(f"  with contacts that bounce          {bouncing:8.0f} x real time")
    print(f"three reference searches at once     {homing(full(1.0)):8.0f} x real time")
    for count in (1, 16, 64):
        print(f"one of {count:2} modules asked and answered {poll(count) * 1e6:6.0f} us")
    return marks.status


if __name__ == "__main__":
    sys.exit(main())
