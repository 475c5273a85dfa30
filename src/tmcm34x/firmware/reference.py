"""The built-in reference search: one state machine for each motor.

Mode 1 looks for the left (reference) switch, modes 2 and 3 for the right one first; a motor that starts on the right
switch leaves it, so that its edge is met from outside.  Once the left input closes,
the motor leaves it slowly to the right and comes back slowly; the middle between the point where it opened and the
point where it closed again becomes position 0, and the motor goes there.  Going left from the right end, the first
switch on the left input is the reference switch, if there is one: so mode 3 differs from mode 2 only in what is
connected.

A search moves when the world does: it is looked at whenever a pin changes or the motion chip has an event, and has
no clock of its own.  A switch that never comes leaves it searching.

Source: manual 6.7.13, 7.1 (193 to 196) and 9.1; fidelity PROG-30 to PROG-37.
"""

from __future__ import annotations

from enum import IntEnum
from typing import TYPE_CHECKING, Final

from tmcm34x.chips.ramp import signed24
from tmcm34x.clock import NEVER
from tmcm34x.firmware.motion import MOTOR_FIELDS, V_ACTUAL, X_ACTUAL

if TYPE_CHECKING:
    from tmcm34x.firmware.module import Module

LEFT_SWITCH_ONLY: Final = 1
"""Referencing mode (axis parameter 193) without a right switch."""
_RIGHT_STOP: Final = MOTOR_FIELDS["DISABLE_STOP_R"]
_LEFT_STOP: Final = MOTOR_FIELDS["DISABLE_STOP_L"]
_SLOW: Final = 4
"""The switch speed is this part of the maximum positioning speed when parameter 195 is 0."""


class Search(IntEnum):
    """What a search is doing; RFS STATUS reads it."""

    IDLE = 0
    GOING_RIGHT = 1
    GOING_LEFT = 2
    LEAVING = 3
    REENTERING = 4
    GOING_TO_ZERO = 5
    LEAVING_RIGHT = 6


class ReferenceSearch:
    """The reference search of one motor."""

    __slots__ = ("_module", "_opened", "_right_end", "motor", "state")

    def __init__(self, module: Module, motor: int) -> None:
        self._module = module
        self.motor = motor
        self.reset()

    def reset(self) -> None:
        """Power-on: no search, nothing measured."""
        self.state = Search.IDLE
        self._right_end = 0
        self._opened = 0

    def start(self) -> None:
        """RFS START: begin, or begin again, with the mode that is set now."""
        values = self._module.axes[self.motor].values
        left_only = values[193] == LEFT_SWITCH_ONLY
        self._set_stops(right=not left_only, left=True)
        if left_only:
            self._enter(Search.GOING_LEFT)
        elif self._module.axes[self.motor].right_switch:
            self._enter(Search.LEAVING_RIGHT)
        else:
            self._enter(Search.GOING_RIGHT)
        self.advance(self._module.now)

    def stop(self) -> None:
        """RFS STOP: leave off, along the ramp."""
        if self.state:
            self._finish()
            self._module.motion.stop(self.motor)

    def abort(self) -> None:
        """Leave off because somebody else takes over the motor."""
        if self.state:
            self._finish()

    def next_event(self) -> int:
        """The search waits for pins and chip only."""
        return NEVER

    def advance(self, now: int) -> None:
        """Look whether the present stretch is over; `now` is where the module is."""
        del now
        while self.state and self._stretch_done():
            self._take_next_stretch()

    def _stretch_done(self) -> bool:
        axis = self._module.axes[self.motor]
        if self.state is Search.GOING_RIGHT:
            return axis.right_switch
        if self.state is Search.LEAVING_RIGHT:
            return not axis.right_switch
        if self.state is Search.GOING_TO_ZERO:
            return axis.at_target and not axis.read(V_ACTUAL)
        return axis.left_switch is not (self.state is Search.LEAVING)

    def _take_next_stretch(self) -> None:
        here = self._module.axes[self.motor].read(X_ACTUAL)
        if self.state is Search.GOING_RIGHT:
            self._right_end = here
            self._enter(Search.GOING_LEFT)
        elif self.state is Search.LEAVING_RIGHT:
            self._enter(Search.GOING_RIGHT)
        elif self.state is Search.GOING_LEFT:
            self._enter(Search.LEAVING)
        elif self.state is Search.LEAVING:
            self._opened = here
            self._enter(Search.REENTERING)
        elif self.state is Search.REENTERING:
            self._set_zero(here)
        else:
            self._finish()
            self._module.tell("reference", self.motor)

    def _enter(self, state: Search) -> None:
        """Begin a stretch: search speed on the way to a switch, switch speed while its points are measured."""
        self.state = state
        values = self._module.axes[self.motor].values
        if state in {Search.GOING_RIGHT, Search.GOING_LEFT}:
            speed = values[194] or values[4]
        else:
            speed = values[195] or values[4] // _SLOW
        rightward = state in {Search.GOING_RIGHT, Search.LEAVING}
        self._module.motion.rotate(self.motor, speed if rightward else -speed)

    def _set_zero(self, closed: int) -> None:
        """Count from the middle of the two switching points, and go there, even if the switch is closed there."""
        axis = self._module.axes[self.motor]
        middle = closed + signed24(self._opened - closed) // 2
        if axis.values[193] != LEFT_SWITCH_ONLY:
            axis.values[196] = abs(signed24(self._right_end - middle))
        here = signed24(closed - middle)
        axis.write(X_ACTUAL, here)
        if self._module.encoders.interface:
            self._module.encoders.preload(self.motor, here)
        self._set_stops(right=axis.values[193] != LEFT_SWITCH_ONLY, left=False)
        self.state = Search.GOING_TO_ZERO
        self._module.motion.move_to(self.motor, 0)

    def _finish(self) -> None:
        """Give the stop functions back to axis parameters 12 and 13."""
        self.state = Search.IDLE
        values = self._module.axes[self.motor].values
        self._set_stops(right=not values[12], left=not values[13])

    def _set_stops(self, *, right: bool, left: bool) -> None:
        axis = self._module.axes[self.motor]
        for field, on in ((_RIGHT_STOP, right), (_LEFT_STOP, left)):
            axis.write(field, int(not on))
