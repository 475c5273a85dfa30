"""A window's line to the debugger: messages of the Debug Adapter Protocol, one in each web socket message."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

import msgspec

from tmcm34x.ide.debug_messages import DebugWindow
from tmcm34x.ide.messages import Outbox, refuse, texts, until_gone

if TYPE_CHECKING:
    from starlette.websockets import WebSocket

    from tmcm34x.ide.debugger import Debugger


class DebugSocket:
    """A window at the other end of `socket`."""

    def __init__(self, debugger: Debugger, socket: WebSocket) -> None:
        self._debugger = debugger
        self._socket = socket
        self._messages = Outbox(self._cut_off)
        self._reader: asyncio.Task[None] | None = None

    async def serve(self) -> None:
        """Talk to the window until it goes."""
        window = DebugWindow(self._put)
        sender = asyncio.create_task(self._send())
        self._reader = asyncio.create_task(self._receive(window))
        try:
            await until_gone(self._reader)
        finally:
            self._debugger.leave(window)
            sender.cancel()
            await asyncio.gather(sender, return_exceptions=True)

    async def _receive(self, window: DebugWindow) -> None:
        async for text in texts(self._socket):
            try:
                if text is None:
                    raise msgspec.DecodeError("not a text message")
                message = msgspec.json.decode(text)
            except (msgspec.DecodeError, UnicodeError, RecursionError) as error:
                await refuse(self._socket, str(error))
                return
            await self._debugger.handle(window, message)

    def _put(self, message: dict[str, Any]) -> None:
        self._messages.put(msgspec.json.encode(message))

    def _cut_off(self) -> None:
        """This window does not read: forget it."""
        if self._reader is not None:
            self._reader.cancel()

    async def _send(self) -> None:
        await self._messages.run(lambda data: self._socket.send_text(data.decode()))
