"""pylablib under test: a library for laboratories, which takes the module for a TMCM-1110 on USB."""

import pytest

Trinamic = pytest.importorskip("pylablib.devices.Trinamic")  # pip install pylablib-lightweight


@pytest.fixture
def stage(tmcm34x_factory):
    module = tmcm34x_factory(343, any_address=True)
    with Trinamic.TMCM1110(module.port) as stage:
        yield stage, module


def test_it_moves(stage):
    device, module = stage
    device.move_to(5000)
    device.wait_move()
    assert device.get_position() == module.motor(0).position == 5000


def test_it_jogs_and_stops(stage):
    device, module = stage
    device.jog("+")
    module.run(1)
    assert module.motor(0).moving
    device.stop()
    module.run(1)
    assert not module.motor(0).moving
