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
from tmcm34x.toolchain.tokens import Token, tokenize

_DATA: Final = re.compile(r"//!\s*(DATA)\b", re.IGNORECASE)
_INCLUDE: Final = re.compile(r"[\s\xa0\ufeff]*(#\s*(\w*))[ \t]*", re.ASCII)


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
    tokens = tokenize(text)
    if not tokens:
        return _EMPTY
    if tokens[0].text == "#":
        return _include(text)
    comment = tokens.pop() if tokens[-1].kind == "comment" else None
    first = 0
    while first + 1 < len(tokens) and tokens[first + 1].text == ":" and tokens[first].kind == "name":
        first += 2
    labels = tuple(tokens[:first:2])
    if comment is not None and first == len(tokens):
        pragma = _DATA.match(comment.text)
        if pragma is not None:
            return _data(text, labels, comment, pragma)
    if first == len(tokens):
        return Line(labels, None, comment, ())
    problems: list[Problem] = []
    if _is_label_without_colon(tokens, first):
        head = tokens[first]
        problems.append(Problem("E103", head.start, head.end, f"a label ends with ':': {shown(head.text)}:"))
        labels, first = (*labels, head), first + 1
    statement = _statement(tokens, first, problems)
    return Line(labels, statement, comment, tuple(problems))


_EMPTY: Final = Line((), None, None, ())


def _statement(tokens: list[Token], first: int, problems: list[Problem]) -> Statement | None:
    head = tokens[first]
    if head.kind != "name":
        problems.append(_bad_head(head))
        return None
    if first + 1 < len(tokens) and tokens[first + 1].text == "=":
        equals = tokens[first + 1]
        value = _expression(tokens[first + 2 :], equals, problems)
        return Constant(head, value)
    return Command(head, _operands(tokens, first + 1, problems), tokens[-1].end)


def _is_label_without_colon(tokens: list[Token], first: int) -> bool:
    """Whether the name at `first` is no command but stands before one."""
    return (
        first + 1 < len(tokens)
        and tokens[first].kind == "name"
        and tokens[first + 1].text.upper() in BY_MNEMONIC
        and tokens[first].text.upper() not in BY_MNEMONIC
    )


def _bad_head(head: Token) -> Problem:
    if head.kind in ("malformed", "stray"):
        error = lexical_error(head)
        return Problem(error.code, error.start, error.end, error.text)
    return Problem(
        "E103", head.start, head.end, f"a command, label or constant is missing before {quoted(head)}"
    )


def _operands(tokens: list[Token], first: int, problems: list[Problem]) -> tuple[Expression | None, ...]:
    """The operands in `tokens` from index `first` on, separated by commas."""
    count = len(tokens)
    if first == count:
        return ()
    operands: list[Expression | None] = []
    start = first
    for index in range(first, count):
        if tokens[index].text == ",":
            operands.append(_expression(tokens[start:index], tokens[index], problems))
            start = index + 1
    operands.append(_expression(tokens[start:], tokens[-1], problems))
    return tuple(operands)


def _expression(tokens: list[Token], beside: Token, problems: list[Problem]) -> Expression | None:
    if not tokens:
        problems.append(
            Problem("E103", beside.start, beside.end, f"an operand is missing beside '{beside.text}'")
        )
        return None
    try:
        return compile_expression(tokens)
    except ExpressionError as error:
        problems.append(Problem(error.code, error.start, error.end, error.text))
        return None


def _data(text: str, labels: tuple[Token, ...], comment: Token, pragma: re.Match[str]) -> Line:
    start, end = pragma.span(1)
    keyword = Token("name", pragma.group(1), comment.start + start, comment.start + end)
    tokens = [keyword, *tokenize(text, keyword.end)]
    rest = tokens.pop() if tokens[-1].kind == "comment" else None
    problems: list[Problem] = []
    operands = _operands(tokens, 1, problems)
    return Line(labels, Data(keyword, operands, tokens[-1].end), rest, tuple(problems))


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
