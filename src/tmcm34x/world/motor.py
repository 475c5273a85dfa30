"""Two-phase stepper motors: torque, speed, pull-out.

The torque at rest grows with the current up to the rated one; above the corner speed it falls with the inverse of
the speed, as it does under a chopper at constant supply voltage.  Leaves out: resonances, the shape of the torque
over the load angle, heating.

Source: the usual textbook curve; numbers of the default are those of a 42 mm motor (fidelity WORLD-3).
"""

from __future__ import annotations

from math import inf, pi
from typing import Final, NamedTuple

FINENESS: Final = 64
"""Rotor units in a full step."""
CYCLE: Final = 4 * FINENESS
"""Rotor units in an electrical cycle: a rotor that slips lands on a multiple of it."""


class Motor(NamedTuple):
    """The data sheet of a motor.

    steps_per_turn: full steps of a turn
    rated_current_ma: coil current (RMS) that gives the holding torque
    holding_torque_nm: torque at rest with rated current
    detent_torque_nm: torque that holds the rotor without current
    inertia_kgm2: of the rotor
    corner_speed: full steps per second above which the torque falls
    start_speed: greatest speed, in full steps per second, at which a rotor left behind catches on again
    load_speed: full steps per second at which the load measurement of a free motor gives its greatest value
    """

    steps_per_turn: int = 200
    rated_current_ma: float = 1000.0
    holding_torque_nm: float = 0.4
    detent_torque_nm: float = 0.015
    inertia_kgm2: float = 5.4e-6
    corner_speed: float = 1000.0
    start_speed: float = 200.0
    load_speed: float = 200.0

    def holding_torque(self, current_ma: float) -> float:
        """Torque at rest [Nm] with a coil current [mA, RMS]; more than the rated current gives no more."""
        return self.holding_torque_nm * min(1.0, current_ma / self.rated_current_ma)

    def torque(self, current_ma: float, speed: float) -> float:
        """Torque before pull-out [Nm] at a speed [full steps per second]."""
        torque = self.holding_torque(current_ma)
        return torque if speed <= self.corner_speed else torque * self.corner_speed / speed

    def pull_out_speed(self, current_ma: float, torque: float) -> float:
        """The greatest speed [full steps per second] at which the motor gives a torque [Nm]."""
        most = self.holding_torque(current_ma)
        if torque > most:
            return 0.0
        return self.corner_speed * most / torque if torque > 0 else inf

    def angle_rad(self, rotor: float) -> float:
        """Rotor units as an angle."""
        return rotor * 2 * pi / (FINENESS * self.steps_per_turn)

    def units_per_turn(self) -> int:
        """Rotor units in a turn."""
        return FINENESS * self.steps_per_turn
