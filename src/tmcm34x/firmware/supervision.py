"""What the firmware watches beside commands: currents, freewheeling, stall, deviation, SHUTDOWN, heartbeat.

Nothing is polled while nothing is to be seen.  A *look* at the motors is taken whenever the motion chips have
an event, after a command that may start a motor (at the next 5 ms of the firmware's clock), and when the SHUTDOWN
pin changes.  A motor that moves with stall detection, deviation check or a speed threshold switched on is *polled*
every 5 ms.  Everything else is a due clock.

Source: manual 6.7.34, 7.1 (6, 7, 203 to 206, 211, 212, 214), 8.1 (68, 80) and 9.2; the 5 ms from the vendor's
change log of the firmware line; fidelity FW-40 to FW-48.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Protocol

from tmcm34x.chips.ramp import signed24
from tmcm34x.clock import MS, NEVER
from tmcm34x.firmware.motion import A_ACTUAL, V_ACTUAL, V_TARGET, X_ACTUAL
from tmcm34x.tmcl.commands import MOTORS

if TYPE_CHECKING:
    from collections.abc import Iterable

    from tmcm34x.firmware.module import Module
    from tmcm34x.firmware.motion import Axis

GRID: Final = 5 * MS
"""Period of the firmware's system control."""
REST_UNIT: Final = 10 * MS
"""Unit of the axis parameters 204 and 214."""
RAMP_TICK: Final = 32
"""Clocks of a ramp tick at ramp divisor 0."""

_NO_SPEED_THRESHOLD: Final = 2048


class TargetListener(Protocol):
    """Who wants to know that motors have reached their targets: a port, for command 138."""

    def target_reached(self, mask: int, size: int) -> None:
        """Send the second reply, to a request of `size` bytes."""
        ...


