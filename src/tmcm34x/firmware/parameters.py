"""Where the parameters live: what reading and writing each of them does.

The rows of `tmcl.axis_parameters` and `tmcl.global_parameters` say which numbers exist, their ranges and what is
stored.  The tables here add only what a row cannot say: the chip's register field behind a number, and what
else a new value brings about.  `tables` puts rows and functions together for one model and profile.

An axis parameter without an entry in `_READ` lives in `Axis.values`; writing puts the value there and then
does what `EFFECTS` says, which is also how power-on brings the stored values into effect.

Source: manual 6.7.5 to 6.7.12, chapters 7 and 8; fidelity FW-50 to FW-55, TMCL-18.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import TYPE_CHECKING, Final

from tmcm34x.board.models import CELLS
from tmcm34x.chips.ramp import VELOCITY
from tmcm34x.chips.registers import DATA, FIELDS
from tmcm34x.clock import MS
from tmcm34x.firmware import currents, drivers, encoder, motion, supervision
from tmcm34x.firmware.axis import A_ACTUAL, MOTOR_FIELDS, PULSE_DIV, RAMP_DIV, RAMP_MODE, V_MAX
from tmcm34x.firmware.state import Tables
from tmcm34x.firmware.storage import axis_rows, global_rows
from tmcm34x.tmcl.datagram import signed32
from tmcm34x.tmcl.global_parameters import LOCK_KEY, UNLOCK_KEY
from tmcm34x.tmcl.numbers import AP, GP
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.firmware.axis import Axis, ChipField
    from tmcm34x.firmware.state import AxisReader, AxisWriter, GlobalReader, GlobalWriter, ModuleState
    from tmcm34x.tmcl.axis_parameters import AxisParameter

Effect = Callable[["ModuleState", "Axis", int], None]
"""Brings a new value, which is in RAM already, into effect."""

OK: Final = Status.OK
EXTENSION: Final = 1
"""Bank of a customer's extension of the firmware."""
VARIABLES: Final = 2
"""Bank of the user variables."""

# Axis parameters: the register field of the motion chip behind each number.

_CHIP_FIELDS: Final[Mapping[int, ChipField]] = {
    AP.TARGET_POSITION: MOTOR_FIELDS["X_TARGET"],
    AP.ACTUAL_POSITION: MOTOR_FIELDS["X_ACTUAL"],
    AP.TARGET_SPEED: MOTOR_FIELDS["V_TARGET"],
    AP.ACTUAL_SPEED: MOTOR_FIELDS["V_ACTUAL"],
    AP.RIGHT_SWITCH_DISABLE: MOTOR_FIELDS["DISABLE_STOP_R"],
    AP.LEFT_SWITCH_DISABLE: MOTOR_FIELDS["DISABLE_STOP_L"],
    AP.MIN_SPEED: MOTOR_FIELDS["V_MIN"],
    AP.RAMP_MODE: MOTOR_FIELDS["RAMP_MODE"],
    AP.MICROSTEP_RESOLUTION: MOTOR_FIELDS["USRS"],
    AP.REFERENCE_SWITCH_TOLERANCE: MOTOR_FIELDS["DX_REF_TOLERANCE"],
    AP.SOFT_STOP: MOTOR_FIELDS["SOFT_STOP"],
}
_MOVING: Final = (AP.TARGET_POSITION, AP.ACTUAL_POSITION, AP.TARGET_SPEED, AP.ACTUAL_SPEED)
"""Registers of the ramp generator: writing one may start the motor."""


def _read_ram(_core: ModuleState, axis: Axis, number: int) -> int:
    return axis.values[number]


def _read_chip(_core: ModuleState, axis: Axis, number: int) -> int:
    return axis.read(_CHIP_FIELDS[number])


def _read_reached(_core: ModuleState, axis: Axis, _number: int) -> int:
    return int(axis.at_target)


def _read_left_switch(_core: ModuleState, axis: Axis, _number: int) -> int:
    return int(axis.left_switch)


