"""The first pass of the assembler: walks lines and files, gives addresses to instructions and values to names."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

from tmcm34x.toolchain.diagnostics import shown
from tmcm34x.toolchain.expressions import SourceExpressionError, evaluate
from tmcm34x.toolchain.includes import standard
from tmcm34x.toolchain.mending.columns import moved
from tmcm34x.toolchain.mending.files import mend
from tmcm34x.toolchain.mending.text import changed
from tmcm34x.toolchain.messages import Messages
from tmcm34x.toolchain.names import Names
from tmcm34x.toolchain.parser import ConstantDefinition, Data, Directive, Include, SourceLine, WrittenCommand
from tmcm34x.toolchain.structure import MODEL, holds, local_labels
from tmcm34x.toolchain.tokens import Token, make, split_lines

IncludeReader = Callable[[str, str], tuple[str, str]]
"""Called with a file as an `#include` names it and with the name of the including file; returns the full
name and the text of the file.  An `OSError` or `ValueError` becomes a diagnostic."""

INCLUDE_DEPTH: Final = 32


class Pending(NamedTuple):
    """An instruction between the passes."""

    statement: WrittenCommand | Data
    file: str
    number: int
    line: SourceLine


class _Branch(NamedTuple):
    """An `#if` at line `number`: whether the lines below count, and whether those below its `#else` would."""

    number: int
    counts: bool
    otherwise: bool


class FirstPass:
    """The instructions of a text and of the files that it includes, and where they stand.

    parse: `parse_line`, or one that remembers lines
    """

    def __init__(
        self,
        messages: Messages,
        names: Names,
        include: IncludeReader,
        parse: Callable[[str], SourceLine],
        model: int,
    ) -> None:
        self.pending: list[Pending] = []
        self.lines: dict[str, list[SourceLine]] = {}
        self.includes: dict[tuple[str, int], str] = {}
        self.left_out: set[tuple[str, int]] = set()
        self._messages = messages
        self._names = names
        self._read = include
        self._parse = parse
        self._model = model
        self._open: list[str] = []

    def walk(self, file: str, text: str) -> None:
        """Take the lines of a file, one after the other."""
        messages = self._messages
        messages.sources[file] = texts = split_lines(text)
        self.lines[file] = lines = self._parsed(text, texts)
        mistakes = mend(texts, lines)
        self._open.append(file)
        self._statements(file, lines)
        for mistake in mistakes:
            if (file, mistake.number) not in self.left_out:
                messages.mistake(mistake)
        self._open.pop()

    def _parsed(self, text: str, texts: list[str]) -> list[SourceLine]:
        parse = self._parse
        lines = list(map(parse, texts))
        if "." in text:
            for index, changes in local_labels(texts).items():
                lines[index] = moved(parse(changed(texts[index], changes)), changes)
        return lines

    def _statements(self, file: str, lines: list[SourceLine]) -> None:
        messages = self._messages
        branches: list[_Branch] = []
        for number, line in enumerate(lines, 1):
            labels, statement, _, problems = line
            if statement is None and not (labels or problems or branches):
                continue
            messages.file, messages.number = file, number
            if type(statement) is Directive:
                self.left_out.add((file, number))
                self._directive(statement, branches)
            elif branches and not branches[-1].counts:
                self.left_out.add((file, number))
            else:
                self._line(line)
        messages.file = file
        for branch in branches:
            messages.number = branch.number
            messages.report("E103", 0, len(messages.text), "this #if has no #endif")

    def _line(self, line: SourceLine) -> None:
        labels, statement, _, problems = line
        if problems:
            self._messages.problems(problems)
        for label in labels:
            self._names.define(label, "label", len(self.pending), line)
        kind = type(statement)
        if kind is WrittenCommand or kind is Data:
            messages = self._messages
            self.pending.append(make(Pending, (statement, messages.file, messages.number, line)))
        elif isinstance(statement, ConstantDefinition):
            self._constant(statement, line)
        elif isinstance(statement, Include):
            self._include(statement)

    def _constant(self, statement: ConstantDefinition, line: SourceLine) -> None:
        value = None
        if statement.value is not None:
            try:
                value = evaluate(statement.value, self._names.earlier_constant)
            except SourceExpressionError as error:
                self._messages.error(error)
        self._names.define(statement.name, "constant", value, line)

    # Conditions

    def _directive(self, statement: Directive, branches: list[_Branch]) -> None:
        messages = self._messages
        counts = not branches or branches[-1].counts
        if statement.kind == "if":
            holds = counts and self._holds(statement)
            branches.append(_Branch(messages.number, holds, counts and not holds))
        elif statement.kind == "assert":
            if counts and not self._holds(statement):
                text = messages.text[statement.start : statement.end]
                messages.report("E402", statement.start, statement.end, f"this does not hold: {shown(text)}")
        elif not branches:
            messages.report("E103", 0, len(messages.text), f"#{statement.kind} without an #if above it")
        else:
            number, _, otherwise = branches.pop()
            if statement.kind == "else":
                branches.append(_Branch(number, otherwise, otherwise=False))

    def _holds(self, statement: Directive) -> bool:
        """Whether the condition of a directive holds; a wrong one does."""
        try:
            return holds(self._messages.text, statement.start, statement.end, self._known)
        except SourceExpressionError as error:
            self._messages.error(error)
            return True

    def _known(self, name: Token) -> float:
        """The value of a name in a condition."""
        own = name.text.upper() == MODEL and MODEL not in self._names.symbols
        return float(self._model) if own else self._names.earlier_constant(name)

    # Files

    def _include(self, statement: Include) -> None:
        messages = self._messages
        start, end, name = statement.start, statement.end, shown(statement.file)
        if len(self._open) > INCLUDE_DEPTH:
            messages.report("E503", start, end, f"more than {INCLUDE_DEPTH} files include each other here")
            return
        found = self._found(statement)
        if found is None:
            return
        self.includes[messages.file, messages.number] = file = found[0]
        if file in self._open:
            messages.report("E502", start, end, f"{name} includes itself")
        elif file not in messages.sources:
            self.walk(*found)

    def _found(self, statement: Include) -> tuple[str, str] | None:
        """The full name and the text of a file; reports one that cannot be read."""
        try:
            return self._read(statement.file, self._messages.file)
        except (OSError, ValueError) as error:
            found = standard(statement.file)
            if found is None:
                reason = getattr(error, "strerror", None) or str(error)
                text = f"cannot read {shown(statement.file)}: {shown(reason)}"
                self._messages.report("E501", statement.start, statement.end, text)
            return found
