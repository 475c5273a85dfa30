"""What follows from a motor's moving and resting: coil currents, freewheeling, driver cells, what is polled.

A motor counts as moving from the command that may start it.  `supervision` looks when it is under way or at rest
again; here is what is done then, and when the next look is due.

Source: manual 7.1 (6, 7, 203 to 206, 211, 212, 214) and 9.2; fidelity FW-32, FW-33, FW-40 to FW-42.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from tmcm34x.clock import MS, NEVER
from tmcm34x.firmware import drivers
from tmcm34x.firmware.axis import A_ACTUAL, V_ACTUAL
from tmcm34x.tmcl.numbers import AP

if TYPE_CHECKING:
    from tmcm34x.firmware.axis import AxisState
    from tmcm34x.firmware.state import ModuleState

GRID: Final = 5 * MS
"""Period of the firmware's system control."""
REST_UNIT: Final = 10 * MS
"""Unit of the axis parameters 204 and 214."""
RAMP_TICK: Final = 32
"""Clocks of a ramp tick at ramp divisor 0."""

_NO_SPEED_THRESHOLD: Final = 2048
_BOOST_CURRENT: Final = AP.BOOST_CURRENT


def next_grid(now: int) -> int:
    """The first clock after `now` at which the firmware's system control runs."""
    return (now // GRID + 1) * GRID


def under_way(core: ModuleState, axis: AxisState) -> int:
    """When a motor that starts now is certain to have begun: a period of 5 ms after a ramp tick."""
    return next_grid(core.now + (RAMP_TICK << axis.values[AP.RAMP_DIVISOR]))


def reschedule(core: ModuleState) -> None:
    """Find the next clock at which supervision has something to do."""
    first, second, third = core.axes
    core.due = min(
        core.shutdown_due, core.poll_due, core.heartbeat_due, core.can_heartbeat_due,
        first.look_due, first.power_due, first.free_due, second.look_due, second.power_due, second.free_due,
        third.look_due, third.power_due, third.free_due,
    )  # fmt: skip


# Motion


def started(core: ModuleState, axis: AxisState, *, steady: bool) -> None:
    """A command may have set a motor in motion: full current, and a look as soon as it must be under way.

    steady: whether the motor goes on as it does now; such a command starts nothing (fidelity FW-41)
    """
    core.touched |= axis.bit
    if steady:
        return
    if not axis.moving:
        begin(core, axis)
    axis.grace = grace = under_way(core, axis)
    axis.look_due = min(axis.look_due, grace)
    reschedule(core)


def freed(core: ModuleState, axis: AxisState) -> None:
    """What held a motor may have gone: if it starts, that is seen when it is under way."""
    if not axis.moving and (axis.open or not axis.at_target):
        axis.look_due = min(axis.look_due, under_way(core, axis))
        reschedule(core)


def begin(core: ModuleState, axis: AxisState) -> None:
    """A motor moves: run current, driver on."""
    axis.moving = True
    axis.power_due = axis.free_due = NEVER
    set_current(core, axis, AP.MAX_CURRENT)
    core.circuit.driver_enable(axis.motor, True)
    plan_poll(core)


def end(core: ModuleState, axis: AxisState, now: int) -> None:
    """A motor rests: the current goes down and the driver off later."""
    axis.moving = False
    axis.rest_since = now
    plan_rest(core, axis)
    choose_pattern(core, axis)
    plan_poll(core)


def plan_rest(core: ModuleState, axis: AxisState) -> None:
    """Find the clocks of standby current (214) and freewheeling (204)."""
    values, board = axis.values, core.circuit
    if AP.POWER_DOWN_DELAY not in values:
        return
    since, soon = axis.rest_since, core.now + 1
    if board.currents[axis.motor] != values[AP.STANDBY_CURRENT] or axis.power_due != NEVER:
        axis.power_due = max(since + values[AP.POWER_DOWN_DELAY] * REST_UNIT, soon)
    freewheeling = values[AP.FREEWHEELING]
    axis.free_due = max(since + freewheeling * REST_UNIT, soon) if freewheeling else NEVER


def set_current(core: ModuleState, axis: AxisState, parameter: int) -> None:
    """Set a coil current to axis parameter 6 or 7, or to 200 while the speed changes."""
    current = axis.values.get(parameter)
    if current is None:
        return
    if _BOOST_CURRENT in axis.values and parameter == AP.MAX_CURRENT:
        current = _boosted(axis, current)
    core.circuit.set_current(axis.motor, current)


def _boosted(axis: AxisState, current: int) -> int:
    """The current of a moving motor: parameter 200 of later firmware while the speed changes."""
    boost = axis.values[_BOOST_CURRENT]
    return boost if boost and (axis.read(A_ACTUAL) or not axis.read(V_ACTUAL)) else current


# Parameters


def settings_changed(core: ModuleState, axis: AxisState) -> None:
    """An axis parameter that is watched here has a new value."""
    if axis.moving:
        set_current(core, axis, AP.MAX_CURRENT)
    elif axis.power_due == NEVER:
        set_current(core, axis, AP.STANDBY_CURRENT)
    else:
        plan_rest(core, axis)
    choose_pattern(core, axis)
    plan_poll(core)
    reschedule(core)


def rest_time_changed(core: ModuleState, axis: AxisState) -> None:
    """Axis parameter 204 or 214 has a new value."""
    if not axis.moving:
        plan_rest(core, axis)
        reschedule(core)


# Polling


def watched(core: ModuleState, axis: AxisState) -> bool:
    """Whether a motor must be polled while it moves: what a threshold or parameter 200 sets is in use."""
    values = axis.values
    return bool(
        (values[AP.MAX_ENCODER_DEVIATION] and core.encoder_interface)
        or values.get(AP.STALL_THRESHOLD)
        or values.get(AP.BOOST_CURRENT)
        or 0 <= values.get(AP.MIXED_DECAY_THRESHOLD, _NO_SPEED_THRESHOLD) < _NO_SPEED_THRESHOLD
        or 0 < values.get(AP.FULLSTEP_THRESHOLD, 0) < _NO_SPEED_THRESHOLD
    )


def plan_poll(core: ModuleState) -> None:
    """Poll in the next period of 5 ms if any motor needs it."""
    for axis in core.axes:
        if axis.moving and watched(core, axis):
            if core.poll_due == NEVER:
                core.poll_due = next_grid(core.now)
            return
    core.poll_due = NEVER


def choose_pattern(core: ModuleState, axis: AxisState) -> None:
    """Bring the driver's decay and current cells in line with the speed."""
    values = axis.values
    if AP.MIXED_DECAY_THRESHOLD in values:
        thresholds = values[AP.MIXED_DECAY_THRESHOLD], values[AP.FULLSTEP_THRESHOLD]
        drivers.set_pattern(core.circuit, axis, abs(axis.read(V_ACTUAL)), *thresholds)
