"""Bytes to and from a module: serial port, TCP, or a module in this process."""

from __future__ import annotations

import os
import select
import socket
from collections.abc import Callable
from typing import Any, Protocol

from tmcm34x.host.exceptions import LinkError
from tmcm34x.links.memory import MemoryClient

READ_SIZE = 4096


class Stream(Protocol):
    """A line with a module at its other end."""

    def write(self, data: bytes) -> None:
        """Send `data`; raises `LinkError`."""
        ...

    def read(self, timeout_s: float) -> bytes:
        """What has come, or comes first within `timeout_s`; empty if nothing does.  Raises `LinkError`."""
        ...

    def close(self) -> None:
        """Hang up."""
        ...


def open_stream(url: str, baud: int = 9600) -> Stream:
    """The line that `url` names: `tcp://host:port`, `host:port`, or the path of a serial port.

    baud: bits per second of a serial port
    Raises `LinkError`.
    """
    address = url.removeprefix("tcp://")
    host, _, port = address.rpartition(":")
    if port.isdecimal() and (host or address != url) and "/" not in host:
        return _open_socket(host.strip("[]") or "127.0.0.1", int(port), url)
    return _open_serial(url, baud)


def _open_socket(host: str, port: int, url: str) -> Stream:
    try:
        connection = socket.create_connection((host, port), timeout=5)
    except (OSError, OverflowError) as error:
        raise LinkError(f"cannot connect to {url}: {_reason(error)}") from error
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return DescriptorStream(connection, url)


def _open_serial(device: str, baud: int) -> Stream:
    import serial

    from tmcm34x.links.serial import port_reason

    try:
        return DescriptorStream(serial.Serial(device, baud, exclusive=True), device)
    except (OSError, ValueError) as error:
        raise LinkError(f"cannot open {device}: {port_reason(error)}") from error


class DescriptorStream:
    """A stream on anything with a file descriptor; `owner` is closed with it."""

    def __init__(self, owner: Any, name: str) -> None:
        self._owner = owner
        self._name = name
        self._fd: int = owner.fileno()
        os.set_blocking(self._fd, False)

    def write(self, data: bytes) -> None:
        """Send `data`, waiting for room where there is none."""
        while data:
            try:
                data = data[os.write(self._fd, data) :]
            except BlockingIOError:
                select.select([], [self._fd], [])
            except OSError as error:
                raise LinkError(f"{self._name}: {_reason(error)}") from error

    def read(self, timeout_s: float) -> bytes:
        """What has come, or comes first within `timeout_s`."""
        try:
            if not select.select([self._fd], [], [], timeout_s)[0]:
                return b""
            data = os.read(self._fd, READ_SIZE)
        except (OSError, ValueError) as error:
            raise LinkError(f"{self._name}: {_reason(error)}") from error
        if not data:
            raise LinkError(f"{self._name}: the other side has hung up")
        return data

    def close(self) -> None:
        """Close the port or socket."""
        self._owner.close()
        self._fd = -1


class MemoryStream:
    """A module in this process.

    wait: lets virtual time pass, given how much [s]; called when there is nothing to read yet
    """

    STEP_S = 0.001

    def __init__(self, client: MemoryClient, wait: Callable[[float], None]) -> None:
        self._client = client
        self._wait = wait

    def write(self, data: bytes) -> None:
        """Send `data`."""
        self._client.write(data)

    def read(self, timeout_s: float) -> bytes:
        """What has come, or comes first within `timeout_s` of virtual time."""
        data = self._client.read()
        waited_s = 0.0
        while not data and waited_s < timeout_s:
            self._wait(self.STEP_S)
            waited_s += self.STEP_S
            data = self._client.read()
        return data

    def close(self) -> None:
        """Hang up."""
        self._client.close()


def _reason(error: Exception) -> str:
    number = getattr(error, "errno", None)
    return os.strerror(number) if number and number > 0 else str(error)
