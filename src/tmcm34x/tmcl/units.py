"""Physical quantities of the numbers that TMCL uses: speed, acceleration, position, current.

The motion chip counts speed in velocity units and acceleration in acceleration units, whose sizes the two divisors
(axis parameters 153 and 154) set; positions are microsteps, whose size parameter 140 sets; currents are 1/255 of the
largest one.  Nothing here rounds or clips unless it says so.

Source: TMC429 datasheet rev. 2.06, 8.1.10 and 8.1.13; manual 7.1 (6, 7, 140, 153, 154).
"""

from __future__ import annotations

from typing import Final, NamedTuple

from tmcm34x import clock

LARGEST: Final = 2047
"""Of a velocity or acceleration setting."""
LARGEST_DIVISOR: Final = 13
LARGEST_RESOLUTION: Final = 6
FULL_CURRENT: Final = 255
"""Setting of the largest current."""
FULLSTEPS_PER_TURN: Final = 200
"""Of the usual two-phase motor, 1.8 degrees."""
_SPEED_DIVIDER: Final = 2048 * 32
_ACCELERATION_EXPONENT: Final = 29


def speed_hz(velocity: float, pulse_divisor: int) -> float:
    """Microsteps per second of a velocity setting; the sign is the direction."""
    return clock.HZ * velocity / (_SPEED_DIVIDER << pulse_divisor)


def velocity_units(speed_hz: float, pulse_divisor: int) -> float:
    """The velocity setting, not rounded, that makes `speed_hz` microsteps per second."""
    return speed_hz * (_SPEED_DIVIDER << pulse_divisor) / clock.HZ


def acceleration_hz_s(acceleration: float, pulse_divisor: int, ramp_divisor: int) -> float:
    """Microsteps per second squared of an acceleration setting."""
    return clock.HZ**2 * acceleration / (1 << pulse_divisor + ramp_divisor + _ACCELERATION_EXPONENT)


def acceleration_units(slope_hz_s: float, pulse_divisor: int, ramp_divisor: int) -> float:
    """The acceleration setting, not rounded, that makes `slope_hz_s` microsteps per second squared."""
    return slope_hz_s * (1 << pulse_divisor + ramp_divisor + _ACCELERATION_EXPONENT) / clock.HZ**2


def current_ma(setting: float, largest_ma: float) -> float:
    """Coil current of a setting 0..255 on a module whose largest current is `largest_ma` [mA RMS]."""
    return setting * largest_ma / FULL_CURRENT


def current_units(current_ma: float, largest_ma: float) -> float:
    """The setting, not rounded, that makes `current_ma`."""
    return current_ma * FULL_CURRENT / largest_ma


def brakes_exactly(acceleration: int, pulse_divisor: int, ramp_divisor: int) -> bool:
    """Whether the chip has braking factors P_MUL and P_DIV for this acceleration.

    Where it has none, a move overshoots its target or creeps to it.  Source: TMC429 datasheet 8.1.10: P_MUL is
    128..255, P_DIV 0..13, and P_MUL / 2**(P_DIV + 3) is acceleration / (128 * 2**(ramp_divisor - pulse_divisor)).
    """
    reduced = 0.988 * acceleration / 2.0 ** (ramp_divisor - pulse_divisor)
    return 0.25 <= reduced < 256 * 16


