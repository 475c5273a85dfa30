"""Repairs of one line: what was meant by a line that is no sound one.

`REPAIRS` is the table, the most certain kind first.  Each entry proposes changes; the first whose result is a sound
line is taken.  Where several results are as good, all are named and none is offered.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from functools import lru_cache
from itertools import pairwise
from typing import Final, NamedTuple

from tmcm34x.tmcl import axis_parameters, global_parameters
from tmcm34x.tmcl.commands import BY_MNEMONIC, FOREIGN_COMMANDS
from tmcm34x.tmcl.commands import Command as Row
from tmcm34x.tmcl.commands import Operand as OperandRow
from tmcm34x.toolchain import parser
from tmcm34x.toolchain.diagnostics import article, one_of, shown
from tmcm34x.toolchain.mending import words
from tmcm34x.toolchain.mending.spelling import nearest
from tmcm34x.toolchain.tokens import BLANKS, Token, tokenize

Change = tuple[int, int, str]
"""Columns of a line, from 0, and the text to put there."""

LONGEST: Final = 400
"""Characters of the longest line that is looked at."""
_NAME: Final = r"[A-Za-z_]\w*"
_BODY: Final = re.compile(rf"(?:\s*{_NAME}\s*:(?!=))*[{BLANKS}]*", re.ASCII)
_HEAD: Final = re.compile(rf"({_NAME})", re.ASCII)
_CALLED: Final = re.compile(rf"({_NAME})\s*(\()(.*?)(\)?)\s*$", re.ASCII)
_ASSIGNED: Final = re.compile(rf"({_NAME})\s*(:=|==|\bEQU\b)", re.ASCII | re.IGNORECASE)
_DECLARED: Final = re.compile(rf"((?:CONST|LET|VAR|INT)\s+){_NAME}\s*=", re.ASCII | re.IGNORECASE)
_DEFINED: Final = re.compile(rf"(#\s*DEFINE\s+)({_NAME})(?=\s)", re.ASCII | re.IGNORECASE)
_DIRECTIVE: Final = re.compile(r"(#?\s*)(\w+)(?=\s+\S)", re.ASCII)
_NUMBERED: Final = re.compile(r"\s*(\d+\s*[.)|]?\s+)(?=[A-Za-z_/])", re.ASCII)
_MARKED: Final = re.compile(rf"\s*({_NAME})\s*(;|,|\.(?=\s))(?=\s*[A-Za-z])", re.ASCII)
_BEFORE: Final = re.compile(rf"\s*(:)\s*({_NAME})(?=\s*(?://|\Z|[A-Za-z]))", re.ASCII)
_COLON: Final = "a label has its ':' only where it is defined"
_ANY_DIRECTIVE: Final = re.compile(
    r"#\s*(?:define|include|if|ifdef|ifndef|else|elif|endif|pragma|assert)\b", re.IGNORECASE
)
_MARKERS: Final = ("#", "--", ";", "'", "*", "!", "/")
_LOOSE: Final = ";:."
"""What is typed for a comma."""


class Repair(NamedTuple):
    """What is wrong with a line, and the changes that make it right; none where that is not certain.

    kind: of habits, which go through a whole file and are told once; else empty
    """

    code: str
    start: int
    end: int
    text: str
    changes: tuple[Change, ...] = ()
    kind: str = ""


class _Text(NamedTuple):
    """A line taken apart: where its code ends, where its statement begins, its first word and what follows."""

    text: str
    end: int
    body: int
    head: str
    rest: int
    labels: frozenset[str]

    @property
    def row(self) -> Row | None:
        return BY_MNEMONIC.get(self.head.upper())

    @property
    def after(self) -> str:
        """The code behind the first word."""
        return self.text[self.rest : self.end]


@lru_cache(maxsize=4096)
def repair(text: str, labels: frozenset[str] = frozenset()) -> Repair | None:
    """What was meant by a line; None where nobody could tell.

    labels: those of the file, in upper case
    """
    if len(text) > LONGEST:
        return None
    line = _take_apart(text, labels)
    for propose in REPAIRS:
        for proposal in propose(line):
            if not proposal.changes or sound(parser.parse_line(changed(text, proposal.changes))):
                return proposal
    return None


def guess(text: str) -> Repair | None:
    """What a line may have meant that no repair fits; None where there is no telling."""
    return None if len(text) > LONGEST else next(_guess(_take_apart(text, frozenset())), None)


def changed(text: str, changes: tuple[Change, ...]) -> str:
    """`text` with changes made."""
    for start, end, new in sorted(changes, reverse=True):
        text = text[:start] + new + text[end:]
    return text


def sound(line: parser.Line) -> bool:
    """Whether a line is whole: a command with as many operands as it takes, its words among them."""
    statement = line.statement
    if line.problems:
        return False
    if isinstance(statement, parser.Data):
        return len(statement.operands) == 4
    if not isinstance(statement, parser.Command):
        return True
    row = BY_MNEMONIC.get(statement.mnemonic.upper())
    if row is None:
        return False
    required = sum(operand.required for operand in row.operands)
    given = statement.operands
    if not required <= len(given) <= len(row.operands) + len(row.spare) and not (
        row.mnemonic == "CALC" and len(given) == 1 and parser.is_not(given[0])
    ):
        return False
    return all(_takes(operand, written) for operand, written in zip(row.operands, given, strict=False))


def _takes(operand: OperandRow, written: object) -> bool:
    if operand.kind == "word":
        return isinstance(written, Token) and written.text.upper() in dict(operand.words)
    return operand.kind != "address" or isinstance(written, Token)


def suits(line: parser.Line) -> bool:
    """Whether the plain numbers of a sound line are such as its command takes."""
    statement = line.statement
    if not sound(line) or not isinstance(statement, parser.Command):
        return False
    row = BY_MNEMONIC[statement.mnemonic.upper()]
    if len(statement.operands) > len(row.operands):
        return False
    given = {
        operand.field: (operand, int(written.text))
        for operand, written in zip(row.operands, statement.operands, strict=False)
        if isinstance(written, Token) and written.text.isdecimal() and len(written.text) < 11
    }
    number = given.get("type", (None, -1))[1]
    for operand, value in given.values():
        if operand.kind == "axis_parameter" and value not in axis_parameters.BY_NUMBER:
            return False
        if operand.kind == "bank" and row.operands[0].kind == "global_parameter":
            if number >= 0 and (value, number) not in global_parameters.BY_NUMBER:
                return False
        elif not operand.low <= value <= operand.high:
            return False
    return True


def _take_apart(text: str, labels: frozenset[str]) -> _Text:
    slashes = text.find("//")
    end = len(text) if slashes < 0 else slashes
    body = _BODY.match(text, 0, end)
    start = body.end() if body is not None else 0
    head = _HEAD.match(text, start, end)
    return _Text(text, end, start, head[1] if head else "", head.end() if head else start, labels)


def _change(code: str, text: str, *changes: Change, kind: str = "") -> Repair:
    start, end, _ = changes[0]
    return Repair(code, start, max(end, start + 1), text, changes, kind)


# The kinds of repairs


def _characters(line: _Text) -> Iterator[Repair]:
    """Characters of word processors for the plain ones."""
    changes = tuple(
        (column, column + 1, words.CHARACTERS[character])
        for column, character in enumerate(line.text[: line.end])
        if character in words.CHARACTERS
    )
    if changes:
        wrong, right = line.text[changes[0][0]], changes[0][2]
        wanted = f"; write {right!r}" if right.strip() else "; write a blank" if right else ""
        yield _change(
            "E101", f"{wrong!r} is not a character of the language{wanted}", *changes, kind="character"
        )


def _end_of_file(line: _Text) -> Iterator[Repair]:
    """Ctrl-Z, with which DOS ended its files."""
    column = line.text.find("\x1a")
    if column >= 0 and not line.text[column + 1 :].strip("\x1a \t"):
        yield _change(
            "E101", "Ctrl-Z, the old mark for the end of a file; delete it", (column, len(line.text), "")
        )


def _symbol_for_word(line: _Text) -> Iterator[Repair]:
    """`JC =, Label` for JC EQ."""
    row = line.row
    first, comma, _ = line.after.partition(",")
    if row is None or not comma or not row.operands or row.operands[0].kind != "word":
        return
    written = first.strip(BLANKS)
    meant = words.WORDS.get(row.mnemonic, {}).get(written) if not written.isidentifier() else None
    start = line.text.find(written, line.rest)
    if meant is not None:
        text = f"{row.mnemonic} takes a word here, not {written!r}; did you mean {meant}?"
        blank = "" if line.text[start - 1] in BLANKS else " "
        yield _change("E205", text, (start, start + len(written), blank + meant))
    elif written and not written[0].isalnum() and written[0] not in "$%(_":
        text = f"{row.mnemonic} takes {one_of(word for word, _ in row.operands[0].words)} here, not {shown(written)}"
        yield Repair("E205", start, start + len(written), text)


def _meaning(line: _Text) -> Iterator[Repair]:
    """Commands as other languages call them."""
    meant = words.COMMANDS.get(line.head.upper())
    called = line.after.strip(BLANKS)
    if meant is not None and (line.head.upper() not in FOREIGN_COMMANDS or called.isidentifier()):
        start, after = line.body, line.after.lstrip(BLANKS)
        if not after:
            meant = meant.partition(" ")[0]
        text = f"no command {line.head}; TMCL writes {meant.rstrip(',')}"
        yield _change("E201", text, (start, line.rest, meant))


def _misspelt(line: _Text) -> Iterator[Repair]:
    """A command with a slip in it, where the operands fit."""
    near = _near(line)
    if not near:
        return
    for fits in (suits, sound):
        fitting = [name for name in near if fits(_with_head(line, name))]
        if fitting:
            text = f"no command {shown(line.head)}; did you mean {one_of(fitting)}?"
            if len(fitting) == 1:
                yield _change("E201", text, (line.body, line.rest, fitting[0]))
            else:
                yield Repair("E201", line.body, line.rest, text)
            return


def _with_head(line: _Text, name: str) -> parser.Line:
    """The line with another command."""
    return parser.parse_line(changed(line.text, ((line.body, line.rest, name),)))


def _near(line: _Text) -> tuple[str, ...]:
    key = line.head.upper()
    if not key or key in BY_MNEMONIC or key in FOREIGN_COMMANDS:
        return ()
    return nearest(key, BY_MNEMONIC, 1 if len(key) < 5 else 2)


def _directive(line: _Text) -> Iterator[Repair]:
    """`include` without its `#` or with a slip, `#define`."""
    match = _DEFINED.match(line.text, line.body)
    if match is not None:
        place = match.end(2)
        text = "there is no #define; a constant is written NAME = VALUE"
        yield _change("E103", text, (match.start(1), match.end(1), ""), (place, place, " ="), kind="define")
    match = _DIRECTIVE.match(line.text, line.body)
    if (
        match is not None
        and match[2].upper() not in BY_MNEMONIC
        and nearest(match[2].lower(), ("include",), 2)
    ):
        quotes = line.text[match.end() :].strip()[:1] in ('"', "<", "'")
        if match[1] or quotes or match[2].lower() == "include":
            yield _change(
                "E103", "another file is included by #include", (match.start(), match.end(), "#include")
            )


def _constant(line: _Text) -> Iterator[Repair]:
    """`NAME := 5`, `NAME EQU 5`, `CONST NAME = 5`."""
    match = _ASSIGNED.match(line.text, line.body)
    if match is not None:
        text = f"a constant is written NAME = VALUE, without {shown(match[2])}"
        yield _change("E103", text, (*match.span(2), "="), kind="assignment")
    match = _DECLARED.match(line.text, line.body)
    if match is not None:
        text = f"a constant is written NAME = VALUE, without {shown(match[1].strip())}"
        yield _change("E103", text, (*match.span(1), ""), kind="declaration")


def _comma_after_command(line: _Text) -> Iterator[Repair]:
    blank = line.after[: len(line.after) - len(line.after.lstrip(BLANKS))]
    place = line.rest + len(blank)
    if line.text[place : place + 1] == "," and line.row is not None:
        new = "" if blank or line.text[place + 1 : place + 2] in BLANKS else " "
        yield _change("E103", f"no ',' stands behind {line.head.upper()}", (place, place + 1, new))


def _parentheses(line: _Text) -> Iterator[Repair]:
    """`SAP(4, 0, 5)`, `JA (Label)`."""
    match = _CALLED.match(line.text, line.body, line.end)
    if match is not None and line.row is not None:
        blank = "" if line.text[match.start(2) - 1] in BLANKS else " "
        changes: list[Change] = [(*match.span(2), blank)]
        if match[4]:
            changes.append((*match.span(4), ""))
        yield _change(
            "E103", f"operands stand behind {match[1].upper()} without parentheses", *changes, kind="call"
        )


def _at_the_end(line: _Text) -> Iterator[Repair]:
    """A comma, colon, semicolon or full stop behind the last operand."""
    code = line.text[: line.end].rstrip(BLANKS)
    if code and code[-1] in ",:;." and line.body < len(code) - 1:
        what = _COLON if code[-1] == ":" and line.row else f"no {code[-1]!r} stands at the end"
        yield _change("E103", what, (len(code) - 1, len(code), ""))


def _commas(line: _Text) -> Iterator[Repair]:
    """One comma too many."""
    for match in re.finditer(r",\s*(,)", line.text[: line.end]):
        yield _change("E103", "an operand is missing between two commas", (*match.span(1), ""))


def _label(line: _Text) -> Iterator[Repair]:
    """`Loop; MVP ...`, `:Loop`."""
    match = _MARKED.match(line.text)
    if match is not None and line.row is None:
        yield _change("E103", f"a label ends with ':': {shown(match[1])}:", (*match.span(2), ":"))
    match = _BEFORE.match(line.text)
    if match is not None:
        text = f"a label ends with ':': {shown(match[2])}:"
        yield _change("E103", text, (*match.span(1), ""), (match.end(2), match.end(2), ":"))


def _glued(line: _Text) -> Iterator[Repair]:
    """`WAITTICKS, 0, 10`, `SAP4, 0, 5`, `JALoop`, `MVP ABS0, 5`."""
    key = line.head.upper()
    if line.row is None:
        for name in sorted(BY_MNEMONIC, key=len, reverse=True):
            left = key.removeprefix(name)
            if left == key or not left:
                continue
            first = BY_MNEMONIC[name].operands[:1]
            known = left in dict(first[0].words) if first else False
            if known or left.isdecimal() or (first and first[0].kind == "address" and left in line.labels):
                place = line.body + len(name)
                yield _change("E103", f"a blank is missing behind {name}", (place, place, " "))
        return
    if not line.row.operands or line.row.operands[0].kind != "word":
        return
    first = tokenize(line.text, line.rest, line.end)[:1]
    for word, _ in sorted(line.row.operands[0].words, key=lambda item: -len(item[0])):
        written = first[0].text.upper() if first else ""
        left = written.removeprefix(word)
        if (
            written != left
            and left
            and written not in line.labels
            and (left.isdecimal() or not _jumps(line.row))
        ):
            place = first[0].start + len(word)
            yield _change("E103", f"',' is missing behind {word}", (place, place, ", "))


def _jumps(row: Row) -> bool:
    return row.operands[-1].kind == "address"


def _split(line: _Text) -> Iterator[Repair]:
    """A blank within a command or a number."""
    tokens = tokenize(line.text, line.body, line.end)
    for before, after in pairwise(tokens):
        if before.kind == after.kind and before.kind in ("name", "number") and before.end < after.start:
            joined = before.text + after.text
            head = before.start == line.body
            if (joined.upper() in BY_MNEMONIC) if head else before.kind == "number":
                text = f"a blank within {shown(joined)}"
                yield _change("E103", text, (before.end, after.start, ""))


def _missing_comma(line: _Text) -> Iterator[Repair]:
    if line.row is None:
        return
    gaps = list(_gaps(tokenize(line.text, line.rest, line.end)))
    for chosen in ([gap] for gap in gaps) if len(gaps) < 2 else (*([gap] for gap in gaps), gaps):
        text = f"',' is missing before {shown(chosen[0].text)!r}"
        changes = tuple((_end_before(line.text, gap.start), gap.start, ", ") for gap in chosen)
        yield Repair("E103", chosen[0].start, chosen[0].end, text, changes)


def _end_before(text: str, column: int) -> int:
    return len(text[:column].rstrip(BLANKS))


def _gaps(tokens: list[Token]) -> Iterator[Token]:
    """The tokens that may begin an operand without a comma before them."""
    for before, token in pairwise(tokens):
        complete = before.kind in ("name", "number", "malformed") or before.text == ")"
        begins = token.kind in ("name", "number") or (token.text in "-(" and token.start > before.end)
        if complete and begins:
            yield token


def _separators(line: _Text) -> Iterator[Repair]:
    """Something else where a comma should be."""
    if line.row is None:
        return
    for mark in _LOOSE:
        places = [match.start() for match in re.finditer(re.escape(mark), line.text[line.rest : line.end])]
        for chosen in (*([place] for place in places), places):
            if chosen:
                changes = tuple((line.rest + place, line.rest + place + 1, ", ") for place in chosen)
                yield _change("E103", f"operands are separated by ',', not by {mark!r}", *changes)


def _comment(line: _Text) -> Iterator[Repair]:
    """The comments of other languages."""
    text = line.text
    for marker in _MARKERS:
        column = text.find(marker)
        while 0 <= column < line.end and not _ANY_DIRECTIVE.match(text, column):
            alone = column == 0 or (text[column - 1] in BLANKS and marker not in "*!") or marker in ";#"
            if alone or not text[:column].strip(BLANKS):
                shown_marker = f"a comment begins with //, not with {marker!r}"
                end = column + len(marker)
                while marker in "*;#!'" and text[end : end + 1] == marker:
                    end += 1
                yield _change("E101", shown_marker, (column, end, "//"), kind=f"comment {marker}")
            column = text.find(marker, column + 1)


def _prefix(line: _Text) -> Iterator[Repair]:
    """`#500` for 500."""
    for match in re.finditer(r"#(?=[\d$%])", line.text[line.rest : line.end]):
        place = line.rest + match.start()
        yield _change("E101", "a number stands without '#'", (place, place + 1, ""))


def _line_number(line: _Text) -> Iterator[Repair]:
    match = _NUMBERED.match(line.text)
    if match is not None:
        yield _change(
            "E103",
            "lines have no numbers in TMCL",
            (*match.span(1), ""),
            kind="number",
        )


def _calcx(line: _Text) -> Iterator[Repair]:
    if line.head.upper() == "CALC":
        text = "CALC needs a number; with the X register it is CALCX"
        yield _change("E203", text, (line.body, line.rest, "CALCX"))


def _missing_word(line: _Text) -> Iterator[Repair]:
    """The word that comes first was left out: `JC Loop`, `WAIT 100`."""
    row = line.row
    if row is None or not row.operands or row.operands[0].kind != "word":
        return
    tokens = tokenize(line.text, line.rest, line.end)
    commas = sum(token.text == "," for token in tokens)
    listed = one_of(word for word, _ in row.operands[0].words)
    if row.mnemonic == "WAIT" and len(tokens) == 1 and tokens[0].kind in ("number", "name"):
        text = f"WAIT needs a condition before {shown(tokens[0].text)}: {listed}"
        yield Repair(
            "E203", tokens[0].start, tokens[0].end, text, ((tokens[0].start, tokens[0].start, "TICKS, 0, "),)
        )
    if (
        tokens
        and tokens[0].text.upper() not in dict(row.operands[0].words)
        and commas + 2 == len(row.operands)
    ):
        text = (
            f"{row.mnemonic} needs {article(row.operands[0].name)} before {shown(tokens[0].text)}: {listed}"
        )
        yield Repair("E203", tokens[0].start, tokens[0].end, text)


def _guess(line: _Text) -> Iterator[Repair]:
    """A command with a slip in it, whose operands are wrong too; or one that TMCL does not have."""
    key = line.head.upper()
    if key in words.NOTES:
        yield Repair("E201", line.body, line.rest, f"no command {line.head}; {words.NOTES[key]}")
    near = _near(line)
    meant = words.COMMANDS.get(key, "").partition(" ")[0]
    if (near or meant) and key not in FOREIGN_COMMANDS:
        text = f"no command {shown(line.head)}; did you mean {meant or one_of(near)}?"
        yield Repair("E201", line.body, line.rest, text)


REPAIRS: Final[tuple[Callable[[_Text], Iterator[Repair]], ...]] = (
    _characters, _end_of_file, _symbol_for_word, _meaning, _misspelt, _directive, _constant, _comma_after_command,
    _parentheses, _at_the_end, _commas, _label, _glued, _comment, _separators, _missing_comma, _split, _prefix,
    _line_number, _calcx, _missing_word,
)  # fmt: skip
"""The kinds of repairs, in the order in which they are tried."""
