"""A virtual module for a test, or a whole bench."""

from __future__ import annotations

import itertools
import sys
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeVar

from tmcm34x import clock
from tmcm34x.bench.action import Action
from tmcm34x.bench.session.world import Unit
from tmcm34x.clock import MS, clocks, run_until, seconds
from tmcm34x.links import LinkOpenError
from tmcm34x.links.faults import fault
from tmcm34x.links.faulty import Faults
from tmcm34x.links.timing import VirtualTiming
from tmcm34x.server import Server
from tmcm34x.testing.base import ModuleUnderTest
from tmcm34x.testing.errors import WrongUseError
from tmcm34x.testing.lines import Clockwork, PacedCanLink, PacedLink, VirtualPace
from tmcm34x.testing.rigs import make_rig
from tmcm34x.testing.telegram import Telegram
from tmcm34x.testing.times import Pace, check_pace, check_time
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.global_parameters import CAN_BIT_RATES
from tmcm34x.tmcl.numbers import GP
from tmcm34x.trace.picture import PictureRecorder

if TYPE_CHECKING:
    from tmcm34x.bench.world import AxisView
    from tmcm34x.firmware.storage import Eeprom
    from tmcm34x.host.module import Module as HostModule
    from tmcm34x.links import CanLink, Link, Peer, Send
    from tmcm34x.testing.background import Background
    from tmcm34x.testing.coverage import Counting
    from tmcm34x.testing.history import History
    from tmcm34x.tmcl.telegrams import Direction, Kind
    from tmcm34x.toolchain.assembler import Assembly

Result = TypeVar("Result")
TELEGRAMS: Final = 60
"""Telegrams that are kept for the report of a failed test."""
_LOOK: Final = 10 * MS
_SAMPLES: Final = 512
_POLL_S: Final = 0.002
_NUMBERS: Final = itertools.count(1)
open_modules: Final[dict[str, VirtualModule]] = {}
"""Virtual modules that are open, by name: what `tmcm34x://NAME` reaches."""


