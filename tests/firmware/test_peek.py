"""Looking at a module leaves no trace in it."""

import pytest

from firmware.hosts import Host
from tmcm34x.bench import build
from tmcm34x.bench.description import parse
from tmcm34x.clock import MS, run_until
from tmcm34x.firmware.peek import AXIS_READERS, GLOBAL_READERS
from tmcm34x.tmcl.axis_parameters import AXIS_PARAMETERS
from tmcm34x.tmcl.commands import COORDINATES, MOTORS
from tmcm34x.tmcl.global_parameters import GLOBAL_PARAMETERS
from tmcm34x.tmcl.mnemonic import parse_instruction

BENCH = """
[[module]]
model = {model}
spi.SPI_SEL0 = {{ kind = "tmcm323" }}
spi.SPI_SEL1 = {{ kind = "shift_register" }}
[[module.axis]]
load = {{ kind = "carriage", lead_mm = 5, mass_kg = 1, friction_n = 30, start = 20 }}
encoder = {{ lines = 500 }}
switch = {{ left = {{ position = 0 }}, right = {{ position = 40 }} }}
[[module.axis]]
[[module.axis]]
"""

PROGRAM = """
SGP 1, 2, 0
MVP ABS, 0, -3000
GAP 206, 0
AGP 2, 2
GGP 133, 0
AGP 3, 2
GAP 209, 0
AGP 4, 2
GGP 0, 0
AGP 5, 2
WAIT TICKS, 0, 3
MVP ABS, 0, 5000
GAP 208, 0
AGP 6, 2
GGP 1, 0
AGP 7, 2
SAC 2, 1, 85
AGP 8, 2
WAIT TICKS, 0, 2
JA 1
"""

EVERY_READING = [
    *(f"GAP {number}, {motor}" for number in range(256) for motor in range(MOTORS + 1)),
    *(f"GGP {number}, {bank}" for number in range(256) for bank in range(4)),
    *(f"GCO {n}, {motor}" for n in range(COORDINATES + 1) for motor in (0, 1, 2, 3, 255)),
    *(f"GIO {port}, {bank}" for port in (*range(12), 255) for bank in range(4)),
    *(f"RFS STATUS, {motor}" for motor in range(MOTORS)),
]


def rig_of(model, text=BENCH):
    return build(parse(text.format(model=model)))


def started(model):
    rig = rig_of(model)
    module = rig.modules[0]
    module.eeprom.write_program([parse_instruction(line) for line in PROGRAM.strip().splitlines()])
    host = Host(module)
    for line in ("SGP 74, 0, 1", "ROR 1, 500", "MVP ABS, 0, 6000", "129 1, 0, 0"):
        host.do(line)
    return rig, host


def every_answer(host):
    return [host.ask(line) for line in EVERY_READING if not line.endswith("255")]


@pytest.mark.parametrize("model", [341, 342, 343])
def test_observers_leave_a_run_byte_for_byte_as_it_is_without_them(model):
    alone, host = started(model)
    watched, watched_host = started(model)
    readings = [parse_instruction(line) for line in EVERY_READING]
    for step in range(25):
        until = (step + 1) * 17 * MS
        run_until(alone, until)
        for when in (until - 9 * MS, until - 5 * MS - 17, until):
            run_until(watched, when)
            for _observer in range(2):
                for instruction in readings:
                    watched.modules[0].peek(instruction)
    modules = alone.modules[0], watched.modules[0]
    assert modules[0].program.variables == modules[1].program.variables
    assert any(modules[0].program.variables[2:])
    assert every_answer(host) == every_answer(watched_host)
    assert alone.worlds[0].view() == watched.worlds[0].view()


@pytest.mark.parametrize("model", [341, 342, 343])
def test_what_is_seen_is_what_a_command_would_be_answered_with(model):
    rig, host = started(model)
    module = rig.modules[0]
    for step in range(12):
        run_until(rig, (step + 1) * 23 * MS)
        for line in EVERY_READING:
            instruction = parse_instruction(line)
            if line.startswith("GCO") and line.endswith("255"):
                assert module.peek(instruction) == (6, 0)
            elif line != "GGP 133, 0":
                seen = module.peek(instruction)
                reply = host.ask(line)
                assert seen == (reply.status, reply.value), line


def test_the_random_number_seen_is_the_one_drawn_last():
    _, host = started(343)
    drawn = host.do("GGP 133, 0")
    assert host.module.peek(parse_instruction("GGP 133, 0")) == (100, drawn)
    assert host.module.peek(parse_instruction("GGP 133, 0")) == (100, drawn)
    assert host.do("GGP 133, 0") != drawn


def test_an_encoder_that_is_another_device_cannot_be_seen_without_acting():
    rig, host = started(343)
    host.do("SGP 74, 0, 2")
    assert rig.modules[0].peek(parse_instruction("GAP 209, 0")) == (6, 0)
    host.do("SGP 74, 0, 3")
    assert rig.modules[0].peek(parse_instruction("GAP 209, 0")) == (100, 0)


def test_commands_that_act_cannot_be_peeked():
    _, host = started(343)
    for line in ("ROR 0, 5", "SAP 4, 0, 5", "GCO 0, 255", "RFS START, 0", "SAC 0, 1, 1", "131 0, 0, 0"):
        assert host.module.peek(parse_instruction(line)) == (6, 0)


def test_each_row_with_an_effect_of_reading_has_a_reader_without_one():
    assert {row.number for row in AXIS_PARAMETERS if row.effect} == set(AXIS_READERS)
    assert {row.number for row in GLOBAL_PARAMETERS if row.effect} == set(GLOBAL_READERS)


def test_without_an_encoder_the_position_of_one_is_zero():
    host = Host(build(parse("[[module]]")).modules[0])
    assert host.module.peek(parse_instruction("GAP 209, 0")) == (100, 0)
