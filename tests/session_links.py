"""Wires for sessions that go through the product's server and its links: pseudo terminal and TCP.

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
from tmcm34x.links.pty import PtyLink
from tmcm34x.links.tcp import TcpLink
from tmcm34x.server import Server

PATIENCE_S = 10.0


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
        self.heard = self.said = self.sent = 0
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

    def wait(self, done: Callable[[], bool]) -> None:
        """Let server and client work until `done`."""
        end_s = time.monotonic() + PATIENCE_S
        while not done():
            assert time.monotonic() < end_s, "the link is stuck"
            self.loop.run_until_complete(asyncio.sleep(0))
            self.fetch()


class ServedSerial(Served):
    """A serial line: what the server hears and says is counted, so that it is known when all has arrived."""

    kind = "serial"

    def __init__(self, rig: Any) -> None:
        super().__init__(rig)
        self.received = self._raw
        connect = self.server.connect

        def counting(name: str, send: Callable[[bytes], None], latency_ms: int = 0) -> Any:
            def say(data: bytes) -> None:
                self.said += len(data)
                send(data)

            peer = connect(name, say, latency_ms)
            receive = peer.receive

            def hear(data: bytes) -> None:
                self.heard += len(data)
                receive(data)

            peer.receive = hear
            return peer

        self.server.connect = counting
        self.fetched = 0

    def send(self, data: bytes) -> None:
        """Send bytes to the module; they have been heard when this returns."""
        self.sent += len(data)
        self.write(data)
        self.settle()

    def settle(self) -> None:
        """All that was sent has been heard, and all that was said has come."""
        self.wait(lambda: self.heard == self.sent and self.fetched == self.said)

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

    async def open(self) -> str:
        """Open the link."""
        return await self.server.open(PtyLink())


class Tcp(ServedSerial):
    """A socket."""

    async def open(self) -> str:
        """Open the link."""
        return await self.server.open(TcpLink("127.0.0.1", 0))

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


LINKS = {"pty": Pty, "tcp": Tcp}