class VirtualModule(ModuleUnderTest):
    """A fresh virtual module.

    model: 341, 342 or 343; with a bench, its first module becomes one unless it is None
    bench: path of a bench file, or its text
    pace: "virtual", where time moves on with what the test and the host do (`testing.lines`), or a factor of real
        time: 1 is real time, 10 ten times real time
    seed: of everything random
    eeprom: its memory, a new one unless given
    any_address: whether serial lines take telegrams for any address, as a module does on USB
    Raises `BenchError`.
    """

    real = False

    def __init__(
        self,
        model: int | None = None,
        *,
        bench: str | Path | None = None,
        pace: Pace = "virtual",
        seed: int = 0,
        eeprom: Eeprom | None = None,
        any_address: bool = False,
    ) -> None:
        self._any_address = any_address
        self.rig = make_rig(model, bench, seed, eeprom)
        self.model = self.rig.modules[0].board.model.number
        self.name = f"module-{next(_NUMBERS)}"
        """By which `tmcm34x://NAME` opens it."""
        self.telegrams: deque[Telegram] = deque(maxlen=TELEGRAMS)
        """The last telegrams of all lines."""
        self.picture = PictureRecorder(self.rig, _SAMPLES)
        self._speed = check_pace(pace)
        self._timing = VirtualTiming()
        self._faults = Faults(self._timing, seed)
        self._server = self._make_server()
        self._clockwork = Clockwork(self.rig, self._server, self._timing, self.picture)
        self._pace = VirtualPace(self.rig, self._clockwork)
        self._addresses: dict[str, str] = {}
        self._history: History | None = None
        self._lines = 0
        self._background: Background | None = None
        self._counting: Counting | None = None
        open_modules[self.name] = self
        if self._speed:
            self._start()

    def _make_server(self) -> Server:
        if self._speed:
            return Server(
                self.rig, speed=self._speed, log=self, faults=self._faults, any_address=self._any_address
            )
        server = Server(
            self.rig,
            monotonic=self._virtual_s,
            log=self,
            faults=self._faults,
            any_address=self._any_address,
        )
        server.pace.draw(self.rig.now, paused=True)
        return server

    def _virtual_s(self) -> float:
        return seconds(self.rig.now)

    def write(self, now: float, name: str, direction: Direction, data: bytes, kind: Kind) -> None:
        """Take a telegram for `telegrams`; called by the server."""
        self.telegrams.append(Telegram(int(now), name, direction, data, kind))

    @property
    def speed(self) -> float:
        """Seconds of the module's time in a second of real time, 1 in virtual time."""
        return self._speed or 1.0

    @property
    def real_pace(self) -> bool:
        """Whether time follows the wall clock."""
        return self._speed > 0

    # Exclusive access

    def do(self, work: Callable[[], Result]) -> Result:
        """What `work` returns, called while nothing else works on the bench."""
        if self._background is None:
            return self._exclusively(work)
        return self._background.call(lambda: self._exclusively(work))

    def _exclusively(self, work: Callable[[], Result]) -> Result:
        while not self._server.catch_up():
            pass
        try:
            return work()
        finally:
            self._server.settle()

    def _start(self) -> Background:
        from tmcm34x.testing.background import Background

        if self._background is None:
            self._background = Background()
            self._pace.loop = self._background.loop
            self._background.call(self._server.start)
        return self._background

    def close(self) -> None:
        """Close all lines, and end what worked on them."""
        open_modules.pop(self.name, None)
        self.do(self._end_counting)
        background, self._background = self._background, None
        if background is not None:
            background.await_(self._server.close())
            background.close()

    # Lines

    @property
    def port(self) -> str:
        """A pseudo terminal, for host code that wants a serial port."""
        return self.open_port()

    def open_port(self, link: str | None = None) -> str:
        """A pseudo terminal, under the symbolic link `link` if given.  Raises `links.LinkError`."""
        if sys.platform == "win32":
            raise LinkOpenError("there are no pseudo terminals on this system: use the URL")
        from tmcm34x.links.posix.pty import PtyLink

        return self._open("port", lambda: PtyLink(link))

    @property
    def url(self) -> str:
        """`tcp://HOST:PORT`, for host code that wants a socket."""
        return f"tcp://{self.address}"

    @property
    def address(self) -> str:
        """`HOST:PORT`."""
        from tmcm34x.links.tcp import TcpLink

        return self._open("tcp", lambda: TcpLink("127.0.0.1", 0))

    @property
    def serial_url(self) -> str:
        """What pyserial's `serial_for_url` opens inside this process, in virtual time without any waiting."""
        from tmcm34x.testing.registration import register_url

        register_url()
        return f"tmcm34x://{self.name}"

    @property
    def can(self) -> dict[str, Any]:
        """Arguments for `can.Bus(**module.can)` of python-can."""
        from tmcm34x.links.can import CanBusLink

        if "can" not in self._addresses:
            self._lines += 1
            rate = CAN_BIT_RATES[self.rig.modules[0].eeprom.global_values[GP.CAN_BIT_RATE]]
            link: CanLink = CanBusLink("virtual", self.name, rate)
            paced = link if self._speed else PacedCanLink(link, self._pace)
            self._addresses["can"] = self._start().await_(self._server.open_can(paced))
        return {"interface": "virtual", "channel": self.name}

    def _open(self, kind: str, make_link: Callable[[], Link]) -> str:
        if kind not in self._addresses:
            self._lines += 1
            link = make_link()
            paced = link if self._speed else PacedLink(link, self._pace)
            self._addresses[kind] = self._start().await_(self._server.open(paced))
        return self._addresses[kind]

    def connect_line(self, name: str, send: Send) -> Peer:
        """One more line inside this process: the module's end of it."""
        self._lines += 1
        return self._pace.wrap(self._faults.wrap(self._server.connect))(name, send)

    def connect(self) -> HostModule:
        """The module through this project's host library, on a line inside this process."""
        from tmcm34x.bench.in_process import InProcessLine
        from tmcm34x.host import Connection
        from tmcm34x.host.module import Module as HostModule

        return HostModule(Connection(InProcessLine(self, self.name)))

    # Time

    @property
    def now(self) -> float:
        """The module's time [s]."""
        return self.do(lambda: seconds(self.rig.now))

    def run(self, seconds: float) -> None:
        """Let `seconds` of the module's time pass."""
        check_time(seconds)
        if self._speed:
            time.sleep(seconds / self._speed)
        else:
            self.do(lambda: run_until(self._clockwork, self.rig.now + clocks(seconds)))

    def run_until(self, holds: Callable[[], Any], timeout: float, *, events_only: bool = False) -> bool:
        """Let time pass until `holds`, or the time is over.

        events_only: look at events alone, not every 10 ms too; for what only events change
        """
        check_time(timeout)
        if self._speed:
            return self._wait_until(holds, timeout)
        look = clock.NEVER if events_only else _LOOK
        until = self.rig.now + clocks(timeout)
        if self._background is None:
            return self._clockwork.search(holds, until, look)
        while not holds():
            if self.do(lambda: self.rig.now) >= until:
                return False
            self.do(lambda: self._clockwork.go_on(until, look))
        return True

    def _wait_until(self, holds: Callable[[], Any], timeout: float) -> bool:
        end_s = time.monotonic() + timeout / self._speed
        while not holds():
            if time.monotonic() >= end_s:
                return False
            time.sleep(_POLL_S)
        return True

    # The module

    def execute(self, instruction: Instruction, module: int = 0) -> tuple[int, int]:
        """Execute a command beside the line; status and value of its reply."""
        return self.do(lambda: self._execute(instruction, module))

    def _execute(self, instruction: Instruction, module: int) -> tuple[int, int]:
        answer = self.rig.modules[module].execute(instruction)
        if self._history is not None:
            self._history.kept.record("command", module, tuple(instruction))
        return answer

    def ask(self, instruction: Instruction, module: int = 0) -> tuple[int, int]:
        """Status and value that a reading command gives, without any other effect."""
        return self.do(lambda: self.rig.modules[module].peek(instruction))

    def load(self, source: str | Path, *, run: bool = False) -> None:
        """Put a TMCL program, as source text or as a path, into the program memory, and perhaps start it.

        Raises `ValueError` with the diagnostics of a program that cannot be assembled.
        """
        from tmcm34x.testing.programs import assemble_source

        assembly = assemble_source(source, self.model)
        self.do(lambda: self._store(source, assembly, run))

    def covers(self, source: Path) -> None:
        """Count for `pytest --tmcl-coverage` what the module executes of a program that a host brings into its memory.

        source: of that program, whose instructions must be in the memory when the module is closed
        Raises `ValueError` with the diagnostics of a program that cannot be assembled.
        """
        from tmcm34x.testing.programs import assemble_source

        assembly = assemble_source(source, self.model)
        self.do(lambda: self._count(source, assembly))

    def _count(self, source: str | Path, assembly: Assembly) -> None:
        from tmcm34x.testing.programs import counting_of

        self._end_counting()
        self._counting = counting_of(source, self.rig.modules[0], assembly)

    def _end_counting(self) -> None:
        counting, self._counting = self._counting, None
        if counting is not None:
            counting.end()

    def _store(self, source: str | Path, assembly: Assembly, run: bool) -> None:
        module = self.rig.modules[0]
        self._end_counting()
        module.eeprom.write_program(assembly.program)
        self._count(source, assembly)
        if run:
            module.program.run(0)
        if self._history is not None:
            self._history.kept.record("program", 0, (tuple(map(tuple, assembly.program)), run))

    # The bench

    @property
    def unit(self) -> Unit:
        """The first module on its bench."""
        return Unit(self.rig)

    def view(self, motor: int, module: int = 0) -> AxisView:
        """An axis as an onlooker sees it."""
        return self.do(self.rig.worlds[module].mounts[motor].view)

    def act(self, name: str, *operands: Any, module: int = 0) -> None:
        """Do one of the actions of a bench (`bench.action.ACTIONS`).  Raises `ActionError`."""
        self.do(lambda: self.rig.act(Action(name, module, operands)))

    def fault(self, name: str, value: float | None = None, **options: Any) -> None:
        """Put a fault of the line in force.  Raises `FaultError`."""
        made = fault(name, value, **options)
        self.do(lambda: self._faults.add(made))

    def clear_faults(self, name: str | None = None) -> None:
        """End the faults of the line that have this name, or all.  Raises `FaultError`."""
        self.do(lambda: self._faults.clear(name))

    @property
    def history(self) -> History:
        """The past from when this is first asked for, which must be before lines are opened; in virtual time only.

        Raises `ValueError` otherwise.
        """
        if self._history is None:
            self._history = self._begin_history()
        return self._history

    def _begin_history(self) -> History:
        from tmcm34x.testing.history import History

        if self._speed:
            raise WrongUseError('time goes back in virtual time only: leave pace at "virtual"')
        if self._lines:
            raise WrongUseError(
                "use the history before the module's lines are opened: it records their telegrams"
            )
        history = History(self.rig)
        history.access, history.time, history.on_return = self.do, self._clockwork, self._brought_back
        self._clockwork.part = self._server.part = history.kept
        self._server.recorder = history.kept
        return history

    def snapshot(self) -> bytes:
        """The whole state of the bench."""
        return self.do(self.rig.snapshot)

    def restore(self, snapshot: bytes) -> None:
        """Go back to a state.  Raises `SnapshotError` for one of another bench."""
        self.do(lambda: self._restore(snapshot))

    def _restore(self, snapshot: bytes) -> None:
        self.rig.restore(snapshot)
        self._brought_back()

    def _brought_back(self) -> None:
        self._timing.now = self.rig.now
        self._server.pace.draw(self.rig.now)
