"""The line to a virtual module without a link, in virtual time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from tmcm34x import clock
from tmcm34x.bench.session.player import CAN, SERIAL, PlayedLine
from tmcm34x.firmware.ports.can import CanPort
from tmcm34x.firmware.ports.serial import SerialPort
from tmcm34x.tmcl.datagram import Instruction

if TYPE_CHECKING:
    from tmcm34x.bench.rig import Rig

SILENCE: Final = 0, 0
"""What a module answers that is not there, or has no power."""


class MemoryWire:
    """What both kinds of lines have."""

    def __init__(self, rig: Rig) -> None:
        self.rig = rig

    @property
    def now(self) -> int:
        """The time in chip clocks."""
        return self.rig.now

    def advance(self, clocks: int) -> None:
        """Let time pass."""
        clock.run_until(self.rig, self.rig.now + clocks)

    def settle(self) -> None:
        """All has happened already."""

    def wait_for(self, size: int) -> None:
        """What is not there does not come at this clock."""

    def wait_for_nothing(self) -> None:
        """What could come at this clock has come."""

    def ask(self, address: int, instruction: Instruction) -> tuple[int, int]:
        """Status and value of a command to the module at `address`."""
        for module in self.rig.modules:
            if module.address == address and module.powered:
                return module.peek(instruction)
        return SILENCE


class MemorySerial(MemoryWire):
    """A serial line on which all modules of a rig are."""

    kind = SERIAL

    def __init__(self, rig: Rig) -> None:
        super().__init__(rig)
        self.received = bytearray()
        ports = [SerialPort(module, self.received.extend) for module in rig.modules]
        self._receivers = [port.receive for port in ports]

    def send(self, data: bytes) -> None:
        """Send bytes to all of them."""
        for receive in self._receivers:
            receive(data)

    def send_frame(self, identifier: int, data: bytes) -> None:
        """A serial line carries no frames; the player knows."""
        raise NotImplementedError


class MemoryCan(MemoryWire):
    """A CAN bus on which all modules of a rig are."""

    kind = CAN

    def __init__(self, rig: Rig) -> None:
        super().__init__(rig)
        self.received: list[tuple[int, bytes]] = []
        ports = [CanPort(module, self._take) for module in rig.modules]
        self._receivers = [port.receive_frame for port in ports]

    def send(self, data: bytes) -> None:
        """A bus carries frames; the player knows."""
        raise NotImplementedError

    def send_frame(self, identifier: int, data: bytes) -> None:
        """Send a frame to all of them."""
        for receive in self._receivers:
            receive(identifier, data)

    def _take(self, identifier: int, data: bytes) -> None:
        self.received.append((identifier, bytes(data)))


WIRES: Final = {SERIAL: MemorySerial, CAN: MemoryCan}


def open_wire(kind: str, rig: Rig) -> PlayedLine:
    """A line of a kind to the modules of `rig`."""
    return WIRES[kind](rig)
