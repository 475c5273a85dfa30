"""The second pass of the assembler: fills the fields of instructions by the rows of `tmcl.commands`."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final, NamedTuple

from tmcm34x.tmcl.commands import BY_MNEMONIC, SISTER_COMMANDS
from tmcm34x.tmcl.commands import Command as CommandRow
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.toolchain import sisters
from tmcm34x.toolchain.assembly import Code
from tmcm34x.toolchain.diagnostics import article, did_you_mean, one_of, shown
from tmcm34x.toolchain.expressions import Operand, SourceExpressionError, evaluate
from tmcm34x.toolchain.first_pass import Pending
from tmcm34x.toolchain.mending import words as meanings
from tmcm34x.toolchain.mending.spelling import limit
from tmcm34x.toolchain.messages import Messages
from tmcm34x.toolchain.names import Names, only
from tmcm34x.toolchain.parser import Data, WrittenCommand, is_not
from tmcm34x.toolchain.tokens import Token, make

_FIELDS: Final = {"type": 1, "motor": 2, "value": 3}
"""Places of the fields in an `Instruction`."""
_VALUE: Final = _FIELDS["value"]
_BYTE: Final = 255
_SMALL: Final = {str(number): number for number in range(_BYTE + 1)}
"""Numbers that fit into every field, as most are written."""
_DATA_FIELDS: Final = ("number", "type", "motor", "value")


class _Shape(NamedTuple):
    """A row of the command table as this pass needs it: by operands and spare numbers in source order."""

    row: CommandRow
    required: int
    places: tuple[tuple[int, Mapping[str, int] | None, bool], ...]
    """Of each one: the field it fills, its words if it has any, and whether it is an address."""


def _shape(row: CommandRow) -> _Shape:
    operands = [(_FIELDS[o.field], dict(o.words) or None, o.kind == "address") for o in row.operands] + [
        (_FIELDS[name], None, False) for name in row.spare
    ]
    return _Shape(row, sum(o.required for o in row.operands), tuple(operands))


_SHAPES: Final = MappingProxyType({mnemonic: _shape(row) for mnemonic, row in BY_MNEMONIC.items()})


class SecondPass:
    """Makes instructions of statements."""

    def __init__(self, messages: Messages, names: Names) -> None:
        self._messages = messages
        self._names = names

    def encode(self, item: Pending) -> Code:
        """The code of a statement; without an instruction where it has mistakes, which are reported."""
        statement, file, number, line = item
        self._messages.file, self._messages.number = file, number
        if isinstance(statement, Data):
            return Code(None, self._data(statement), file, number, line)
        shape = _SHAPES.get(statement.mnemonic.upper())
        if shape is None:
            self._unknown_command(statement)
            return Code(None, None, file, number, line)
        instruction = self._command(statement, shape, whole=not line.problems)
        return make(Code, (shape.row, instruction, file, number, line))

    def _command(self, statement: WrittenCommand, shape: _Shape, *, whole: bool) -> Instruction | None:
        operands, places = statement.operands, shape.places
        if not (shape.required <= len(operands) <= len(places) or self._right_count(statement, shape, whole)):
            self._names.note(operands)
            return None
        fields: list[int | None] = [shape.row.number, 0, 0, 0]
        for operand, (field, words, address) in zip(operands, places, strict=False):
            if type(operand) is Token and operand.text in _SMALL and words is None:
                fields[field] = _SMALL[operand.text]
            elif words is None:
                fields[field] = self._integer(operand, field, address)
            else:
                fields[field] = self._word(operand, words, shape.row)
        return None if None in fields else make(Instruction, tuple(fields))

    def _data(self, statement: Data) -> Instruction | None:
        operands = statement.operands
        if len(operands) != len(_DATA_FIELDS):
            text = f"DATA takes four numbers: {', '.join(_DATA_FIELDS)}"
            self._messages.report("E103", statement.start, statement.end, text)
            return None
        fields = [self._integer(operand, index, address=False) for index, operand in enumerate(operands)]
        return None if None in fields else make(Instruction, tuple(fields))

    # Operands

    def _word(self, operand: Operand | None, words: Mapping[str, int], row: CommandRow) -> int | None:
        if operand is None:
            return None
        written = operand.text.upper() if isinstance(operand, Token) else ""
        value = words.get(written)
        if value is None:
            meant = meanings.WORDS.get(row.mnemonic, {}).get(written)
            most = max(1, limit(written))
            near = (meant,) if meant is not None else self._messages.near(written, words, most)
            text = f"{row.mnemonic} takes {one_of(words)} here{did_you_mean(near)}"
            self._messages.report("E205", operand.start, operand.end, text, only(near))
        return value

    def _integer(self, operand: Operand | None, field: int, address: bool) -> int | None:
        if operand is None:
            return None
        try:
            value = self._value(operand, address)
        except SourceExpressionError as error:
            self._messages.error(error)
            return None
        return None if value is None else self._fitting(operand, value, field)

    def _value(self, operand: Operand, address: bool) -> float | None:
        """The value of an operand; None where it is reported as something else that was meant."""
        if not address:
            return evaluate(operand, self._names.constant)
        if isinstance(operand, Token):
            return evaluate(operand, self._names.address)
        if self._messages.repaired():
            self._names.note((operand,))
            return None
        return evaluate(operand, self._names.constant)

    def _fitting(self, operand: Operand, value: float, field: int) -> int | None:
        """A value as its field holds it; reports one that does not fit."""
        low, high = (-(2**31), 2**32 - 1) if field == _VALUE else (0, _BYTE)
        number = round(value) if low - 0.5 <= value <= high + 0.5 else high + 1
        if low <= number <= high:
            return number - 2**32 if number >= 2**31 else number
        self._messages.report(
            "E206", operand.start, operand.end, f"{value:.15g} does not fit: {low} to {high}"
        )
        return None

    # Commands that are none

    def _right_count(self, statement: WrittenCommand, shape: _Shape, whole: bool) -> bool:
        """Whether another number of operands than the row's is still right; reports when not.

        whole: nothing was reported of the line yet
        """
        row, operands = shape.row, statement.operands
        if row is _CALC and len(operands) == 1 and is_not(operands[0]):
            return True
        if not whole or self._messages.repaired():
            return False
        if len(operands) > len(shape.places):
            extra = operands[len(shape.places)]
            start = extra.start if extra is not None else statement.start
            text = f"too many operands for {row.mnemonic}: {row.syntax}"
            self._messages.report("E204", start, statement.end, text)
        else:
            text = f"{row.mnemonic} needs {article(row.operands[len(operands)].name)}: {row.syntax}"
            self._messages.report("E203", statement.start, statement.end, text)
        return False

    def _unknown_command(self, statement: WrittenCommand) -> None:
        self._names.note(statement.operands)
        name, start = statement.mnemonic.upper(), statement.start
        end = min(start + len(name), statement.end)
        number = SISTER_COMMANDS.get(name)
        if number is not None:
            owner, instead = sisters.COMMANDS[name]
            text = f"{name} (command {number}) is of other TMCL firmware: {owner}; a TMCM-34x has {instead}"
            self._messages.report("E202", start, end, text)
            return
        hint = "" if statement.operands else "; a label ends with ':'"
        self._messages.report("E201", start, end, f"no command {shown(statement.mnemonic)}{hint}")


_CALC: Final = BY_MNEMONIC["CALC"]
