from __future__ import annotations

import pytest

from firmware.hosts import switched_on
from tmcm34x.board.models import TMC236_CELLS
from tmcm34x.firmware import drivers


def test_a_342_has_no_loads_and_no_flags():
    board = switched_on(342).board
    for motor in range(3):
        for read in (drivers.status, drivers.load, drivers.flags, drivers.peek_load, drivers.peek_flags):
            assert read(board, motor) == 0


@pytest.mark.parametrize(
    ("speed", "mixed_decay", "full_step", "decay", "full"),
    [
        (500, 2048, 0, (0x10, 0x10), False),
        (500, 500, 500, (0x10, 0x10), False),
        (501, 500, 500, (0x07, 0x0F), True),
        (1, 0, 1, (0x07, 0x0F), False),
        (0, -1, 2048, (0x11, 0x11), False),
        (2047, -1, 2048, (0x11, 0x11), False),
        (2047, 2048, 1, (0x10, 0x10), True),
    ],
)
def test_decay_and_current_cells_by_speed(speed, mixed_decay, full_step, decay, full):
    module = switched_on()
    drivers.set_pattern(module.board, module.axes[1], speed, mixed_decay, full_step)
    expected = bytearray(TMC236_CELLS)
    expected[0], expected[6] = decay
    if full:
        expected[1:5] = expected[7:11] = b"\x11" * 4
    assert drivers.read_cells(module.board, 12, 12) == expected
    assert drivers.read_cells(module.board, 0, 12) == bytes(TMC236_CELLS)


def test_cells_are_written_to_every_chip_and_only_when_they_change():
    board = switched_on(342).board
    drivers.write_cells(board, 64, bytes((1, 2, 3, 4)))
    assert [drivers.read_cells(board, 64, 4)] == [bytes((1, 2, 3, 4))]
    assert all(chip.transfer(1 << 31 | 32 << 25 | 1 << 24) & 0xFFFF == 0x0201 for chip in board.chips)
