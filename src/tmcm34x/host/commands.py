"""The commands of a host's operations, by what they do.

Source: manual 6.7.1 to 6.7.4, 6.7.5, 6.7.7, 6.7.8, 6.7.11 to 6.7.13.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final, Literal

from tmcm34x.host.polling import AXIS_BANK
from tmcm34x.host.steps import MOVES, NUMBERS, SEARCHES
from tmcm34x.tmcl.axis_parameters import BY_KEY
from tmcm34x.tmcl.commands import MOTORS
from tmcm34x.tmcl.datagram import Instruction

Keeping = Literal["store", "restore"]
SPEED: Final = BY_KEY["actual_speed"].number
"""Number of the parameter that says whether a motor stands."""
_GROUP: Final = 0x80
"""In the motor field of MVP COORD: the other bits are a mask of motors."""
_KEEPING: Final = {
    ("store", True): "STAP", ("store", False): "STGP", ("restore", True): "RSAP", ("restore", False): "RSGP",
}  # fmt: skip
"""Mnemonics by what is to be done and whether it is an axis parameter."""


def stop(motor: int) -> Instruction:
    """Bring a motor to rest along its ramp."""
    return Instruction(NUMBERS["MST"], 0, motor)


def rotate(motor: int, velocity: int) -> Instruction:
    """Turn a motor, to the left where the velocity is negative."""
    return Instruction(NUMBERS["ROR" if velocity >= 0 else "ROL"], 0, motor, abs(velocity))


def move_by(motor: int, distance: int) -> Instruction:
    """Move a motor by a distance from where it is [microsteps]."""
    return Instruction(NUMBERS["MVP"], MOVES["REL"], motor, distance)


def start_search(motor: int) -> Instruction:
    """Start the reference search of a motor."""
    return Instruction(NUMBERS["RFS"], SEARCHES["START"], motor)


def stop_search(motor: int) -> Instruction:
    """Give it up."""
    return Instruction(NUMBERS["RFS"], SEARCHES["STOP"], motor)


def search_state(motor: int) -> Instruction:
    """Ask for its state; 0 is over."""
    return Instruction(NUMBERS["RFS"], SEARCHES["STATUS"], motor)


def to_coordinate(motors: Iterable[int], coordinate: int) -> Instruction:
    """Move motors to a stored coordinate, so that they arrive together."""
    mask = _GROUP | sum(1 << motor for motor in motors)
    return Instruction(NUMBERS["MVP"], MOVES["COORD"], mask, coordinate)


def read_axis(key: str, motor: int) -> Instruction:
    """Read an axis parameter."""
    return Instruction(NUMBERS["GAP"], BY_KEY[key].number, motor)


def set_axis(key: str, motor: int, value: int) -> Instruction:
    """Set an axis parameter."""
    return Instruction(NUMBERS["SAP"], BY_KEY[key].number, motor, value)


def keep(action: Keeping, bank: int, number: int, motor: int) -> Instruction:
    """Store a parameter in the EEPROM, or bring it back from there; `bank` as for `polling.reader`."""
    axis = bank == AXIS_BANK
    return Instruction(NUMBERS[_KEEPING[action, axis]], number, motor if axis else bank)


def motors_of(mask: int) -> str:
    """The motors of a mask, for people."""
    return ", ".join(str(motor) for motor in range(MOTORS) if mask & 1 << motor) or "none"