def _read_right_switch(_core: ModuleState, axis: Axis, _number: int) -> int:
    return int(axis.right_switch)


def _read_acceleration(_core: ModuleState, axis: Axis, _number: int) -> int:
    return abs(axis.read(A_ACTUAL))


def _read_load(core: ModuleState, axis: Axis, _number: int) -> int:
    return drivers.load(core.board, axis.motor)


def _read_flags(core: ModuleState, axis: Axis, _number: int) -> int:
    return drivers.flags(core.board, axis.motor)


def _read_encoder(core: ModuleState, axis: Axis, _number: int) -> int:
    return encoder.position(core, axis.motor)


_READ: Final[Mapping[int, AxisReader]] = {
    **dict.fromkeys((*_MOVING, AP.RAMP_MODE), _read_chip),
    AP.POSITION_REACHED: _read_reached,
    AP.REFERENCE_SWITCH: _read_left_switch,
    AP.RIGHT_SWITCH: _read_right_switch,
    AP.LEFT_SWITCH: _read_left_switch,
    AP.ACTUAL_ACCELERATION: _read_acceleration,
    AP.LOAD_VALUE: _read_load,
    AP.DRIVER_ERROR_FLAGS: _read_flags,
    AP.ENCODER_POSITION: _read_encoder,
}


def _write_ram(core: ModuleState, axis: Axis, number: int, value: int) -> Status:
    axis.values[number] = value
    effect = EFFECTS.get(number)
    if effect is not None:
        effect(core, axis, number)
    return OK


def _write_chip(core: ModuleState, axis: Axis, number: int, value: int) -> Status:
    axis.write(_CHIP_FIELDS[number], value)
    currents.started(core, axis)
    return OK


def _write_ramp_mode(core: ModuleState, axis: Axis, _number: int, mode: int) -> Status:
    """Change the mode as the motion commands do, with the speed limit that belongs to it."""
    if mode == VELOCITY:
        motion.enter_velocity_mode(axis)
        currents.started(core, axis)
    else:
        motion.enter_ramp_mode(core, axis, mode)
    return OK


def _write_encoder(core: ModuleState, axis: Axis, _number: int, position: int) -> Status:
    if not core.encoder_interface:
        return Status.NOT_AVAILABLE
    encoder.preload(core, axis.motor, position)
    return OK


_WRITE: Final[Mapping[int, AxisWriter]] = {
    **dict.fromkeys(_MOVING, _write_chip),
    AP.RAMP_MODE: _write_ramp_mode,
    AP.ENCODER_POSITION: _write_encoder,
}
"""Parameters that are no value in RAM."""


def _apply_field(_core: ModuleState, axis: Axis, number: int) -> None:
    axis.write(_CHIP_FIELDS[number], axis.values[number])


def _apply_max_speed(core: ModuleState, axis: Axis, number: int) -> None:
    """At once in position mode; in velocity mode with the next positioning command."""
    if not axis.open:
        axis.write(V_MAX, axis.values[number])
        currents.freed(core, axis)


def _apply_acceleration(core: ModuleState, axis: Axis, number: int) -> None:
    axis.set_acceleration(axis.values[number])
    currents.freed(core, axis)


def _apply_ramp_divisor(_core: ModuleState, axis: Axis, number: int) -> None:
    axis.write(RAMP_DIV, axis.values[number])
    axis.set_acceleration(axis.values[AP.MAX_ACCELERATION])


def _apply_pulse_divisor(_core: ModuleState, axis: Axis, number: int) -> None:
    axis.write(PULSE_DIV, axis.values[number])
    axis.set_acceleration(axis.values[AP.MAX_ACCELERATION])


def _apply_stop_switch(core: ModuleState, axis: Axis, number: int) -> None:
    """The right and left stop functions are the reference search's while it runs (manual 9.1)."""
    if not axis.search:
        _apply_field(core, axis, number)
        currents.freed(core, axis)


