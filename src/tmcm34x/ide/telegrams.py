"""The telegram log: the latest telegrams of all lines, for pages that follow them."""

from __future__ import annotations

from collections import deque
from threading import Lock
from typing import Final, NamedTuple

from tmcm34x.ide import wire
from tmcm34x.tmcl.numbers import CONTROL
from tmcm34x.tmcl.telegrams import Direction, Kind, explain

KEPT: Final = 2000
BATCH: Final = 500
"""Lines in one message to a page."""
_TEXT: Final = -1
"""Stands for the command of what has no number: lines of the ASCII interface."""
_COMMAND_AT: Final[dict[tuple[Kind, Direction], int]] = {
    ("telegram", ">"): 1, ("telegram", "<"): 3, ("frame", ">"): 0, ("frame", "<"): 2,
}  # fmt: skip
"""Where the number of the command is (manual 6.1, 6.2)."""
_OWN_FORM: Final = frozenset({CONTROL.READ_PROGRAM_MEMORY, CONTROL.GET_FIRMWARE_VERSION, _TEXT})
"""Commands whose replies may not name them (manual 6.7.36)."""
_ANSWERED_TWICE: Final = frozenset({CONTROL.REQUEST_TARGET_REACHED})


class LogEntry(NamedTuple):
    """A telegram as it went by; it is explained only when it is shown."""

    number: int
    now: float
    link: str
    direction: Direction
    data: bytes
    kind: Kind
    request: int
    """Of a reply: number of the entry with its request, or 0."""
    latency: float
    """Of a reply: clocks since its request."""


class _Request(NamedTuple):
    """A request that may be answered."""

    number: int
    now: float


class Telegrams:
    """The latest telegrams, numbered from 1; the thread of a line may write while pages read."""

    def __init__(self) -> None:
        self._lock = Lock()
        self.count = 0
        self.polls_wanted = False
        """Some page wants to see also what the IDE asks for by itself."""
        self._entries: deque[LogEntry] = deque(maxlen=KEPT)
        self._asked: dict[str, dict[int, _Request]] = {}
        """The last request of each command on each line; the newest stands last."""

    def write(
        self, now: float, name: str, direction: Direction, data: bytes, kind: Kind = "telegram"
    ) -> None:
        """Note a telegram."""
        with self._lock:
            self._write(now, name, direction, data, kind)

    def _write(self, now: float, name: str, direction: Direction, data: bytes, kind: Kind) -> None:
        self.count += 1
        asked = self._asked.setdefault(name, {})
        if direction == ">":
            command = _command(direction, data, kind)
            asked.pop(command, None)
            asked[command] = _Request(self.count, now)
            request = None
        else:
            request = _answered(asked, data, kind)
        number, latency = (0, 0.0) if request is None else (request.number, now - request.now)
        self._entries.append(LogEntry(self.count, now, name, direction, data, kind, number, latency))

    def since(self, number: int) -> wire.Telegrams | None:
        """The lines after `number`, the latest only where they are too many; none at all gives None."""
        with self._lock:
            if number >= self.count:
                return None
            first = max(number, self.count - min(len(self._entries), BATCH))
            start = len(self._entries) - (self.count - first)
            entries = [self._entries[index] for index in range(start, len(self._entries))]
        return wire.Telegrams(list(map(_line, entries)), first - number)


def _command(direction: Direction, data: bytes, kind: Kind) -> int:
    at = _COMMAND_AT.get((kind, direction))
    return _TEXT if at is None or at >= len(data) else data[at]


def _answered(asked: dict[int, _Request], data: bytes, kind: Kind) -> _Request | None:
    """The request that a reply belongs to: that of the same command, else the last where its reply has no command."""
    if not asked:
        return None
    last = next(reversed(asked))
    command = _command("<", data, kind)
    if command not in asked and last in _OWN_FORM:
        command = last
    return asked.get(command) if command in _ANSWERED_TWICE else asked.pop(command, None)


def _line(entry: LogEntry) -> wire.Telegram:
    text, address, status = explain(entry.direction, entry.data, entry.kind)
    inward = entry.direction == ">"
    if inward and address is not None:
        text = f"{text}  (to {address})"
    return wire.Telegram(
        entry.number, entry.now, entry.link, "in" if inward else "out", entry.data.hex(" "), text, status,
        entry.request, entry.latency,
    )  # fmt: skip
