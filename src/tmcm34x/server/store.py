"""Keeps a module's EEPROM in its image file: soon after each write, and at the end."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from tmcm34x.server.eeprom_file import EepromFile, EepromFileError

if TYPE_CHECKING:
    from tmcm34x.firmware.storage import Eeprom

DELAY_S: Final = 0.05
"""From the first write until the image is written: a burst of writes costs one image."""


class Store:
    """`eeprom` kept in `file`; `report` takes a line about an image that could not be written."""

    def __init__(self, eeprom: Eeprom, file: EepromFile, report: Callable[[str], None]) -> None:
        self._eeprom = eeprom
        self._file = file
        self._report = report
        self._saved = eeprom.revision
        self._failed = False
        self._task: asyncio.Task[None] | None = None

    @property
    def changed(self) -> bool:
        """Whether the EEPROM holds something that no image has, and none is on its way."""
        return self._task is None and self._eeprom.revision != self._saved

    def save_now(self) -> None:
        """Write the image unless the file holds it already.  Raises `EepromFileError`."""
        image = self._eeprom.to_bytes()
        if image != self._file.load():
            self._file.save(image)
        self._saved = self._eeprom.revision

    def save_soon(self) -> None:
        """Write the image in a moment, beside the event loop: disks are slow."""
        self._task = asyncio.get_running_loop().create_task(self._save_later())

    async def close(self) -> None:
        """Write what is not written yet and let go of the file."""
        while self._task is not None:
            await self._task
        if self.changed or self._failed:
            await self._save()
        self._file.close()

    async def _save_later(self) -> None:
        await asyncio.sleep(DELAY_S)
        await self._save()
        self._task = None
        if self.changed:
            self.save_soon()

    async def _save(self) -> None:
        revision, image = self._eeprom.revision, self._eeprom.to_bytes()
        self._saved = revision
        self._failed = False
        try:
            await asyncio.to_thread(self._file.save, image)
        except EepromFileError as error:
            self._failed = True
            self._report(f"memory not saved: {error}")
