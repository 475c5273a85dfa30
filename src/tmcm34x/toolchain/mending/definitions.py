"""Repairs of labels, constants and directives."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from tmcm34x.tmcl.commands import BY_MNEMONIC
from tmcm34x.toolchain.diagnostics import shown
from tmcm34x.toolchain.mending.spelling import nearest
from tmcm34x.toolchain.mending.text import NAME, Repair, TakenApart, change

_ASSIGNED: Final = re.compile(rf"({NAME})\s*(:=|==|\bEQU\b)", re.ASCII | re.IGNORECASE)
_DECLARED: Final = re.compile(rf"((?:CONST|LET|VAR|INT)\s+){NAME}\s*=", re.ASCII | re.IGNORECASE)
_DEFINED: Final = re.compile(rf"(#\s*DEFINE\s+)({NAME})(?=\s)", re.ASCII | re.IGNORECASE)
_DIRECTIVE: Final = re.compile(r"(#?\s*)(\w+)(?=\s+\S)", re.ASCII)
_NUMBERED: Final = re.compile(r"\s*(\d+\s*[.)|]?\s+)(?=[A-Za-z_/])", re.ASCII)
_MARKED: Final = re.compile(rf"\s*({NAME})\s*(;|,|\.(?=\s))(?=\s*[A-Za-z])", re.ASCII)
_BEFORE: Final = re.compile(rf"\s*(:)\s*({NAME})(?=\s*(?://|\Z|[A-Za-z]))", re.ASCII)


def directive(line: TakenApart) -> Iterator[Repair]:
    """`include` without its `#` or with a slip, `#define`."""
    match = _DEFINED.match(line.text, line.body)
    if match is not None:
        place = match.end(2)
        text = "TMCL has no #define; a constant is written NAME = VALUE"
        yield change("E103", text, (match.start(1), match.end(1), ""), (place, place, " ="), kind="define")
    match = _DIRECTIVE.match(line.text, line.body)
    if match is not None and _means_include(line, match):
        yield change("E103", "another file is included by #include", (*match.span(), "#include"))


def _means_include(line: TakenApart, match: re.Match[str]) -> bool:
    word = match[2].lower()
    if word.upper() in BY_MNEMONIC or not nearest(word, ("include",), 2):
        return False
    quotes = line.text[match.end() :].strip()[:1] in ('"', "<", "'")
    return bool(match[1]) or quotes or word == "include"


def constant(line: TakenApart) -> Iterator[Repair]:
    """`NAME := 5`, `NAME EQU 5`, `CONST NAME = 5`."""
    match = _ASSIGNED.match(line.text, line.body)
    if match is not None:
        text = f"a constant is written NAME = VALUE, without {shown(match[2])}"
        yield change("E103", text, (*match.span(2), "="), kind="assignment")
    match = _DECLARED.match(line.text, line.body)
    if match is not None:
        text = f"a constant is written NAME = VALUE, without {shown(match[1].strip())}"
        yield change("E103", text, (*match.span(1), ""), kind="declaration")


def label(line: TakenApart) -> Iterator[Repair]:
    """`Loop; MVP ...`, `:Loop`."""
    match = _MARKED.match(line.text)
    if match is not None and line.row is None:
        yield change("E103", f"a label ends with ':': {shown(match[1])}:", (*match.span(2), ":"))
    match = _BEFORE.match(line.text)
    if match is not None:
        text = f"a label ends with ':': {shown(match[2])}:"
        yield change("E103", text, (*match.span(1), ""), (match.end(2), match.end(2), ":"))


def line_number(line: TakenApart) -> Iterator[Repair]:
    """The number of the line in a manual's print before its statement."""
    match = _NUMBERED.match(line.text)
    if match is not None:
        yield change(
            "E103",
            "TMCL has no line numbers",
            (*match.span(1), ""),
            kind="number",
        )
