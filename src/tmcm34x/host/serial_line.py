"""Serial ports, and what else pyserial opens by a URL, such as `socket://` and `rfc2217://`.

Works on Linux, macOS and Windows by pyserial's own calls.  Ports of the first two are file descriptors, and are used as
such: that is faster, which counts where a module on a pseudo terminal answers in 30 us.
"""

from __future__ import annotations

import contextlib
import errno
import importlib.util
import os
import select
import sys
import time
from typing import TYPE_CHECKING, Any, Final

import serial

from tmcm34x.host.exceptions import LinkError, LostLinkError
from tmcm34x.host.line import RealTime
from tmcm34x.links.reasons import is_in_use, port_reason

if TYPE_CHECKING:
    from tmcm34x.host.steps import Follow
    from tmcm34x.host.url import Url

_READ_SIZE: Final = 4096


class SerialLine(RealTime):
    """A port that pyserial opens; see `open_line`."""

    def __init__(self, name: str, port: Any) -> None:
        self.name = name
        self._port = port
        self._timeout_s: float | None = None

    def write(self, data: bytes) -> None:
        """Send `data`, waiting for room where there is none."""
        try:
            self._port.write(data)
        except GONE as error:
            raise self._lost(error) from error

    def read(self, size: int, timeout_s: float) -> bytes:
        """At least `size` bytes, or what has come when the time is over."""
        try:
            if timeout_s != self._timeout_s:
                self._port.timeout = self._timeout_s = timeout_s
            return self._port.read(size)
        except GONE as error:
            raise self._lost(error) from error

    def waiting(self) -> bytes:
        """What has come already."""
        try:
            size = self._port.in_waiting
            return self._port.read(size) if size else b""
        except GONE as error:
            raise self._lost(error) from error

    def follow(self, change: Follow, address: int) -> int:
        """Change the bit rate, or the address."""
        if change.baud is not None:
            try:
                self._port.baudrate = change.baud
            except (*GONE, ValueError) as error:
                raise LinkError(f"{self.name}: the port does not take {change.baud} baud: {error}") from error
        return super().follow(change, address)

    def close(self) -> None:
        """Close the port."""
        with contextlib.suppress(*GONE):
            self._port.close()

    def _lost(self, error: Exception) -> LostLinkError:
        if is_in_use(error):
            return LostLinkError(
                f"{self.name}: another program reads from this port; close it and begin again"
            )
        return LostLinkError(
            f"{self.name}: the port was disconnected ({port_reason(error)}); is it plugged in?"
        )


class DescriptorLine(SerialLine):
    """A port of a POSIX system, read and written by its file descriptor; pyserial does everything else."""

    def write(self, data: bytes) -> None:
        """Send `data`, waiting for room where there is none."""
        descriptor = self._port.fd
        try:
            while data := data[self._write_some(descriptor, data) :]:
                select.select((), (descriptor,), ())
        except (*GONE, ValueError) as error:
            raise self._lost(error) from error

    def _write_some(self, descriptor: int, data: bytes) -> int:
        """How many bytes of `data` there was room for."""
        try:
            return os.write(descriptor, data)
        except BlockingIOError:
            return 0

    def read(self, size: int, timeout_s: float) -> bytes:
        """At least `size` bytes, or what has come when the time is over."""
        data = self._next(size, timeout_s)
        if len(data) == size:
            return data
        end = time.monotonic() + timeout_s
        while data and len(data) < size and (more := self._next(size - len(data), end - time.monotonic())):
            data += more
        return data

    def waiting(self) -> bytes:
        """What has come already."""
        return self._next(_READ_SIZE, 0.0)

    def _next(self, size: int, timeout_s: float) -> bytes:
        """What comes next, at most `size` bytes; nothing when the time is over."""
        descriptor = self._port.fd
        try:
            if not select.select((descriptor,), (), (), max(0.0, timeout_s))[0]:
                return b""
            data = os.read(descriptor, size)
        except (*GONE, ValueError) as error:
            raise self._lost(error) from error
        if not data:
            raise self._lost(OSError(errno.EIO, "no bytes"))
        return data


def open_line(url: Url) -> SerialLine:
    """The port that `url` names.  Raises `LinkError`."""
    name = url.target
    try:
        port = serial.serial_for_url(name, url.baud, timeout=1.0, do_not_open=True)
        port.exclusive = True
        port.open()
    except (OSError, ValueError, AttributeError) as error:
        raise LinkError(f"cannot open {name}: {port_reason(error)}") from error
    return (DescriptorLine if hasattr(port, "fd") else SerialLine)(name, port)


def _termios_error() -> type[Exception]:
    if sys.platform == "win32" or importlib.util.find_spec("termios") is None:
        return OSError
    import termios

    return termios.error


GONE: Final = (OSError, TypeError, _termios_error())
"""Raised where a port was disconnected: pyserial's own exception is an `OSError`, that of termios is none."""
