"""Sessions and modules for tests.

    python benchmarks/bench_sessions.py

Lines of a session in virtual time; setting up a fresh module for a test; a reference search of twenty simulated
seconds as a test writes it; polling a module over a line inside the process, and over a pseudo terminal.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

import serial
from marks import Marks

from tmcm34x.bench.session.language import parse
from tmcm34x.bench.session.runner import make_rig, play
from tmcm34x.bench.session.wires import MemorySerial
from tmcm34x.testing import VirtualModule
from tmcm34x.tmcl.datagram import pack_request
from tmcm34x.tmcl.mnemonic import parse_instruction

LINES = 10_000
"""Session lines a second that must be reached."""
SETUP_MS = 5.0
HOMING_MS = 60.0
BENCH = """
[[module]]
[[module.axis]]
load = { kind = "carriage", start = 100.0, low = -5, high = 205 }
switch.left = { position = 0.0 }
switch.right = { position = 200.0 }
"""


def best(work: Callable[[], float], rounds: int = 5) -> float:
    """The least of several."""
    return min(work() for _ in range(rounds))


def session_lines() -> float:
    """Lines of a conversation a second."""
    pairs = "> SAP 4, 0, 500\n< 100 500\n> GAP 4, 0\n< 100 500\n> GGP 66, 0\n< 100 1\n+ 1 ms\n" * 1000
    (case,) = parse("== a conversation\n" + pairs)
    wire = MemorySerial(make_rig(case, 343))
    start = time.process_time()
    play(case, wire, 343)
    return len(case.steps) / (time.process_time() - start)


def setup() -> float:
    """Seconds that a fresh module takes, opened and closed."""
    start = time.process_time()
    with VirtualModule(343):
        pass
    return time.process_time() - start


def homing() -> float:
    """Seconds of work that a reference search takes, with the set-up of its bench; twenty seconds are simulated."""
    start = time.process_time()
    with VirtualModule(343, bench=BENCH) as module:
        module.motor(0).reference_search_speed = 0
        module.command("RFS START, 0")
        module.until("RFS STATUS, 0 is 100 0")
        assert module.motor(0).position == 0
        module.run(max(0.0, 20 - module.now))
        assert module.now >= 20
    return time.process_time() - start


def polling(line: str) -> float:
    """Seconds for a request and its reply."""
    request = pack_request(1, parse_instruction("GAP 1, 0"))
    with VirtualModule(343) as module, serial.serial_for_url(getattr(module, line), timeout=5) as port:
        start = time.perf_counter()
        for _ in range(500):
            port.write(request)
            assert len(port.read(9)) == 9
        return (time.perf_counter() - start) / 500


def main() -> int:
    """Print the figures; status 1 when one misses its mark."""
    marks = Marks()
    home = best(homing) * 1e3
    marks.at_least("session lines in virtual time", max(session_lines() for _ in range(3)), LINES, "/ s")
    marks.at_most("a fresh module for a test", best(setup) * 1e3, SETUP_MS, "ms")
    marks.at_most("homing, 20 simulated seconds", home, HOMING_MS, "ms")
    print(f"  that is {20e3 / home:.0f} x real time")
    print(f"request and reply inside the process  {best(lambda: polling('serial_url')) * 1e6:8.0f} us")
    print(f"request and reply, pseudo terminal    {best(lambda: polling('port')) * 1e6:8.0f} us")
    return marks.status


if __name__ == "__main__":
    sys.exit(main())
