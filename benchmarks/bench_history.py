"""Going back: what recording costs, and how long steps and runs back take after an hour of simulated motion.

Must: 50 ms for each step back, 1 s for ten simulated minutes back, 64 MiB, and recording at most 5 % of the time
without.

python benchmarks/bench_history.py
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from statistics import median
from time import process_time

from marks import Marks

from tmcm34x.bench import Rig, load, simple_rig
from tmcm34x.clock import HZ, Timed
from tmcm34x.debug.control import Breakpoint
from tmcm34x.debug.history import History
from tmcm34x.debug.sessions.base import SourceMap
from tmcm34x.debug.sessions.bench import BenchSession
from tmcm34x.links import Peer
from tmcm34x.server import Server
from tmcm34x.tmcl.datagram import pack_request
from tmcm34x.tmcl.mnemonic import parse_instruction
from tmcm34x.toolchain.assembler import Assembly, assemble

EXAMPLES = Path(__file__).parents[1] / "examples"
STAGE = """\
Loop:   MVP   ABS, 0, 20000
        MVP   ABS, 1, 8000
        WAIT  POS, 0, 0
        WAIT  POS, 1, 0
        SIO   1, 2, 1
        WAIT  TICKS, 0, 10
        SIO   1, 2, 0
        GGP   3, 2
        CALC  ADD, 1
        AGP   3, 2
        MVP   ABS, 0, 0
        MVP   ABS, 1, 0
        WAIT  POS, 0, 0
        JA    Loop
"""
FIRST = (EXAMPLES / "manual" / "5.2-first-program.tmc").read_text()
PROGRAMS = (("the manual's first program", FIRST, None), ("an XY stage", STAGE, "xy-stage.toml"))
HOUR = 3600 * HZ
ROUNDS, STRETCHES, STRETCH = 9, 10, 60 * HZ


class Silent:
    """A listener that does nothing."""

    def held(self, stop: object) -> None:
        """The program is held."""

    def ended(self) -> None:
        """The program has ended."""

    def said(self, text: str, address: int) -> None:
        """A log point was passed."""


def builder(assembly: Assembly, bench: str | None) -> Callable[[], Rig]:
    def build() -> Rig:
        rig = simple_rig() if bench is None else load(EXAMPLES / "benches" / bench)
        rig.modules[0].eeprom.write_program(assembly.program)
        return rig

    return build


def run(time: Timed, until: int) -> float:
    start = process_time()
    while (when := time.next_event()) <= until:
        time.advance(when)
    time.advance(until)
    return process_time() - start


def recording(build: Callable[[], Rig]) -> float:
    """Time with a history over time without.

    Both run the same stretches in turn, several times over; of each stretch the least time counts, so that other work
    on the machine does not.  A stretch has several snapshots in it.
    """
    plain, recorded = zip(*(stretches(build, n % 2) for n in range(ROUNDS)), strict=True)
    return sum(map(min, zip(*recorded, strict=True))) / sum(map(min, zip(*plain, strict=True)))


def stretches(build: Callable[[], Rig], first: int) -> tuple[list[float], list[float]]:
    """The times of the stretches without and with a history; which of both goes first changes."""
    rigs = build(), build()
    sides: tuple[Timed, Timed] = rigs[0], History(rigs[1])
    for rig in rigs:
        rig.modules[0].program.run()
    times: tuple[list[float], list[float]] = [], []
    for n in range(STRETCHES):
        for side in (0, 1) if (n + first) % 2 else (1, 0):
            times[side].append(run(sides[side], (n + 1) * STRETCH))
    return times


def served_us() -> tuple[float, float]:
    """Processor time of a telegram on a line of a server without and with a history, as medians of pairs in turn."""
    plain, recorded = line(False), line(True)
    pairs = [(telegrams_us(plain), telegrams_us(recorded)) for _ in range(25)]
    return median(alone for alone, _ in pairs), median(kept for _, kept in pairs)


def line(recorded: bool) -> Peer:
    """The module's end of a line, while three motors turn."""
    server = Server(simple_rig())
    for motor in range(3):
        server.rig.modules[0].execute(parse_instruction(f"ROR {motor}, 500"))
    if recorded:
        server.part = server.recorder = History(server.rig)
    return server.connect("host", lambda _: None)


def telegrams_us(peer: Peer, count: int = 4000) -> float:
    telegram = pack_request(1, parse_instruction("GAP 1, 0"))
    start = process_time()
    for _ in range(count):
        peer.receive(telegram)
    return 1e6 * (process_time() - start) / count


def timed_ms(do: Callable[[], object]) -> float:
    start = process_time()
    do()
    return 1000 * (process_time() - start)


def going_back(session: BenchSession, marks: Marks) -> None:
    history = session.history
    assert history is not None
    steps = [timed_ms(lambda: session.step_back(over=False)) for _ in range(20)]
    print(f"  step back after an hour: median {median(steps):.0f} ms")
    marks.at_most("  step back after an hour, the slowest", max(steps), 50, "ms")
    address = session.text.assembly.labels["Loop"]
    session.set_breakpoints([Breakpoint.make(1, address, condition=f"time_ms < {(3600 - 600) * 1000}")])
    marks.at_most(
        "  ten simulated minutes back to a breakpoint", timed_ms(session.reverse_continue), 1000, "ms"
    )
    history.return_to(history.branch.end)
    looks = [timed_ms(lambda n=n: history.look_at(HOUR - n * 5 * HZ)) for n in range(0, 120, 7)]
    print(f"  any moment of the last ten minutes: median {median(looks):.0f} ms, worst {max(looks):.0f} ms")
    marks.at_most(f"  {len(history.branch.snapshots)} snapshots", history.memory / 2**20, 64, "MiB")


def main() -> int:
    """Print the figures; status 1 when one misses its mark."""
    marks = Marks()
    alone, kept = served_us()
    print(f"a telegram on a line: {alone:.1f} us, with a history {kept:.1f} us")
    for name, source, bench in PROGRAMS:
        assembly = assemble(source)
        assert assembly.ok
        build = builder(assembly, bench)
        print(name)
        marks.at_most("  recording, of the time without", 100 * (recording(build) - 1), 5, "%")
        session = BenchSession(build(), Silent(), SourceMap(assembly), keeps_history=True)
        session.start(hold=False)
        session.advance(HOUR)
        session.pause()
        going_back(session, marks)
    return marks.status


if __name__ == "__main__":
    sys.exit(main())
