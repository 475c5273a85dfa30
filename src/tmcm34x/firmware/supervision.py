"""What the firmware watches beside commands: motion and rest, stall, deviation, SHUTDOWN, heartbeat, command 138.

Nothing is polled while nothing is to be seen.  A *look* at a motor is taken whenever the motion chip has an event
of it that is more than another acceleration, and after a command that may start it (at the next 5 ms of the firmware's
clock); at all motors when the SHUTDOWN pin changes.  A motor that moves with stall detection, deviation check or a
speed threshold switched on is *polled* every 5 ms.  Everything else is a due clock.

Source: manual 6.7.34, 7.1 (205, 206, 212), 8.1 (68, 80) and 9.2; the 5 ms from the vendor's change log of the
firmware line; fidelity FW-40 to FW-49.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from tmcm34x.chips.ramp import signed24
from tmcm34x.clock import MS, NEVER
from tmcm34x.firmware import currents, drivers, encoder
from tmcm34x.firmware.axis import A_ACTUAL, V_ACTUAL, V_TARGET, X_ACTUAL
from tmcm34x.firmware.currents import reschedule
from tmcm34x.firmware.reference import halt_motor, stop_motor
from tmcm34x.firmware.state import ALL_MOTORS, EventRequest
from tmcm34x.tmcl.numbers import AP, GP

if TYPE_CHECKING:
    from tmcm34x.firmware.axis import AxisState
    from tmcm34x.firmware.roles import Port
    from tmcm34x.firmware.state import ModuleState

STALLED: Final = 1
DEVIATED: Final = 2
"""Bits of axis parameter 207 of later firmware."""


def advance(core: ModuleState, now: int, motors: int) -> None:
    """Do what is due at `now`.

    motors: those that the motion chips have an event of, as bits
    """
    due = now >= core.due
    shutdown = due and now >= core.shutdown_due
    if shutdown:
        core.shutdown_due = NEVER
        _look_at_shutdown(core)
    for axis in core.axes:
        if (axis.moving and motors & axis.bit) or (due and (shutdown or now >= axis.look_due)):
            _look(core, axis, now)
    if motors and core.requests:
        answer_requests(core, motors)
    if due:
        _do_later(core, now)
    reschedule(core)


def _do_later(core: ModuleState, now: int) -> None:
    """What is due after the looks: polling, what follows from rest, the heartbeat."""
    if now >= core.poll_due:
        _poll(core)
    for axis in core.axes:
        if now >= axis.power_due or now >= axis.free_due:
            _rest(core, axis, now)
    if now >= core.heartbeat_due or now >= core.can_heartbeat_due:
        _lose_heartbeat(core)


def _rest(core: ModuleState, axis: AxisState, now: int) -> None:
    if now >= axis.power_due:
        axis.power_due = NEVER
        currents.set_current(core, axis, AP.STANDBY_CURRENT)
    if now >= axis.free_due:
        axis.free_due = NEVER
        core.circuit.driver_enable(axis.motor, False)


def _look(core: ModuleState, axis: AxisState, now: int) -> None:
    """Look whether a motor moves; one at rest does not start without a command or a pin."""
    if now >= axis.look_due:
        axis.look_due = NEVER
    if not axis.transfer(axis.ask_speed) & V_ACTUAL.mask:
        _look_at_standstill(core, axis, now)
    elif not axis.moving or core.shut_down:
        _look_at_motion(core, axis)


def _look_at_standstill(core: ModuleState, axis: AxisState, now: int) -> None:
    """A motor that does not turn now; if it is not at rest, it turns round or ends its move: look again."""
    if not axis.at_rest:
        _look_at_motion(core, axis)
        if not core.shut_down and not axis.read(V_TARGET):
            axis.look_due = min(axis.look_due, currents.under_way(core, axis))
    elif axis.moving:
        if now >= axis.grace:
            currents.end(core, axis, now)
        else:
            axis.look_due = min(axis.look_due, axis.grace)


def _look_at_motion(core: ModuleState, axis: AxisState) -> None:
    """A motor moves."""
    if not axis.moving:
        currents.begin(core, axis)
    if core.shut_down:
        halt_motor(core, axis)


# Command 138


def request_target_reached(core: ModuleState, port: Port, mask: int, size: int) -> None:
    """Tell `port` once all motors of `mask` are at their targets; one request for each port."""
    core.requests = [row for row in core.requests if row.port is not port]
    core.requests.append(EventRequest(port, mask, size))
    core.touched |= mask or ALL_MOTORS


def answer_requests(core: ModuleState, motors: int) -> None:
    """Send the second reply of every command 138 whose motors are at their targets.

    motors: those that may have come there since the last look, as bits
    """
    due = [row for row in core.requests if (row.mask & motors or not row.mask) and _reached(core, row.mask)]
    if due:
        core.requests = [row for row in core.requests if row not in due]
        for row in due:
            row.port.target_reached(row.mask, row.size)


def _reached(core: ModuleState, motors: int) -> bool:
    """Whether all of some motors have come to their targets."""
    return all(axis.reached for axis in core.axes if motors & axis.bit)


# Polling


def _poll(core: ModuleState) -> None:
    core.poll_due = NEVER
    for axis in core.axes:
        if axis.moving and currents.watched(core, axis):
            currents.choose_pattern(core, axis)
            if axis.values.get(AP.BOOST_CURRENT):
                currents.set_current(core, axis, AP.MAX_CURRENT)
            _check_stall(core, axis)
            _check_deviation(core, axis)
    currents.plan_poll(core)


def _check_stall(core: ModuleState, axis: AxisState) -> None:
    threshold = axis.values.get(AP.STALL_THRESHOLD)
    if not threshold or not axis.read(V_ACTUAL) or axis.read(A_ACTUAL):
        return
    if drivers.load(core.circuit, axis.motor) >= threshold:
        halt_motor(core, axis)
        _note_error(axis, STALLED)
        core.tell("stall", axis.motor)


def _check_deviation(core: ModuleState, axis: AxisState) -> None:
    limit = axis.values[AP.MAX_ENCODER_DEVIATION]
    if not limit or not core.encoder_interface or not axis.read(V_ACTUAL):
        return
    if abs(signed24(axis.read(X_ACTUAL) - encoder.position(core, axis.motor))) > limit:
        stop_motor(core, axis)
        _note_error(axis, DEVIATED)
        core.application.raise_error("EDV")
        core.tell("deviation", axis.motor)


def _note_error(axis: AxisState, bit: int) -> None:
    if AP.EXTENDED_ERROR_FLAGS in axis.values:
        axis.values[AP.EXTENDED_ERROR_FLAGS] |= bit


# Pins and host


def pins_changed(core: ModuleState) -> None:
    """The world changed a pin: a switch that opened may set a motor in motion again."""
    for axis in core.axes:
        currents.freed(core, axis)
    shutdown_changed(core)


def shutdown_changed(core: ModuleState) -> None:
    """The SHUTDOWN pin or its meaning (global parameter 80) may have changed: looked at in the next period."""
    if core.eeprom.global_values[GP.SHUTDOWN_PIN] or core.shut_down:
        core.shutdown_due = min(core.shutdown_due, currents.next_grid(core.now))
        reschedule(core)


def _look_at_shutdown(core: ModuleState) -> None:
    function = core.eeprom.global_values[GP.SHUTDOWN_PIN]
    active = bool(function) and core.circuit.shutdown_level() == (function == 1)
    if active and not core.shut_down:
        core.application.raise_error("ESD")
        core.tell("shutdown", -1)
    core.shut_down = active


def heard(core: ModuleState) -> None:
    """A command came on a serial port; the next must come within the heartbeat (global parameter 68)."""
    core.heartbeat_due = core.now + core.heartbeat * MS
    reschedule(core)


def heard_on_can(core: ModuleState) -> None:
    """A command came on CAN; the next must come within the heartbeat of CAN (global parameter 82)."""
    core.can_heartbeat_due = core.now + core.can_heartbeat * MS
    reschedule(core)


def settings_changed(core: ModuleState) -> None:
    """Heartbeat and SHUTDOWN settings may have changed."""
    if not core.heartbeat:
        core.heartbeat_due = NEVER
    if not core.can_heartbeat:
        core.can_heartbeat_due = NEVER
    shutdown_changed(core)
    core.touched = ALL_MOTORS


def _lose_heartbeat(core: ModuleState) -> None:
    core.heartbeat_due = core.can_heartbeat_due = NEVER
    for axis in core.axes:
        stop_motor(core, axis)
    core.tell("heartbeat", -1)
