"""Axis parameters: what reading and writing each of them does.

A parameter without an entry in `READERS` lives in `AxisState.values`; writing puts the value there and then does what
`EFFECTS` says, which is also how power-on brings the stored values into effect.

Source: manual 6.7.5 to 6.7.8, chapter 7; fidelity TMCL-18.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Final

from tmcm34x.chips.ramp import VELOCITY
from tmcm34x.firmware import currents, drivers, encoder, motion
from tmcm34x.firmware.axis import A_ACTUAL, MOTOR_FIELDS, PULSE_DIV, RAMP_DIV, RAMP_MODE, V_MAX
from tmcm34x.tmcl.axis_parameters import axis_rows
from tmcm34x.tmcl.numbers import AP
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.firmware.axis import AxisState, ChipField
    from tmcm34x.firmware.state import AxisReader, AxisWriter, ModuleState

Effect = Callable[["ModuleState", "AxisState", int], None]
"""Brings a new value, which is in RAM already, into effect."""

OK: Final = Status.OK

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


def read_ram(_core: ModuleState, axis: AxisState, number: int) -> int:
    """Read a parameter that lives in RAM."""
    return axis.values[number]


def _read_chip(_core: ModuleState, axis: AxisState, number: int) -> int:
    return axis.read(_CHIP_FIELDS[number])


def _read_reached(_core: ModuleState, axis: AxisState, _number: int) -> int:
    return int(axis.at_target)


def _read_left_switch(_core: ModuleState, axis: AxisState, _number: int) -> int:
    return int(axis.left_switch)


def _read_right_switch(_core: ModuleState, axis: AxisState, _number: int) -> int:
    return int(axis.right_switch)


def _read_acceleration(_core: ModuleState, axis: AxisState, _number: int) -> int:
    return abs(axis.read(A_ACTUAL))


def _read_load(core: ModuleState, axis: AxisState, _number: int) -> int:
    return drivers.load(core.circuit, axis.motor)


def _read_flags(core: ModuleState, axis: AxisState, _number: int) -> int:
    return drivers.flags(core.circuit, axis.motor)


def _read_encoder(core: ModuleState, axis: AxisState, _number: int) -> int:
    return encoder.position(core, axis.motor)


READERS: Final[Mapping[int, AxisReader]] = {
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


def write_ram(core: ModuleState, axis: AxisState, number: int, value: int) -> Status:
    """Write a parameter that lives in RAM, and bring it into effect."""
    axis.values[number] = value
    effect = EFFECTS.get(number)
    if effect is not None:
        effect(core, axis, number)
    return OK


def _write_chip(core: ModuleState, axis: AxisState, number: int, value: int) -> Status:
    axis.write(_CHIP_FIELDS[number], value)
    currents.started(core, axis, steady=axis.steady)
    watched = core.observers or core.on_event
    if watched and number == AP.TARGET_POSITION and axis.read(_CHIP_FIELDS[AP.RAMP_MODE]) == VELOCITY:
        core.tell("no_positioning", axis.motor)
    return OK


def _write_ramp_mode(core: ModuleState, axis: AxisState, _number: int, mode: int) -> Status:
    """Change the mode as the motion commands do, with the speed limit that belongs to it."""
    if mode == VELOCITY:
        motion.enter_velocity_mode(axis)
        currents.started(core, axis, steady=axis.steady)
    else:
        motion.enter_ramp_mode(core, axis, mode)
    return OK


def _write_encoder(core: ModuleState, axis: AxisState, _number: int, position: int) -> Status:
    if not core.encoder_interface:
        return Status.NOT_AVAILABLE
    encoder.preload(core, axis.motor, position)
    return OK


WRITERS: Final[Mapping[int, AxisWriter]] = {
    **dict.fromkeys(_MOVING, _write_chip),
    AP.RAMP_MODE: _write_ramp_mode,
    AP.ENCODER_POSITION: _write_encoder,
}
"""Parameters that are no value in RAM."""


def _apply_field(_core: ModuleState, axis: AxisState, number: int) -> None:
    axis.write(_CHIP_FIELDS[number], axis.values[number])


def _apply_max_speed(core: ModuleState, axis: AxisState, number: int) -> None:
    """At once in position mode; in velocity mode with the next positioning command."""
    if not axis.open:
        axis.write(V_MAX, axis.values[number])
        currents.freed(core, axis)


def _apply_acceleration(core: ModuleState, axis: AxisState, number: int) -> None:
    axis.set_acceleration(axis.values[number])
    currents.freed(core, axis)


def _apply_ramp_divisor(_core: ModuleState, axis: AxisState, number: int) -> None:
    axis.write(RAMP_DIV, axis.values[number])
    axis.set_acceleration(axis.values[AP.MAX_ACCELERATION])


def _apply_pulse_divisor(_core: ModuleState, axis: AxisState, number: int) -> None:
    axis.write(PULSE_DIV, axis.values[number])
    axis.set_acceleration(axis.values[AP.MAX_ACCELERATION])


def _apply_stop_switch(core: ModuleState, axis: AxisState, number: int) -> None:
    """The right and left stop functions are the reference search's while it runs (manual 9.1)."""
    if not axis.search:
        _apply_field(core, axis, number)
        currents.freed(core, axis)


def _apply_watch(core: ModuleState, axis: AxisState, _number: int) -> None:
    currents.settings_changed(core, axis)


def _apply_rest_time(core: ModuleState, axis: AxisState, _number: int) -> None:
    currents.rest_time_changed(core, axis)


def _apply_prescaler(core: ModuleState, axis: AxisState, number: int) -> None:
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
            row.number: stored.get(row.number, row.default) for row in rows if row.number not in READERS
        }
        axis.write(RAMP_MODE, 0)
    for number, effect in EFFECTS.items():
        for axis in core.axes:
            if number in axis.values:
                effect(core, axis, number)