def _apply_watch(core: ModuleState, axis: Axis, _number: int) -> None:
    currents.settings_changed(core, axis)


def _apply_rest_time(core: ModuleState, axis: Axis, _number: int) -> None:
    currents.rest_time_changed(core, axis)


def _apply_prescaler(core: ModuleState, axis: Axis, number: int) -> None:
    encoder.configure(core, axis.motor, axis.values[number])


EFFECTS: Final[Mapping[int, Effect]] = {
    AP.MAX_SPEED: _apply_max_speed,
    AP.MAX_ACCELERATION: _apply_acceleration,
    AP.MAX_CURRENT: _apply_watch,
    AP.STANDBY_CURRENT: _apply_watch,
    AP.RIGHT_SWITCH_DISABLE: _apply_stop_switch,
    AP.LEFT_SWITCH_DISABLE: _apply_stop_switch,
    AP.MIN_SPEED: _apply_field,
    AP.MICROSTEP_RESOLUTION: _apply_field,
    AP.REFERENCE_SWITCH_TOLERANCE: _apply_field,
    AP.SOFT_STOP: _apply_field,
    AP.RAMP_DIVISOR: _apply_ramp_divisor,
    AP.PULSE_DIVISOR: _apply_pulse_divisor,
    AP.BOOST_CURRENT: _apply_watch,
    AP.MIXED_DECAY_THRESHOLD: _apply_watch,
    AP.FREEWHEELING: _apply_rest_time,
    AP.STALL_THRESHOLD: _apply_watch,
    AP.ENCODER_PRESCALER: _apply_prescaler,
    AP.FULLSTEP_THRESHOLD: _apply_watch,
    AP.MAX_ENCODER_DEVIATION: _apply_watch,
    AP.POWER_DOWN_DELAY: _apply_rest_time,
}
"""What a new value does, once it is in RAM."""


def restore_axes(core: ModuleState) -> None:
    """Power-on: all axis parameters from the EEPROM, and then into effect."""
    rows = axis_rows(core.eeprom.model, core.eeprom.profile)
    for axis, stored in zip(core.axes, core.eeprom.axis_values, strict=True):
        axis.open = axis.scaled = False
        axis.values = {
            row.number: stored.get(row.number, row.default) for row in rows if row.number not in _READ
        }
        axis.write(RAMP_MODE, 0)
    for number, effect in EFFECTS.items():
        for axis in core.axes:
            if number in axis.values:
                effect(core, axis, number)


# Global parameters of bank 0.

_COVER_FIELDS: Final = {GP.COVER_POSITION: "COVER_POSITION", GP.COVER_LENGTH: "COVER_LEN"}
_WHOLE_REGISTERS: Final = {GP.COVER_DATAGRAM: FIELDS["COVER_DATAGRAM"][0], GP.SMGP: FIELDS["LSMD"][0]}
"""Common registers that are one number of 24 bits, written to all chips."""
_LONG_WORDS: Final = 16
_TABLES: Final = {GP.DRIVER_CHAIN_0: 0, GP.MICROSTEP_TABLE_0: CELLS}
"""First cell of the tables in the chip's RAM, by the parameter of its first long word."""
_FIRST_CELLS: Final = {
    first + n: start + 4 * n for first, start in _TABLES.items() for n in range(_LONG_WORDS)
}
"""First of the four cells of a long word."""


def _written_cover(core: ModuleState) -> int:
    """The cover register as it was written: the chip reads the position one higher."""
    register, position = FIELDS["COVER_POSITION"]
    data = core.board.transfer(0, register.read()) & register.writable
    return position.put(data, position.get(data) - 1)


def _read_cover(core: ModuleState, number: int) -> int:
    return FIELDS[_COVER_FIELDS[number]][1].get(_written_cover(core))


def _write_cover(core: ModuleState, number: int, value: int) -> Status:
    register, field = FIELDS[_COVER_FIELDS[number]]
    data = field.put(_written_cover(core), value)
    for chip in range(len(core.board.model.parts)):
        core.board.transfer(chip, register.write(data))
    return OK


