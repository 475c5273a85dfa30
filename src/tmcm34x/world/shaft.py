"""Incremental encoders on a motor's shaft, with a null channel and slip."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

from tmcm34x.world.motor import Motor


class Encoder:
    """A disc that turns with a rotor.

    lines: of the disc; four quadrature edges each
    slip: fraction of the rotor's way that the disc does not make, 0 for a rigid coupling
    null_level: level of the null channel at its mark, or None without one
    rotor: returns the rotor position
    """

    def __init__(
        self,
        rotor: Callable[[], int],
        motor: Motor,
        lines: int,
        *,
        slip: float = 0.0,
        null_level: int | None = 1,
    ) -> None:
        self._rotor = rotor
        self.edges_per_turn = 4 * lines
        self.null_level = null_level
        share = Fraction(1 - slip).limit_denominator(1_000_000)
        self._numerator = self.edges_per_turn * share.numerator
        self._denominator = motor.units_per_turn() * share.denominator

    def edges(self) -> int:
        """Quadrature edges passed, signed; 0 at rotor position 0."""
        return self._rotor() * self._numerator // self._denominator
