"""A recording of lines that pass through this process: hosts on one side, a module on the other.

What comes from a side goes to the other at once, byte for byte; telegrams are put together for the recording alone.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from functools import partial
from typing import Final

from tmcm34x.capture.files import RecordingWriter
from tmcm34x.capture.record import RecordingError, from_sink
from tmcm34x.clock import HZ
from tmcm34x.links import EXTENDED, BusPeer, Link, LinkOpenError, Peer, Send, SendFrame
from tmcm34x.server.telegram_log import LineLog, Sink
from tmcm34x.tmcl.telegrams import Direction, Kind

CONNECT_S: Final = 5.0
LONGEST: Final = 64
"""Characters of a line of SLCAN that has not ended."""
STANDARD_DIGITS: Final = 3
IDENTIFIER_DIGITS: Final = {b"t": STANDARD_DIGITS, b"T": 8}
"""Digits of the identifier by the letter that begins the line of a frame."""


class SlcanLog:
    """Finds the frames in the lines of text of an SLCAN adapter, `t0017060400...`; see `links.posix.slcan`."""

    def __init__(self, sink: Sink, name: str) -> None:
        self._log = LineLog(sink, name)
        self._partial: dict[Direction, bytearray] = {">": bytearray(), "<": bytearray()}

    def add(self, now: int, direction: Direction, data: bytes) -> None:
        """Take characters; each CR or BELL ends a line."""
        partial = self._partial[direction]
        partial += data.replace(b"\a", b"\r")
        *lines, rest = bytes(partial).split(b"\r")
        partial[:] = rest[-LONGEST:]
        for line in lines:
            self._line(now, direction, line)

    def _line(self, now: int, direction: Direction, line: bytes) -> None:
        digits = IDENTIFIER_DIGITS.get(line[:1])
        if digits is None:
            return
        try:
            identifier = int(line[1 : 1 + digits], 16)
            size = int(line[1 + digits : 2 + digits])
            data = bytes.fromhex(line[2 + digits : 2 + digits + 2 * size].decode("ascii"))
        except ValueError:
            return
        if len(data) == size:
            extended = EXTENDED if digits > STANDARD_DIGITS else 0
            self._log.add_frame(now, direction, identifier | extended, data)


class Tape:
    """Puts telegrams into a recording, with the time since it began.

    lost: called with the reason when nothing can be recorded
    """

    def __init__(self, recorder: RecordingWriter, lost: Callable[[Exception], None]) -> None:
        self._recorder = recorder
        self.lost = lost
        self._start_s = time.monotonic()

    def take(self, add: Callable[[int], None]) -> None:
        """Have something logged at the present clock."""
        try:
            add(round((time.monotonic() - self._start_s) * HZ))
        except RecordingError as error:
            self.lost(error)

    def write(self, now: float, name: str, direction: Direction, data: bytes, kind: Kind) -> None:
        """Take a telegram of a log."""
        self._recorder.add(from_sink(round(now * 1e9 / HZ), name, direction, data, kind))


class BusTap:
    """Records the frames of a CAN bus, and sends none.

    reply: identifier of frames that are replies
    """

    def __init__(self, tape: Tape, reply: int) -> None:
        self._tape = tape
        self._reply = reply

    def connect(self, name: str, _: SendFrame) -> BusPeer:
        """The bus is joined."""
        self._log = LineLog(self._tape, name)
        return self

    def receive_frame(self, identifier: int, data: bytes, bit_rate: int | None) -> None:
        """Take a frame."""
        del bit_rate
        direction: Direction = "<" if identifier == self._reply else ">"
        self._tape.take(lambda now: self._log.add_frame(now, direction, identifier, data))

    def disconnect(self) -> None:
        """The bus is left."""


class Proxy:
    """Passes bytes between the clients of links and one module, and records them.

    tape: what records; its `lost` is also called when the module's side is gone
    make_log: puts bytes together to what is recorded
    """

    def __init__(self, tape: Tape, make_log: type[LineLog | SlcanLog] = LineLog) -> None:
        self.tape = tape
        self.make_log = make_log
        self._clients: list[_Client] = []
        self._to_module: Send = lambda _: None

    def to_module(self, send: Send) -> None:
        """How bytes get to the module."""
        self._to_module = send

    def connect(self, name: str, send: Send) -> Peer:
        """A host has come: the module's end of its line."""
        client = _Client(self, name, send)
        self._clients.append(client)
        return client

    def from_host(self, client: _Client, data: bytes) -> None:
        """Pass on what a host sends."""
        self.tape.take(lambda now: client.log.add(now, ">", data))
        self._to_module(data)

    def from_module(self, data: bytes) -> None:
        """Pass on what the module sends, to all hosts, as on a shared line."""
        for client in self._clients:
            self.tape.take(partial(client.log.add, direction="<", data=data))
            client.send(data)

    def leave(self, client: _Client) -> None:
        """A host has gone."""
        self._clients.remove(client)

    def module_gone(self) -> None:
        """The module's side is closed."""
        self.tape.lost(LinkOpenError("the module's side has hung up"))


class _Client:
    """One host."""

    def __init__(self, proxy: Proxy, name: str, send: Send) -> None:
        self._proxy = proxy
        self.send = send
        self.log = proxy.make_log(proxy.tape, name)

    def receive(self, data: bytes) -> None:
        self._proxy.from_host(self, data)

    def disconnect(self) -> None:
        self._proxy.leave(self)


class _Module:
    """The module's side, where it is a link."""

    def __init__(self, proxy: Proxy, send: Send) -> None:
        self.receive = proxy.from_module
        self.disconnect = proxy.module_gone
        proxy.to_module(send)


async def open_serial(proxy: Proxy, link: Link) -> str:
    """The module at the other end of a serial port.  Raises `LinkOpenError`."""
    return await link.open(lambda _, send: _Module(proxy, send))


async def open_tcp(proxy: Proxy, host: str, port: int) -> asyncio.Transport:
    """The module behind a socket.  Raises `LinkOpenError`."""
    loop = asyncio.get_running_loop()
    try:
        connecting = loop.create_connection(lambda: _Socket(proxy), host, port)
        transport, _ = await asyncio.wait_for(connecting, CONNECT_S)
    except (OSError, TimeoutError) as error:
        reason = getattr(error, "strerror", None) or "no answer"
        raise LinkOpenError(f"cannot connect to {host}:{port}: {reason}") from error
    proxy.to_module(transport.write)
    return transport


class _Socket(asyncio.Protocol):
    def __init__(self, proxy: Proxy) -> None:
        self._proxy = proxy

    def data_received(self, data: bytes) -> None:
        self._proxy.from_module(data)

    def connection_lost(self, exc: Exception | None) -> None:
        del exc
        self._proxy.module_gone()
