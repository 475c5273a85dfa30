"""The built-in reference search: one state machine for each motor, in `AxisState.search`.

Mode 1 looks for the left (reference) switch, modes 2 and 3 for the right one first; a motor that starts on the right
switch leaves it, so that its edge is met from outside.  Once the left input closes, the motor leaves it slowly to the
right and comes back slowly; the middle between the point where it opened and the point where it closed again becomes
position 0, and the motor goes there.  Going left from the right end, the first switch on the left input is the
reference switch, if there is one: so mode 3 differs from mode 2 only in what is connected.

A search moves when the world does: it is looked at whenever a pin changes or the motion chip has an event, and has
no clock of its own.  A switch that never comes leaves it searching.

Source: manual 6.7.13, 7.1 (193 to 196) and 9.1; fidelity PROG-30 to PROG-37.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from tmcm34x.chips.ramp import signed24
from tmcm34x.firmware import encoder, motion
from tmcm34x.firmware.axis import STOP_SWITCHES, X_ACTUAL, ReferenceSearch
from tmcm34x.tmcl.numbers import AP

if TYPE_CHECKING:
    from tmcm34x.firmware.axis import AxisState
    from tmcm34x.firmware.state import ModuleState

LEFT_SWITCH_ONLY: Final = 1
"""Referencing mode (axis parameter 193) without a right switch."""
_LEFT_STOP, _RIGHT_STOP = STOP_SWITCHES
_SLOW: Final = 4
"""The switch speed is this part of the maximum positioning speed when parameter 195 is 0."""
_AT_SEARCH_SPEED: Final = frozenset({ReferenceSearch.GOING_RIGHT, ReferenceSearch.GOING_LEFT})
_RIGHTWARD: Final = frozenset({ReferenceSearch.GOING_RIGHT, ReferenceSearch.LEAVING})
_NEXT: Final = {
    ReferenceSearch.LEAVING_RIGHT: ReferenceSearch.GOING_RIGHT,
    ReferenceSearch.GOING_RIGHT: ReferenceSearch.GOING_LEFT,
    ReferenceSearch.GOING_LEFT: ReferenceSearch.LEAVING,
    ReferenceSearch.LEAVING: ReferenceSearch.REENTERING,
}
"""The stretches in their order; REENTERING is followed by the way to zero."""


def start(core: ModuleState, axis: AxisState) -> None:
    """RFS START: begin, or begin again, with the mode that is set now."""
    left_only = axis.values[AP.REFERENCE_MODE] == LEFT_SWITCH_ONLY
    _set_stops(axis, right=not left_only, left=True)
    if left_only:
        _enter(core, axis, ReferenceSearch.GOING_LEFT)
    else:
        _enter(
            core, axis, ReferenceSearch.LEAVING_RIGHT if axis.right_switch else ReferenceSearch.GOING_RIGHT
        )
    advance(core, axis)


def stop(core: ModuleState, axis: AxisState) -> None:
    """RFS STOP: leave off, along the ramp."""
    if axis.search:
        abort(axis)
        motion.stop(core, axis)


def abort(axis: AxisState) -> None:
    """Leave off, because another command takes over the motor or all is done; 12 and 13 are in force again."""
    if axis.search:
        axis.search = ReferenceSearch.IDLE
        values = axis.values
        _set_stops(axis, right=not values[AP.RIGHT_SWITCH_DISABLE], left=not values[AP.LEFT_SWITCH_DISABLE])


def stop_motor(core: ModuleState, axis: AxisState) -> None:
    """Stop a motor along its ramp, whatever it was doing."""
    abort(axis)
    motion.stop(core, axis)


def halt_motor(core: ModuleState, axis: AxisState) -> None:
    """Stop a motor at once, whatever it was doing."""
    abort(axis)
    motion.halt(core, axis)


def advance(core: ModuleState, axis: AxisState) -> None:
    """Look whether the present stretch is over."""
    while axis.search and _stretch_done(axis):
        _take_next_stretch(core, axis)


def _stretch_done(axis: AxisState) -> bool:
    match axis.search:
        case ReferenceSearch.GOING_RIGHT:
            return axis.right_switch
        case ReferenceSearch.LEAVING_RIGHT:
            return not axis.right_switch
        case ReferenceSearch.LEAVING:
            return not axis.left_switch
        case ReferenceSearch.GOING_TO_ZERO:
            return axis.settled
        case _:
            return axis.left_switch


def _take_next_stretch(core: ModuleState, axis: AxisState) -> None:
    here = axis.read(X_ACTUAL)
    if axis.search is ReferenceSearch.GOING_TO_ZERO:
        abort(axis)
        core.tell("reference", axis.motor)
    elif axis.search is ReferenceSearch.REENTERING:
        _set_zero(core, axis, here)
    else:
        if axis.search is ReferenceSearch.GOING_RIGHT:
            axis.right_end = here
        elif axis.search is ReferenceSearch.LEAVING:
            axis.opened = here
        _enter(core, axis, _NEXT[axis.search])


def _enter(core: ModuleState, axis: AxisState, search: ReferenceSearch) -> None:
    """Begin a stretch: search speed on the way to a switch, switch speed while its points are measured."""
    axis.search = search
    values = axis.values
    if search in _AT_SEARCH_SPEED:
        speed = values[AP.REFERENCE_SEARCH_SPEED] or values[AP.MAX_SPEED]
    else:
        speed = values[AP.REFERENCE_SWITCH_SPEED] or values[AP.MAX_SPEED] // _SLOW
    motion.rotate(core, axis, speed if search in _RIGHTWARD else -speed)


def _set_zero(core: ModuleState, axis: AxisState, closed: int) -> None:
    """Count from the middle of the two switching points, and go there, even if the switch is closed there."""
    middle = closed + signed24(axis.opened - closed) // 2
    both = axis.values[AP.REFERENCE_MODE] != LEFT_SWITCH_ONLY
    if both:
        axis.values[AP.END_SWITCH_DISTANCE] = abs(signed24(axis.right_end - middle))
    if AP.LAST_REFERENCE_POSITION in axis.values:
        axis.values[AP.LAST_REFERENCE_POSITION] = signed24(middle)
    here = signed24(closed - middle)
    axis.write(X_ACTUAL, here)
    encoder.preload(core, axis.motor, here)
    _set_stops(axis, right=both, left=False)
    axis.search = ReferenceSearch.GOING_TO_ZERO
    motion.move_to(core, axis, 0)


def _set_stops(axis: AxisState, *, right: bool, left: bool) -> None:
    for field, on in ((_RIGHT_STOP, right), (_LEFT_STOP, left)):
        axis.write(field, int(not on))
