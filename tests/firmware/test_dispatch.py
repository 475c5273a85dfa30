from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware.hosts import Host, module_state, switched_on
from tmcm34x.tmcl.commands import COMMANDS, CONTROL_FUNCTIONS, SISTER_COMMANDS
from tmcm34x.tmcl.datagram import Instruction

KNOWN = {row.number for row in (*COMMANDS, *CONTROL_FUNCTIONS)}


@pytest.mark.parametrize("number", sorted(set(range(256)) - KNOWN))
def test_an_unknown_command_is_status_2_and_echoes_its_value(number):
    assert switched_on().execute(Instruction(number, 1, 2, -3)) == (2, -3)


def test_commands_of_other_firmwares_are_unknown():
    assert not KNOWN & set(SISTER_COMMANDS.values())


@pytest.mark.parametrize(
    "line", ["COMP 5", "JC ZE, 0", "JA 0", "CSUB 0", "RSUB", "WAIT TICKS, 0, 1", "STOP", "CLE ALL"]
)
def test_a_command_for_programs_is_not_available_in_direct_mode(line):
    assert Host(switched_on()).status(line) == 6


@pytest.mark.parametrize(
    ("line", "status"),
    [
        ("ROR 3, 100", 4),
        ("ROL 255, 100", 4),
        ("ROR 0, 2048", 4),
        ("ROL 0, -2048", 4),
        ("MST 3", 4),
        ("MVP 3, 0, 0", 3),
        ("MVP ABS, 3, 0", 4),
        ("SAP 4, 3, 0", 4),
        ("SAP 99, 0, 0", 3),
        ("SAP 8, 0, 0", 3),
        ("SAP 4, 0, 2048", 4),
        ("SAP 4, 0, -1", 4),
        ("SAP 138, 0, 3", 4),
        ("GAP 99, 0", 3),
        ("GAP 1, 3", 4),
        ("STAP 1, 0", 3),
        ("STAP 138, 0", 3),
        ("STAP 4, 3", 4),
        ("RSAP 209, 0", 3),
        ("SGP 99, 0, 0", 3),
        ("SGP 133, 0, 0", 3),
        ("SGP 65, 0, 12", 4),
        ("SGP 66, 1, 0", 4),
        ("SGP 56, 2, 0", 3),
        ("SGP 0, 3, 0", 4),
        ("SGP 73, 0, 1", 4),
        ("GGP 131, 0", 3),
        ("GGP 0, 1", 4),
        ("GGP 56, 2", 3),
        ("STGP 56, 2", 3),
        ("STGP 39, 0", 3),
        ("STGP 0, 1", 4),
        ("RSGP 39, 0", 3),
        ("RFS 3, 0", 3),
        ("RFS START, 3", 4),
        ("SIO 8, 2, 0", 3),
        ("SIO 0, 2, 2", 4),
        ("SIO 255, 2, 256", 4),
        ("SIO 255, 2, -2", 4),
        ("SIO 0, 0, 1", 3),
        ("SIO 0, 3, 1", 4),
        ("GIO 8, 0", 3),
        ("GIO 10, 1", 3),
        ("GIO 255, 1", 3),
        ("GIO 10, 2", 3),
        ("GIO 0, 3", 4),
        ("CALC 10, 0", 3),
        ("CALCX 11", 3),
        ("SAC 1, 1, 0", 3),
        ("SAC 129, 1, 0", 3),
        ("SAC 4, 1, 0", 3),
        ("SAC 0, 0, 0", 4),
        ("SAC 0, 5, 0", 4),
        ("SCO 21, 0, 0", 3),
        ("SCO 0, 3, 0", 4),
        ("SCO 0, 0, 8388608", 4),
        ("GCO 21, 0", 3),
        ("GCO 0, 3", 4),
        ("CCO 21, 0", 3),
        ("CCO 0, 3", 4),
        ("CCO 0, 8", 4),
        ("ACO 21, 0", 3),
        ("ACO 0, 3", 4),
        ("AAP 99, 0", 3),
        ("AGP 99, 0", 3),
        ("129 2, 0, 0", 3),
        ("129 1, 0, 2048", 4),
        ("132 0, 0, 2048", 4),
        ("134 0, 0, 2048", 4),
        ("136 2, 0, 0", 3),
        ("UF0", 6),
    ],
)
def test_wrong_operands_are_refused_and_change_nothing(line, status):
    module = switched_on()
    host = Host(module)
    before = module_state(module)
    assert host.status(line) == status
    assert module_state(module) == before


@pytest.mark.parametrize(
    "line",
    [
        "GAP 99, 0, 55",
        "GAP 1, 7, 55",
        "GGP 99, 0, 55",
        "GIO 99, 0, 55",
        "GCO 99, 0, 55",
        "RFS STATUS, 3, 55",
        "SAC 0, 5, 55",
        "SAC 4, 1, 55",
    ],
)
def test_reading_what_is_not_there_gives_0(line):
    assert Host(switched_on()).ask(line).value == 0


