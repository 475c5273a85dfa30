"""Telegrams over TCP: each client is one more host on the module's line.

The stream carries the same bytes as a serial line, with nothing around them.

Source: manual 6.1 for the telegrams; the transport is that of serial-to-Ethernet converters (fidelity WIRE-1).
"""

from __future__ import annotations

import asyncio
import os
import socket
import sys
from collections.abc import Callable
from typing import Final, cast

from tmcm34x.links import Connect, LinkOpenError, Peer

STALL_S: Final = 30.0
"""How long the other end of a connection may take nothing of what is sent to it, until it is given up."""
MOST_EDITORS: Final = 64
"""Of one server of editors, at a time."""
_READ_SIZE: Final = 4096
_MOST_CLIENTS: Final = 4096
_KEEP_ALIVE: Final = {"TCP_KEEPIDLE": 60, "TCP_KEEPINTVL": 10, "TCP_KEEPCNT": 3}
"""Seconds until the other end is asked whether it is there, between two questions, and how many."""


class TcpLink:
    """A listening socket; port 0 lets the system choose one.

    A connection more than the process has file descriptors for is reset at once.
    """

    kind = "tcp"
    latency_ms = 0
    baud_rate = None

    def __init__(self, host: str, port: int) -> None:
        self._host = host
        self._port = port
        self._clients: set[_Client] = set()
        self._server: asyncio.Server | None = None
        self._unplugged = False
        self._most = most_clients()

    async def open(self, connect: Connect) -> str:
        """Listen; returns `host:port` with the port in use."""
        loop = asyncio.get_running_loop()
        try:
            self._server = await loop.create_server(
                lambda: _Client(connect, self._clients, self._accepts), self._host, self._port
            )
        except OSError as error:
            reason = os.strerror(error.errno) if error.errno and error.errno > 0 else error.strerror
            raise LinkOpenError(f"cannot listen on {_join(self._host, self._port)}: {reason}") from error
        return _join(*self._server.sockets[0].getsockname()[:2])

    def close(self) -> None:
        """Stop listening and drop all clients."""
        if self._server is not None:
            self._server.close()
        self.hang_up()

    def hang_up(self) -> None:
        """Reset all connections."""
        for client in tuple(self._clients):
            client.abort()

    def unplug(self) -> None:
        """Reset all connections, and new ones at once."""
        self._unplugged = True
        self.hang_up()

    def plug_in(self) -> None:
        """Accept connections again."""
        self._unplugged = False

    def _accepts(self) -> bool:
        return not self._unplugged and len(_CLIENTS) < self._most


class _Client(asyncio.BufferedProtocol):
    """One connection.  A client that does not fetch its replies is not read from meanwhile.

    It reads into a small buffer of its own: asyncio would allocate 256 KiB for each telegram, which takes as long as
    the rest of a round trip.
    """

    def __init__(self, connect: Connect, clients: set[_Client], accepts: Callable[[], bool]) -> None:
        self._connect = connect
        self._buffer = bytearray(_READ_SIZE)
        self._clients = clients
        self._accepts = accepts
        self._peer: Peer | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast(asyncio.Transport, transport)
        name = transport.get_extra_info("peername")
        if not name or not self._accepts():  # a client that reset its connection has no name any more
            self._transport.abort()
            return
        keep_alive(self._transport.get_extra_info("socket"))
        self._clients.add(self)
        _CLIENTS.add(self)
        self._peer = self._connect(f"tcp {_join(*name[:2])}", self._send)

    def get_buffer(self, sizehint: int) -> bytearray:
        return self._buffer

    def buffer_updated(self, nbytes: int) -> None:
        if self._peer is not None:
            self._peer.receive(bytes(self._buffer[:nbytes]))

    def connection_lost(self, exc: Exception | None) -> None:
        self._clients.discard(self)
        _CLIENTS.discard(self)
        if self._peer is not None:
            self._peer.disconnect()

    def _send(self, data: bytes) -> None:
        # asyncio complains on the error output about what is written to a connection that was reset.
        if not self._transport.is_closing():
            self._transport.write(data)

    def pause_writing(self) -> None:
        self._transport.pause_reading()

    def resume_writing(self) -> None:
        self._transport.resume_reading()

    def abort(self) -> None:
        self._transport.abort()


_CLIENTS: Final[set[_Client]] = set()
"""The connections of this process, over all links."""


def most_clients() -> int:
    """How many connections fit into half of the files that the process may open, so that there are some left."""
    return fitting(_MOST_CLIENTS, 2)


def fitting(most: int, files: int) -> int:
    """How many connections fit, 4 to `most`, when so many of the files that the process may open are for each."""
    if sys.platform == "win32":
        return most
    from resource import RLIMIT_NOFILE, getrlimit

    return max(4, min(most, getrlimit(RLIMIT_NOFILE)[0] // files))


def keep_alive(connection: socket.socket) -> None:
    """Have connections dropped whose other end has vanished without a word."""
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for name, value in _KEEP_ALIVE.items():
        if hasattr(socket, name):
            connection.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), value)


def _join(host: str, port: int) -> str:
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"
