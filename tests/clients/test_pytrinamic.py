"""The vendor's own host library, unmodified, against `tmcm34x serve`."""

from contextlib import contextmanager
from random import Random

import pytest
from pytrinamic.connections import ConnectionManager
from pytrinamic.modules import TMCM3110
from pytrinamic.tmcl import TMCLReplyStatusError

from tmcm34x.host import Connection, Module

SPEED = 20
"""Virtual seconds per second: moves need not take long."""

ACTUAL, SPEED_NOW, MAX_SPEED, MAX_ACCELERATION, REACHED = 1, 3, 4, 5, 8
RAMP_DIV, PULSE_DIV = 153, 154
TICK_TIMER = 132
USER_BANK = 2


@pytest.fixture(scope="module")
def served(serve_once):
    """One module on both links."""
    return serve_once("--pty", "--tcp", 0, "--speed", SPEED)


@pytest.fixture(scope="module")
def slow(serve_once):
    """A module slow enough for a host to see every millisecond."""
    return serve_once("--tcp", 0, "--speed", 4)


@contextmanager
def connected(served, kind):
    """A PyTrinamic connection to a module as it left the factory."""
    with Connection.open(served.tcp, timeout=0.05, retries=1000) as connection:
        module = Module(connection)
        module.restore_factory_settings()  # not answered; and what comes while it restarts is lost
        assert module.tick_timer >= 0
    port = served.pty if kind == "serial_tmcl" else served.tcp
    with ConnectionManager(f"--interface {kind} --port {port} --timeout 60").connect() as connection:
        yield connection


@pytest.fixture(params=["serial_tmcl", "socket_serial_tmcl"])
def interface(request, served):
    """A connection over each of the links."""
    with connected(served, request.param) as connection:
        yield connection


@pytest.fixture
def close_look(slow):
    """A connection to the slow module."""
    with connected(slow, "socket_serial_tmcl") as connection:
        yield connection


def ask_until(condition):
    """Ask without a pause until it holds; the number of questions is bounded."""
    assert any(condition() for _ in range(20_000))


def at_rest(interface, axis, position):
    """Whether a motor stands there."""
    return (
        interface.get_axis_parameter(ACTUAL, axis, signed=True) == position
        and interface.get_axis_parameter(SPEED_NOW, axis, signed=True) == 0
    )


def test_version_string(interface):
    assert interface.get_version_string() == "343V4.36\x00"[:8]


def test_axis_parameters_are_written_and_read(interface):
    for axis in range(3):
        interface.set_axis_parameter(MAX_SPEED, axis, 500 + axis)
    assert [interface.get_axis_parameter(MAX_SPEED, axis) for axis in range(3)] == [500, 501, 502]


def test_a_negative_position_is_read_signed(interface):
    interface.stop(0)  # in position mode it would move back to its target at once
    interface.set_axis_parameter(ACTUAL, 0, -12345)
    assert interface.get_axis_parameter(ACTUAL, 0, signed=True) == -12345


def test_axis_parameters_are_stored_and_restored(interface):
    interface.set_axis_parameter(MAX_ACCELERATION, 1, 300)
    interface.store_axis_parameter(MAX_ACCELERATION, 1)
    interface.set_axis_parameter(MAX_ACCELERATION, 1, 400)
    interface.restore_axis_parameter(MAX_ACCELERATION, 1)
    assert interface.get_axis_parameter(MAX_ACCELERATION, 1) == 300


def test_global_parameters_and_user_variables(interface):
    assert interface.get_global_parameter(66, 0) == 1
    interface.set_global_parameter(42, USER_BANK, -7)
    assert interface.get_global_parameter(42, USER_BANK, signed=True) == -7
    interface.store_global_parameter(42, USER_BANK)
    interface.set_global_parameter(42, USER_BANK, 8)
    interface.restore_global_parameter(42, USER_BANK)
    assert interface.get_global_parameter(42, USER_BANK, signed=True) == -7


def test_a_move_to_a_position_ends_there(interface, wait_for):
    assert interface.move_to(0, 20_000) == 20_000
    assert wait_for(lambda: interface.get_axis_parameter(REACHED, 0))
    assert wait_for(lambda: at_rest(interface, 0, 20_000))