def _read_whole(core: ModuleState, number: int) -> int:
    return core.board.transfer(0, _WHOLE_REGISTERS[number].read()) & DATA


def _write_whole(core: ModuleState, number: int, value: int) -> Status:
    for chip in range(len(core.board.model.parts)):
        core.board.transfer(chip, _WHOLE_REGISTERS[number].write(value))
    return OK


def _read_cells(core: ModuleState, number: int) -> int:
    return int.from_bytes(drivers.read_cells(core.board, _FIRST_CELLS[number], 4), "little")


def _write_cells(core: ModuleState, number: int, value: int) -> Status:
    drivers.write_cells(core.board, _FIRST_CELLS[number], (value & 0x3F3F3F3F).to_bytes(4, "little"))
    return OK


def _read_low_word(core: ModuleState, _number: int) -> int:
    return drivers.datagram_words(core.board)[0]


def _read_high_word(core: ModuleState, _number: int) -> int:
    return drivers.datagram_words(core.board)[1]


def _read_switches(core: ModuleState, _number: int) -> int:
    """The switches of all motors, in the order of one chip that has all of them."""
    return sum((2 * axis.left_switch + axis.right_switch) << 2 * axis.motor for axis in core.axes)


def _read_application(core: ModuleState, _number: int) -> int:
    return core.program.state


def _read_download(core: ModuleState, _number: int) -> int:
    return int(core.program.downloading)


def _read_counter(core: ModuleState, _number: int) -> int:
    return core.program.counter


def _read_last_error(core: ModuleState, _number: int) -> int:
    return core.program.last_status


