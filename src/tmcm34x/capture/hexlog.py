"""Plain text logs of telegrams in hexadecimal, as hosts and terminal programs write them.

One telegram a line, with a time in seconds before it or without, and a sign of its direction or without:

    0.012 > 01 06 01 00 00 00 00 00 08
    0.015 < 02 01 64 06 00 00 00 00 6d
    TX: 010601000000000008

Without a sign, nine bytes that follow a request and carry its command number are its reply.  Lines without bytes are
passed over.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Final

from tmcm34x.capture.record import NS, Record, kind_of
from tmcm34x.tmcl.datagram import SIZE, checksum
from tmcm34x.tmcl.telegrams import Direction

STEP_NS: Final = 20_000_000
"""Time between telegrams of a log that has none."""
_BYTES: Final = re.compile(r"(?<![0-9A-Za-z.])((?:(?:0x)?[0-9A-Fa-f]{2}[\s,]*){3,})\s*(?:\W.*)?\Z")
_RUN: Final = re.compile(r"(?<![0-9A-Za-z])([0-9A-Fa-f]{18})(?![0-9A-Za-z])")
_TIME: Final = re.compile(r"\s*[\[(]?(\d+\.\d+)")
_TO: Final = re.compile(r">|\b(?:tx|send|sent|out|write|request|host)\b", re.IGNORECASE)
_FROM: Final = re.compile(r"<|\b(?:rx|recv|received|in|read|reply|module)\b", re.IGNORECASE)


def write(records: Iterable[Record]) -> str:
    """A whole log."""
    return "".join(line(record) for record in records)


def line(record: Record) -> str:
    """The line of one record."""
    return f"{record.time_ns / NS:.9f} {record.direction} {record.data.hex(' ')}\n"


def read(text: str) -> list[Record]:
    """The telegrams of a log; other lines are passed over."""
    records: list[Record] = []
    for row in text.splitlines():
        match = _RUN.search(row) or _BYTES.search(row)
        if match is None:
            continue
        digits = re.sub(r"0x|[\s,]", "", match.group(1))
        before = row[: match.start()]
        last = records[-1] if records else None
        data = bytes.fromhex(digits[: len(digits) // 2 * 2])
        direction = _direction(before, data, last)
        records.append(Record(_time(before, last), "log", direction, kind_of(data), data))
    return records


def _time(before: str, last: Record | None) -> int:
    match = _TIME.match(before)
    if match:
        return round(float(match.group(1)) * NS)
    return last.time_ns + STEP_NS if last else 0


def _direction(before: str, data: bytes, last: Record | None) -> Direction:
    if _TO.search(before):
        return ">"
    if _FROM.search(before):
        return "<"
    return "<" if last is not None and last.direction == ">" and _answers(last.data, data) else ">"


def _answers(request: bytes, data: bytes) -> bool:
    """Whether nine bytes without a sign are the reply to the request before them."""
    if len(data) != SIZE or len(request) != SIZE:
        return False
    plain = data[3] == request[1] and data[1] == request[0] and checksum(data[:-1]) == data[-1]
    return plain or data[1:4].isdigit()
