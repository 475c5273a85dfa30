"""Homing on a bench, with its switch, and with the cable of the switch broken or the switch missing."""

import pytest

pytestmark = pytest.mark.tmcm34x_bench("linear-stage.toml")


def test_homing_ends_at_the_left_switch(driver, tmcm343):
    driver.home(0, timeout=60)
    assert tmcm343.motor(0).position == 0
    assert tmcm343.motor(0).load_position == pytest.approx(0, abs=0.1)


def test_homing_without_a_switch_gives_up_and_stops(driver, tmcm343):
    tmcm343.act("switch", 0, "left", False)  # the switch never closes
    with pytest.raises(TimeoutError):
        driver.home(0, timeout=60)
    tmcm343.run(2)
    assert not tmcm343.motor(0).moving
    assert tmcm343.motor(0).lost_steps > 0, "it ran against the hard stop"


def test_homing_with_a_broken_cable_gives_up_and_stops(driver, tmcm343):
    """The contacts are normally closed: an open line is active, so the search leaves the switch for ever."""
    tmcm343.unplug("left", 0)
    with pytest.raises(TimeoutError):
        driver.home(0, timeout=60)
    tmcm343.run(2)
    assert not tmcm343.motor(0).moving
    assert tmcm343.motor(0).load_position > 100, "it went away from the switch"
