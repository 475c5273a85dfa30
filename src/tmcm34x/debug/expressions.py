"""Conditions and watches: whole numbers, and what `view` knows by name.

    accumulator > 10 && gp[3] != 0          ap[1][0] / 64          !(in[255] & %100)

Loosest first: `||` or, `&&` and, `!` not, comparisons, `|`, `&`, shifts, `+ -`, `* / %`, sign and `~`.
Comparisons bind looser than the bit operators, so that `in[255] & 4 == 4` means what it seems to.  Division is
the module's own: toward zero.  Numbers are written as in TMCL sources: decimal, $hexadecimal, %binary; `^`, a
power there and something else elsewhere, is left out.
"""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Final, NamedTuple

from tmcm34x.firmware.program.registers import quotient, remainder

LONGEST: Final = 200
"""Characters of an expression: bounds its nesting too."""
_LARGEST_SHIFT: Final = 31

Read = Callable[[str, tuple[int, ...]], int]
"""Gives the value of a name with its indices; raises `ExpressionError`."""
Expression = Callable[[Read], int]


class ExpressionError(ValueError):
    """An expression that is not well formed, or has no value now; the text is one line."""


def _divide(x: int, y: int) -> int:
    if y == 0:
        raise ExpressionError("division by zero")
    return quotient(x, y)


def _modulo(x: int, y: int) -> int:
    if y == 0:
        raise ExpressionError("division by zero")
    return remainder(x, y)


def _shifting(shift: Callable[[int, int], int]) -> Callable[[int, int], int]:
    def call(x: int, y: int) -> int:
        if not 0 <= y <= _LARGEST_SHIFT:
            raise ExpressionError(f"a shift by {y}")
        return shift(x, y)

    return call


_OR, _AND, _NOT, _COMPARISON, _SIGN = 1, 2, 3, 4, 10
_BINARY: Final[Mapping[str, tuple[int, Callable[[int, int], int]]]] = MappingProxyType({
    "==": (_COMPARISON, int.__eq__), "!=": (_COMPARISON, int.__ne__), "<": (_COMPARISON, int.__lt__),
    "<=": (_COMPARISON, int.__le__), ">": (_COMPARISON, int.__gt__), ">=": (_COMPARISON, int.__ge__),
    "|": (5, int.__or__), "&": (6, int.__and__),
    "<<": (7, _shifting(int.__lshift__)), ">>": (7, _shifting(int.__rshift__)),
    "+": (8, int.__add__), "-": (8, int.__sub__),
    "*": (9, int.__mul__), "/": (9, _divide), "%": (9, _modulo),
})  # fmt: skip
_LOGICAL: Final = MappingProxyType({"||": _OR, "&&": _AND})
_UNARY: Final[Mapping[str, tuple[int, Callable[[int], int]]]] = MappingProxyType({
    "!": (_NOT, operator.not_), "-": (_SIGN, operator.neg), "+": (_SIGN, operator.pos), "~": (_SIGN, operator.invert),
})  # fmt: skip
_WORDS: Final = MappingProxyType({"or": "||", "and": "&&", "not": "!"})
_TOKEN: Final = re.compile(
    r"\s*(?:(?P<number>\d+|\$[0-9a-fA-F]+)\b|(?P<name>[A-Za-z_]\w*)"
    r"|(?P<sign>\|\||&&|==|!=|<=|>=|<<|>>|[-+*/%<>&|!~()\[\]])|(?P<end>\Z)|(?P<stray>.))"
)
_BITS: Final = re.compile(r"%[01]+\b")
_ASSIGNMENT: Final = re.compile(r"(?P<target>[^=!<>]+[^=!<>\s])\s*=(?!=)(?P<value>.+)\Z", re.DOTALL)
_PIECES: Final = re.compile(r"\{([^{}]*)\}")


class _Token(NamedTuple):
    kind: str
    text: str


class Reference(NamedTuple):
    """Something that can be assigned to: a name with its indices."""

    name: str
    indices: tuple[Expression, ...]


class Comparison(NamedTuple):
    """A reference, and what it is compared with."""

    reference: Reference
    other: Expression


def compile_expression(text: str) -> Expression:
    """What gives the value of `text`; raises `ExpressionError` where it is not well formed."""
    parser = _Parser(text)
    expression = parser.expression(0)
    parser.expect_end()
    return expression


def comparisons(text: str) -> list[Comparison]:
    """What `text` compares with something, where one side is a reference alone; raises `ExpressionError`."""
    parser = _Parser(text)
    parser.expression(0)
    parser.expect_end()
    return parser.comparisons


def compile_reference(text: str) -> Reference:
    """`text` as something to assign to; raises `ExpressionError` where it is none."""
    parser = _Parser(text)
    if parser.token.kind != "name":
        raise ExpressionError(f"nothing can be written to {text.strip()}")
    reference = parser.reference()
    parser.expect_end()
    return reference


