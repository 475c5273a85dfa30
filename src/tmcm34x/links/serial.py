"""A real serial port: the virtual module at the end of a real cable.

A port that goes away (a USB adapter pulled) is tried again once a second until it is back.
"""

from __future__ import annotations

import asyncio
import errno
import os
from typing import Final

import serial

from tmcm34x.links import Connect, LinkError, Peer
from tmcm34x.links.descriptor import Descriptor

RETRY_S: Final = 1.0


class SerialLink:
    """The port `device` at `baud` bits per second, 8 data bits, no parity, one stop bit."""

    kind = "serial"
    latency_ms = 40
    """USB adapters hand over what has come every 16 ms, whatever it is."""
    baud_rate = None

    def __init__(self, device: str, baud: int) -> None:
        self._device = device
        self._baud = baud
        self._port: serial.Serial | None = None
        self._descriptor: Descriptor | None = None
        self._peer: Peer | None = None
        self._retry: asyncio.TimerHandle | None = None

    async def open(self, connect: Connect) -> str:
        """Open the port for ourselves alone; returns its name."""
        self._connect = connect
        try:
            self._start()
        except (OSError, ValueError) as error:
            raise LinkError(f"cannot open {self._device}: {port_reason(error)}") from error
        return self._device

    def close(self) -> None:
        """Close the port."""
        self.unplug()

    def hang_up(self) -> None:
        """Close the port and open it again."""
        self.unplug()
        self.plug_in()

    def unplug(self) -> None:
        """Close the port."""
        if self._retry is not None:
            self._retry.cancel()
            self._retry = None
        self._stop()

    def plug_in(self) -> None:
        """Open the port again."""
        if self._port is None:
            self._restart()

    def _start(self) -> None:
        self._port = serial.Serial(self._device, self._baud, timeout=0, exclusive=True)
        self._peer = self._connect(f"{self.kind} {self._device}", self._send)
        self._descriptor = Descriptor(self._port.fileno(), self._peer.receive, self._restart)

    def _stop(self) -> None:
        if self._descriptor is not None:
            self._descriptor.stop()
            self._descriptor = None
        if self._port is not None:
            self._port.close()
            self._port = None
        if self._peer is not None:
            self._peer.disconnect()
            self._peer = None

    def _send(self, data: bytes) -> None:
        if self._descriptor is not None:
            self._descriptor.send(data)

    def _restart(self) -> None:
        self._stop()
        try:
            self._start()
        except OSError:
            self._retry = asyncio.get_running_loop().call_later(RETRY_S, self._restart)


def port_reason(error: Exception) -> str:
    """Why a port could not be opened, in words for its user."""
    number = getattr(error, "errno", None)
    if number in {errno.EAGAIN, errno.EBUSY}:
        return "another program is using it"
    return os.strerror(number) if number else str(error)
