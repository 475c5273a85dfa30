from __future__ import annotations

import pytest

from firmware.hosts import Host, switched_on
from tmcm34x.board.models import MODELS
from tmcm34x.clock import MS
from tmcm34x.firmware import drivers
from tmcm34x.tmcl.axis_parameters import AXIS_PARAMETERS
from tmcm34x.tmcl.global_parameters import GLOBAL_PARAMETERS
from tmcm34x.tmcl.mnemonic import parse_instruction

HARDWARE = {0, 1, 2, 3, 138, 209}
"""Parameters that the motor's motion changes, or that need more hardware."""
AXIS_ROWS = [row for row in AXIS_PARAMETERS if row.writable and row.number not in HARDWARE]
GLOBAL_ROWS = [
    row
    for row in GLOBAL_PARAMETERS
    if row.writable and row.bank == 0 and row.number not in {6, 73, 255, *range(7, 39)}
]


STORED_GLOBAL_ROWS = [row for row in GLOBAL_ROWS if row.stored and row.number != 64]


def execute(module, line):
    """Past the wire, whose address and pause are parameters too."""
    return module.execute(parse_instruction(line))


def probes(row):
    middle = (row.low + row.high) // 2
    return sorted({row.low, row.low + 1, middle, row.high})


@pytest.mark.parametrize("row", AXIS_ROWS, ids=lambda row: row.key)
@pytest.mark.parametrize("model", MODELS)
def test_every_axis_parameter_reads_back_and_has_its_range(row, model):
    host = Host(switched_on(model))
    if model not in row.models:
        assert [host.status(f"{word} {row.number}, 0, 1") for word in ("SAP", "GAP", "STAP", "RSAP")] == [
            3
        ] * 4
        return
    for motor in range(3):
        for value in probes(row):
            assert host.do(f"SAP {row.number}, {motor}, {value}") == value
            assert host.do(f"GAP {row.number}, {motor}") == value
        for value in (row.low - 1, row.high + 1):
            if -(2**31) <= value < 2**31:
                assert host.status(f"SAP {row.number}, {motor}, {value}") == 4
        assert host.do(f"GAP {row.number}, {motor}") == row.high


@pytest.mark.parametrize("row", [row for row in AXIS_PARAMETERS if row.stored], ids=lambda row: row.key)
def test_every_storable_axis_parameter_survives_power_and_can_be_restored(row):
    module = switched_on()
    host = Host(module)
    value = row.high if row.high != row.default else row.low
    host.do(f"SAP {row.number}, 1, {value}")
    host.do(f"STAP {row.number}, 1")
    host.do(f"SAP {row.number}, 1, {row.low}")
    host.do(f"RSAP {row.number}, 1")
    assert host.do(f"GAP {row.number}, 1") == value
    module.reset()
    assert [host.do(f"GAP {row.number}, {motor}") for motor in range(3)] == [row.default, value, row.default]


@pytest.mark.parametrize("row", GLOBAL_ROWS, ids=lambda row: row.key)
def test_every_global_parameter_reads_back_and_has_its_range(row):
    module = switched_on()
    for value in probes(row):
        assert execute(module, f"SGP {row.number}, 0, {value}") == (100, value)
        assert execute(module, f"GGP {row.number}, 0") == (100, value)
    for value in (row.low - 1, row.high + 1):
        if -(2**31) <= value < 2**31:
            assert execute(module, f"SGP {row.number}, 0, {value}") == (4, value)
    assert execute(module, f"GGP {row.number}, 0") == (100, row.high)


@pytest.mark.parametrize("row", STORED_GLOBAL_ROWS, ids=lambda row: row.key)
def test_every_stored_global_parameter_survives_power(row):
    module = switched_on()
    execute(module, f"SGP {row.number}, 0, {row.high}")
    module.reset()
    assert execute(module, f"GGP {row.number}, 0") == (100, row.high)


def test_user_variables_are_stored_only_on_demand():
    module = switched_on()
    host = Host(module)
    for n in range(56):
        host.do(f"SGP {n}, 2, {n - 2**31}")
    host.do("STGP 55, 2")
    module.reset()
    assert [host.do(f"GGP {n}, 2") for n in (0, 54, 55)] == [0, 0, 55 - 2**31]
    host.do("SGP 55, 2, 1")
    host.do("RSGP 55, 2")
    assert host.do("GGP 55, 2") == 55 - 2**31


def test_the_lock_flag_reads_1_while_locked():
    host = Host(switched_on())
    assert host.do("GGP 73, 0") == 0
    host.do("SGP 73, 0, 1234")
    assert host.do("GGP 73, 0") == 1
    assert host.status("SGP 73, 0, 4322") == 4
    host.do("SGP 73, 0, 4321")
    assert host.do("GGP 73, 0") == 0


