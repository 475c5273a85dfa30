from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware.hosts import Host, switched_on
from tmcm34x.chips.tmc246 import MotorCondition, Tmc246
from tmcm34x.chips.tmc423 import Tmc423
from tmcm34x.clock import MS, NEVER, run_until
from tmcm34x.firmware import drivers, motion
from tmcm34x.firmware.axis import V_TARGET, X_ACTUAL


def current(module, motor):
    return module.board.currents[motor]


# Currents


def test_the_current_is_full_from_the_start_of_a_move_until_the_power_down_delay_after_it():
    module = switched_on()
    host = Host(module)
    assert module.board.currents == [8, 8, 8]
    host.do("MVP ABS, 1, 3000")
    assert module.board.currents == [8, 128, 8]
    while module.axes[1].moving:
        module.advance(module.next_event())
    assert [host.do(f"GAP {n}, 1") for n in (1, 3)] == [3000, 0]
    at_rest = module.now
    run_until(module, at_rest + 2000 * MS - 1)
    assert current(module, 1) == 128
    run_until(module, at_rest + 2000 * MS)
    assert current(module, 1) == 8


@pytest.mark.parametrize("model", [341, 342, 343])
def test_a_motor_rests_at_the_same_clock_whatever_the_others_do(model):
    def rest_of_motor_1(*others):
        module = switched_on(model)
        host = Host(module)
        for line in ("SAP 5, 1, 3", "ROR 1, 200", *others):
            host.do(line)
        run_until(module, 3000 * MS)
        host.do("MST 1")
        run_until(module, 9000 * MS)
        assert not module.axes[1].moving
        return module.axes[1].rest_since

    alone = rest_of_motor_1()
    assert alone > 3000 * MS
    assert rest_of_motor_1("SAP 4, 0, 2000", "MVP ABS, 0, 40000", "ROL 2, 5") == alone


@pytest.mark.parametrize("acceleration", [1, 20, 1000])
def test_a_motor_that_turns_round_moves(acceleration):
    """Speed and target speed are 0 for at least one ramp tick in the middle of a move."""
    module = switched_on()
    host = Host(module)
    changes = []
    for line in ("SAP 214, 0, 1", "SAP 204, 0, 2", f"SAP 5, 0, {acceleration}", "SAP 4, 0, 100"):
        host.do(line)
    module.board.on_current.append(lambda *change: changes.append(change))
    host.do("MVP ABS, 0, -40000")
    host.wait_ms(2000)
    host.do("MVP ABS, 0, 4000")
    while host.do("GAP 3, 0") <= 0:
        host.wait_ms(20)
    host.wait_ms(100)
    assert module.axes[0].moving
    assert changes == [(0, 128, True)]


@settings(max_examples=60)
@given(
    st.lists(st.tuples(st.integers(-30000, 30000), st.integers(0, 2500)), min_size=2, max_size=4),
    st.integers(1, 2047), st.integers(5, 2047), st.integers(0, 2), st.integers(5, 9),
)  # fmt: skip
def test_a_motor_with_standby_current_stays_where_it_is(moves, speed, acceleration, v_min, ramp_div):
    module = switched_on()
    host = Host(module)
    for number, value in ((4, speed), (5, acceleration), (130, v_min), (153, ramp_div), (214, 1)):
        host.do(f"SAP {number}, 0, {value}")
    rests = []
    module.board.on_current.append(lambda _, current, on: rests.append((current, position(module))))
    for target, pause_ms in (*moves, (0, 60_000)):
        before = position(module)
        assert not rests or rests[-1][0] == 128 or rests[-1][1] == before
        host.do(f"MVP ABS, 0, {target}")
        assert current(module, 0) == 128 or target == before
        host.wait_ms(pause_ms)
    assert not rests or rests[-1] == (8, position(module))


def position(module):
    return module.axes[0].read(X_ACTUAL)


