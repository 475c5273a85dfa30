"""Constant expressions: compiled to postfix once, evaluated in floating point.

Operators, loosest first, with the usual precedence (fidelity TOOL-4):

    +  -        two operands, from the left
    *  /        two operands, from the left; / keeps the fraction
    -  +        sign of what follows: -2^2 is -4
    ^           power, from the right: 2^3^2 is 2^9

Functions take one operand in parentheses, angles in radians.  Where a command takes a whole number the
result is rounded to the nearest, halves to the even neighbour (fidelity TOOL-5).  No step uses recursion: a
line of a million parentheses is a diagnostic or a number, like any other.

Source: facts of the TMCL-IDE's assembler; see docs/language.md.
"""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Final, NamedTuple

from tmcm34x.toolchain.diagnostics import did_you_mean, shown
from tmcm34x.toolchain.mending.spelling import nearest
from tmcm34x.toolchain.tokens import Token, number_value


class Function(NamedTuple):
    """One row of `FUNCTIONS`."""

    call: Callable[[float], float]
    meaning: str


def _add(x: float, y: float) -> float:
    return x + y


def _subtract(x: float, y: float) -> float:
    return x - y


def _multiply(x: float, y: float) -> float:
    return x * y


def _divide(x: float, y: float) -> float:
    return x / y


def _sign(x: float) -> float:
    return float((x > 0) - (x < 0))


def _round(x: float) -> float:
    return float(round(x))


def _truncate(x: float) -> float:
    return float(math.trunc(x))


FUNCTIONS: Final[Mapping[str, Function]] = MappingProxyType({
    "SIN": Function(math.sin, "sine of an angle in radians"),
    "COS": Function(math.cos, "cosine of an angle in radians"),
    "TAN": Function(math.tan, "tangent of an angle in radians"),
    "ASIN": Function(math.asin, "angle in radians with this sine, -1 to 1"),
    "ACOS": Function(math.acos, "angle in radians with this cosine, -1 to 1"),
    "ATAN": Function(math.atan, "angle in radians with this tangent"),
    "LOG": Function(math.log10, "logarithm to base 10"),
    "LN": Function(math.log, "natural logarithm"),
    "EXP": Function(math.exp, "e to the power of the operand"),
    "SQRT": Function(math.sqrt, "square root"),
    "ABS": Function(abs, "the operand without its sign"),
    "INT": Function(_truncate, "the operand without its fraction"),
    "ROUND": Function(_round, "the nearest whole number, halves to the even one"),
    "SIGN": Function(_sign, "-1, 0 or 1: the sign of the operand"),
    "DEG": Function(math.degrees, "an angle in degrees, from radians"),
    "RAD": Function(math.radians, "an angle in radians, from degrees"),
})  # fmt: skip
"""The functions, by name."""

_BINARY: Final[Mapping[str, tuple[int, Callable[[float, float], float]]]] = MappingProxyType({
    "+": (1, _add), "-": (1, _subtract), "*": (2, _multiply), "/": (2, _divide), "^": (4, math.pow),
})  # fmt: skip
_SIGN_PRECEDENCE: Final = 3
_OPEN: Final = 0

Step = tuple[str, Token, object]
"""One postfix step: `number` with its value, `name`, `binary` or `unary` with what to call; and its token."""


class Expression(NamedTuple):
    """A compiled expression at the columns `start` to `end` of its line."""

    start: int
    end: int
    steps: tuple[Step, ...]


Operand = Token | Expression
"""A number, with a minus or not, or a name that stands alone is its token; all else is compiled."""


class SourceExpressionError(Exception):
    """An expression that cannot be compiled or has no value.

    start, end: columns, from 0, of what is wrong with it
    replacement: what would be right there, where that is known
    """

    def __init__(self, code: str, start: int, end: int, text: str, replacement: str | None = None) -> None:
        super().__init__(text)
        self.problem = (code, start, end, text, replacement)


class UnknownValueError(SourceExpressionError):
    """A constant whose own definition has a mistake: there is no more to report of what uses it."""

    def __init__(self, name: Token) -> None:
        super().__init__("E401", name.start, name.end, f"{shown(name.text)} has no value")


def compile_expression(tokens: Sequence[Token]) -> Operand:
    """The expression in `tokens`, at least one; raises `SourceExpressionError` where it is not well formed."""
    first = tokens[0]
    if len(tokens) == 1 and first.kind in ("number", "name"):
        return first
    return _Compiler(tokens).run()


