"""What a bench file can put on a module, seen through commands."""

import pytest

from bench.rigs import rig_of, run_ms, run_while, say, view
from tmcm34x.bench import build
from tmcm34x.bench.description import parse
from tmcm34x.chips.tmc246 import FAULTS
from tmcm34x.clock import MS, NEVER
from tmcm34x.toolchain.assembler import assemble

STALL = """
[[module]]
[[module.axis]]
load = { kind = "carriage", mass_kg = 0.5, friction_n = 2.0, low = 0.0, high = 100.0, start = 37.5 }
"""

MANUAL_9_2 = """
      SAP 205, 0, 5
      ROL 0, 500
Loop: GAP 3, 0
      COMP 0
      JC NE, Loop
      SAP 1, 0, 0
      STOP
"""


def settle(rig, limit_ms=60_000):
    run_while(rig, lambda: rig.next_event() < NEVER, limit_ms)


# Load measurement


def test_homing_by_stall_detection_as_the_manual_prints_it():
    rig = rig_of(STALL)
    module = rig.modules[0]
    module.eeprom.write_program(assemble(MANUAL_9_2.replace("ROL", "WAIT TICKS, 0, 10\nROL")).program)
    module.program.run()
    run_while(rig, lambda: module.program.state)
    assert view(rig).position == pytest.approx(0.0, abs=2 * 64 / 2560)
    assert say(rig, "GAP 1, 0") == 0
    say(rig, "SAP 205, 0, 0")
    say(rig, "MVP ABS, 0, 25600")
    run_ms(rig, 5_000)
    assert view(rig).position == pytest.approx(10.0, abs=2 * 64 / 2560)
    assert view(rig).lost_fullsteps > 0


def test_the_load_value_rises_with_the_load_and_a_free_motor_does_not_stall():
    rig = rig_of(STALL)
    say(rig, "SAP 205, 0, 5")
    say(rig, "ROR 0, 500")
    run_ms(rig, 1_000)
    assert say(rig, "GAP 206, 0") == 0
    rig.worlds[0].push(0, 0.1)
    run_ms(rig, 20)
    assert say(rig, "GAP 206, 0") == 3
    assert say(rig, "GAP 3, 0") == 500
    rig.worlds[0].push(0, 0.25)
    run_ms(rig, 20)
    assert say(rig, "GAP 3, 0") == 0
    assert view(rig).grip in {"following", "stalled"}


