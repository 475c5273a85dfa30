"""The opened folder as pages ask for it, and the changes that are sent to them."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Mapping
from typing import TYPE_CHECKING, Final

from tmcm34x.ide import wire

if TYPE_CHECKING:
    from tmcm34x.ide.target import Tell
    from tmcm34x.ide.window import Window
    from tmcm34x.ide.workspace import OpenFolder

WATCH_S: Final = 1.0
"""Between two looks at the folder."""


class Folder:
    """The files of `workspace`; `tell` takes what pages should see, `watched` says whether there is any."""

    def __init__(self, workspace: OpenFolder, tell: Tell, watched: Callable[[], bool]) -> None:
        self._workspace = workspace
        self._tell = tell
        self._watched = watched
        self._files: list[wire.FileEntry] = []
        self._looks: set[asyncio.Task[None]] = set()

    async def watch(self) -> None:
        """Look for changes for ever."""
        while True:
            if self._watched():
                await self._look()
            await asyncio.sleep(WATCH_S)

    async def _look(self) -> None:
        files = await asyncio.to_thread(self._workspace.files)
        if files != self._files:
            self._files = files
            self._tell(wire.FilesChanged(files))

    def _look_soon(self) -> None:
        """Look after the answer: the window that has made the change gets that first."""
        look = asyncio.create_task(self._look())
        self._looks.add(look)
        look.add_done_callback(self._looks.discard)

    async def list_files(self, page: Window, call: wire.ListFiles) -> list[wire.FileEntry]:
        """All of them."""
        self._files = await asyncio.to_thread(self._workspace.files)
        return self._files

    async def read_file(self, page: Window, call: wire.ReadFile) -> wire.FileText:
        """The text of one."""
        return await asyncio.to_thread(self._workspace.read, call.path)

    async def write_file(self, page: Window, call: wire.WriteFile) -> wire.FileEntry:
        """Save a text."""
        work = self._workspace
        entry = await asyncio.to_thread(work.write, call.path, call.text, call.stamp, call.newline)
        self._look_soon()
        return entry

    async def rename_file(self, page: Window, call: wire.RenameFile) -> None:
        """Give a file another path."""
        await asyncio.to_thread(self._workspace.rename, call.path, call.to)
        self._look_soon()

    async def delete_file(self, page: Window, call: wire.DeleteFile) -> None:
        """Remove a file."""
        await asyncio.to_thread(self._workspace.delete, call.path)
        await self._look()


METHODS: Final[Mapping[type[wire.Call], Callable[..., Awaitable[object]]]] = {
    wire.ListFiles: Folder.list_files, wire.ReadFile: Folder.read_file, wire.WriteFile: Folder.write_file,
    wire.RenameFile: Folder.rename_file, wire.DeleteFile: Folder.delete_file,
}  # fmt: skip
