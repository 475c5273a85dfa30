"""How virtual time follows the wall clock."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

from tmcm34x import clock

MOST_SPEED: Final = 1e6
"""Beyond any computer, and still far from where the arithmetic of clocks ends."""


class Pace:
    """Virtual time as a straight line over wall time, drawn anew when speed or pause change.

    speed: virtual seconds per wall second, 0..`MOST_SPEED`; 1 is real time, 0 is as fast as there is something to do
    monotonic: the wall clock [s]
    """

    def __init__(self, speed: float, monotonic: Callable[[], float]) -> None:
        self.monotonic = monotonic
        self._speed = speed
        self._paused = False
        self.wall_s = 0.0
        """The wall's time when `target` was last asked for."""
        self.draw(0)

    @property
    def speed(self) -> float:
        """Virtual seconds per wall second."""
        return self._speed

    @property
    def paused(self) -> bool:
        """Whether virtual time stands still."""
        return self._paused

    def draw(self, now: int, speed: float | None = None, paused: bool | None = None) -> None:
        """Begin a new line here: at clock `now`, at the wall's time."""
        self._speed = self._speed if speed is None else speed
        self._paused = self._paused if paused is None else paused
        self._rate = 0.0 if self._paused else self._speed * clock.HZ
        self._start_s = self.monotonic()
        self._origin = now

    def target(self) -> int:
        """The clock that virtual time should show now; `NEVER` when nothing holds it back."""
        wall_s = self.wall_s = self.monotonic()
        if self._rate:
            return self._origin + int((wall_s - self._start_s) * self._rate)
        return self._origin if self._paused else clock.NEVER

    def due_s(self, when: int) -> float:
        """The wall clock's time at which `when` is due [s]; infinite while paused."""
        if self._rate:
            return self._start_s + (when - self._origin) / self._rate
        return math.inf if self._paused else self._start_s
