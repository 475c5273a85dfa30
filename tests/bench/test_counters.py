"""What has happened to modules, in figures."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tmcm34x.bench import simple_rig
from tmcm34x.bench.counters import Counters
from tmcm34x.clock import clocks, run_until
from tmcm34x.firmware.ports.can import CanPort
from tmcm34x.firmware.ports.serial import SerialPort
from tmcm34x.tmcl.datagram import pack_can_request, pack_request
from tmcm34x.tmcl.mnemonic import parse_instruction

COMMAND = str(Path(sys.executable).with_name("tmcm34x"))
PROGRAM = " SAP 4, 0, 9999\n SAP 4, 0, 0\n MVP ABS, 0, 1000\n SGP 68, 0, 1\n STOP\n"


@pytest.fixture
def rig():
    return simple_rig(343)


def do(rig, *commands):
    return [rig.modules[0].execute(parse_instruction(command))[0] for command in commands]


def counted(counters):
    return counters.modules[0].figures()


def test_a_target_position_in_velocity_mode_moves_nothing(rig):
    counters = Counters(rig)
    assert do(rig, "SAP 0, 0, 500", "ROR 0, 100", "SAP 0, 0, 1000", "MST 0", "SAP 0, 0, 0") == [100] * 5
    assert counted(counters)["without_effect"] == {"no_positioning": 2}
    assert counters.lines() == ["module 0: target positions set in velocity mode (axis parameter 0): 2"]


def test_a_move_without_speed_moves_nothing_and_one_to_where_the_motor_is_asks_for_nothing(rig):
    counters = Counters(rig)
    do(rig, "SAP 4, 1, 0", "MVP ABS, 1, 1000", "MVP REL, 1, 5", "MVP ABS, 1, 0", "MVP ABS, 0, 1000")
    assert counted(counters)["without_effect"] == {"no_speed": 2}


def test_lines_of_text_are_counted_too(rig):
    port = SerialPort(rig.modules[0], lambda data: None)
    counters = Counters(rig)
    port.receive(bytes.fromhex("018b0000000000008c"))
    port.receive(b"AGAP 4, 7\rAGAP 4, 0\rAFOO\r")
    assert counted(counters)["refused"] == {"4 invalid value": 1, "2 invalid command": 1}


def test_versions_and_stored_instructions_are_no_statuses(rig):
    rig.modules[0].eeprom.write_program([parse_instruction("MVP COORD, 1, 3")])
    frames, bytes_out = [], bytearray()
    bus = CanPort(rig.modules[0], lambda identifier, data: frames.append(data))
    line = SerialPort(rig.modules[0], bytes_out.extend)
    counters = Counters(rig)
    for command in ("136 0, 0, 0", "134 0, 0, 0"):
        instruction = parse_instruction(command)
        bus.receive_frame(1, pack_can_request(instruction))
        line.receive(pack_request(1, instruction))
    assert [frame[:3] for frame in frames] == [b"343", bytes((4, 2, 1))]
    assert len(bytes_out) == 18
    assert counted(counters)["refused"] == {}
    bus.receive_frame(1, pack_can_request(parse_instruction("GAP 99, 0")))
    assert counted(counters)["refused"] == {"3 wrong type": 1}


def test_counting_looks_at_no_good_telegram(rig):
    counters = Counters(rig)
    line = SerialPort(rig.modules[0], lambda data: None)
    assert not rig.modules[0].observers, "each telegram would be shown to an observer"
    line.receive(pack_request(1, parse_instruction("GAP 1, 0")))
    line.receive(pack_request(1, parse_instruction("GAP 1, 0"))[:-1] + b"\0")
    assert counted(counters)["refused"] == {"1 wrong checksum": 1}


def test_commands_of_a_program_are_counted_too(rig):
    from tmcm34x.toolchain.assembler import assemble

    module = rig.modules[0]
    module.eeprom.write_program(assemble(PROGRAM).program)
    counters = Counters(rig)
    module.program.run(0)
    run_until(rig, clocks(0.1))
    found = counted(counters)
    assert found["refused"] == {"4 invalid value": 1}
    assert found["without_effect"] == {"no_speed": 1}
    assert found["eeprom_writes"] == {"global_parameter 68": 1}


def test_counting_changes_no_run():
    def digest(*, counting):
        rig = simple_rig(343)
        counters = Counters(rig) if counting else None
        do(rig, "ROR 0, 100", "SAP 0, 0, 1000", "SAP 4, 1, 0", "MVP ABS, 1, 1000", "STAP 4, 1")
        run_until(rig, clocks(0.5))
        assert counters is None or counted(counters)["without_effect"]
        return rig.digest()

    assert digest(counting=True) == digest(counting=False)


def test_run_shows_what_was_counted(tmp_path):
    file = tmp_path / "p.tmc"
    file.write_text(PROGRAM)
    result = subprocess.run([COMMAND, "run", file], capture_output=True, text=True, check=False)
    assert "counted     1 EEPROM write, 1 of them to global_parameter 68" in result.stdout
    assert "counted     moves with a largest speed of 0 (axis parameter 4): 1" in result.stdout
    result = subprocess.run([COMMAND, "run", "--json", file], capture_output=True, text=True, check=False)
    (figures,) = json.loads(result.stdout)["counters"]
    assert figures["without_effect"] == {"no_speed": 1}
    assert figures["refused"] == {"4 invalid value": 1}
