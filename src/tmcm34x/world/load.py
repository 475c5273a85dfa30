"""Loads on a motor's shaft: a carriage on a screw or belt, or a table that turns.

A load has positions in its own unit (millimetres, degrees), an inertia, friction, and an outer force or torque that
may depend on the position in steps.  All torques are given as seen at the motor.

Source: mechanics; what a bench leaves out is listed in docs/bench.md.
"""

from __future__ import annotations

from bisect import bisect_right
from math import pi
from typing import NamedTuple, Protocol

from tmcm34x.world.motor import FINENESS, Motor

Zones = tuple[tuple[float, float], ...]
"""Pairs (from position, force or torque), by rising position; before the first, the first one's holds."""


class Load(Protocol):
    """What `LoadAxis` asks of a load; positions in its unit."""

    @property
    def start(self) -> float:
        """Position at the first power-on."""
        ...

    @property
    def low(self) -> float | None:
        """Lower hard stop."""
        ...

    @property
    def high(self) -> float | None:
        """Upper hard stop."""
        ...

    @property
    def zones(self) -> Zones:
        """Outer force or torque by position."""
        ...

    @property
    def circular(self) -> bool:
        """Whether positions repeat after a turn."""
        ...

    def units_per_position(self, motor: Motor) -> float:
        """Rotor units in one unit of position."""
        ...

    @property
    def inertia_kgm2(self) -> float:
        """Inertia seen at the motor."""
        ...

    @property
    def friction_nm(self) -> float:
        """Torque against the motion, at the motor."""
        ...

    def torque_nm(self, value: float) -> float:
        """A force or torque of `zones` at the motor; positive pushes toward lower positions."""
        ...


class Carriage(NamedTuple):
    """A carriage on a screw or belt; positions in millimetres, forces in newtons.

    lead_mm: way of one motor turn
    mass_kg: moved mass
    friction_n: force against the motion
    low, high: hard stops, where the axis has any
    start: position at the first power-on
    zones: (from position, force); a positive force pushes toward lower positions
    """

    lead_mm: float = 5.0
    mass_kg: float = 0.5
    friction_n: float = 1.0
    low: float | None = None
    high: float | None = None
    start: float = 0.0
    zones: Zones = ()

    @property
    def circular(self) -> bool:
        """A carriage has ends."""
        return False

    def units_per_position(self, motor: Motor) -> float:
        """Rotor units in a millimetre."""
        return FINENESS * motor.steps_per_turn / self.lead_mm

    @property
    def inertia_kgm2(self) -> float:
        """The mass seen through the screw."""
        return self.mass_kg * self.torque_nm(1.0) ** 2

    @property
    def friction_nm(self) -> float:
        """The friction seen through the screw."""
        return self.torque_nm(self.friction_n)

    def torque_nm(self, value: float) -> float:
        """A force [N] seen through the screw."""
        return value * self.lead_mm / 2000 / pi


class Turntable(NamedTuple):
    """A table that turns endlessly; positions in degrees of the table, torques in newton metres at the table.

    ratio: motor turns in one turn of the table
    table_inertia_kgm2: of the table, at the table
    table_friction_nm: torque against the motion, at the table
    start: position at the first power-on
    zones: (from degrees 0..360, torque); a positive torque pushes toward lower positions
    """

    ratio: float = 1.0
    table_inertia_kgm2: float = 2e-5
    table_friction_nm: float = 0.01
    start: float = 0.0
    zones: Zones = ()

    @property
    def low(self) -> None:
        """A table has no ends."""
        return

    @property
    def high(self) -> None:
        """A table has no ends."""
        return

    @property
    def circular(self) -> bool:
        """Positions repeat after 360 degrees."""
        return True

    def units_per_position(self, motor: Motor) -> float:
        """Rotor units in a degree of the table."""
        return FINENESS * motor.steps_per_turn * self.ratio / 360

    @property
    def inertia_kgm2(self) -> float:
        """The table's inertia seen through the gear."""
        return self.table_inertia_kgm2 / self.ratio**2

    @property
    def friction_nm(self) -> float:
        """The table's friction seen through the gear."""
        return self.torque_nm(self.table_friction_nm)

    def torque_nm(self, value: float) -> float:
        """A torque at the table seen through the gear."""
        return value / self.ratio


class ZoneMap:
    """The outer torque of a load over rotor positions, in steps."""

    def __init__(self, load: Load, units: float, turn: int | None) -> None:
        self._turn = turn
        self._edges = [round(start * units) for start, _ in load.zones]
        self._torques = [load.torque_nm(value) for _, value in load.zones]

    def _index(self, rotor: int) -> int:
        place = rotor % self._turn if self._turn else rotor
        index = bisect_right(self._edges, place) - 1
        return index if index >= 0 or self._turn else 0

    def torque(self, rotor: int) -> float:
        """Torque [Nm at the motor] at a rotor position; positive pushes toward lower positions."""
        return self._torques[self._index(rotor)] if self._torques else 0.0

    def room(self, rotor: int) -> tuple[int | None, int | None]:
        """The lowest and highest rotor position around `rotor` with the same torque; None for no end."""
        edges, turn = self._edges, self._turn
        if len(edges) < 2:
            return None, None
        base = rotor // turn * turn if turn else 0
        after = bisect_right(edges, rotor - base)
        low = edges[after - 1] if after else None
        high = edges[after] - 1 if after < len(edges) else None
        if turn:
            low = edges[-1] - turn if low is None else low
            high = edges[0] + turn - 1 if high is None else high
            return base + low, base + high
        if after <= 1:
            low = None
            high = edges[1] - 1
        return low, high
