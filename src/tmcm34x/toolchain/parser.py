"""Lines of source text to statements.

Each line stands alone, so `parse_line` is a function of its text and nothing else.  Grammar:

    line       = { label } [ statement ] [ comment ]
    label      = name ":"
    statement  = name "=" expression
               | "#" "include" file
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
    Expression,
    ExpressionError,
    compile_expression,
    lexical_error,
    quoted,
)
from tmcm34x.toolchain.tokens import BLANK, Token, make, tokenize

_BLANKS: Final = rf"{BLANK}*+"
_NAME: Final = r"[A-Za-z_]\w*+"
_LABEL: Final = re.compile(rf"({_NAME}){_BLANKS}:", re.ASCII)
_HEAD: Final = re.compile(rf"{_BLANKS}((?:{_NAME}{_BLANKS}:{_BLANKS})*+)({_NAME})?{_BLANKS}(=)?", re.ASCII)
_NEXT_WORD: Final = re.compile(rf"{_BLANKS}({_NAME})", re.ASCII)
_PLAIN: Final = re.compile(rf"{_BLANKS}(?:(-?\d{{1,15}}+)|({_NAME})){_BLANKS}", re.ASCII)
"""Nearly all operands: a whole number or a name."""
_DATA: Final = re.compile(rf"//!{_BLANKS}(DATA)\b", re.IGNORECASE | re.ASCII)
_INCLUDE: Final = re.compile(rf"{_BLANKS}(#{_BLANKS}(\w*)){_BLANKS}", re.ASCII)


class Problem(NamedTuple):
    """A mistake in one line; columns count from 0."""

    code: str
    start: int
    end: int
    text: str


class Command(NamedTuple):
    """A mnemonic and its operands; an operand that could not be parsed is None."""

    mnemonic: Token
    operands: tuple[Expression | None, ...]
    end: int


class Constant(NamedTuple):
    """`name = value`; value is None when it could not be parsed."""

    name: Token
    value: Expression | None


class Include(NamedTuple):
    """`#include file`; the file as written, without quotes."""

    file: str
    start: int
    end: int


class Data(NamedTuple):
    """`//! DATA number, type, motor, value`."""

    keyword: Token
    operands: tuple[Expression | None, ...]
    end: int


Statement = Command | Constant | Include | Data


class Line(NamedTuple):
    """What one line holds."""

    labels: tuple[Token, ...]
    statement: Statement | None
    comment: Token | None
    problems: tuple[Problem, ...]


def parse_line(text: str) -> Line:
    """The statement in one line, its labels and comment, and what is wrong with it."""
    slashes = text.find("//")
    end = len(text) if slashes < 0 else slashes
    comment = None if slashes < 0 else make(Token, ("comment", text[slashes:], slashes, len(text)))
    head = _HEAD.match(text, 0, end)
    assert head is not None
    names, name, equals = head.groups()
    labels = _labels(text, head.start(1), head.end(1)) if names else ()
    problems: list[Problem] = []
    if name is None:
        if head.end() < end:
            return _without_name(text, labels, comment, head.end(2) if equals is None else head.start(3), end)
        pragma = None if comment is None else _DATA.match(comment.text)
        if pragma is not None:
            return _data(text, labels, slashes, pragma)
        return Line(labels, None, comment, ())
    token = make(Token, ("name", name, *head.span(2)))
    if equals is not None:
        return Line(
            labels, Constant(token, _operand(text, head.end(), end, problems)), comment, tuple(problems)
        )
    start = token.end
    if name.upper() not in BY_MNEMONIC:
        following = _NEXT_WORD.match(text, start, end)
        if following is not None and following.group(1).upper() in BY_MNEMONIC:
            problems.append(Problem("E103", token.start, start, f"a label ends with ':': {shown(name)}:"))
            labels = (*labels, token)
            token = Token("name", following.group(1), *following.span(1))
            start = token.end
    operands, last = _operands(text, start, end, problems)
    return make(Line, (labels, make(Command, (token, operands, last)), comment, tuple(problems)))


def _labels(text: str, start: int, end: int) -> tuple[Token, ...]:
    return tuple(Token("name", match[1], *match.span(1)) for match in _LABEL.finditer(text, start, end))


def _operands(
    text: str, start: int, end: int, problems: list[Problem]
) -> tuple[tuple[Expression | None, ...], int]:
    """The operands between two columns, separated by commas; and where the last one ends."""
    segments = text[start:end].split(",")
    if len(segments) == 1 and not segments[0].strip():
        return (), start
    operands: list[Expression | None] = []
    for segment in segments:
        stop = start + len(segment)
        operands.append(_operand(text, start, stop, problems))
        start = stop + 1
    last = operands[-1]
    return tuple(operands), end if last is None else last.end


def _operand(text: str, start: int, end: int, problems: list[Problem]) -> Expression | None:
    """The expression between two columns."""
    plain = _PLAIN.fullmatch(text, start, end)
    if plain is not None:
        number, name = plain.groups()
        if name is None:
            return make(Expression, (*plain.span(1), float(number), None, ()))
        start, end = plain.span(2)
        return make(Expression, (start, end, None, make(Token, ("name", name, start, end)), ()))
    tokens = tokenize(text, start, end)
    try:
        if tokens:
            return compile_expression(tokens)
        place, what = (
            (start - 1, start) if text[start - 1] in ",=" else (start, start + 1),
            "an operand is missing",
        )
        problems.append(Problem("E103", *place, what))
    except ExpressionError as error:
        problems.append(Problem(error.code, error.start, error.end, error.text))
    return None


def _without_name(text: str, labels: tuple[Token, ...], comment: Token | None, start: int, end: int) -> Line:
    """A line whose statement does not begin with a name."""
    head = tokenize(text, start, end)[0]
    if head.text == "#" and not labels:
        return _include(text)
    if head.kind in ("malformed", "stray"):
        error = lexical_error(head)
        problem = Problem(error.code, error.start, error.end, error.text)
    else:
        what = f"a command, label or constant is missing before {quoted(head)}"
        problem = Problem("E103", head.start, head.end, what)
    return Line(labels, None, comment, (problem,))


def _data(text: str, labels: tuple[Token, ...], slashes: int, pragma: re.Match[str]) -> Line:
    first, start = (slashes + column for column in pragma.span(1))
    keyword = Token("name", pragma.group(1), first, start)
    slashes = text.find("//", start)
    end = len(text) if slashes < 0 else slashes
    comment = None if slashes < 0 else Token("comment", text[slashes:], slashes, len(text))
    problems: list[Problem] = []
    operands, last = _operands(text, start, end, problems)
    return Line(labels, Data(keyword, operands, last), comment, tuple(problems))


def _include(text: str) -> Line:
    match = _INCLUDE.match(text)
    assert match is not None
    start, end = match.span(1)
    if match.group(2).lower() != "include":
        problem = Problem("E103", start, end, f"no directive {shown(match.group(1))}; there is only #include")
        return Line((), None, None, (problem,))
    position = match.end()
    slashes = text.find("//", position)
    comment = Token("comment", text[slashes:], slashes, len(text)) if slashes >= 0 else None
    name = (text[position:slashes] if comment else text[position:]).strip(" \t\xa0")
    if not name:
        return Line((), None, comment, (Problem("E103", start, end, "the name of a file is missing"),))
    place = text.index(name, position)
    bare = name[1:-1] if len(name) > 2 and name[0] == name[-1] == '"' else name
    return Line((), Include(bare, place, place + len(name)), comment, ())