def test_giving_up_the_protection_against_reading_erases_the_program():
    module = switched_on()
    host = Host(module)
    for before, after, erased in ((1, 0, True), (3, 2, True), (3, 1, False), (2, 0, False), (1, 3, False)):
        host.do("SGP 81, 0, 0")
        for line in ("132 0, 0, 0", "133 0, 0, 0"):
            host.do(line)
        module.eeprom.write_instruction(0, (28, 0, 0, 0))
        host.do(f"SGP 81, 0, {before}")
        host.do(f"SGP 81, 0, {after}")
        assert (module.eeprom.read_instruction(0).number == 0) is erased, (before, after)


# Parameters 0..38


@pytest.mark.parametrize("model", MODELS)
def test_chain_and_microstep_table_can_be_changed_stored_and_restored(model):
    module = switched_on(model)
    host = Host(module)
    for first, last in ((7, 22), (23, 38)):
        fresh = [host.do(f"GGP {number}, 0") for number in range(first, last + 1)]
        host.do(f"SGP {last}, 0, $3f2a1500")
        host.do(f"SGP {first}, 0, $01020304")
        changed = [host.do(f"GGP {number}, 0") for number in range(first, last + 1)]
        assert changed == [0x01020304, *fresh[1:-1], 0x3F2A1500]
        host.do(f"STGP {first}, 0")
        host.do(f"SGP {first}, 0, 0")
        host.do(f"RSGP {first}, 0")
        assert [host.do(f"GGP {number}, 0") for number in range(first, last + 1)] == changed
        module.reset()
        assert [host.do(f"GGP {number}, 0") for number in range(first, last + 1)] == changed


def test_cells_keep_six_bits_lowest_cell_in_the_lowest_byte():
    module = switched_on()
    host = Host(module)
    host.do("SGP 23, 0, -1")
    assert host.do("GGP 23, 0") == 0x3F3F3F3F
    host.do("SGP 24, 0, $04030201")
    assert drivers.read_cells(module.board, 68, 4) == bytes((1, 2, 3, 4))


def test_storing_other_parameters_of_bank_0_does_nothing():
    module = switched_on()
    host = Host(module)
    revision = module.eeprom.revision
    for number in (0, 8, 22, 24, 64, 66, 128, 255):
        host.do(f"STGP {number}, 0")
        host.do(f"RSGP {number}, 0")
    assert module.eeprom.revision == revision


@pytest.mark.parametrize("model", MODELS)
def test_all_switches_are_in_parameter_5_in_the_same_order_on_every_model(model):
    module = switched_on(model)
    host = Host(module)
    for motor in range(3):
        for side, bit in (("right", 0), ("left", 1)):
            module.board.set_switch(motor, side, True)
            assert host.do("GGP 5, 0") == 1 << 2 * motor + bit
            module.board.set_switch(motor, side, False)


@pytest.mark.parametrize("model", MODELS)
def test_smgp_reads_as_the_firmware_set_it_and_takes_24_bits(model):
    module = switched_on(model)
    host = Host(module)
    assert host.do("GGP 6, 0") == MODELS[model].smgp
    host.do("SGP 6, 0, $010f02")
    assert host.do("GGP 6, 0") == 0x010F02
    assert host.status("SGP 6, 0, $1000000") == 4


def test_a_cover_datagram_keeps_its_place_and_is_sent_once():
    module = switched_on()
    host = Host(module)
    for line in ("SGP 2, 0, 5", "SGP 3, 0, 12", "SGP 4, 0, $abc"):
        host.do(line)
    assert [host.do(f"GGP {n}, 0") for n in (2, 3, 4)] == [5, 12, 0xABC]
    assert module.board.chips[0].driver_datagram()[0] >> 36 - 5 - 12 & 0xFFF == 0xABC
    host.wait_ms(1)
    assert module.board.chips[0].driver_datagram()[0] >> 36 - 5 - 12 & 0xFFF != 0xABC


def test_datagram_words_show_what_the_drivers_sent():
    module = switched_on()
    host = Host(module)
    host.do("GGP 0, 0")
    host.wait_ms(1000)
    assert [host.do(f"GGP {n}, 0") for n in (0, 1)] == [0xF00F00, 0xF00]


def test_the_encoder_position_needs_an_encoder_module():
    host = Host(switched_on())
    assert host.do("GAP 209, 0") == 0
    assert host.status("SAP 209, 0, 5") == 6


def test_a_tick_is_a_millisecond_of_module_time():
    module = switched_on()
    host = Host(module)
    host.wait_ms(0.999)
    assert host.do("GGP 132, 0") == 0
    module.advance(MS)
    assert host.do("GGP 132, 0") == 1
