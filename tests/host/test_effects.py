"""What may set a motor in motion, held against the module: nothing else does."""

from __future__ import annotations

from copy import copy

import pytest

from tmcm34x.bench import simple_rig
from tmcm34x.clock import MS, run_until
from tmcm34x.firmware.axis import V_ACTUAL, V_TARGET
from tmcm34x.host.effects import moves
from tmcm34x.tmcl.commands import BY_MNEMONIC
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.numbers import CONTROL

OF_PARAMETERS = {BY_MNEMONIC[name].number for name in ("SAP", "AAP", "RSAP", "SGP", "AGP", "RSGP")}
LOOK_MS = 60
VALUE = 500


@pytest.fixture(scope="module")
def rig():
    """With a coordinate away from where the motors are."""
    rig = simple_rig(343)
    rig.modules[0].execute(Instruction(BY_MNEMONIC["SCO"].number, 3, 0, 7000))
    return rig


@pytest.mark.parametrize("number", [n for n in range(256) if n != CONTROL.RESTORE_FACTORY_SETTINGS])
def test_a_command_that_is_said_not_to_move_moves_nothing(rig, number):
    for type_ in range(256) if number in OF_PARAMETERS else range(4):
        instruction = Instruction(number, type_, 0, VALUE)
        if moves(instruction):
            continue
        other = copy(rig)
        module = other.modules[0]
        module.execute(instruction)
        run_until(other, other.now + LOOK_MS * MS)
        speeds = [axis.read(register) for axis in module.axes for register in (V_ACTUAL, V_TARGET)]
        assert speeds == [0] * 6, instruction
