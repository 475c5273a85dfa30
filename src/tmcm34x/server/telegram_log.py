"""Telegrams that go over the lines: put together from chunks and written down for people.

A line of the text log: virtual time in seconds, link, direction (`>` to the module, `<` from it), bytes, meaning.
Bytes that make no telegram are shown as they came.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, Protocol

from tmcm34x import clock
from tmcm34x.links import EXTENDED
from tmcm34x.tmcl.datagram import SIZE
from tmcm34x.tmcl.telegrams import Direction, Kind, explain

_WIDTH: Final = 3 * SIZE - 1
GAP: Final = 5 * clock.MS
"""Bytes that come later than this after others belong to another telegram (fidelity WIRE-3)."""


class Sink(Protocol):
    """Takes telegrams, one at a time."""

    def write(self, now: float, name: str, direction: Direction, data: bytes, kind: Kind) -> None:
        """Take one; `name` is the link's."""
        ...


class Stream(Protocol):
    """A text file, or `Output`."""

    def write(self, line: str, /) -> object:
        """Take a line."""
        ...

    def flush(self) -> None:
        """Keep nothing back."""
        ...


class TelegramLog:
    """Writes what goes over the lines to `stream`, telegram by telegram."""

    def __init__(self, stream: Stream) -> None:
        self.stream = stream
        self._failed = False
        self.lost: Callable[[OSError], None] | None = None
        """Called when the stream takes no more; nothing is written from then on."""

    def write(self, now: float, name: str, direction: Direction, data: bytes, kind: Kind) -> None:
        """Write one line."""
        if self._failed:
            return
        text, address, _ = explain(direction, data, kind)
        if address is not None:
            text = f"{'to' if direction == '>' else 'from'} {address}: {text}"
        dump = data.hex(" ")
        try:
            line = f"{now / clock.HZ:12.6f}  {name:<24} {direction}  {dump:<{_WIDTH}}  {text}\n"
            self.stream.write(line)
            self.stream.flush()
        except OSError as error:
            self._failed = True
            if self.lost is not None:
                self.lost(error)


class LineLog:
    """Puts the chunks of the line `name` together to telegrams for `sink`."""

    def __init__(self, sink: Sink, name: str) -> None:
        self._sink = sink
        self._name = name
        self._partial: dict[Direction, bytearray] = {">": bytearray(), "<": bytearray()}
        self._last: dict[Direction, int] = {">": 0, "<": 0}

    def add(self, now: int, direction: Direction, data: bytes, *, text: bool = False) -> None:
        """Take a chunk of bytes; `text` says that the line speaks ASCII."""
        partial = self._partial[direction]
        if partial and (text or now - self._last[direction] > GAP):
            self._write(now, direction, bytes(partial), "incomplete")
            partial.clear()
        self._last[direction] = now
        if text:
            self._write(now, direction, data, "text")
            return
        partial += data
        while len(partial) >= SIZE:
            telegram = bytes(partial[:SIZE])
            del partial[:SIZE]
            self._write(now, direction, telegram, "telegram")

    def add_frame(self, now: int, direction: Direction, identifier: int, data: bytes) -> None:
        """Take a CAN frame."""
        number = f"{identifier & ~EXTENDED:08x}" if identifier & EXTENDED else f"{identifier:03x}"
        self._sink.write(now, f"{self._name} {number}", direction, data, "frame")

    def _write(self, now: int, direction: Direction, data: bytes, kind: Kind) -> None:
        self._sink.write(now, self._name, direction, data, kind)
