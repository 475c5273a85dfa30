"""Where the parameters live: what reading and writing each of them does.

The rows of `tmcl.axis_parameters` and `tmcl.global_parameters` say which numbers exist, their ranges and what is
stored.  The tables here add only what a row cannot say: the chip's register field behind a number, and what
else a new value brings about.

An axis parameter without an entry in `_READ` lives in `Axis.values`; writing puts the value there and then
does what `_APPLY` says, which is also how power-on brings the stored values into effect.

Source: manual 6.7.5 to 6.7.12, chapters 7 and 8; fidelity FW-50 to FW-55.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import TYPE_CHECKING, Final

from tmcm34x.board.models import CELLS
from tmcm34x.chips.registers import DATA, FIELDS
from tmcm34x.clock import MS
from tmcm34x.firmware.motion import (
    MOTOR_FIELDS,
    PULSE_DIV,
    RAMP_DIV,
    RAMP_MODE,
    V_MAX,
    VELOCITY,
    Axis,
)
from tmcm34x.tmcl.axis_parameters import AXIS_PARAMETERS, AxisParameter
from tmcm34x.tmcl.datagram import signed32
from tmcm34x.tmcl.global_parameters import (
    BY_NUMBER,
    GLOBAL_PARAMETERS,
    LOCK_KEY,
    UNLOCK_KEY,
    GlobalParameter,
)
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.firmware.module import Module

AxisReader = Callable[["Module", Axis], int]
AxisWriter = Callable[["Module", Axis, int], Status]
Effect = Callable[["Module", Axis, int], None]
GlobalReader = Callable[["Module"], int]
GlobalWriter = Callable[["Module", int], Status]

OK: Final = Status.OK
EXTENSION: Final = 1
"""Bank of a customer's extension of the firmware."""
VARIABLES: Final = 2
"""Bank of the user variables."""

# Axis parameters: the register field of the motion chip behind each number.

_CHIP_FIELDS: Final = {
    0: "X_TARGET",
    1: "X_ACTUAL",
    2: "V_TARGET",
    3: "V_ACTUAL",
    12: "DISABLE_STOP_R",
    13: "DISABLE_STOP_L",
    130: "V_MIN",
    135: "A_ACTUAL",
    138: "RAMP_MODE",
    140: "USRS",
    149: "SOFT_STOP",
    153: "RAMP_DIV",
    154: "PULSE_DIV",
}


def _chip_reader(number: int) -> AxisReader:
    field = MOTOR_FIELDS[_CHIP_FIELDS[number]]

    def read(_module: Module, axis: Axis) -> int:
        return axis.read(field)

    return read


def _ram_reader(number: int) -> AxisReader:
    def read(_module: Module, axis: Axis) -> int:
        return axis.values[number]

    return read


def _chip_writer(number: int) -> AxisWriter:
    """Write a register of the ramp generator, which may start the motor."""
    field = MOTOR_FIELDS[_CHIP_FIELDS[number]]

    def write(module: Module, axis: Axis, value: int) -> Status:
        axis.write(field, value)
        module.supervision.started(axis.motor)
        return OK

    return write


def _ram_writer(number: int, effect: Effect | None) -> AxisWriter:
    def write(module: Module, axis: Axis, value: int) -> Status:
        axis.values[number] = value
        if effect is not None:
            effect(module, axis, value)
        return OK

    return write


_READ: Final[Mapping[int, AxisReader]] = {
    **{number: _chip_reader(number) for number in (0, 1, 2, 3, 138)},
    8: lambda _, axis: int(axis.at_target),
    9: lambda _, axis: int(axis.left_switch),
    10: lambda _, axis: int(axis.right_switch),
    11: lambda _, axis: int(axis.left_switch),
    135: lambda _, axis: abs(axis.read(MOTOR_FIELDS["A_ACTUAL"])),
    206: lambda module, axis: module.drivers.load(axis.motor),
    208: lambda module, axis: module.drivers.flags(axis.motor),
    209: lambda module, axis: module.encoders.position(axis.motor),
}


