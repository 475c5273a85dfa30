"""The module on a real or virtual CAN bus, through any adapter that python-can drives (extra `can`)."""

from __future__ import annotations

import asyncio
import contextlib
from collections import deque
from typing import Any, Final, cast

from tmcm34x.links import EXTENDED, ConnectBus, LinkOpenError

_STOP_S: Final = 0.05
"""How long closing waits at most, on a bus that can only be read by waiting."""


class Echoes:
    """What was sent on a bus that brings it back to the sender, as IP multicast does: no other node has sent it."""

    INTERFACES: Final = frozenset({"udp_multicast"})
    _MOST: Final = 256
    """Frames that may be under way; those that were lost are forgotten then."""

    def __init__(self, interface: str) -> None:
        self._expected: deque[tuple[int, bytes]] | None = (
            deque(maxlen=self._MOST) if interface in self.INTERFACES else None
        )

    def sent(self, identifier: int, data: bytes) -> None:
        """A frame was sent."""
        if self._expected is not None:
            self._expected.append((identifier, data))

    def has(self, identifier: int, data: bytes) -> bool:
        """Whether a frame that has come was sent here; each comes back once."""
        expected, frame = self._expected, (identifier, data)
        if expected is None or frame not in expected:
            return False
        expected.remove(frame)
        return True


class CanBusLink:
    """The bus `channel` of python-can's `interface`, at `bit_rate` bits per second."""

    kind = "can"

    def __init__(self, interface: str, channel: str, bit_rate: int) -> None:
        self._interface = interface
        self._channel = channel
        self._bit_rate = bit_rate
        # python-can's types are partly unknown: what little of it is used here is checked by the tests.
        self._bus: Any = None
        self._notifier: Any = None
        self._echoes = Echoes(interface)

    async def open(self, connect: ConnectBus) -> str:
        """Join the bus; returns `interface:channel`."""
        name = f"{self._interface}:{self._channel}"
        try:
            import can
        except ImportError as error:
            raise LinkOpenError("python-can is missing: install tmcm34x with its extra `can`") from error
        self._message, self._error = can.Message, can.CanError
        try:
            self._bus = cast(Any, can.Bus)(
                interface=self._interface, channel=self._channel, bitrate=self._bit_rate
            )
        except (can.CanError, OSError, ValueError, ImportError, TypeError) as error:
            raise LinkOpenError(f"cannot join {name}: {' '.join(str(error).split())}") from error
        self._peer = connect(f"{self.kind} {name}", self._send)
        self._notifier = can.Notifier(
            self._bus, [self._receive], timeout=_STOP_S, loop=asyncio.get_running_loop()
        )
        return name

    async def finish(self) -> None:
        """Leave the bus when all frames that it has sent so far are delivered."""
        if self._notifier is not None and self._bus is not None:
            self._notifier.stop()
            await asyncio.sleep(0)  # frames that the notifier has passed to the loop
            while (message := self._bus.recv(0)) is not None:
                self._receive(message)
        self.close()

    def close(self) -> None:
        """Leave the bus."""
        if self._notifier is not None:
            self._notifier.stop()
            self._notifier = None
            self._peer.disconnect()
        if self._bus is not None:
            self._bus.shutdown()
            self._bus = None

    def _send(self, identifier: int, data: bytes) -> None:
        if self._bus is None:
            return
        with contextlib.suppress(self._error):  # no acknowledge: the frame is lost, as on a real bus
            extended = bool(identifier & EXTENDED)
            self._bus.send(
                self._message(arbitration_id=identifier & ~EXTENDED, data=data, is_extended_id=extended)
            )
            self._echoes.sent(identifier, data)

    def _receive(self, message: Any) -> None:
        if message.is_remote_frame or message.is_error_frame:
            return
        identifier = message.arbitration_id | (EXTENDED if message.is_extended_id else 0)
        data = bytes(message.data)
        if not self._echoes.has(identifier, data):
            self._peer.receive_frame(identifier, data, None)
