"""The registers of one axis, and the velocity that they ask for."""

from __future__ import annotations

from math import isqrt
from typing import Any, Final

from tmcm34x.chips.ramp.state import HALF_TURN, HOLD, RAMP, SOFT, TURN, VELOCITY, RampState
from tmcm34x.clock import Value

FARTHEST: Final = (1 << 19) - 1
"""Distances beyond this count as this in the calculation of the braking velocity."""


def brake_factor(a_max: int, ramp_div: int, pulse_div: int) -> tuple[int, int]:
    """P_MUL (128..255) and P_DIV (0..13) that brake with an A_MAX of 0..2047, 1.2 % early.

    Where no pair fits, the nearest: 255 and 0, or 128 and 13.

    Source: TMC429 datasheet 8.1.10; reduction and nearest pair: fidelity CHIP-9.
    """
    exponent = pulse_div - ramp_div - 4
    for p_div in range(13, -1, -1):
        shift = exponent + p_div
        numerator, denominator = 988 * a_max << max(shift, 0), 1000 << max(-shift, 0)
        if (p_mul := numerator // denominator) <= 255:
            return (p_mul, p_div) if p_mul >= 128 else (128, 13)
    return 255, 0


class Law:
    """Registers by their names, as numbers; after setting them `derive` must be called (but for targets and switches).

    `left` and `right` say whether the stop function of a switch acts: active and not disabled.
    """

    def __init__(self) -> None:
        self.mode = RAMP
        self.x_target = 0
        self.v_min = 0
        self.v_max = 0
        self.v_target = 0
        self.a_max = 0
        self.pmul = 128
        self.pdiv = 0
        self.ramp_div = 0
        self.pulse_div = 0
        self.usrs = 0
        self.left = False
        self.right = False
        self.soft_stop = False
        self.dx_ref_tolerance = 0
        self.derive()

    def derive(self) -> None:
        """Compute from the registers what the parts use; dividers above 13 act as 13 (fidelity CHIP-4)."""
        self.ramp_div = min(self.ramp_div, 13)
        self.pulse_div = min(self.pulse_div, 13)
        soft = self.mode == SOFT
        self.wave_step = 64 >> min(self.usrs, 6)
        """64ths of a full step in a microstep."""
        self.ramp_mask = (1 << self.ramp_div) - 1
        self.rise = self.ramp_div - self.pulse_div
        common = 0 if soft else min(self.pdiv + 3, 11)
        self.shift = self.pdiv + 3 - common
        self.factor = self.pmul if soft else self.pmul << 11 - common
        self.margin = 0 if soft else 1
        """How many steps before the target the braking velocity is zero."""
        self.dense = self.mode == RAMP and self.rise >= 0 and 8 << self.pdiv < self.pmul << self.rise
        """Whether braking from a velocity takes fewer ramp ticks than velocity units."""

    def save_registers(self) -> Value:
        """All registers."""
        return (
            (self.mode, self.x_target, self.v_min, self.v_max, self.v_target, self.a_max, self.pmul),
            (self.pdiv, self.ramp_div, self.pulse_div, self.usrs),
            (self.left, self.right, self.soft_stop, self.dx_ref_tolerance),
        )

    def load_registers(self, value: Any) -> None:
        """Take the registers that `save_registers` has returned."""
        motion, scales, stops = value
        self.mode, self.x_target, self.v_min, self.v_max, self.v_target, self.a_max, self.pmul = motion
        self.pdiv, self.ramp_div, self.pulse_div, self.usrs = scales
        self.left, self.right, self.soft_stop, self.dx_ref_tolerance = stops
        self.derive()

    def distance(self, x: int) -> int:
        """From x to the target, the shorter way round."""
        return (self.x_target - x + HALF_TURN & TURN - 1) - HALF_TURN

    def allowed(self, far: int) -> int:
        """The highest velocity at a distance of at least 1 from which the axis can brake to the target.

        In ramp mode it brakes for the step before the target, and V_MIN makes the last one.

        Source: datasheet 8.1.10; fidelity CHIP-1 (square root) and CHIP-2 (soft mode).
        """
        limit = self.factor * (min(far, FARTHEST) - self.margin) >> self.shift
        return min(self.v_max, max(self.v_min, limit if self.mode == SOFT else isqrt(limit)))

    def nearest(self, velocity: int) -> int:
        """The smallest distance at which a velocity is allowed that is allowed at some distance."""
        if velocity <= self.v_min:
            return 1
        limit = velocity if self.mode == SOFT else velocity * velocity
        return self.margin - ((-limit << self.shift) // self.factor)

    def aim(self, v: int, x: int) -> int:
        """The velocity, signed and in 1/256, that the axis moves toward."""
        if self.mode == HOLD:
            return v
        if self.mode == VELOCITY:
            return max(-self.v_max, min(self.v_max, self.v_target)) << 8
        distance = self.distance(x)
        if distance in (0, -HALF_TURN):
            return 0
        return self.allowed(distance) << 8 if distance > 0 else -self.allowed(-distance) << 8

    def v_target_read(self, state: RampState) -> int:
        """The V_TARGET register: in ramp and soft mode V_MAX with the sign of the motion, 0 when braking or at rest.

        Source: manual chapter 7, parameter 2; fidelity CHIP-3.
        """
        v = state.v
        if self.mode > SOFT:
            return self.v_target
        if v == 0 or state.a * v < 0:
            return 0
        sign = -1 if v < 0 else 1
        aim = sign * self.aim(v, state.x)
        return 0 if aim < self.v_max << 8 and abs(v) >= aim else sign * self.v_max

    def blocked(self, direction: int, x: int) -> bool:
        """Whether a stop switch forbids that direction at x."""
        if self.dx_ref_tolerance and abs(x) <= self.dx_ref_tolerance:
            return False
        return self.right if direction > 0 else self.left

    def windowed(self, direction: int) -> bool:
        """Whether that direction is forbidden everywhere but in the window around zero."""
        return bool(self.dx_ref_tolerance) and (self.right if direction > 0 else self.left)
