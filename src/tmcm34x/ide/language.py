"""The language server for the page's editor: the very one of `tmcm34x lsp`, in a thread of its own.

A thread, because judging a long program takes longer than the module may wait.

Leaves out: nothing; messages pass through unchanged.
"""

from __future__ import annotations

import asyncio
import threading
from collections.abc import AsyncIterator
from pathlib import Path
from typing import TYPE_CHECKING, Final

from starlette.websockets import WebSocketDisconnect

from tmcm34x.ide.wire import RefusalError

if TYPE_CHECKING:
    from starlette.websockets import WebSocket

    from tmcm34x.ide.workspace import Workspace

_END: Final = None


class Language:
    """One session with the editor of one window."""

    def __init__(self, workspace: Workspace, model: int, socket: WebSocket) -> None:
        self._workspace = workspace
        self._model = model
        self._socket = socket
        self._loop = asyncio.get_running_loop()
        self._answers: asyncio.Queue[str | None] = asyncio.Queue()
        self._started = threading.Event()
        self._thread_loop: asyncio.AbstractEventLoop | None = None
        self._thread = threading.Thread(target=self._run, name="language server", daemon=True)

    async def serve(self) -> None:
        """Pass messages both ways until the window goes."""
        self._thread.start()
        await asyncio.to_thread(self._started.wait)
        sender = asyncio.create_task(self._send())
        try:
            while True:
                self._put(await self._socket.receive_text())
        except (WebSocketDisconnect, KeyError):
            pass
        finally:
            self._put(_END)
            sender.cancel()
            await asyncio.gather(sender, return_exceptions=True)

    async def _send(self) -> None:
        while (text := await self._answers.get()) is not None:
            await self._socket.send_text(text)

    def _put(self, text: str | None) -> None:
        if self._thread_loop is not None and not self._thread_loop.is_closed():
            self._thread_loop.call_soon_threadsafe(self._requests.put_nowait, text)

    # In the thread

    def _run(self) -> None:
        asyncio.run(self._session())

    async def _session(self) -> None:
        from tmcm34x.editor.sessions import serve_messages

        self._requests: asyncio.Queue[str | None] = asyncio.Queue()
        self._thread_loop = asyncio.get_running_loop()
        self._started.set()
        await serve_messages(self._received(), self._answer, self, model=self._model)

    async def _received(self) -> AsyncIterator[str]:
        while (text := await self._requests.get()) is not None:
            yield text

    async def _answer(self, text: str) -> None:
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._answers.put_nowait, text)

    def read(self, path: str) -> str:
        """The text of an included file, inside the opened folder only."""
        try:
            inside = Path(path).resolve().relative_to(self._workspace.folder)
            return self._workspace.read(inside.as_posix()).text
        except (ValueError, RefusalError) as error:
            raise FileNotFoundError(f"{path} is not in the opened folder") from error

    def names(self, folder: str) -> list[str]:
        """The names of the files in a folder inside the opened one."""
        return self._workspace.names(folder)
