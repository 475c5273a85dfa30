"""Which lines are whole: what a repair must lead to."""

from __future__ import annotations

from typing import Final, TypeGuard

from tmcm34x.tmcl import axis_parameters, global_parameters
from tmcm34x.tmcl.commands import BY_MNEMONIC
from tmcm34x.tmcl.commands import Operand as OperandRow
from tmcm34x.toolchain import parser
from tmcm34x.toolchain.tokens import Token

_DATA_OPERANDS: Final = 4
_DIGITS: Final = 11
"""Numbers of so many digits fit into no field."""


def sound(line: parser.SourceLine) -> bool:
    """Whether a line is whole: a command with as many operands as it takes, its words among them."""
    statement = line.statement
    if line.problems:
        return False
    if isinstance(statement, parser.Data):
        return len(statement.operands) == _DATA_OPERANDS
    return not isinstance(statement, parser.WrittenCommand) or _whole(statement)


def _whole(statement: parser.WrittenCommand) -> bool:
    row, given = BY_MNEMONIC.get(statement.mnemonic.upper()), statement.operands
    if row is None:
        return False
    required = sum(operand.required for operand in row.operands)
    alone = row.mnemonic == "CALC" and len(given) == 1 and parser.is_not(given[0])
    if not (required <= len(given) <= len(row.operands) + len(row.spare) or alone):
        return False
    return all(_takes(operand, written) for operand, written in zip(row.operands, given, strict=False))


def _takes(operand: OperandRow, written: object) -> bool:
    if operand.kind == "word":
        return isinstance(written, Token) and written.text.upper() in dict(operand.words)
    return operand.kind != "address" or isinstance(written, Token)


def suits(line: parser.SourceLine) -> bool:
    """Whether the plain numbers of a sound line are such as its command takes."""
    statement = line.statement
    if not sound(line) or not isinstance(statement, parser.WrittenCommand):
        return False
    row = BY_MNEMONIC[statement.mnemonic.upper()]
    numbers = [
        (o, int(w.text)) for o, w in zip(row.operands, statement.operands, strict=False) if _is_plain(w)
    ]
    parameter = next((value for operand, value in numbers if operand.field == "type"), -1)
    return len(statement.operands) <= len(row.operands) and all(
        _suits(operand, value, row.operands[0], parameter) for operand, value in numbers
    )


def _is_plain(written: object) -> TypeGuard[Token]:
    return isinstance(written, Token) and written.text.isdecimal() and len(written.text) < _DIGITS


def _suits(operand: OperandRow, value: int, first: OperandRow, parameter: int) -> bool:
    """Whether a number can be right for an operand; `parameter` is the number of the parameter, if there is one."""
    if operand.kind == "bank" and first.kind == "global_parameter":
        return parameter < 0 or (value, parameter) in global_parameters.BY_NUMBER
    known = operand.kind != "axis_parameter" or value in axis_parameters.BY_NUMBER
    return known and operand.low <= value <= operand.high
