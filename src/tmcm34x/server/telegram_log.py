"""Telegrams as lines of text, for people.

A line: virtual time in seconds, link, direction (`>` to the module, `<` from it), bytes, meaning.  Bytes that make
no telegram are shown as they came.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, TextIO

from tmcm34x import clock
from tmcm34x.tmcl.datagram import (
    SIZE,
    Reply,
    unpack_can_reply,
    unpack_can_request,
    unpack_reply,
    unpack_request,
)
from tmcm34x.tmcl.mnemonic import format_instruction
from tmcm34x.tmcl.status import STATUS_TEXTS

_WIDTH: Final = 3 * SIZE - 1
GAP: Final = 5 * clock.MS
"""Bytes that come later than this after others belong to another telegram (fidelity WIRE-3)."""


class TelegramLog:
    """Writes what goes over the lines to `stream`, telegram by telegram."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._failed = False
        self.lost: Callable[[OSError], None] | None = None
        """Told when the stream takes no more; nothing is written from then on."""

    def line(self, name: str) -> LineLog:
        """The log of one client's line."""
        return LineLog(self, name)

    def write(self, now: int, name: str, direction: str, data: bytes, meaning: str) -> None:
        """Write one line."""
        if self._failed:
            return
        seconds, dump = clock.seconds(now), data.hex(" ")
        try:
            self._stream.write(f"{seconds:12.6f}  {name:<24} {direction}  {dump:<{_WIDTH}}  {meaning}\n")
            self._stream.flush()
        except OSError as error:
            self._failed = True
            if self.lost is not None:
                self.lost(error)


class LineLog:
    """Puts the chunks of one line together to telegrams."""

    def __init__(self, log: TelegramLog, name: str) -> None:
        self._log = log
        self._name = name
        self._partial = {">": bytearray(), "<": bytearray()}
        self._last = {">": 0, "<": 0}

    def add(self, now: int, direction: str, data: bytes, *, text: bool = False) -> None:
        """Take a chunk of bytes; `text` says that the line speaks ASCII."""
        partial = self._partial[direction]
        if partial and (text or now - self._last[direction] > GAP):
            self._write(now, direction, bytes(partial), "incomplete")
            partial.clear()
        self._last[direction] = now
        if text:
            self._write(now, direction, data, repr(data.decode("latin-1")))
            return
        partial += data
        while len(partial) >= SIZE:
            telegram = bytes(partial[:SIZE])
            del partial[:SIZE]
            self._write(now, direction, telegram, _explain(direction, telegram))

    def add_frame(self, now: int, direction: str, identifier: int, data: bytes) -> None:
        """Take a CAN frame."""
        self._log.write(
            now, f"{self._name} {identifier:03x}", direction, data, _explain_frame(direction, data)
        )

    def _write(self, now: int, direction: str, data: bytes, meaning: str) -> None:
        self._log.write(now, self._name, direction, data, meaning)


def _explain(direction: str, telegram: bytes) -> str:
    try:
        if direction == ">":
            address, instruction = unpack_request(telegram)
            return f"to {address}: {format_instruction(instruction)}"
        reply = unpack_reply(telegram)
    except ValueError:
        return "no telegram"
    return _explain_reply(reply)


def _explain_frame(direction: str, data: bytes) -> str:
    try:
        if direction == ">":
            return format_instruction(unpack_can_request(data))
        return _explain_reply(unpack_can_reply(data))
    except ValueError:
        return "no telegram"


def _explain_reply(reply: Reply) -> str:
    text = STATUS_TEXTS.get(reply.status, "unknown status")
    return f"from {reply.address}: {reply.status} {text}, value {reply.value}"