def _write_ramp_mode(module: Module, axis: Axis, mode: int) -> Status:
    """Change the mode as the motion commands do, with the speed limit that belongs to it."""
    if mode == VELOCITY:
        module.motion.enter_velocity_mode(axis.motor)
        module.supervision.started(axis.motor)
    else:
        module.motion.enter_ramp_mode(axis.motor, mode)
    return OK


def _write_encoder(module: Module, axis: Axis, position: int) -> Status:
    if not module.encoders.interface:
        return Status.NOT_AVAILABLE
    module.encoders.preload(axis.motor, position)
    return OK


_WRITE: Final[Mapping[int, AxisWriter]] = {
    **{number: _chip_writer(number) for number in (0, 1, 2, 3)},
    138: _write_ramp_mode,
    209: _write_encoder,
}
"""Parameters that are no value in RAM."""


def _apply_field(number: int) -> Effect:
    field = MOTOR_FIELDS[_CHIP_FIELDS[number]]

    def apply(_module: Module, axis: Axis, value: int) -> None:
        axis.write(field, value)

    return apply


def _apply_max_speed(module: Module, axis: Axis, speed: int) -> None:
    """At once in position mode; in velocity mode with the next positioning command."""
    if not axis.open:
        axis.write(V_MAX, speed)
        module.supervision.freed(axis.motor)


def _apply_acceleration(module: Module, axis: Axis, acceleration: int) -> None:
    axis.set_acceleration(acceleration)
    module.supervision.freed(axis.motor)


def _apply_ramp_divisor(_module: Module, axis: Axis, value: int) -> None:
    axis.write(RAMP_DIV, value)
    axis.set_acceleration(axis.values[5])


def _apply_pulse_divisor(_module: Module, axis: Axis, value: int) -> None:
    axis.write(PULSE_DIV, value)
    axis.set_acceleration(axis.values[5])


def _apply_stop_switch(number: int) -> Effect:
    """The right and left stop functions are the reference search's while it runs (manual 9.1)."""
    field = MOTOR_FIELDS[_CHIP_FIELDS[number]]

    def apply(module: Module, axis: Axis, value: int) -> None:
        if not module.searches[axis.motor].state:
            axis.write(field, value)
            module.supervision.freed(axis.motor)

    return apply


def _apply_watch(module: Module, axis: Axis, _value: int) -> None:
    module.supervision.settings_changed(axis.motor)


def _apply_rest_time(module: Module, axis: Axis, _value: int) -> None:
    module.supervision.rest_time_changed(axis.motor)


def _apply_prescaler(module: Module, axis: Axis, value: int) -> None:
    module.encoders.configure(axis.motor, value)


_APPLY: Final[Mapping[int, Effect]] = {
    4: _apply_max_speed,
    5: _apply_acceleration,
    6: _apply_watch,
    7: _apply_watch,
    12: _apply_stop_switch(12),
    13: _apply_stop_switch(13),
    130: _apply_field(130),
    140: _apply_field(140),
    149: _apply_field(149),
    153: _apply_ramp_divisor,
    154: _apply_pulse_divisor,
    203: _apply_watch,
    204: _apply_rest_time,
    205: _apply_watch,
    210: _apply_prescaler,
    211: _apply_watch,
    212: _apply_watch,
    214: _apply_rest_time,
}
"""What a new value does, once it is in RAM."""


def _axis_writer(row: AxisParameter) -> AxisWriter:
    return _WRITE.get(row.number) or _ram_writer(row.number, _APPLY.get(row.number))


@cache
def axis_readers(model: int) -> tuple[AxisReader | None, ...]:
    """How GAP reads each number 0..255 on `model`; None for one that is not there."""
    readers: list[AxisReader | None] = [None] * 256
    for row in AXIS_PARAMETERS:
        if row.readable and model in row.models:
            readers[row.number] = _READ.get(row.number) or _ram_reader(row.number)
    return tuple(readers)


