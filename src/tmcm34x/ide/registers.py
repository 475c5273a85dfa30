"""The registers of a virtual module's motion chips, looked at without a datagram.

Source: TMC429 datasheet, sections as in `chips.registers`.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from tmcm34x.chips.registers import COMMON, REGISTERS, Register
from tmcm34x.chips.tmc429 import bus
from tmcm34x.ide import wire
from tmcm34x.tmcl.commands import MOTORS

if TYPE_CHECKING:
    from tmcm34x.board.board import Board
    from tmcm34x.chips.tmc429.chip import Tmc429


def registers(board: Board) -> list[wire.RegisterShape]:
    """Each register of each chip that drives a motor."""
    return list(_registers(board))


def _registers(board: Board) -> Iterator[wire.RegisterShape]:
    places = [board.wiring(motor) for motor in range(MOTORS)]
    for number in sorted({chip for chip, _ in places}):
        chip = board.chips[number]
        for motor, (_, place) in enumerate(places):
            if places[motor][0] == number:
                yield from (
                    _shape(chip, number, row, motor, place) for row in REGISTERS if row.area != COMMON
                )
        yield from (_shape(chip, number, row, -1, COMMON) for row in REGISTERS if row.area == COMMON)


def _shape(chip: Tmc429, number: int, row: Register, motor: int, place: int) -> wire.RegisterShape:
    value = _value(chip, row, place)
    fields = [
        wire.FieldShape(field.name, field.high, field.low, field.access, field.get(value))
        for field in row.fields
    ]
    return wire.RegisterShape(number, motor, row.name, row.index, value, row.section, fields)


def _value(chip: Tmc429, row: Register, place: int) -> int:
    """What a datagram would read, without the datagram: one would also wake a chip that sleeps."""
    return bus.read_common(chip, row.index) if row.area == COMMON else bus.read_motor(chip, place, row.index)
