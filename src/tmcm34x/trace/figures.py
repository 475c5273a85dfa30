"""What the motors have done, in figures."""

from __future__ import annotations

from math import ceil
from typing import TYPE_CHECKING, NamedTuple

from tmcm34x.clock import HZ, NEVER
from tmcm34x.trace.recorder import spots

if TYPE_CHECKING:
    from tmcm34x.bench import Rig


class MotorFigures(NamedTuple):
    """What a motor has done."""

    module: int
    motor: int
    distance: int
    """Microsteps made in both directions together."""
    peak_speed: int
    """The greatest speed, without sign [velocity units]."""
    position: int
    """Now [microsteps]."""


class FiguresRecorder:
    """Sums up what the motors do.

    Extremes of the speed are at events; where a motor may turn back is looked at besides.
    """

    def __init__(self, rig: Rig) -> None:
        self.due = NEVER
        self._spots = spots(rig)
        self._places = [spot.motion.phase / spot.motion.step for spot in self._spots]
        self._distances = [0.0] * len(self._spots)
        self._moved = [True] * len(self._spots)
        self._peaks = [abs(spot.speed) for spot in self._spots]

    def before(self, now: int) -> None:
        """Nothing to see."""

    def after(self, now: int) -> None:
        """Add the ways since the last event."""
        self.due = NEVER
        for n, spot in enumerate(self._spots):
            speed = abs(spot.speed)
            if speed or self._moved[n]:
                self._moved[n] = bool(speed)
                self._peaks[n] = max(self._peaks[n], speed)
                motion = spot.motion
                place = motion.phase / motion.step
                self._distances[n] += abs(place - self._places[n])
                self._places[n] = place
                if motion.rate_hz * motion.acceleration_hz_s < 0:
                    delay_s = -motion.rate_hz / motion.acceleration_hz_s
                    self.due = min(self.due, now + ceil(delay_s * HZ))

    def figures(self) -> tuple[MotorFigures, ...]:
        """So far, of all motors."""
        return tuple(
            MotorFigures(spot.number, spot.motor, round(distance), peak, spot.position)
            for spot, distance, peak in zip(self._spots, self._distances, self._peaks, strict=True)
        )
