"""Names in code are those of the rows."""

from tmcm34x.tmcl import axis_parameters, commands, global_parameters
from tmcm34x.tmcl.numbers import AP, COMMAND, CONTROL, GP


def names(space):
    return {name: value for name, value in vars(space).items() if name.isupper()}


def test_every_axis_parameter_has_its_name():
    rows = (*axis_parameters.AXIS_PARAMETERS, *axis_parameters.LATER_AXIS_PARAMETERS)
    assert names(AP) == {row.key.upper(): row.number for row in rows}


def test_every_global_parameter_of_bank_0_has_its_name():
    rows = (*global_parameters.GLOBAL_PARAMETERS, *global_parameters.LATER_GLOBAL_PARAMETERS)
    expected = {row.key.upper(): row.number for row in rows if row.bank == 0}
    for table in ("DRIVER_CHAIN", "MICROSTEP_TABLE"):
        for n in range(1, 16):
            del expected[f"{table}_{n}"]
    assert names(GP) == expected


def test_every_command_has_its_name():
    assert names(COMMAND) == {"END": 0} | {row.mnemonic: row.number for row in commands.COMMANDS}


def test_every_control_function_has_its_name():
    rows = (*commands.CONTROL_FUNCTIONS, commands.BOOT_FUNCTION)
    assert names(CONTROL) == {row.key.upper(): row.number for row in rows}
