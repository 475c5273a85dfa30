"""Source text as lines, and lines as tokens with their columns.

Lossless: between two tokens of a line stand only blanks, so text and tokens together hold everything.
Nothing is refused here; what the language does not have becomes a token of kind `malformed` or `stray`.

Lexical grammar, one line at a time (fidelity TOOL-1, TOOL-2):

    comment    //  to the end of the line
    name       a letter or _, then letters, digits, _       (upper and lower case are the same)
    number     12   1.5   .5   2e3   $1F   %1011
    operator   + - * / ^ ( ) , : = #
"""

from __future__ import annotations

import re
from typing import Final, Literal, NamedTuple, Protocol, TypeVar, cast

T = TypeVar("T")
TokenKind = Literal["name", "number", "operator", "comment", "malformed", "stray"]

_TOKEN: Final = re.compile(
    r"""
    [\ \t\v\f\xa0\ufeff]*+ (?: \Z |
      (?P<name>      [A-Za-z_]\w*+ )
    | (?P<number>    (?: (?: \d++ (?: \.\d*+ )? | \.\d++ ) (?: [eE][+-]?\d++ )?
                       | \$[0-9A-Fa-f]++
                       | %[01]++ ) (?! [\w.] ) )
    | (?P<comment>   //.* )
    | (?P<operator>  [-+*/^(),:=\#] )
    | (?P<malformed> [$%]?[\w.]++ | [$%] )
    | (?P<stray>     [^\ \t\v\f\xa0\ufeff\w$%.+*/^(),:=\#-]++ ) )
    """,
    re.VERBOSE | re.ASCII | re.DOTALL,
)
BLANKS: Final = " \t\v\f\xa0\ufeff"
"""No-break spaces come along with text copied from a PDF; a byte order mark is no text at all."""


class _Make(Protocol):
    def __call__(self, cls: type[T], fields: tuple[object, ...], /) -> T: ...


make: Final = cast("_Make", tuple.__new__)  # pyright: ignore[reportUnknownMemberType]
"""`make(Token, (kind, text, start, end))` is `Token(...)` in a third of the time, for what each line needs."""


class Token(NamedTuple):
    """A word of a line; `start` and `end` count its characters from 0."""

    kind: TokenKind
    text: str
    start: int
    end: int


def tokenize(line: str, start: int = 0, end: int | None = None) -> list[Token]:
    """The tokens of one line between two columns, without the blanks between them."""
    tokens: list[Token] = []
    for match in _TOKEN.finditer(line, start, len(line) if end is None else end):
        kind = match.lastgroup
        if kind is not None:
            first, last = match.span(kind)
            tokens.append(make(Token, (kind, line[first:last], first, last)))
    return tokens


def first_token(line: str, start: int, end: int) -> Token:
    """The first token between two columns, where there is one."""
    match = _TOKEN.match(line, start, end)
    assert match is not None and match.lastgroup is not None
    first, last = match.span(match.lastgroup)
    return make(Token, (match.lastgroup, line[first:last], first, last))


def split_lines(text: str) -> list[str]:
    """The lines of `text` without their ends, which are LF, CR LF or CR; the last one may be empty."""
    if "\r" in text:
        text = text.replace("\r\n", "\n").replace("\r", "\n")
    return text.split("\n")


def number_value(text: str) -> float:
    """The value of a token of kind `number`, a minus before it included; infinite when out of all proportion."""
    if text.isdecimal() and len(text) < 16:
        return int(text)
    if text[0] in "$%":
        digits, base = text[1:], 16 if text[0] == "$" else 2
        return float(int(digits, base)) if len(digits) <= 128 else _large(digits, base)
    return float(text)


def _large(digits: str, base: int) -> float:
    digits = digits.lstrip("0")
    return float(int(digits or "0", base)) if len(digits) <= 128 else float("inf")
