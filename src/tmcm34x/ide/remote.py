"""The IDE's module when it is a real one, on a serial port or behind a socket.

One thread talks on the line, one command at a time.  Between the commands of pages it polls what pages show: the
motion of each motor in every round, one other value a round.  Nothing is polled while no page looks.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import cycle
from typing import TYPE_CHECKING, Final, NamedTuple

from tmcm34x import clock
from tmcm34x.board.models import MODELS
from tmcm34x.debug.sessions.base import Listener
from tmcm34x.debug.sessions.remote import RemoteSession
from tmcm34x.host.connection import Connection
from tmcm34x.host.effects import moves
from tmcm34x.host.exceptions import GarbledReplyError, LinkError, ReplyError
from tmcm34x.ide import wire
from tmcm34x.ide.exchange import FACTORY_RESET, VERSION, answered, unanswered
from tmcm34x.ide.state import State, bits, empty, put
from tmcm34x.tmcl.axis_parameters import BY_KEY as AXIS_BY_KEY
from tmcm34x.tmcl.commands import BY_MNEMONIC, MOTORS
from tmcm34x.tmcl.datagram import Instruction, pack_request
from tmcm34x.tmcl.global_parameters import BY_KEY as GLOBAL_BY_KEY
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.ide.target import T, Tell
    from tmcm34x.ide.telegrams import Telegrams

TIMEOUT_S: Final = 0.5
RETRY_S: Final = 1.0
"""Between two attempts to find a lost module."""
LOOKED_AT_S: Final = 3.0
"""A page that asked for state less than this ago is looking."""
PATIENCE: Final = 3
"""Commands in a row without an answer until the module counts as lost."""
COORDINATE_BANK: Final = -2
POLL: Final = "poll"

_NEVER: Final = frozenset({
    Status.INVALID_COMMAND, Status.WRONG_TYPE, Status.INVALID_VALUE, Status.NOT_AVAILABLE,
})  # fmt: skip
"""Answers that will be the same next time."""
_GAP: Final = BY_MNEMONIC["GAP"].number
_GGP: Final = BY_MNEMONIC["GGP"].number
_GIO: Final = BY_MNEMONIC["GIO"].number
_GCO: Final = BY_MNEMONIC["GCO"].number
_RFS: Final = BY_MNEMONIC["RFS"].number
_RFS_STATUS: Final = 2
_ALL_PORTS: Final = 255
_SHUTDOWN_PORT: Final = 10


class Reading(NamedTuple):
    """A value that is polled, and the command that reads it."""

    key: str
    motor: int
    command: Instruction


def _axis(key: str, motor: int) -> Reading:
    return Reading(key, motor, Instruction(_GAP, AXIS_BY_KEY[key].number, motor))


_FAST: Final = tuple(
    _axis(key, motor) for motor in range(MOTORS) for key in ("actual_position", "actual_speed")
)
_SLOW: Final = (
    *(
        _axis(key, motor)
        for key in (
            "target_position", "target_speed", "position_reached", "left_switch", "right_switch", "load_value",
            "actual_acceleration", "ramp_mode", "driver_error_flags", "encoder_position", "microstep_resolution",
            "left_switch_disable", "right_switch_disable", "max_current", "standby_current",
        )
        for motor in range(MOTORS)
    ),
    *(Reading("search", motor, Instruction(_RFS, _RFS_STATUS, motor)) for motor in range(MOTORS)),
    Reading("state", 0, Instruction(_GGP, GLOBAL_BY_KEY["application_status"].number)),
    Reading("counter", 0, Instruction(_GGP, GLOBAL_BY_KEY["program_counter"].number)),
    Reading("inputs", 0, Instruction(_GIO, _ALL_PORTS, 0)),
    Reading("outputs", 0, Instruction(_GIO, _ALL_PORTS, 2)),
    Reading("shutdown", 0, Instruction(_GIO, _SHUTDOWN_PORT, 0)),
    *(Reading("analog", port, Instruction(_GIO, port, 1)) for port in range(8)),
)  # fmt: skip


class Remote:
    """The module at `address` on the line `url`.

    Opens the line at once; raises `LinkError`.
    """

    def __init__(self, url: str, baud: int, address: int, telegrams: Telegrams) -> None:
        self.source: wire.Source = "tcp" if url.startswith("tcp://") or ":" in url else "serial"
        self.place = f"{url}, address {address}"
        self.ability = wire.Ability(bench=False, debug=False, peek=False, language_server=True)
        self._url = url
        self._baud = baud
        self._address = address
        self._telegrams = telegrams
        self._tell: Tell = lambda event: None
        self._thread = ThreadPoolExecutor(1, "line")
        self._task: asyncio.Task[None] | None = None
        self._start_s = time.monotonic()
        self._looked_s = -math.inf
        self._silent = 0
        self._up = True
        self._hushed = False
        self._link = POLL
        self._urgencies = 0
        """How often something urgent was sent: what was queued before may not be."""
        self.line = 0
        self._values: dict[tuple[str, int], int] = {}
        self._refused: set[Instruction] = set()
        self._watches: list[wire.Watched] = []
        self._watched: dict[Instruction, int] = {}
        self._connection: Connection | None = self._open_line()
        self.model = MODELS[self._model_number()]

    def _open_line(self) -> Connection:
        connection = Connection.open(self._url, baud=self._baud, address=self._address, timeout=TIMEOUT_S)
        connection.listeners.append(self._note)
        return connection

    def _model_number(self) -> int:
        """What the module says it is; a TMCM-343 while it says nothing."""
        assert self._connection is not None
        try:
            number = int(self._connection.version()[:3])
        except (ReplyError, ValueError):
            self._silent = PATIENCE
            self._up = False
            return 343
        return number if number in MODELS else 343

    async def open(self, tell: Tell) -> None:
        """Begin to poll."""
        self._tell = tell
        self._task = asyncio.create_task(self._poll())

    async def close(self) -> None:
        """Hang up."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)
        self._thread.shutdown(wait=True, cancel_futures=True)
        if self._connection is not None:
            self._connection.close()

    @property
    def link(self) -> wire.Link:
        """How the line is."""
        if self._up:
            return wire.Link(True, "")
        if self._connection is None:
            return wire.Link(False, f"The line {self.place} is gone; the IDE looks for it.")
        return wire.Link(False, f"No answer at {self.place}: check power, wiring, address and bit rate.")

    # Talking

    async def exchange(self, instruction: Instruction) -> wire.Exchange:
        """Send a command and wait for its answer."""
        return await asyncio.get_running_loop().run_in_executor(
            self._thread, self._exchange, instruction, "IDE", self._urgencies
        )

    def urgent(self, instructions: Sequence[Instruction]) -> None:
        """Write commands to the line from here, while its thread may be waiting for an answer."""
        self._urgencies += 1
        connection = self._connection
        if connection is None:
            return
        self._link = "IDE"
        with contextlib.suppress(LinkError):
            connection.urgent(instructions)

    def _exchange(self, instruction: Instruction, link: str, urgencies: int | None = None) -> wire.Exchange:
        sent = pack_request(self._address, instruction)
        if urgencies not in {None, self._urgencies} and (self._hushed or moves(instruction)):
            return unanswered(instruction, sent, "not sent: STOP ALL came first")
        connection = self._connection
        if connection is None:
            return unanswered(instruction, sent, "no answer: the line is gone")
        self._link = link
        try:
            if instruction.number == FACTORY_RESET:
                connection.send(instruction)
                return unanswered(instruction, sent, "sent: this command is never answered")
            received = connection.ask(instruction, retries=0).telegram
        except GarbledReplyError as error:
            return unanswered(instruction, sent, f"no whole answer: {error}")
        except ReplyError:
            self._silent += 1
            return unanswered(instruction, sent, "no answer in time")
        except LinkError as error:
            self._lose()
            return unanswered(instruction, sent, str(error))
        self._silent = 0
        return answered(instruction, sent, received)

    def _note(self, sent: bool, data: bytes) -> None:
        if self._link != POLL or self._telegrams.polls_wanted:
            self._telegrams.write(self.now, self._link, ">" if sent else "<", data)

    def _lose(self) -> None:
        if self._connection is not None:
            self._connection.close()
            self._connection = None

    @property
    def now(self) -> float:
        """Time since the IDE was started."""
        return (time.monotonic() - self._start_s) * clock.HZ

    # The debugger

    def session(self, listener: Listener) -> RemoteSession:
        """Run control of the module's program, as far as its firmware has it.  Raises `HostError`."""
        if self._connection is None:
            raise LinkError("the line is gone")
        return RemoteSession(self._connection, listener)

    async def debug(self, work: Callable[[], T], *, polling: bool = False) -> T:
        """Do something with the session in the thread that has the line."""

        def linked() -> T:
            self._link = POLL if polling else "IDE"
            return work()

        return await asyncio.get_running_loop().run_in_executor(self._thread, linked)

    async def read(self, items: Sequence[wire.Watched]) -> list[int | None]:
        """Values of parameters and coordinates."""
        values: list[int | None] = []
        for item in items:
            command = _command(item)
            if command is None or not self._up or self._hushed:
                values.append(None)
                continue
            values.append(await self._value(command))
        return values

    async def _value(self, command: Instruction) -> int | None:
        exchange = await asyncio.get_running_loop().run_in_executor(
            self._thread, self._exchange, command, POLL
        )
        return exchange.value if exchange.status == Status.OK else None

    # Polling

    def hush(self, on: bool) -> None:
        """Poll nothing while a program is being downloaded."""
        self._hushed = on

    async def _poll(self) -> None:
        slow = cycle(_SLOW)
        while True:
            self._tell_link()
            if self._connection is None:
                await self._find()
            elif self._silent >= PATIENCE:
                await asyncio.sleep(RETRY_S)
                await self._value(Instruction(VERSION, 1))
            elif self._hushed or time.monotonic() - self._looked_s > LOOKED_AT_S:
                await asyncio.sleep(0.1)
            else:
                await self._round(slow)

    async def _round(self, slow: cycle[Reading]) -> None:
        """All of the motion, what pages watch, and a little of the rest."""
        started = time.monotonic()
        for reading in _FAST:
            await self._take(reading)
        for item in tuple(self._watches):
            command = _command(item)
            if command is not None and not self._hushed:
                self._watched[command] = await self._value(command) or 0
        for _ in range(3):
            await self._take(next(slow))
        await asyncio.sleep(max(0.0, 1 / 60 - (time.monotonic() - started)))

    async def _take(self, reading: Reading) -> None:
        if reading.command in self._refused or self._hushed or self._silent >= PATIENCE:
            return
        exchange = await asyncio.get_running_loop().run_in_executor(
            self._thread, self._exchange, reading.command, POLL
        )
        if exchange.status == Status.OK:
            self._values[reading.key, reading.motor] = exchange.value
        elif exchange.status in _NEVER:
            self._refused.add(reading.command)

    async def _find(self) -> None:
        await asyncio.sleep(RETRY_S)
        try:
            self._connection = await asyncio.get_running_loop().run_in_executor(self._thread, self._open_line)
        except LinkError:
            return
        self.line += 1
        self._silent = 0

    def _tell_link(self) -> None:
        up = self._connection is not None and self._silent < PATIENCE
        if up != self._up:
            self._up = up
            self._tell(self.link)

    def watch(self, items: Sequence[wire.Watched]) -> None:
        """Poll these too."""
        self._watches = list(dict.fromkeys(items))

    def watched(self, items: Sequence[wire.Watched]) -> list[int]:
        """The values as last polled."""
        commands = [_command(item) for item in items]
        return [0 if command is None else self._watched.get(command, 0) for command in commands]

    # State

    def state(self) -> State:
        """Everything as last polled."""
        self._looked_s = time.monotonic()
        state = empty()
        value = self._values.get
        put(
            state,
            "time",
            self.now,
            1.0,
            1.0,
            bits(False, self._silent < PATIENCE, self._connection is not None),
        )
        put(state, "program", value(("state", 0), 0) & 3, 0, 0, value(("counter", 0), 0) & 0xFFFF, 0, 0, 0)
        for motor in range(MOTORS):
            self._put_motor(state, motor)
        levels = (value(("analog", port), 0) & 0xFFFF for port in range(8))
        put(
            state, "board", *(value((key, 0), 0) & 0xFF for key in ("inputs", "outputs", "shutdown")), *levels
        )
        return state

    def _put_motor(self, state: State, motor: int) -> None:
        def value(key: str) -> int:
            return self._values.get((key, motor), 0)

        speed, resolution = value("actual_speed"), value("microstep_resolution") & 7
        left, right = value("left_switch") != 0, value("right_switch") != 0
        flags = bits(
            left, right, left, value("position_reached") != 0, value("left_switch_disable") != 0,
            value("right_switch_disable") != 0, True, False,
        )  # fmt: skip
        turn = FULLSTEPS << resolution
        put(
            state, f"motor{motor}", value("actual_position"), value("target_position"), _short(speed),
            _short(value("target_speed")), _short(value("actual_acceleration")), value("encoder_position"), flags,
            value("load_value") & 7, value("driver_error_flags") & 0xFF,
            value("max_current" if speed else "standby_current") & 0xFF, value("ramp_mode") & 3, value("search") & 0xFF,
            resolution, value("actual_position") % turn / turn * 2 * math.pi, 0, 0.0, 0.0,
        )  # fmt: skip


FULLSTEPS: Final = 200
"""Of a turn, for the dials: the usual motor."""


def _command(item: wire.Watched) -> Instruction | None:
    if not (0 <= item.number <= 255 and 0 <= item.motor <= 255 and -2 <= item.bank <= 255):
        return None
    if item.bank == COORDINATE_BANK:
        return Instruction(_GCO, item.number, item.motor)
    return (
        Instruction(_GAP, item.number, item.motor)
        if item.bank < 0
        else Instruction(_GGP, item.number, item.bank)
    )


def _short(value: int) -> int:
    return max(-32768, min(32767, value))
