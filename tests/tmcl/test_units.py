"""Conversions between TMCL's numbers and physical quantities."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tmcm34x.chips.ramp import brake_factor
from tmcm34x.tmcl import units
from tmcm34x.tmcl.units import Scale

DIVISORS = st.integers(0, 13)


def test_the_defaults_of_the_manual_in_physical_units():
    """Velocity 1000 with pulse divisor 3: 16 MHz * 1000 / (8 * 2048 * 32) = 30,517.6 microsteps/s."""
    scale = Scale()
    assert units.speed_hz(1000, 3) == pytest.approx(30517.578)
    assert scale.steps_s(1000) == pytest.approx(476.837)
    assert scale.rev_min(-1000) == pytest.approx(-143.051, abs=1e-3)
    assert units.acceleration_hz_s(1000, 3, 7) == pytest.approx(465661.287)
    assert scale.ramp_s(1000, 1000) == pytest.approx(0.065536)


@given(st.integers(-2047, 2047), DIVISORS, DIVISORS)
def test_both_ways_give_the_same_setting(setting, pulse, ramp):
    assert units.velocity_units(units.speed_hz(setting, pulse), pulse) == pytest.approx(setting)
    slope = units.acceleration_hz_s(setting, pulse, ramp)
    assert units.acceleration_units(slope, pulse, ramp) == pytest.approx(setting)
    scale = Scale(pulse, ramp, gear=2.5, pitch=4.0)
    assert scale.velocity_of_rev_min(scale.rev_min(setting)) == pytest.approx(setting)
    assert scale.velocity_of_steps_s(scale.steps_s(setting)) == pytest.approx(setting)
    assert scale.velocity_of_units_s(scale.units_s(setting)) == pytest.approx(setting)
    assert scale.acceleration_of_steps_s2(scale.steps_s2(setting)) == pytest.approx(setting)
    assert scale.microsteps(scale.units(setting)) == pytest.approx(setting)


def test_currents():
    assert units.current_ma(255, 1100) == 1100
    assert units.current_units(units.current_ma(77, 1100), 1100) == pytest.approx(77)


@given(st.integers(1, 2047), DIVISORS, DIVISORS)
def test_braking_is_exact_where_the_chip_has_its_factors(acceleration, pulse, ramp):
    mul, div = brake_factor(acceleration, ramp, pulse)
    wanted = 988 * acceleration / 1000 / (128 * 2.0 ** (ramp - pulse))
    near = 0.98 < mul / 2 ** (div + 3) / wanted <= 1.0001
    if units.brakes_exactly(acceleration, pulse, ramp):
        assert near
    else:
        assert not near or (mul, div) in {(128, 13), (255, 0)}


@given(st.floats(1, 2000), st.floats(0.01, 5), st.integers(0, 6), st.sampled_from([200, 400]))
def test_the_best_settings_reach_what_was_wanted(rev_min, ramp_s, resolution, fullsteps):
    scale = Scale(resolution=resolution, fullsteps_per_turn=fullsteps)
    best = units.best_settings(scale, rev_min, ramp_s)
    if best is None:
        fastest = scale._replace(pulse_divisor=0)
        slowest = scale._replace(pulse_divisor=13)
        assert (
            fastest.rev_min(2047) < rev_min
            or slowest.rev_min(1) > rev_min
            or scale._replace(pulse_divisor=0, ramp_divisor=0).ramp_s(1, 2047) > ramp_s / 2048
        )
        return
    assert 0 < best.velocity <= 2047
    assert 0 < best.acceleration <= 2047
    assert best.scale.rev_min(best.velocity) == pytest.approx(rev_min, abs=0.501 * best.scale.rev_min(1))
    assert best.scale.ramp_s(best.velocity, best.acceleration) == pytest.approx(
        ramp_s, rel=0.51 / best.acceleration + 0.01
    )
    assert best.velocity > 1023 or best.scale.pulse_divisor == 13


def test_speeds_that_no_divisor_reaches_have_no_settings():
    assert units.best_settings(Scale(), 100_000, 0.1) is None


def test_the_time_of_a_move():
    scale = Scale()
    speed, slope = units.speed_hz(1000, 3), units.acceleration_hz_s(1000, 3, 7)
    assert scale.move_s(0, 1000, 1000) == 0
    assert scale.move_s(100, 1000, 1000) == pytest.approx(2 * (100 / slope) ** 0.5)
    assert scale.move_s(-100_000, 1000, 1000) == pytest.approx(100_000 / speed + speed / slope)
    assert scale.move_s(100, 0, 5) == scale.ramp_s(3, 0) == float("inf")
