"""The IDE's module when it is a real one, on a serial port or behind a socket.

One thread talks on the line, one command at a time.  Between the commands of pages it polls what pages show: the
motion of each motor in every round, one other value a round.  Nothing is polled while no page looks.
"""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Final

from tmcm34x.debug.sessions.base import Listener
from tmcm34x.debug.sessions.remote import RemoteSession
from tmcm34x.host.exceptions import LinkError
from tmcm34x.host.polling import PROBE, Polled, Polling, reader
from tmcm34x.host.steps import VERSION
from tmcm34x.ide import wire
from tmcm34x.ide.exchange import unanswered
from tmcm34x.ide.faults import fault
from tmcm34x.ide.polled import pack, put_held
from tmcm34x.ide.remote_line import CLOSED, PATIENCE, POLL, RemoteLine
from tmcm34x.ide.sampling import Samples, column_of
from tmcm34x.ide.state import Groups
from tmcm34x.tmcl.datagram import Instruction, pack_request
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.host.url import Url
    from tmcm34x.ide.target import T, Tell
    from tmcm34x.ide.telegrams import Telegrams

RETRY_S: Final = 1.0
"""Between two attempts to find a lost module."""
LOOKED_AT_S: Final = 3.0
"""A page that asked for state less than this ago is looking."""
LOADING: Final = "another host is downloading a program"


