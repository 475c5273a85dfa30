"""An axis in physical units: way in mm or degrees, turns per minute, milliamperes.

The divisors and the resolution are read from the module whenever they are needed, so that nothing here is out of
date.  Settings are rounded to the nearest that the module has.

Source: manual 7.1 (4 to 7, 140, 153, 154); the largest currents are the models' (`board.models`).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Generic, TypeVar

from tmcm34x.board.models import MODELS
from tmcm34x.host.attributes import AxisAttributes
from tmcm34x.host.exceptions import NotAvailableError, RangeError
from tmcm34x.tmcl.axis_parameters import BY_KEY as AXIS_KEYS
from tmcm34x.tmcl.units import Scale, current_ma, current_units


class Driven(AxisAttributes, ABC):
    """What `Physical` needs of an axis besides its parameters."""

    __slots__ = ()

    @abstractmethod
    def read(self, key: str) -> int:
        """The value of a parameter."""

    @abstractmethod
    def write(self, key: str, value: int) -> None:
        """Set a parameter."""

    @abstractmethod
    def move_to(self, position: int, *, wait: bool = False, timeout_s: float = 60.0) -> None:
        """Move to a position [microsteps]."""

    @abstractmethod
    def move_by(self, distance: int, *, wait: bool = False, timeout_s: float = 60.0) -> None:
        """Move by a distance [microsteps]."""


AnyAxis = TypeVar("AnyAxis", bound=Driven)


class Physical(Generic[AnyAxis]):
    """`axis` with way in units of `pitch` per turn of what is driven; see `Axis.physical`."""

    def __init__(self, axis: AnyAxis, model: int, fullsteps_per_turn: int, gear: float, pitch: float) -> None:
        self.axis = axis
        self._model = model
        self._drive = fullsteps_per_turn, gear, pitch

    @property
    def scale(self) -> Scale:
        """The conversions, with the divisors and the resolution that the module has now."""
        axis = self.axis
        return Scale(axis.pulse_divisor, axis.ramp_divisor, axis.microstep_resolution, *self._drive)

    @property
    def position(self) -> float:
        """Where the motor is [units]."""
        return self.scale.units(self.axis.actual_position)

    @property
    def speed(self) -> float:
        """The speed it has now [units/s]."""
        return self.scale.units_s(self.axis.actual_speed)

    @property
    def speed_rev_min(self) -> float:
        """The speed it has now [rev/min of what is driven]."""
        return self.scale.rev_min(self.axis.actual_speed)

    @property
    def speed_steps_s(self) -> float:
        """The speed it has now [full steps/s]."""
        return self.scale.steps_s(self.axis.actual_speed)

    @property
    def max_speed(self) -> float:
        """Top speed of moves [units/s]."""
        return self.scale.units_s(self.axis.max_speed)

    @max_speed.setter
    def max_speed(self, speed: float) -> None:
        self._set_max_speed(self.scale.velocity_of_units_s(speed), speed, self.scale.units_s, "units/s")

    @property
    def max_speed_rev_min(self) -> float:
        """Top speed of moves [rev/min of what is driven]."""
        return self.scale.rev_min(self.axis.max_speed)

    @max_speed_rev_min.setter
    def max_speed_rev_min(self, speed: float) -> None:
        self._set_max_speed(self.scale.velocity_of_rev_min(speed), speed, self.scale.rev_min, "rev/min")

    def _set_max_speed(
        self, velocity: float, speed: float, physical: Callable[[int], float], unit: str
    ) -> None:
        """Set parameter 4.  Raises `RangeError`, which says how fast the present pulse divisor allows."""
        most = AXIS_KEYS["max_speed"].high
        if round(velocity) > most:
            raise RangeError(
                f"{speed:g} {unit} is more than the {physical(most):.4g} {unit} that pulse divisor "
                f"{self.scale.pulse_divisor} allows; a lower one (axis parameter 154) is faster, see `tmcm34x units`"
            )
        self.axis.max_speed = round(velocity)

    @property
    def max_acceleration(self) -> float:
        """Acceleration of moves [full steps/s²]."""
        return self.scale.steps_s2(self.axis.max_acceleration)

    @max_acceleration.setter
    def max_acceleration(self, slope: float) -> None:
        self.axis.max_acceleration = round(self.scale.acceleration_of_steps_s2(slope))

    @property
    def max_current_ma(self) -> float:
        """Coil current while moving [mA RMS].  Raises `NotAvailableError` where the module's largest is not known."""
        return current_ma(self.axis.max_current, self._largest_ma)

    @max_current_ma.setter
    def max_current_ma(self, current: float) -> None:
        self.axis.max_current = round(current_units(current, self._largest_ma))

    @property
    def standby_current_ma(self) -> float:
        """Coil current at rest [mA RMS]; see `max_current_ma`."""
        return current_ma(self.axis.standby_current, self._largest_ma)

    @standby_current_ma.setter
    def standby_current_ma(self, current: float) -> None:
        self.axis.standby_current = round(current_units(current, self._largest_ma))

    def move_to(self, position: float, *, wait: bool = False, timeout_s: float = 60.0) -> None:
        """Move to a position [units]; otherwise like `Axis.move_to`."""
        self.axis.move_to(round(self.scale.microsteps(position)), wait=wait, timeout_s=timeout_s)

    def move_by(self, way: float, *, wait: bool = False, timeout_s: float = 60.0) -> None:
        """Move by a way [units]; otherwise like `Axis.move_by`."""
        self.axis.move_by(round(self.scale.microsteps(way)), wait=wait, timeout_s=timeout_s)

    @property
    def _largest_ma(self) -> int:
        row = MODELS.get(self._model)
        if row is None or row.max_current_ma is None:
            raise NotAvailableError(f"the current of setting 255 on a TMCM-{self._model} is not known")
        return row.max_current_ma
