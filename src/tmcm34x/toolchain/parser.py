"""Lines of source text to statements.

Each line stands alone, so `parse_line` is a function of its text and nothing else.  Grammar:

    line       = { label } [ statement ] [ comment ]
    label      = name ":"
    statement  = name "=" expression
               | "#" "include" file
               | "#" ("if" | "assert") condition | "#" ("else" | "endif")
               | command [ operand { "," operand } ]
               | "//!" "DATA" number "," type "," motor "," value
    operand    = expression                              (a word such as ABS is an expression of one name)

After a mistake the parser goes on at the next comma, so that one pass finds them all.  The DATA line is our
own: a comment to other assemblers, to ours an instruction given by its numbers (fidelity TOOL-8).
"""

from __future__ import annotations

import re
from typing import Final, NamedTuple

from tmcm34x.tmcl.commands import BY_MNEMONIC
from tmcm34x.toolchain.diagnostics import shown
from tmcm34x.toolchain.expressions import (
    Operand,
    SourceExpressionError,
    compile_expression,
    lexical_error,
    quoted,
)
from tmcm34x.toolchain.includes import unquoted
from tmcm34x.toolchain.tokens import BLANKS, Token, first_token, make, tokenize

_BLANKS: Final = rf"[{BLANKS}]*+"
_NAME: Final = r"[A-Za-z_]\w*+"
_LABEL: Final = re.compile(rf"({_NAME}){_BLANKS}:", re.ASCII)
_HEAD: Final = re.compile(rf"{_BLANKS}((?:{_NAME}{_BLANKS}:{_BLANKS})*)({_NAME})?{_BLANKS}(=)?", re.ASCII)
_NEXT_WORD: Final = re.compile(rf"{_BLANKS}({_NAME})", re.ASCII)
_DIRECTIVES: Final = "there are #include, #if, #else, #endif and #assert"
DIRECTIVES: Final = frozenset({"if", "else", "endif", "assert"})
"""Those besides `#include`: see `structure`."""
_DATA: Final = re.compile(rf"//!{_BLANKS}(DATA)\b", re.IGNORECASE | re.ASCII)
_INCLUDE: Final = re.compile(rf"{_BLANKS}(#{_BLANKS}(\w*)){_BLANKS}", re.ASCII)


_OTHER_COMMENT: Final = re.compile(rf"[{BLANKS}]++(;|#|'|--|/\*)")
_CURLY: Final = re.compile("[\u2018\u2019\u201c\u201d\u201e]")
"""Quotes of word processors."""
_MOST_OPERANDS: Final = 8
"""Operands of a line that are looked at; no command has more than three, or four numbers in a DATA line."""


class Problem(NamedTuple):
    """A mistake in one line; columns count from 0; `replacement` is what would be right, where that is known."""

    code: str
    start: int
    end: int
    text: str
    replacement: str | None = None


Operands = tuple[Operand | None, ...]


class WrittenCommand(NamedTuple):
    """A mnemonic as written and its operands; an operand that could not be parsed is None."""

    mnemonic: str
    start: int
    operands: Operands
    end: int


class ConstantDefinition(NamedTuple):
    """`name = value`; value is None when it could not be parsed."""

    name: Token
    value: Operand | None


class Include(NamedTuple):
    """`#include file`; the file as written, without quotes or angle brackets."""

    file: str
    start: int
    end: int


class Data(NamedTuple):
    """`//! DATA number, type, motor, value`."""

    start: int
    operands: Operands
    end: int


class Directive(NamedTuple):
    """`#if`, `#else`, `#endif` or `#assert`, and the columns of its condition."""

    kind: str
    start: int
    end: int


Statement = WrittenCommand | ConstantDefinition | Include | Data | Directive


class SourceLine(NamedTuple):
    """What one line holds; `comment` is the column of its slashes."""

    labels: tuple[Token, ...]
    statement: Statement | None
    comment: int | None
    problems: tuple[Problem, ...]


def is_not(operand: Operand | None) -> bool:
    """Whether an operand is the word NOT, after which CALC needs no number."""
    return isinstance(operand, Token) and operand.text.upper() == "NOT"


def parse_line(text: str) -> SourceLine:
    """The statement in one line, its labels and comment, and what is wrong with it."""
    end, comment = _comment(text, 0)
    head = _HEAD.match(text, 0, end)
    assert head is not None
    names, name, equals = head.groups()
    labels = _labels(text, *head.span(1)) if names else ()
    if name is None:
        if head.end() < end or equals is not None:
            return _without_name(text, labels, comment, head.end(1), end)
        pragma = None if comment is None else _DATA.match(text, comment)
        return SourceLine(labels, None, comment, ()) if pragma is None else _data(text, labels, pragma)
    start, stop = head.span(2)
    problems: list[Problem] = []
    if equals is not None:
        value = _operand(text, head.end(), end, problems)
        return SourceLine(
            labels, ConstantDefinition(Token("name", name, start, stop), value), comment, tuple(problems)
        )
    if name.upper() not in BY_MNEMONIC:
        following = _NEXT_WORD.match(text, stop, end)
        if following is not None and following[1].upper() in BY_MNEMONIC:
            problems.append(_lacks_colon(name, start, stop))
            labels = (*labels, Token("name", name, start, stop))
            name, (start, stop) = following[1], following.span(1)
    operands, last = _operands(text, stop, end, problems)
    return make(
        SourceLine, (labels, make(WrittenCommand, (name, start, operands, last)), comment, tuple(problems))
    )


