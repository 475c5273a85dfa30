"""The tables hold together: numbers, ranges, defaults and texts."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tmcm34x.tmcl import axis_parameters, commands, datagram, global_parameters, mnemonic
from tmcm34x.tmcl.axis_parameters import AXIS_PARAMETERS, LATER_AXIS_PARAMETERS
from tmcm34x.tmcl.commands import COMMANDS, CONTROL_FUNCTIONS
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.global_parameters import GLOBAL_PARAMETERS
from tmcm34x.tmcl.groups import AXIS_GROUPS, GLOBAL_GROUPS
from tmcm34x.tmcl.status import STATUS_TEXTS, Status

int32 = st.integers(-(2**31), 2**31 - 1)
byte = st.integers(0, 255)
instructions = st.builds(Instruction, byte, byte, byte, int32)


def test_command_numbers_and_mnemonics_are_unique_and_sorted():
    numbers = [row.number for row in (*COMMANDS, *CONTROL_FUNCTIONS)]
    assert len(set(numbers)) == len(numbers)
    assert len(commands.BY_MNEMONIC) == len(COMMANDS)
    assert not set(commands.SISTER_COMMANDS) & set(commands.BY_MNEMONIC)
    assert not set(commands.SISTER_COMMANDS.values()) & set(numbers)


def test_the_mnemonic_list_of_chapter_6_5_is_complete():
    listed = (
        "ROR ROL MST MVP SAP GAP STAP RSAP SGP GGP STGP RSGP RFS SIO GIO CALC COMP JC JA CSUB RSUB WAIT STOP "
        "SAC SCO GCO CCO CALCX AAP AGP ACO CLE UF0 UF1 UF2 UF3 UF4 UF5 UF6 UF7"
    )
    assert set(listed.split()) == set(commands.BY_MNEMONIC)
    assert [row.number for row in CONTROL_FUNCTIONS] == list(range(128, 140))


def test_the_ascii_list_of_chapter_6_6_3_is_complete():
    listed = "ROL ROR MST MVP SAP GAP STAP RSAP SGP GGP STGP RSGP RFS SIO GIO SAC SCO GCO CCO"
    assert {row.mnemonic for row in COMMANDS if "ascii" in row.where} == {
        *listed.split(),
        *(f"UF{n}" for n in range(8)),
    }


@pytest.mark.parametrize("row", AXIS_PARAMETERS + GLOBAL_PARAMETERS, ids=lambda row: row.key)
def test_a_parameter_row_is_sound(row):
    assert row.low <= row.default <= row.high
    assert set(row.access) <= set("RWE")
    assert row.readable
    assert row.meaning.endswith(".")
    assert row.key.isidentifier()
    assert all(row.low <= value <= row.high for value, _ in row.choices)


MISPRINTED = [
    (axis_parameters.BY_KEY["end_switch_distance"], 0, 8388607),
    (axis_parameters.BY_NUMBER[193], 1, 3),
    (axis_parameters.BY_NUMBER[203], -1, 2048),
    (axis_parameters.BY_NUMBER[204], 0, 65535),
    (axis_parameters.BY_NUMBER[205], 0, 7),
    (axis_parameters.BY_NUMBER[210], -(2**31), 2**31 - 1),
    (axis_parameters.BY_NUMBER[211], 0, 2048),
    (axis_parameters.BY_NUMBER[214], 1, 65535),
    (global_parameters.BY_NUMBER[0, 65], 0, 11),
    (global_parameters.BY_NUMBER[0, 69], 1, 8),
]


@pytest.mark.parametrize(("row", "low", "high"), MISPRINTED, ids=lambda item: getattr(item, "key", item))
def test_ranges_that_the_manual_misprints_or_leaves_out(row, low, high):
    assert (row.low, row.high) == (low, high)


def test_currents_are_parts_of_the_module_s_maximum():
    for key in ("max_current", "standby_current"):
        row = axis_parameters.BY_KEY[key]
        assert (row.low, row.high, row.unit) == (0, 255, "1/255 of the module's maximum")


def test_names_and_sections_are_not_the_misprinted_ones():
    rows = commands.BY_MNEMONIC
    assert {n: rows[f"UF{n}"].number for n in range(8)} == {n: 64 + n for n in range(8)}
    sections = {name: rows[name].section for name in ("STGP", "RSGP", "RFS", "SCO", "UF0", "UF7")}
    assert sections == {
        "STGP": "6.7.11", "RSGP": "6.7.12", "RFS": "6.7.13", "SCO": "6.7.25", "UF0": "6.7.33", "UF7": "6.7.33",
    }  # fmt: skip
    assert rows["SCO"].title == "set coordinate"
    motor = rows["WAIT"].operands[1]
    assert (motor.name, motor.low, motor.high) == ("motor", 0, 2)
    count = rows["SAC"].operands[1]
    assert (count.name, count.low, count.high) == ("bytes", 1, 4)
    assert [row.section for row in CONTROL_FUNCTIONS if row.number == 138] == ["6.7.34"]
    assert [global_parameters.BY_NUMBER[bank, 0].section for bank in (0, 2)] == ["8.1", "8.3"]


def test_storable_axis_parameters_are_those_of_section_6_7_7():
    stored = {4, 5, 6, 7, 12, 13, 130, 140, 149, 153, 154, 193, 194, 195, 203, 204, 205, 210, 211, 212, 214}
    assert {row.number for row in AXIS_PARAMETERS if row.stored} == stored


def test_what_would_make_a_module_mute_for_ever_is_not_stored():
    assert not global_parameters.BY_NUMBER[0, 255].stored


def test_readable_axis_parameters_are_those_of_section_6_7_6():
    listed = {
        *range(14), 130, 135, 138, 140, 149, 153, 154, 193, 194, 195, 196, *range(203, 207), *range(208, 215),
    }  # fmt: skip
    assert set(axis_parameters.BY_NUMBER) == listed


def test_bank_0_holds_the_numbers_of_section_8_1():
    listed = {
        *range(39), *range(64, 72), *range(73, 78), 80, 81, 83, 84, 85, 128, 129, 130, 132, 133, 255,
    }  # fmt: skip
    assert {number for bank, number in global_parameters.BY_NUMBER if bank == 0} == listed
    assert {number for bank, number in global_parameters.BY_NUMBER if bank == 2} == set(range(56))


def test_a_342_lacks_currents_and_loads():
    assert {row.number for row in AXIS_PARAMETERS if 342 not in row.models} == {
        6, 7, 203, 204, 205, 206, 208, 211, 214,
    }  # fmt: skip


def test_positions_have_24_bits_and_variables_32():
    for key in ("target_position", "actual_position"):
        row = axis_parameters.BY_KEY[key]
        assert (row.low, row.high) == (-8388608, 8388607)
    assert axis_parameters.BY_KEY["end_switch_distance"].high == 8388607
    variable = global_parameters.BY_KEY["user_variable_0"]
    assert (variable.low, variable.high) == (-2147483648, 2147483647)


def test_times_at_rest_count_ten_milliseconds():
    for number in (204, 214):
        assert axis_parameters.BY_NUMBER[number].unit == "10 ms"
    assert axis_parameters.BY_NUMBER[214].default * 10 == 2000


def test_rotation_takes_both_signs():
    for mnemonic_ in ("ROR", "ROL"):
        velocity = commands.BY_MNEMONIC[mnemonic_].operands[1]
        assert (velocity.low, velocity.high) == (-2047, 2047)


def test_conditions_and_flags_are_complete():
    def words(name):
        return [word for word, _ in commands.BY_MNEMONIC[name].operands[0].words]

    assert words("JC") == ["ZE", "NZ", "EQ", "NE", "GT", "GE", "LT", "LE", "ETO", "EAL", "EDV", "EPO", "ESD"]
    assert words("CLE") == ["ALL", "ETO", "EAL", "EDV", "EPO", "ESD"]
    assert words("CALC") == ["ADD", "SUB", "MUL", "DIV", "MOD", "AND", "OR", "XOR", "NOT", "LOAD"]
    assert words("CALCX") == [*words("CALC"), "SWAP"]


def test_a_surplus_number_fills_the_unused_field():
    assert mnemonic.parse_instruction("GAP 1, 2, 77") == Instruction(6, 1, 2, 77)
    assert mnemonic.parse_instruction("GIO 0, 2, 1") == Instruction(15, 0, 2, 1)
    assert mnemonic.parse_instruction("COMP 5, 6, 7") == Instruction(20, 6, 7, 5)


def test_factory_defaults_of_an_axis():
    defaults = {row.number: row.default for row in AXIS_PARAMETERS if row.stored}
    assert defaults == {
        4: 1000, 5: 1000, 6: 128, 7: 8, 12: 0, 13: 0, 130: 1, 140: 6, 149: 0, 153: 7, 154: 3, 193: 1, 194: 0,
        195: 0, 203: 2048, 204: 0, 205: 0, 210: 512, 211: 0, 212: 0, 214: 200,
    }  # fmt: skip


def test_every_status_has_a_text():
    assert set(STATUS_TEXTS) == set(Status)


@given(instructions)
def test_any_instruction_survives_text_and_back(instruction):
    assert mnemonic.parse_instruction(mnemonic.format_instruction(instruction)) == instruction


@given(byte, instructions)
def test_any_instruction_survives_a_telegram_and_back(address, instruction):
    assert datagram.unpack_request(datagram.pack_request(address, instruction)) == (address, instruction)
    assert datagram.unpack_record(datagram.pack_record(instruction)) == instruction


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("ROR 0", "needs 2 operands"),
        ("MVP ABS, 1, 2, 3", "too many operands"),
        ("FLY 1, 2", "unknown command FLY"),
        ("CALCVX ADD, 1", "another firmware"),
        ("SAP 4, 0, fast", "not a number: fast"),
        ("SAP 4, 300, 1", "0..255"),
        ("SAP 4, 0, 4294967296", "32 bits"),
        ("", "no command"),
    ],
)
def test_a_wrong_line_says_what_is_wrong(line, message):
    with pytest.raises(mnemonic.MnemonicError, match=message):
        mnemonic.parse_instruction(line)


@pytest.mark.parametrize(
    "line", ["SAP, 4, 0, 996", "sap 4 0 996", " SAP  4,0 ,$3E4", "SAP 4, 0, %1111100100"]
)
def test_blanks_commas_cases_and_bases_are_all_read(line):
    assert mnemonic.parse_instruction(line) == Instruction(5, 4, 0, 996)


def test_each_parameter_is_in_one_group():
    axis = sorted(number for _, numbers in AXIS_GROUPS for number in numbers)
    assert axis == sorted(row.number for row in (*AXIS_PARAMETERS, *LATER_AXIS_PARAMETERS))
    general = sorted(number for _, numbers in GLOBAL_GROUPS for number in numbers)
    assert general == [row.number for row in GLOBAL_PARAMETERS if row.bank == 0]


@pytest.mark.parametrize(
    ("row", "kind"),
    [
        (axis_parameters.BY_KEY["actual_position"], "position"),
        (axis_parameters.BY_KEY["max_speed"], "speed"),
        (axis_parameters.BY_KEY["max_acceleration"], "acceleration"),
        (axis_parameters.BY_KEY["max_current"], "current"),
        (axis_parameters.BY_KEY["power_down_delay"], "time"),
        (axis_parameters.BY_KEY["position_reached"], "flag"),
        (axis_parameters.BY_KEY["ramp_mode"], "choice"),
        (axis_parameters.BY_KEY["load_value"], "number"),
        (axis_parameters.BY_KEY["driver_error_flags"], "bits"),
        (global_parameters.BY_KEY["download_mode"], "flag"),
        (global_parameters.BY_KEY["baud_rate"], "choice"),
        (global_parameters.BY_KEY["telegram_pause"], "time"),
    ],
    ids=lambda value: getattr(value, "key", value),
)
def test_the_kind_of_a_value_follows_from_its_columns(row, kind):
    assert row.kind == kind
