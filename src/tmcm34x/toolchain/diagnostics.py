"""What the tool chain reports about a source text: locations, diagnostics, fixes.

The tool chain never raises for what a user wrote; it returns diagnostics, all of a file in one pass.
`ERRORS` is the table of the assembler's own; the linter has its table in `linter.RULES`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Final, Literal, NamedTuple

Severity = Literal["error", "warning", "information"]

ERRORS: Final = MappingProxyType({
    "E101": "a character or word that the language does not have",
    "E102": "an invalid number: decimal, $hexadecimal or %binary",
    "E103": "something is missing or misplaced",
    "E201": "an unknown command",
    "E202": "a command of other TMCL firmware, not available on a TMCM-34x",
    "E203": "a command with too few operands",
    "E204": "a command with too many operands",
    "E205": "an operand that must be one of certain words",
    "E206": "a number that does not fit into its field",
    "E301": "an undefined name",
    "E302": "a name defined twice (case does not matter)",
    "E303": "a constant used in another one before its definition",
    "E304": "a label where a number is needed",
    "E401": "an expression without a value: division by zero, square root of a negative number, overflow",
    "E402": "an #assert that fails",
    "E501": "an include file that cannot be read",
    "E502": "a file that includes itself, directly or through others",
    "E503": "include files nested too deeply",
    "E601": "a program longer than the program memory",
})  # fmt: skip
"""The assembler's diagnostics, by code: what each one is about."""

_WINDOW: Final = 100
"""Characters of a source line that are shown beside a diagnostic."""
_SHOWN_NAME: Final = 40
_MOST_NAMES: Final = 14


class Location(NamedTuple):
    """A stretch of one source line: columns count characters from 1, `end` is the one after the last."""

    file: str
    line: int
    column: int
    end: int


class Edit(NamedTuple):
    """One replacement; an empty stretch inserts, a text with line ends inserts lines."""

    location: Location
    text: str


class Fix(NamedTuple):
    """A change that would remove a diagnostic, for editors to offer."""

    title: str
    edits: tuple[Edit, ...]


class Diagnostic(NamedTuple):
    """One finding."""

    location: Location
    severity: Severity
    code: str
    text: str
    fixes: tuple[Fix, ...] = ()


def shown(text: str) -> str:
    """`text` from a source as a message may quote it: printable and short."""
    return printable(text if len(text) <= _SHOWN_NAME else text[: _SHOWN_NAME - 1] + "…")


def printable(text: str) -> str:
    """`text` on one line, as many characters long, with blanks for tabs and the like and no control characters."""
    if text.isprintable():
        return text
    return "".join(
        c if c.isprintable() else " " if c.isspace() else "\N{REPLACEMENT CHARACTER}" for c in text
    )


def one_of(names: Iterable[str]) -> str:
    """Names as alternatives: `A, B or C`; the first of them."""
    *most, last = [*names][:_MOST_NAMES] or [""]
    return f"{', '.join(most)} or {last}" if most else last


def article(name: str) -> str:
    """`name` with its indefinite article."""
    return f"an {name}" if name[:1] in "aeiou" else f"a {name}"


def did_you_mean(near: Sequence[str]) -> str:
    """The end of a message about a name that may be a misspelling of others."""
    return f"; did you mean {one_of(near)}?" if near else ""


def has_errors(diagnostics: Iterable[Diagnostic]) -> bool:
    """Whether one of them forbids a program."""
    return any(diagnostic.severity == "error" for diagnostic in diagnostics)


def render(diagnostic: Diagnostic, lines: Sequence[str] = ()) -> str:
    """The diagnostic as three lines: `FILE:LINE:COL: error[CODE]: text`, the source line, a caret line.

    lines: the lines of its file; without them the first line comes alone.  Long lines are shown in part.
    """
    file, line, column, end = diagnostic.location
    head = f"{printable(file)}:{line}:{column}: {diagnostic.severity}[{diagnostic.code}]: {diagnostic.text}"
    if not 1 <= line <= len(lines):
        return head
    source = lines[line - 1]
    first = max(0, column - 1 - _WINDOW // 2) if len(source) > _WINDOW else 0
    window = source[first : first + _WINDOW]
    prefix = "…" if first else ""
    suffix = "…" if first + _WINDOW < len(source) else ""
    text = printable(window).rstrip()
    width = max(1, min(end, first + len(window) + 1) - column)
    caret = " " * (len(prefix) + column - 1 - first) + "^" + "~" * (width - 1)
    return f"{head}\n  {prefix}{text}{suffix}\n  {caret}"


def render_all(diagnostics: Iterable[Diagnostic], sources: Mapping[str, Sequence[str]]) -> str:
    """All diagnostics with their source lines; `sources` has the lines of each file by its name."""
    return "".join(render(item, sources.get(item.location.file, ())) + "\n" for item in diagnostics)
