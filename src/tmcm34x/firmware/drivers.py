"""The motor drivers behind the motion chip, as far as the firmware knows them.

Status words come back through the motion chip's driver chain.  Mixed decay and full step are cells of the
chain table, which the firmware rewrites: where a bridge's decay bit is Zero, the falling-current signal or One;
where its current bits are those of the wave or all One.

Source: manual 7.1 (203, 206, 208, 211) and 9.2; TMC429 datasheet 8.2.1, 11.4; TMC246 datasheet 4; fidelity
FW-30 to FW-33.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from tmcm34x.board.board import DRIVER_BITS
from tmcm34x.board.models import FAST_DECAY_A, FAST_DECAY_B, ONE, TMC236_CELLS, ZERO
from tmcm34x.chips.registers import DATA, FIELDS, read_ram, write_ram

if TYPE_CHECKING:
    from tmcm34x.board.board import Board

LOAD_SHIFT: Final = 9
LOAD_MAX: Final = 7
FLAGS: Final = 0xFF

_LOW: Final = FIELDS["DATAGRAM_LOW_WORD"][0]
_HIGH: Final = FIELDS["DATAGRAM_HIGH_WORD"][0]

_DECAY_OFF: Final = ZERO, ZERO
_DECAY_FALLING: Final = FAST_DECAY_A, FAST_DECAY_B
_DECAY_ON: Final = ONE, ONE
_FULL_CURRENT: Final = bytes((ONE,) * 4)


def load_of(status: int) -> int:
    """The load in a status word: the driver's reading is smaller for more load (fidelity FW-31)."""
    return LOAD_MAX - (status >> LOAD_SHIFT)


class Drivers:
    """The drivers of all motors; on a TMCM-342 there are none and everything reads 0."""

    __slots__ = ("_board", "_patterns")

    def __init__(self, board: Board) -> None:
        self._board = board
        self._patterns: list[tuple[tuple[int, int], bool]] = []
        self.forget()

    def forget(self) -> None:
        """Assume that the chain in the chip is the one of a plain wave without mixed decay."""
        self._patterns = [(_DECAY_OFF, False)] * len(self._board.model.wiring)

    def status(self, motor: int) -> int:
        """The driver's last status word, 12 bits."""
        return self._board.driver_statuses() >> DRIVER_BITS * (2 - motor) & (1 << DRIVER_BITS) - 1

    def datagram_words(self) -> tuple[int, int]:
        """The chip's low and high word: what the drivers sent with the last datagram that was asked for.

        Asks for another one, which the chip sends with the next microstep or by itself after a while.
        """
        words = self.peek_datagram_words()
        self._board.transfer(0, _LOW.write(0))
        return words

    def peek_datagram_words(self) -> tuple[int, int]:
        """What `datagram_words` gives, without asking for another datagram."""
        transfer = self._board.bus(0)
        return transfer(_LOW.read()) & DATA, transfer(_HIGH.read()) & DATA

    def load(self, motor: int) -> int:
        """The load, 0..7, greater for more (axis parameter 206)."""
        return load_of(self.status(motor)) if self._board.model.drivers else 0

    def peek_load(self, motor: int) -> int:
        """What `load` would give now, without a datagram."""
        return load_of(self._board.preview_driver_status(motor)) if self._board.model.drivers else 0

    def flags(self, motor: int) -> int:
        """The error flags (axis parameter 208)."""
        return self.status(motor) & FLAGS

    def peek_flags(self, motor: int) -> int:
        """What `flags` would give now, without a datagram."""
        return self._board.preview_driver_status(motor) & FLAGS

    def set_pattern(self, motor: int, speed: int, mixed_decay: int, full_step: int) -> None:
        """Choose decay and current cells for a speed.

        mixed_decay: threshold, -1 always (axis parameter 203)
        full_step: threshold, 0 or 2048 never (axis parameter 211)
        """
        moderate = _DECAY_FALLING if speed > mixed_decay else _DECAY_OFF
        pattern = _DECAY_ON if mixed_decay < 0 else moderate, 0 < full_step < speed
        if pattern != self._patterns[motor]:
            self._patterns[motor] = pattern
            self._write_pattern(motor, *pattern)

    def _write_pattern(self, motor: int, decay: tuple[int, int], full_step: bool) -> None:
        cells = bytearray(TMC236_CELLS)
        cells[0], cells[6] = decay
        if full_step:
            cells[1:5] = cells[7:11] = _FULL_CURRENT
        self.write_cells(motor * len(cells), bytes(cells))

    def read_cells(self, first: int, count: int) -> bytes:
        """Cells of the chip's RAM from an even number on: 0..63 driver chain, 64..127 microstep table."""
        transfer = self._board.bus(0)
        cells = bytearray()
        for address in range(first // 2, (first + count) // 2):
            data = transfer(read_ram(address))
            cells += bytes((data & 63, data >> 8 & 63))
        return bytes(cells)

    def write_cells(self, first: int, cells: bytes) -> None:
        """Set cells of every motion chip's RAM from an even number on; six bits each."""
        for chip in range(len(self._board.model.parts)):
            transfer = self._board.bus(chip)
            for n in range(0, len(cells), 2):
                transfer(write_ram((first + n) // 2, cells[n], cells[n + 1]))
