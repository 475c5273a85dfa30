"""A CAN port: frames of seven or eight bytes, answered with as many.

The module listens to the identifiers of global parameters 71 and, unless 0, 83; it answers with that of 70.  Frames
with other identifiers or lengths are ignored; extended identifiers count like standard ones.  Telegram pause and
serial heartbeat do not concern CAN.

Source: manual 6.1, 6.2, 6.7.36, 8.1 (69 to 71, 83); reply layout: fidelity TMCL-12, FW-87.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from tmcm34x.firmware import supervision
from tmcm34x.firmware.power import settle
from tmcm34x.tmcl.datagram import CAN_SIZES, Reply, pack_can_reply, unpack_can_request
from tmcm34x.tmcl.global_parameters import CAN_BIT_RATES
from tmcm34x.tmcl.numbers import CONTROL, GP
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.clock import Value
    from tmcm34x.firmware.module import FirmwareModule

IDENTIFIER_BITS: Final = (1 << 29) - 1


def unconnected(identifier: int, data: bytes) -> None:
    """Where a port sends that leads nowhere: that of a copy."""
    del identifier, data


class CanPort:
    """The CAN port of `module`.

    send: takes the identifier and data bytes of a frame the module sends
    """

    __slots__ = ("_reply_address", "module", "send")

    def __init__(self, module: FirmwareModule, send: Callable[[int, bytes], None]) -> None:
        self.module = module
        self.send = send
        self._reply_address = (0, 0)
        module.attach(self)

    @property
    def takes_text(self) -> bool:
        """Whether there is an ASCII interface: not on CAN."""
        return False

    @property
    def bit_rate(self) -> int:
        """Bits per second (global parameter 69)."""
        return CAN_BIT_RATES[self.module.eeprom.global_values[GP.CAN_BIT_RATE]]

    @property
    def identifiers(self) -> tuple[int, ...]:
        """The identifiers the module listens to."""
        settings = self.module.eeprom.global_values
        second = settings[GP.CAN_SECONDARY_ID]
        return (settings[GP.CAN_ID], second) if second else (settings[GP.CAN_ID],)

    def power_on(self) -> None:
        """Nothing to forget: a frame is a whole command."""

    def enter_text(self, on: bool) -> None:
        """There is no ASCII interface on CAN."""

    def receive_frame(self, identifier: int, data: bytes) -> None:
        """Take a frame from the bus, at the module's present clock; bits above the 29 of an identifier are ignored."""
        module, identifier = self.module, identifier & IDENTIFIER_BITS
        if not module.powered or identifier not in self.identifiers or len(data) not in CAN_SIZES:
            return
        if module.observers:
            module.show(self, "in", data)
        if module.can_heartbeat:
            supervision.heard_on_can(module)
        self._take_address()
        module.command(self, unpack_can_request(data), len(data))
        if module.touched:
            settle(module)

    def _take_address(self) -> None:
        """A reply goes out as things were before its command (fidelity FW-84)."""
        settings = self.module.eeprom.global_values
        self._reply_address = settings[GP.CAN_REPLY_ID], settings[GP.CAN_ID] & 0xFF

    def answer(self, status: int, number: int, value: int, size: int) -> None:
        """Send a reply in the normal form."""
        if status < Status.OK:
            self.module.refused(status)
        self.deliver(pack_can_reply(Reply(0, self._reply_address[1], status, number, value), size))

    def answer_text(self, text: bytes, size: int) -> None:
        """Send the version; its eighth character needs a frame of eight bytes (manual 6.7.36)."""
        self.deliver(text[:size])

    def answer_record(self, record: bytes, size: int) -> None:
        """Send a stored command: command, type, motor, value."""
        self.deliver(record + bytes(size - len(record)))

    def target_reached(self, mask: int, size: int) -> None:
        """Send the second reply of command 138."""
        self._take_address()
        self.answer(int(Status.POSITION_REACHED), CONTROL.REQUEST_TARGET_REACHED, mask, size)

    def deliver(self, data: bytes) -> None:
        """Send a frame now, unless replies are disabled (255)."""
        module = self.module
        if module.silent:
            return
        if module.observers:
            module.show(self, "out", data)
        self.send(self._reply_address[0], data)

    # State as a plain value

    def save(self) -> Value:
        """Where the next reply goes."""
        return self._reply_address

    def load(self, value: Any) -> None:
        """Go back to what `save` gave."""
        self._reply_address = value

    def recipe(self) -> Callable[[FirmwareModule], CanPort]:
        """Makes a CAN port that leads nowhere on another module."""
        return partial(CanPort, send=unconnected)
