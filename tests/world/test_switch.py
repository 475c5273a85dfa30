"""Switches, lines, bouncing."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tmcm34x.clock import NEVER
from tmcm34x.world.switch import CLEAN, FAR, Contact, Switch, SwitchInput, noise

BOUNCY = Contact(bounce=16000)


def line_at(rotor, *switches, contact=CLEAN, seed=0):
    line = SwitchInput(switches, contact, seed)
    line.settle(rotor)
    return line


def test_a_limit_switch_is_pressed_from_its_place_on():
    left = Switch(-FAR, -100)
    assert not left.follow(-99)
    assert left.follow(-100)
    assert left.follow(-5000)
    assert left.room(-5000) == (-FAR, -100)
    left.follow(0)
    assert left.room(0) == (-99, FAR)


def test_a_switch_opens_late_by_its_hysteresis():
    right = Switch(100, FAR, hysteresis=5)
    assert not right.follow(99)
    assert right.follow(100)
    assert right.follow(95)
    assert right.room(95)[0] == 95
    assert not right.follow(94)
    assert not right.follow(99)


@given(st.integers(0, 359), st.integers(0, 40), st.integers(0, 9), st.booleans(), st.integers(-1500, 1500))
@settings(max_examples=100)
def test_nothing_changes_within_the_room_and_something_does_outside(start, width, late, pressed, rotor):
    def fresh():
        switch = Switch(start, start + width, late, turn=360)
        switch.pressed = pressed
        return switch

    state = fresh().follow(rotor)
    switch = fresh()
    switch.pressed = state
    low, high = switch.room(rotor)
    assert low <= rotor <= high
    for place in range(max(low, rotor - 400), min(high, rotor + 400) + 1):
        switch.pressed = state
        assert switch.follow(place) == state
    for place in (low - 1, high + 1):
        switch.pressed = state
        assert switch.follow(place) != state


def test_a_range_that_is_never_pressed_is_refused():
    with pytest.raises(ValueError, match="never pressed"):
        Switch(5, 4)


@pytest.mark.parametrize(("contact", "open_"), [(CLEAN, False), (Contact(normally_closed=False), True)])
def test_an_open_contact_is_active(contact, open_):
    line = line_at(0, Switch(10, FAR), contact=contact)
    assert line.active(0) == open_
    line.follow(1, 10)
    assert line.active(1) != open_


def test_switches_in_series_open_the_line_together():
    line = line_at(0, Switch(-FAR, -100), Switch(-50, -40))
    seen = []
    for rotor in (0, -40, -51, -100, -45, 0):
        line.follow(0, rotor)
        seen.append(line.active(0))
    assert seen == [False, True, False, True, True, False]


def test_a_line_without_switches_is_never_active_but_a_broken_cable_is():
    line = SwitchInput()
    assert not line.active(0)
    line.unplugged = True
    assert line.active(0)
    line.override = False
    assert not line.active(0)


def edges(line, until):
    """All changes of the level, as (clock, level)."""
    now, level, seen = 0, line.active(0), []
    while (when := line.next_event(now)) <= until:
        now = when
        if line.active(now) != level:
            level = not level
            seen.append((now, level))
    return seen


def test_a_bouncing_contact_ends_at_its_new_level_and_repeats_with_its_seed():
    runs = []
    for seed in (1, 1, 2):
        line = line_at(0, Switch(10, FAR), contact=BOUNCY, seed=seed)
        line.follow(0, 10)
        assert line.active(0)
        runs.append(edges(line, NEVER - 1))
        assert line.active(16001)
        assert line.next_event(16001) == NEVER
    assert runs[0] == runs[1] != runs[2]
    assert all(0 < when <= 16000 for when, _ in runs[0])
    assert runs[0]
    assert runs[0][-1][1]


def test_settling_does_not_bounce():
    line = line_at(500, Switch(10, FAR), contact=BOUNCY)
    assert line.active(0)
    assert line.next_event(0) == NEVER


def test_noise_depends_on_every_number():
    assert len({noise(a, b, c) for a in range(6) for b in range(6) for c in range(6)}) == 216
    assert noise(1, 2) == noise(1, 2)
