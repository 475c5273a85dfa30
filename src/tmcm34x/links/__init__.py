"""Links: what carries bytes between a host and a module's line.

A link knows no protocol.  It waits for clients; for each one it asks `connect` for the module's end of the
line and passes on what the client sends.  Wires are bound methods: the link gives `connect` its own `send`
and gets a `Peer` back.

Serial links carry bytes, CAN links frames; both kinds look alike otherwise.

Read in this order: this file, `memory`, `tcp`, `serial`, `can`, `posix.pty`, `posix.slcan`; then what disturbs lines:
`timing`, `pacing`, `faults`, `faulty`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, Protocol, runtime_checkable

Send = Callable[[bytes], None]
"""Takes bytes for the client; bytes that are not fetched are lost, as on a wire."""


class LinkOpenError(Exception):
    """A link that cannot be opened; the text is one clear line."""


class Peer(Protocol):
    """The module's end of one client's line."""

    def receive(self, data: bytes) -> None:
        """Take bytes that the client sent."""
        ...

    def disconnect(self) -> None:
        """The client is gone."""
        ...


Connect = Callable[[str, Send], Peer]
"""Called by a link for each new client, with a name for logs and a way to send."""


class Link(Protocol):
    """A place where clients connect, on the running event loop."""

    kind: str
    """Word on the `ready` line."""
    latency_ms: int
    """How much later than its neighbour a byte of the same telegram may come through this kind of link."""

    @property
    def baud_rate(self) -> Callable[[], int] | None:
        """Tells the bits per second that the client has set; None where there is nothing to set."""
        ...

    async def open(self, connect: Connect) -> str:
        """Begin to take clients; return the address that they use.

        Raises `LinkOpenError`.
        """
        ...

    def close(self) -> None:
        """Let go of all clients and of the address."""
        ...


@runtime_checkable
class Plug(Protocol):
    """A link that can be cut."""

    def hang_up(self) -> None:
        """Disconnect all clients; they may connect again."""
        ...

    def unplug(self) -> None:
        """Disconnect all clients and accept no others."""
        ...

    def plug_in(self) -> None:
        """Accept clients again."""
        ...


EXTENDED: Final = 1 << 31
"""Set in the identifier of a CAN frame that has 29 bits of it, not 11 (as in SocketCAN)."""


@runtime_checkable
class Reporting(Protocol):
    """A link that goes away and comes back by itself."""

    report: Callable[[str], None] | None
    """Takes a line for the user about that."""


@runtime_checkable
class Moving(Protocol):
    """A link that may have another address after `plug_in`."""

    kind: str
    moved: Callable[[str], None] | None
    """Called with the new address."""


SendFrame = Callable[[int, bytes], None]
"""Takes identifier and data bytes of a CAN frame for the client."""


class BusPeer(Protocol):
    """The bus at which one client's CAN adapter is."""

    def receive_frame(self, identifier: int, data: bytes, bit_rate: int | None) -> None:
        """Take a frame that the client sends, at `bit_rate` bits per second; None is whatever the bus has."""
        ...

    def disconnect(self) -> None:
        """The client is gone."""
        ...


ConnectBus = Callable[[str, SendFrame], BusPeer]
"""Called by a CAN link for each new client, with a name for logs and a way to send."""


class CanLink(Protocol):
    """A place where CAN clients connect, on the running event loop."""

    kind: str
    """Word on the `ready` line."""

    async def open(self, connect: ConnectBus) -> str:
        """Begin to take clients; return the address that they use.

        Raises `LinkOpenError`.
        """
        ...

    def close(self) -> None:
        """Let go of all clients and of the address."""
        ...
