"""What the motors and outputs have done, in figures."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, NamedTuple

from tmcm34x.board.board import OUTPUTS
from tmcm34x.clock import NEVER
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
    lost: int
    """Full steps by which the rotor is behind the chip now."""


class FiguresRecorder:
    """Sums up what motors and outputs do.

    Between two events the speed may rise and fall again: each such bend is looked at, so that the figures do not
    depend on which events there were.
    """

    def __init__(self, rig: Rig) -> None:
        self.due = NEVER
        self.switched = [[0] * OUTPUTS for _ in rig.modules]
        """How often each output of each module was switched."""
        self._rig = rig
        self._spots = spots(rig)
        self._phases = [spot.motion.phase for spot in self._spots]
        self._distances = [0.0] * len(self._spots)
        self._peaks = [abs(spot.speed) for spot in self._spots]
        self._outputs = [module.board.outputs for module in rig.modules]
        for number, module in enumerate(rig.modules):
            module.board.on_output.append(partial(self._count, number))

    def before(self, now: int) -> None:
        """Add the ways up to `now`."""
        for n, spot in enumerate(self._spots):
            step = spot.motion.step
            for speed, phase in spot.bends(now):
                self._peaks[n] = max(self._peaks[n], abs(speed))
                self._distances[n] += abs(phase - self._phases[n]) / step
                self._phases[n] = phase

    def after(self, now: int) -> None:
        """Nothing to add: motors do not jump."""

    def figures(self) -> tuple[MotorFigures, ...]:
        """So far, of all motors."""
        views = [world.view() for world in self._rig.worlds]
        return tuple(
            MotorFigures(
                spot.number, spot.motor, round(distance), peak, spot.position,
                round(views[spot.number][spot.motor].lost_fullsteps),
            )
            for spot, distance, peak in zip(self._spots, self._distances, self._peaks, strict=True)
        )  # fmt: skip

    def _count(self, number: int, outputs: int) -> None:
        changed = outputs ^ self._outputs[number]
        self._outputs[number] = outputs
        for n in range(OUTPUTS):
            self.switched[number][n] += changed >> n & 1
