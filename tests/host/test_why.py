"""Why a motor does not turn."""

import pytest

from host_rigs import connected, faulty
from tmcm34x.bench import simple_rig
from tmcm34x.host import Module, why
from tmcm34x.host.program import download, run
from tmcm34x.host.reading import Value
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.mnemonic import parse_instruction


def lines(connection, motor=0, *, model=343, drivers=False):
    return [reason.line for reason in why.reasons(connection.run(why.read(motor, model, drivers=drivers)))]


@pytest.fixture
def module():
    return Module(connected())


@pytest.mark.parametrize(
    ("prepare", "shown", "change"),
    [
        ("SAP 4, 0, 0", "axis parameter 4 is 0", "SAP 4, 0, 500"),
        ("SAP 5, 0, 0", "axis parameter 5 is 0", "SAP 5, 0, 500"),
        ("SAP 6, 0, 0", "axis parameter 6 is 0", "SAP 6, 0, 128"),
        ("SAP 204, 0, 50", "axis parameter 204 is 50", "SAP 204, 0, 0"),
        ("SGP 73, 0, 1234", "global parameter 73 is 1", "SGP 73, 0, 4321"),
        ("MST 0", "axis parameter 2 is 0, 138 is 2", "ROR 0, 500"),
        ("GAP 1, 0", "axis parameters 0 and 1 are 0", "MVP ABS, 0, POSITION"),
    ],
)
def test_each_reason_names_the_parameter_and_the_command(module, prepare, shown, change):
    module.connection.execute(parse_instruction(prepare))
    assert any(shown in line and change in line for line in lines(module.connection))


def test_a_closed_switch_matters_only_in_its_direction(module):
    facts = module.connection.run(why.read(0, 343))
    facts.readings |= {"right_switch": Value(1), "target_position": Value(1000)}
    assert any("The right switch is closed" in reason.text for reason in why.reasons(facts))
    facts.readings |= {"target_position": Value(-1000)}
    assert not any("switch is closed" in reason.text for reason in why.reasons(facts))


def test_groups_name_the_others(module):
    module.axes[0].group_index = module.axes[2].group_index = 5
    assert any("Motor 2 and this one are in group 5" in line for line in lines(module.connection))
    assert not any("group" in line for line in lines(module.connection, 1))


def test_a_running_program_and_a_search_are_named(module):
    module.connection.run(download([Instruction(22)]))
    module.connection.run(run())
    assert any("The stand-alone program is running" in line for line in lines(module.connection))


def test_a_motor_that_turns_has_no_reasons(module):
    module.axes[0].rotate(500)
    module.connection.wait(0.5)
    assert lines(module.connection) == []


def test_what_the_module_does_not_tell_is_no_zero():
    """A current that cannot be read is not "0", and is listed as unknown."""
    connection = connected(faults=faulty("status=3"))
    facts = connection.run(why.read(0, 343))
    assert not any("current" in reason.text for reason in why.reasons(facts))
    assert any(line.startswith("max_current: refused: status 3") for line in why.unknown(facts))


def test_a_model_without_current_is_not_told_that_it_is_zero():
    connection = connected(simple_rig(342))
    assert not any("current" in line for line in lines(connection, model=342))
    assert why.unknown(connection.run(why.read(0, 342))) == []


def test_looking_does_not_act(module):
    """Neither load nor driver flags are read unless asked for."""
    seen = []
    module.connection.listeners.append(lambda sent, data: seen.append(data[1:3]) if sent else None)
    lines(module.connection)
    assert not {bytes((6, number)) for number in (206, 208)} & set(seen)
    lines(module.connection, drivers=True)
    assert {bytes((6, number)) for number in (206, 208)} <= set(seen)
