"""The modules' end of a line: a port at each module of a bench, all of which receive what comes.

A line can be put to another rig of the same description: `describe` says what `open_line` needs for that.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from tmcm34x import clock
from tmcm34x.firmware.ports import can, serial
from tmcm34x.firmware.ports.can import IDENTIFIER_BITS, CanPort
from tmcm34x.firmware.ports.serial import SerialPort
from tmcm34x.tmcl.datagram import SIZE

if TYPE_CHECKING:
    from tmcm34x.bench.crowd import Crowd
    from tmcm34x.bench.rig import Rig
    from tmcm34x.clock import Value

_OVER: Final = -1
"""A receive time-out that has always passed."""


class SerialEnd:
    """A serial line: each module receives every byte.

    send: takes the bytes that a module sends
    any_address: telegrams for all addresses are meant, as on USB
    only: the one module that is on the line; None: all
    crowd: finds the modules that whole telegrams may be meant for; the others, which would drop them, are left alone

    The ports' own receive time-out is either far away or over: who serves the line says which with each piece.
    """

    def __init__(
        self,
        rig: Rig,
        send: Callable[[bytes], None] = serial.unconnected,
        *,
        any_address: bool = False,
        only: int | None = None,
        crowd: Crowd | None = None,
    ) -> None:
        self._modules = range(len(rig.modules)) if only is None else (only,)
        self.ports = [SerialPort(rig.modules[n], send, any_address=any_address) for n in self._modules]
        self.record: Callable[[bytes, bool, int | None], None] | None = None
        """Called with what was received, after it was."""
        self._any_address = any_address
        self._only = only
        self._crowd = crowd
        self._receivers = [port.receive for port in self.ports]
        self._begun: set[int] = set()
        """Ports that do not begin with a whole telegram: something has come already, or they take lines of text."""
        self._set_time_out(clock.NEVER)
        if crowd is not None and only is None:
            self._begun.update(n for n, port in enumerate(self.ports) if not port.idle)
            crowd.on_look.append(self._look)

    def describe(self) -> tuple[str, tuple[Value, ...]]:
        """Kind and options, for `open_line`."""
        return "serial", (self._any_address, self._only)

    def receive(self, data: bytes, over: bool = False, baud_rate: int | None = None) -> None:
        """Take bytes.

        over: too late to complete a telegram that was begun
        baud_rate: the sender's; modules at another one receive nothing (fidelity WIRE-8).  None is the module's own
        """
        if self._crowd is None:
            self._receive(data, over, baud_rate)
        else:
            self._receive_in_crowd(self._crowd, data, over, baud_rate)
        if self.record is not None:
            self.record(data, over, baud_rate)

    def _receive_in_crowd(self, crowd: Crowd, data: bytes, over: bool, baud_rate: int | None) -> None:
        """Give the ports the bytes that they may be meant for."""
        crowd.know()
        if self._only is not None:
            crowd.reach(self._only)
            self._receive(data, over, baud_rate)
            crowd.look(self._modules)
        elif self._begun or self._any_address or baud_rate is not None or len(data) % SIZE:
            crowd.gather()
            self._receive(data, over, baud_rate)
            crowd.forget()
        else:
            meant = crowd.addressed(set(data[::SIZE]))
            for index in meant:
                crowd.reach(index)
                self._receivers[index](data)
            crowd.look(meant)

    def _receive(self, data: bytes, over: bool, baud_rate: int | None) -> None:
        """Give all ports the bytes."""
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

    def _look(self, index: int) -> None:
        """Something was done on a module."""
        if self.ports[index].idle:
            self._begun.discard(index)
        else:
            self._begun.add(index)

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
        if self._crowd is not None and self._only is None:
            self._crowd.on_look.remove(self._look)


class CanEnd:
    """A CAN bus: each module receives every frame.

    send: takes identifier and data of the frames that a module sends
    crowd: finds the modules that a frame may be meant for
    """

    def __init__(
        self,
        rig: Rig,
        send: Callable[[int, bytes], None] = can.unconnected,
        *,
        crowd: Crowd | None = None,
    ) -> None:
        self._ports = [CanPort(module, send) for module in rig.modules]
        self.record: Callable[[int, bytes, int | None], None] | None = None
        """Called with what was received, after it was."""
        self._crowd = crowd

    def describe(self) -> tuple[str, tuple[Value, ...]]:
        """Kind and options, for `open_line`."""
        return "can", ()

    def receive_frame(self, identifier: int, data: bytes, bit_rate: int | None = None) -> None:
        """Take a frame; modules at another bit rate do not understand it."""
        if self._crowd is None:
            for port in self._ports:
                if bit_rate in {None, port.bit_rate}:
                    port.receive_frame(identifier, data)
        else:
            self._receive_in_crowd(self._crowd, identifier, data, bit_rate)
        if self.record is not None:
            self.record(identifier, data, bit_rate)

    def _receive_in_crowd(self, crowd: Crowd, identifier: int, data: bytes, bit_rate: int | None) -> None:
        """Give the frame to the ports that it may be meant for."""
        meant = crowd.identified(identifier & IDENTIFIER_BITS)
        for index in meant:
            port = self._ports[index]
            if bit_rate in {None, port.bit_rate}:
                crowd.reach(index)
                port.receive_frame(identifier, data)
        crowd.look(meant)

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
    any_address, only = options
    return SerialEnd(rig, any_address=any_address, only=only)
