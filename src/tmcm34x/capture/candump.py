"""Logs of `candump -l`, of the Linux can-utils: `(1436509053.249713) can0 001#06010000000000`.

A log does not tell who sent a frame.  Frames of eight or seven bytes with the identifiers of replies are taken as
replies, all others of these sizes as requests; see `read`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Final

from tmcm34x.capture.record import NO_IDENTIFIER, NS, Record, RecordingError, is_frame_of_ours
from tmcm34x.links import EXTENDED

REPLY_ID: Final = 2
"""The identifier of replies in the factory settings (global parameter 70)."""
_LINE: Final = re.compile(
    r"\((\d+)\.(\d{1,9})\)\s+(\S+)\s+([0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})#([0-9A-Fa-f]*)(?:\s+[RT])?\s*\Z"
)
_OTHER: Final = re.compile(r"\(\d+\.\d+\)\s+\S+\s+[0-9A-Fa-f]+#")
"""Remote and FD frames, which no module sends."""


def write(records: Iterable[Record]) -> str:
    """A whole log; what is no frame is left out."""
    return "".join(line(record) for record in records)


def line(record: Record) -> str:
    """The line of one frame; empty for what is none."""
    if record.identifier == NO_IDENTIFIER:
        return ""
    extended = record.identifier & EXTENDED
    number = f"{record.identifier & ~EXTENDED:08X}" if extended else f"{record.identifier:03X}"
    seconds, rest = divmod(record.time_ns, NS)
    interface = re.sub(r"\W+", "-", record.line) or "can"
    return f"({seconds:010}.{rest // 1000:06}) {interface} {number}#{record.data.hex().upper()}\n"


def read(text: str, reply_ids: frozenset[int] = frozenset({REPLY_ID})) -> list[Record]:
    """The frames of a log.  Raises `RecordingError` with the line.

    reply_ids: identifiers of replies
    """
    records: list[Record] = []
    for number, row in enumerate(text.splitlines(), 1):
        if not row.strip() or row.startswith("#"):
            continue
        match = _LINE.match(row)
        if match is not None:
            records += _record(match, reply_ids)
        elif not _OTHER.match(row) and number < len(text.splitlines()):
            raise RecordingError(f"line {number}: not a line of candump: {row}")
    return records


def _record(match: re.Match[str], reply_ids: frozenset[int]) -> list[Record]:
    seconds, fraction, interface, number, digits = match.groups()
    data = bytes.fromhex(digits) if len(digits) % 2 == 0 else b""
    if not is_frame_of_ours(data):
        return []
    identifier = int(number, 16) | (EXTENDED if len(number) == 8 else 0)
    direction = "<" if identifier in reply_ids else ">"
    time_ns = int(seconds) * NS + int(fraction.ljust(9, "0"))
    return [Record(time_ns, interface, direction, "frame", data, identifier)]
