"""The registers of a stand-alone program, and its arithmetic.

Source: manual 6.7.16 to 6.7.21, 6.7.29; fidelity PROG-1 to PROG-3.
"""

from __future__ import annotations

from math import isnan
from typing import Any, Final

from tmcm34x.tmcl.commands import FLAGS

ERROR_FLAGS: Final = {word: 1 << (number - 1) for word, number in FLAGS if number}
"""Bits of `Registers.errors` by the word that CLE and JC use."""

NOT_COMPARED: Final = float("nan")
"""A difference that is neither equal, greater nor lower: no COMP has been executed yet."""

Contents = tuple[Any, ...]
"""All registers and user variables as one value, equal for two equal states."""


NAMES: Final = "accumulator", "counter", "difference", "errors", "result", "stack", "variables", "x"
"""What a register command can read or change."""


class Registers:
    """Everything that a register command can read or change."""

    __slots__ = ("accumulator", "counter", "difference", "errors", "result", "stack", "variables", "x")

    def __init__(self, variables: list[int]) -> None:
        self.accumulator = 0
        self.x = 0
        self.result = 0
        """What ZE and NZ look at: the last value loaded or calculated, or COMP's difference."""
        self.difference: float = NOT_COMPARED
        """What EQ to LE look at: accumulator minus COMP's operand, at the last COMP."""
        self.errors = 0
        self.counter = 0
        self.stack: list[int] = []
        self.variables = variables
        self.reset()

    @property
    def flags(self) -> dict[str, bool]:
        """All flags that JC looks at, by name."""
        return {
            "zero": self.result == 0,
            "equal": self.difference == 0,
            "lower": self.difference < 0,
            "greater": self.difference > 0,
            **{word: bool(self.errors & bit) for word, bit in ERROR_FLAGS.items()},
        }

    def reset(self) -> None:
        """Control function 131: everything but the user variables as after power-on."""
        self.accumulator = self.x = self.errors = self.counter = 0
        self.result = 1
        self.difference = NOT_COMPARED
        self.stack.clear()

    def load(self, value: int) -> None:
        """Put what a command has read into the accumulator, and set the zero flag by it."""
        self.accumulator = self.result = value

    def assign(self, other: Registers) -> None:
        """Take over the contents of `other`."""
        self.accumulator, self.x = other.accumulator, other.x
        self.result, self.difference = other.result, other.difference
        self.errors, self.counter = other.errors, other.counter
        self.stack[:] = other.stack
        self.variables[:] = other.variables

    def contents(self) -> Contents:
        """A value that is equal for two equal states."""
        return (
            self.counter, self.accumulator, self.x, self.result, _plain(self.difference), self.errors,
            tuple(self.stack), tuple(self.variables),
        )  # fmt: skip

    def __reduce__(self) -> tuple[Any, ...]:
        """A copy has the same contents."""
        return _copied, (self.contents(),)

    def restore(self, contents: Contents) -> None:
        """Go back to a state that `contents` gave."""
        self.counter, self.accumulator, self.x, self.result, difference, self.errors = contents[:6]
        self.difference = NOT_COMPARED if difference is None else difference
        self.stack[:], self.variables[:] = contents[6:]


def _copied(contents: Contents) -> Registers:
    """Registers with these contents."""
    registers = Registers([])
    registers.restore(contents)
    return registers


def _plain(difference: float) -> int | None:
    """A difference that equals itself, on either core a whole number: None before the first COMP."""
    return None if isnan(difference) else int(difference)


def quotient(dividend: int, divisor: int) -> int:
    """`dividend / divisor` rounded toward zero; the dividend itself when dividing by zero (fidelity PROG-3)."""
    if divisor == 0:
        return dividend
    magnitude = abs(dividend) // abs(divisor)
    return magnitude if (dividend < 0) == (divisor < 0) else -magnitude


def remainder(dividend: int, divisor: int) -> int:
    """What `quotient` leaves, with the sign of the dividend; the dividend itself when dividing by zero."""
    return dividend - divisor * quotient(dividend, divisor) if divisor else dividend
