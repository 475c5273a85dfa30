"""What hangs on one module, joined to its board.

Motors are joined to the motion chips by the chip's plan: how the electrical angle moves from now on.  The world asks
the chip to stop at the microstep at which a switch, a hard stop or a load changes, and computes the clock at which a
speed becomes critical; in between nothing runs.  Analogue inputs, encoders and driver status words are computed when
the module asks for them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from math import ceil
from typing import TYPE_CHECKING, Final, NamedTuple

from tmcm34x.chips.tmc246 import FAULTS, Condition, Tmc246
from tmcm34x.chips.tmc423 import Counter, Tmc423
from tmcm34x.clock import HZ, NEVER
from tmcm34x.world.axis import Axis, Field
from tmcm34x.world.motor import FINENESS
from tmcm34x.world.shaft import Encoder
from tmcm34x.world.signal import THRESHOLD, Constant, Source, Wire
from tmcm34x.world.switch import FAR, Line

if TYPE_CHECKING:
    from tmcm34x.board.board import Board, Side
    from tmcm34x.chips.tmc429 import Motion, Tmc429
    from tmcm34x.firmware.module import Module

X_MIN: Final = -(1 << 23)
X_MAX: Final = (1 << 23) - 1
EVERYWHERE: Final = X_MIN, X_MAX
SHUTDOWN: Final = 8
"""Number of the SHUTDOWN pin among the inputs, behind IN_0..IN_7."""

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
    """

    axis: Axis
    sign: int = 1
    max_current_ma: float = 1100.0
    step: int = 4


class Disc(NamedTuple):
    """An encoder on a shaft: see `world.shaft.Encoder`."""

    lines: int
    slip: float = 0.0
    null_level: int | None = 1


