"""The language server for the page's editor: the very one of `tmcm34x lsp`, in a thread of its own.

A thread, because judging a long program takes longer than the module may wait.

Leaves out: nothing; messages pass through unchanged.
"""

from __future__ import annotations

import asyncio
import contextlib
import threading
from collections.abc import AsyncIterator, Callable
from typing import TYPE_CHECKING, Final

from tmcm34x.files import followed
from tmcm34x.ide.messages import refuse, texts
from tmcm34x.ide.wire import RefusalError

if TYPE_CHECKING:
    from starlette.websockets import WebSocket

    from tmcm34x.ide.workspace import OpenFolder

MOST_WAITING: Final = 8
"""Requests that wait for the server, and answers that wait for the window."""


class Language:
    """One session with the editor of one window.

    A window that asks faster than it is answered, or does not read, is not read from meanwhile.
    """

    def __init__(self, workspace: OpenFolder, model: int, socket: WebSocket) -> None:
        self._workspace = workspace
        self._model = model
        self._socket = socket
        self._loop = asyncio.get_running_loop()
        self._answers: asyncio.Queue[str | None] = asyncio.Queue()
        self._started = asyncio.Event()
        self._room = asyncio.Semaphore(MOST_WAITING)
        """For requests that wait for the thread."""
        self._thread = threading.Thread(target=self._run, name="language server", daemon=True)

    async def serve(self) -> None:
        """Pass messages both ways until the window or the session ends."""
        self._thread.start()
        await self._started.wait()
        work = (asyncio.create_task(self._receive()), asyncio.create_task(self._send()))
        try:
            await asyncio.wait(work, return_when=asyncio.FIRST_COMPLETED)
        finally:
            self._in_thread(self._end)
            for task in work:
                task.cancel()
            await asyncio.gather(*work, return_exceptions=True)

    async def _receive(self) -> None:
        async for text in texts(self._socket):
            if text is None:
                await refuse(self._socket, "not a text message")
                return
            await self._room.acquire()
            self._in_thread(self._requests.put_nowait, text)

    async def _send(self) -> None:
        while (text := await self._answers.get()) is not None:
            await self._socket.send_text(text)
            self._in_thread(self._credit.release)

    def _in_thread(self, call: Callable[..., object], *arguments: object) -> None:
        with contextlib.suppress(RuntimeError):  # the session is over and its loop closed
            self._thread_loop.call_soon_threadsafe(call, *arguments)

    def _outside(self, call: Callable[..., object], *arguments: object) -> None:
        with contextlib.suppress(RuntimeError):  # the server is over and its loop closed
            self._loop.call_soon_threadsafe(call, *arguments)

    # In the thread

    def _run(self) -> None:
        try:
            asyncio.run(self._session())
        finally:
            self._outside(self._answers.put_nowait, None)

    async def _session(self) -> None:
        from tmcm34x.editor.sessions import serve_messages

        self._requests: asyncio.Queue[str] = asyncio.Queue()
        self._credit = asyncio.Semaphore(MOST_WAITING)
        self._over = asyncio.Event()
        self._thread_loop = asyncio.get_running_loop()
        self._outside(self._started.set)
        serving = asyncio.create_task(serve_messages(self._received(), self._answer, self, model=self._model))
        over = asyncio.create_task(self._over.wait())
        await asyncio.wait((serving, over), return_when=asyncio.FIRST_COMPLETED)
        over.cancel()
        serving.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await serving

    def _end(self) -> None:
        self._over.set()

    async def _received(self) -> AsyncIterator[str]:
        while True:
            yield await self._requests.get()
            self._outside(self._room.release)

    async def _answer(self, text: str) -> None:
        await self._credit.acquire()
        self._outside(self._answers.put_nowait, text)

    def read(self, path: str) -> str:
        """The text of an included file, inside the opened folder only."""
        try:
            inside = followed(path).relative_to(self._workspace.folder)
            return self._workspace.read(inside.as_posix()).text
        except (OSError, ValueError, RefusalError) as error:
            raise FileNotFoundError(f"{path} is not in the opened folder") from error

    def names(self, folder: str) -> list[str]:
        """The names of the files in a folder inside the opened one."""
        return self._workspace.names(folder)
