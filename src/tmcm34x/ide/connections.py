"""Connections of browsers: so many at most, and none on which nothing moves.

An HTTP connection has a moment for a request and for taking its reply.  A web socket that takes nothing for a while is
reset with all that waits for it.  Where no more connections fit, the oldest one that is no web socket makes room: web
sockets are those of windows that brought the token.

Source: fidelity IDE-17.
"""

from __future__ import annotations

import asyncio
import logging
from itertools import count
from typing import TYPE_CHECKING, Any, Final

from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

from tmcm34x.links.tcp import STALL_S, fitting

if TYPE_CHECKING:
    import h11

REQUEST_S: Final = 30.0
"""For a whole request and its reply."""
MOST: Final = 128
_FILES: Final = 10
"""Files for each connection, with what stands behind it."""

_numbers = count()


def most_connections() -> int:
    """How many connections the process has files for."""
    return fitting(MOST, _FILES)


class _Limit:
    """Resets a connection after some seconds, unless it is lifted before."""

    def __init__(self) -> None:
        self._timer: asyncio.TimerHandle | None = None

    def set(self, transport: asyncio.Transport, seconds: float) -> None:
        self.lift()
        self._timer = asyncio.get_running_loop().call_later(seconds, transport.abort)

    def lift(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None


class HttpConnection(H11Protocol):
    """A connection that is no web socket, or none yet."""

    def __init__(self, *arguments: Any, **more: Any) -> None:
        super().__init__(*arguments, **more)
        self._limit = _Limit()
        self.number = next(_numbers)

    def connection_made(self, transport: asyncio.Transport) -> None:
        """Have the time for a request."""
        super().connection_made(transport)
        self._limit.set(transport, REQUEST_S)
        if len(self.connections) > most_connections():
            _make_room(self.connections)

    def on_response_complete(self) -> None:
        """Have the time for another request."""
        self._limit.set(self.transport, REQUEST_S)
        super().on_response_complete()

    def handle_websocket_upgrade(self, event: h11.Request) -> None:
        """Become a web socket."""
        self._limit.lift()
        super().handle_websocket_upgrade(event)

    def connection_lost(self, exc: Exception | None) -> None:
        """End."""
        self._limit.lift()
        super().connection_lost(exc)


def _make_room(connections: set[Any]) -> None:
    """Reset the oldest HTTP connection; the newest of all is one."""
    oldest = min(
        (one for one in connections if isinstance(one, HttpConnection)),
        key=lambda connection: connection.number,
    )
    connections.discard(oldest)
    oldest.transport.abort()


class SocketConnection(WebSocketsSansIOProtocol):
    """A web socket."""

    def __init__(self, *arguments: Any, **more: Any) -> None:
        super().__init__(*arguments, **more)
        self._limit = _Limit()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Have `pause_writing` called for anything that is not taken at once."""
        super().connection_made(transport)
        self.transport.set_write_buffer_limits(0)

    def pause_writing(self) -> None:
        """Something waits for the window."""
        super().pause_writing()
        self._limit.set(self.transport, STALL_S)

    def resume_writing(self) -> None:
        """The window has taken all."""
        self._limit.lift()
        super().resume_writing()

    def handle_ping(self) -> None:
        """Answer, unless what was sent before is not taken: answers to a flood must not pile up."""
        if self.writable.is_set():
            super().handle_ping()
        else:
            self.transport.abort()

    def shutdown(self) -> None:
        """The server ends, and does not wait for a window that takes nothing."""
        if self.writable.is_set():
            super().shutdown()
        else:
            self.transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        """End."""
        self._limit.lift()
        super().connection_lost(exc)


def _ours(record: logging.LogRecord) -> bool:
    """Whether a record is about a fault of the server's, and not about what a client did or did not do."""
    cancelled = record.exc_info is not None and isinstance(record.exc_info[1], asyncio.CancelledError)
    return not cancelled and not str(record.msg).startswith(_CLIENTS)


_CLIENTS: Final = ("Invalid UTF-8 sequence", "Cancel %s running task")

logging.getLogger("uvicorn.error").addFilter(_ours)
