"""Pseudo terminal: a serial port that any host program can open by its path.

The client's side is named, raw from the start, and outlives its clients.  Linux tells the master side of a
hang-up only when no other process has the client's side open; so the link holds it open while it waits, lets go
when the first byte shows that a client is there, and takes it again when that client has hung up.  What the
client left unread is then thrown away, as the driver of a real port does.

Leaves out: the client's modem control lines.  Its bit rate is readable (`baud_rate`) but delays nothing
(fidelity WIRE-2).
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import sys
import termios
import tty
from collections.abc import Callable
from pathlib import Path

from tmcm34x.links import Connect, LinkOpenError, Peer

assert sys.platform != "win32"

from tmcm34x.links.posix.descriptor import Descriptor  # noqa: E402 - on Windows a checker finds nothing there

_NO_FD = -1


class PtyLink:
    """A pseudo terminal, with a symbolic link to its path if `link` names one."""

    kind = "pty"
    latency_ms = 0

    def __init__(self, link: str | None = None) -> None:
        self._link = None if link is None else Path(link)
        self._linked = False
        self._master = _NO_FD
        self._slave = _NO_FD
        self._path = ""
        self._descriptor: Descriptor | None = None
        self._peer: Peer | None = None
        self.moved: Callable[[str], None] | None = None
        """Called with the new address when the terminal has been replaced (`plug_in`)."""

    async def open(self, connect: Connect) -> str:
        """Create the terminal; returns its path, or that of the symbolic link."""
        self._connect = connect
        return self._start()

    def close(self) -> None:
        """Remove the symbolic link and hang up."""
        if self._linked and self._link is not None:
            self._remove_link(self._link)
        if self._descriptor is not None:
            self._descriptor.stop()
            self._descriptor = None
        self._drop_peer()
        self._release_slave()
        if self._master != _NO_FD:
            os.close(self._master)
            self._master = _NO_FD

    def hang_up(self) -> None:
        """Replace the terminal by another one: clients see theirs gone."""
        self.unplug()
        self.plug_in()

    unplug = close

    def plug_in(self) -> None:
        """Make another terminal, under the same symbolic link; `moved` gets its address."""
        if self._master == _NO_FD:
            address = self._start()
            if self.moved is not None:
                self.moved(address)

    def _start(self) -> str:
        try:
            self._master, self._slave = os.openpty()
        except OSError as error:
            raise LinkOpenError(f"cannot create a pseudo terminal: {error.strerror}") from error
        self._path = os.ttyname(self._slave)
        tty.setraw(self._slave)
        if self._link is not None:
            self._make_link(self._link)
        self._listen()
        return self._path if self._link is None else str(self._link)

    def baud_rate(self) -> int:
        """The bit rate that the client has set, 0 if it is none that has a name."""
        speed = termios.tcgetattr(self._master)[5]
        return _RATES.get(speed, 0)

    def _make_link(self, link: Path) -> None:
        # A killed process leaves its link behind.  It is ours if it points at nothing, or at the very
        # terminal that we have just been given.
        stale = link.is_symlink() and (not link.exists() or str(link.readlink()) == self._path)
        try:
            if stale:
                link.unlink()
            link.symlink_to(self._path)
        except FileExistsError as error:
            self.close()
            raise LinkOpenError(f"{link} is already there") from error
        except OSError as error:
            self.close()
            raise LinkOpenError(f"cannot create {link}: {error.strerror}") from error
        self._linked = True

    def _remove_link(self, link: Path) -> None:
        self._linked = False
        with contextlib.suppress(OSError):
            if str(link.readlink()) == self._path:
                link.unlink()

    def _listen(self) -> None:
        self._descriptor = Descriptor(self._master, self._receive_first, self._hang_up)

    def _receive_first(self, data: bytes) -> None:
        assert self._descriptor is not None
        self._peer = peer = self._connect(self.kind, self._descriptor.send)
        self._descriptor.receive = peer.receive
        self._release_slave()
        peer.receive(data)

    def _release_slave(self) -> None:
        if self._slave != _NO_FD:
            # A client that asked for exclusive use would lock everybody out for good, us included.
            with contextlib.suppress(OSError):
                fcntl.ioctl(self._slave, termios.TIOCNXCL)
            os.close(self._slave)
            self._slave = _NO_FD

    def _hang_up(self) -> None:
        self._drop_peer()
        self._slave = os.open(self._path, os.O_RDWR | os.O_NOCTTY)
        termios.tcflush(self._slave, termios.TCIFLUSH)
        tty.setraw(self._slave)
        self._listen()

    def _drop_peer(self) -> None:
        if self._peer is not None:
            self._peer.disconnect()
            self._peer = None


_RATES = {
    getattr(termios, name): int(name[1:]) for name in dir(termios) if name[0] == "B" and name[1:].isdecimal()
}
