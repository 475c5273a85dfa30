"""Changes of an EEPROM as plain values, and as the entries of a journal behind its image.

An entry has 16 bytes, all numbers little endian:

u8        cell, see `Cell`
u8        motor, 0 where the cell has none
u16       number of the parameter, variable or coordinate, index of the first table cell, address of an instruction
i64       value; eight table cells or the seven bytes of an instruction, first one lowest
u32       CRC-32 of the 12 bytes before, begun with the CRC of the entry before, or of the image

So an entry that is damaged, missing in the middle or of another image is found.  An entry that is incomplete, or zeros
to the end, was never written to its end: it was acknowledged to no host.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable
from enum import IntEnum
from typing import Final, NamedTuple

TABLE_CELLS: Final = 8
"""Cells of the driver chain or microstep table in one change."""

_BODY: Final = struct.Struct("<BBHq")
_CRC: Final = struct.Struct("<I")
ENTRY_SIZE: Final = _BODY.size + _CRC.size


class Cell(IntEnum):
    """What part of the memory was written."""

    AXIS_PARAMETER = 1
    GLOBAL_PARAMETER = 2
    USER_VARIABLE = 3
    COORDINATE = 4
    DRIVER_CHAIN = 5
    MICROSTEP_TABLE = 6
    INSTRUCTION = 7
    PROGRAM_ERASED = 8
    DEFAULTS = 9


class EepromWrite(NamedTuple):
    """One write; see the module's text."""

    cell: Cell
    motor: int = 0
    number: int = 0
    value: int = 0


class JournalError(ValueError):
    """An entry that cannot be right; the text names it."""


class Chain:
    """The running CRC of a journal: begins with that of its image."""

    def __init__(self, crc: int) -> None:
        self._crc = crc

    def seal(self, changes: Iterable[EepromWrite]) -> bytes:
        """The entries of `changes`, to be appended."""
        entries = b""
        for change in changes:
            body = _BODY.pack(*change)
            self._crc = zlib.crc32(body, self._crc)
            entries += body + _CRC.pack(self._crc)
        return entries

    def open(self, journal: bytes) -> list[EepromWrite]:
        """The changes in whole entries; raises `JournalError`."""
        changes: list[EepromWrite] = []
        for start in range(0, len(journal), ENTRY_SIZE):
            body, crc = journal[start : start + _BODY.size], journal[start + _BODY.size : start + ENTRY_SIZE]
            self._crc = zlib.crc32(body, self._crc)
            if crc != _CRC.pack(self._crc):
                raise JournalError(f"wrong CRC in journal entry {start // ENTRY_SIZE + 1}")
            cell, *fields = _BODY.unpack(body)
            changes.append(EepromWrite(Cell(cell), *fields))
        return changes


def unfinished(journal: bytes) -> int:
    """How many bytes at the end of a journal belong to entries that were never written to their end."""
    whole = len(journal.rstrip(b"\0"))
    whole += -whole % ENTRY_SIZE  # the last bytes of an entry may be zeros
    return len(journal) - min(whole, len(journal) - len(journal) % ENTRY_SIZE)
