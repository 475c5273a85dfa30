"""Texts that an editor changes piece by piece.

Lines end with LF, CR LF or CR, as the protocol counts them; characters are counted in the client's units.

Source: Language Server Protocol 3.17, `TextDocumentContentChangeEvent`.
"""

from __future__ import annotations

import re
from typing import Final, Literal

Units = Literal["utf-8", "utf-16", "utf-32"]
_LINE_END: Final = re.compile(r"\r\n|\r|\n")


def replaced(text: str, start: tuple[int, int], end: tuple[int, int], new: str, units: Units) -> str:
    """`text` with `new` between two places, which are lines and characters counted from 0.

    A position after the end of its line is the end of the line, and one after the last line the end of the text.
    """
    first, last = offset(text, *start, units), offset(text, *end, units)
    return text[:first] + new + text[max(first, last) :]


def offset(text: str, line: int, character: int, units: Units) -> int:
    """The place in `text` of a character on a line."""
    begin = _line_start(text, line)
    if begin is None:
        return len(text)
    match = _LINE_END.search(text, begin)
    content = text[begin : match.start() if match is not None else len(text)]
    return begin + column(content, character, units)


def _line_start(text: str, line: int) -> int | None:
    if "\r" not in text:
        begin = 0
        for _ in range(line):
            begin = text.find("\n", begin) + 1
            if not begin:
                return None
        return begin
    begin = 0
    for _ in range(line):
        match = _LINE_END.search(text, begin)
        if match is None:
            return None
        begin = match.end()
    return begin


def column(line: str, character: int, units: Units) -> int:
    """The number of characters of `line` that make so many of the client's units."""
    if units == "utf-32" or line.isascii():
        return min(character, len(line))
    passed = 0
    for place, letter in enumerate(line):
        if passed >= character:
            return place
        passed += width(letter, units)
    return len(line)


def width(text: str, units: Units) -> int:
    """The length of `text` in the client's units."""
    if units == "utf-32" or text.isascii():
        return len(text)
    if units == "utf-8":
        return len(text.encode("utf-8", "surrogatepass"))
    return len(text) + sum(character > "\uffff" for character in text)
