"""Diagnostics of the assembler as they come, for the line that it is at."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from tmcm34x.toolchain.diagnostics import Diagnostic, Edit, Fix, Location, shown
from tmcm34x.toolchain.expressions import SourceExpressionError, UnknownValueError
from tmcm34x.toolchain.mending.files import Mistake
from tmcm34x.toolchain.mending.lines import repair
from tmcm34x.toolchain.mending.spelling import nearest
from tmcm34x.toolchain.mending.text import changed
from tmcm34x.toolchain.parser import Problem
from tmcm34x.toolchain.tokens import BLANKS

_SUGGESTIONS: Final = 50
"""Misspelt names of one text that get a suggestion: looking for one takes a while."""
_LEXICAL: Final = frozenset({"E101", "E102"})
_CAUSES: Final = frozenset({"E501", "E503"})
_CONSEQUENCES: Final = frozenset({"E301", "E303"})
"""Names are not missed while a file is missing that may define them."""


class Messages:
    """What is reported of a text and of the files that it includes.

    sources: the lines of each file, by its name, in the order of reading
    file, number: of the line that reports are about
    """

    def __init__(self) -> None:
        self.sources: dict[str, list[str]] = {}
        self.file = ""
        self.number = 0
        self._found: list[Diagnostic] = []
        self._suggestions = _SUGGESTIONS

    @property
    def text(self) -> str:
        """The line that reports are about."""
        return self.sources[self.file][self.number - 1]

    def location(self, start: int, end: int) -> Location:
        """The stretch between two columns of the line, which count from 0."""
        return Location(self.file, self.number, start + 1, end + 1)

    def add(self, diagnostic: Diagnostic) -> None:
        """Take a diagnostic as it is."""
        self._found.append(diagnostic)

    def report(self, code: str, start: int, end: int, text: str, replacement: str | None = None) -> None:
        """Report an error between two columns of the line; `replacement` is what would be right there."""
        location = self.location(start, end)
        fixes: tuple[Fix, ...] = ()
        if replacement is not None:
            title = f"Change to {shown(replacement)}" if replacement else "Delete this"
            fixes = (Fix(title, (Edit(location, replacement),)),)
        self.add(Diagnostic(location, "error", code, text, fixes))

    def error(self, error: SourceExpressionError) -> None:
        """Report what is wrong with an expression, unless its cause is reported elsewhere."""
        if not isinstance(error, UnknownValueError):
            self.report(*error.problem)

    def problems(self, problems: tuple[Problem, ...]) -> None:
        """Report mistakes in the characters and words of a line; where there are none, all others."""
        lexical = [problem for problem in problems if problem.code in _LEXICAL]
        for problem in lexical or problems:
            self.report(*problem)

    def mistake(self, found: Mistake) -> None:
        """Report what mending found in the file, with the changes that mend it."""
        edits = tuple(
            Edit(Location(self.file, number, start + 1, end + 1), new)
            for number, (start, end, new) in found.changes
        )
        fixes = (Fix(f"Change to {self._mended(found)}", edits),) if edits else ()
        place = Location(self.file, found.number, found.start + 1, found.end + 1)
        self.add(Diagnostic(place, "error", found.code, found.text, fixes))

    def _mended(self, found: Mistake) -> str:
        """The line of a mistake as it was meant, without its comment."""
        here = tuple(change for number, change in found.changes if number == found.number)
        text = changed(self.sources[self.file][found.number - 1], here)
        return shown(text.partition("//")[0].strip(BLANKS) or "a comment")

    def repaired(self) -> bool:
        """Report what the line was meant to be; whether that can be determined."""
        found = repair(self.text) if self._affordable() else None
        if found is None:
            return False
        changes = tuple((self.number, change) for change in found.changes)
        self.mistake(Mistake(self.number, found.code, found.start, found.end, found.text, changes))
        return True

    def near(self, name: str, candidates: Iterable[str], most: int | None = None) -> tuple[str, ...]:
        """The candidates that `name` may be a misspelling of."""
        return nearest(name.upper(), candidates, most) if self._affordable() else ()

    def _affordable(self) -> bool:
        self._suggestions -= 1
        return self._suggestions >= 0

    def result(self) -> tuple[Diagnostic, ...]:
        """All diagnostics, in the order of files and lines; a missing file stands for what follows from it."""
        found = self._found
        if any(item.code in _CAUSES for item in found):
            found = [item for item in found if item.code not in _CONSEQUENCES]
        order = {name: index for index, name in enumerate(self.sources)}
        return tuple(sorted(found, key=lambda item: (order[item.location.file], *item.location[1:])))