class Remote(RemoteLine):
    """The module that `url` names, as the IDE uses it; options as for `RemoteLine`."""

    def __init__(self, url: Url, telegrams: Telegrams, *, patient: bool = False) -> None:
        self.ability = wire.Ability(
            bench=False,
            debug=False,
            peek=False,
            language_server=True,
            history=False,
            irreversible=RemoteSession.irreversible,
        )
        self._task: asyncio.Task[None] | None = None
        self._looked_s = -math.inf
        self.line = 0
        self._polling = Polling()
        self._watches: list[wire.Watched] = []
        self._watched: dict[Instruction, int | None] = {}
        self._session: RemoteSession | None = None
        self.samples = Samples()
        self._seen = 0.0
        """When the module last sent a value [clocks]."""
        super().__init__(url, telegrams, patient=patient)

    async def open(self, tell: Tell) -> None:
        """Begin to poll."""
        self._tell = tell
        self._loop = asyncio.get_running_loop()
        self._task = asyncio.create_task(self._poll())
        self._task.add_done_callback(self._end_of_polling)

    async def close(self) -> None:
        """Hang up; what is still queued is not sent."""
        self._closed = True
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)
        await asyncio.to_thread(self._thread.shutdown)
        if self._connection is not None:
            self._connection.close()

    def _end_of_polling(self, task: asyncio.Task[None]) -> None:
        """Only a bug ends it before `close`: pages must not take old values for present ones without a word."""
        if not task.cancelled() and isinstance(error := task.exception(), Exception):
            self._tell(fault(error, "polling"))

    def _lose(self) -> None:
        super()._lose()
        self._session = None

    # The debugger

    def session(self, listener: Listener) -> RemoteSession:
        """Run control of the module's program, as far as its firmware has it.  Raises `HostError`."""
        if self._connection is None:
            raise LinkError("the line was lost")
        self._session = RemoteSession(self._connection, listener)
        return self._session

    async def debug(self, work: Callable[[], T], *, polling: bool = False) -> T:
        """Do something with the session in the thread that has the line."""

        def linked() -> T:
            if self._closed:
                raise LinkError(CLOSED)
            if self._hushed:
                raise LinkError("the module is busy with a download")
            if polling and self._polling.loading:
                raise LinkError(LOADING)
            self._link = POLL if polling else "IDE"
            return work()

        if self._closed:
            raise LinkError(CLOSED)
        return await asyncio.get_running_loop().run_in_executor(self._thread, linked)

    async def read(self, items: Sequence[wire.Watched]) -> list[int | None]:
        """Values of parameters and coordinates."""
        values: list[int | None] = []
        for item in items:
            command = reader(*_fields(item))
            if command is None or not self._up or not self._may_ask:
                values.append(None)
                continue
            values.append(await self._value(command))
        return values

    async def _value(self, command: Instruction) -> int | None:
        exchange = await self._send(command, POLL)
        return exchange.value if exchange.status == Status.OK else None

    # Polling

    @property
    def _may_ask(self) -> bool:
        """Whether a question is answered, and not stored as part of a program that is being downloaded."""
        return not self._hushed and not self._polling.loading

    def hush(self, on: bool) -> None:
        """Poll nothing while a program is being downloaded."""
        self._hushed = on
        self.samples.gap(self.now, self._watches)

    async def _poll(self) -> None:
        while True:
            if self._connection is None and self._terminal.on:
                self._terminal.on, self._moved = False, True
            self._tell_link()
            if self._connection is None:
                await self._find()
            elif self._terminal.on:
                await asyncio.sleep(0.1)
            elif self._silent >= PATIENCE:
                await asyncio.sleep(RETRY_S)
                await self._ask_version()
            elif self._hushed or time.monotonic() - self._looked_s > LOOKED_AT_S:
                await asyncio.sleep(0.1)
            else:
                await self._round()

    def _exchange(
        self, instruction: Instruction, link: str, urgencies: int | None, retries: int
    ) -> wire.Exchange:
        """In the thread of the line, so that a poll that was queued before the mode was seen is not sent."""
        if link != POLL:
            return super()._exchange(instruction, link, urgencies, retries)
        if self._polling.stored(instruction):
            return unanswered(instruction, pack_request(self._address, instruction), LOADING)
        exchange = super()._exchange(instruction, link, urgencies, retries)
        self._polling.see_mode(instruction, exchange.status)
        return exchange

    async def _ask_version(self) -> None:
        """See whether the module answers again, and which one it is."""
        exchange = await self._send(Instruction(VERSION), POLL)
        if exchange.status == Status.OK:
            self._polling.forget()
            self._take_model(exchange.meaning)

    async def _round(self) -> None:
        """All of the motion, what pages watch, and a little of the rest."""
        started = time.monotonic()
        for polled in self._polling.due():
            await self._take(polled)
        for item in tuple(self._watches):
            command = reader(*_fields(item))
            if command is not None and self._may_ask:
                value = self._watched[command] = await self._value(command)
                self.samples.add(self.now, {}, {item: value})
        await asyncio.sleep(max(0.0, 1 / 60 - (time.monotonic() - started)))

    async def _take(self, polled: Polled) -> None:
        if not (self._may_ask or (polled is PROBE and not self._hushed)) or self._silent >= PATIENCE:
            return
        exchange = await self._send(polled.command, POLL)
        if not self._polling.take(polled, exchange.status, exchange.value):
            return
        self._seen = self.now
        at = column_of(polled)
        if at is not None:
            self.samples.add(self._seen, {at: exchange.value})

    async def _find(self) -> None:
        await asyncio.sleep(RETRY_S)
        try:
            self._connection = await asyncio.get_running_loop().run_in_executor(self._thread, self._open_line)
        except LinkError:
            return
        self.line += 1
        self._silent = PATIENCE
        self._polling.forget()

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
        commands = [reader(*_fields(item)) for item in items]
        return [None if command is None else self._watched.get(command) for command in commands]

    # State

    def state(self) -> Groups:
        """Everything as last polled."""
        self._looked_s = time.monotonic()
        state = pack(self._polling.values, self.now, self._seen, connected=self._connection is not None)
        if self._session is not None and (self._session.in_steps or self._session.held_here):
            put_held(state, self._session.counter, held=self._session.held_here)
        return state


def _fields(item: wire.Watched) -> tuple[int, int, int]:
    return item.bank, item.number, item.motor