class Scale(NamedTuple):
    """How the numbers of one axis become physical: its divisors, its resolution, and what the motor drives.

    pulse_divisor, ramp_divisor: axis parameters 154 and 153
    resolution: axis parameter 140; a full step has 2**resolution microsteps
    fullsteps_per_turn: of the motor
    gear: turns of the motor for one turn of what it drives
    pitch: way per turn of what is driven, such as 5 mm or 360 degrees, in any unit
    """

    pulse_divisor: int = 3
    ramp_divisor: int = 7
    resolution: int = LARGEST_RESOLUTION
    fullsteps_per_turn: int = FULLSTEPS_PER_TURN
    gear: float = 1.0
    pitch: float = 360.0

    @property
    def microsteps_per_turn(self) -> float:
        """Microsteps of one turn of what is driven."""
        return self.gear * (self.fullsteps_per_turn << self.resolution)

    # Speed

    def steps_s(self, velocity: float) -> float:
        """Full steps per second of a velocity setting."""
        return speed_hz(velocity, self.pulse_divisor) / (1 << self.resolution)

    def rev_min(self, velocity: float) -> float:
        """Turns per minute of a velocity setting."""
        return 60 * speed_hz(velocity, self.pulse_divisor) / self.microsteps_per_turn

    def units_s(self, velocity: float) -> float:
        """Speed of a velocity setting in units of `pitch` per second."""
        return self.rev_min(velocity) / 60 * self.pitch

    def velocity_of_rev_min(self, speed: float) -> float:
        """The velocity setting, not rounded, for `speed` turns per minute."""
        return velocity_units(speed / 60 * self.microsteps_per_turn, self.pulse_divisor)

    def velocity_of_steps_s(self, speed: float) -> float:
        """The velocity setting, not rounded, for `speed` full steps per second."""
        return velocity_units(speed * (1 << self.resolution), self.pulse_divisor)

    def velocity_of_units_s(self, speed: float) -> float:
        """The velocity setting, not rounded, for `speed` units of `pitch` per second."""
        return self.velocity_of_rev_min(60 * speed / self.pitch)

    # Acceleration

    def steps_s2(self, acceleration: float) -> float:
        """Full steps per second squared of an acceleration setting."""
        slope = acceleration_hz_s(acceleration, self.pulse_divisor, self.ramp_divisor)
        return slope / (1 << self.resolution)

    def acceleration_of_steps_s2(self, slope: float) -> float:
        """The acceleration setting, not rounded, for `slope` full steps per second squared."""
        return acceleration_units(slope * (1 << self.resolution), self.pulse_divisor, self.ramp_divisor)

    def acceleration_of_ramp(self, velocity: float, seconds: float) -> float:
        """The acceleration setting, not rounded, that reaches a velocity setting from rest in `seconds`."""
        slope = speed_hz(velocity, self.pulse_divisor) / seconds
        return acceleration_units(slope, self.pulse_divisor, self.ramp_divisor)

    def ramp_s(self, velocity: float, acceleration: float) -> float:
        """Seconds from rest to a velocity setting; infinite without acceleration."""
        if not acceleration:
            return float("inf")
        slope = acceleration_hz_s(acceleration, self.pulse_divisor, self.ramp_divisor)
        return abs(speed_hz(velocity, self.pulse_divisor)) / slope

    # Position

    def turns(self, microsteps: float) -> float:
        """Turns of what is driven."""
        return microsteps / self.microsteps_per_turn

    def units(self, microsteps: float) -> float:
        """Way in units of `pitch`."""
        return self.turns(microsteps) * self.pitch

    def microsteps(self, units: float) -> float:
        """Microsteps, not rounded, of a way in units of `pitch`."""
        return units / self.pitch * self.microsteps_per_turn

    def move_s(self, microsteps: float, velocity: float, acceleration: float) -> float:
        """Seconds of a positioning move from rest to rest: a trapezium, or a triangle where it is short."""
        speed = abs(speed_hz(velocity, self.pulse_divisor))
        slope = acceleration_hz_s(acceleration, self.pulse_divisor, self.ramp_divisor)
        way = abs(microsteps)
        if not way:
            return 0.0
        if not speed or not slope:
            return float("inf")
        if way < speed * speed / slope:
            return 2 * (way / slope) ** 0.5
        return way / speed + speed / slope


class RampSettings(NamedTuple):
    """Divisors, velocity and acceleration that come nearest to a wanted speed and ramp."""

    scale: Scale
    velocity: int
    acceleration: int


def best_settings(scale: Scale, rev_min: float, ramp_s: float) -> RampSettings | None:
    """The finest divisors with which a motor reaches `rev_min` turns per minute within `ramp_s` seconds.

    scale: the resolution, motor and gear; its divisors do not matter
    None where no divisors reach the speed or the ramp.  The largest velocity setting wins, as the finest; of the
    ramp divisors those with exact braking, then the one whose ramp is nearest.
    """
    for pulse in range(LARGEST_DIVISOR, -1, -1):
        finest = scale._replace(pulse_divisor=pulse)
        velocity = round(finest.velocity_of_rev_min(rev_min))
        if 0 < velocity <= LARGEST:
            return _best_ramp(finest, velocity, ramp_s)
    return None


def _best_ramp(scale: Scale, velocity: int, ramp_s: float) -> RampSettings | None:
    found: list[tuple[bool, float, RampSettings]] = []
    for ramp in range(LARGEST_DIVISOR, -1, -1):
        tried = scale._replace(ramp_divisor=ramp)
        acceleration = round(tried.acceleration_of_ramp(velocity, ramp_s))
        if 0 < acceleration <= LARGEST:
            miss = abs(tried.ramp_s(velocity, acceleration) - ramp_s)
            exact = brakes_exactly(acceleration, tried.pulse_divisor, ramp)
            found.append((not exact, miss, RampSettings(tried, velocity, acceleration)))
    return min(found, key=lambda entry: entry[:2])[2] if found else None
