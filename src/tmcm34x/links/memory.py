"""A link inside one process: a client without a file descriptor, for tests and tools in virtual time."""

from __future__ import annotations

from tmcm34x.links import Connect, Peer


class MemoryClient:
    """The host's end: `write` sends, `read` takes what has come back so far."""

    def __init__(self, connect: Connect, name: str = "memory") -> None:
        self._received = bytearray()
        self._connect = connect
        self._name = name
        self._peer: Peer = connect(name, self._received.extend)
        self.connected = True

    def write(self, data: bytes) -> None:
        """Send `data` to the module; it is lost where the line has been cut."""
        if self.connected:
            self._peer.receive(data)

    @property
    def waiting(self) -> int:
        """Bytes that `read` would take."""
        return len(self._received)

    def read(self, size: int | None = None) -> bytes:
        """Up to `size` bytes that the module has sent, all of them by default."""
        end = len(self._received) if size is None else size
        data = bytes(self._received[:end])
        del self._received[:end]
        return data

    def close(self) -> None:
        """Hang up."""
        if self.connected:
            self.connected = False
            self._peer.disconnect()

    hang_up = unplug = close

    def plug_in(self) -> None:
        """Connect again, as if for the first time."""
        if not self.connected:
            self._peer = self._connect(self._name, self._received.extend)
            self.connected = True
