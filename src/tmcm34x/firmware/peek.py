"""Looking at a module without acting on it: what a reading command would be answered with.

Most readings leave no trace and are done as the command does them.  A parameter whose row names an `effect` of
reading has a reader of its own here, which changes nothing: no datagram that a driver or device would notice, no
random number drawn.  Whatever shows values by itself (an IDE, a debugger, a monitor) looks in this way only.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Final

from tmcm34x.firmware import drivers, encoder
from tmcm34x.firmware.commands.coordinates import ALL_COORDINATES
from tmcm34x.firmware.dispatch import execute
from tmcm34x.tmcl.commands import MOTORS, RFS_TYPES
from tmcm34x.tmcl.numbers import AP, COMMAND, GP
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.firmware.state import ModuleState, Result
    from tmcm34x.tmcl.datagram import Instruction

_RFS_STATUS: Final = dict(RFS_TYPES)["STATUS"]


def _load(core: ModuleState, motor: int) -> int | None:
    return drivers.peek_load(core.circuit, motor)


def _flags(core: ModuleState, motor: int) -> int | None:
    return drivers.peek_flags(core.circuit, motor)


def _low_word(core: ModuleState) -> int:
    return drivers.peek_datagram_words(core.circuit)[0]


def _high_word(core: ModuleState) -> int:
    return drivers.peek_datagram_words(core.circuit)[1]


def _random(core: ModuleState) -> int:
    """The number that was drawn last, or the one that the seed stands for."""
    return core.last_random_number


AXIS_READERS: Final[Mapping[int, Callable[[ModuleState, int], int | None]]] = {
    AP.LOAD_VALUE: _load,
    AP.DRIVER_ERROR_FLAGS: _flags,
    AP.ENCODER_POSITION: encoder.peek,
}
"""Readers of the axis parameters with an effect; None is what cannot be known without acting."""

GLOBAL_READERS: Final[Mapping[int, Callable[[ModuleState], int]]] = {
    GP.DATAGRAM_LOW_WORD: _low_word,
    GP.DATAGRAM_HIGH_WORD: _high_word,
    GP.RANDOM_NUMBER: _random,
}
"""Readers of the global parameters of bank 0 with an effect."""


def peek(core: ModuleState, instruction: Instruction) -> Result:
    """Status and value that GAP, GGP, GCO, GIO or RFS STATUS would be answered with now.

    Any other command is not available (status 6), also GCO with motor 255, which copies, and a reading whose value
    cannot be known without acting.
    """
    number, type_, motor, _ = instruction
    if number == COMMAND.GAP and motor < MOTORS and type_ in AXIS_READERS:
        return _peek_axis(core, instruction)
    if number == COMMAND.GGP and motor == 0 and type_ in GLOBAL_READERS:
        return Status.OK, GLOBAL_READERS[type_](core)
    if _harmless(number, type_, motor):
        return execute(core, *instruction)
    return Status.NOT_AVAILABLE, 0


def _harmless(number: int, type_: int, motor: int) -> bool:
    if number == COMMAND.GCO:
        return motor != ALL_COORDINATES
    if number == COMMAND.RFS:
        return type_ == _RFS_STATUS
    return number in {COMMAND.GAP, COMMAND.GGP, COMMAND.GIO}


def _peek_axis(core: ModuleState, instruction: Instruction) -> Result:
    _, type_, motor, _ = instruction
    if not core.tables.axis_readers[type_]:
        return Status.WRONG_TYPE, 0
    value = AXIS_READERS[type_](core, motor)
    return (Status.NOT_AVAILABLE, 0) if value is None else (Status.OK, value)