class Mount:
    """One motor of a module with the axis on it."""

    def __init__(self, module: Module, motor: int, fitting: Fitting) -> None:
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
        """Whether the chip has had an event or another plan, or somebody did something, since the last look."""
        self._watched = EVERYWHERE
        self._steps = 0
        self._counted = 0
        self._size = 1
        if board.model.drivers is not None:
            self.driver = Tmc246(board.model.drivers)
            self.driver.condition = self._condition
            board.attach_driver(motor, self.driver)

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

    def _condition(self) -> Condition:
        axis = self.axis
        speed = self._speed(self.chip.motion(self.smda).rate_hz)
        return Condition(abs(speed) / axis.motor.load_speed, axis.load_ratio(speed))

    def _speed(self, rate_hz: float) -> float:
        """Full steps per second of a microstep rate."""
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
            Field(
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
        speed = self._speed(self.chip.motion(self.smda).rate_hz)
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


class World:
    """What hangs on `module`: an axis on each motor, and what `connect` and `attach_encoders` add."""

    def __init__(self, module: Module, fittings: Sequence[Fitting]) -> None:
        board = module.board
        self.module = module
        self.mounts = tuple(Mount(module, motor, fitting) for motor, fitting in enumerate(fittings))
        self.dirty = True
        """Whether something happened that must be looked at before time goes on."""
        self.due = NEVER
        """The clock at which `settle` must be called whatever the module does."""
        self.encoder_chip: Tmc423 | None = None
        self._by_wiring = {board.wiring(mount.motor): mount for mount in self.mounts}
        self._sources: dict[int, Source] = {}
        self._overrides: dict[int, Source] = {}
        for index, chip in enumerate(board.chips):
            chip.on_plan.append(partial(self._plan_changed, index))
            chip.on_restart.append(partial(self._restarting, index))
        board.on_current.append(self._current_changed)

    def connect(self, number: int, source: Source) -> None:
        """Drive input 0..7, or SHUTDOWN as number 8."""
        self._sources[number] = source
        self._attach(number)

    def _attach(self, number: int) -> None:
        if number != SHUTDOWN:
            board, source = self.module.board, self._source(number)
            if isinstance(source, Constant):
                board.attach_analog(number, None)
                board.set_analog(number, source.value)
            elif isinstance(source, Wire):
                board.attach_analog(number, partial(self.level, number))
            else:
                board.attach_analog(number, partial(self.level, number), partial(self._next_edge, number))
        self.dirty = True

    def _next_edge(self, number: int) -> int:
        return self._source(number).next_edge(self.module.now)

    def attach_encoders(self, select: int, encoders: Mapping[int, Disc]) -> None:
        """Put a TMCM-323 on select line 0..2 that reads encoders on the shafts of motors."""
        shafts = [
            self._shaft(mount, encoders[mount.motor]) if mount.motor in encoders else None
            for mount in self.mounts
        ]
        self.encoder_chip = Tmc423(shafts)
        for mount, counter in zip(self.mounts, self.encoder_chip.counters, strict=True):
            mount.counter = counter
        self.module.board.attach_spi(select, self.encoder_chip)

    @staticmethod
    def _shaft(mount: Mount, disc: Disc) -> Encoder:
        return Encoder(mount.rotor, mount.axis.motor, disc.lines, slip=disc.slip, null_level=disc.null_level)

    # Told by the board

    def _plan_changed(self, chip: int, smda: int) -> None:
        mount = self._by_wiring.get((chip, smda))
        if mount is not None:
            mount.plan_changed()
            self.dirty = True

    def _restarting(self, chip: int) -> None:
        for (index, _), mount in self._by_wiring.items():
            if index == chip:
                mount.restarting()
        self.dirty = True

    def _current_changed(self, motor: int, current: int, on: bool) -> None:
        del current
        mount = self.mounts[motor]
        if mount.driver is not None:
            mount.driver.enabled = on
        mount.dirty = self.dirty = True

    def wire_changed(self, outputs: int) -> None:
        """An output that is wired to an input here has changed."""
        del outputs
        self.dirty = True

    # Time

    def settle(self, now: int) -> None:
        """Bring everything to `now`, to which the module has come."""
        due = NEVER
        for mount in self.mounts:
            if mount.dirty or mount.due <= now:
                mount.settle(now)
            due = min(due, mount.due)
        if SHUTDOWN in self._sources or SHUTDOWN in self._overrides:
            source = self._source(SHUTDOWN)
            self.module.board.set_shutdown(int(source.level(now) >= THRESHOLD))
            due = min(due, source.next_edge(now))
        self.due = due
        self.dirty = False

    # Inputs

    def _source(self, number: int) -> Source:
        return self._overrides.get(number) or self._sources.get(number) or Constant(0)

    def level(self, number: int) -> int:
        """The level of input 0..7, or of SHUTDOWN as number 8, now."""
        return self._source(number).level(self.module.now)

    # Hands

    def set_level(self, number: int, level: int | None) -> None:
        """Hold an input (0..7, 8 for SHUTDOWN) at a level 0..1023, or give it back to its source."""
        if level is None:
            self._overrides.pop(number, None)
        else:
            self._overrides[number] = Constant(level)
        self._attach(number)

    @property
    def overridden(self) -> list[int]:
        """Inputs that are held although they have a source."""
        return sorted(self._overrides.keys() & self._sources.keys())

    def set_switch(self, motor: int, side: Side, active: bool | None) -> None:
        """Hold a switch line at a level, or let its switches work again."""
        self._line(motor, side).override = active
        self._touch(motor)

    def unplug(self, motor: int, side: Side, unplugged: bool = True) -> None:
        """Break the cable of a switch line, or mend it."""
        self._line(motor, side).unplugged = unplugged
        self._touch(motor)

    def set_fault(self, motor: int, name: str, on: bool) -> None:
        """Raise or end a fault of a driver, one of `chips.tmc246.FAULTS`; a TMCM-342 has no drivers to fail."""
        driver = self.mounts[motor].driver
        if driver is None or name not in FAULTS:
            raise ValueError(f"no fault {name!r} on motor {motor} of a {self.module.board.model.name}")
        driver.set_fault(name, on)
        self._touch(motor)

    def push(self, motor: int, torque_nm: float) -> None:
        """Load the shaft by hand; a positive torque pushes toward lower positions."""
        self.mounts[motor].axis.push_nm = torque_nm
        self._touch(motor)

    def move(self, motor: int, position: float) -> None:
        """Take the load somewhere by force."""
        mount = self.mounts[motor]
        mount.settle(self.module.now)
        mount.axis.push_to(position)
        self._touch(motor)

    def set_power(self, on: bool) -> None:
        """Switch the supply of the module."""
        if on == self.module.powered:
            return
        if on:
            self.module.power_on()
        else:
            self.module.power_off()
        for mount in self.mounts:
            mount.dirty = True
        if self.encoder_chip is not None:
            self.encoder_chip.reset()
        self.dirty = True

    def _line(self, motor: int, side: Side) -> Line:
        axis = self.mounts[motor].axis
        return axis.left if side == "left" else axis.right

    def _touch(self, motor: int) -> None:
        self.mounts[motor].dirty = self.dirty = True

    def view(self) -> tuple[AxisView, ...]:
        """All axes now."""
        return tuple(mount.view() for mount in self.mounts)