class _Compiler:
    """Shunting yard: operands go straight to `steps`, operators wait on `waiting` for their operands."""

    def __init__(self, tokens: Sequence[Token]) -> None:
        self.tokens = tokens
        self.steps: list[Step] = []
        self.waiting: list[tuple[int, Step]] = []

    def run(self) -> Expression:
        operand_next = True
        for index, token in enumerate(self.tokens):
            if token.kind in ("malformed", "stray"):
                raise lexical_error(token)
            operand_next = self.take_operand(index, token) if operand_next else self.take_operator(token)
        last = self.tokens[-1]
        if operand_next:
            raise SourceExpressionError(
                "E103", last.start, last.end, f"a number or name is missing after '{last.text}'"
            )
        self.flush(_OPEN)
        if self.waiting:
            opening = self.waiting[-1][1][1]
            raise SourceExpressionError(
                "E103", opening.start, opening.end, "this parenthesis is never closed"
            )
        return Expression(self.tokens[0].start, last.end, tuple(self.steps))

    def take_operand(self, index: int, token: Token) -> bool:
        """Takes a token where an operand may begin; returns whether one is still needed."""
        if token.kind == "number":
            self.steps.append(("number", token, number_value(token.text)))
            return False
        if token.kind == "name":
            if index + 1 < len(self.tokens) and self.tokens[index + 1].text == "(":
                function = FUNCTIONS.get(token.text.upper())
                if function is None:
                    raise _unknown_function(token)
                self.waiting.append((5, ("unary", token, function.call)))
                return True
            self.steps.append(("name", token, None))
            return False
        if token.text == "(":
            self.waiting.append((_OPEN, ("(", token, None)))
        elif token.text == "-":
            self.waiting.append((_SIGN_PRECEDENCE, ("unary", token, operator.neg)))
        elif token.text != "+":
            raise SourceExpressionError(
                "E103", token.start, token.end, f"a number or name is missing before '{token.text}'"
            )
        return True

    def take_operator(self, token: Token) -> bool:
        """Takes a token where an operand is complete; returns whether another one is needed."""
        if token.text == ")":
            self.flush(_OPEN)
            if not self.waiting:
                raise SourceExpressionError(
                    "E103", token.start, token.end, "this parenthesis was never opened"
                )
            self.waiting.pop()
            return False
        if token.text not in _BINARY:
            raise SourceExpressionError(
                "E103", token.start, token.end, f"an operator or ',' is missing before {quoted(token)}"
            )
        precedence, call = _BINARY[token.text]
        self.flush(precedence if token.text == "^" else precedence - 1)
        self.waiting.append((precedence, ("binary", token, call)))
        return True

    def flush(self, precedence: int) -> None:
        """Moves what binds tighter than `precedence` to the steps, up to an open parenthesis."""
        while self.waiting and self.waiting[-1][0] > precedence:
            self.steps.append(self.waiting.pop()[1])


def _unknown_function(token: Token) -> SourceExpressionError:
    near = nearest(token.text.upper(), FUNCTIONS)
    text = f"no function {shown(token.text)}{did_you_mean(near)}"
    return SourceExpressionError("E301", token.start, token.end, text, near[0] if len(near) == 1 else None)


def evaluate(operand: Operand, value_of: Callable[[Token], float]) -> float:
    """The operand's value; `value_of` gives those of names, and may raise `SourceExpressionError` itself."""
    if isinstance(operand, Token):
        return value_of(operand) if operand.kind == "name" else number_value(operand.text)
    stack: list[float] = []
    for kind, token, what in operand.steps:
        if kind == "number":
            stack.append(what)  # type: ignore[arg-type]
        elif kind == "name":
            stack.append(value_of(token))
        else:
            last = stack.pop()
            operands = (last,) if kind == "unary" else (stack.pop(), last)
            try:
                stack.append(what(*operands))  # type: ignore[operator]
            except (ArithmeticError, ValueError) as error:
                raise _no_value(token, operands, error) from None
    return stack[0]


def names_in(operand: Operand | None) -> Iterator[Token]:
    """The names of constants and labels in an operand."""
    if isinstance(operand, Token):
        if operand.kind == "name":
            yield operand
    elif operand is not None:
        yield from (token for kind, token, _ in operand.steps if kind == "name")


def _no_value(token: Token, operands: tuple[float, ...], error: Exception) -> SourceExpressionError:
    if isinstance(error, ZeroDivisionError):
        return SourceExpressionError("E401", token.start, token.end, "division by zero")
    listed = " and ".join(f"{x:g}" for x in operands)
    text = f"{shown(token.text.upper())} has no value for {listed}"
    return SourceExpressionError("E401", token.start, token.end, text)


_LOOKALIKES: Final = str.maketrans("OoIiLl", "001111")
_NOTATIONS: Final = tuple(
    (re.compile(pattern, re.IGNORECASE), right, hint)
    for pattern, right, hint in (
        (r"0x([0-9a-f]+)", r"$\1", "hexadecimal numbers are written {}"),
        (r"0b([01]+)", r"%\1", "binary numbers are written {}"),
        (r"0*([0-9a-f]+)h", r"$\1", "hexadecimal numbers are written {}"),
        (r"([01]{3,})b", r"%\1", "binary numbers are written {}"),
        (r"(\d+)0ms", r"\1", "a number has no unit, and WAIT counts in 10 ms: {}"),
        (r"(\d+)s", r"\g<1>00", "a number has no unit, and WAIT counts in 10 ms: {}"),
        (r"(\d+(?:\.\d+)?)(?:ms|s|us|mm|rpm|rps|hz|khz|ma|a|v|deg|ticks?)", "", "a number has no unit"),
        (r"(?=[0-9.]*[OIL])([0-9OIL]+(?:\.[0-9OIL]+)?)", r"\1", "with digits for its letters it is {}"),
        (r"(\d+)[_'](\d+)", r"\1\2", "digits stand together: {}"),
    )
)
"""Numbers of other languages: what they look like, how TMCL writes them, and the hint."""


def lexical_error(token: Token) -> SourceExpressionError:
    """Why a `malformed` or `stray` token cannot stand in a source text."""
    text = token.text
    if token.kind != "malformed":
        return SourceExpressionError(
            "E101", token.start, token.end, f"{quoted(token)} is not part of the language"
        )
    for pattern, right, hint in _NOTATIONS:
        match = pattern.fullmatch(text)
        if match is not None:
            replacement = match.expand(right).translate(_LOOKALIKES) if right else None
            return SourceExpressionError(
                "E102",
                token.start,
                token.end,
                f"{shown(text)} is not a number; {hint.format(replacement)}",
                replacement,
            )
    return SourceExpressionError("E102", token.start, token.end, f"{shown(text)} is not a number")


def quoted(token: Token) -> str:
    """A token as a message shows it."""
    return f"'{shown(token.text)}'"
