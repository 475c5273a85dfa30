"""Carriages and tables seen at the motor."""

from math import pi

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tmcm34x.world.load import Carriage, Turntable, ZoneMap
from tmcm34x.world.motor import Motor

MOTOR = Motor()


def test_a_carriage_moves_its_lead_in_a_turn():
    carriage = Carriage(lead_mm=5)
    assert carriage.units_per_position(MOTOR) * 5 == MOTOR.units_per_turn()
    assert carriage.torque_nm(2 * pi * 1000 / 5) == pytest.approx(1.0)
    assert Carriage(mass_kg=2, lead_mm=2 * pi * 1000).inertia_kgm2 == pytest.approx(2.0)


def test_a_gear_divides_torque_and_the_square_of_it_inertia():
    table = Turntable(ratio=10, table_inertia_kgm2=1, table_friction_nm=1)
    assert table.friction_nm == pytest.approx(0.1)
    assert table.inertia_kgm2 == pytest.approx(0.01)
    assert table.units_per_position(MOTOR) * 360 == pytest.approx(10 * MOTOR.units_per_turn())


def test_zones_hold_from_their_position_on():
    load = Carriage(lead_mm=2 * pi * 1000, zones=((0, 1.0), (10, 2.0), (20, 0.5)))
    zones = ZoneMap(load, 100.0, None)
    assert [zones.torque(rotor) for rotor in (-5, 0, 999, 1000, 1999, 2000, 9999)] == pytest.approx(
        [1, 1, 1, 2, 2, 0.5, 0.5]
    )
    assert zones.room(500) == (None, 999)
    assert zones.room(-500) == (None, 999)
    assert zones.room(1000) == (1000, 1999)
    assert zones.room(2000) == (2000, None)


@given(st.integers(-5000, 5000), st.lists(st.integers(0, 359), min_size=2, max_size=5, unique=True))
@settings(max_examples=60)
def test_a_tables_zones_repeat_and_rooms_are_as_wide_as_they_can_be(rotor, starts):
    load = Turntable(zones=tuple((start, float(n)) for n, start in enumerate(sorted(starts))))
    zones = ZoneMap(load, 1.0, 360)
    low, high = zones.room(rotor)
    here = zones.torque(rotor)
    assert low <= rotor <= high
    assert all(zones.torque(place) == here for place in range(low, high + 1))
    assert zones.torque(low - 1) != here
    assert zones.torque(high + 1) != here
    assert zones.torque(rotor + 360) == here
