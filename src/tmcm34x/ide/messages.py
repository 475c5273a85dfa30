"""Messages of one window: those that come, and those that wait for it."""

from __future__ import annotations

import asyncio
import contextlib
from collections import deque
from collections.abc import AsyncIterator, Awaitable, Callable
from typing import TYPE_CHECKING, Final

from starlette.websockets import WebSocketDisconnect, WebSocketState

from tmcm34x.ide.wire import MALFORMED

if TYPE_CHECKING:
    from starlette.websockets import WebSocket

MAX_BACKLOG: Final = 8 << 20
"""Bytes that wait for one window; one that falls behind farther is cut off and may come back."""


async def texts(socket: WebSocket) -> AsyncIterator[str | None]:
    """What a window sends until it is gone; None for what is no text.

    Others have their turn after each, even if the window has sent a thousand at once.
    """
    while (message := await socket.receive())["type"] != "websocket.disconnect":
        yield message.get("text")
        await asyncio.sleep(0)


async def until_gone(reader: asyncio.Task[None]) -> None:
    """Wait until the task that reads a window's messages ends or is cancelled; raises what it has met."""
    try:
        await reader
    except asyncio.CancelledError:
        if not reader.cancelled():
            raise


async def refuse(socket: WebSocket, why: str) -> None:
    """Close a web socket on which something came that is no message."""
    if socket.application_state is WebSocketState.CONNECTED:
        with contextlib.suppress(WebSocketDisconnect):
            await socket.close(MALFORMED, why[:100])


class Outbox:
    """Messages in order; `full` is called instead of keeping one when too much waits."""

    def __init__(self, full: Callable[[], object]) -> None:
        self._full = full
        self._messages: deque[bytes] = deque()
        self._backlog = 0
        self._wake = asyncio.Event()

    def __bool__(self) -> bool:
        return bool(self._messages)

    def put(self, data: bytes) -> None:
        """Keep a message until it can be sent."""
        if self._backlog > MAX_BACKLOG:
            self._full()
            return
        self._backlog += len(data)
        self._messages.append(data)
        self._wake.set()

    async def run(self, send: Callable[[bytes], Awaitable[object]]) -> None:
        """Send until this is cancelled; what waits then is dropped."""
        try:
            while True:
                await self._wake.wait()
                self._wake.clear()
                while self._messages:
                    data = self._messages.popleft()
                    await send(data)
                    self._backlog -= len(data)
        finally:
            self._messages.clear()
