"""The line to a real module: commands and their answers, urgent ones, the text interface, the module's own changes."""

from __future__ import annotations

import asyncio
import contextlib
import threading
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Final

from tmcm34x import clock
from tmcm34x.board.models import MODELS
from tmcm34x.host.ascii import Terminal
from tmcm34x.host.commands import motors_of
from tmcm34x.host.connection import Connection
from tmcm34x.host.effects import moves
from tmcm34x.host.exceptions import GarbledReplyError, HostError, LinkError, NoReplyError, ReplyError
from tmcm34x.host.following import followed, following
from tmcm34x.host.steps import ASCII_MODE, FACTORY_RESET
from tmcm34x.ide import wire
from tmcm34x.ide.exchange import answered, unanswered
from tmcm34x.tmcl.datagram import Instruction, Reply, pack_request
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.host.url import Url
    from tmcm34x.ide.target import Tell
    from tmcm34x.ide.telegrams import Telegrams

TIMEOUT_S: Final = 0.5
RETRIES: Final = 2
"""How often a command of an operation is sent again that only reads, or that the module says has not arrived."""
PATIENCE: Final = 3
"""Commands in a row without an answer until the module counts as lost."""
POLL: Final = "poll"
_SOURCES: Final[dict[str, wire.Source]] = {"serial": "serial", "tcp": "tcp", "can": "can", "slcan": "slcan"}
SILENT: Final = "not sent: the module does not answer"
CLOSED: Final = "not sent: the IDE is connected to another module"


