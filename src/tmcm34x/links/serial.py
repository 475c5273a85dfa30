"""A real serial port: the virtual module at the end of a real cable, by pyserial's own calls, on any system.

One thread reads the port and one writes it; the module works on the event loop.  A port that goes away (a USB adapter
pulled) is tried again once a second until it is back.
"""

from __future__ import annotations

import asyncio
import contextlib
import queue
import threading
from collections.abc import Callable
from functools import partial
from typing import Final

import serial

from tmcm34x.links import Connect, LinkOpenError, Peer
from tmcm34x.links.reasons import port_reason

RETRY_S: Final = 1.0
_LOOK_S: Final = 0.5
"""Longest wait for bytes before the reader looks whether it is still needed."""


class SerialLink:
    """The port `device` at `baud` bits per second, 8 data bits, no parity, one stop bit."""

    kind = "serial"
    latency_ms = 40
    """USB adapters hand over what has come every 16 ms, whatever it is."""
    baud_rate = None

    def __init__(self, device: str, baud: int) -> None:
        self._device = device
        self._baud = baud
        self._cable: _Cable | None = None
        self._peer: Peer | None = None
        self._retry: asyncio.TimerHandle | None = None
        self._away = False
        self.report: Callable[[str], None] | None = None
        """Takes a line of text when the port was disconnected and when it is connected again."""

    async def open(self, connect: Connect) -> str:
        """Open the port for ourselves alone; returns its name."""
        self._connect = connect
        try:
            self._start()
        except (OSError, ValueError) as error:
            raise LinkOpenError(f"cannot open {self._device}: {port_reason(error)}") from error
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
        if self._cable is None:
            self._restart()

    def _start(self) -> None:
        port = serial.Serial(self._device, self._baud, timeout=_LOOK_S, exclusive=True)
        self._cable = cable = _Cable(port, self._receive, self._lost)
        self._peer = self._connect(f"{self.kind} {self._device}", cable.send)
        cable.start()

    def _stop(self) -> None:
        if self._cable is not None:
            self._cable.stop()
            self._cable = None
        if self._peer is not None:
            self._peer.disconnect()
            self._peer = None

    def _receive(self, cable: _Cable, data: bytes) -> None:
        if cable is self._cable and self._peer is not None:
            self._peer.receive(data)

    def _lost(self, cable: _Cable) -> None:
        if cable is self._cable:
            self._restart()

    def _restart(self) -> None:
        self._stop()
        try:
            self._start()
        except OSError as error:
            self._retry = asyncio.get_running_loop().call_later(RETRY_S, self._restart)
            self._tell(
                True, f"{self._device} was disconnected ({port_reason(error)}); trying again every second"
            )
        else:
            self._tell(False, f"{self._device} is back")

    def _tell(self, away: bool, line: str) -> None:
        if away != self._away and self.report is not None:
            self.report(line)
        self._away = away


class _Cable:
    """An open port with its two threads; what they do arrives on the event loop."""

    def __init__(
        self,
        port: serial.Serial,
        receive: Callable[[_Cable, bytes], None],
        lost: Callable[[_Cable], None],
    ) -> None:
        self._port = port
        self._receive = partial(receive, self)
        self._lost = partial(lost, self)
        self._loop = asyncio.get_running_loop()
        self._outgoing: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        self._open = True
        self._threads = [
            threading.Thread(target=work, name=f"serial {name}", daemon=True)
            for name, work in (("reader", self._read), ("writer", self._write))
        ]

    def start(self) -> None:
        """Begin to read."""
        for thread in self._threads:
            thread.start()

    def send(self, data: bytes) -> None:
        """Have `data` written."""
        self._outgoing.put(data)

    def stop(self) -> None:
        """Close the port and end the threads."""
        self._open = False
        self._outgoing.put(b"")
        with contextlib.suppress(OSError, AttributeError):
            self._port.cancel_read()
            self._port.cancel_write()
        for thread in self._threads:
            thread.join()
        self._port.close()

    def _read(self) -> None:
        try:
            while self._open:
                if data := self._port.read(1):
                    self._call(self._receive, data + self._port.read(self._port.in_waiting))
        except (OSError, TypeError):  # pyserial's own words for a port that was closed under it
            self._call(self._lost)

    def _write(self) -> None:
        try:
            while data := self._outgoing.get():
                self._port.write(data)
        except OSError:
            self._call(self._lost)

    def _call(self, action: Callable[..., None], *operands: bytes) -> None:
        if self._open:
            with contextlib.suppress(RuntimeError):  # the event loop has ended
                self._loop.call_soon_threadsafe(action, *operands)
