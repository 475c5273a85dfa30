"""The telegram log: the latest telegrams of all lines, for pages that follow them."""

from __future__ import annotations

from collections import deque
from typing import Final, NamedTuple

from tmcm34x.ide import wire
from tmcm34x.tmcl.telegrams import Direction, Kind, explain

KEPT: Final = 2000
BATCH: Final = 500
"""Lines in one message to a page."""


class Entry(NamedTuple):
    """A telegram as it went by; it is explained only when it is shown."""

    number: int
    now: float
    link: str
    direction: Direction
    data: bytes
    kind: Kind


class Telegrams:
    """The latest telegrams, numbered from 1."""

    def __init__(self) -> None:
        self.count = 0
        self.polls_wanted = False
        """Some page wants to see also what the IDE asks for by itself."""
        self._entries: deque[Entry] = deque(maxlen=KEPT)

    def write(
        self, now: float, name: str, direction: Direction, data: bytes, kind: Kind = "telegram"
    ) -> None:
        """Note a telegram."""
        self.count += 1
        self._entries.append(Entry(self.count, now, name, direction, data, kind))

    def since(self, number: int) -> wire.Telegrams | None:
        """The lines after `number`, the latest only where they are too many; none at all gives None."""
        if number >= self.count:
            return None
        first = max(number, self.count - min(len(self._entries), BATCH))
        start = len(self._entries) - (self.count - first)
        lines = [_line(self._entries[index]) for index in range(start, len(self._entries))]
        return wire.Telegrams(lines, first - number)


def _line(entry: Entry) -> wire.Telegram:
    text, address, status = explain(entry.direction, entry.data, entry.kind)
    inward = entry.direction == ">"
    if inward and address is not None:
        text = f"{text}  (to {address})"
    return wire.Telegram(
        entry.number, entry.now, entry.link, "in" if inward else "out", entry.data.hex(" "), text, status
    )
