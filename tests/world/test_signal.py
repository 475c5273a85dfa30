"""Signal sources: levels, and the clocks of their digital edges."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tmcm34x.clock import NEVER
from tmcm34x.world.signal import MAX, THRESHOLD, Constant, Ramp, Sine, Square, Table, Wire

SOURCES = [
    Constant(700),
    Square(100, 30),
    Square(100, 30, delay=55),
    Ramp(128),
    Ramp(128, 1000, 100, delay=7),
    Sine(400),
    Sine(400, 300, 250, delay=13),
    Table((0, 10, 50), (0, MAX, 100)),
    Table((0, 60), (MAX, 0), period=80),
    Table((0, 40, 90), (0, MAX, 0), period=120, interpolated=True),
]


@pytest.mark.parametrize("source", SOURCES, ids=repr)
@given(now=st.integers(0, 900))
@settings(max_examples=40)
def test_no_digital_edge_comes_before_the_next_one_announced(source, now):
    edge = source.next_edge(now)
    assert edge > now
    before = source.level(now) >= THRESHOLD
    for clock in range(now, min(edge, now + 500)):
        assert (source.level(clock) >= THRESHOLD) == before
    assert 0 <= source.level(now) <= MAX


def test_a_square_wave_begins_high_after_its_delay():
    source = Square(10, 4, delay=20, high=900, low=30)
    assert [source.level(now) for now in (0, 19, 20, 23, 24, 29, 30)] == [30, 30, 900, 900, 30, 30, 900]


def test_a_ramp_rises_evenly_and_begins_again():
    source = Ramp(1000, 0, 1000)
    assert [source.level(now) for now in (0, 1, 500, 999, 1000)] == [0, 1, 500, 999, 0]


def test_a_sine_swings_around_its_middle():
    source = Sine(400, 500, 100)
    assert [source.level(now) for now in (0, 100, 200, 300)] == [500, 600, 500, 400]


def test_a_table_jumps_or_goes_straight():
    jumping = Table((0, 10, 20), (100, 100, 200))
    assert [jumping.level(now) for now in (0, 10, 15, 20, 99)] == [100, 100, 100, 200, 200]
    straight = Table((0, 10, 20), (100, 100, 200), interpolated=True)
    assert [straight.level(now) for now in (0, 10, 15, 20, 99)] == [100, 100, 150, 200, 200]
    assert straight.next_edge(20) == NEVER


def test_a_wire_reads_what_is_there():
    levels = [5]
    wire = Wire(lambda: levels[0])
    assert wire.level(0) == 5
    levels[0] = 900
    assert wire.level(0) == 900
    assert wire.next_edge(0) == NEVER
