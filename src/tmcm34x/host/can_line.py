"""CAN buses that python-can knows (extra `can`); frames become the nine bytes of a serial line and back."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any, Final

from tmcm34x.host.exceptions import LinkError, LostLinkError
from tmcm34x.host.line import RealTime
from tmcm34x.links.can import Echoes
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


class CanLine(RealTime):
    """A CAN bus that python-can knows (extra `can`); replies have the identifier `reply`.

    Telegrams keep the serial form above this line; the address of a module is the low byte of its first identifier.
    """

    def __init__(self, interface: str, channel: str, options: Can) -> None:
        self.name = f"{interface}:{channel}"
        self._interface, self._channel, self._options = interface, channel, options
        self._number = 0
        self._echoes = Echoes(interface)
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

    @property
    def identifiers(self) -> tuple[int, int | None]:
        """The module's, and that of its replies; None: any."""
        return self._options.id, self._options.reply

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
        self.send_frame(self._options.id, pack_can_request(instruction, 8))

    def send_frame(self, identifier: int, data: bytes) -> None:
        """Send a frame as it is."""
        frame = self._can.Message(arbitration_id=identifier, data=data, is_extended_id=False)
        try:
            self._bus.send(frame)
            self._echoes.sent(identifier, data)
        except (self._can.CanError, OSError) as error:
            raise LostLinkError(
                f"{self.name}: a frame cannot be sent: {' '.join(str(error).split())}"
            ) from error

    def read(self, size: int, timeout_s: float) -> bytes:
        """At least `size` bytes, or what has come when the time is over."""
        data, end = b"", time.monotonic() + timeout_s
        while len(data) < size and (left := end - time.monotonic()) > 0:
            data += self._receive(left) or b""
        return data

    def waiting(self) -> bytes:
        """What has come already."""
        data = b""
        while (telegram := self._receive(0)) is not None:
            data += telegram
        return data

    def close(self) -> None:
        """Leave the bus."""
        self._bus.shutdown()

    def receive_frame(self, timeout_s: float) -> tuple[int, bytes] | None:
        """Identifier and data of the next frame with the identifier of replies, if one comes in this time."""
        end = time.monotonic() + timeout_s
        while (frame := self._next(max(0.0, end - time.monotonic()))) is not None:
            if self._may_reply(frame):
                return frame.arbitration_id, bytes(frame.data)
        return None

    def _receive(self, timeout_s: float) -> bytes | None:
        """The next frame, empty if it is no reply; None where there is none."""
        frame = self._next(timeout_s)
        if frame is None:
            return None
        if not self._may_reply(frame):
            return b""
        return serial_form(self._number, bytes(frame.data), frame.arbitration_id & 0xFF)

    def _may_reply(self, frame: Any) -> bool:
        if frame.is_remote_frame or frame.is_error_frame:
            return False
        if self._echoes.has(frame.arbitration_id, bytes(frame.data)):
            return False
        return self._options.reply in {None, frame.arbitration_id}

    def _next(self, timeout_s: float) -> Any:
        """The next frame; None where there is none."""
        try:
            return self._bus.recv(timeout_s)
        except (self._can.CanError, OSError) as error:
            raise LostLinkError(
                f"{self.name}: the bus was disconnected ({' '.join(str(error).split())}); is the adapter plugged in?"
            ) from error


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


def open_line(url: Url) -> CanLine:
    """The bus that `url` names, `slcan:DEVICE` or `can:INTERFACE:CHANNEL`.  Raises `LinkError`."""
    interface, _, channel = ("slcan:" + url.target if url.scheme == "slcan" else url.target).partition(":")
    return CanLine(interface, channel, url.can)
