"""The motor drivers behind the motion chip, as far as the firmware knows them.

Status words come back through the motion chip's driver chain.  Mixed decay and full step are cells of the
chain table, which the firmware rewrites: where a bridge's decay bit is Zero, the falling-current signal or One;
where its current bits are those of the wave or all One.  On a TMCM-342 there are no drivers and everything reads 0.

Source: manual 7.1 (203, 206, 208, 211) and 9.2; TMC429 datasheet 8.2.1, 11.4; TMC246 datasheet 4; fidelity
FW-30 to FW-33.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from tmcm34x.board.board import DRIVER_BITS
from tmcm34x.board.models import FAST_DECAY_A, FAST_DECAY_B, ONE, TMC236_CELLS, ZERO
from tmcm34x.chips.registers import DATA, FIELDS, read_ram, write_ram
from tmcm34x.chips.tmc246 import LOAD_MAX, LOAD_SHIFT

if TYPE_CHECKING:
    from tmcm34x.board.circuit import Circuit
    from tmcm34x.firmware.axis import AxisState

FLAGS: Final = 0xFF

_LOW: Final = FIELDS["DATAGRAM_LOW_WORD"][0]
_HIGH: Final = FIELDS["DATAGRAM_HIGH_WORD"][0]

DECAY_OFF: Final = 0
DECAY_FALLING: Final = 1
DECAY_ON: Final = 2
_DECAY_CELLS: Final = ((ZERO, ZERO), (FAST_DECAY_A, FAST_DECAY_B), (ONE, ONE))
"""Cells of the decay bits of bridges A and B."""
_FULL_CURRENT: Final = bytes((ONE,) * 4)


def load_of(status: int) -> int:
    """The load in a status word: the driver's reading is smaller for more load (fidelity FW-31)."""
    return LOAD_MAX - (status >> LOAD_SHIFT)


def status(board: Circuit, motor: int) -> int:
    """The driver's last status word, 12 bits."""
    return board.driver_statuses() >> DRIVER_BITS * (2 - motor) & (1 << DRIVER_BITS) - 1


def load(board: Circuit, motor: int) -> int:
    """The load, 0..7, greater for more (axis parameter 206)."""
    return load_of(status(board, motor)) if board.model.drivers else 0


def flags(board: Circuit, motor: int) -> int:
    """The error flags (axis parameter 208)."""
    return status(board, motor) & FLAGS


def peek_load(board: Circuit, motor: int) -> int:
    """What `load` would give now, without a datagram."""
    return load_of(board.preview_driver_status(motor)) if board.model.drivers else 0


def peek_flags(board: Circuit, motor: int) -> int:
    """What `flags` would give now, without a datagram."""
    return board.preview_driver_status(motor) & FLAGS


def datagram_words(board: Circuit) -> tuple[int, int]:
    """The chip's low and high word: what the drivers sent with the last datagram that was asked for.

    Asks for another one, which the chip sends with the next microstep or by itself after a while.
    """
    words = peek_datagram_words(board)
    board.transfer(0, _LOW.write(0))
    return words


def peek_datagram_words(board: Circuit) -> tuple[int, int]:
    """What `datagram_words` gives, without asking for another datagram."""
    transfer = board.bus(0)
    return transfer(_LOW.read()) & DATA, transfer(_HIGH.read()) & DATA


def set_pattern(board: Circuit, axis: AxisState, speed: int, mixed_decay: int, full_step: int) -> None:
    """Choose decay and current cells of a motor for a speed.

    mixed_decay: threshold, -1 always (axis parameter 203)
    full_step: threshold, 0 or 2048 never (axis parameter 211)
    """
    moderate = DECAY_FALLING if speed > mixed_decay else DECAY_OFF
    pattern = DECAY_ON if mixed_decay < 0 else moderate, 0 < full_step < speed
    if pattern != (axis.decay, axis.full_step):
        axis.decay, axis.full_step = pattern
        cells = bytearray(TMC236_CELLS)
        cells[0], cells[6] = _DECAY_CELLS[axis.decay]
        if axis.full_step:
            cells[1:5] = cells[7:11] = _FULL_CURRENT
        write_cells(board, axis.motor * len(cells), bytes(cells))


def read_cells(board: Circuit, first: int, count: int) -> bytes:
    """Cells of the chip's RAM from an even number on: 0..63 driver chain, 64..127 microstep table."""
    transfer = board.bus(0)
    cells = bytearray()
    for address in range(first // 2, (first + count) // 2):
        data = transfer(read_ram(address))
        cells += bytes((data & 63, data >> 8 & 63))
    return bytes(cells)


def write_cells(board: Circuit, first: int, cells: bytes) -> None:
    """Set cells of every motion chip's RAM from an even number on; six bits each."""
    for chip in range(len(board.model.parts)):
        transfer = board.bus(chip)
        for n in range(0, len(cells), 2):
            transfer(write_ram((first + n) // 2, cells[n], cells[n + 1]))
