"""TMC423: prescaler arithmetic, null channel functions, datagrams."""

from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tmcm34x.chips import tmc423
from tmcm34x.chips.tmc423 import (
    CLEAR_FLAGS,
    CLEAR_ON_NULL,
    COMMON_HOLD,
    CONFIGURATION,
    CONFIGURATION_ALL,
    CONTROL,
    EVERY_NULL,
    HOLD_ON_NULL,
    NULL_ACTIVE_HIGH,
    NULL_CHANNELS,
    POSITION,
    REVERSE,
    Tmc423,
    configuration,
    datagram,
)
from tmcm34x.clock import pack, unpack

ONE = 0x010 << 12

# From the data sheet's table 6: lines, microsteps a turn, code.
TABLE_6 = [
    (1024, 12800, 0x032), (1024, 6400, 0x019), (1000, 12800, 0x831), (1000, 6400, 0x813), (512, 12800, 0x064),
    (500, 12800, 0x862), (256, 12800, 0x0C8), (250, 12800, 0x8C4), (200, 12800, 0x100), (200, 800, 0x010),
    (125, 12800, 0x993), (50, 12800, 0x400), (50, 400, 0x020),
]  # fmt: skip


class Disc:
    def __init__(self, edges_per_turn=4000, null_level=1):
        self.edges_per_turn = edges_per_turn
        self.null_level = null_level
        self.place = 0

    def edges(self):
        return self.place


def chip(word=ONE, disc=None):
    disc = disc or Disc()
    chip = Tmc423((disc, None, None))
    chip.exchange(datagram(CONFIGURATION[0], word, write=True), 4)
    return chip, disc


def position(chip, encoder=0):
    value = chip.exchange(datagram(POSITION[encoder]), 4) & 0xFF_FFFF
    return value - (1 << 24) if value & 0x80_0000 else value


def test_the_prescaler_is_one_at_power_on():
    disc = Disc()
    chip = Tmc423((None, disc, None))
    disc.place = 123
    assert position(chip, 1) == 123
    assert position(chip, 0) == 0


@pytest.mark.parametrize(("lines", "microsteps", "code"), TABLE_6)
def test_a_turn_of_the_data_sheets_examples_gives_its_microsteps(lines, microsteps, code):
    unit, disc = chip(code << 12)
    disc.place = 4 * lines
    assert position(unit) == microsteps
    disc.place = -4 * lines
    assert position(unit) == -microsteps


@given(st.integers(0, 0xFFF), st.lists(st.integers(-5000, 5000), max_size=8))
@settings(max_examples=60)
def test_the_fraction_is_kept_from_edge_to_edge(code, places):
    whole, fraction = (code >> 4) & 0x7F, code & 15
    factor = whole + Fraction(fraction, 5 if code & 0x800 else 16)
    unit, disc = chip(code << 12, Disc(null_level=None))
    for place in places:
        disc.place = place
        expected = int(place * factor // 1) & 0xFF_FFFF
        assert position(unit) & 0xFF_FFFF == expected


def test_parameter_210_is_the_configuration_without_its_reserved_bits():
    assert configuration(512) == ONE
    assert configuration(512 + 16) == ONE | NULL_ACTIVE_HIGH
    assert configuration(512 + 1) == ONE | REVERSE


def test_a_reversed_encoder_counts_down():
    unit, disc = chip(ONE | REVERSE)
    disc.place = 10
    assert position(unit) == -10


def test_a_preload_sets_the_counter():
    unit, disc = chip()
    unit.exchange(datagram(POSITION[0], -1000, write=True), 4)
    disc.place = 1
    assert position(unit) == -999


def test_clear_on_null_acts_once_unless_every_null_is_asked():
    unit, disc = chip(ONE | NULL_ACTIVE_HIGH | CLEAR_ON_NULL)
    assert position(unit) == 0
    disc.place = 10
    assert position(unit) == 10
    disc.place = 4010
    assert position(unit) == 4010

    unit, disc = chip(ONE | NULL_ACTIVE_HIGH | CLEAR_ON_NULL | EVERY_NULL)
    disc.place = 12010
    assert position(unit) == 10
    disc.place = 11990
    assert position(unit) == -10


def test_the_next_null_clears_the_counter_while_the_shaft_is_on_the_mark():
    disc = Disc()
    disc.place = 100
    unit, disc = chip(ONE | NULL_ACTIVE_HIGH | CLEAR_ON_NULL, disc)
    disc.place = 3999
    assert position(unit) == 3899
    disc.place = 4000
    assert position(unit) == 0
    disc.place = 3990
    assert position(unit) == -10
    disc.place = 4010
    assert position(unit) == 10


def test_a_null_polarity_the_wrong_way_round_is_active_all_the_time():
    unit, disc = chip(ONE | CLEAR_ON_NULL)
    disc.place = 77
    assert position(unit) == 0
    unit, disc = chip()
    disc.place = 50
    unit.exchange(datagram(CONFIGURATION[0], ONE | HOLD_ON_NULL, write=True), 4)
    disc.place = 60
    assert position(unit) == 50
    unit.exchange(datagram(CONFIGURATION[0], ONE, write=True), 4)
    assert position(unit) == 60


def test_a_null_mark_sets_a_flag_that_stays_until_it_is_cleared():
    disc = Disc()
    disc.place = 1
    unit, disc = chip(ONE | NULL_ACTIVE_HIGH, disc)
    unit.exchange(datagram(CONTROL, CLEAR_FLAGS, write=True), 4)
    assert unit.exchange(datagram(NULL_CHANNELS), 4) == 0
    disc.place = 4000
    assert unit.exchange(datagram(NULL_CHANNELS), 4) == 1 << 30 | 1 << 18
    disc.place = 4001
    assert unit.exchange(datagram(NULL_CHANNELS), 4) == 1 << 30
    unit.exchange(datagram(CONTROL, CLEAR_FLAGS, write=True), 4)
    assert unit.exchange(datagram(NULL_CHANNELS), 4) == 0


def test_common_hold_freezes_all_read_outs():
    discs = [Disc(), Disc(), Disc()]
    unit = Tmc423(discs)
    unit.exchange(datagram(CONFIGURATION_ALL, ONE, write=True), 4)
    for n, disc in enumerate(discs):
        disc.place = 10 + n
    unit.exchange(datagram(CONTROL, COMMON_HOLD, write=True), 4)
    for disc in discs:
        disc.place = 99
    assert [position(unit, n) for n in range(3)] == [10, 11, 12]
    unit.exchange(datagram(CONTROL, 0, write=True), 4)
    assert [position(unit, n) for n in range(3)] == [99, 99, 99]


@pytest.mark.parametrize("nbytes", [1, 2, 3])
def test_a_short_datagram_does_nothing(nbytes):
    unit, _ = chip()
    assert unit.exchange(0x09_0000_05 >> (8 * (4 - nbytes)), nbytes) == 0
    assert position(unit) == 0


def test_reset_forgets_position_and_configuration():
    unit, disc = chip(0x032 << 12)
    disc.place = 500
    assert position(unit)
    unit.reset()
    assert position(unit) == 0
    assert unit.counters[0].configuration == tmc423.DEFAULT_CONFIGURATION


def test_a_chip_that_was_saved_goes_on_like_the_original():
    first, disc = chip(ONE | NULL_ACTIVE_HIGH | CLEAR_ON_NULL)
    disc.place = 10
    assert position(first) == 10
    second, _ = chip(disc=disc)
    second.load(unpack(pack(first.save())))
    disc.place = 4010
    assert position(second) == position(first) == 4010
    assert second.save() == first.save()
