"""A driver of one's own: moves, refusals, damaged replies."""

import pytest
from driver import NoReplyError, RefusedError


def test_a_move_ends_at_its_target(driver, tmcm343):
    driver.move_to(1, 51200)
    assert tmcm343.motor(1).position == 51200
    assert not tmcm343.motor(1).moving


def test_a_refusal_is_an_exception(driver, tmcm343):
    with pytest.raises(RefusedError, match="status 4"):
        driver.set_max_speed(0, 5000)
    assert tmcm343.motor(0).max_speed == 1000


@pytest.mark.parametrize("fault", ["bad_checksum", "garble", "drop", "silent", "stray", "duplicate"])
def test_a_damaged_reply_is_asked_for_again(driver, tmcm343, fault):
    tmcm343.fault(fault, count=2)
    assert driver.position(0) == 0
    driver.move_to(0, 1000)
    assert driver.position(0) == 1000


def test_a_dead_line_is_noticed(driver, tmcm343):
    tmcm343.fault("silent")
    with pytest.raises(NoReplyError):
        driver.position(0)


def test_a_power_failure_leaves_the_position_at_zero(driver, tmcm343):
    driver.move_to(0, 1000)
    tmcm343.power_cycle()
    assert driver.position(0) == 0
