"""TCP sockets, such as those of serial servers and of `tmcm34x serve --tcp`."""

from __future__ import annotations

import select
import socket
import time
from typing import TYPE_CHECKING, Final

from tmcm34x.host.exceptions import LinkError, LostLinkError
from tmcm34x.host.line import RealTime
from tmcm34x.links.reasons import reason

if TYPE_CHECKING:
    from tmcm34x.host.url import Url

CONNECT_S: Final = 5.0
"""How long a socket may take to connect."""
_READ_SIZE: Final = 4096


class SocketLine(RealTime):
    """A TCP socket."""

    def __init__(self, host: str, port: int) -> None:
        self.name = f"tcp:{f'[{host}]' if ':' in host else host}:{port}"
        try:
            self._socket = socket.create_connection((host, port), timeout=CONNECT_S)
        except (OSError, OverflowError, UnicodeError) as error:
            raise LinkError(f"cannot connect to {self.name}: {reason(error)}") from error
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket.setblocking(False)

    def write(self, data: bytes) -> None:
        """Send `data`, waiting for room where there is none."""
        while data:
            try:
                data = data[self._socket.send(data) :]
            except BlockingIOError:
                self._wait_for_room()
            except OSError as error:
                raise self._lost(reason(error)) from error

    def _wait_for_room(self) -> None:
        try:
            select.select([], [self._socket], [])
        except (OSError, ValueError) as error:
            raise self._lost("closed here") from error

    def read(self, size: int, timeout_s: float) -> bytes:
        """At least `size` bytes, or what has come when the time is over."""
        data, end = b"", 0.0
        while len(data) < size:
            end = end or time.monotonic() + timeout_s
            if not self._ready(max(0.0, end - time.monotonic())):
                break
            data += self._receive()
        return data

    def waiting(self) -> bytes:
        """What has come already."""
        return self._receive() if self._ready(0) else b""

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()

    def _ready(self, timeout_s: float) -> bool:
        try:
            return bool(select.select([self._socket], [], [], timeout_s)[0])
        except (OSError, ValueError) as error:
            raise self._lost("closed here") from error

    def _receive(self) -> bytes:
        try:
            data = self._socket.recv(_READ_SIZE)
        except BlockingIOError:
            return b""
        except OSError as error:
            raise self._lost(reason(error)) from error
        if not data:
            raise self._lost("the other side has hung up")
        return data

    def _lost(self, why: str) -> LostLinkError:
        return LostLinkError(
            f"{self.name}: the connection was lost ({why}); is the other side still running?"
        )


def open_line(url: Url) -> SocketLine:
    """The socket that `url` names.  Raises `LinkError`."""
    host, _, port = url.target.rpartition(":")
    return SocketLine(host.strip("[]") or "127.0.0.1", int(port))
