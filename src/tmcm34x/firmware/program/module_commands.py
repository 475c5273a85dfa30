"""What the commands are that are no register commands: which a program alone has, and which read.

Source: the columns `where` of `tmcl.commands`; fidelity PROG-11, PROG-18.
"""

from __future__ import annotations

from typing import Final

from tmcm34x.tmcl.commands import BY_MNEMONIC, BY_NUMBER, MOTORS, RFS_TYPES
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.status import Status

STOP: Final = BY_MNEMONIC["STOP"].number
WAIT: Final = BY_MNEMONIC["WAIT"].number
_GCO: Final = BY_MNEMONIC["GCO"].number
_RFS: Final = BY_MNEMONIC["RFS"].number
_RFS_STATUS: Final = dict(RFS_TYPES)["STATUS"]
PROGRAM_ONLY: Final = frozenset(row.number for row in BY_MNEMONIC.values() if "direct" not in row.where)
_READING: Final = frozenset(row.number for row in BY_MNEMONIC.values() if "reads" in row.where)


def reads(instruction: Instruction) -> bool:
    """Whether the command's value goes to the accumulator."""
    number, type_, motor, _ = instruction
    if number == _RFS:
        return type_ == _RFS_STATUS
    return number in _READING and not (number == _GCO and motor >= MOTORS)


def misuse(instruction: Instruction) -> Status:
    """Why a command for programs alone is refused: its type, or else its value is out of range."""
    operands = BY_NUMBER[instruction.number].operands
    types = [operand for operand in operands if operand.field == "type"]
    right = all(operand.low <= instruction.type <= operand.high for operand in types)
    return Status.INVALID_VALUE if right else Status.WRONG_TYPE