@cache
def axis_writers(model: int) -> tuple[tuple[AxisParameter, AxisWriter] | None, ...]:
    """Row and writer for each number 0..255 that SAP may write on `model`."""
    writers: list[tuple[AxisParameter, AxisWriter] | None] = [None] * 256
    for row in AXIS_PARAMETERS:
        if row.writable and model in row.models:
            writers[row.number] = (row, _axis_writer(row))
    return tuple(writers)


def restore_axes(module: Module) -> None:
    """Power-on: all axis parameters from the EEPROM, and then into effect."""
    model = module.board.model.number
    for axis, stored in zip(module.axes, module.eeprom.axis_values, strict=True):
        axis.values.update(
            (row.number, row.default)
            for row in AXIS_PARAMETERS
            if model in row.models and row.number not in _READ
        )
        axis.values.update(stored)
        axis.write(RAMP_MODE, 0)
    for number, effect in _APPLY.items():
        for axis in module.axes:
            if number in axis.values:
                effect(module, axis, axis.values[number])


# Global parameters of bank 0.


def _cover(name: str) -> tuple[GlobalReader, GlobalWriter]:
    """Position or length of the cover datagram; the chip reads the position one higher than it was written."""
    register, field = FIELDS[name]
    position = FIELDS["COVER_POSITION"][1]

    def written(module: Module) -> int:
        data = module.board.transfer(0, register.read()) & register.writable
        return position.put(data, position.get(data) - 1)

    def read(module: Module) -> int:
        return field.get(written(module))

    def write(module: Module, value: int) -> Status:
        data = field.put(written(module), value)
        for chip in range(len(module.board.model.parts)):
            module.board.transfer(chip, register.write(data))
        return OK

    return read, write


def _whole(name: str) -> tuple[GlobalReader, GlobalWriter]:
    """The common register that holds the field `name`, as one number of 24 bits, written to all chips."""
    register = FIELDS[name][0]

    def read(module: Module) -> int:
        return module.board.transfer(0, register.read()) & DATA

    def write(module: Module, value: int) -> Status:
        for chip in range(len(module.board.model.parts)):
            module.board.transfer(chip, register.write(value))
        return OK

    return read, write


def _cells(first: int) -> tuple[GlobalReader, GlobalWriter]:
    """Four cells of the chip's RAM as a long word, lowest cell in the lowest byte."""

    def read(module: Module) -> int:
        return int.from_bytes(module.drivers.read_cells(first, 4), "little")

    def write(module: Module, value: int) -> Status:
        module.drivers.write_cells(first, (value & 0x3F3F3F3F).to_bytes(4, "little"))
        return OK

    return read, write


def _read_switches(module: Module) -> int:
    """The switches of all motors, in the order of one chip that has all of them."""
    return sum((2 * axis.left_switch + axis.right_switch) << 2 * axis.motor for axis in module.axes)


def _write_lock(module: Module, value: int) -> Status:
    if value not in {LOCK_KEY, UNLOCK_KEY}:
        return Status.INVALID_VALUE
    module.eeprom.set_global_value(73, int(value == LOCK_KEY))
    return OK


def _write_tick_timer(module: Module, value: int) -> Status:
    module.tick_origin = module.now // MS - value
    return OK


def _write_disable_reply(module: Module, value: int) -> Status:
    module.silent = bool(value)
    return OK


def _write_protection(module: Module, value: int) -> Status:
    """Giving up the protection against reading erases the program (manual 8.1)."""
    if module.eeprom.global_values[81] & 1 and not value & 1:
        module.program.erase()
    module.eeprom.set_global_value(81, value)
    return OK


def _write_encoder_interface(module: Module, value: int) -> Status:
    module.eeprom.set_global_value(74, value)
    module.encoders.interface = value
    for axis in module.axes:
        _apply_prescaler(module, axis, axis.values[210])
        _apply_watch(module, axis, 0)
    return OK