def _read_tick_timer(core: ModuleState, _number: int) -> int:
    return signed32(core.now // MS - core.tick_origin)


def _read_random(core: ModuleState, _number: int) -> int:
    return core.random_number()


def _read_disable_reply(core: ModuleState, _number: int) -> int:
    return int(core.silent)


def _read_stored(core: ModuleState, number: int) -> int:
    return core.eeprom.global_values[number]


_READ_GLOBAL: Final[Mapping[int, GlobalReader]] = {
    GP.DATAGRAM_LOW_WORD: _read_low_word,
    GP.DATAGRAM_HIGH_WORD: _read_high_word,
    **dict.fromkeys(_COVER_FIELDS, _read_cover),
    **dict.fromkeys(_WHOLE_REGISTERS, _read_whole),
    **dict.fromkeys(_FIRST_CELLS, _read_cells),
    GP.REFERENCE_SWITCHES: _read_switches,
    GP.APPLICATION_STATUS: _read_application,
    GP.DOWNLOAD_MODE: _read_download,
    GP.PROGRAM_COUNTER: _read_counter,
    GP.LAST_ERROR: _read_last_error,
    GP.TICK_TIMER: _read_tick_timer,
    GP.RANDOM_NUMBER: _read_random,
    GP.DISABLE_REPLY: _read_disable_reply,
}


def _write_stored(core: ModuleState, number: int, value: int) -> Status:
    core.eeprom.set_global_value(number, value)
    return OK


def _write_setting(core: ModuleState, number: int, value: int) -> Status:
    """A stored parameter that the module keeps at hand."""
    core.eeprom.set_global_value(number, value)
    core.take_settings()
    supervision.settings_changed(core)
    return OK


def _write_lock(core: ModuleState, number: int, value: int) -> Status:
    if value not in {LOCK_KEY, UNLOCK_KEY}:
        return Status.INVALID_VALUE
    core.eeprom.set_global_value(number, int(value == LOCK_KEY))
    return OK


def _write_encoder_interface(core: ModuleState, number: int, value: int) -> Status:
    core.eeprom.set_global_value(number, value)
    core.encoder_interface = value
    for axis in core.axes:
        _apply_prescaler(core, axis, AP.ENCODER_PRESCALER)
        currents.settings_changed(core, axis)
    return OK


def _write_protection(core: ModuleState, number: int, value: int) -> Status:
    """Giving up the protection against reading erases the program (manual 8.1)."""
    if core.eeprom.global_values[number] & 1 and not value & 1:
        core.program.erase()
    core.eeprom.set_global_value(number, value)
    return OK


def _write_tick_timer(core: ModuleState, _number: int, value: int) -> Status:
    core.tick_origin = core.now // MS - value
    return OK


def _write_disable_reply(core: ModuleState, _number: int, value: int) -> Status:
    core.silent = bool(value)
    return OK


_WRITE_GLOBAL: Final[Mapping[int, GlobalWriter]] = {
    **dict.fromkeys(_COVER_FIELDS, _write_cover),
    **dict.fromkeys(_WHOLE_REGISTERS, _write_whole),
    **dict.fromkeys(_FIRST_CELLS, _write_cells),
    **dict.fromkeys(
        (
            GP.BAUD_RATE, GP.SERIAL_ADDRESS, GP.SERIAL_HEARTBEAT, GP.CAN_REPLY_ID, GP.CAN_ID, GP.TELEGRAM_PAUSE,
            GP.HOST_ADDRESS, GP.SHUTDOWN_PIN, GP.CAN_SECONDARY_ID, GP.CAN_HEARTBEAT, GP.SERIAL_SECONDARY_ADDRESS,
        ),
        _write_setting,
    ),
    GP.EEPROM_LOCK: _write_lock,
    GP.ENCODER_INTERFACE: _write_encoder_interface,
    GP.CODE_PROTECTION: _write_protection,
    GP.TICK_TIMER: _write_tick_timer,
    GP.DISABLE_REPLY: _write_disable_reply,
}  # fmt: skip


def store_global(core: ModuleState, number: int) -> Status:
    """STGP in bank 0: the first long words of driver chain and microstep table store the whole table.

    All others are stored by SGP already, or cannot be; nothing happens (manual 6.7.11, fidelity FW-53).
    """
    if number not in core.tables.globals:
        return Status.WRONG_TYPE
    if number in _TABLES:
        if core.eeprom.locked:
            return Status.EEPROM_LOCKED
        cells = drivers.read_cells(core.board, _TABLES[number], CELLS)
        if number == GP.MICROSTEP_TABLE_0:
            core.eeprom.set_microstep_table(cells)
        else:
            core.eeprom.set_driver_chain(cells)
    return OK


def restore_global(core: ModuleState, number: int) -> Status:
    """RSGP in bank 0, the counterpart of `store_global`."""
    if number not in core.tables.globals:
        return Status.WRONG_TYPE
    if number in _TABLES:
        table = core.eeprom.microstep_table if number == GP.MICROSTEP_TABLE_0 else core.eeprom.driver_chain
        drivers.write_cells(core.board, _TABLES[number], table)
    return OK


# The tables of one model and profile.


@cache
def tables(model: int, profile: str) -> Tables:
    """The tables of `model` (341..343) with `profile` ("standard" or "later")."""
    readers: list[AxisReader | None] = [None] * 256
    writers: list[tuple[AxisParameter, AxisWriter] | None] = [None] * 256
    rows = axis_rows(model, profile)
    for row in rows:
        if row.readable:
            readers[row.number] = _READ.get(row.number, _read_ram)
        if row.writable:
            writers[row.number] = row, _WRITE.get(row.number, _write_ram)
    bank_0 = global_rows(profile)
    return Tables(
        tuple(readers),
        tuple(writers),
        frozenset(row.number for row in rows if row.stored),
        frozenset(row.number for row in bank_0),
        {row.number: _READ_GLOBAL.get(row.number, _read_stored) for row in bank_0 if row.readable},
        {row.number: (row, _WRITE_GLOBAL.get(row.number, _write_stored)) for row in bank_0 if row.writable},
    )