def test_currents_follow_their_parameters_at_once():
    module = switched_on()
    host = Host(module)
    host.do("SAP 7, 0, 33")
    assert current(module, 0) == 33
    host.do("SAP 6, 0, 200")
    assert current(module, 0) == 33
    host.do("ROR 0, 100")
    assert current(module, 0) == 200
    host.do("SAP 6, 0, 90")
    host.do("SAP 7, 0, 50")
    assert current(module, 0) == 90
    host.do("SAP 214, 0, 10")
    host.do("MST 0")
    host.wait_ms(300)
    assert current(module, 0) == 50


def test_a_new_move_within_the_delay_keeps_the_current_up():
    module = switched_on()
    host = Host(module)
    seen = []
    module.board.on_current.append(lambda *change: seen.append(change))
    for target in (100, 200, 300):
        host.do(f"MVP ABS, 0, {target}")
        host.wait_ms(1500)
    assert seen == [(0, 128, True)]


def test_a_shorter_delay_counts_from_the_beginning_of_rest():
    module = switched_on()
    host = Host(module)
    host.do("MVP ABS, 0, 10")
    host.wait_ms(1000)
    host.do("SAP 214, 0, 50")
    host.wait_ms(1)
    assert current(module, 0) == 8


def test_a_command_that_moves_nothing_leaves_the_current_in_standby():
    module = switched_on()
    host = Host(module)
    for line in ("MVP ABS, 0, 0", "MST 1", "ROR 2, 0"):
        host.do(line)
    assert module.board.currents == [8] * 3
    assert module.next_event() == NEVER


def test_a_motor_that_waits_at_a_switch_rests_and_starts_again_when_it_opens():
    module = switched_on()
    host = Host(module)
    module.board.set_switch(0, "right", True)
    host.do("MVP ABS, 0, 100000")
    host.wait_ms(3000)
    assert (current(module, 0), host.do("GAP 3, 0")) == (8, 0)
    module.board.set_switch(0, "right", False)
    host.wait_ms(20)
    assert (current(module, 0), host.do("GAP 3, 0") > 0) == (128, True)


def test_a_motor_that_a_switch_holds_in_velocity_mode_keeps_its_current():
    module = switched_on()
    module.board.set_switch(0, "right", True)
    Host(module).do("ROR 0, 500")
    run_until(module, 5000 * MS)
    assert current(module, 0) == 128


@pytest.mark.parametrize("divisor", [0, 7, 13])
def test_rest_is_noticed_at_every_ramp_divisor(divisor):
    module = switched_on()
    host = Host(module)
    host.do(f"SAP 153, 0, {divisor}")
    host.do("ROR 0, 5")
    host.wait_ms(5000)
    assert current(module, 0) == 128
    host.do("MST 0")
    host.wait_ms(5000)
    assert current(module, 0) == 8


def test_freewheeling_switches_the_driver_off_after_its_time():
    module = switched_on()
    host = Host(module)
    host.do("SAP 204, 0, 30")
    host.do("MVP ABS, 0, 100")
    host.wait_ms(200)
    assert module.board.enabled[0]
    host.wait_ms(300)
    assert module.board.enabled == [False, True, True]
    host.do("MVP ABS, 0, 200")
    assert module.board.enabled[0]
    host.wait_ms(1000)
    host.do("SAP 204, 0, 0")
    host.do("MVP ABS, 0, 100")
    host.wait_ms(60_000)
    assert module.board.enabled[0]


def test_a_342_sets_no_currents():
    module = switched_on(342)
    Host(module).do("ROR 0, 500")
    run_until(module, 5000 * MS)
    assert module.board.currents == [0, 0, 0]


# Stall


class Motor:
    """A driver on a motor whose load a test sets."""

    def __init__(self, module, motor):
        self.load = 0.0
        self.driver = Tmc246()
        self.driver.condition = lambda: MotorCondition(1.0, self.load)
        module.board.attach_driver(motor, self.driver)


