"""One axis: a motor, its load and its switches, following the field that the chip turns.

The chip commands an electrical angle; the rotor follows it, displaced by `slip`.  A rotor that is asked for more
torque than the motor has at that speed lets go of the field and stays behind; it catches on again at a multiple of
an electrical cycle when the field is slow enough.  A rotor that is driven against a hard stop stays there while the
field turns on.  This is decided where the acceleration, the current, the outer torque or a switch changes and where
the speed reaches a critical value, never microstep by microstep (fidelity WORLD-3).

Left out: resonances, the elastic angle between field and rotor, how long a falling load takes, backlash.
"""

from __future__ import annotations

from enum import Enum
from math import inf, pi
from typing import Any, Final, NamedTuple

from tmcm34x.clock import Value
from tmcm34x.world.load import Load, ZoneMap
from tmcm34x.world.motor import CYCLE, FINENESS, Motor
from tmcm34x.world.switch import FAR, SwitchInput, narrowest

YIELD: Final = CYCLE // 2
"""How far the field gets ahead of a rotor at a hard stop before the rotor is out of step."""


class Grip(Enum):
    """How rotor and field are joined."""

    FREE = "free"
    """No current."""
    FOLLOWING = "following"
    """In step."""
    BLOCKED = "blocked"
    """At a hard stop, the field turning on."""
    STALLED = "stalled"
    """Left behind, waiting for a slow field."""


class MotorField(NamedTuple):
    """What the module does to the motor at a moment; positive is the load's positive direction.

    angle: electrical angle in rotor units, never wrapped
    speed: full steps per second, signed
    acceleration: full steps per second squared, signed
    current_ma: coil current (RMS), 0 with the coils off
    """

    angle: int = 0
    speed: float = 0.0
    acceleration: float = 0.0
    current_ma: float = 0.0


