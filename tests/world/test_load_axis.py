"""Rotor and field: following, hard stops, step loss, switches."""

from math import inf

import pytest

from tmcm34x.world.load import Carriage, Turntable
from tmcm34x.world.load_axis import YIELD, Grip, LoadAxis, MotorField, whole_turn
from tmcm34x.world.motor import CYCLE, Motor
from tmcm34x.world.switch import FAR, Switch, SwitchInput

MOTOR = Motor()
ENDLESS = Carriage(mass_kg=0.0, friction_n=0.0)
CURRENT = 1000.0


def axis(load=ENDLESS, motor=MOTOR, **lines):
    axis = LoadAxis(motor, load, **lines)
    axis.power_on()
    go(axis, 0)
    return axis


def go(axis, angle, speed=0.0, acceleration=0.0, current_ma=CURRENT):
    axis.follow(0, MotorField(angle, speed, acceleration, current_ma))
    return axis.rotor


def test_a_rotor_follows_the_field_unit_by_unit():
    free = axis()
    assert [go(free, angle, 100.0) for angle in (1, 7, 1000, -3)] == [1, 7, 1000, -3]
    assert free.lost_fullsteps == 0
    assert free.grip is Grip.FOLLOWING


def test_the_first_power_on_does_not_move_a_load():
    placed = axis(Carriage(start=10.123))
    assert placed.position(placed.rotor) == pytest.approx(10.123, abs=5 / 12800)
    assert placed.lost_fullsteps == 0


def test_without_current_the_rotor_stays_and_snaps_to_the_nearest_cycle_later():
    free = axis()
    go(free, 1000)
    go(free, 1000, current_ma=0.0)
    assert free.grip is Grip.FREE
    assert go(free, 1000 + 3 * CYCLE + 20, current_ma=0.0) == 1000
    assert go(free, 1000 + 3 * CYCLE + 20) == 1020
    assert free.lost_fullsteps == -12


def test_a_hard_stop_holds_the_rotor_and_it_comes_back_out_of_step():
    stopped = axis(Carriage(lead_mm=5, mass_kg=0, friction_n=0, high=1.0))
    end = stopped.high
    assert end == 2560
    assert go(stopped, end + YIELD, 100.0) == end
    assert stopped.grip is Grip.FOLLOWING
    assert go(stopped, end + YIELD + 1, 100.0) == end
    assert stopped.grip is Grip.BLOCKED
    assert stopped.load_ratio() == 1.0
    assert stopped.room() == (-FAR, FAR)
    far = end + 10 * CYCLE + 30
    assert go(stopped, far, 100.0) == end
    assert go(stopped, far, -1.0) == end
    assert stopped.grip is Grip.FOLLOWING
    assert go(stopped, far - 100, -50.0) == end - 70
    assert stopped.lost_fullsteps == -40


def test_room_ends_where_a_hard_stop_makes_the_rotor_yield():
    stopped = axis(Carriage(lead_mm=5, low=-1.0, high=1.0))
    assert stopped.room() == (-2560 - YIELD, 2560 + YIELD)


def test_too_much_torque_leaves_the_rotor_behind_until_the_field_is_slow():
    heavy = axis(Carriage(mass_kg=0, friction_n=0, zones=((0, 0.0), (1, 400.0))))
    assert heavy.room()[1] == 2559
    assert go(heavy, 2559, 500.0) == 2559
    assert go(heavy, 2560, 500.0) == 2560
    assert heavy.grip is Grip.FOLLOWING
    weak = MOTOR._replace(holding_torque_nm=0.3)
    heavy = axis(Carriage(mass_kg=0, friction_n=0, zones=((0, 0.0), (1, 400.0))), weak)
    go(heavy, 2560, 500.0)
    assert heavy.grip is Grip.STALLED
    assert heavy.load_ratio() == 1.0
    assert heavy.rotor == 2559, "the force pushes it out of the zone"
    assert go(heavy, 9200, 201.0) == 2559
    go(heavy, 9200, 200.0)
    assert heavy.grip is Grip.FOLLOWING
    assert heavy.lost_fullsteps % 4 == 0
    assert heavy.lost_fullsteps < -90


def test_a_rotor_lets_go_when_the_speed_uses_the_torque_up():
    free = axis(Carriage(mass_kg=1.0, friction_n=10.0))
    go(free, 10, 100.0, 5000.0)
    critical = 100.0 + 5000.0 * free.delay_s()
    assert critical > MOTOR.corner_speed
    assert go(free, 20, critical * 0.999, 5000.0) == 20
    assert free.grip is Grip.FOLLOWING
    assert free.load_ratio() > 0.99
    go(free, 30, critical * 1.001, 5000.0)
    assert free.grip is Grip.STALLED