def _write_settings(number: int) -> GlobalWriter:
    """A stored parameter that the module keeps at hand."""

    def write(module: Module, value: int) -> Status:
        module.eeprom.set_global_value(number, value)
        module.take_settings()
        return OK

    return write


def _write_stored(number: int) -> GlobalWriter:
    def write(module: Module, value: int) -> Status:
        module.eeprom.set_global_value(number, value)
        return OK

    return write


def _read_stored(number: int) -> GlobalReader:
    return lambda module: module.eeprom.global_values[number]


_COMMON: Final[Mapping[int, tuple[GlobalReader, GlobalWriter]]] = {
    2: _cover("COVER_POSITION"),
    3: _cover("COVER_LEN"),
    4: _whole("COVER_DATAGRAM"),
    6: _whole("LSMD"),
    **{7 + n: _cells(4 * n) for n in range(16)},
    **{23 + n: _cells(CELLS + 4 * n) for n in range(16)},
}
_READ_GLOBAL: Final[Mapping[int, GlobalReader]] = {
    0: lambda module: module.drivers.datagram_words()[0],
    1: lambda module: module.drivers.datagram_words()[1],
    5: _read_switches,
    **{number: pair[0] for number, pair in _COMMON.items()},
    128: lambda module: module.program.state,
    129: lambda module: int(module.program.downloading),
    130: lambda module: module.program.counter,
    132: lambda module: signed32(module.now // MS - module.tick_origin),
    133: lambda module: module.random_number(),
    255: lambda module: int(module.silent),
}
_WRITE_GLOBAL: Final[Mapping[int, GlobalWriter]] = {
    **{number: pair[1] for number, pair in _COMMON.items()},
    **{number: _write_settings(number) for number in (65, 66, 68, 70, 71, 75, 76, 80, 83)},
    73: _write_lock,
    74: _write_encoder_interface,
    81: _write_protection,
    132: _write_tick_timer,
    255: _write_disable_reply,
}


def _bank_0() -> tuple[GlobalParameter, ...]:
    return tuple(row for row in GLOBAL_PARAMETERS if row.bank == 0)


GLOBAL_READERS: Final[Mapping[int, GlobalReader]] = {
    row.number: _READ_GLOBAL.get(row.number) or _read_stored(row.number) for row in _bank_0() if row.readable
}
"""How GGP reads each number of bank 0."""

GLOBAL_WRITERS: Final[Mapping[int, tuple[GlobalParameter, GlobalWriter]]] = {
    row.number: (row, _WRITE_GLOBAL.get(row.number) or _write_stored(row.number))
    for row in _bank_0()
    if row.writable
}
"""Row and writer of each number of bank 0 that SGP may write."""

LOCK: Final = 73
"""The one stored parameter that may be written while the EEPROM is locked."""

_TABLES: Final = {7: (0, "driver_chain"), 23: (CELLS, "microstep_table")}


def store_global(module: Module, number: int) -> Status:
    """STGP in bank 0: the first long words of driver chain and microstep table store the whole table.

    All others are stored by SGP already, or cannot be; nothing happens (manual 6.7.11, fidelity FW-53).
    """
    if (0, number) not in BY_NUMBER:
        return Status.WRONG_TYPE
    if number in _TABLES:
        if module.eeprom.locked:
            return Status.EEPROM_LOCKED
        first, _ = _TABLES[number]
        cells = module.drivers.read_cells(first, CELLS)
        if first:
            module.eeprom.set_microstep_table(cells)
        else:
            module.eeprom.set_driver_chain(cells)
    return OK


def restore_global(module: Module, number: int) -> Status:
    """RSGP in bank 0, the counterpart of `store_global`."""
    if (0, number) not in BY_NUMBER:
        return Status.WRONG_TYPE
    if number in _TABLES:
        first, name = _TABLES[number]
        module.drivers.write_cells(first, getattr(module.eeprom, name))
    return OK
