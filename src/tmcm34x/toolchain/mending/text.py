"""A line taken apart, and a repair of it."""

from __future__ import annotations

import re
from typing import Final, NamedTuple

from tmcm34x.tmcl.commands import BY_MNEMONIC
from tmcm34x.tmcl.commands import Command as CommandRow
from tmcm34x.toolchain.tokens import BLANKS

Change = tuple[int, int, str]
"""Columns of a line, from 0, and the text to put there."""
LONGEST: Final = 400
"""Characters of the longest line that is looked at."""
NAME: Final = r"[A-Za-z_]\w*"
_BODY: Final = re.compile(rf"(?:\s*{NAME}\s*:(?!=))*[{BLANKS}]*", re.ASCII)
_HEAD: Final = re.compile(rf"({NAME})", re.ASCII)


class Repair(NamedTuple):
    """What is wrong with a line, and the changes that make it right; none where that is not certain.

    kind: of habits, which run through a whole file and are reported once; else empty
    """

    code: str
    start: int
    end: int
    text: str
    changes: tuple[Change, ...] = ()
    kind: str = ""


class TakenApart(NamedTuple):
    """A line taken apart: where its code ends, where its statement begins, its first word and what follows."""

    text: str
    end: int
    body: int
    head: str
    rest: int
    labels: frozenset[str]

    @property
    def row(self) -> CommandRow | None:
        """The command that the first word is; None where it is none."""
        return BY_MNEMONIC.get(self.head.upper())

    @property
    def after(self) -> str:
        """The code after the first word."""
        return self.text[self.rest : self.end]


def take_apart(text: str, labels: frozenset[str]) -> TakenApart:
    """The parts of a line; `labels` are those of its file, in upper case."""
    slashes = text.find("//")
    end = len(text) if slashes < 0 else slashes
    body = _BODY.match(text, 0, end)
    start = body.end() if body is not None else 0
    head = _HEAD.match(text, start, end)
    return TakenApart(text, end, start, head[1] if head else "", head.end() if head else start, labels)


def changed(text: str, changes: tuple[Change, ...]) -> str:
    """`text` with changes made."""
    for start, end, new in sorted(changes, reverse=True):
        text = text[:start] + new + text[end:]
    return text


def change(code: str, text: str, *changes: Change, kind: str = "") -> Repair:
    """A repair that is reported where its first change is."""
    start, end, _ = changes[0]
    return Repair(code, start, max(end, start + 1), text, changes, kind)