def test_a_move_by_a_distance_starts_at_the_actual_position(interface, wait_for):
    interface.stop(2)
    interface.set_axis_parameter(ACTUAL, 2, 1000)
    interface.move_by(2, -4000)
    assert wait_for(lambda: interface.get_axis_parameter(REACHED, 2))
    assert wait_for(lambda: at_rest(interface, 2, -3000))


@pytest.mark.parametrize(
    ("max_acceleration", "ramp_div", "pulse_div"),
    [
        (1000, 7, 3),
        (500, 7, 3),
        (100, 7, 3),
        (2047, 7, 3),
        (2047, 4, 4),
        (500, 3, 2),
        (1000, 5, 4),
        (50, 3, 3),
        (300, 8, 5),
    ],
)
def test_every_move_reads_its_target_when_it_is_reached_and_2_ms_later(
    close_look, max_acceleration, ramp_div, pulse_div
):
    interface = close_look
    random = Random(max_acceleration)
    for axis in range(3):
        for number, value in (
            (MAX_ACCELERATION, max_acceleration),
            (RAMP_DIV, ramp_div),
            (PULSE_DIV, pulse_div),
        ):
            interface.set_axis_parameter(number, axis, value)
    for _ in range(12):
        targets = [random.randint(-300, 300) for _ in range(3)]
        for axis, target in enumerate(targets):
            interface.move_to(axis, target)
            ask_until(lambda axis=axis: interface.get_axis_parameter(REACHED, axis))
            assert interface.get_axis_parameter(ACTUAL, axis, signed=True) == target
            reached_ms = interface.get_global_parameter(TICK_TIMER, 0)
            ask_until(lambda since=reached_ms: interface.get_global_parameter(TICK_TIMER, 0) >= since + 2)
            assert interface.get_axis_parameter(REACHED, axis) == 1
            assert at_rest(interface, axis, target)


def test_a_hundred_chained_moves_do_not_drift(close_look):
    for _ in range(100):
        close_look.move_by(0, 320)
        ask_until(lambda: close_look.get_axis_parameter(REACHED, 0))
    assert at_rest(close_look, 0, 32_000)


def test_rotation_reaches_its_speed_and_stops(interface, wait_for):
    interface.rotate(1, -600)
    assert wait_for(lambda: interface.get_axis_parameter(SPEED_NOW, 1, signed=True) == -600)
    interface.stop(1)
    assert wait_for(lambda: interface.get_axis_parameter(SPEED_NOW, 1) == 0)
    assert interface.get_axis_parameter(ACTUAL, 1, signed=True) < 0


def test_outputs_and_inputs(interface):
    interface.set_digital_output(3)
    assert interface.get_digital_output(3) == 1
    interface.clear_digital_output(3)
    assert interface.get_digital_output(3) == 0
    assert interface.get_digital_input(0) in {0, 1}
    assert 0 <= interface.get_analog_input(0) <= 1023


@pytest.mark.parametrize(
    ("call", "status"),
    [
        (lambda host: host.get_axis_parameter(77, 0), 3),
        (lambda host: host.set_axis_parameter(MAX_SPEED, 0, 2048), 4),
        (lambda host: host.get_axis_parameter(MAX_SPEED, 3), 4),
        (lambda host: host.send(99, 0, 0, 0), 2),
    ],
)
def test_refusals_raise_status_errors(interface, call, status):
    with pytest.raises(TMCLReplyStatusError) as caught:
        call(interface)
    assert caught.value.status_code == status


def test_the_class_of_the_nearest_module_drives_three_axes(interface, wait_for):
    """There is no class for a TMCM-34x; TMCM-3110 has the same numbers for what both have."""
    module = TMCM3110(interface)
    for motor in module.motors:
        motor.linear_ramp.max_velocity = 1500
        motor.linear_ramp.max_acceleration = 800
        motor.drive_settings.max_current = 200
        motor.drive_settings.standby_current = 20
    module.move_to(0, 30_000)
    module.move_by(1, -15_000)
    module.rotate(2, 700)
    assert wait_for(
        lambda: module.motors[0].get_position_reached() and module.motors[1].get_position_reached()
    )
    assert wait_for(lambda: at_rest(interface, 0, 30_000))
    assert module.motors[1].actual_position == -15_000
    assert module.motors[2].actual_velocity == 700
    module.stop(2)
    assert wait_for(lambda: module.motors[2].actual_velocity == 0)
    assert module.motors[0].drive_settings.max_current == 200
