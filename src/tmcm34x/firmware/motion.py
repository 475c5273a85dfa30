"""Motion commands: what the firmware writes into the motion chip to make motors turn, move and stop.

Nothing else in the firmware starts or stops a motor.

In velocity mode the chip's V_MAX is open (2047), so that ROR and ROL are not limited by parameter 4; in position
mode it is parameter 4.  An interpolated move scales V_MAX and A_MAX for its own time only.

Source: manual 6.7.1 to 6.7.4; vendor's firmware for sister modules; fidelity FW-20 to FW-26.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from tmcm34x.chips.ramp import RAMP, VELOCITY
from tmcm34x.chips.registers import DATA
from tmcm34x.firmware.axis import RAMP_MODE, V_ACTUAL, V_MAX, V_TARGET, X_ACTUAL, X_TARGET
from tmcm34x.firmware.currents import started
from tmcm34x.tmcl.numbers import AP
from tmcm34x.tmcl.units import LARGEST

if TYPE_CHECKING:
    from tmcm34x.firmware.axis import AxisState
    from tmcm34x.firmware.state import ModuleState

_FRACTION: Final = 64
"""Bits behind the point in the scaling of interpolated moves."""
OPEN: Final = LARGEST
"""The chip's V_MAX in velocity mode: no limit."""


def enter_velocity_mode(axis: AxisState) -> None:
    """Velocity mode with open V_MAX; the target speed stays what it is."""
    if axis.scaled:
        axis.restore_limits()
    axis.write(RAMP_MODE, VELOCITY)
    axis.write(V_MAX, OPEN)
    axis.open = True


def enter_ramp_mode(core: ModuleState, axis: AxisState, mode: int) -> None:
    """Position mode (0) or soft mode (1), limited by parameter 4."""
    axis.restore_limits()
    axis.write(RAMP_MODE, mode)
    started(core, axis, steady=axis.settled)


def rotate(core: ModuleState, axis: AxisState, velocity: int) -> None:
    """Turn at `velocity` (-2047..2047) until the next motion command."""
    enter_velocity_mode(axis)
    axis.write(V_TARGET, velocity)
    started(core, axis, steady=axis.steady)


def stop(core: ModuleState, axis: AxisState) -> None:
    """Come to rest along the ramp: velocity mode, target speed 0."""
    rotate(core, axis, 0)


def halt(core: ModuleState, axis: AxisState) -> None:
    """Come to rest at once: velocity mode, target and actual speed 0."""
    rotate(core, axis, 0)
    axis.write(V_ACTUAL, 0)


def move_to(core: ModuleState, axis: AxisState, position: int) -> None:
    """Go to `position` with the limits of parameters 4 and 5."""
    if not axis.values[AP.MAX_SPEED] and position != axis.read(X_ACTUAL):
        core.tell("no_speed", axis.motor)
    axis.write(X_TARGET, position)
    enter_ramp_mode(core, axis, RAMP)


def move_interpolated(core: ModuleState, targets: Sequence[tuple[AxisState, int]]) -> None:
    """Take motors to positions so that all arrive together, on a straight line.

    Speeds and accelerations are in the ratio of the ways, as fast as parameters 4 and 5 of every motor allow:
    with equal settings the motor with the longest way uses its own, the others a fraction.

    Source: manual 6.7.4; scaling: fidelity FW-24.
    """
    ways = [_distance(axis.read(X_ACTUAL), position) for axis, position in targets]
    speeds = _in_ratio(
        [
            (axis.values[AP.MAX_SPEED], way << axis.values[AP.PULSE_DIVISOR])
            for (axis, _), way in zip(targets, ways, strict=True)
        ]
    )
    accelerations = _in_ratio(
        [
            (
                axis.values[AP.MAX_ACCELERATION],
                way << axis.values[AP.RAMP_DIVISOR] + axis.values[AP.PULSE_DIVISOR],
            )
            for (axis, _), way in zip(targets, ways, strict=True)
        ]
    )
    for (axis, position), speed, acceleration in zip(targets, speeds, accelerations, strict=True):
        axis.write(X_TARGET, position)
        if speed == axis.values[AP.MAX_SPEED] and acceleration == axis.values[AP.MAX_ACCELERATION]:
            axis.restore_limits()
        else:
            axis.scale_limits(speed, acceleration)
        axis.write(RAMP_MODE, RAMP)
        started(core, axis, steady=axis.settled)


def _distance(start: int, end: int) -> int:
    """How far the chip goes, by the shorter way round its 24 bits."""
    way = (end - start) & DATA
    return min(way, DATA + 1 - way)


def _in_ratio(limits: list[tuple[int, int]]) -> list[int]:
    """Numbers in the ratio of the weights, none above its limit, from pairs of limit and weight.

    A number of no weight is its limit; one that would be rounded to zero is 1.
    """
    factor = min(((limit << _FRACTION) // weight for limit, weight in limits if weight), default=0)
    half = 1 << _FRACTION - 1
    return [
        max(factor * weight + half >> _FRACTION, factor > 0) if weight else limit for limit, weight in limits
    ]
