"""What waits for a motor: zeroing, searches, coordinates, load profiles, settings kept one by one; on both drivers."""

from __future__ import annotations

import asyncio

import pytest

from host_rigs import connected, faulty, module_of
from tmcm34x.host import AsyncConnection, HostError, motion, settings
from tmcm34x.host.exceptions import NotReachedError
from tmcm34x.host.load_profile import measure
from tmcm34x.host.steps import value
from tmcm34x.tmcl.datagram import Instruction

LOST = "silent,probability=0.1"


@pytest.mark.parametrize("faults", [(), (LOST,)], ids=["good line", "bad line"])
def test_a_motor_is_zeroed_where_it_comes_to_rest(faults):
    connection = connected(faults=faulty(*faults, seed=4))
    connection.run(motion.send(Instruction(1, 0, 0, 500)))
    connection.wait(0.5)
    connection.run(motion.zero(0))
    axis = module_of(connection).axes[0]
    assert [connection.run(motion.send(Instruction(6, number))) for number in (0, 1, 3, 8)] == [0, 0, 0, 1]
    assert axis.at_target


def test_motors_are_at_their_coordinate_when_the_operation_ends():
    connection = connected()
    for motor, position in enumerate((1500, -700)):
        connection.run(value(Instruction(30, 3, motor, position)))
    connection.run(motion.go([0, 1], 3))
    assert [connection.run(value(Instruction(6, 1, motor))) for motor in (0, 1)] == [1500, -700]


def test_a_search_that_ends_too_late_goes_on_unless_it_belongs_to_home():
    connection = connected()
    with pytest.raises(NotReachedError, match=r"motor 0 has not found its reference point in 0\.1 s"):
        connection.run(motion.find_reference(0, 0.1))
    assert connection.run(motion.search(0, "STATUS"))
    with pytest.raises(NotReachedError):
        connection.run(motion.home(0, 0.1))
    assert not connection.run(motion.search(0, "STATUS"))


def test_a_load_profile_has_mean_and_deviation_of_each_velocity():
    connection = connected()
    found = []
    connection.run(measure(1, range(200, 401, 100), found.append))
    assert [load.velocity for load in found] == [200, 300, 400]
    assert all(load.mean >= 0 and load.deviation >= 0 for load in found)
    assert connection.run(value(Instruction(6, 3, 1))) == 400


def test_kept_settings_are_counted_where_one_is_refused():
    connection = connected()
    connection.run(value(Instruction(5, 4, 1, 777)))
    told = []
    connection.run(
        settings.keep("store", [(-1, 4, 0), (-1, 4, 1), (2, 7, 0)], lambda *done: told.append(done))
    )
    assert told == [(0, 3), (1, 3), (2, 3)]
    assert module_of(connection).eeprom.axis_values[1][4] == 777
    with pytest.raises(HostError, match=r"STAP 1, 0: status 3, .*; 1 of 2 values are stored in the EEPROM"):
        connection.run(settings.keep("store", [(-1, 4, 0), (-1, 1, 0)]))
    connection.run(value(Instruction(5, 4, 1, 1)))
    connection.run(settings.keep("restore", [(-1, 4, 1)]))
    assert connection.run(value(Instruction(6, 4, 1))) == 777


def test_the_same_operations_are_awaited():
    async def run():
        async with await AsyncConnection.open("virtual:343") as connection:
            await connection.run(motion.send(Instruction(1, 0, 2, 300)))
            await connection.run(motion.zero(2))
            found = []
            await connection.run(measure(2, [200], found.append))
            await connection.run(settings.keep("store", [(-1, 4, 2)]))
            return found

    (load,) = asyncio.run(run())
    assert load.velocity == 200
