"""Modules and their worlds in virtual time."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.rigs import rig_of, run_ms, run_while, say, view
from tmcm34x.bench import simple_rig
from tmcm34x.bench.action import Action
from tmcm34x.clock import HZ, MS, NEVER, run_until
from tmcm34x.toolchain.assembler import assemble

LIMITED = """
[[module]]
model = {model}
[[module.axis]]
load = {{ kind = "carriage", lead_mm = 5.0, low = -21.0, high = 21.0 }}
microsteps = 64
switch.left = {{ position = -20.0, hysteresis = 0.5 }}
switch.right = {{ position = 20.0, hysteresis = 0.5 }}
"""


@pytest.mark.parametrize("model", [341, 342, 343])
def test_a_simple_rig_moves_its_motors_and_rests_for_nothing(model):
    rig = simple_rig(model)
    say(rig, "MVP ABS, 1, 5000")
    run_ms(rig, 5_000)
    assert say(rig, "GAP 1, 1") == 5000
    assert view(rig, 1).lost_fullsteps == 0
    assert rig.next_event() == NEVER


def test_a_simple_rig_takes_addresses_and_a_memory():
    rig = simple_rig(343, address=7, host_address=9)
    eeprom = rig.modules[0].eeprom
    assert (say(rig, "GGP 66, 0"), say(rig, "GGP 76, 0")) == (7, 9)
    assert say(simple_rig(343, eeprom), "GGP 66, 0") == 7


@pytest.mark.parametrize("model", [341, 342, 343])
def test_a_switch_closes_at_the_clock_of_its_microstep(model):
    rig = rig_of(LIMITED.format(model=model))
    board = rig.modules[0].board
    say(rig, "ROL 0, 777")
    run_ms(rig, 300)
    chip, smda = board.chips[0], 0
    steps_to_go = chip.position(smda) + 20 * 2560
    assert steps_to_go > 0
    clocks = [clock for clock, _ in chip.steps(smda, rig.now, rig.now + 60_000 * MS)]
    due = clocks[steps_to_go - 1]
    run_until(rig, due - 1)
    assert not board.switch(0, "left")
    assert view(rig).position > -20
    run_until(rig, due)
    assert board.switch(0, "left")
    assert view(rig).position == -20
    run_ms(rig, 100)
    assert say(rig, "GAP 3, 0") == 0
    assert say(rig, "GAP 11, 0") == 1
    assert -20 * 2560 >= say(rig, "GAP 1, 0") > -20 * 2560 - 120


def test_a_pressed_switch_lets_the_motor_leave_and_opens_late():
    rig = rig_of(LIMITED.format(model=343))
    say(rig, "ROR 0, 500")
    run_ms(rig, 10_000)
    assert (say(rig, "GAP 3, 0"), say(rig, "GAP 10, 0")) == (0, 1)
    say(rig, "ROL 0, 100")
    run_while(rig, lambda: view(rig).right)
    assert view(rig).position == pytest.approx(19.5, abs=2 / 2560)


def test_with_its_stop_disabled_the_motor_runs_into_the_hard_stop_and_loses_steps():
    rig = rig_of(LIMITED.format(model=343))
    say(rig, "SAP 13, 0, 1")
    say(rig, "ROL 0, 500")
    run_ms(rig, 10_000)
    seen = view(rig)
    assert seen.position == -21.0
    assert (seen.grip, seen.load) == ("blocked", 1.0)
    say(rig, "MST 0")
    run_ms(rig, 1000)
    say(rig, "ROR 0, 200")
    run_ms(rig, 500)
    seen = view(rig)
    assert seen.grip == "following"
    assert seen.lost_fullsteps > 100
    assert seen.lost_fullsteps % 4 == 0


def test_setting_the_position_and_the_resolution_moves_neither_rotor_nor_switches():
    rig = rig_of(LIMITED.format(model=343))
    say(rig, "MVP ABS, 0, 25600")
    run_ms(rig, 5_000)
    for command in ("SAP 0, 0, -7", "SAP 1, 0, -7", "SAP 140, 0, 3"):
        say(rig, command)
    run_ms(rig, 100)
    assert view(rig).position == pytest.approx(10.0)
    assert view(rig).lost_fullsteps == 0
    say(rig, "MVP REL, 0, 100")
    run_ms(rig, 5_000)
    assert view(rig).position == pytest.approx(10.0 + 100 * 8 / 2560)
    say(rig, "ROR 0, 300")
    run_while(rig, lambda: not view(rig).right)
    assert view(rig).position == pytest.approx(20.0, abs=8 / 2560)


def test_a_reversed_axis_has_its_left_switch_at_the_high_end():
    rig = rig_of("""
