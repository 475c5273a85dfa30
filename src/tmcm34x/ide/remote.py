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
from typing import TYPE_CHECKING, Final

from tmcm34x import clock
from tmcm34x.board.models import MODELS
from tmcm34x.debug.sessions.base import Listener
from tmcm34x.debug.sessions.remote import RemoteSession
from tmcm34x.host.connection import Connection
from tmcm34x.host.effects import moves
from tmcm34x.host.exceptions import GarbledReplyError, LinkError, ReplyError
from tmcm34x.host.steps import Follow
from tmcm34x.ide import wire
from tmcm34x.ide.exchange import ASCII_MODE, FACTORY_RESET, VERSION, answered, unanswered
from tmcm34x.ide.polled import pack, put_held
from tmcm34x.ide.readings import FAST, SLOW, Reading, column_of, command_of
from tmcm34x.ide.sampling import Samples
from tmcm34x.ide.state import State
from tmcm34x.ide.terminal import Terminal, motors_of
from tmcm34x.tmcl.commands import BY_MNEMONIC
from tmcm34x.tmcl.datagram import Instruction, Reply, pack_request
from tmcm34x.tmcl.global_parameters import BAUD_RATES
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
POLL: Final = "poll"

_NEVER: Final = frozenset({
    Status.INVALID_COMMAND, Status.WRONG_TYPE, Status.INVALID_VALUE, Status.NOT_AVAILABLE,
})  # fmt: skip
"""Answers that will be the same next time."""
_SGP: Final = BY_MNEMONIC["SGP"].number
_ADDRESS: Final = GLOBAL_BY_KEY["serial_address"].number
_BAUD: Final = GLOBAL_BY_KEY["baud_rate"].number