def with_stall_detection():
    """A host of a module that stops motor 0 at a load value of 2 or less, and the motor."""
    module = switched_on()
    host = Host(module)
    host.do("SAP 205, 0, 5")
    return host, Motor(module, 0)


def test_a_stalled_motor_is_stopped_at_once():
    host, motor = with_stall_detection()
    host.do("ROL 0, 500")
    host.wait_ms(1000)
    assert [host.do(f"GAP {n}, 0") for n in (3, 206)] == [-500, 0]
    motor.load = 0.5
    host.wait_ms(100)
    assert host.do("GAP 206, 0") == 3
    motor.load = 0.8
    host.wait_ms(5)
    assert [host.do(f"GAP {n}, 0") for n in (3, 2, 138)] == [0, 0, 2]


def test_the_threshold_itself_stops():
    host, motor = with_stall_detection()
    motor.load = 5 / 7
    host.do("ROR 0, 500")
    host.wait_ms(1000)
    assert host.do("GAP 3, 0") == 0


def test_stall_is_not_looked_for_while_speed_changes_or_detection_is_off():
    module = switched_on()
    host = Host(module)
    Motor(module, 0).load = 1.0
    host.do("SAP 5, 0, 20")
    host.do("ROR 0, 1000")
    host.wait_ms(1000)
    host.do("SAP 205, 0, 1")
    host.wait_ms(1000)
    assert 0 < host.do("GAP 3, 0") < 1000
    host.do("SAP 205, 0, 0")
    host.wait_ms(5000)
    assert host.do("GAP 3, 0") == 1000


def test_a_stall_ends_a_reference_search():
    host, motor = with_stall_detection()
    host.do("RFS START, 0")
    host.wait_ms(500)
    assert host.do("RFS STATUS, 0") > 0
    motor.load = 0.8
    host.wait_ms(5)
    assert [host.do("RFS STATUS, 0"), host.do("GAP 3, 0")] == [0, 0]
    assert host.do("GAP 1, 0") < 0


def test_driver_flags_read_at_once():
    module = switched_on()
    host = Host(module)
    motor = Motor(module, 2)
    motor.driver.set_fault("over_temperature", True)
    assert [host.do(f"GAP 208, {n}") & 0xC0 for n in range(3)] == [0, 0, 0xC0]


# Mixed decay and full step


def cells(module, motor):
    return drivers.read_cells(module.board, 12 * motor, 12)


def test_mixed_decay_is_used_above_its_threshold():
    module = switched_on()
    host = Host(module)
    assert (cells(module, 1)[0], cells(module, 1)[6]) == (0x10, 0x10)
    host.do("SAP 203, 1, 400")
    host.do("ROR 1, 600")
    host.wait_ms(20)
    assert (cells(module, 1)[0], cells(module, 1)[6]) == (0x10, 0x10)
    host.wait_ms(100)
    assert (cells(module, 1)[0], cells(module, 1)[6]) == (0x07, 0x0F)
    assert cells(module, 0)[0] == 0x10
    host.do("MST 1")
    host.wait_ms(200)
    assert (cells(module, 1)[0], cells(module, 1)[6]) == (0x10, 0x10)
    host.do("SAP 203, 1, -1")
    assert (cells(module, 1)[0], cells(module, 1)[6]) == (0x11, 0x11)


def test_full_current_is_used_above_the_full_step_threshold():
    module = switched_on()
    host = Host(module)
    fresh = cells(module, 0)
    host.do("SAP 211, 0, 700")
    host.do("ROR 0, 900")
    host.wait_ms(300)
    changed = cells(module, 0)
    assert changed[1:5] == changed[7:11] == bytes((0x11,)) * 4
    assert (changed[5], changed[11]) == (fresh[5], fresh[11])
    host.do("SAP 211, 0, 2048")
    assert cells(module, 0) == fresh


