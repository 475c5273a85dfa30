"""The state of an axis after a tick."""

from __future__ import annotations

from typing import Any, Final

from tmcm34x.clock import NEVER, Value

RAMP: Final = 0
SOFT: Final = 1
VELOCITY: Final = 2
HOLD: Final = 3

TURN: Final = 1 << 24
HALF_TURN: Final = 1 << 23

LAST: Final = NEVER
"""The tick at which a part that lasts ends."""


def signed24(x: int) -> int:
    """The position that 24 bits of `x` stand for, -2^23 .. 2^23 - 1."""
    return (x + HALF_TURN & TURN - 1) - HALF_TURN


class RampState:
    """An axis after one tick; never changed once it is made.

    n: the tick, counted from power-on
    v: velocity, signed, in 1/256 of a velocity unit
    x: X_ACTUAL, signed
    acc: accumulator of the pulse generator, 0..2047
    wave: microstep phase in 64ths of a full step, counted on past the wave's 256
    a: A_ACTUAL: what the last ramp tick did to the velocity, signed
    stopping: whether the last ramp tick took speed away because of a stop switch
    rest: tick since which v is zero; while it is not, some earlier tick
    down: whether the motion, or the last one, is toward lower positions
    """

    __slots__ = ("a", "acc", "down", "n", "rest", "stopping", "v", "wave", "x")

    def __init__(  # noqa: PLR0917
        self,
        n: int = 0,
        v: int = 0,
        x: int = 0,
        acc: int = 0,
        wave: int = 0,
        a: int = 0,
        stopping: bool = False,
        rest: int = 0,
        down: bool = False,
    ) -> None:
        self.n = n
        self.v = v
        self.x = x
        self.acc = acc
        self.wave = wave
        self.a = a
        self.stopping = stopping
        self.rest = rest
        self.down = down

    def with_position(self, x: int) -> RampState:
        """The same at another position."""
        return RampState(self.n, self.v, x, self.acc, self.wave, self.a, self.stopping, self.rest, self.down)

    def with_velocity(self, v: int) -> RampState:
        """The same with another velocity from now on."""
        rest = self.rest if self.v == 0 else self.n
        down = v < 0 if v else self.down
        return RampState(self.n, v, self.x, self.acc, self.wave, self.a, self.stopping, rest, down)

    def save(self) -> Value:
        """All of it, in the order of the arguments."""
        return self.n, self.v, self.x, self.acc, self.wave, self.a, self.stopping, self.rest, self.down

    @staticmethod
    def load(value: Any) -> RampState:
        """The state that `save` has returned."""
        return RampState(*value)


def v_actual(v: int) -> int:
    """V_ACTUAL: a velocity in 1/256 toward zero."""
    return -(-v >> 8) if v < 0 else v >> 8