def test_a_load_by_position_is_felt_in_its_zone_only():
    rig = rig_of("""
[[module]]
[[module.axis]]
load = { kind = "carriage", mass_kg = 0.1, friction_n = 0.0, force = [[0.0, 0.0], [5.0, 120.0], [10.0, 0.0]] }
""")
    say(rig, "ROR 0, 500")
    seen = {}
    while view(rig).position < 15:
        run_ms(rig, 5)
        seen.setdefault(int(view(rig).position // 5), []).append(say(rig, "GAP 206, 0"))
    assert (set(seen[0][20:]), set(seen[1][1:-1]), set(seen[2][1:])) == ({0}, {3}, {0})


# Drivers


@pytest.mark.parametrize("name", FAULTS)
@pytest.mark.parametrize("model", [341, 343])
def test_a_fault_shows_in_the_error_flags_and_ends(model, name):
    rig = rig_of(f"[[module]]\nmodel = {model}")
    say(rig, "ROR 1, 200")
    run_ms(rig, 100)
    assert say(rig, "GAP 208, 1") == 0
    rig.worlds[0].set_fault(1, name, True)
    run_ms(rig, 10)
    assert say(rig, "GAP 208, 1") == FAULTS[name].raises
    assert say(rig, "GAP 208, 0") == say(rig, "GAP 208, 2") == 0
    assert (view(rig, 1).current_ma == 0) == FAULTS[name].stops
    assert view(rig, 1).faults == (name,)
    rig.worlds[0].set_fault(1, name, False)
    run_ms(rig, 10)
    assert bool(say(rig, "GAP 208, 1")) == FAULTS[name].latched


def test_a_342_has_no_driver_to_fail():
    with pytest.raises(ValueError, match="TMCM-342"):
        rig_of("[[module]]\nmodel = 342").worlds[0].set_fault(0, "short_a", True)
    with pytest.raises(ValueError, match="no fault 'rust'"):
        rig_of("[[module]]").worlds[0].set_fault(0, "rust", True)


def test_currents_follow_the_parameters():
    rig = rig_of("[[module]]\n[[module.axis]]\nmax_current_ma = 2550.0")
    for line in ("SAP 6, 0, 100", "SAP 7, 0, 10", "SAP 214, 0, 5"):
        say(rig, line)
    say(rig, "ROR 0, 100")
    run_ms(rig, 100)
    assert view(rig).current_ma == pytest.approx(1000)
    say(rig, "MST 0")
    run_ms(rig, 1_000)
    assert view(rig).current_ma == pytest.approx(100)


# Inputs and outputs


def test_inputs_follow_their_sources():
    rig = rig_of("""
[[module]]
[module.input]
IN_0 = { kind = "constant", value = 321 }
IN_1 = { kind = "square", period_ms = 10.0, duty = 0.3, delay_ms = 5.0, high = 900, low = 20 }
IN_2 = { kind = "ramp", period_ms = 1000.0, start = 0, end = 1000 }
IN_3 = { kind = "sine", period_ms = 400.0, middle = 500, amplitude = 100 }
IN_4 = { kind = "table", points = [[0, 10], [100, 600]], repeat_ms = 200.0 }
IN_5 = { kind = "table", points = [[100, 0], [200, 1000]], interpolated = true }
IN_6 = { kind = "output", output = 2 }
IN_7 = { kind = "output", output = 2, invert = true }
""")
    run_ms(rig, 5)
    assert [say(rig, f"GIO {n}, 1") for n in range(8)] == [321, 900, 5, 508, 10, 0, 0, 1023]
    assert say(rig, "GIO 255, 0") == 0b1000_0010
    say(rig, "SIO 2, 2, 1")
    run_ms(rig, 145)
    assert [say(rig, f"GIO {n}, 1") for n in range(8)] == [321, 20, 150, 571, 600, 500, 1023, 0]
    assert say(rig, "GIO 4, 0") == 1
    run_ms(rig, 100)
    assert say(rig, "GIO 4, 1") == 10


def test_an_output_of_one_module_reaches_an_input_of_another():
    rig = rig_of("[[module]]\n[[module]]\ninput.IN_3 = { kind = 'output', module = 0, output = 7 }")
    assert say(rig, "GIO 3, 0", module=1) == 0
    say(rig, "SIO 7, 2, 1")
    assert say(rig, "GIO 3, 0", module=1) == 1


def test_a_potentiometer_follows_its_axis():
    rig = rig_of("[[module]]\ninput.IN_0 = { kind = 'position', motor = 0, low = -10, high = 10 }")
    assert say(rig, "GIO 0, 1") == 512
    say(rig, "MVP ABS, 0, 12800")
    run_ms(rig, 5_000)
    assert say(rig, "GIO 0, 1") == 767
    say(rig, "MVP ABS, 0, -50000")
    run_ms(rig, 5_000)
    assert say(rig, "GIO 0, 1") == 0


def test_a_level_can_be_held_by_hand():
    rig = rig_of("[[module]]\ninput.IN_0 = { kind = 'constant', value = 100 }")
    rig.worlds[0].set_level(0, 700)
    rig.worlds[0].set_level(5, 42)
    assert (say(rig, "GIO 0, 1"), say(rig, "GIO 5, 1")) == (700, 42)
    rig.worlds[0].set_level(0, None)
    rig.worlds[0].set_level(5, None)
    assert (say(rig, "GIO 0, 1"), say(rig, "GIO 5, 1")) == (100, 0)


SHUTDOWN = """
[[module]]
[[module]]
input.SHUTDOWN = { kind = "output", module = 0, output = 4 }
"""


def test_the_shutdown_pin_stops_motors_also_through_a_wire_from_another_module():
    rig = rig_of(SHUTDOWN)
    say(rig, "SGP 80, 0, 1", module=1)
    say(rig, "ROR 0, 500", module=1)
    run_ms(rig, 1_000)
    assert say(rig, "GAP 3, 0", module=1) == 500
    assert say(rig, "GIO 10, 0", module=1) == 0
    say(rig, "SIO 4, 2, 1")
    run_ms(rig, 10)
    assert say(rig, "GIO 10, 0", module=1) == 1
    assert say(rig, "GAP 3, 0", module=1) == 0


def test_a_source_drives_shutdown_at_its_clock():
    rig = rig_of(
        "[[module]]\ninput.SHUTDOWN = { kind = 'square', period_ms = 100, delay_ms = 50, duty = 0.5 }"
    )
    board = rig.modules[0].board
    seen = []
    while rig.now < 200 * MS:
        rig.advance(rig.next_event())
        if not seen or seen[-1][1] != board.shutdown_level():
            seen.append((rig.now / MS, board.shutdown_level()))
    assert seen == [(50, 1), (100, 0), (150, 1), (200, 0)]


# Serial devices and encoders


def test_serial_devices_answer_sac():
    rig = rig_of("""
[[module]]
[module.spi]
SPI_SEL0 = { kind = "echo" }
SPI_SEL1 = { kind = "shift_register", bytes = 2 }
SPI_SEL2 = { kind = "buttons", bytes = 2, inputs = 0xBEEF }
""")
    assert say(rig, "SAC 0, 2, 1234") == 1234
    assert [say(rig, f"SAC 2, 1, {n}") for n in (1, 2, 3, 4)] == [0, 0, 1, 2]
    assert say(rig, "SAC 3, 2, 0") == 0xBEEF


def test_a_device_of_ones_own_is_attached_in_python():
    class Counter:
        def __init__(self):
            self.count = 0

        def exchange(self, data, nbytes):
            self.count += 1
            return self.count

    rig = rig_of("[[module]]")
    rig.modules[0].board.attach_spi(1, Counter())
    assert [say(rig, "SAC 2, 4, 0") for _ in range(3)] == [1, 2, 3]


ENCODER = """
[[module]]
[[module.axis]]
load = { kind = "carriage", lead_mm = 5.0, low = -5.0, start = 20.0 }
encoder = { lines = 1000, null = "high" }
[[module.axis]]
load = { kind = "carriage", lead_mm = 5.0 }
encoder = { lines = 1024, slip = 0.02, null = "none" }
[module.spi]
SPI_SEL1 = { kind = "tmcm323" }
"""


def encoder_rig():
    rig = rig_of(ENCODER)
    for line in ("SGP 74, 0, 2", "SAP 210, 0, 67104", "SAP 210, 1, 1600", "SAP 209, 0, 0", "SAP 209, 1, 0"):
        say(rig, line)
    return rig


def test_an_encoder_counts_microsteps_with_the_right_prescaler():
    rig = encoder_rig()
    for motor in (0, 1):
        say(rig, f"MVP ABS, {motor}, 25600")
    run_ms(rig, 5_000)
    assert say(rig, "GAP 209, 0") == 25600
    assert say(rig, "GAP 209, 1") == pytest.approx(25600 * 0.98, abs=4)
    say(rig, "MVP ABS, 0, -6400")
    run_ms(rig, 5_000)
    assert say(rig, "GAP 209, 0") == -6400


def test_lost_steps_show_between_position_and_encoder_and_stop_the_motor():
    rig = encoder_rig()
    say(rig, "SAP 212, 0, 1000")
    say(rig, "ROL 0, 500")
    run_ms(rig, 100)
    run_while(rig, lambda: say(rig, "GAP 3, 0"))
    assert view(rig).position == -5.0
    gap = say(rig, "GAP 209, 0") - say(rig, "GAP 1, 0")
    assert 1000 < gap < 2000


def test_a_null_mark_clears_the_counter_although_the_shaft_turns_round_on_the_way():
    rig = encoder_rig()
    say(rig, f"SAP 210, 0, {67104 | 16 | 4 | 2}")
    say(rig, "MVP ABS, 0, 13000")
    run_ms(rig, 3_000)
    assert say(rig, "GAP 209, 0") == 198, "62 edges of 3.2"
    say(rig, "MVP ABS, 0, 12700")
    run_ms(rig, 3_000)
    say(rig, "MVP ABS, 0, 20000")
    run_ms(rig, 3_000)
    assert say(rig, "GAP 209, 0") == 7200


def test_a_null_mark_passed_while_the_motor_turns_round_clears_the_counter():
    rig = encoder_rig()
    say(rig, "MVP ABS, 0, 100")
    run_ms(rig, 500)
    say(rig, f"SAP 210, 0, {67104 | 16 | 4}")
    say(rig, "SAP 5, 0, 200")
    say(rig, "ROR 0, 500")
    run_ms(rig, 870)
    assert 11_600 < say(rig, "GAP 1, 0") < 12_800
    say(rig, "ROL 0, 500")
    run_ms(rig, 1_500)
    after = say(rig, "GAP 1, 0")
    assert after < 12800
    assert say(rig, "GAP 209, 0") == pytest.approx(after - 12800, abs=4)


# Events and hands


def test_events_happen_at_their_time():
    rig = rig_of("""
[[module]]
[[event]]
at_ms = 10
do = "fault"
fault = "under_voltage"
motor = 2
[[event]]
at_ms = 20
do = "switch"
side = "right"
[[event]]
at_ms = 20
do = "level"
input = "IN_4"
value = 77.0
[[event]]
at_ms = 30
do = "switch"
side = "right"
on = false
[[event]]
at_ms = 30
do = "unplug"
motor = 1
[[event]]
at_ms = 35
do = "move"
value = 12.0
[[event]]
at_ms = 40
do = "power"
on = false
[[event]]
at_ms = 50
do = "power"
""")
    world, module = rig.worlds[0], rig.modules[0]
    assert rig.next_event() == 10 * MS
    run_ms(rig, 10)
    assert world.view()[2].faults == ("under_voltage",)
    run_ms(rig, 10)
    assert say(rig, "GIO 4, 1") == 77
    run_ms(rig, 1)
    assert say(rig, "GAP 10, 0") == 1
    run_ms(rig, 10)
    assert (say(rig, "GAP 10, 0"), say(rig, "GAP 11, 1")) == (0, 1)
    run_ms(rig, 5)
    assert view(rig).position == pytest.approx(12.0)
    run_ms(rig, 5)
    assert not module.powered
    run_ms(rig, 10)
    assert module.powered


def test_a_hand_on_a_switch_is_stronger_than_its_place_until_it_lets_go():
    rig = rig_of("[[module]]\n[[module.axis]]\nswitch.left.position = 5.0")
    world = rig.worlds[0]
    run_ms(rig, 1)
    assert say(rig, "GAP 11, 0") == 1
    world.set_switch(0, "left", False)
    run_ms(rig, 1)
    assert say(rig, "GAP 11, 0") == 0
    world.set_switch(0, "left", None)
    run_ms(rig, 1)
    assert say(rig, "GAP 11, 0") == 1


def test_bouncing_contacts_depend_on_the_seed_only():
    def edges(seed):
        rig = rig_of(
            f"seed = {seed}\n[[module]]\n[[module.axis]]\nswitch = {{ right = {{ position = 1.0 }}, bounce_ms = 4.0 }}"
        )
        board = rig.modules[0].board
        say(rig, "ROR 0, 100")
        seen, level = [], False
        while rig.now < 1_000 * MS and rig.next_event() < NEVER:
            rig.advance(rig.next_event())
            if board.switch(0, "right") != level:
                level = not level
                seen.append((rig.now, level))
        return seen

    runs = [edges(seed) for seed in (1, 1, 2)]
    assert runs[0] == runs[1] != runs[2]
    assert len(runs[0]) > 2
    assert runs[0][-1][1]


def test_a_bench_without_motion_has_no_events():
    assert build(parse(STALL)).next_event() == NEVER