def split_assignment(text: str) -> tuple[str, str] | None:
    """Both sides of `target = value`, or None where `text` is no assignment."""
    match = _ASSIGNMENT.match(text)
    return (match["target"], match["value"]) if match else None


def compile_message(text: str) -> Callable[[Read], str]:
    """A message whose `{expressions}` are replaced by their values, each time anew."""
    pieces = _PIECES.split(text)
    expressions = [compile_expression(piece) for piece in pieces[1::2]]

    def message(read: Read) -> str:
        values = [_shown(expression, read) for expression in expressions]
        return "".join(f"{a}{b}" for a, b in zip(pieces[::2], [*values, ""], strict=True))

    return message


def _shown(expression: Expression, read: Read) -> str:
    try:
        return str(int(expression(read)))
    except ExpressionError as error:
        return f"<{error}>"


class _Parser:
    """Precedence climbing; `token` is the next one."""

    def __init__(self, text: str) -> None:
        if len(text) > LONGEST:
            raise ExpressionError(f"longer than {LONGEST} characters")
        self._text = text
        self._position = 0
        self.comparisons: list[Comparison] = []
        self._alone: Reference | None = None
        """The reference that the last expression consists of, if it is one alone."""
        self.token = _Token("", "")
        self.take(operand_next=True)

    def take(self, *, operand_next: bool) -> str:
        """Go to the next token; gives back the text of the present one.  `%` is a sign only after an operand."""
        taken = self.token.text
        start = self._position
        while start < len(self._text) and self._text[start].isspace():
            start += 1
        bits = _BITS.match(self._text, start) if operand_next else None
        match = bits or _TOKEN.match(self._text, start)
        assert match is not None
        self._position = match.end()
        if bits is not None:
            self.token = _Token("number", bits[0])
        else:
            kind, text = match.lastgroup or "", match[match.lastgroup or 0]
            self.token = (
                _Token("sign", _WORDS[text.lower()]) if text.lower() in _WORDS else _Token(kind, text)
            )
        return taken

    def expect_end(self) -> None:
        if self.token.kind != "end":
            raise ExpressionError(f"'{self.token.text}' is not expected here")

    def expression(self, tightest: int) -> Expression:
        """An expression whose operators all bind tighter than `tightest`."""
        left = self.operand()
        while self.token.kind == "sign":
            sign = self.token.text
            precedence = _LOGICAL.get(sign) or _BINARY.get(sign, (0,))[0]
            if precedence <= tightest:
                break
            self.take(operand_next=True)
            reference, self._alone = self._alone, None
            right = self.expression(precedence)
            if precedence == _COMPARISON:
                self._note_comparison(reference, left, right)
            self._alone = None
            left = _join(sign, left, right)
        return left

    def _note_comparison(self, reference: Reference | None, left: Expression, right: Expression) -> None:
        if reference is not None:
            self.comparisons.append(Comparison(reference, right))
        if self._alone is not None:
            self.comparisons.append(Comparison(self._alone, left))

    def operand(self) -> Expression:
        kind, text = self.token
        self._alone = None
        if kind == "number":
            self.take(operand_next=False)
            value = _number(text)
            return lambda _read: value
        if kind == "name":
            reference = self.reference()
            self._alone = reference
            return _reader(reference)
        if text in _UNARY:
            precedence, call = _UNARY[text]
            self.take(operand_next=True)
            inner = self.expression(precedence)
            self._alone = None
            return lambda read: call(inner(read))
        if text == "(":
            self.take(operand_next=True)
            inner = self.expression(0)
            self._close(")")
            return inner
        raise ExpressionError(f"a value is missing {f'before {text!r}' if text else 'at the end'}")

    def reference(self) -> Reference:
        name = self.take(operand_next=False)
        indices: list[Expression] = []
        while self.token.text == "[":
            self.take(operand_next=True)
            indices.append(self.expression(0))
            self._close("]")
        return Reference(name, tuple(indices))

    def _close(self, sign: str) -> None:
        if self.token.text != sign:
            raise ExpressionError(f"'{sign}' is missing")
        self.take(operand_next=False)


def _number(text: str) -> int:
    if text[0] in "$%":
        return int(text[1:], 16 if text[0] == "$" else 2)
    return int(text)


def _join(sign: str, left: Expression, right: Expression) -> Expression:
    if sign == "||":
        return lambda read: bool(left(read) or right(read))
    if sign == "&&":
        return lambda read: bool(left(read) and right(read))
    call = _BINARY[sign][1]
    return lambda read: call(left(read), right(read))


def values_of(indices: Sequence[Expression], read: Read) -> tuple[int, ...]:
    """The values of a reference's indices now."""
    return tuple(int(index(read)) for index in indices)


def _reader(reference: Reference) -> Expression:
    name, indices = reference
    return lambda read: read(name, values_of(indices, read))
