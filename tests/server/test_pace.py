"""Virtual time against the wall's."""

import math

import pytest

from tmcm34x.clock import HZ, NEVER
from tmcm34x.server import Pace


class Wall:
    """A clock on the wall that goes when told."""

    def __init__(self):
        self.time_s = 1000.0

    def __call__(self):
        return self.time_s


@pytest.fixture
def wall():
    return Wall()


@pytest.mark.parametrize("speed", [0.01, 1, 10])
def test_virtual_time_goes_at_the_given_speed(wall, speed):
    pace = Pace(speed, wall)
    wall.time_s += 2.5
    assert pace.target() == pytest.approx(2.5 * speed * HZ, abs=1)


@pytest.mark.parametrize("speed", [0.01, 1, 10])
def test_a_clock_is_due_when_it_is_the_target(wall, speed):
    pace = Pace(speed, wall)
    wall.time_s = pace.due_s(3 * HZ)
    assert pace.target() == pytest.approx(3 * HZ, abs=10)


def test_nothing_holds_virtual_time_back_at_speed_0(wall):
    pace = Pace(0, wall)
    assert pace.target() == NEVER
    assert pace.due_s(3600 * HZ) <= wall()


def test_virtual_time_stands_still_in_a_pause_and_loses_nothing(wall):
    pace = Pace(1, wall)
    wall.time_s += 1
    pace.draw(pace.target(), paused=True)
    wall.time_s += 60
    assert pace.target() == HZ
    assert pace.due_s(2 * HZ) == math.inf
    pace.draw(pace.target(), paused=False)
    wall.time_s += 1
    assert pace.target() == 2 * HZ


def test_a_change_of_speed_begins_where_the_old_one_ends(wall):
    pace = Pace(1, wall)
    wall.time_s += 1
    pace.draw(pace.target(), speed=10)
    wall.time_s += 1
    assert pace.target() == 11 * HZ
    assert (pace.speed, pace.paused) == (10, False)
