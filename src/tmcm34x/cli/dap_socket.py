"""Editors that reach the debug adapter through a TCP port.

Each has a thread of its own, so that none keeps another waiting.  An editor that takes nothing of what is sent to it,
or has sent nothing at all, is given up after a while; one whose computer is gone is found out by TCP's own keepalive.
"""

from __future__ import annotations

import contextlib
import socket
import struct
import threading
import time
from collections.abc import Callable
from typing import Final

from tmcm34x.links.tcp import MOST_EDITORS, STALL_S, keep_alive, most_clients

_READ_SIZE: Final = 65536
_AGAIN_S: Final = 0.1
_RESET: Final = struct.pack("ii", 1, 0)
"""Of SO_LINGER: what was not taken is thrown away."""

Converse = Callable[[Callable[[], bytes], Callable[[bytes], object]], object]
"""Talks with an editor until it disconnects; takes how to read and how to write."""


class Editor:
    """The socket of an editor.

    stall_s: how long it may take nothing, and has for its first bytes [s]
    """

    def __init__(self, connection: socket.socket, stall_s: float = STALL_S) -> None:
        connection.settimeout(stall_s)
        with contextlib.suppress(OSError):  # It may have been reset already.
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            keep_alive(connection)
        self._connection = connection
        self._met = False

    def read(self) -> bytes:
        """The next bytes of the editor, none when it is gone; it may be silent for hours once it has sent some."""
        while True:
            try:
                data = self._connection.recv(_READ_SIZE)
            except TimeoutError:
                if self._met:
                    continue
                return b""
            self._met = True
            return data

    def write(self, data: bytes) -> None:
        """Send all of `data`.  Raises `ConnectionError`, also when nothing is taken for too long."""
        left = memoryview(data)
        try:
            while left:
                left = left[self._connection.send(left) :]
        except OSError as error:
            _forget_rest(self._connection)
            raise ConnectionError(str(error)) from error

    def close(self) -> None:
        """Hang up; a thread that reads meanwhile gets no bytes."""
        with contextlib.suppress(OSError):
            self._connection.shutdown(socket.SHUT_RDWR)
        self._connection.close()


def listen(host: str, port: int) -> socket.socket:
    """A listening socket.  Raises `OSError`."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    return socket.create_server((host, port), family=family)


def serve(server: socket.socket, converse: Converse) -> None:
    """Talk with each editor that connects, in a thread of its own; more of them than fit are reset at once."""
    places = threading.Semaphore(min(MOST_EDITORS, most_clients()))
    while True:
        try:
            connection = server.accept()[0]
        except OSError:  # There are no more files; or the editor is gone already.
            time.sleep(_AGAIN_S)
            continue
        if places.acquire(blocking=False):
            threading.Thread(target=_attend, args=(connection, converse, places), daemon=True).start()
        else:
            _forget_rest(connection)
            connection.close()


def _attend(connection: socket.socket, converse: Converse, places: threading.Semaphore) -> None:
    """One editor, to its end."""
    editor = Editor(connection)
    try:
        converse(editor.read, editor.write)
    finally:
        editor.close()
        places.release()


def _forget_rest(connection: socket.socket) -> None:
    """Have the connection reset when it is closed, with what was not taken."""
    with contextlib.suppress(OSError):
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _RESET)
