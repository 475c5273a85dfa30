"""One motor of a module with what it drives.

Motors are joined to the motion chips by the chip's plan: how the electrical angle moves from now on.  The mount asks
the chip to stop at the microstep at which a switch, a hard stop or a load changes, and computes the clock at which a
speed becomes critical; in between nothing runs.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from tmcm34x.chips.tmc246 import MotorCondition, Tmc246
from tmcm34x.clock import HZ, NEVER, Value
from tmcm34x.world.load_axis import LoadAxis, MotorField
from tmcm34x.world.motor import FINENESS
from tmcm34x.world.switch import FAR

if TYPE_CHECKING:
    from tmcm34x.board.board import Board, Side
    from tmcm34x.chips.tmc423 import Counter
    from tmcm34x.chips.tmc429 import Motion, Tmc429
    from tmcm34x.firmware.module import FirmwareModule

X_MIN: Final = -(1 << 23)
X_MAX: Final = (1 << 23) - 1
EVERYWHERE: Final = X_MIN, X_MAX

_CLOCKS_PER_RAMP_TICK: Final = 32
_FAR_S: Final = 1e9


class AxisView(NamedTuple):
    """One axis as an onlooker sees it.

    position: of the load, in millimetres or degrees
    angle_rad: of the rotor
    lost_fullsteps: rotor against chip, since power-on
    load: torque asked over torque there is, 0..1
    """

    motor: int
    position: float
    angle_rad: float
    lost_fullsteps: float
    load: float
    current_ma: float
    speed: float
    grip: str
    left: bool
    right: bool
    faults: tuple[str, ...]


@dataclass(frozen=True)
class Fitting:
    """One axis and how it is fitted to a module.

    sign: -1 where the load moves to lower positions when the chip counts up
    max_current_ma: coil current (RMS) of current setting 255
    step: 64ths of a full step that a step output makes, where an outside driver makes the microsteps
    name, shape: for drawings: what the axis is called, and whether it is a "rail", "turntable", "belt" or "shaft"
    """

    axis: LoadAxis
    sign: int = 1
    max_current_ma: float = 1100.0
    step: int = 4
    name: str = ""
    shape: str = "shaft"


class Mount:
    """One motor of a module with the axis on it."""

    def __init__(self, module: FirmwareModule, motor: int, fitting: Fitting) -> None:
        board: Board = module.board
        index, smda = board.wiring(motor)
        self.module = module
        self.board = board
        self.motor = motor
        self.axis = fitting.axis
        self.fitting = fitting
        self.chip: Tmc429 = board.chips[index]
        self.smda = smda
        self.driver: Tmc246 | None = None
        self.counter: Counter | None = None
        """The encoder interface that counts this shaft."""
        self.due = NEVER
        """The clock at which the grip or a bouncing contact must be looked at."""
        self._grip_due = NEVER
        self.dirty = True
        """Whether the chip has had an event or another plan, or something was done to the axis, since the last look."""
        self._watched = EVERYWHERE
        self._steps = 0
        self._counted = 0
        self._size = 1
        if board.model.drivers is not None:
            self.driver = Tmc246(board.model.drivers)
            self.driver.condition = self._condition
            board.attach_driver(motor, self.driver)

    # State

    def save(self) -> Value:
        """The axis and its driver, and what the mount knows of the chip."""
        return (
            (self.due, self._grip_due, self.dirty, self._watched, self._steps, self._counted, self._size),
            self.axis.save(),
            None if self.driver is None else self.driver.save(),
        )

    def load(self, value: Any) -> None:
        """Become a mount that was saved."""
        own, axis, driver = value
        self.due, self._grip_due, self.dirty, self._watched, self._steps, self._counted, self._size = own
        self.axis.load_state(axis)
        if self.driver is not None:
            self.driver.load(driver)

    # The field

    def angle(self) -> int:
        """The field's angle now, in the axis's direction."""
        return self._angle(self.chip.motion(self.smda).phase)

    def _angle(self, phase: int) -> int:
        """The angle that belongs to a microstep phase of the chip."""
        if self.driver is None:
            # An outside driver counts steps, whatever the chip's own microstep is.
            phase = (self._steps + (phase - self._counted) // self._size) * self.fitting.step
        return self.fitting.sign * phase

    def plan_changed(self) -> None:
        """The chip moves otherwise from now on."""
        self.dirty = True
        if self.driver is None:
            motion = self.chip.motion(self.smda)
            self._steps += (motion.phase - self._counted) // self._size
            self._counted, self._size = motion.phase, motion.step

    def restarting(self) -> None:
        """The chip is about to count from zero again, and its driver to forget everything."""
        self.plan_changed()
        self._counted, self._size = 0, FINENESS
        if self.driver is not None:
            self.driver.reset()
            self.axis.power_on()

    def current_ma(self) -> float:
        """Coil current (RMS) that the motor gets."""
        if not self.module.powered:
            return 0.0
        driver, board = self.driver, self.board
        if driver is None:
            return self.fitting.max_current_ma
        if not (board.enabled[self.motor] and driver.driving):
            return 0.0
        return self.fitting.max_current_ma * board.currents[self.motor] / 255

    def _condition(self) -> MotorCondition:
        axis = self.axis
        speed = self.fullsteps_per_s(self.chip.motion(self.smda).rate_hz)
        return MotorCondition(abs(speed) / axis.motor.load_speed, axis.load_ratio(speed))

    def fullsteps_per_s(self, rate_hz: float) -> float:
        """Speed of the field at a microstep rate [full steps/s], in the direction of the load."""
        size = self.fitting.step if self.driver is None else self.chip.motion(self.smda).step
        return self.fitting.sign * rate_hz * size / FINENESS

    # Settling

    def settle(self, now: int) -> None:
        """Bring axis and switches to `now`, and see what comes next."""
        axis = self.axis
        if self.dirty or self._grip_due <= now:
            self._follow(now)
        self._set_switch("left", axis.left.active(now))
        self._set_switch("right", axis.right.active(now))
        if self.dirty:
            self._follow(now)
        self.due = min(self._grip_due, axis.next_event(now))

    def _set_switch(self, side: Side, active: bool) -> None:
        if active != self.board.switch(self.motor, side):
            self.board.set_switch(self.motor, side, active)

    def _follow(self, now: int) -> None:
        motion = self.chip.motion(self.smda)
        fitting, axis = self.fitting, self.axis
        size = fitting.step if self.driver is None else motion.step
        scale = fitting.sign * size / FINENESS
        axis.follow(
            now,
            MotorField(
                self._angle(motion.phase),
                motion.rate_hz * scale,
                motion.acceleration_hz_s * scale,
                self.current_ma(),
            ),
        )
        self.dirty = False
        self._grip_due = NEVER
        if motion.acceleration_hz_s:
            delay_s = axis.delay_s()
            if delay_s < _FAR_S:
                self._grip_due = now + max(ceil(delay_s * HZ), _CLOCKS_PER_RAMP_TICK << motion.ramp_div)
        if self.counter is not None and self.counter.waits_for_null:
            self._sample(now, motion)
        self._watch(motion.position, size)

    def _sample(self, now: int, motion: Motion) -> None:
        """Have the encoder counted, and be there again when the shaft turns round."""
        if self.counter is not None:
            self.counter.sample()
            if motion.rate_hz * motion.acceleration_hz_s < 0:
                clocks = ceil(-motion.rate_hz / motion.acceleration_hz_s * HZ)
                self._grip_due = min(
                    self._grip_due, now + max(clocks, _CLOCKS_PER_RAMP_TICK << motion.ramp_div)
                )

    def _watch(self, x: int, size: int) -> None:
        """Have the chip stop where the axis's room ends."""
        low, high = self.axis.room()
        angle = self.axis.field.angle
        below, above = angle - low, high - angle
        if self.fitting.sign < 0:
            below, above = above, below
        x_low = x - below // size if below < FAR >> 1 else X_MIN
        x_high = x + above // size if above < FAR >> 1 else X_MAX
        watched = max(x_low, X_MIN), min(x_high, X_MAX)
        if watched != self._watched:
            self._watched = watched
            self.chip.watch(self.smda, *watched)

    # What one sees

    def rotor(self) -> int:
        """The rotor position now."""
        return self.axis.rotor_at(self.angle())

    def view(self) -> AxisView:
        """The axis now."""
        axis, now = self.axis, self.module.now
        rotor = self.rotor()
        speed = self.fullsteps_per_s(self.chip.motion(self.smda).rate_hz)
        return AxisView(
            self.motor,
            axis.position(rotor),
            axis.motor.angle_rad(rotor),
            axis.lost_fullsteps_at(self.angle()),
            axis.load_ratio(speed),
            self.current_ma(),
            speed,
            axis.grip.value,
            axis.left.active(now),
            axis.right.active(now),
            tuple(sorted(self.driver.faults)) if self.driver else (),
        )
