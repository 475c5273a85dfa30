"""pytmcl, unmodified, against `tmcm34x serve`."""

import threading

import pytest
import pyTMCL
import serial


@pytest.fixture
def bus(serve):
    """A pytmcl bus on the pseudo terminal of a fresh module, twenty times as fast as real ones."""
    with serial.Serial(serve("--pty", "--speed", 20).pty, 9600, timeout=60) as port:
        yield pyTMCL.connect(port)


def test_parameters_and_variables(bus):
    motor = bus.get_module(1).get_motor(1)
    motor.axis.max_positioning_speed = 700
    assert motor.axis.max_positioning_speed == 700
    motor.set_user_var(3, -99)
    assert motor.get_user_var(3) == -99


def test_the_callback_comes_when_the_position_is_reached(bus, wait_for):
    motor = bus.get_motor(1, 0)
    reached = threading.Event()
    assert motor.move_absolute(-15_000, callback=reached.set) == 100
    assert reached.wait(10)
    motor.trigger_thread.join()
    assert wait_for(lambda: motor.axis.actual_position == -15_000 and motor.axis.actual_speed == 0)
    motor.move_relative(500, callback=reached.clear)
    motor.trigger_thread.join(10)
    assert not reached.is_set()
    assert wait_for(lambda: motor.axis.actual_position == -14_500 and motor.axis.actual_speed == 0)


def test_rotation_and_stop(bus, wait_for):
    motor = bus.get_motor(1, 2)
    motor.rotate_left(400)
    assert wait_for(lambda: motor.axis.actual_speed == -400)
    motor.stop()
    assert wait_for(lambda: motor.axis.actual_speed == 0)


def test_a_refusal_raises_its_exception(bus):
    with pytest.raises(pyTMCL.reply.TrinamicException, match="Wrong Type"):
        bus.get_motor(1, 0).axis.get(77)
