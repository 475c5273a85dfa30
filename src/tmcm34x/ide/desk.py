"""The IDE's own line to its virtual module: both ends are in this process."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tmcm34x.links import Connect, Peer, Send


class Desk:
    """The IDE's own line, as a link of the server; `take` gets what the module sends."""

    kind = "ide"
    latency_ms = 0
    baud_rate = None

    def __init__(self, take: Send) -> None:
        self._take = take
        self._connect: Connect | None = None
        self._peer: Peer | None = None

    async def open(self, connect: Connect) -> str:
        """Plug the line in."""
        self._connect = connect
        self.plug_in()
        return "IDE"

    def close(self) -> None:
        """Pull it out."""
        if self._peer is not None:
            self._peer.disconnect()
            self._peer = None

    def plug_in(self) -> None:
        """Begin a new conversation."""
        self.close()
        assert self._connect is not None
        self._peer = self._connect("IDE", self._take)

    def write(self, data: bytes) -> None:
        """Send to the module."""
        if self._peer is not None:
            self._peer.receive(data)
