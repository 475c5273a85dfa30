"""Repairs of what stands between names and numbers: characters, commas, parentheses, comments."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import pairwise
from typing import Final

from tmcm34x.toolchain.diagnostics import shown
from tmcm34x.toolchain.mending import words
from tmcm34x.toolchain.mending.text import NAME, Change, Repair, TakenApart, change
from tmcm34x.toolchain.tokens import BLANKS, Token, tokenize

_CALLED: Final = re.compile(rf"({NAME})\s*(\()(.*?)(\)?)\s*$", re.ASCII)
_COLON: Final = "a label is followed by ':' only where it is defined"
_ANY_DIRECTIVE: Final = re.compile(
    r"#\s*(?:define|include|if|ifdef|ifndef|else|elif|endif|pragma|assert)\b", re.IGNORECASE
)
_MARKERS: Final = ("#", "--", ";", "'", "*", "!", "/")
_LOOSE: Final = ";:."
"""What is typed for a comma."""


def characters(line: TakenApart) -> Iterator[Repair]:
    """Characters of word processors for the plain ones."""
    changes = tuple(
        (column, column + 1, words.CHARACTERS[character])
        for column, character in enumerate(line.text[: line.end])
        if character in words.CHARACTERS
    )
    if changes:
        wrong, right = line.text[changes[0][0]], changes[0][2]
        wanted = f"; write {right!r}" if right.strip() else "; write a space" if right else ""
        yield change(
            "E101", f"{wrong!r} is not a character of the language{wanted}", *changes, kind="character"
        )


def end_of_file(line: TakenApart) -> Iterator[Repair]:
    """Ctrl-Z, with which DOS ended its files."""
    column = line.text.find("\x1a")
    if column >= 0 and not line.text[column + 1 :].strip("\x1a \t"):
        yield change(
            "E101", "Ctrl-Z, the old mark for the end of a file; delete it", (column, len(line.text), "")
        )


def comma_after_command(line: TakenApart) -> Iterator[Repair]:
    """`JC, ZE, Loop`."""
    blank = line.after[: len(line.after) - len(line.after.lstrip(BLANKS))]
    place = line.rest + len(blank)
    if line.text[place : place + 1] == "," and line.row is not None:
        new = "" if blank or line.text[place + 1 : place + 2] in BLANKS else " "
        yield change("E103", f"{line.head.upper()} is not followed by ','", (place, place + 1, new))


def parentheses(line: TakenApart) -> Iterator[Repair]:
    """`SAP(4, 0, 5)`, `JA (Label)`."""
    match = _CALLED.match(line.text, line.body, line.end)
    if match is not None and line.row is not None:
        blank = "" if line.text[match.start(2) - 1] in BLANKS else " "
        changes: list[Change] = [(*match.span(2), blank)]
        if match[4]:
            changes.append((*match.span(4), ""))
        yield change(
            "E103",
            f"the operands of {match[1].upper()} are written without parentheses",
            *changes,
            kind="call",
        )


def at_the_end(line: TakenApart) -> Iterator[Repair]:
    """A comma, colon, semicolon or full stop after the last operand."""
    code = line.text[: line.end].rstrip(BLANKS)
    if code and code[-1] in ",:;." and line.body < len(code) - 1:
        what = _COLON if code[-1] == ":" and line.row else f"a line does not end with {code[-1]!r}"
        yield change("E103", what, (len(code) - 1, len(code), ""))


def commas(line: TakenApart) -> Iterator[Repair]:
    """One comma too many."""
    for match in re.finditer(r",\s*(,)", line.text[: line.end]):
        yield change("E103", "an operand is missing between two commas", (*match.span(1), ""))


def missing_comma(line: TakenApart) -> Iterator[Repair]:
    """`SAP 4, 0 500`."""
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


def _comma(line: TakenApart, place: int) -> tuple[int, int, str]:
    """A comma for the mark at a place, and a blank where none follows."""
    followed = line.text[place + 1 : place + 2].isspace()
    return place, place + 1, "," if followed else ", "


def separators(line: TakenApart) -> Iterator[Repair]:
    """Something else where a comma should be."""
    if line.row is None:
        return
    for mark in _LOOSE:
        places = [match.start() for match in re.finditer(re.escape(mark), line.text[line.rest : line.end])]
        for chosen in (*([place] for place in places), places):
            if chosen:
                changes = tuple(_comma(line, line.rest + place) for place in chosen)
                yield change("E103", f"operands are separated by ',', not by {mark!r}", *changes)


def comment(line: TakenApart) -> Iterator[Repair]:
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
                yield change("E101", shown_marker, (column, end, "//"), kind=f"comment {marker}")
            column = text.find(marker, column + 1)


def prefix(line: TakenApart) -> Iterator[Repair]:
    """`#500` for 500."""
    for match in re.finditer(r"#(?=[\d$%])", line.text[line.rest : line.end]):
        place = line.rest + match.start()
        yield change("E101", "a number is written without '#'", (place, place + 1, ""))
