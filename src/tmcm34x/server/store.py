"""Keeps a module's EEPROM in its file: every change at once in the journal, a new image when the memory is at rest.

A change is in the file system before the command that made it is answered: the listener of the EEPROM writes it.  A
process that is killed loses nothing; a computer that loses power loses what came since the last rest, unless the store
is `durable`: then each change is on the disk before its reply.

When a change cannot be written (the disk is full), the whole image is tried again once a second until there is room.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Final

from tmcm34x.firmware.storage import begin_journal
from tmcm34x.server.eeprom_file import EepromFile, EepromFileError

if TYPE_CHECKING:
    from tmcm34x.firmware.changes import EepromWrite
    from tmcm34x.firmware.storage import Eeprom

REST_S: Final = 0.5
"""After a time without changes as long as this the journal becomes a new image."""
RETRY_S: Final = 1.0
LONGEST_JOURNAL: Final = 4096
"""Changes after which there is a new image even without a rest."""


class Store:
    """`eeprom` kept in `file`.

    report: takes a line about a memory that could not be written, or that could again
    durable: every change is synchronised to the disk before its reply
    """

    def __init__(
        self, eeprom: Eeprom, file: EepromFile, report: Callable[[str], None], *, durable: bool = False
    ) -> None:
        self._eeprom = eeprom
        self._file = file
        self._report = report
        self._durable = durable
        self._chain = begin_journal(eeprom.to_bytes())
        self._entries = 0
        """Changes in the journal."""
        self._tail: list[EepromWrite] | None = None
        """Changes since the image was made that is just being written."""
        self._error = ""
        self._failed = False
        self._replacements = 0
        self._loop: asyncio.AbstractEventLoop | None = None
        self._timer: asyncio.TimerHandle | None = None
        self._task: asyncio.Task[None] | None = None
        self._last_s = 0.0

    @property
    def error(self) -> str:
        """Why the file lacks changes; empty where it lacks none."""
        return self._error

    def begin(self) -> None:
        """Write the image unless the file holds it already, and every change from now on.

        Raises `EepromFileError`.
        """
        image = self._eeprom.to_bytes()
        if image != self._file.load():
            self._file.save(image)
        self._chain = begin_journal(image)
        self._eeprom.listeners.append(self._keep)

    def start(self) -> None:
        """From now on there is a running event loop, and new images are made at rest."""
        self._loop = asyncio.get_running_loop()
        if self._entries or self._error:
            self._rest_later(self._loop, REST_S)

    def renew_soon(self) -> None:
        """The memory has become another one without a change: have a new image made, and a journal only then."""
        self._error = self._error or "the memory was replaced a moment ago"
        self._replacements += 1
        if self._loop is not None and self._timer is None:
            self._rest_later(self._loop, 0.0)

    async def close(self) -> None:
        """Make a last image and give the file free."""
        if self._keep in self._eeprom.listeners:
            self._eeprom.listeners.remove(self._keep)
        self._loop = None
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if self._task is not None:
            await self._task
        if self._entries or self._error:
            await self._renew()
        self._file.close()

    def _keep(self, changes: Sequence[EepromWrite]) -> None:
        """Write changes to the journal; the command that made them is answered after this."""
        if self._tail is not None:
            self._tail += changes
        self._entries += len(changes)
        if not self._error:
            try:
                self._file.append(self._chain.seal(changes))
                if self._durable:
                    self._file.synchronise(folder=False)
            except EepromFileError as error:
                self._fail(error)
        if self._loop is not None:
            self._last_s = self._loop.time()
            if self._timer is None:
                self._rest_later(self._loop, RETRY_S if self._error else REST_S)

    def _fail(self, error: EepromFileError) -> None:
        if not self._failed:
            self._report(f"memory not saved: {error}; trying again every second")
        self._failed = True
        self._error = str(error)

    def _rest_later(self, loop: asyncio.AbstractEventLoop, delay_s: float) -> None:
        self._timer = loop.call_later(delay_s, self._rest)

    def _rest(self) -> None:
        """Make a new image if it is time for one."""
        assert self._loop is not None
        self._timer = None
        rest_s = self._loop.time() - self._last_s
        if rest_s < REST_S and self._entries < LONGEST_JOURNAL and not self._error:
            self._rest_later(self._loop, REST_S - rest_s)
        elif self._task is None:
            self._task = self._loop.create_task(self._renew())
            self._task.add_done_callback(self._renewed)

    def _renewed(self, _: asyncio.Task[None]) -> None:
        self._task = None
        if (self._entries or self._error) and self._loop is not None and self._timer is None:
            self._rest_later(self._loop, RETRY_S)

    async def _renew(self) -> None:
        """Replace the file by one with the present image, beside the event loop: disks are slow."""
        replacements = self._replacements
        image, self._tail = self._eeprom.to_bytes(), []
        try:
            new = await asyncio.to_thread(self._file.prepare, image)
            chain, tail = begin_journal(image), self._tail
            self._file.publish(new, chain.seal(tail))
            self._chain, self._entries = chain, len(tail)
            self._tail = None
            await asyncio.to_thread(self._file.synchronise)
        except EepromFileError as error:
            if self._tail is None or self._error:
                self._fail(error)
        else:
            if self._failed:
                self._failed = False
                self._report("memory saved")
            if replacements == self._replacements:
                self._error = ""
        finally:
            self._tail = None