[[module]]
[[module.axis]]
reverse = true
switch.left = { position = 3.0 }
switch.right = { position = -3.0 }
""")
    say(rig, "ROL 0, 500")
    run_ms(rig, 5_000)
    assert say(rig, "GAP 11, 0") == 1
    assert view(rig).position == pytest.approx(3.0, abs=0.1)
    assert say(rig, "GAP 1, 0") < 0


def test_a_342_turns_the_motor_by_its_outside_drivers_microsteps():
    rig = rig_of("[[module]]\nmodel = 342\n[[module.axis]]\nmicrosteps = 8\nload.kind = 'carriage'")
    say(rig, "SAP 140, 0, 2")
    say(rig, "MVP ABS, 0, 1600")
    run_ms(rig, 5_000)
    assert view(rig).position == pytest.approx(5.0)
    say(rig, "SAP 140, 0, 5")
    say(rig, "MVP ABS, 0, 3200")
    run_ms(rig, 5_000)
    assert view(rig).position == pytest.approx(10.0)
    assert view(rig).lost_fullsteps == 0


def test_a_reset_forgets_positions_but_the_load_stays_within_two_full_steps():
    rig = rig_of(LIMITED.format(model=343))
    say(rig, "MVP ABS, 0, 5000")
    run_ms(rig, 5_000)
    rig.modules[0].reset()
    run_ms(rig, 10)
    assert say(rig, "GAP 1, 0") == 0
    assert view(rig).position == pytest.approx(5000 / 2560, abs=2 * 64 / 2560)
    assert view(rig).lost_fullsteps == 0


def test_a_342_keeps_its_outside_drivers_place_over_a_reset():
    rig = rig_of(LIMITED.format(model=342))
    say(rig, "MVP ABS, 0, 5001")
    run_ms(rig, 5_000)
    rig.modules[0].reset()
    say(rig, "MVP ABS, 0, -1")
    run_ms(rig, 5_000)
    assert view(rig).position == pytest.approx(5000 / 2560)
    assert view(rig).lost_fullsteps == 0


def test_power_off_lets_a_hanging_load_fall_and_power_on_finds_it_there():
    rig = rig_of("""
