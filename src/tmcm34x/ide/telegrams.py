"""The telegram log: the latest telegrams of all lines, for pages that follow them."""

from __future__ import annotations

from collections import deque
from typing import Final, NamedTuple

from tmcm34x.ide import wire
from tmcm34x.tmcl.commands import BY_NUMBER
from tmcm34x.tmcl.datagram import SIZE, unpack_reply, unpack_request
from tmcm34x.tmcl.mnemonic import format_instruction
from tmcm34x.tmcl.status import STATUS_TEXTS, Status

KEPT: Final = 2000
BATCH: Final = 500
"""Lines in one message to a page."""


class Entry(NamedTuple):
    """A telegram as it went by; it is decoded only when somebody wants to see it."""

    number: int
    now: float
    link: str
    inward: bool
    data: bytes
    meaning: str


class Telegrams:
    """The latest telegrams, numbered from 1."""

    def __init__(self) -> None:
        self.count = 0
        self.polls_wanted = False
        """Some page wants to see also what the IDE asks for by itself."""
        self._entries: deque[Entry] = deque(maxlen=KEPT)

    def add(self, now: float, link: str, inward: bool, data: bytes, meaning: str = "") -> None:
        """Note a telegram; without `meaning` it is decoded when it is shown."""
        self.count += 1
        self._entries.append(Entry(self.count, now, link, inward, data, meaning))

    def since(self, number: int) -> wire.Telegrams | None:
        """The lines after `number`, the latest only where they are too many; none at all gives None."""
        if number >= self.count:
            return None
        first = max(number, self.count - min(len(self._entries), BATCH))
        start = len(self._entries) - (self.count - first)
        lines = [_line(self._entries[index]) for index in range(start, len(self._entries))]
        return wire.Telegrams(lines, first - number)


def _line(entry: Entry) -> wire.Telegram:
    status = 0
    if entry.meaning:
        text = entry.meaning
    elif entry.inward:
        text = _request(entry.data)
    else:
        status, text = _reply(entry.data)
    direction = "in" if entry.inward else "out"
    return wire.Telegram(entry.number, entry.now, entry.link, direction, entry.data.hex(" "), text, status)


def _request(data: bytes) -> str:
    try:
        address, instruction = unpack_request(data)
    except ValueError as error:
        return f"no telegram: {error}"
    row = BY_NUMBER.get(instruction.number)
    if row is None or row.mnemonic:
        text = format_instruction(instruction)
    else:
        text = f"{instruction.number} {row.title}, {instruction.value}"
    return f"{text}  (to {address})"


def _reply(data: bytes) -> tuple[int, str]:
    if len(data) == SIZE and data[1:4].isdigit() and data[4:5] in b"VB":
        return 100, f"version {data[1:].decode('latin-1')}"
    try:
        reply = unpack_reply(data)
    except ValueError as error:
        return 0, f"no telegram: {error}"
    text = STATUS_TEXTS.get(reply.status)
    if text is None:
        return 0, "a reply of its own form"
    if reply.status == Status.OK:
        return reply.status, f"100, value {reply.value}"
    return reply.status, f"{reply.status} {text}, value {reply.value}"
