"""The ready benches: each is loaded, run, and does what its title says."""

from pathlib import Path

import pytest

from bench.rigs import run_ms, run_while, say, view
from tmcm34x.bench import load
from tmcm34x.bench.description import read
from tmcm34x.clock import NEVER
from tmcm34x.firmware.ports.serial import SerialPort
from tmcm34x.toolchain.assembler import assemble

FOLDER = Path(__file__).parents[2] / "examples" / "benches"
BENCHES = sorted(FOLDER.glob("*.toml"))

MANUAL_9_2 = """
      SAP 205, 0, 5 //Turn on Stall Detection (use other threshold if needed)
      ROL 0, 500 //Let the motor run (or use ROR or other velocity)
Loop: GAP 3, 0
      COMP 0
      JC NE, Loop //Wait until the motor has stopped
      SAP 1, 0, 0 //Set this position as the zero position
"""


def bench(name):
    return load(FOLDER / f"{name}.toml")


def search(rig, *motors):
    for motor in motors:
        say(rig, f"RFS START, {motor}")
    run_while(rig, lambda: any(say(rig, f"RFS STATUS, {motor}") for motor in motors))


@pytest.mark.parametrize("path", BENCHES, ids=lambda path: path.stem)
def test_a_ready_bench_says_what_it_is_and_runs(path):
    assert read(path).title
    rig = load(path)
    for n in range(len(rig.modules)):
        for motor in range(3):
            say(rig, f"ROR {motor}, 300", module=n)
    run_ms(rig, 10_000)
    for n, world in enumerate(rig.worlds):
        assert len(world.view()) == 3
        assert world.module.powered
        say(rig, "GAP 1, 0", module=n)
    assert BENCHES


def test_the_xy_stage_finds_its_zero_and_its_length_on_both_axes_at_once():
    rig = bench("xy-stage")
    for motor in (0, 1):
        say(rig, f"SAP 193, {motor}, 2")
    search(rig, 0, 1)
    assert [say(rig, f"GAP 1, {motor}") for motor in (0, 1)] == [0, 0]
    assert say(rig, "GAP 196, 0") == pytest.approx(200 * 2560, abs=100)
    assert say(rig, "GAP 196, 1") == pytest.approx(120 * 2560, abs=100)
    assert say(rig, "GIO 0, 1") == 0
    say(rig, "MVP ABS, 0, 256000")
    run_while(rig, lambda: not say(rig, "GAP 8, 0"))
    assert say(rig, "GIO 0, 1") == pytest.approx(512, abs=1)


def test_pick_and_place_holds_its_hanging_axis_until_the_power_goes():
    rig = bench("pick-and-place")
    search(rig, 2)
    assert view(rig, 2).position == pytest.approx(0.0, abs=0.1)
    say(rig, "SIO 0, 2, 1")
    assert say(rig, "GIO 0, 0") == 1
    run_ms(rig, 5_000)
    assert view(rig, 2).position == pytest.approx(0.0, abs=0.1)
    rig.worlds[0].set_power(False)
    run_ms(rig, 1)
    assert view(rig, 2).position == 60.0


def test_the_turntable_finds_its_mark_from_anywhere():
    rig = bench("turntable")
    places = []
    for turn in (0, 7_000, 31_000):
        say(rig, f"MVP REL, 0, {turn}")
        run_while(rig, lambda: not say(rig, "GAP 8, 0"))
        search(rig, 0)
        assert say(rig, "GAP 1, 0") == 0
        places.append(view(rig).position)
    assert max(places) - min(places) < 0.05
    assert places[0] == pytest.approx(93.0, abs=0.2)


def test_the_conveyors_emergency_stop_stops_it():
    rig = bench("conveyor")
    say(rig, "SGP 80, 0, 1")
    say(rig, "ROR 0, 800")
    run_ms(rig, 4_500)
    assert view(rig).load > 0.5
    run_ms(rig, 3_000)
    assert view(rig).load < 0.5
    assert say(rig, "GAP 3, 0") == 800
    run_ms(rig, 1_000)
    assert say(rig, "GAP 3, 0") == 0


def test_the_encoder_bench_notices_lost_steps():
    rig = bench("encoder")
    for line in ("SGP 74, 0, 2", "SAP 210, 0, 67104", "SAP 210, 1, 1600", "SAP 212, 0, 500", "SAP 209, 0, 0"):
        say(rig, line)
    say(rig, "ROR 0, 500")
    say(rig, "ROR 1, 500")
    run_ms(rig, 2_900)
    assert say(rig, "GAP 209, 0") == pytest.approx(say(rig, "GAP 1, 0"), abs=4)
    assert say(rig, "GAP 209, 1") < say(rig, "GAP 1, 1") * 0.985
    run_ms(rig, 300)
    assert say(rig, "GAP 3, 0") == 0
    assert say(rig, "GAP 1, 0") - say(rig, "GAP 209, 0") > 500


def test_stall_homing_runs_the_manuals_program_as_it_is_printed():
    rig = bench("stall-homing")
    module = rig.modules[0]
    module.eeprom.write_program(assemble(MANUAL_9_2).program)
    module.program.run()
    run_while(rig, lambda: module.program.state)
    assert say(rig, "GAP 1, 0") == 0
    assert view(rig).position == pytest.approx(0.0, abs=2 * 64 / 2560)


def test_three_modules_share_the_line_by_their_addresses():
    rig = bench("rs485")
    assert [say(rig, "GGP 66, 0", module=n) for n in range(3)] == [1, 2, 3]
    answers = [[], [], []]
    ports = [SerialPort(module, answers[n].append) for n, module in enumerate(rig.modules)]
    request = bytes((3, 136, 1, 0, 0, 0, 0, 0, 140))
    for port in ports:
        port.receive(request)
    assert [len(answer) for answer in answers] == [0, 0, 1]
    assert answers[2][0][4:8] == bytes((1, 0x57, 4, 36))
    say(rig, "SIO 7, 2, 1")
    assert say(rig, "GIO 0, 0", module=2) == 1
    say(rig, "MVP ABS, 0, -200000", module=1)
    run_while(rig, lambda: rig.next_event() < NEVER)
    assert view(rig, module=1).position == pytest.approx(-20.0, abs=0.1)
    assert say(rig, "GAP 11, 0", module=1) == 1