[[module]]
[[module.axis]]
motor.holding_torque_nm = 0.8
load = { kind = "carriage", lead_mm = 5.0, low = -30.0, force = 25.0 }
""")
    world = rig.worlds[0]
    say(rig, "MVP ABS, 0, 25600")
    run_ms(rig, 5_000)
    assert view(rig).position == pytest.approx(10.0)
    world.set_power(False)
    run_ms(rig, 100)
    assert view(rig).position == -30.0
    assert view(rig).grip == "free"
    world.set_power(True)
    run_ms(rig, 100)
    assert say(rig, "GAP 1, 0") == 0
    assert view(rig).position == pytest.approx(-30.0, abs=0.06)


def test_freewheeling_lets_a_hand_move_the_load():
    rig = rig_of(LIMITED.format(model=343))
    say(rig, "SAP 204, 0, 10")
    say(rig, "MVP ABS, 0, 2560")
    run_ms(rig, 3_000)
    assert view(rig).grip == "free"
    assert view(rig).current_ma == 0
    rig.worlds[0].move(0, 7.3)
    run_ms(rig, 1)
    assert view(rig).position == pytest.approx(7.3, abs=1 / 2560)


def test_a_held_load_yields_to_a_hand_by_whole_cycles_only():
    rig = rig_of(LIMITED.format(model=343))
    rig.worlds[0].move(0, 1.03)
    run_ms(rig, 1)
    assert view(rig).position == pytest.approx(1.0)
    assert view(rig).lost_fullsteps == 40


STRONG = "SAP 6, 0, 255 | SAP 140, 0, 2 | SAP 154, 0, 3 | SAP 153, 0, 7 | SAP 5, 0, {a} | ROR 0, {v}"


def speed_up(rig, a, v):
    for line in STRONG.format(a=a, v=v).split(" | "):
        say(rig, line)


def test_a_motor_asked_for_more_speed_than_it_has_torque_for_loses_steps():
    rig = rig_of(
        "[[module]]\n[[module.axis]]\nload = { kind = 'carriage', mass_kg = 2.0, friction_n = 40.0 }"
    )
    speed_up(rig, 100, 300)
    run_ms(rig, 2_000)
    assert view(rig).grip == "following"
    speed_up(rig, 100, 2000)
    run_ms(rig, 5_000)
    assert view(rig).grip == "stalled"
    stayed = view(rig).position
    run_ms(rig, 1_000)
    assert view(rig).position == stayed
    say(rig, "MST 0")
    run_ms(rig, 60_000)
    assert view(rig).grip == "following"
    assert view(rig).lost_fullsteps < -1000


def test_the_moment_of_pull_out_does_not_depend_on_who_looks():
    text = "[[module]]\n[[module.axis]]\nload = { kind = 'carriage', mass_kg = 2.0, friction_n = 40.0 }"
    stays = []
    for slice_ms in (1_000, 1, 0.3):
        rig = rig_of(text)
        speed_up(rig, 100, 2000)
        while rig.now < 3_000 * MS:
            run_ms(rig, slice_ms)
            say(rig, "GAP 1, 0")
        assert view(rig).grip == "stalled"
        stays.append(view(rig).position)
    assert stays[0] == stays[1] == stays[2]


def test_too_fast_a_start_is_a_loss_and_a_slower_one_is_not():
    for a, grip in ((2047, "stalled"), (200, "following")):
        rig = rig_of(
            "[[module]]\n[[module.axis]]\nload = { kind = 'carriage', lead_mm = 60.0, mass_kg = 1.0 }"
        )
        speed_up(rig, a, 500)
        run_ms(rig, 1_000)
        assert view(rig).grip == grip


@given(
    st.lists(
        st.tuples(
            st.sampled_from((
                "MVP ABS, 0, 40000", "MVP ABS, 0, -70000", "ROL 0, 900", "ROR 0, 400", "MST 0", "SAP 140, 0, 4",
                "SAP 1, 0, 1234", "SAP 13, 0, 1", "SAP 12, 0, 1", "MVP REL, 1, -3000", "SAP 6, 0, 20", "SAP 5, 0, 90",
                "ROL 1, 600", "RFS START, 0", "SAP 204, 0, 3", "GAP 206, 0",
            )),
            st.integers(1, 700),
        ),
        max_size=6,
    ),
    st.lists(st.integers(1, 20_000_000), max_size=6),
)  # fmt: skip
@settings(max_examples=40)
def test_slicing_does_not_matter(commands, cuts):
    text = (
        LIMITED.format(model=343)
        + "switch.bounce_ms = 3.0\n[[module.axis]]\nload.kind = 'carriage'\nload.low = -1.0\nswitch.left.position = 0.5"
    )
    seen = []
    for slices in ([], cuts):
        rig = rig_of(text)
        for line, pause_ms in commands:
            say(rig, line)
            end = rig.now + pause_ms * MS
            for cut in sorted(slices):
                if rig.now < rig.now + cut < end:
                    run_until(rig, rig.now + cut)
                    rig.worlds[0].view()
            run_until(rig, end)
        run_ms(rig, 500)
        assert -21.0 <= view(rig, 0).position <= 21.0
        assert view(rig, 1).position >= -1.0
        seen.append((rig.worlds[0].view(), [say(rig, f"GAP {n}, 0") for n in (0, 1, 2, 3, 9, 10, 11)]))
    assert seen[0] == seen[1]


def test_a_motor_that_comes_to_its_target_too_fast_is_there_at_one_clock_however_time_is_sliced():
    whole, sliced = simple_rig(), simple_rig()
    for rig in (whole, sliced):
        source = "Loop: MVP REL, 0, 700\nWAIT POS, 0, 0\nGGP 3, 2\nCALC ADD, 1\nAGP 3, 2\nWAIT TICKS, 0, 3\nJA Loop\n"
        rig.modules[0].eeprom.write_program(assemble(source).program)
        rig.modules[0].program.run()
    run_until(whole, HZ)
    for clock in range(0, HZ + 1, 4 * MS):
        run_until(sliced, clock)
    assert sliced.digest() == whole.digest()


WAYS = st.lists(
    st.tuples(
        st.sampled_from(["MVP ABS, 0, 40000", "ROR 1, 900", "MST 1", "GAP 1, 0"]),
        st.lists(st.floats(0, 1), max_size=4),
    ),
    min_size=1,
    max_size=6,
)


@settings(max_examples=20)
@given(st.booleans(), WAYS)
def test_time_that_is_passed_between_events_is_time_that_is_advanced(running, ways):
    rigs = passed, whole = rig_of(LIMITED.format(model=343)), rig_of(LIMITED.format(model=343))
    program = assemble("Loop: SIO 1, 2, 1\nWAIT TICKS, 0, 3\nSIO 1, 2, 0\nGIO 3, 1\nJA Loop\n").program
    for rig in rigs:
        rig.modules[0].eeprom.write_program(program)
        if running:
            rig.modules[0].program.run(0)
    for command, parts in ways:
        assert say(passed, command) == say(whole, command)
        for rig in rigs:
            rig.act(Action("switch", 0, (2, "left", len(parts) % 2 == 0)))
        for part in sorted(parts):
            before = passed.now, passed.next_event()
            passed.pass_to(before[0] + int(part * (min(before[1], before[0] + HZ) - 1 - before[0])))
            assert passed.next_event() == before[1]
        due = min(passed.next_event(), passed.now + HZ)
        passed.advance(due)
        run_until(whole, due)
        assert passed.digest() == whole.digest()


def test_what_is_due_all_the_same_happens_while_time_is_passed():
    rig = simple_rig()
    assert rig.next_event() == NEVER
    say(rig, "MVP ABS, 0, 5000")
    rig.pass_to(10 * HZ)
    assert rig.next_event() > rig.now == 10 * HZ
    assert (say(rig, "GAP 8, 0"), say(rig, "GAP 1, 0")) == (1, 5000)