def test_stored_thresholds_work_from_power_on():
    module = switched_on()
    host = Host(module)
    host.do("SAP 203, 2, -1")
    host.do("STAP 203, 2")
    module.reset()
    assert cells(module, 2)[0] == 0x11


# Encoder


class Shaft:
    """A shaft without null channel that a test turns."""

    edges_per_turn = 4000
    null_level = None

    def __init__(self):
        self.place = 0

    def edges(self):
        return self.place


def with_encoders():
    module = switched_on()
    shafts = [Shaft() for _ in range(3)]
    module.board.attach_spi(1, Tmc423(shafts))
    host = Host(module)
    host.do("SGP 74, 0, 2")
    return module, host, shafts


def test_encoder_positions_are_read_written_and_scaled():
    _, host, shafts = with_encoders()
    for motor, shaft in enumerate(shafts):
        shaft.place = 100 * motor - 50
    assert [host.do(f"GAP 209, {motor}") for motor in range(3)] == [-50, 50, 150]
    host.do("SAP 209, 1, -8388608")
    assert host.do("GAP 209, 1") == -8388608
    host.do("SAP 210, 2, 1024")
    shafts[2].place += 10
    assert host.do("GAP 209, 2") == 170


def test_the_prescaler_is_sent_at_power_on():
    module, host, shafts = with_encoders()
    host.do("SAP 210, 0, 2048")
    host.do("STAP 210, 0")
    module.reset()
    before = host.do("GAP 209, 0")
    shafts[0].place += 10
    assert host.do("GAP 209, 0") - before == 40


def test_a_deviation_stops_the_motor_along_its_ramp_and_sets_the_flag():
    module, host, _ = with_encoders()
    host.do("SAP 212, 0, 500")
    host.do("ROR 0, 500")
    host.do("ROR 1, 500")
    host.wait_ms(10)
    assert not module.program.flags["EDV"]
    host.wait_ms(1000)
    assert [host.do(f"GAP 3, {motor}") for motor in (0, 1)] == [0, 500]
    assert 500 < host.do("GAP 1, 0") < 2500
    assert module.program.flags["EDV"]


def test_a_deviation_ends_a_reference_search():
    _, host, _ = with_encoders()
    host.do("SAP 212, 0, 500")
    host.do("RFS START, 0")
    host.wait_ms(1000)
    assert [host.do("RFS STATUS, 0"), host.do("GAP 3, 0")] == [0, 0]
    assert -2500 < host.do("GAP 1, 0") < -500


def test_a_shaft_that_follows_lets_the_motor_run():
    module, host, shafts = with_encoders()
    host.do("SAP 212, 0, 500")
    host.do("MVP ABS, 0, 30000")
    for _ in range(300):
        host.wait_ms(5)
        shafts[0].place = host.do("GAP 1, 0")
    assert host.do("GAP 1, 0") == 30000
    assert not module.program.flags["EDV"]


# SHUTDOWN


@pytest.mark.parametrize(("function", "active"), [(1, 1), (2, 0)])
def test_shutdown_stops_all_motors_at_once(function, active):
    module = switched_on()
    host = Host(module)
    module.board.set_shutdown(1 - active)
    host.do(f"SGP 80, 0, {function}")
    host.do("ROR 0, 1000")
    host.do("MVP ABS, 1, 1000000")
    host.wait_ms(500)
    assert not module.program.flags["ESD"]
    module.board.set_shutdown(active)
    host.wait_ms(5)
    assert [host.do(f"GAP 3, {motor}") for motor in (0, 1)] == [0, 0]
    assert module.program.flags["ESD"]
    host.do("ROR 0, 1000")
    host.wait_ms(100)
    assert host.do("GAP 3, 0") == 0
    module.board.set_shutdown(1 - active)
    host.wait_ms(5)
    host.do("ROR 0, 1000")
    host.wait_ms(500)
    assert host.do("GAP 3, 0") == 1000