class Remote:
    """The module at `address` on the line `url`.

    Opens the line at once; raises `LinkError`.
    """

    def __init__(self, url: str, baud: int, address: int, telegrams: Telegrams) -> None:
        self.source: wire.Source = "tcp" if url.startswith("tcp://") or ":" in url else "serial"
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
        self._moved = False
        """Address or bit rate were changed: pages do not know it yet."""
        self._link = POLL
        self._urgencies = 0
        """How often something urgent was sent: what was queued before may not be."""
        self.line = 0
        self._values: dict[tuple[str, int], int] = {}
        self._refused: set[Instruction] = set()
        self._watches: list[wire.Watched] = []
        self._watched: dict[Instruction, int | None] = {}
        self._terminal = Terminal()
        self._session: RemoteSession | None = None
        self.samples = Samples()
        self._seen = 0.0
        """When the module last sent a value [clocks]."""
        self._connection: Connection | None = self._open_line()
        self.model, self.known = MODELS[343], False
        self._take_model(self._identify())

    @property
    def place(self) -> str:
        """Port, bit rate where there is one, and address."""
        rate = f", {self._baud} baud" if self.source == "serial" else ""
        return f"{self._url}{rate}, address {self._address}"

    def _open_line(self) -> Connection:
        connection = Connection.open(self._url, baud=self._baud, address=self._address, timeout=TIMEOUT_S)
        connection.listeners.append(self._note)
        return connection

    def _identify(self) -> str:
        """What the module says it is, such as `343V4.36`; empty while it says nothing."""
        assert self._connection is not None
        try:
            return self._connection.version()
        except (ReplyError, ValueError):
            self._silent = PATIENCE
            self._up = False
            return ""

    def _take_model(self, version: str) -> None:
        number = int(version[:3]) if version[:3].isdecimal() else 0
        self.known = number in MODELS
        if self.known:
            self.model = MODELS[number]

    async def open(self, tell: Tell) -> None:
        """Begin to poll."""
        self._tell = tell
        self._loop = asyncio.get_running_loop()
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
        if self._terminal.on:
            text = "The module speaks its ASCII interface, which executes no binary commands."
            return wire.Link(False, text, self.place, True)
        if self._up:
            return wire.Link(True, "", self.place, False)
        if self._connection is None:
            return wire.Link(
                False, f"The line {self.place} is gone; the IDE looks for it.", self.place, False
            )
        text = f"No answer at {self.place}: check power, wiring, address and bit rate."
        return wire.Link(False, text, self.place, False)

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
        leave = self._terminal.leave(self._address)
        with contextlib.suppress(LinkError):
            connection.line.write(leave)
            connection.urgent(instructions)

    def _exchange(self, instruction: Instruction, link: str, urgencies: int | None = None) -> wire.Exchange:
        sent = pack_request(self._address, instruction)
        if urgencies not in {None, self._urgencies} and (self._hushed or moves(instruction)):
            return unanswered(instruction, sent, "not sent: STOP ALL came first")
        connection = self._connection
        if connection is None:
            return unanswered(instruction, sent, "no answer: the line is gone")
        if self._terminal.on:
            return unanswered(instruction, sent, "not sent: the module speaks its ASCII interface")
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
        exchange = answered(instruction, sent, received)
        if exchange.status == Status.OK:
            self._follow(instruction, connection)
        while connection.events:
            self._second(connection.events.popleft())
        return exchange

    def _second(self, reply: Reply) -> None:
        """Tell of a second reply of command 138."""
        happened = wire.Happened(self.now, "target", -1, f"targets reached: motors {motors_of(reply.value)}")
        self._loop.call_soon_threadsafe(self._tell, happened)

    async def send_ascii(self, line: str) -> str:
        """Send a line to the ASCII interface; what came back."""
        connection = self._connection
        if connection is None:
            raise wire.RefusalError("line", "The line is gone.")
        return await asyncio.get_running_loop().run_in_executor(
            self._thread, self._terminal.send, connection, self._address, line
        )

    def _follow(self, instruction: Instruction, connection: Connection) -> None:
        """Go on at the address or bit rate that the module has from its next command on."""
        match (instruction.number, instruction.type, instruction.motor):
            case (number, kind, 0) if number == _SGP and kind == _ADDRESS:
                self._address = instruction.value
                connection.perform(Follow(address=self._address))
            case (number, kind, 0) if number == _SGP and kind == _BAUD and self.source == "serial":
                self._baud = BAUD_RATES[instruction.value]
                connection.perform(Follow(baud=self._baud))
            case (number, _, _) if number == ASCII_MODE:
                self._terminal.on = True
            case _:
                return
        self._moved = True

    def _note(self, sent: bool, data: bytes) -> None:
        if self._link != POLL or self._telegrams.polls_wanted:
            self._telegrams.write(self.now, self._link, ">" if sent else "<", data)

    def _lose(self) -> None:
        if self._connection is not None:
            self._connection.close()
            self._connection = self._session = None

    @property
    def now(self) -> float:
        """Time since the IDE was started."""
        return (time.monotonic() - self._start_s) * clock.HZ

    # The debugger

    def session(self, listener: Listener) -> RemoteSession:
        """Run control of the module's program, as far as its firmware has it.  Raises `HostError`."""
        if self._connection is None:
            raise LinkError("the line is gone")
        self._session = RemoteSession(self._connection, listener)
        return self._session

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
            command = command_of(item)
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
        self.samples.gap(self.now, self._watches)

    async def _poll(self) -> None:
        slow = cycle(SLOW)
        while True:
            self._tell_link()
            if self._connection is None:
                self._terminal.on = False
                await self._find()
            elif self._terminal.on:
                await asyncio.sleep(0.1)
            elif self._silent >= PATIENCE:
                await asyncio.sleep(RETRY_S)
                await self._ask_version()
            elif self._hushed or time.monotonic() - self._looked_s > LOOKED_AT_S:
                await asyncio.sleep(0.1)
            else:
                await self._round(slow)

    async def _ask_version(self) -> None:
        """See whether the module answers again, and which one it is."""
        exchange = await asyncio.get_running_loop().run_in_executor(
            self._thread, self._exchange, Instruction(VERSION), POLL
        )
        if exchange.status == Status.OK:
            self._values.clear()
            self._take_model(exchange.meaning)

    async def _round(self, slow: cycle[Reading]) -> None:
        """All of the motion, what pages watch, and a little of the rest."""
        started = time.monotonic()
        for reading in FAST:
            await self._take(reading)
        for item in tuple(self._watches):
            command = command_of(item)
            if command is not None and not self._hushed:
                value = self._watched[command] = await self._value(command)
                self.samples.add(self.now, {}, {item: value})
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
            self._seen = self.now
            self._sample(reading, exchange.value)
        elif exchange.status in _NEVER:
            self._refused.add(reading.command)
            self._values.pop((reading.key, reading.motor), None)

    def _sample(self, reading: Reading, value: int) -> None:
        """A row for a value of a curve, at the time that it came."""
        at = column_of(reading)
        if at is not None:
            self.samples.add(self._seen, {at: value})

    async def _find(self) -> None:
        await asyncio.sleep(RETRY_S)
        try:
            self._connection = await asyncio.get_running_loop().run_in_executor(self._thread, self._open_line)
        except LinkError:
            return
        self.line += 1
        self._silent = PATIENCE
        self._values.clear()
        self._refused.clear()

    def _tell_link(self) -> None:
        up = self._connection is not None and self._silent < PATIENCE and not self._terminal.on
        if up != self._up or self._moved:
            self._up, self._moved = up, False
            self.samples.gap(self.now, self._watches)
            self._tell(self.link)

    def watch(self, items: Sequence[wire.Watched]) -> None:
        """Poll these too."""
        self._watches = list(dict.fromkeys(items))

    def watched(self, items: Sequence[wire.Watched]) -> list[int | None]:
        """The values as last polled, None where the module refused or none was polled yet."""
        commands = [command_of(item) for item in items]
        return [None if command is None else self._watched.get(command) for command in commands]

    # State

    def state(self) -> State:
        """Everything as last polled."""
        self._looked_s = time.monotonic()
        state = pack(self._values, self.now, self._seen, connected=self._connection is not None)
        if self._session is not None and (self._session.in_steps or self._session.held_here):
            put_held(state, self._session.counter, held=self._session.held_here)
        return state
