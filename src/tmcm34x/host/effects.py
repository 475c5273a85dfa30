"""What a command may set in motion, and which command cannot be undone.

Source: manual 6.7, 7.1, 8.1; bank 0 parameters 0 to 38 carry the manual's warning of 8.1: wrong values damage
drivers.
"""

from __future__ import annotations

from typing import Final

from tmcm34x.host.items import ALL_MOTORS as STORED_COORDINATES
from tmcm34x.host.steps import (
    ASCII_MODE,
    FACTORY_RESET,
    RESET,
    RUN,
    START_DOWNLOAD,
    STEP,
    STOP,
)
from tmcm34x.tmcl.axis_parameters import BY_KEY as AXIS_BY_KEY
from tmcm34x.tmcl.commands import BY_MNEMONIC, MOTORS
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.global_parameters import BY_KEY as GLOBAL_BY_KEY
from tmcm34x.tmcl.global_parameters import GlobalParameter

ALL_MOTORS: Final = frozenset(range(MOTORS))
_NUMBERS: Final = {name: row.number for name, row in BY_MNEMONIC.items()}
_TURN: Final = {_NUMBERS[name] for name in ("ROR", "ROL")}
_MVP: Final = _NUMBERS["MVP"]
_COORD: Final = 2
_RFS: Final = _NUMBERS["RFS"]
_RFS_START: Final = 0
_WRITE_AXIS: Final = {_NUMBERS[name] for name in ("SAP", "AAP", "RSAP")}
_WRITE_GLOBAL: Final = {_NUMBERS[name] for name in ("SGP", "AGP")}
_MANY: Final = 0x80
"""Bit of the motor field of MVP COORD: the other bits are motors."""
_MOVING: Final = {
    AXIS_BY_KEY[key].number
    for key in ("target_position", "actual_position", "target_speed", "actual_speed", "ramp_mode")
}
"""Axis parameters that start a motor when they are written."""
_PROGRAM: Final = {RUN, STEP}

_LAST_CHIP_PARAMETER: Final = 38
_BY_NUMBER: Final = {0: {row.number: row for row in GLOBAL_BY_KEY.values() if row.bank == 0}}
_CONSEQUENCES: Final = {
    "eeprom_magic": "with any value but 228 the module has its factory settings again after the next power-on",
    "code_protection": "giving up the protection against reading erases the program; while it is protected it "
    "cannot be read",
    "baud_rate": "from the next command on the module speaks at the new rate, and a host must follow it",
    "serial_address": "from the next command on the module has the new address, and a host must follow it",
    "host_address": "replies go to another address: other hosts may no longer see them",
    "can_bit_rate": "hosts on CAN at the old bit rate no longer reach the module",
    "can_reply_id": "hosts on CAN look for replies under the old identifier",
    "can_id": "hosts on CAN no longer reach the module under the old identifier",
    "ascii_mode": "the module may start in the ASCII interface, where no binary command is answered",
    "eeprom_lock": "while the EEPROM is locked no setting can be stored",
}
"""By key: what writing a global parameter brings about that is not undone by writing another value."""


def moves(instruction: Instruction) -> frozenset[int]:
    """Motors that a command may set in motion; all of them for one that lets the program go on."""
    number, motor = instruction.number, instruction.motor
    if number in _PROGRAM:
        return ALL_MOTORS
    if number == _MVP and instruction.type == _COORD and motor & _MANY:
        return frozenset(n for n in range(MOTORS) if motor & 1 << n)
    starts = (
        number in _TURN
        or number == _MVP
        or (number == _RFS and instruction.type == _RFS_START)
        or (number in _WRITE_AXIS and instruction.type in _MOVING)
    )
    return frozenset({motor}) if starts else frozenset()


def commands(instruction: Instruction) -> frozenset[int]:
    """Motors whose motion a command decides on: those that it starts, stops or takes a search away from."""
    if instruction.number in {_NUMBERS["MST"], _RFS}:
        return frozenset({instruction.motor})
    if instruction.number in {STOP, RESET}:
        return frozenset()
    return moves(instruction)


def stores(instruction: Instruction) -> bool:
    """Whether a command writes the EEPROM."""
    number, type_, motor, _ = instruction
    if number in _WRITE_GLOBAL:
        row = _BY_NUMBER[0].get(type_) if motor == 0 else None
        return row is not None and row.stored
    storing = {_NUMBERS["STAP"], _NUMBERS["STGP"], START_DOWNLOAD}
    return number in storing or (number == _NUMBERS["SCO"] and motor == STORED_COORDINATES)


def warning(instruction: Instruction) -> str:
    """What the user should know before a command goes to a real module; empty where it is harmless."""
    return (
        consequence(instruction)
        or ("may move a motor" if moves(instruction) else "")
        or ("writes the EEPROM" if stores(instruction) else "")
    )


def consequence(instruction: Instruction) -> str:
    """What a command does that cannot be undone, as a sentence without its full stop; empty for all others."""
    match instruction.number:
        case number if number == FACTORY_RESET:
            return "All stored parameters, addresses and baud rate too, go back to their defaults; the module restarts"
        case number if number == ASCII_MODE:
            return "The module enters the ASCII interface: binary commands get no reply until BIN ends it"
        case number if number == START_DOWNLOAD:
            return "The module stores what follows over its program, until command 133"
        case number if number in _WRITE_GLOBAL:
            row = _BY_NUMBER[0].get(instruction.type) if instruction.motor == 0 else None
            return "" if row is None else _of_parameter(row, instruction.value)
        case _:
            return ""


def _of_parameter(row: GlobalParameter, value: int) -> str:
    if row.number <= _LAST_CHIP_PARAMETER:
        return f"{row.name} goes straight to the chips: the manual warns that wrong values damage the drivers"
    text = _CONSEQUENCES.get(row.key)
    return f"{row.name} becomes {value}: {text}" if text else ""
