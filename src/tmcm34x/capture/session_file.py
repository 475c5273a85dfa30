"""Recordings as sessions: every line carries its time, and says what it says in words where words give its bytes.

Requests become commands, replies a status and a value; what these would not give back byte for byte stays in
hexadecimal.  A remark `# line NAME` says on which line the following was recorded.
"""

from __future__ import annotations

import re
from bisect import bisect_left
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Final

from tmcm34x.bench.session import actions
from tmcm34x.bench.session.language import Case, parse
from tmcm34x.capture.record import NO_IDENTIFIER, NS, Record, origin_ns
from tmcm34x.clock import HZ
from tmcm34x.tmcl.datagram import (
    Instruction,
    Reply,
    pack_can_reply,
    pack_can_request,
    pack_reply,
    pack_request,
    unpack_can_reply,
    unpack_reply,
    unpack_request,
)
from tmcm34x.tmcl.mnemonic import format_instruction, parse_instruction
from tmcm34x.tmcl.telegrams import Direction

_LINE: Final = re.compile(r"# line (.+?)\s*\Z")
HOST: Final = 2
MODULE: Final = 1


class SessionWriter:
    """Turns records into lines, one after the other."""

    def __init__(self, title: str = "recording") -> None:
        self._title = title
        self._address, self._host = MODULE, HOST
        self._asked: Instruction | None = None
        self._line = ""
        self._can = False
        self._start_ns: int | None = None

    def head(self, can: bool) -> str:
        """What a file begins with."""
        return f"# links: {'can' if can else 'serial'}\n\n== {self._title}\n"

    def lines(self, record: Record) -> str:
        """What a record adds to the file."""
        text = ""
        if self._start_ns is None:
            self._start_ns = origin_ns([record])
            self._can = record.kind == "frame"
            text = self.head(self._can)
        if record.line != self._line:
            self._line = record.line
            text += f"# line {record.line}\n"
        body = self._body(record)
        stamp = f"{(record.time_ns - self._start_ns) / NS:.9f}"
        return f"{text}{self._addresses}{stamp} {record.direction} {body}\n"

    def _body(self, record: Record) -> str:
        self._addresses = ""
        words = self._request(record) if record.direction == ">" else self._reply(record)
        can = record.kind == "frame"
        if words and can == self._can:  # words are of the kind of line that the head names
            return words
        if can:
            return f"id ${record.identifier:x}: {record.data.hex(' ')}"
        return record.data.hex(" ")

    def _request(self, record: Record) -> str:
        self._asked = instruction = record.instruction
        if instruction is None:
            return ""
        can = record.kind == "frame"
        address = record.identifier if can else record.data[0]
        packed = pack_can_request(instruction) if can else pack_request(address, instruction)
        if packed != record.data or parse_instruction(format_instruction(instruction)) != instruction:
            return ""
        self._address_is(address, self._host)
        return format_instruction(instruction)

    def _reply(self, record: Record) -> str:
        can = record.kind == "frame"
        try:
            reply = (
                unpack_can_reply(record.data, record.identifier & 0xFF) if can else unpack_reply(record.data)
            )
        except ValueError:
            return ""
        host = record.identifier if can else reply.host
        packed = pack_can_reply(reply) if can else pack_reply(reply)
        if packed != record.data or reply.address != self._address or self._asked is None:
            return ""
        self._address_is(self._address, host)
        other = "" if reply.command == self._asked.number else f" of {reply.command}"
        return f"{reply.status} {reply.value}{other}"

    def _address_is(self, address: int, host: int) -> None:
        if (address, host) != (self._address, self._host):
            self._address, self._host = address, host
            self._addresses = f"@ {address} host {host}\n"

    _addresses = ""


def write(records: Iterable[Record]) -> str:
    """A whole session."""
    writer = SessionWriter()
    return "".join(writer.lines(record) for record in records) or f"{writer.head(False)}"


def read(text: str, path: Path) -> list[Record]:
    """The records of a session; events and measurements in it are passed over.  Raises `SessionSyntaxError`."""
    lines = _Lines(text)
    return [
        record._replace(line=lines.of(number))
        for case in parse(text, path)
        for number, record in _records(case)
    ]


class _Lines:
    """Which line of a recording its remarks `# line NAME` name for what follows them."""

    def __init__(self, text: str) -> None:
        found = enumerate(map(_LINE.match, text.splitlines()), 1)
        self._named = [(number, match.group(1)) for number, match in found if match]

    def of(self, number: int) -> str:
        """The name for line `number` of the text."""
        place = bisect_left(self._named, (number,))
        return self._named[place - 1][1] if place else "session"


def _records(case: Case) -> Iterator[tuple[int, Record]]:
    """What is sent and received in a case, with the number of the line of text."""
    can = "serial" not in case.kinds
    address, host, now, number = MODULE, HOST, 0, 0
    for step in case.steps:
        action = step.action
        now = now if step.at is None else step.at
        time_ns = round(now * NS / HZ)
        direction: Direction = ">" if action.asks else "<"
        match action:
            case actions.PassTime(clocks):
                now += clocks
            case actions.Address(module, other):
                address, host = module, host if other is None else other
            case actions.Send(instruction):
                number = instruction.number
                data = pack_can_request(instruction) if can else pack_request(address, instruction)
                yield step.line, _record(time_ns, direction, data, address if can else NO_IDENTIFIER)
            case actions.SendFrame(identifier, data) | actions.ExpectedFrame(identifier, data):
                number = data[0] if action.asks and data else number
                yield step.line, _record(time_ns, direction, data, identifier)
            case actions.SendBytes(data) | actions.Bytes(data):
                number = _number(data, number) if action.asks else number
                yield step.line, _record(time_ns, direction, data)
            case actions.ExpectedReply(status, low, _, command):
                reply = Reply(host & 0xFF, address, status, command or number, low or 0)
                data = pack_can_reply(reply) if can else pack_reply(reply)
                yield step.line, _record(time_ns, direction, data, host if can else NO_IDENTIFIER)
            case _:
                pass


def _record(time_ns: int, direction: Direction, data: bytes, identifier: int = NO_IDENTIFIER) -> Record:
    if identifier != NO_IDENTIFIER:
        return Record(time_ns, "", direction, "frame", data, identifier)
    return Record(time_ns, "", direction, "telegram" if len(data) == 9 else "incomplete", data)


def _number(data: bytes, default: int) -> int:
    try:
        return unpack_request(data)[1].number
    except ValueError:
        return default
