"""What a virtual module keeps of its lines, for the report of a failed test."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from tmcm34x.tmcl.telegrams import Direction, Kind


class Telegram(NamedTuple):
    """One telegram of a line, with the clock at which it passed."""

    now: int
    line: str
    direction: Direction
    data: bytes
    kind: Kind
