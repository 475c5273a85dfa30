"""The program memory as hosts see it: download, reading back, protection.

Source: manual 6.7.36 (132 to 134), 8.1 parameter 81; fidelity PROG-15 to PROG-17.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from tmcm34x.tmcl.commands import BY_NUMBER, PROGRAM_SIZE
from tmcm34x.tmcl.datagram import END_MARK, Instruction
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.firmware.storage import Eeprom

_PROTECTION: Final = 81
_NO_READING, _NO_WRITING = 1, 2
"""Bits of global parameter 81."""


class Memory:
    """The program memory in `eeprom`, and the download that is going on."""

    __slots__ = ("_eeprom", "address", "downloading")

    def __init__(self, eeprom: Eeprom) -> None:
        self._eeprom = eeprom
        self.downloading = False
        self.address = 0
        """Where the next command of a download goes."""

    def __getitem__(self, address: int) -> Instruction:
        """The command at an address from 0 up."""
        return self._eeprom.read_instruction(address) if address < PROGRAM_SIZE else END_MARK

    @property
    def _protection(self) -> int:
        return self._eeprom.global_values[_PROTECTION]

    def may_download(self, address: int) -> Status:
        """Whether a download to `address` can begin."""
        if not 0 <= address < PROGRAM_SIZE:
            return Status.INVALID_VALUE
        return Status.NOT_AVAILABLE if self._protection & _NO_WRITING else Status.OK

    def store(self, instruction: Instruction) -> Status:
        """Store the next command of a download; control functions are refused, and so is a 2,049th command."""
        row = BY_NUMBER.get(instruction.number)
        if row is not None and "control" in row.where:
            return Status.NOT_AVAILABLE
        if self.address >= PROGRAM_SIZE:
            return Status.INVALID_VALUE
        self._eeprom.write_instruction(self.address, instruction)
        self.address += 1
        return Status.LOADED

    def read(self, address: int) -> Instruction | Status:
        """The stored command at `address`, or the status that refuses it."""
        if not 0 <= address < PROGRAM_SIZE:
            return Status.INVALID_VALUE
        if self._protection & _NO_READING:
            return Status.NOT_AVAILABLE
        return self._eeprom.read_instruction(address)

    def erase(self) -> None:
        """Wipe it: its protection against reading was given up."""
        self._eeprom.erase_program()
