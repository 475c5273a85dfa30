"""What the linter says of an operand is what the module answers."""

import pytest

from firmware.programs import module_with
from tmcm34x.tmcl import axis_parameters, global_parameters
from tmcm34x.tmcl.commands import BY_MNEMONIC, COMMANDS
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.mnemonic import format_instruction
from tmcm34x.tmcl.status import Status
from tmcm34x.toolchain.assembler import assemble
from tmcm34x.toolchain.linter import lint

REFUSED = frozenset({"W301", "W303", "W304", "W305", "W306", "W307"})
MVP = BY_MNEMONIC["MVP"].number
RELATIVE = 1
FINE = (Status.OK, Status.LOADED)


def edges(low, high):
    return sorted({low - 1, low, high, high + 1})


def values(operand):
    return edges(operand.low, operand.high) if operand.kind == "number" else [0]


def cases(row):
    """Instructions at the edges of what a command takes."""
    first = row.operands[0]
    if first.kind == "axis_parameter":
        for parameter in axis_parameters.AXIS_PARAMETERS:
            if parameter.key == "encoder_position":  # the answer depends on the encoder
                continue
            for value in edges(parameter.low, parameter.high) if row.mnemonic == "SAP" else [0]:
                yield Instruction(row.number, parameter.number, 0, value)
        yield Instruction(row.number, 141, 0, 0)
        yield Instruction(row.number, 4, 3, 0)
    elif first.kind == "global_parameter":
        for parameter in global_parameters.GLOBAL_PARAMETERS:
            if parameter.bank == 0 or parameter.number in (0, 55):
                for value in edges(parameter.low, parameter.high) if row.mnemonic == "SGP" else [0]:
                    yield Instruction(row.number, parameter.number, parameter.bank, value)
        yield from (
            Instruction(row.number, 56, 2, 0),
            Instruction(row.number, 72, 0, 0),
            Instruction(row.number, 0, 1, 0),
        )
    elif first.kind == "word":
        for _, number in first.words:
            for motor in (0, 2, 3):
                for value in (0, 20, 21, 8388607, 8388608, -8388608, -8388609, 16777215, 16777216):
                    yield Instruction(row.number, number, motor, value)
    elif first.kind == "coordinate":
        for number in (0, 20, 21):
            for motor in (0, 2, 3):
                for value in values(row.operands[-1]):
                    yield Instruction(row.number, number, motor, value)
    elif first.kind == "motor":
        for motor in (0, 2, 3):
            for value in values(row.operands[-1]):
                yield Instruction(row.number, 0, motor, value)
    elif first.kind == "port":
        for port in (0, 7, 8, 10, 255):
            for bank in (0, 1, 2, 3):
                for value in (0, 1, 2, 255) if row.mnemonic == "SIO" else (0,):
                    yield Instruction(row.number, port, bank, value)


def judged(instruction):
    assembly = assemble(format_instruction(instruction))
    assert assembly.program == (instruction,)
    return REFUSED & {item.code for item in lint(assembly)}


def fits(instruction):
    """Whether it is an instruction, and no offset that depends on where the motor is."""
    if instruction.number == MVP and instruction.type == RELATIVE and 2**23 <= abs(instruction.value) < 2**24:
        return False
    return (
        0 <= instruction.type <= 255
        and 0 <= instruction.motor <= 255
        and -(2**31) <= instruction.value < 2**31
    )


STATE = {"AAP", "AGP", "STGP", "RSGP"}
"""Commands whose answer depends on the accumulator, or that accept what has nothing to store."""
ROWS = [
    row for row in COMMANDS
    if "direct" in row.where and row.operands and row.number < 64 and row.mnemonic not in STATE
]  # fmt: skip


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.mnemonic)
def test_the_module_refuses_what_the_linter_warns_of_and_nothing_else(row):
    wrong = []
    for instruction in filter(fits, cases(row)):
        status, _ = module_with().execute(instruction)
        if (status in FINE) != (not judged(instruction)):
            wrong.append((format_instruction(instruction), Status(status).name, sorted(judged(instruction))))
    assert wrong == []