def _lacks_colon(name: str, start: int, end: int) -> Problem:
    return Problem("E103", start, end, f"a label ends with ':': {shown(name)}:", f"{name}:")


def _comment(text: str, start: int) -> tuple[int, int | None]:
    """Where the code from `start` on ends, and where a comment begins."""
    slashes = text.find("//", start)
    return (len(text), None) if slashes < 0 else (slashes, slashes)


def _labels(text: str, start: int, end: int) -> tuple[Token, ...]:
    return tuple(Token("name", match[1], *match.span(1)) for match in _LABEL.finditer(text, start, end))


def _operands(text: str, start: int, end: int, problems: list[Problem]) -> tuple[Operands, int]:
    """The operands between two columns, separated by commas; and where the last one ends."""
    segments = text[start:end].split(",", _MOST_OPERANDS)[:_MOST_OPERANDS]
    if len(segments) == 1 and not segments[0].strip(BLANKS):
        return (), start
    operands: list[Operand | None] = []
    for segment in segments:
        stop = start + len(segment)
        word = segment.strip(BLANKS)
        if word.isidentifier() and word.isascii():
            kind = "name"
        elif word.isdecimal() and word.isascii():
            kind = "number"
        else:
            operands.append(_operand(text, start, stop, problems))
            start = stop + 1
            continue
        first = start + segment.find(word)
        operands.append(make(Token, (kind, word, first, first + len(word))))
        start = stop + 1
    last = operands[-1]
    return tuple(operands), end if last is None else last.end


def _operand(text: str, start: int, end: int, problems: list[Problem]) -> Operand | None:
    """The operand between two columns, where it is more than a word or may be nothing."""
    tokens = tokenize(text, start, end)
    try:
        if tokens:
            return compile_expression(tokens)
        place = (start - 1, start) if text[start - 1] in ",=" else (start, start + 1)
        problems.append(Problem("E103", *place, "an operand is missing"))
    except SourceExpressionError as error:
        problems.append(Problem(*error.problem))
    return None


def _without_name(
    text: str, labels: tuple[Token, ...], comment: int | None, start: int, end: int
) -> SourceLine:
    """A line whose statement does not begin with a name."""
    head = first_token(text, start, end)
    if head.text == "#" and not labels:
        return _directive(text)
    if head.kind in ("malformed", "stray"):
        problem = Problem(*lexical_error(head).problem)
    else:
        what = f"a command, label or constant is missing before {quoted(head)}"
        problem = Problem("E103", head.start, head.end, what)
    return SourceLine(labels, None, comment, (problem,))


def _data(text: str, labels: tuple[Token, ...], pragma: re.Match[str]) -> SourceLine:
    first, start = pragma.span(1)
    end, comment = _comment(text, start)
    problems: list[Problem] = []
    operands, last = _operands(text, start, end, problems)
    return SourceLine(labels, Data(first, operands, last), comment, tuple(problems))


def _directive(text: str) -> SourceLine:
    match = _INCLUDE.match(text)
    assert match is not None
    word, stop = match[2].lower(), match.end()
    end, comment = _comment(text, stop)
    if word in DIRECTIVES:
        return SourceLine((), Directive(word, stop, len(text[:end].rstrip(BLANKS))), comment, ())
    if word == "include":
        name = text[stop:end].strip(BLANKS)
        problem = Problem("E103", *match.span(1), "the name of a file is missing")
        return (
            _include(text.index(name, stop), name, comment)
            if name
            else SourceLine((), None, comment, (problem,))
        )
    what = f"no directive {shown(match[1])}; {_DIRECTIVES}"
    return SourceLine((), None, None, (Problem("E103", *match.span(1), what),))


def _include(place: int, name: str, comment: int | None) -> SourceLine:
    """The line that includes the file which is named at column `place`."""
    problems: tuple[Problem, ...] = ()
    other = _OTHER_COMMENT.search(name)
    if other is not None:
        comment = place + other.start(1)
        what = f"a comment begins with //, not with {other[1]!r}"
        problems = (Problem("E101", comment, comment + len(other[1]), what, "//"),)
        name = name[: other.start()]
    curly = _CURLY.search(name)
    if curly is not None:
        column = place + curly.start()
        problems = (Problem("E101", column, column + 1, f"{curly[0]!r} is not a character of the language"),)
    return SourceLine((), Include(unquoted(name), place, place + len(name)), comment, problems)
