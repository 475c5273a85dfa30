"""Wires for sessions that go through the product's server and its links: pseudo terminal, TCP, SLCAN.

The server runs on a wall clock that stands still until the session lets time pass, so that every run is the same
and the replies are those of a wire in memory, byte for byte.
"""

from __future__ import annotations

import asyncio
import os
import select
import socket
import time
import tty
from collections.abc import Callable
from typing import Any

from tmcm34x import clock
from tmcm34x.links import Connect, Link, Send
from tmcm34x.links.posix.pty import PtyLink
from tmcm34x.links.posix.slcan import SlcanLink
from tmcm34x.links.tcp import TcpLink
from tmcm34x.server import Server

PATIENCE_S = 60.0


class StandingClock:
    """A monotonic clock that moves when told, by chip clocks."""

    def __init__(self) -> None:
        self.clocks = 0.0

    def __call__(self) -> float:
        """The time [s]."""
        return self.clocks / clock.HZ

    def advance(self, clocks: int) -> None:
        """Go on; a quarter of a clock ahead, so that rounding loses none."""
        self.clocks = int(self.clocks) + clocks + 0.25


class Served:
    """A bench behind a server with one link, and a client of that link; a context manager."""

    def __init__(self, rig: Any) -> None:
        self.rig = rig
        self.clock = StandingClock()
        self.server = Server(rig, monotonic=self.clock)
        self.loop = asyncio.new_event_loop()
        self._raw = bytearray()

    def __enter__(self) -> Any:
        """Open the link and connect."""
        self.connect(self.loop.run_until_complete(self.open()))
        return self

    def __exit__(self, *_: object) -> None:
        """Hang up, close the link."""
        self.hang_up()
        self.loop.run_until_complete(self.server.close())
        self.loop.run_until_complete(asyncio.sleep(0))
        self.loop.close()

    def advance(self, clocks: int) -> None:
        """Let simulated time pass."""
        self.clock.advance(clocks)
        assert self.server.catch_up()
        self.server.settle()
        self.settle()

    @property
    def now(self) -> int:
        """The time in chip clocks."""
        return self.rig.now

    def wait_for(self, size: int) -> None:
        """What is not there does not come at this clock."""

    def wait_for_nothing(self) -> None:
        """What could come at this clock has come."""

    def ask(self, address: int, instruction: Any) -> tuple[int, int]:
        """Status and value of a command outside the conversation."""
        return self.rig.modules[0].peek(instruction)

    def wait(self, done: Callable[[], bool]) -> None:
        """Let server and client work until `done`."""
        end_s = time.monotonic() + PATIENCE_S
        while not done():
            assert time.monotonic() < end_s, "the link is stuck"
            self.loop.run_until_complete(asyncio.sleep(0))
            self.fetch()


class Counted:
    """A link that counts the bytes which the server hears and says."""

    def __init__(self, link: Link) -> None:
        self.link = link
        self.kind, self.latency_ms, self.baud_rate = link.kind, link.latency_ms, link.baud_rate
        self.close = link.close
        self.heard = self.said = 0

    async def open(self, connect: Connect) -> str:
        """Open the link itself."""
        return await self.link.open(lambda name, send: CountedPeer(self, connect, name, send))


class CountedPeer:
    """One client's line."""

    def __init__(self, counted: Counted, connect: Connect, name: str, send: Send) -> None:
        self.counted = counted
        self.send = send
        self.peer = connect(name, self.say)
        self.disconnect = self.peer.disconnect

    def receive(self, data: bytes) -> None:
        """The server hears."""
        self.counted.heard += len(data)
        self.peer.receive(data)

    def say(self, data: bytes) -> None:
        """The server says."""
        self.counted.said += len(data)
        self.send(data)


class ServedSerial(Served):
    """A serial line; bytes are counted at both ends, so that it is known when all have arrived."""

    kind = "serial"

    def __init__(self, rig: Any) -> None:
        super().__init__(rig)
        self.received = self._raw
        self.sent = self.fetched = 0

    async def open(self) -> str:
        """Open the link."""
        self.counted = Counted(self.make_link())
        return await self.server.open(self.counted)

    def send(self, data: bytes) -> None:
        """Send bytes to the module; they have been heard when this returns."""
        self.sent += len(data)
        self.write(data)
        self.settle()

    def settle(self) -> None:
        """All that was sent has been heard, and all that was said has come."""
        self.wait(lambda: (self.counted.heard, self.counted.said) == (self.sent, self.fetched))

    def take(self, data: bytes) -> None:
        """Bytes have come."""
        self.fetched += len(data)
        self._raw += data


class Terminal:
    """A client that opens a path as a terminal."""

    def connect(self, path: str) -> None:
        """Open the terminal."""
        self.fd = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        tty.setraw(self.fd)

    def hang_up(self) -> None:
        """Close the terminal."""
        os.close(self.fd)

    def write(self, data: bytes) -> None:
        """Send bytes."""
        assert os.write(self.fd, data) == len(data)

    def fetch(self) -> None:
        """Take what has come."""
        if select.select([self.fd], [], [], 0)[0]:
            self.take(os.read(self.fd, 4096))


class Pty(Terminal, ServedSerial):
    """A pseudo terminal."""

    def make_link(self) -> Link:
        """A pseudo terminal without a name of its own."""
        return PtyLink()


class Tcp(ServedSerial):
    """A socket."""

    def make_link(self) -> Link:
        """A socket that the system chooses."""
        return TcpLink("127.0.0.1", 0)

    def connect(self, address: str) -> None:
        """Connect to the socket."""
        host, port = address.rsplit(":", 1)
        self.socket = socket.create_connection((host, int(port)))
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.socket.setblocking(False)

    def hang_up(self) -> None:
        """Disconnect."""
        self.socket.close()

    def write(self, data: bytes) -> None:
        """Send bytes."""
        self.socket.sendall(data)

    def fetch(self) -> None:
        """Take what has come."""
        if select.select([self.socket], [], [], 0)[0]:
            self.take(self.socket.recv(4096))


class Slcan(Terminal, Served):
    """An SLCAN adapter on a pseudo terminal; what it answers to a further line comes after all frames."""

    kind = "can"

    def __init__(self, rig: Any) -> None:
        super().__init__(rig)
        self.received: list[tuple[int, bytes]] = []
        self.answers: list[bytes] = []

    async def open(self) -> str:
        """Open the link."""
        return await self.server.open_can(SlcanLink(None, lambda: 0))

    def connect(self, path: str) -> None:
        """Open the adapter's channel."""
        super().connect(path)
        self.command(b"S8")
        self.command(b"O")

    def command(self, line: bytes) -> bytes:
        """Send a line to the adapter; its answer."""
        self.answers.clear()
        self.write(line + b"\r")
        self.wait(lambda: bool(self.answers))
        return self.answers.pop()

    def send_frame(self, identifier: int, data: bytes) -> None:
        """Send a frame; its acknowledgement comes before the module's reply."""
        assert self.command(b"t%03X%d%s" % (identifier, len(data), data.hex().encode())) == b"z"

    def settle(self) -> None:
        """Wait for all that is on its way: the answer to a further line comes after it."""
        self.command(b"V")

    def take(self, data: bytes) -> None:
        """Characters have come."""
        self._raw += data
        while b"\r" in self._raw:
            line, _, rest = bytes(self._raw).partition(b"\r")
            self._raw[:] = rest
            if line[:1] == b"t":
                self.received.append((int(line[1:4], 16), bytes.fromhex(line[5:].decode())))
            else:
                self.answers.append(line)


LINKS = {"pty": Pty, "tcp": Tcp, "slcan": Slcan}
