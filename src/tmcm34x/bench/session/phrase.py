"""Phrases: lines of fixed words and slots, such as `motor {0..2} {left|right} switch {closes|opens}`.

A slot is a choice of words, a range of integers, or one of the kinds in `_KINDS`.  A line that is no phrase gives an
error at the column of the first word that fits none, with the words that would fit and the nearest of them.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from math import isfinite
from typing import Any, Final, NamedTuple

from tmcm34x.toolchain.mending.spelling import limit, proposal

_PART: Final = re.compile(r"\{([^}]*)\}|(\S+)")
_WORD: Final = re.compile(r"\S+")
_RANGE: Final = re.compile(r"(-?\d+)\.\.(-?\d+)\Z")
NUMBER: Final = r"(?:-?\d+|\$[0-9A-Fa-f]+)"
_SPAN: Final = re.compile(rf"({NUMBER})(?:\.\.({NUMBER}))?\Z")
_FLOAT: Final = r"-?(?:\d+\.\d*|\d+)"
_FLOAT_SPAN: Final = re.compile(rf"({_FLOAT}?)(?:\.\.({_FLOAT}))?\Z")
_BITS: Final = re.compile(r"[01]{8}\Z")


class LineError(ValueError):
    """A line that cannot be read: why, and at which character of it, counted from 0."""

    def __init__(self, problem: str, column: int = 0) -> None:
        super().__init__(problem)
        self.problem = problem
        self.column = column


class Slot(NamedTuple):
    """One part of a phrase.

    expected: what it takes, in words
    words: the words it takes, where it is a choice
    read: from a word to its value; raises `ValueError`
    """

    expected: str
    words: tuple[str, ...]
    read: Callable[[str], Any]


def read_number(text: str) -> int:
    """A decimal number, or a hexadecimal one after `$`."""
    return int(text[1:], 16) if text.startswith("$") else int(text)


def read_byte(text: str, what: str, column: int = 0) -> int:
    """The number of `what`, 0..255, at a column of its line.  Raises `LineError`."""
    value = read_number(text)
    if not 0 <= value <= 0xFF:
        raise LineError(f"{what} is 0..255, not {text}", column)
    return value


def check_span(low: float | None, high: float, column: int = 0) -> None:
    """Raises `LineError` for a range without a number in it."""
    if low is not None and low > high:
        raise LineError(f"a range goes from the lower number to the higher: {high}..{low}", column)


def read_span(text: str) -> tuple[int, int]:
    """`5` or `5..8` as the lowest and the highest number."""
    match = _SPAN.match(text)
    if match is None:
        raise ValueError(text)
    low, high = read_number(match[1]), read_number(match[2] or match[1])
    check_span(low, high)
    return low, high


def _read_float(text: str) -> float:
    value = float(text)
    if not isfinite(value):
        raise ValueError(text)
    return value


def _read_float_span(text: str) -> tuple[float, float]:
    low_text, separator, high_text = text.partition("..")
    low = _read_float(low_text)
    high = _read_float(high_text) if separator else low
    check_span(low, high)
    return low, high


def _read_bits(text: str) -> str:
    if not _BITS.match(text):
        raise ValueError(text)
    return text


_KINDS: Final[dict[str, Slot]] = {
    "number": Slot("a number", (), _read_float),
    "integers": Slot("an integer or a range a..b", (), read_span),
    "numbers": Slot("a number or a range a..b", (), _read_float_span),
    "bits": Slot("eight bits", (), _read_bits),
    "name": Slot("a name", (), str),
}


def _choice(words: tuple[str, ...]) -> Slot:
    def read(text: str) -> str:
        if text not in words:
            raise ValueError(text)
        return text

    return Slot(" or ".join(words), words, read)


def _integer(low: int, high: int) -> Slot:
    def read(text: str) -> int:
        value = read_number(text)
        if not low <= value <= high:
            raise ValueError(text)
        return value

    return Slot(f"a number {low}..{high}", (), read)


def _slot(text: str) -> Slot:
    if match := _RANGE.match(text):
        return _integer(int(match.group(1)), int(match.group(2)))
    return _KINDS.get(text) or _choice(tuple(text.split("|")))


class Phrase(NamedTuple):
    """A line that is understood: its parts, and what it stands for."""

    parts: tuple[Slot, ...]
    fixed: tuple[bool, ...]
    meaning: Any

    def match(self, words: Sequence[str]) -> tuple[int, list[Any]]:
        """How many words fit, and the values of the slots among them."""
        values: list[Any] = []
        for n, (word, slot, fixed) in enumerate(zip(words, self.parts, self.fixed, strict=False)):
            try:
                value = slot.read(word)
            except ValueError:
                return n, values
            if not fixed:
                values.append(value)
        return min(len(words), len(self.parts)), values


def phrase(text: str, meaning: Any) -> Phrase:
    """The phrase in `text`, with slots in braces."""
    parts = [(slot, word) for slot, word in _PART.findall(text)]
    slots = tuple(_slot(slot) if slot else _choice((word,)) for slot, word in parts)
    return Phrase(slots, tuple(not slot for slot, _ in parts), meaning)


def read_phrase(text: str, phrases: Sequence[Phrase], start: int = 0) -> tuple[Any, tuple[Any, ...]]:
    """Meaning and slot values of the phrase in `text` from character `start` on.  Raises `LineError`."""
    found = [(match.group(), match.start()) for match in _WORD.finditer(text, start)]
    words = [word for word, _ in found]
    best, wanted = -1, list[Slot | None]()
    for candidate in phrases:
        fit, values = candidate.match(words)
        if fit == len(words) == len(candidate.parts):
            return candidate.meaning, tuple(values)
        if fit > best:
            best, wanted = fit, []
        if fit == best:
            wanted.append(candidate.parts[fit] if fit < len(candidate.parts) else None)
    word, column = found[best] if best < len(found) else ("", len(text.rstrip()))
    raise LineError(_complaint(word, wanted), column)


def _complaint(word: str, wanted: Sequence[Slot | None]) -> str:
    texts = dict.fromkeys("the end of the line" if slot is None else slot.expected for slot in wanted)
    problem = f"expected {', '.join(texts)}" + (f", got {word}" if word else "")
    words = [known for slot in wanted if slot is not None for known in slot.words if known != word]
    return problem + proposal(word, words, max(1, limit(word)))
