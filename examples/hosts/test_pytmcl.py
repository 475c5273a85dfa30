"""pytmcl under test, on a serial port."""

import pytest
import serial

pyTMCL = pytest.importorskip("pyTMCL")


def test_it_moves(tmcm343):
    with serial.Serial(tmcm343.port, timeout=3) as port:
        motor = pyTMCL.connect(port).get_motor(1, 0)
        motor.move_absolute(-15000)
        while not motor.axis.target_position_reached:
            pass
    assert tmcm343.motor(0).position == -15000


def test_it_raises_on_a_refusal(tmcm343):
    with serial.Serial(tmcm343.port, timeout=3) as port:
        motor = pyTMCL.connect(port).get_motor(1, 0)
        with pytest.raises(pyTMCL.reply.TrinamicException, match="Wrong Type"):
            motor.axis.get(77)
