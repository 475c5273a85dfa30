"""A window's line to the debugger: messages of the Debug Adapter Protocol, one in each web socket message."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any, Final

import msgspec
from starlette.websockets import WebSocketDisconnect

from tmcm34x.ide.debugger import Window
from tmcm34x.ide.wire import MALFORMED

if TYPE_CHECKING:
    from starlette.websockets import WebSocket

    from tmcm34x.ide.debugger import Debugger

MAX_WAITING: Final = 10_000
"""Messages that wait for one window; one that falls behind farther is cut off and may come back."""


class DebugSocket:
    """A window at the other end of `socket`."""

    def __init__(self, debugger: Debugger, socket: WebSocket) -> None:
        self._debugger = debugger
        self._socket = socket
        self._messages: asyncio.Queue[dict[str, Any]] = asyncio.Queue(MAX_WAITING)
        self._reader: asyncio.Task[None] | None = None

    async def serve(self) -> None:
        """Talk to the window until it goes."""
        window = Window(self._put)
        sender = asyncio.create_task(self._send())
        self._reader = asyncio.create_task(self._receive(window))
        try:
            await self._reader
        except (WebSocketDisconnect, KeyError):
            pass
        except asyncio.CancelledError:
            if not self._reader.cancelled():
                raise
        finally:
            self._debugger.leave(window)
            sender.cancel()
            await asyncio.gather(sender, return_exceptions=True)

    async def _receive(self, window: Window) -> None:
        while True:
            text = await self._socket.receive_text()
            try:
                message = msgspec.json.decode(text)
            except (msgspec.DecodeError, UnicodeError, RecursionError) as error:
                await self._socket.close(MALFORMED, str(error)[:100])
                return
            await self._debugger.handle(window, message)

    def _put(self, message: dict[str, Any]) -> None:
        try:
            self._messages.put_nowait(message)
        except asyncio.QueueFull:
            if self._reader is not None:
                self._reader.cancel()

    async def _send(self) -> None:
        while True:
            message = await self._messages.get()
            await self._socket.send_text(msgspec.json.encode(message).decode())