class LoadAxis:
    """A motor with its load, and the lines of its two switch inputs.

    Positions are those of the load: millimetres or degrees.
    """

    def __init__(
        self, motor: Motor, load: Load, left: SwitchInput | None = None, right: SwitchInput | None = None
    ) -> None:
        self.motor = motor
        self.load = load
        self.left = left or SwitchInput()
        self.right = right or SwitchInput()
        self.units = load.units_per_position(motor)
        self.turn = whole_turn(motor, load)
        self.low = -FAR if load.low is None else round(load.low * self.units)
        self.high = FAR if load.high is None else round(load.high * self.units)
        self.rotor = round(load.start * self.units)
        """Rotor position in rotor units; 0 at position 0 of the load."""
        self.field = MotorField()
        self.grip = Grip.FREE
        self.push_nm = 0.0
        """Outer torque put on the shaft from outside; positive pushes toward lower positions."""
        self._phase = self.rotor % CYCLE
        self._slip = 0
        self._origin = self.rotor
        self._zones = ZoneMap(load, self.units, self.turn)
        self._radians = 2 * pi / motor.steps_per_turn
        self._inertia = motor.inertia_kgm2 + load.inertia_kgm2
        for line in (self.left, self.right):
            line.settle(self.rotor)
        self._lowest = self._highest = self.rotor
        self._look_around()

    # State

    def save(self) -> Value:
        """Where the rotor is, how it got there, and the lines of the switches."""
        return (
            (self.rotor, tuple(self.field), self.grip.value, self.push_nm),
            (self._slip, self._origin, self._lowest, self._highest),
            (self.left.save(), self.right.save()),
        )

    def load_state(self, value: Any) -> None:
        """Become an axis that was saved."""
        (self.rotor, field, grip, self.push_nm), places, lines = value
        self.field, self.grip = MotorField(*field), Grip(grip)
        self._slip, self._origin, self._lowest, self._highest = places
        for line, saved in zip((self.left, self.right), lines, strict=True):
            line.load(saved)

    # What the field does

    def power_on(self) -> None:
        """The chip counts from zero again: what it commands now is no loss."""
        self.grip = Grip.FREE
        self._origin = self._nearest(0)

    def follow(self, now: int, field: MotorField) -> None:
        """Take a field at clock `now`; to be called wherever `room`, `delay_s` or a change of the field asks for it."""
        self.field = field
        if not field.current_ma:
            self._let_go(Grip.FREE)
        else:
            self._catch(field)
            if self.grip is Grip.FOLLOWING:
                self._turn(field)
        if not self._lowest <= self.rotor <= self._highest:
            self.left.follow(now, self.rotor)
            self.right.follow(now, self.rotor)
            self._look_around()

    def _look_around(self) -> None:
        """Find the rotor positions between which no switch and no outer torque changes."""
        rotor = self.rotor
        low, high = narrowest((self.left.room(rotor), self.right.room(rotor)))
        below, above = self._zones.room(rotor)
        self._lowest = low if below is None else max(low, below)
        self._highest = high if above is None else min(high, above)

    def _catch(self, field: MotorField) -> None:
        """Get into step again, if the rotor is out of it and the field lets it."""
        if self.grip is Grip.FOLLOWING:
            return
        if self.grip is Grip.BLOCKED:
            outward = field.speed > 0 if self.rotor == self.high else field.speed < 0
            if outward:
                return
        elif abs(field.speed) > self.motor.start_speed:
            self._let_go(Grip.STALLED)
            return
        self._slip = self._nearest(field.angle)
        self.grip = Grip.FOLLOWING

    def _turn(self, field: MotorField) -> None:
        wanted = field.angle + self._slip
        if wanted > self.high + YIELD or wanted < self.low - YIELD:
            self.rotor = self.high if wanted > self.high else self.low
            self.grip = Grip.BLOCKED
            return
        self.rotor = max(self.low, min(self.high, wanted))
        needed = self._needed(field.speed, field.acceleration)
        if needed > self.motor.torque(field.current_ma, abs(field.speed)):
            self._let_go(Grip.STALLED)

    def _nearest(self, angle: int) -> int:
        """The slip that brings the rotor to the nearest place where it is in step with the field."""
        return (self.rotor - angle - self._phase + CYCLE // 2) // CYCLE * CYCLE + self._phase

    def _let_go(self, grip: Grip) -> None:
        """The field does not hold the rotor; an outer torque that friction cannot hold takes it along."""
        self.grip = grip
        hold = self.load.friction_nm + self.motor.detent_torque_nm
        outer = self._outer()
        while abs(outer) > hold:
            low, high = self._zones.room(self.rotor)
            if outer > 0:
                end = self.low if low is None else max(self.low, low - 1)
            else:
                end = self.high if high is None else min(self.high, high + 1)
            if abs(end) == FAR or self.turn is not None:
                return
            self.rotor = end
            if end in (self.low, self.high):
                return
            outer = self._outer()

    # Torque

    def _outer(self) -> float:
        return self._zones.torque(self.rotor) + self.push_nm

    def _needed(self, speed: float, acceleration: float) -> float:
        """The torque that the motor must give [Nm]; the sign of `speed` is that of the motion."""
        needed = self._outer() + self._inertia * acceleration * self._radians
        friction = self.load.friction_nm
        if speed:
            return abs(needed + friction if speed > 0 else needed - friction)
        return max(0.0, abs(needed) - friction)

    def load_ratio(self, speed: float | None = None) -> float:
        """Torque asked over torque there is, 0..1; 1 when the motor is out of step.

        speed: the field's at this moment, if it is not the last one followed [full steps per second]
        """
        if self.grip is Grip.FREE:
            return 0.0
        if self.grip is not Grip.FOLLOWING:
            return 1.0
        field = self.field
        speed = field.speed if speed is None else speed
        available = self.motor.torque(field.current_ma, abs(speed))
        return min(1.0, self._needed(speed, field.acceleration) / available) if available else 1.0

    # When something changes

    def delay_s(self) -> float:
        """Seconds until the speed is such that the grip may change as things are; infinite if it never will.

        A rotor in step loses it above some speed; one out of step catches on below another.
        """
        _, speed, acceleration, current_ma = self.field
        if not acceleration or self.grip is Grip.FREE:
            return inf
        rising = speed if acceleration > 0 else -speed
        if self.grip is Grip.FOLLOWING:
            limit = self.motor.pull_out_speed(current_ma, self._needed(acceleration, acceleration))
        else:
            limit = -self.motor.start_speed if self.grip is Grip.STALLED else 0.0
            if rising >= 0:
                return inf
        return max(0.0, (limit - rising) / abs(acceleration))

    def room(self) -> tuple[int, int]:
        """The lowest and highest field angle at which nothing changes; beyond them `follow` must be called."""
        if self.grip is not Grip.FOLLOWING:
            return -FAR, FAR
        slip, low, high = self._slip, self._lowest, self._highest
        if low <= self.low:
            low = self.low - YIELD
        if high >= self.high:
            high = self.high + YIELD
        return low - slip, high - slip

    def next_event(self, now: int) -> int:
        """The next clock after `now` at which a contact bounces."""
        return min(self.left.next_event(now), self.right.next_event(now))

    # What one sees

    def rotor_at(self, angle: int) -> int:
        """The rotor position under a field angle within `room`."""
        if self.grip is not Grip.FOLLOWING:
            return self.rotor
        return max(self.low, min(self.high, angle + self._slip))

    def position(self, rotor: int) -> float:
        """A rotor position in the load's unit; 0..360 on a circular axis."""
        return (rotor % self.turn if self.turn else rotor) / self.units

    @property
    def lost_fullsteps(self) -> float:
        """Full steps by which the rotor is off what the chip has counted since power-on."""
        return self.lost_fullsteps_at(self.field.angle)

    def lost_fullsteps_at(self, angle: int) -> float:
        """The same under a field angle within `room`."""
        slip = self._slip if self.grip is Grip.FOLLOWING else self.rotor - angle
        return (slip - self._origin) / FINENESS

    def push_to(self, position: float) -> None:
        """Move the load by force; a motor under current only yields by whole electrical cycles."""
        place = max(self.low, min(self.high, round(position * self.units)))
        if self.grip is Grip.FOLLOWING:
            self._slip += (place - self.rotor + CYCLE // 2) // CYCLE * CYCLE
            place = max(self.low, min(self.high, self.field.angle + self._slip))
        self.rotor = place


def whole_turn(motor: Motor, load: Load) -> int | None:
    """Rotor units in a turn of a circular load, None for one with ends.

    Raises ValueError where a turn is not a whole number of units, so that a place would wander.
    """
    if not load.circular:
        return None
    exact = 360 * load.units_per_position(motor)
    if abs(exact - round(exact)) > 1e-6:
        raise ValueError(f"a turn of the table is {exact:g} 64ths of a full step: not a whole number")
    return round(exact)