def test_shutdown_at_power_on_counts():
    module = switched_on()
    Host(module).do("SGP 80, 0, 2")
    module.reset()
    run_until(module, module.now + 5 * MS)
    assert module.program.flags["ESD"]


def test_shutdown_ends_a_reference_search():
    module = switched_on()
    host = Host(module)
    host.do("SGP 80, 0, 1")
    host.do("RFS START, 1")
    host.wait_ms(200)
    module.board.set_shutdown(1)
    host.wait_ms(10)
    assert [host.do("RFS STATUS, 1"), host.do("GAP 3, 1")] == [0, 0]


def stall():
    host, motor = with_stall_detection()
    return host, lambda: setattr(motor, "load", 1.0)


def shut_down():
    module = switched_on()
    host = Host(module)
    host.do("SGP 80, 0, 1")
    return host, lambda: module.board.set_shutdown(1)


def deviate():
    _, host, shafts = with_encoders()
    host.do("SAP 212, 0, 30000")

    def leap():
        shafts[0].place += 200_000

    return host, leap


@pytest.mark.parametrize("after_us", [1, 2400, 4999])
@pytest.mark.parametrize("watched", [stall, shut_down, deviate])
def test_the_firmware_looks_at_multiples_of_5_ms(watched, after_us):
    host, happen = watched()
    module = host.module
    host.do("ROR 0, 500")
    run_until(module, 1000 * MS)
    run_until(module, 1000 * MS + after_us * MS // 1000)
    happen()
    assert module.axes[0].read(V_TARGET) == 500
    run_until(module, 1005 * MS - 1)
    assert module.axes[0].read(V_TARGET) == 500
    run_until(module, 1005 * MS)
    assert module.axes[0].read(V_TARGET) == 0


# Heartbeat


def test_silence_on_the_serial_ports_stops_the_motors_along_their_ramps():
    module = switched_on()
    host = Host(module)
    for line in ("SGP 68, 0, 200", "ROR 0, 1000", "MVP ABS, 1, 1000000"):
        host.do(line)
    for _ in range(10):
        host.wait_ms(150)
        assert host.do("GAP 138, 1") == 0
    host.wait_ms(199)
    assert [axis.moving for axis in module.axes] == [True, True, False]
    assert module.axes[0].at_target is False
    host.wait_ms(20)
    assert 0 < host.do("GAP 3, 0") < 1000
    host.wait_ms(199)
    assert [host.do(f"GAP {n}, {motor}") for motor in (0, 1) for n in (3, 138)] == [0, 2, 0, 2]


def test_only_commands_for_the_module_feed_the_heartbeat_on_any_port():
    module = switched_on()
    host, other, stranger = Host(module), Host(module), Host(module, address=2)
    host.do("SGP 68, 0, 200")
    host.do("ROR 0, 500")
    for _ in range(5):
        host.wait_ms(150)
        other.do("GAP 4, 0")
    assert module.axes[0].moving
    for _ in range(10):
        host.wait_ms(100)
        stranger.send(6, 4, 0, 0)
        host.port.receive(bytes(9)[:8] + b"\x01")
    assert not module.axes[0].moving


def test_the_heartbeat_waits_for_the_first_command():
    module = switched_on()
    host = Host(module)
    host.do("SGP 68, 0, 100")
    module.reset()
    motion.rotate(module, module.axes[0], 500)
    run_until(module, module.now + 1000 * MS)
    assert module.axes[0].values[4] == 1000
    assert host.do("GAP 3, 0") == 500
    run_until(module, module.now + 1000 * MS)
    assert host.do("GAP 3, 0") == 0


# Cost


def test_a_motor_that_moves_without_watches_makes_few_events():
    module = switched_on()
    Host(module).do("ROR 0, 500")
    events = 0
    while module.next_event() < 100_000 * MS:
        module.advance(module.next_event())
        events += 1
    assert events < 5
