"""Requests with their replies."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

from tmcm34x.capture.record import Record


class TimedRecord(NamedTuple):
    """A record, and for a reply the nanoseconds since the last request of its line."""

    record: Record
    latency_ns: int | None


def rows(records: Iterable[Record]) -> Iterator[TimedRecord]:
    """All records with the latencies of replies."""
    asked: dict[str, int] = {}
    for record in records:
        if record.direction == ">":
            asked[record.line] = record.time_ns
            yield TimedRecord(record, None)
        else:
            since = asked.get(record.line)
            yield TimedRecord(record, None if since is None else record.time_ns - since)


def count(number: int, what: str, several: str = "") -> str:
    """`1 request`, `2 requests`."""
    return f"{number} {what if number == 1 else several or what + 's'}"


def summary(records: Iterable[Record]) -> str:
    """How many requests and replies, and their latencies."""
    latencies: list[int] = []
    requests = replies = 0
    waiting: set[str] = set()
    for record, latency_ns in rows(records):
        if record.direction == ">":
            requests += 1
            waiting.add(record.line)
        else:
            replies += 1
            if latency_ns is not None and record.line in waiting:
                waiting.discard(record.line)
                latencies.append(latency_ns)
    text = f"{count(requests, 'request')}, {count(replies, 'reply', 'replies')}"
    if not latencies:
        return text
    latencies.sort()
    middle, most = latencies[len(latencies) // 2], latencies[-1]
    return f"{text}, latency {latencies[0] / 1e6:.3f} ms to {most / 1e6:.3f} ms, median {middle / 1e6:.3f} ms"
