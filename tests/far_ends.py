"""The other end of a connection, where both are in this process."""

import contextlib
import gc
import socket


def far_end(address):
    """The server's socket whose client has `address`."""
    for sock in gc.get_objects():
        if isinstance(sock, socket.socket) and sock.fileno() >= 0:
            with contextlib.suppress(OSError):
                if sock.getpeername() == address:
                    return sock
    raise AssertionError
