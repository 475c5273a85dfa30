"""Looking at a module without acting on it: what a reading command would be answered with.

Most readings leave no trace and are done as the command does them.  A parameter whose row names an `effect` of
reading has a reader of its own here, which changes nothing: no datagram that a driver or device would notice, no
random number drawn.  Whoever shows values by itself (an IDE, a debugger, a monitor) looks in this way only.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Final

from tmcm34x.firmware.dispatch import ALL_COORDINATES
from tmcm34x.tmcl import axis_parameters, global_parameters
from tmcm34x.tmcl.commands import BY_MNEMONIC, MOTORS, RFS_TYPES
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.firmware.module import Module
    from tmcm34x.tmcl.datagram import Instruction

_GAP, _GGP, _GCO, _GIO, _RFS = (BY_MNEMONIC[name].number for name in ("GAP", "GGP", "GCO", "GIO", "RFS"))
_RFS_STATUS: Final = dict(RFS_TYPES)["STATUS"]


def _load(module: Module, motor: int) -> int | None:
    return module.drivers.peek_load(motor)


def _flags(module: Module, motor: int) -> int | None:
    return module.drivers.peek_flags(motor)


def _encoder(module: Module, motor: int) -> int | None:
    return module.encoders.peek(motor)


def _low_word(module: Module) -> int:
    return module.drivers.peek_datagram_words()[0]


def _high_word(module: Module) -> int:
    return module.drivers.peek_datagram_words()[1]


def _random(module: Module) -> int:
    """The number that was drawn last, or the one that the seed stands for."""
    return module.last_random_number


AXIS_READERS: Final[Mapping[str, Callable[[Module, int], int | None]]] = {
    "load_value": _load,
    "driver_error_flags": _flags,
    "encoder_position": _encoder,
}
"""Readers of the axis parameters with an effect, by key; None is what cannot be known without acting."""

GLOBAL_READERS: Final[Mapping[str, Callable[[Module], int]]] = {
    "datagram_low_word": _low_word,
    "datagram_high_word": _high_word,
    "random_number": _random,
}
"""Readers of the global parameters with an effect, by key."""


def peek(module: Module, instruction: Instruction) -> tuple[int, int]:
    """Status and value that GAP, GGP, GCO, GIO or RFS STATUS would be answered with now.

    Any other command is not available (status 6), also GCO with motor 255, which copies, and a reading whose value
    cannot be known without acting.
    """
    number, type_, motor, _ = instruction
    if number == _GAP:
        return _peek_axis(module, instruction)
    if number == _GGP:
        return _peek_global(module, instruction)
    harmless = number == _GIO or (number == _GCO and motor != ALL_COORDINATES)
    harmless = harmless or (number == _RFS and type_ == _RFS_STATUS)
    return module.dispatcher.execute(instruction) if harmless else (Status.NOT_AVAILABLE, 0)


def _peek_axis(module: Module, instruction: Instruction) -> tuple[int, int]:
    _, type_, motor, _ = instruction
    row = axis_parameters.BY_NUMBER.get(type_)
    reader = AXIS_READERS.get(row.key) if row and module.board.model.number in row.models else None
    if reader is None or motor >= MOTORS:
        return module.dispatcher.execute(instruction)
    value = reader(module, motor)
    return (Status.NOT_AVAILABLE, 0) if value is None else (Status.OK, value)


def _peek_global(module: Module, instruction: Instruction) -> tuple[int, int]:
    _, type_, bank, _ = instruction
    row = global_parameters.BY_NUMBER.get((bank, type_))
    reader = GLOBAL_READERS.get(row.key) if row else None
    return module.dispatcher.execute(instruction) if reader is None else (Status.OK, reader(module))
