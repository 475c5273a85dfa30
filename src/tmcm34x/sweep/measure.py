"""What is measured in a run besides the figures of `trace.figures`."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Final

from tmcm34x.chips.ramp import SOFT
from tmcm34x.clock import HZ, NEVER

if TYPE_CHECKING:
    from tmcm34x.bench import Rig
    from tmcm34x.bench.mount import Mount

_US: Final = HZ // 1_000_000
_UNIT: Final = 16
"""A velocity unit is f / 2^(PULSE_DIV + 16) microsteps per second (datasheet 8.1.13)."""


class LossRecorder:
    """The greatest number of full steps by which each rotor was off from what the chip counts, without sign.

    Steps that are lost on the way out may come back on the way home: the end alone does not show them.  Looked at after
    each event.
    """

    def __init__(self, rig: Rig) -> None:
        self.due = NEVER
        self._axes = [mount.axis for world in rig.worlds for mount in world.mounts]
        self.lost = [0] * len(self._axes)
        """Of each motor, so far."""

    def before(self, now: int) -> None:
        """Nothing to see."""

    def after(self, now: int) -> None:
        """Look at each rotor."""
        del now
        for n, axis in enumerate(self._axes):
            lost = axis.lost_fullsteps
            if lost:
                self.lost[n] = max(self.lost[n], round(abs(lost)))


class LoadRecorder:
    """How close each motor came to its limits, and how far it went past its targets."""

    def __init__(self, rig: Rig) -> None:
        self.due = NEVER
        self._rig = rig
        self._last = rig.now
        self.motors = [_MotorRecord(mount) for world in rig.worlds for mount in world.mounts]

    def before(self, now: int) -> None:
        """Look at what each motor does up to `now`."""
        for motor in self.motors:
            motor.before(now, now - self._last)
        self._last = now

    def after(self, now: int) -> None:
        """See which motors have got new targets."""
        del now
        for motor in self.motors:
            motor.after()


class _MotorRecord:
    """One motor's part of `LoadRecorder`."""

    def __init__(self, mount: Mount) -> None:
        self._mount = mount
        self._axis = mount.chip.axes[mount.smda]
        self._target = self._axis.x_target
        self._direction = 0
        self._durations: Counter[float] = Counter()
        self._ratio = 0.0
        self.overshoot = 0
        """Microsteps by which the actual position was beyond the target position, in the direction of the move."""

    @property
    def margin(self) -> int:
        """The least part of its torque that the motor had left [percent]; 0 once it was out of step."""
        return round(100 * (1 - self._ratio))

    @property
    def peak_current_us(self) -> int:
        """How long the motor had the greatest coil current of the run [us]."""
        return self._durations[max(self._durations, default=0.0)] // _US

    def before(self, now: int, duration: int) -> None:
        """Take the motion up to `now`, at the current that has been there since the last event."""
        mount = self._mount
        self._durations[mount.axis.field.current_ma] += duration
        motion = mount.chip.motion(mount.smda)
        unit_hz = HZ / (1 << self._axis.pulse_div + _UNIT)
        for count, (speed, phase) in enumerate(mount.chip.bends(mount.smda, now)):
            if not count:
                self._load(speed * unit_hz)
            self._pass(motion.position + (phase - motion.phase) // motion.step)

    def after(self) -> None:
        """A new target gives the direction of the move."""
        if self._axis.x_target != self._target:
            self._target = self._axis.x_target
            away = self._target - self._mount.chip.position(self._mount.smda)
            self._direction = (away > 0) - (away < 0)

    def _load(self, rate_hz: float) -> None:
        """The motor comes to this rate with the acceleration that it has."""
        ratio = self._mount.axis.load_ratio(self._mount.fullsteps_per_s(rate_hz))
        self._ratio = max(self._ratio, ratio)

    def _pass(self, position: int) -> None:
        if self._axis.mode <= SOFT:
            self.overshoot = max(self.overshoot, (position - self._target) * self._direction)