@pytest.mark.parametrize(
    "line",
    [
        "ROR 1, 350", "ROL 1, -350", "MVP ABS, 1, 90000", "MVP REL, 0, -1000", "SAP 6, 1, 200", "SGP 66, 0, 1",
        "SIO 7, 2, 1", "SCO 1, 2, 1000", "RFS STOP, 1", "CALC MUL, -5000", "SAP 4, 0, 5000", "MST 0",
    ],
)  # fmt: skip
def test_a_command_that_reads_nothing_echoes_its_value(line):
    host = Host(switched_on())
    value = int(line.split(",")[-1]) if line[-1] != "0" or "," in line else 0
    expected = 0 if line in {"MST 0", "RFS STOP, 1"} else value
    assert host.ask(line).value == expected


# The accumulator in direct mode


def test_direct_mode_reads_leave_the_accumulator_alone():
    module = switched_on()
    host = Host(module)
    host.do("CALC LOAD, 77")
    for line in ("GAP 4, 0", "GGP 66, 0", "GIO 255, 0", "GCO 0, 0", "SAC 0, 1, 5", "RFS STATUS, 0"):
        host.do(line)
    assert module.program.accumulator == 77


def test_direct_mode_calculates_with_the_program_s_registers():
    host = Host(switched_on())
    for line in (
        "CALC LOAD, 1200",
        "CALCX LOAD",
        "CALC SUB, 200",
        "AAP 4, 1",
        "CALCX SWAP",
        "AGP 9, 2",
        "ACO 3, 0",
    ):
        host.do(line)
    assert [host.do(line) for line in ("GAP 4, 1", "GGP 9, 2", "GCO 3, 0")] == [1000, 1200, 1200]
    host.do("CALC LOAD, 2048")
    assert host.status("AAP 4, 1") == 4
    assert host.status("AGP 77, 0") == 4


# Coordinates


def test_coordinates_live_in_ram_and_are_copied_with_motor_255():
    module = switched_on()
    host = Host(module)
    for n in range(21):
        for motor in range(3):
            host.do(f"SCO {n}, {motor}, {1000 * motor - n}")
    host.do("SCO 7, 255, 0")
    assert [positions[6] for positions in module.eeprom.coordinates] == [-7, 993, 1993]
    assert module.eeprom.coordinates[1][7] == 0
    host.do("SCO 0, 255, 0")
    assert module.eeprom.coordinates[2] == [2000 - n for n in range(1, 21)]
    module.reset()
    assert host.do("GCO 20, 2") == 0
    host.do("GCO 20, 255")
    assert [host.do(f"GCO {n}, 2") for n in (19, 20)] == [0, 1980]
    host.do("GCO 0, 255")
    assert [host.do(f"GCO {n}, 2") for n in (0, 1, 20)] == [0, 1999, 1980]


def test_coordinates_live_in_the_eeprom_when_parameter_84_says_so():
    module = switched_on()
    host = Host(module)
    for line in ("SCO 3, 1, 5", "SGP 84, 0, 1", "SCO 3, 0, -12", "SCO 0, 0, 9"):
        host.do(line)
    assert host.do("GCO 3, 1") == 0
    module.reset()
    assert [host.do(f"GCO {n}, 0") for n in (3, 0)] == [-12, 0]
    host.do("MVP COORD, 0, 3")
    assert host.do("GAP 0, 0") == -12


def test_capturing_takes_one_motor_or_all():
    host = Host(switched_on())
    for motor in range(3):
        host.do(f"SAP 0, {motor}, {100 + motor}")
        host.do(f"SAP 1, {motor}, {100 + motor}")
    host.do("CCO 2, 1")
    assert [host.do(f"GCO 2, {motor}") for motor in range(3)] == [0, 101, 0]
    host.do("CCO 0, 7")
    assert [host.do(f"GCO 0, {motor}") for motor in range(3)] == [100, 101, 102]


def test_motion_commands_end_a_reference_search():
    module = switched_on()
    host = Host(module)
    for line in ("ROR 0, 5", "ROL 0, 5", "MST 0", "MVP ABS, 0, 5", "MVP COORD, $41, 0", "MVP COORD, $81, 0"):
        host.do("RFS START, 0")
        assert host.do("RFS STATUS, 0") != 0
        host.do(line)
        assert host.do("RFS STATUS, 0") == 0


# Program control


def test_commands_are_stored_while_downloading():
    module = switched_on()
    host = Host(module)
    host.do("132 0, 0, 5")
    assert [host.status(line) for line in ("ROR 0, 500", "GAP 1, 0", "99 1, 2, 3", "131 0, 0, 0")] == [
        101,
        101,
        101,
        6,
    ]
    host.do("133 0, 0, 0")
    assert [module.eeprom.read_instruction(5 + n).number for n in range(4)] == [1, 6, 99, 0]
    assert host.do("GAP 2, 0") == 0


def test_running_without_an_address_ignores_the_value():
    assert Host(switched_on()).status("129 0, 0, 99999") == 100


@settings(max_examples=300)
@given(
    st.integers(0, 255), st.integers(0, 255), st.integers(0, 255), st.integers(-(2**31), 2**31 - 1),
    st.sampled_from([341, 342, 343]),
)  # fmt: skip
def test_every_telegram_has_a_known_status_and_a_32_bit_value(number, type_, motor, value, model):
    status, answer = switched_on(model).execute(Instruction(number, type_, motor, value))
    assert status in {100, 2, 3, 4, 5, 6}
    assert -(2**31) <= answer < 2**31
