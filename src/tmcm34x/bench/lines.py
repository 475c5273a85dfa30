"""The modules' end of a line: a port at each module of a bench, all of which receive what comes.

A line can be put to another rig of the same description: `describe` says what `open_line` needs for that.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from tmcm34x import clock
from tmcm34x.firmware.ports import can, serial
from tmcm34x.firmware.ports.can import CanPort
from tmcm34x.firmware.ports.serial import SerialPort

if TYPE_CHECKING:
    from tmcm34x.bench.rig import Rig
    from tmcm34x.clock import Value

_OVER: Final = -1
"""A receive time-out that has always passed."""


class SerialEnd:
    """A serial line: each module receives every byte.

    send: takes the bytes that a module sends
    any_address: telegrams for all addresses are meant, as on USB

    The ports' own receive time-out is either far away or over: who serves the line says which with each piece.
    """

    def __init__(
        self, rig: Rig, send: Callable[[bytes], None] = serial.unconnected, *, any_address: bool = False
    ) -> None:
        self.ports = [SerialPort(module, send, any_address=any_address) for module in rig.modules]
        self._any_address = any_address
        self._receivers = [port.receive for port in self.ports]
        self._set_time_out(clock.NEVER)

    def describe(self) -> tuple[str, tuple[Value, ...]]:
        """Kind and options, for `open_line`."""
        return "serial", (self._any_address,)

    def receive(self, data: bytes, over: bool = False, baud_rate: int | None = None) -> None:
        """Take bytes.

        over: too late to complete a telegram that was begun
        baud_rate: the sender's; modules at another one receive nothing (fidelity WIRE-8).  None is the module's own
        """
        if over:
            self._set_time_out(_OVER)
        if baud_rate is None:
            for receive in self._receivers:
                receive(data)
        else:
            for port in self.ports:
                if port.baud_rate == baud_rate:
                    port.receive(data)
        if over:
            self._set_time_out(clock.NEVER)

    def drop(self) -> None:
        """Forget what was received of a telegram or of a line of text that is not complete."""
        for port in self.ports:
            port.drop()

    def _set_time_out(self, clocks: int) -> None:
        for port in self.ports:
            port.time_out = clocks

    @property
    def speaks_ascii(self) -> bool:
        """Whether a module takes lines of text from it."""
        return any(port.ascii_mode for port in self.ports)

    def unplug(self) -> None:
        """Take the ports away; what they owe is not sent."""
        for port in self.ports:
            port.send = serial.unconnected
            port.module.detach(port)


class CanEnd:
    """A CAN bus: each module receives every frame.

    send: takes identifier and data of the frames that a module sends
    """

    def __init__(self, rig: Rig, send: Callable[[int, bytes], None] = can.unconnected) -> None:
        self._ports = [CanPort(module, send) for module in rig.modules]

    def describe(self) -> tuple[str, tuple[Value, ...]]:
        """Kind and options, for `open_line`."""
        return "can", ()

    def receive(self, identifier: int, data: bytes, bit_rate: int | None = None) -> None:
        """Take a frame; modules at another bit rate do not understand it."""
        for port in self._ports:
            if bit_rate in {None, port.bit_rate}:
                port.receive(identifier, data)

    def unplug(self) -> None:
        """Take the ports away; what they owe is not sent."""
        for port in self._ports:
            port.send = can.unconnected
            port.module.detach(port)


LineEnd: TypeAlias = SerialEnd | CanEnd
"""The modules' end of one line."""


def open_line(rig: Rig, kind: str, options: tuple[Any, ...]) -> LineEnd:
    """A line that leads nowhere, of a kind that `describe` gave."""
    if kind == "can":
        return CanEnd(rig)
    (any_address,) = options
    return SerialEnd(rig, any_address=any_address)
