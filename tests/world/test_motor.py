"""Torque and pull-out speed."""

from math import inf, pi

import pytest

from tmcm34x.world.motor import Motor

MOTOR = Motor(rated_current_ma=1000, holding_torque_nm=0.4, corner_speed=1000)


def test_torque_grows_with_current_up_to_the_rated_one():
    assert MOTOR.torque(500, 0) == pytest.approx(0.2)
    assert MOTOR.torque(1000, 0) == pytest.approx(0.4)
    assert MOTOR.torque(2000, 0) == pytest.approx(0.4)


def test_torque_falls_with_the_inverse_of_speed_above_the_corner():
    assert MOTOR.torque(1000, 1000) == pytest.approx(0.4)
    assert MOTOR.torque(1000, 2000) == pytest.approx(0.2)


def test_pull_out_speed_is_where_the_torque_is_just_enough():
    speed = MOTOR.pull_out_speed(800, 0.1)
    assert MOTOR.torque(800, speed) == pytest.approx(0.1)
    assert MOTOR.pull_out_speed(800, 0) == inf
    assert MOTOR.pull_out_speed(100, 0.1) == 0.0


def test_a_turn_has_64_units_for_each_full_step():
    assert MOTOR.units_per_turn() == 12800
    assert MOTOR.angle_rad(12800) == pytest.approx(2 * pi)
