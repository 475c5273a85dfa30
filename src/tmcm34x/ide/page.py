"""One window: its web socket, and what it is sent.

Back pressure: state is packed when the socket has room, never before, so a slow browser gets fewer frames and
nothing piles up.  Log lines that are not fetched in time are skipped and counted.  Answers cannot pile up because
a page may have only so many calls under way, and so much text in them.
"""

from __future__ import annotations

import asyncio
import contextlib
from functools import partial
from itertools import count
from typing import TYPE_CHECKING, Final

import msgspec
from starlette.websockets import WebSocketState

from tmcm34x.ide import wire
from tmcm34x.ide.calls import answer
from tmcm34x.ide.faults import fault
from tmcm34x.ide.messages import Outbox, refuse, texts, until_gone
from tmcm34x.ide.state import Frames

if TYPE_CHECKING:
    from starlette.websockets import WebSocket

    from tmcm34x.ide.hub import Hub

MAX_CALLS: Final = 64
"""Calls of one page under way at a time."""
MAX_TEXT: Final = 12 << 20
"""Characters of these calls together."""
LOG_S: Final = 0.1

_numbers = count(1)
_request = msgspec.json.Decoder(wire.Request)
_event = msgspec.json.Encoder()


class Page:
    """A window at the other end of `socket`."""

    def __init__(self, hub: Hub, socket: WebSocket) -> None:
        self._hub = hub
        self._socket = socket
        self._events = Outbox(self._cut_off)
        self._reader: asyncio.Task[None] | None = None
        self._frames = Frames()
        self._calls: dict[asyncio.Task[None], int] = {}
        """Under way, with the length of their texts."""
        self._log_from: int | None = None
        self._hurry = asyncio.Event()
        self._sampled = hub.target.samples.last
        """Number of the last row of samples that this window was sent."""
        self.number = next(_numbers)
        self.heard_s = asyncio.get_running_loop().time()
        """When this window last said something."""
        self.rate_hz = 30
        self.wants_polls = False
        self.watches: list[wire.Watched] = []

    def send(self, event: wire.Event) -> None:
        """Let the page have an event, in order."""
        self._events.put(_event.encode(event))

    def _cut_off(self) -> None:
        """This window does not read: forget it."""
        if self._reader is not None:
            self._reader.cancel()

    def begin_anew(self) -> None:
        """The module is another one: its state is sent whole, behind what has been said so far."""
        self._sampled = 0
        self._frames = Frames()

    def hurry(self) -> None:
        """Send the state now: something happened that a person waits for."""
        self._hurry.set()

    def follow_log(self, call: wire.FollowLog) -> None:
        """Send log lines from those on that the page has, or none."""
        self._log_from = call.since if call.on else None
        self.wants_polls = call.on and call.polls

    async def serve(self) -> None:
        """Talk to the page until it goes."""
        self._hub.join(self)
        pumps = [
            asyncio.create_task(work()) for work in (self._send_events, self._send_states, self._send_log)
        ]
        self._reader = asyncio.create_task(self._receive())
        try:
            await until_gone(self._reader)
        finally:
            for task in (*pumps, *self._calls):
                task.cancel()
            await asyncio.gather(*pumps, return_exceptions=True)
            self._hub.leave(self)

    async def _receive(self) -> None:
        async for text in texts(self._socket):
            try:
                if text is None:
                    raise msgspec.DecodeError("not a text message")
                number, call = _request.decode(text)
            except (msgspec.DecodeError, UnicodeError) as error:
                await refuse(self._socket, str(error))
                return
            self.heard_s = asyncio.get_running_loop().time()
            if isinstance(call, wire.StopAll) or self._has_room(len(text)):
                self._begin(number, call, len(text))
            else:
                self.send(wire.Refusal(number, "busy", "Too many requests at a time."))

    def _has_room(self, size: int) -> bool:
        return len(self._calls) < MAX_CALLS and sum(self._calls.values()) + size <= MAX_TEXT

    def _begin(self, number: int, call: wire.Call, size: int) -> None:
        task = asyncio.create_task(self._answer(number, call))
        self._calls[task] = size
        task.add_done_callback(self._calls.pop)

    async def _answer(self, number: int, call: wire.Call) -> None:
        try:
            self.send(wire.CallResult(number, await answer(self._hub, self, call)))
        except wire.RefusalError as error:
            self.send(wire.Refusal(number, error.code, str(error)))
        except Exception as error:
            self.send(fault(error, type(call).__name__, number))

    async def _send_events(self) -> None:
        await self._events.run(partial(self._send, text=True))

    async def _send_states(self) -> None:
        loop = asyncio.get_running_loop()
        due = loop.time()
        while True:
            if self.rate_hz and not self._events:
                target = self._hub.target
                watched = target.watched(self.watches) if self.watches else ()
                frame = self._frames.frame(target.state(), watched)
                rows = target.samples.since(self._sampled, self.watches)
                self._sampled = target.samples.last
                for message in filter(None, (rows, frame)):
                    await self._send(message, text=False)
                await self._hub.check_memory()
            now = loop.time()
            due = max(min(due, now) + 1 / (self.rate_hz or 2), now)
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._hurry.wait(), due - loop.time())
            self._hurry.clear()

    async def _send_log(self) -> None:
        while True:
            await asyncio.sleep(LOG_S)
            if self._log_from is None:
                continue
            lines = self._hub.telegrams.since(self._log_from)
            if lines is not None:
                self._log_from = lines.lines[-1].number
                await self._send(_event.encode(lines), text=True)

    async def _send(self, data: bytes, *, text: bool) -> None:
        if self._socket.application_state is not WebSocketState.CONNECTED:
            return
        if text:
            await self._socket.send_text(data.decode())
        else:
            await self._socket.send_bytes(data)
