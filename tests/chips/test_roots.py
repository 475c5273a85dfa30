"""Braking velocities that are kept for the next move."""

from math import isqrt

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chips.harness import chip_with, path
from tmcm34x.chips.ramp import roots as kept
from tmcm34x.chips.ramp.law import FARTHEST
from tmcm34x.chips.ramp.roots import MOST, entries, roots

MOVE = {"v_min": 1, "v_max": 2047, "pulse_div": 3, "ramp_div": 7, "a_max": 900, "p_mul": 183, "p_div": 5}


@pytest.fixture(autouse=True)
def nothing_known():
    """No lists before and after."""
    kept._lists.clear()
    yield
    kept._lists.clear()


def moved(x_target):
    chip = chip_with(**MOVE, x_target=x_target)
    return path(chip), chip.save()


def test_a_move_fills_in_the_roots_of_the_distances_that_it_brakes_at():
    moved(50_000)
    (((factor, shift), known),) = kept._lists.items()
    filled = {distance: root for distance, root in enumerate(known) if root}
    assert len(filled) > 50
    assert filled == {distance: isqrt(factor * distance >> shift) << 8 for distance in filled}


def test_a_move_is_the_same_whatever_is_known():
    alone = moved(50_000)
    for x_target in (50_000, 49_731, 200_000, 50_000):
        again = moved(x_target)
    assert again == alone


def test_a_wrong_root_would_be_seen():
    """That the test above can fail."""
    alone = moved(50_000)
    (known,) = kept._lists.values()
    known[:] = [root and root + 256 for root in known]
    assert moved(50_000) != alone


def test_all_lists_together_are_bounded():
    for p_mul in range(128, 148):
        assert len(roots(p_mul, 3, FARTHEST)) == FARTHEST + 1
        assert entries() <= MOST
    assert list(kept._lists) == [(146, 3), (147, 3)]
    assert MOST == 2 * (FARTHEST + 1)


@given(st.lists(st.tuples(st.integers(128, 131), st.integers(0, FARTHEST)), max_size=30))
def test_a_list_is_as_long_as_asked_and_keeps_what_is_known(asked):
    for factor, farthest in asked:
        known = roots(factor, 3, farthest)
        assert len(known) > farthest
        known[farthest] = factor
        assert roots(factor, 3, farthest) is known
        assert roots(factor, 3, len(known) - 1)[farthest] == factor
        assert entries() <= MOST


def test_a_short_list_grows_in_place():
    short = roots(128, 3, 10)
    short[5] = 256
    assert roots(128, 3, 1000) is short
    assert (len(short), short[5]) == (1001, 256)
