"""Lines: what carries bytes between this host and modules.

A `Line` knows no protocol.  It also owns time, so that time-outs hold in virtual time where the module is virtual.
CAN frames are turned into the nine bytes of a serial line and back, and everything above knows only these.

Works on Linux, macOS and Windows: serial ports by pyserial's own calls, sockets by the standard library's.
"""

from __future__ import annotations

import contextlib
import errno
import importlib.util
import os
import select
import socket
import sys
import time
from typing import TYPE_CHECKING, Any, Final, Protocol

from tmcm34x.host.exceptions import LinkError
from tmcm34x.tmcl.datagram import (
    SIZE,
    checksum,
    pack_can_request,
    pack_reply,
    unpack_can_reply,
    unpack_request,
)
from tmcm34x.tmcl.numbers import CONTROL

if TYPE_CHECKING:
    from tmcm34x.host.steps import Follow
    from tmcm34x.host.url import Can, Url

CONNECT_S: Final = 5.0
"""How long a socket may take to connect."""
_READ_SIZE: Final = 4096


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


class SerialLine(RealTime):
    """A serial port, or what else pyserial opens by a URL, such as `socket://` and `rfc2217://`."""

    def __init__(self, url: str, baud: int) -> None:
        import serial

        self.name = url
        try:
            self._port: Any = serial.serial_for_url(url, baud, timeout=1.0, do_not_open=True)
            self._port.exclusive = True
            self._port.open()
        except (OSError, ValueError, AttributeError) as error:
            raise LinkError(f"cannot open {url}: {port_reason(error)}") from error
        self._timeout_s = 1.0
        # pyserial raises its own exception, an OSError, when a port goes away; termios has one that is none.
        self._gone: Final = (OSError, TypeError, _termios_error())

    def write(self, data: bytes) -> None:
        """Send `data`, waiting for room where there is none."""
        try:
            self._port.write(data)
        except self._gone as error:
            raise self._lost(error) from error

    def read(self, size: int, timeout_s: float) -> bytes:
        """At least `size` bytes, or what has come when the time is over."""
        port = self._port
        try:
            if timeout_s != self._timeout_s:
                port.timeout = self._timeout_s = timeout_s
            return port.read(size)
        except self._gone as error:
            raise self._lost(error) from error

    def waiting(self) -> bytes:
        """What has come already."""
        try:
            size = self._port.in_waiting
            return self._port.read(size) if size else b""
        except self._gone as error:
            raise self._lost(error) from error

    def follow(self, change: Follow, address: int) -> int:
        """Change the bit rate, or the address."""
        if change.baud is not None:
            try:
                self._port.baudrate = change.baud
            except (*self._gone, ValueError) as error:
                raise LinkError(f"{self.name}: the port does not take {change.baud} baud: {error}") from error
        return super().follow(change, address)

    def close(self) -> None:
        """Close the port."""
        with contextlib.suppress(*self._gone):
            self._port.close()

    def _lost(self, error: Exception) -> LinkError:
        return LinkError(f"{self.name}: the port is gone ({port_reason(error)}); is it plugged in?")


class SocketLine(RealTime):
    """A TCP socket."""

    def __init__(self, host: str, port: int) -> None:
        self.name = f"tcp:{f'[{host}]' if ':' in host else host}:{port}"
        try:
            self._socket = socket.create_connection((host, port), timeout=CONNECT_S)
        except (OSError, OverflowError, UnicodeError) as error:
            raise LinkError(f"cannot connect to {self.name}: {_reason(error)}") from error
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket.setblocking(False)

    def write(self, data: bytes) -> None:
        """Send `data`, waiting for room where there is none."""
        while data:
            try:
                data = data[self._socket.send(data) :]
            except BlockingIOError:
                select.select([], [self._socket], [])
            except OSError as error:
                raise LinkError(f"{self.name}: {_reason(error)}") from error

    def read(self, size: int, timeout_s: float) -> bytes:
        """At least `size` bytes, or what has come when the time is over."""
        data, end = b"", 0.0
        while len(data) < size:
            end = end or time.monotonic() + timeout_s
            if not self._ready(max(0.0, end - time.monotonic())):
                break
            data += self._receive()
        return data

    def waiting(self) -> bytes:
        """What has come already."""
        return self._receive() if self._ready(0) else b""

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()

    def _ready(self, timeout_s: float) -> bool:
        try:
            return bool(select.select([self._socket], [], [], timeout_s)[0])
        except (OSError, ValueError) as error:
            raise LinkError(f"{self.name}: the connection is closed") from error

    def _receive(self) -> bytes:
        try:
            data = self._socket.recv(_READ_SIZE)
        except BlockingIOError:
            return b""
        except OSError as error:
            raise LinkError(f"{self.name}: {_reason(error)}") from error
        if not data:
            raise LinkError(f"{self.name}: the other side has hung up")
        return data


