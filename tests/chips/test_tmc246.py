"""TMC246: the word, the flags, the load value."""

import pytest

from tmcm34x.chips.tmc246 import AT_REST, FAULTS, PARTS, Flag, MotorCondition, Tmc246, load_reading

FULL = 0b0_1111_0_0_1111_0
ONLY_A = 0b0_1111_0_0_0000_0


def driver(part="TMC246", condition=AT_REST):
    chip = Tmc246(part)
    chip.condition = lambda: condition
    chip.transfer(FULL)
    return chip


def test_after_power_on_the_coils_are_off_and_nothing_is_wrong():
    chip = Tmc246()
    assert chip.standby
    assert chip.status() == 0b000_1_0000_0000


def test_current_codes_are_bits_10_to_7_and_4_to_1():
    chip = Tmc246()
    chip.transfer(0b1_1010_1_0_0101_0)
    assert chip.current_codes == (10, 5)
    assert chip.mixed_decay


@pytest.mark.parametrize("part", PARTS)
def test_only_parts_with_load_measurement_answer_a_load_value(part):
    status = driver(part, MotorCondition(1.0, 0.0)).transfer(FULL)
    assert status >> 9 == (7 if PARTS[part].load_measurement else 0)


def test_the_load_value_falls_with_load_and_rises_with_speed():
    by_load = [load_reading(MotorCondition(1.0, load / 10)) for load in range(11)]
    assert by_load == sorted(by_load, reverse=True)
    assert (by_load[0], by_load[-1]) == (7, 0)
    by_speed = [load_reading(MotorCondition(speed / 10, 0.0)) for speed in range(15)]
    assert by_speed == sorted(by_speed)
    assert (by_speed[0], by_speed[-1]) == (0, 7)


def test_mixed_decay_lowers_the_load_value():
    chip = driver(condition=MotorCondition(1.0, 0.0))
    assert chip.transfer(FULL | 1 << 11) >> 9 == 5


def test_the_load_value_of_a_motor_at_rest_is_the_last_one():
    chip = driver(condition=MotorCondition(1.0, 0.0))
    chip.condition = lambda: AT_REST
    assert chip.transfer(FULL) >> 9 == 7


@pytest.mark.parametrize("row", FAULTS.values(), ids=lambda row: row.name)
def test_a_fault_raises_its_flags_while_current_flows_and_ends(row):
    chip = driver()
    chip.set_fault(row.name, True)
    assert chip.flags == row.raises
    assert chip.driving == (not row.stops)
    assert chip.status() & 0xFF == row.raises
    chip.set_fault(row.name, False)
    assert bool(chip.flags) == row.latched
    chip.enabled = False
    chip.enabled = True
    assert not chip.flags
    assert chip.driving


def test_open_load_is_masked_while_its_coil_has_no_current():
    chip = driver()
    chip.set_fault("open_load_b", True)
    assert chip.flags == Flag.OLB
    chip.transfer(ONLY_A)
    assert not chip.flags


def test_an_overcurrent_flag_stays_until_both_codes_are_zero():
    chip = driver()
    chip.set_fault("short_a", True)
    chip.transfer(FULL)
    chip.set_fault("short_a", False)
    assert Flag.OCA in chip.flags
    chip.transfer(0)
    chip.transfer(FULL)
    assert not chip.flags


def test_switched_off_outputs_show_no_error():
    chip = driver()
    chip.set_fault("over_temperature", True)
    assert chip.enabled
    chip.enabled = False
    assert not chip.enabled
    assert not chip.flags
    assert not chip.driving