class Supervision:
    """The watch over one module's motors."""

    __slots__ = (
        "_grace",
        "_module",
        "_requests",
        "_rest_since",
        "due",
        "free_due",
        "heartbeat_due",
        "look_due",
        "moving",
        "poll_due",
        "power_due",
        "shut_down",
    )

    def __init__(self, module: Module) -> None:
        self._module = module
        self.reset()

    def reset(self) -> None:
        """Power-on: all motors at rest with standby current."""
        self.moving = [False] * MOTORS
        """Whether each motor moves, as far as the firmware has noticed."""
        self.shut_down = False
        """Whether the SHUTDOWN pin is active."""
        self.power_due = [NEVER] * MOTORS
        self.free_due = [NEVER] * MOTORS
        self.look_due = NEVER
        self.poll_due = NEVER
        self.heartbeat_due = NEVER
        self.due = NEVER
        """The next clock at which there is something to do."""
        self._grace = [0] * MOTORS
        self._rest_since = [self._module.now] * MOTORS
        self._requests: list[tuple[TargetListener, int, int]] = []

    # Told by others

    def started(self, motor: int) -> None:
        """A command may have set a motor in motion: full current, and a look as soon as it must be under way."""
        module = self._module
        if not self.moving[motor]:
            self._begin(motor)
        self._grace[motor] = grace = self._under_way(motor)
        self.look_due = min(self.look_due, grace)
        self._reschedule()
        module.touched = True

    def heard(self) -> None:
        """A command came on a serial port; the next must come within the heartbeat (global parameter 68)."""
        self.heartbeat_due = self._module.now + self._module.heartbeat * MS
        self._reschedule()

    def pins_changed(self) -> None:
        """The world changed a pin: a switch that opened may set a motor in motion again."""
        for motor in range(MOTORS):
            self.freed(motor)
        self.shutdown_changed()

    def freed(self, motor: int) -> None:
        """What held a motor may have gone: if it starts, that is seen when it is under way."""
        axis = self._module.axes[motor]
        if not self.moving[motor] and (axis.open or not axis.at_target):
            self.look_due = min(self.look_due, self._under_way(motor))
            self._reschedule()

    def shutdown_changed(self) -> None:
        """The SHUTDOWN pin or its meaning (global parameter 80) may have changed: looked at in the next period."""
        if self._module.eeprom.global_values[80] or self.shut_down:
            self.look_due = min(self.look_due, _next_grid(self._module.now))
            self._reschedule()

    def settings_changed(self, motor: int) -> None:
        """An axis parameter that is watched here has a new value."""
        if self.moving[motor]:
            self._set_current(motor, 6)
        elif self.power_due[motor] == NEVER:
            self._set_current(motor, 7)
        else:
            self._plan_rest(motor)
        self._choose_pattern(motor)
        self._plan_poll()
        self._reschedule()

    def rest_time_changed(self, motor: int) -> None:
        """Axis parameter 204 or 214 has a new value."""
        if not self.moving[motor]:
            self._plan_rest(motor)
            self._reschedule()

    @property
    def requested(self) -> bool:
        """Whether a second reply of command 138 is still to come."""
        return bool(self._requests)

    def request_target_reached(self, listener: TargetListener, mask: int, size: int) -> None:
        """Tell `listener` once all motors of `mask` are at their targets; one request for each listener."""
        self._requests = [row for row in self._requests if row[0] is not listener]
        self._requests.append((listener, mask, size))
        self._module.touched = True

    def _under_way(self, motor: int) -> int:
        """When a motor that starts now is certain to have begun: a period of 5 ms after a ramp tick."""
        return _next_grid(self._module.now + (RAMP_TICK << self._module.axes[motor].values[153]))

    # Time

    def advance(self, now: int, chips_have_event: bool) -> None:
        """Do what is due at `now`."""
        if now >= self.look_due:
            self._look(now, self._module.axes)
        elif chips_have_event:
            self._look(now, [axis for axis in self._module.axes if self.moving[axis.motor]])
        if now >= self.poll_due:
            self._poll()
        for motor in range(MOTORS):
            if now >= self.power_due[motor]:
                self.power_due[motor] = NEVER
                self._set_current(motor, 7)
            if now >= self.free_due[motor]:
                self.free_due[motor] = NEVER
                self._module.board.driver_enable(motor, False)
        if now >= self.heartbeat_due:
            self._lose_heartbeat()
        self._reschedule()

    def answer_requests(self) -> None:
        """Send the second reply of every command 138 whose motors are at their targets."""
        if not self._requests:
            return
        reached = self._module.motion.reached()
        due = [row for row in self._requests if not row[1] & ~reached]
        self._requests = [row for row in self._requests if row[1] & ~reached]
        for listener, mask, size in due:
            listener.target_reached(mask, size)

    def _look(self, now: int, axes: Iterable[Axis]) -> None:
        """Look whether motors move; one at rest does not start without a command or a pin."""
        if now >= self.look_due:
            self.look_due = NEVER
            self._look_at_shutdown()
        for axis in axes:
            motor = axis.motor
            if not axis.at_rest:
                self._look_at_motion(axis)
            elif self.moving[motor]:
                if now >= self._grace[motor]:
                    self._end(motor, now)
                else:
                    self.look_due = min(self.look_due, self._grace[motor])
        self.answer_requests()

    def _look_at_motion(self, axis: Axis) -> None:
        """A motor moves; if that cannot be seen in its speed, it turns round or ends its move: look again."""
        motor = axis.motor
        if not self.moving[motor]:
            self._begin(motor)
        if self.shut_down:
            self._module.halt(motor)
        elif not axis.read(V_ACTUAL) and not axis.read(V_TARGET):
            self.look_due = min(self.look_due, self._under_way(motor))

    def _begin(self, motor: int) -> None:
        self.moving[motor] = True
        self.power_due[motor] = self.free_due[motor] = NEVER
        self._set_current(motor, 6)
        self._module.board.driver_enable(motor, True)
        self._plan_poll()

    def _end(self, motor: int, now: int) -> None:
        self.moving[motor] = False
        self._rest_since[motor] = now
        self._plan_rest(motor)
        self._choose_pattern(motor)
        self._plan_poll()

    def _plan_rest(self, motor: int) -> None:
        values = self._module.axes[motor].values
        if 214 not in values:
            return
        since, soon = self._rest_since[motor], self._module.now + 1
        if self._module.board.currents[motor] != values[7] or self.power_due[motor] != NEVER:
            self.power_due[motor] = max(since + values[214] * REST_UNIT, soon)
        self.free_due[motor] = max(since + values[204] * REST_UNIT, soon) if values[204] else NEVER

    def _set_current(self, motor: int, parameter: int) -> None:
        current = self._module.axes[motor].values.get(parameter)
        if current is not None:
            self._module.board.set_current(motor, current)

    # Polling

    def _watched(self, motor: int) -> bool:
        values = self._module.axes[motor].values
        return bool(
            (values[212] and self._module.encoders.interface)
            or values.get(205)
            or 0 <= values.get(203, _NO_SPEED_THRESHOLD) < _NO_SPEED_THRESHOLD
            or 0 < values.get(211, 0) < _NO_SPEED_THRESHOLD
        )

    def _plan_poll(self) -> None:
        if not any(self.moving[motor] and self._watched(motor) for motor in range(MOTORS)):
            self.poll_due = NEVER
        elif self.poll_due == NEVER:
            self.poll_due = _next_grid(self._module.now)

    def _poll(self) -> None:
        self.poll_due = NEVER
        for motor in range(MOTORS):
            if self.moving[motor] and self._watched(motor):
                self._choose_pattern(motor)
                self._check_stall(motor)
                self._check_deviation(motor)
        self._plan_poll()

    def _choose_pattern(self, motor: int) -> None:
        axis = self._module.axes[motor]
        if 203 in axis.values:
            speed = abs(axis.read(V_ACTUAL))
            self._module.drivers.set_pattern(motor, speed, axis.values[203], axis.values[211])

    def _check_stall(self, motor: int) -> None:
        axis = self._module.axes[motor]
        threshold = axis.values.get(205)
        if not threshold or not axis.read(V_ACTUAL) or axis.read(A_ACTUAL):
            return
        if self._module.drivers.load(motor) >= threshold:
            self._module.halt(motor)
            self._module.tell("stall", motor)

    def _check_deviation(self, motor: int) -> None:
        module = self._module
        axis = module.axes[motor]
        limit = axis.values[212]
        if not limit or not module.encoders.interface or not axis.read(V_ACTUAL):
            return
        if abs(signed24(axis.read(X_ACTUAL) - module.encoders.position(motor))) > limit:
            module.stop(motor)
            module.raise_error("EDV")
            module.tell("deviation", motor)

    # Pins and host

    def _look_at_shutdown(self) -> None:
        module = self._module
        function = module.eeprom.global_values[80]
        active = bool(function) and module.board.shutdown_level() == (function == 1)
        if active and not self.shut_down:
            module.raise_error("ESD")
            module.tell("shutdown", -1)
        self.shut_down = active

    def _lose_heartbeat(self) -> None:
        self.heartbeat_due = NEVER
        for motor in range(MOTORS):
            self._module.stop(motor)
        self._module.tell("heartbeat", -1)

    def _reschedule(self) -> None:
        self.due = min(self.look_due, self.poll_due, self.heartbeat_due, *self.power_due, *self.free_due)


def _next_grid(now: int) -> int:
    """The first clock after `now` at which the firmware's system control runs."""
    return (now // GRID + 1) * GRID