class RemoteLine:
    """The line to the module that `url` names: one thread talks on it, one command at a time.

    Opens the line at once and asks the module what it is; raises `LinkError`.

    patient: a line that cannot be opened is tried again and again instead
    """

    def __init__(self, url: Url, telegrams: Telegrams, *, patient: bool = False) -> None:
        self.source: wire.Source = _SOURCES[url.scheme]
        self.url = url
        """The line as it is now: the IDE follows its own changes of address, rate and identifiers."""
        self._telegrams = telegrams
        self._loop: asyncio.AbstractEventLoop
        self._tell: Tell = lambda event: None
        self._thread = ThreadPoolExecutor(1, "line")
        self._start_s = time.monotonic()
        self._silent = 0
        """Commands in a row without an answer."""
        self._up = True
        self._hushed = False
        self._moved = False
        """Address or bit rate were changed: pages do not know it yet."""
        self._link = POLL
        self._urgencies = 0
        """How often something urgent was sent: what was queued before may not be."""
        self._urging = 0
        """The thread that is sending something urgent."""
        self._closed = False
        self._garbled = False
        """Bytes came last, but no reply."""
        self._terminal = Terminal()
        self.model, self.known = MODELS[343], False
        self._connection: Connection | None = None
        try:
            self._connection = self._open_line()
            self._take_model(self._identify(self._connection))
        except LinkError:
            self._lose()
            self._up = False
            if not patient:
                raise

    @property
    def place(self) -> str:
        """Port, bit rate where there is one, and address."""
        return self.url.place

    @property
    def _address(self) -> int:
        return self.url.address

    def _open_line(self) -> Connection:
        connection = Connection.open(self.url.name, timeout=TIMEOUT_S, retries=RETRIES)
        connection.listeners.append(self._note)
        return connection

    def _identify(self, connection: Connection) -> str:
        """What the module says it is, such as `343V4.36`; empty while it says nothing."""
        try:
            return connection.version()
        except HostError as error:
            if isinstance(error, LinkError):
                raise
            self._garbled = not isinstance(error, NoReplyError)
            self._silent = PATIENCE
            self._up = False
            return ""

    def _take_model(self, version: str) -> None:
        number = int(version[:3]) if version[:3].isdecimal() else 0
        self.known = number in MODELS
        if self.known:
            self.model = MODELS[number]

    @property
    def link(self) -> wire.Link:
        """How the line is."""
        if self._terminal.on:
            text = "The module is in ASCII mode, which executes no binary commands."
            return wire.Link(False, text, self.place, True)
        if self._up:
            return wire.Link(True, "", self.place, False)
        if self._connection is None:
            return wire.Link(
                False, f"The line {self.place} was lost; the IDE tries to connect again.", self.place, False
            )
        return wire.Link(False, self._trouble, self.place, False)

    @property
    def _trouble(self) -> str:
        """Why a module that does not answer may be silent."""
        if self._garbled:
            return (
                f"What comes at {self.place} is no reply: check the bit rate, and what else is on the line."
            )
        return f"No answer at {self.place}: check {self.url.checks}."

    # Talking

    async def exchange(self, instruction: Instruction) -> wire.Exchange:
        """Send a command and wait for its answer."""
        return await self._send(instruction, "IDE", self._urgencies)

    async def ask(self, instruction: Instruction) -> wire.Exchange:
        """The same for operations, which have it sent again where that does no harm."""
        if self._silent >= PATIENCE:
            return unanswered(instruction, pack_request(self._address, instruction), SILENT)
        return await self._send(instruction, "IDE", self._urgencies, RETRIES)

    async def _send(
        self, instruction: Instruction, link: str, urgencies: int | None = None, retries: int = 0
    ) -> wire.Exchange:
        """Have the thread of the line send a command."""
        if self._closed:
            return unanswered(instruction, pack_request(self._address, instruction), CLOSED)
        return await asyncio.get_running_loop().run_in_executor(
            self._thread, self._exchange, instruction, link, urgencies, retries
        )

    def urgent(self, instructions: Sequence[Instruction]) -> None:
        """Write commands to the line from here, while its thread may be waiting for an answer."""
        self._urgencies += 1
        connection = self._connection
        if connection is None:
            return
        leave = self._terminal.leave(self._address)
        self._urging = threading.get_ident()
        with contextlib.suppress(LinkError):
            if leave:
                connection.line.write(leave)
            connection.urgent(instructions)
        self._urging = 0

    def _exchange(
        self, instruction: Instruction, link: str, urgencies: int | None, retries: int
    ) -> wire.Exchange:
        sent = pack_request(self._address, instruction)
        if self._closed:
            return unanswered(instruction, sent, CLOSED)
        if urgencies not in {None, self._urgencies} and (self._hushed or moves(instruction)):
            return unanswered(instruction, sent, "not sent: STOP ALL came first")
        connection = self._connection
        if connection is None:
            return unanswered(instruction, sent, "no reply: the line was lost")
        if self._terminal.on:
            return unanswered(instruction, sent, "not sent: the module is in ASCII mode")
        self._link = link
        try:
            if instruction.number == FACTORY_RESET:
                connection.send(instruction)
                return unanswered(instruction, sent, "sent: this command is never answered")
            received = connection.ask(instruction, retries=retries).telegram
        except GarbledReplyError as error:
            self._garbled = True
            return unanswered(instruction, sent, f"no whole answer: {error}")
        except ReplyError:
            self._silent += 1
            self._garbled = False
            return unanswered(instruction, sent, "no answer in time")
        except LinkError as error:
            self._lose()
            return unanswered(instruction, sent, str(error))
        self._silent, self._garbled = 0, False
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
        if connection is None or self._closed:
            raise wire.RefusalError("line", "The line was lost.")
        if self.url.is_can:
            raise wire.RefusalError("can", "The ASCII interface is on serial lines, not on CAN.")
        return await asyncio.get_running_loop().run_in_executor(
            self._thread, self._send_line, connection, line
        )

    def _send_line(self, connection: Connection, line: str) -> str:
        try:
            return self._terminal.send(connection, self._address, line)
        except LinkError as error:
            self._lose()
            raise wire.RefusalError("line", f"{error}.") from error

    def _follow(self, instruction: Instruction, connection: Connection) -> None:
        """Go on at the address, bit rate or identifier that the module has from its next command on."""
        if instruction.number == ASCII_MODE and not self.url.is_can:
            self._terminal.on = True
        elif change := following(instruction):
            url = followed(self.url, change)
            if url.place == self.place:
                return
            self.url = url
            connection.perform(change)
        else:
            return
        self._moved = True

    def _note(self, sent: bool, data: bytes) -> None:
        link = "IDE" if self._urging == threading.get_ident() else self._link
        if link != POLL or self._telegrams.polls_wanted:
            self._telegrams.write(self.now, link, ">" if sent else "<", data)

    def _lose(self) -> None:
        if self._connection is not None:
            self._connection.close()
            self._connection = None

    @property
    def now(self) -> float:
        """Time since the IDE was started."""
        return (time.monotonic() - self._start_s) * clock.HZ