class CanLine(RealTime):
    """A CAN bus that python-can knows (extra `can`); replies have the identifier `reply`.

    Telegrams keep the serial form above this line; the address of a module is the low byte of its identifier.
    """

    def __init__(self, interface: str, channel: str, options: Can) -> None:
        self.name = f"{interface}:{channel}"
        self._interface, self._channel, self._options = interface, channel, options
        self._number = 0
        try:
            import can
        except ImportError as error:
            raise LinkError("python-can is missing: install tmcm34x with its extra `can`") from error
        self._can: Any = can
        self._bus = self._join()

    def _join(self) -> Any:
        extra: dict[str, Any] = {"sleep_after_open": 0} if self._interface == "slcan" else {}
        rate = self._options.bitrate
        try:
            return self._can.Bus(interface=self._interface, channel=self._channel, bitrate=rate, **extra)
        except (self._can.CanError, OSError, ValueError, ImportError, TypeError, AttributeError) as error:
            raise LinkError(f"cannot join {self.name}: {' '.join(str(error).split())}") from error

    def follow(self, change: Follow, address: int) -> int:
        """Change identifiers or bit rate; a serial address is nothing to this line."""
        if change.can_id is not None:
            self._options = self._options._replace(id=change.can_id)
        if change.can_reply is not None:
            self._options = self._options._replace(reply=change.can_reply)
        if change.can_bit_rate is not None:
            self._options = self._options._replace(bitrate=change.can_bit_rate)
            self._bus.shutdown()
            self._bus = self._join()
        return self._options.id & 0xFF

    def write(self, data: bytes) -> None:
        """Send a telegram as a frame of eight bytes."""
        _, instruction = unpack_request(data)
        self._number = instruction.number
        frame = self._can.Message(
            arbitration_id=self._options.id, data=pack_can_request(instruction, 8), is_extended_id=False
        )
        try:
            self._bus.send(frame)
        except (self._can.CanError, OSError) as error:
            raise LinkError(f"{self.name}: a frame cannot be sent: {' '.join(str(error).split())}") from error

    def read(self, size: int, timeout_s: float) -> bytes:
        """At least `size` bytes, or what has come when the time is over."""
        data, end = b"", time.monotonic() + timeout_s
        while len(data) < size and (left := end - time.monotonic()) > 0:
            data += self._receive(left)
        return data

    def waiting(self) -> bytes:
        """What has come already."""
        data = b""
        while telegram := self._receive(0):
            data += telegram
        return data

    def close(self) -> None:
        """Leave the bus."""
        self._bus.shutdown()

    def _receive(self, timeout_s: float) -> bytes:
        try:
            frame = self._bus.recv(timeout_s)
        except (self._can.CanError, OSError) as error:
            raise LinkError(f"{self.name}: the bus is gone: {' '.join(str(error).split())}") from error
        reply = self._options.reply
        if frame is None or frame.arbitration_id != reply or frame.is_remote_frame or frame.is_error_frame:
            return b""
        return serial_form(self._number, bytes(frame.data), reply & 0xFF)


def serial_form(number: int, data: bytes, host: int) -> bytes:
    """The nine bytes of a serial line for the frame that answers command `number`; empty for other frames."""
    if len(data) not in {7, 8}:
        return b""
    if number == _VERSION and data[:1].isdigit() and data[3:4] in b"VB":
        return bytes((host,)) + data.ljust(SIZE - 1)
    if number == _READ_MEMORY and data[2] != _READ_MEMORY:
        body = bytes((host,)) + data[:7]
        return body + bytes((checksum(body),))
    return pack_reply(unpack_can_reply(data, host))


_READ_MEMORY: Final = CONTROL.READ_PROGRAM_MEMORY
_VERSION: Final = CONTROL.GET_FIRMWARE_VERSION


def open_line(url: Url) -> Line:
    """The line that `url` names.  Raises `LinkError`."""
    return _OPENERS[url.scheme](url)


def _open_can(url: Url) -> Line:
    interface, _, channel = url.target.partition(":")
    return CanLine(interface, channel, url.can)


def _open_virtual(url: Url) -> Line:
    """The module in this process: `bench` is above this package, and imported when one is asked for."""
    from importlib import import_module

    return import_module("tmcm34x.bench.in_process").open_line(url)


def _open_tcp(url: Url) -> Line:
    host, _, port = url.target.rpartition(":")
    return SocketLine(host.strip("[]") or "127.0.0.1", int(port))


def _open_serial(url: Url) -> Line:
    return SerialLine(url.target, url.baud)


def _open_slcan(url: Url) -> Line:
    return CanLine("slcan", url.target, url.can)


_OPENERS: Final = {
    "serial": _open_serial,
    "tcp": _open_tcp,
    "can": _open_can,
    "slcan": _open_slcan,
    "virtual": _open_virtual,
}


def port_reason(error: Exception) -> str:
    """Why a port could not be opened, in words for its user."""
    number = getattr(error, "errno", None)
    if number in {errno.EAGAIN, errno.EBUSY}:
        return "another program is using it"
    return os.strerror(number) if number else str(error)


def _reason(error: Exception) -> str:
    number = getattr(error, "errno", None)
    return os.strerror(number) if number and number > 0 else str(error)


def _termios_error() -> type[Exception]:
    if sys.platform == "win32" or importlib.util.find_spec("termios") is None:
        return OSError
    import termios

    return termios.error
