"""What the rules report, and where."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from functools import cached_property
from typing import Final

from tmcm34x.tmcl.commands import Field
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.toolchain.assembler import Assembly, Code
from tmcm34x.toolchain.diagnostics import Diagnostic, Fix, Location
from tmcm34x.toolchain.entries import entries
from tmcm34x.toolchain.expressions import Operand, evaluate
from tmcm34x.toolchain.linter.rules import RULES, ignored_codes
from tmcm34x.toolchain.parser import ConstantDefinition, WrittenCommand
from tmcm34x.toolchain.tokens import Token

Numbered = list[tuple[int, Instruction]]
"""The instructions of a program with their addresses."""
_SEVERAL: Final = 3
"""Different parameters missing from the model make it likely that a program is for another one."""
_SIGNED: Final = 2
"""Steps of a number with its sign."""
_WRITTEN_FOR_ANOTHER: Final = "; was the program written for another module?"


class Findings:
    """The findings about one program, as they come.

    model: the module that it is for, 341, 342 or 343
    rules: those that are on
    """

    def __init__(self, assembly: Assembly, model: int, rules: frozenset[str]) -> None:
        self.assembly = assembly
        self.model = model
        self.rules = rules
        self.items: list[Diagnostic] = []
        self._gathered: dict[tuple[str, str], list[Location]] = {}

    @cached_property
    def entries(self) -> tuple[int, ...]:
        """Where the program may be started."""
        return entries(self.assembly)

    @cached_property
    def mistaken(self) -> frozenset[str]:
        """Words in lines with errors, in upper case: names that stand there may be used, whatever is wrong there.

        While an include file is missing, that holds for all names.
        """
        errors = [item for item in self.assembly.diagnostics if item.severity == "error"]
        if any(item.code in ("E501", "E503") for item in errors):
            return frozenset(self.assembly.symbols)
        lines = {(item.location.file, item.location.line) for item in errors}
        texts = (self.assembly.sources[file][line - 1].partition("//")[0] for file, line in lines)
        return frozenset(word.upper() for text in texts for word in re.findall(r"\w+", text))

    @cached_property
    def broken(self) -> frozenset[str]:
        """The constants whose value has a fraction, in upper case."""
        return frozenset(key for key, symbol in self.assembly.symbols.items() if symbol.value % 1)

    @cached_property
    def addresses_are_labels(self) -> bool:
        """Whether all jumps stay right when commands move: none goes to a number."""
        labels = {key for key, symbol in self.assembly.symbols.items() if symbol.kind == "label"}
        return all(
            isinstance(operand, Token) and operand.text.upper() in labels
            for code in self.assembly.code
            for operand in _addresses(code)
        )

    def report(self, code: str, location: Location, text: str, fixes: Iterable[Fix] = ()) -> None:
        """Add a finding, unless a comment on its line suppresses it."""
        if not self.ignored(code, location):
            self.items.append(Diagnostic(location, RULES[code].severity, code, text, tuple(fixes)))

    def gather(self, code: str, location: Location, text: str) -> None:
        """Add a finding that is reported once, at its first line, however often it occurs."""
        if not self.ignored(code, location):
            self._gathered.setdefault((code, text), []).append(location)

    def finish(self) -> None:
        """Report what was gathered, each with the number of further lines."""
        missing = len(self._gathered)
        for (code, text), places in self._gathered.items():
            more = len(places) - 1
            again = f"; {more} more line{'s' * (more > 1)}" if more else ""
            question = _WRITTEN_FOR_ANOTHER if missing >= _SEVERAL else ""
            self.report(code, places[0], text + again + question)
            missing = 0
        self._gathered.clear()

    def ignored(self, code: str, location: Location) -> bool:
        """Whether a rule is off, or a comment on the line suppresses it."""
        if code not in self.rules:
            return True
        line = self.assembly.lines[location.file][location.line - 1]
        if line.comment is None:
            return False
        ignored = ignored_codes(self.assembly.sources[location.file][location.line - 1][line.comment :])
        return ignored is None or code in ignored

    def exact_value(self, operand: Operand, *, literally: bool) -> float | None:
        """The value of an operand of an instruction before it is rounded.

        literally: only that of a number, or of a name that stands for one; None for an expression
        """
        named = isinstance(operand, Token) and operand.kind == "name" and self._names_a_number(operand)
        if literally and not (is_number(operand) or named):
            return None
        return evaluate(operand, lambda name: self.assembly.symbols[name.text.upper()].value)

    def _names_a_number(self, name: Token) -> bool:
        place = self.assembly.symbols[name.text.upper()].definition
        statement = self.assembly.lines[place.file][place.line - 1].statement
        return isinstance(statement, ConstantDefinition) and isinstance(statement.value, Token)


def is_number(operand: Operand) -> bool:
    """Whether an operand is a number as it stands there, with a minus or not."""
    if isinstance(operand, Token):
        return operand.kind == "number"
    return len(operand.steps) == _SIGNED and [step[0] for step in operand.steps] == ["number", "unary"]


def field_location(code: Code, field: Field) -> Location:
    """Where the operand for a field of the instruction stands; the whole command where it has none."""
    statement, row = code.line.statement, code.row
    if isinstance(statement, WrittenCommand) and row is not None:
        fields = (*(operand.field for operand in row.operands), *row.spare)
        index = fields.index(field)
        operand = statement.operands[index] if index < len(statement.operands) else None
        if operand is not None:
            return Location(code.location.file, code.location.line, operand.start + 1, operand.end + 1)
    return code.location


def _addresses(code: Code) -> Iterator[Operand | None]:
    """The operands of a command that are addresses; of a DATA line, which may hold one, None."""
    statement = code.line.statement
    if code.row is None:
        yield None
    elif isinstance(statement, WrittenCommand):
        for row, operand in zip(code.row.operands, statement.operands, strict=False):
            if row.kind == "address":
                yield operand


def name_of(code: Code) -> str:
    """The mnemonic at an address; empty for a DATA line."""
    return code.row.mnemonic if code.row is not None else ""