def test_reversing_counts_the_friction_of_the_way_back():
    free = axis(Carriage(mass_kg=1.0, friction_n=10.0))
    go(free, 10, 100.0, 5000.0)
    ahead = free.delay_s()
    go(free, 10, -100.0, 5000.0)
    assert free.delay_s() == pytest.approx(ahead + 200.0 / 5000.0)


def test_a_stalled_rotor_waits_for_the_start_speed_and_a_blocked_one_for_rest():
    stalled = axis(Carriage(friction_n=900.0))
    go(stalled, 10, 900.0)
    assert stalled.grip is Grip.STALLED
    assert stalled.delay_s() == inf
    go(stalled, 20, 900.0, -1000.0)
    assert stalled.delay_s() == pytest.approx((900.0 - MOTOR.start_speed) / 1000.0)
    go(stalled, 20, 900.0, 1000.0)
    assert stalled.delay_s() == inf
    blocked = axis(Carriage(high=0.0))
    go(blocked, 1000, 300.0, -1000.0)
    assert blocked.grip is Grip.BLOCKED
    assert blocked.delay_s() == pytest.approx(0.3)


def test_no_moment_is_awaited_at_constant_speed_or_without_current():
    free = axis()
    go(free, 10, 100.0)
    assert free.delay_s() == inf
    go(free, 10, 100.0, 10.0, current_ma=0.0)
    assert free.delay_s() == inf


def test_less_current_loses_steps_earlier():
    friction = Carriage(mass_kg=0, friction_n=100.0)
    strong, weak = axis(friction), axis(friction)
    go(strong, 100, 900.0)
    go(weak, 100, 900.0, current_ma=150.0)
    assert strong.grip is Grip.FOLLOWING
    assert weak.grip is Grip.STALLED


def test_a_hanging_load_falls_to_its_stop_without_current_but_not_against_friction():
    falling = axis(Carriage(lead_mm=5, low=-2.0, high=50.0, zones=((0, 50.0),)))
    go(falling, 1000)
    assert go(falling, 1000, current_ma=0.0) == falling.low
    held = axis(Carriage(lead_mm=5, low=-2.0, friction_n=60.0, zones=((0, 50.0),)))
    go(held, 1000)
    assert go(held, 1000, current_ma=0.0) == 1000


def test_friction_and_detent_torque_together_hold_a_load_without_current():
    """On a lead of 5 mm the detent torque of 15 mNm is 18.8 N."""
    for force, falls in ((78.0, False), (79.5, True)):
        hanging = axis(Carriage(lead_mm=5, low=-2.0, friction_n=60.0, zones=((0, force),)))
        assert (go(hanging, 0, current_ma=0.0) == hanging.low) is falls


def test_a_load_without_ends_or_a_table_does_not_fall():
    for load in (Carriage(zones=((0, -900.0),)), Turntable(zones=((0, 9.0),))):
        loose = axis(load)
        assert go(loose, 0, current_ma=0.0) == 0


def test_switches_close_at_their_place_and_bound_the_room():
    limited = axis(left=SwitchInput([Switch(-FAR, -100)]), right=SwitchInput([Switch(200, FAR)]))
    assert limited.room() == (-99, 199)
    go(limited, -100, -10.0)
    assert limited.left.active(0)
    assert limited.room()[1] == -100
    go(limited, 200, 10.0)
    assert limited.right.active(0)
    assert not limited.left.active(0)


def test_room_counts_in_field_angles():
    limited = axis(right=SwitchInput([Switch(200, FAR)]))
    limited.push_to(-CYCLE * limited.units / limited.units / limited.units)
    assert limited.rotor == -CYCLE
    assert limited.room()[1] == 199 + CYCLE
    assert limited.lost_fullsteps == -4


def test_a_table_wraps_and_its_turn_must_be_whole():
    table = axis(Turntable(ratio=3))
    go(table, 3 * 12800 + 3200, 10.0)
    assert table.position(table.rotor) == pytest.approx(30.0)
    with pytest.raises(ValueError, match="not a whole number"):
        whole_turn(MOTOR, Turntable(ratio=1.00001))


def test_power_on_starts_counting_losses_anew():
    again = axis()
    go(again, 1000)
    go(again, 1000, current_ma=0.0)
    again.power_on()
    assert go(again, 0) == 1024
    assert again.lost_fullsteps == 0


def test_a_hand_on_the_shaft_adds_to_the_load():
    pushed = axis()
    go(pushed, 100, 100.0)
    assert pushed.load_ratio() == 0.0
    pushed.push_nm = 0.2
    assert pushed.load_ratio() == pytest.approx(0.5)
    pushed.push_nm = 0.5
    go(pushed, 110, 100.0)
    go(pushed, 120, 300.0)
    assert pushed.grip is Grip.STALLED
