"""Lines: what carries bytes between this host and modules.

A `Line` knows no protocol.  It also owns time, so that time-outs hold in virtual time where the module is virtual.
Each kind has a module of its own, imported when such a line is opened: `serial_line`, `socket_line`, `can_line`, and
`bench.in_process` for modules in this process.
"""

from __future__ import annotations

import time
from importlib import import_module
from typing import TYPE_CHECKING, Final, Protocol

if TYPE_CHECKING:
    from tmcm34x.host.steps import Follow
    from tmcm34x.host.url import Url


class Line(Protocol):
    """A line with modules at its other end; all methods may raise `LinkError`."""

    name: str
    """For people and error texts."""
    real: bool
    """Whether a real module may be at its other end: then moving and storing need a word from the user."""

    def write(self, data: bytes) -> None:
        """Send `data`."""
        ...

    def read(self, size: int, timeout_s: float) -> bytes:
        """At least `size` bytes, or what has come when the time is over."""
        ...

    def waiting(self) -> bytes:
        """What has come already."""
        ...

    def now(self) -> float:
        """Time [s] of an arbitrary origin: the wall clock's, or virtual."""
        ...

    def sleep(self, seconds: float) -> None:
        """Let time pass."""
        ...

    def follow(self, change: Follow, address: int) -> int:
        """Take up another bit rate or identifier, where the line has one; the module's address from now on."""
        ...

    def close(self) -> None:
        """Hang up."""
        ...


class RealTime:
    """The wall clock, for lines of this world."""

    real = True

    def now(self) -> float:
        """Seconds of the wall clock."""
        return time.monotonic()

    def sleep(self, seconds: float) -> None:
        """Wait."""
        time.sleep(seconds)

    def follow(self, change: Follow, address: int) -> int:
        """There is no bit rate here; only the address may change."""
        return address if change.address is None else change.address


def open_line(url: Url) -> Line:
    """The line that `url` names.  Raises `LinkError`."""
    line: Line = import_module(_HOMES[url.scheme]).open_line(url)
    return line


_HOMES: Final = {
    "serial": "tmcm34x.host.serial_line",
    "tcp": "tmcm34x.host.socket_line",
    "can": "tmcm34x.host.can_line",
    "slcan": "tmcm34x.host.can_line",
    "virtual": "tmcm34x.bench.in_process",
}
"""`bench` is above this package, and imported when a module in this process is asked for."""
