"""A line of the host library to a virtual module of a test."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tmcm34x.host.steps import Follow
    from tmcm34x.testing.virtual import VirtualModule


class HostLine:
    """See `host.line.Line`; time is that of the module."""

    real = False

    def __init__(self, module: VirtualModule) -> None:
        self._module = module
        self.name = module.name
        self._received = bytearray()
        self._peer = module.do(lambda: module.connect_line("host", self._received.extend))

    def write(self, data: bytes) -> None:
        """Send `data`."""
        self._module.do(lambda: self._peer.receive(data))

    def read(self, size: int, timeout_s: float) -> bytes:
        """At least `size` bytes, or what has come when the time is over."""
        if len(self._received) < size:
            self._module.run_until(lambda: len(self._received) >= size, timeout_s, events_only=True)
        return self.waiting()

    def waiting(self) -> bytes:
        """What has come already."""
        data = bytes(self._received)
        self._received.clear()
        return data

    def now(self) -> float:
        """The module's time [s]."""
        return self._module.now

    def sleep(self, seconds: float) -> None:
        """Let the module's time pass."""
        self._module.run(seconds)

    def follow(self, change: Follow, address: int) -> int:
        """A line of a test follows the module's bit rate by itself; only the address may change."""
        return address if change.address is None else change.address

    def close(self) -> None:
        """Hang up."""
        self._module.do(self._peer.disconnect)
