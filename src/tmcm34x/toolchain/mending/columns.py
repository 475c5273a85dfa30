"""Where the words of a changed line stood before its changes."""

from __future__ import annotations

from collections.abc import Sequence

from tmcm34x.toolchain.expressions import Expression, Operand
from tmcm34x.toolchain.mending.text import Change
from tmcm34x.toolchain.parser import (
    ConstantDefinition,
    Data,
    Include,
    Problem,
    SourceLine,
    Statement,
    WrittenCommand,
)
from tmcm34x.toolchain.tokens import Token


def moved(line: SourceLine, changes: Sequence[Change]) -> SourceLine:
    """A line parsed from a changed text, with the columns of the text before the changes."""
    back = _Back(sorted(changes))
    comment = None if line.comment is None else back.start(line.comment)
    labels = tuple(map(back.token, line.labels))
    return SourceLine(
        labels, back.statement(line.statement), comment, tuple(map(back.problem, line.problems))
    )


class _Back:
    def __init__(self, changes: Sequence[Change]) -> None:
        self._changes = changes

    def start(self, column: int) -> int:
        """Where what begins at a column began."""
        return self._before(column, ends=False)

    def end(self, start: int, column: int) -> int:
        """Where what ends at a column ended; it began at `start`."""
        return max(start, self._before(column, ends=True))

    def _before(self, column: int, *, ends: bool) -> int:
        shift = 0
        for start, end, new in self._changes:
            first = start + shift + ends
            if column < first:
                break
            if column < first + len(new):
                return end if ends else start
            shift += len(new) - (end - start)
        return column - shift

    def problem(self, old: Problem) -> Problem:
        """A mistake in its old place; what would be right is right there only where nothing was changed."""
        start = self.start(old.start)
        end = self.end(start, old.end)
        same = not any(first < end and start < last for first, last, _ in self._changes)
        return Problem(old.code, start, end, old.text, old.replacement if same else None)

    def token(self, old: Token) -> Token:
        start = self.start(old.start)
        return Token(old.kind, old.text, start, self.end(start, old.end))

    def operand(self, old: Operand | None) -> Operand | None:
        if old is None or isinstance(old, Token):
            return old if old is None else self.token(old)
        steps = tuple((kind, self.token(where), what) for kind, where, what in old.steps)
        start = self.start(old.start)
        return Expression(start, self.end(start, old.end), steps)

    def statement(self, old: Statement | None) -> Statement | None:
        if isinstance(old, ConstantDefinition):
            return ConstantDefinition(self.token(old.name), self.operand(old.value))
        if not isinstance(old, WrittenCommand | Data | Include):
            return old
        start = self.start(old.start)
        whole = old._replace(start=start, end=self.end(start, old.end))
        if isinstance(whole, Include):
            return whole
        return whole._replace(operands=tuple(map(self.operand, whole.operands)))
