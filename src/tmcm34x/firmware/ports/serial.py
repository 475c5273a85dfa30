"""A serial port: RS232, RS485, or USB, which take the same nine bytes.

Telegrams come in any pieces.  A piece that is not completed within the receive time-out is dropped, which is also
how a host finds back after noise.  A telegram for another address is silence, whatever its checksum.  A wrong
checksum is answered with status 1, command 0 and value 0.

Source: manual 6.1, 6.2, 6.6, 6.7.36, 8.1 (65 to 68, 75, 76, 255); fidelity FW-80 to FW-86.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from tmcm34x.clock import MS
from tmcm34x.firmware import supervision
from tmcm34x.firmware.dispatch import execute
from tmcm34x.firmware.ports.ascii import AsciiLine
from tmcm34x.firmware.power import settle
from tmcm34x.tmcl.datagram import REPLY_BODY, SIZE, TELEGRAM, Instruction
from tmcm34x.tmcl.global_parameters import BAUD_RATES
from tmcm34x.tmcl.numbers import CONTROL, GP
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.clock import Value
    from tmcm34x.firmware.module import FirmwareModule

TIME_OUT: Final = 5 * MS
"""A partial telegram is dropped when the next bytes come later than this after the last ones."""

_BYTES: Final = tuple(bytes((n,)) for n in range(256))
_FIRST_CONTROL: Final = CONTROL.STOP_APPLICATION
_WRONG_CHECKSUM: Final = int(Status.WRONG_CHECKSUM)
_OK: Final = int(Status.OK)
_ASCII_MODE: Final = 1
"""Bit of global parameter 67 that starts a port in ASCII mode."""


def unconnected(data: bytes) -> None:
    """Where a port sends that leads nowhere: that of a copy."""
    del data


class SerialPort:
    """A further serial port of `module`.

    send: takes the bytes the module sends
    any_address: telegrams for all addresses are meant, as on USB
    """

    __slots__ = ("_buffer", "_last", "_line", "_reply_address", "any_address", "module", "send", "time_out")

    def __init__(
        self, module: FirmwareModule, send: Callable[[bytes], None], *, any_address: bool = False
    ) -> None:
        self.module = module
        self.send = send
        self.any_address = any_address
        self.time_out = TIME_OUT
        """The receive time-out in clocks; a port in real time may need more at higher speed."""
        self._buffer = bytearray()
        self._last = 0
        self._line: AsciiLine | None = None
        self._reply_address = 0, 0
        module.attach(self)

    @property
    def takes_text(self) -> bool:
        """Whether there is an ASCII interface."""
        return True

    @property
    def baud_rate(self) -> int:
        """Bits per second (global parameter 65); changes after the reply to the command that sets it."""
        return BAUD_RATES[self.module.baud_index]

    @property
    def idle(self) -> bool:
        """Whether the next bytes begin a telegram."""
        return self._line is None and not self._buffer

    @property
    def ascii_mode(self) -> bool:
        """Whether the port speaks ASCII lines instead of telegrams."""
        return self._line is not None

    def enter_text(self, on: bool) -> None:
        """Speak ASCII lines from now on, or telegrams."""
        self._line = AsciiLine(self) if on else None

    def power_on(self) -> None:
        """Forget what was received; start in the mode of global parameter 67."""
        self.drop()
        self.enter_text(bool(self.module.eeprom.global_values[GP.ASCII_MODE] & _ASCII_MODE))

    def drop(self) -> None:
        """Forget what was received of a telegram or of a line of text that is not complete."""
        self._buffer.clear()
        self.enter_text(self.ascii_mode)

    def receive(self, data: bytes) -> None:
        """Take bytes from the line, at the module's present clock."""
        module = self.module
        if not module.powered:
            return
        if module.observers:
            module.show(self, "in", data)
        if self._line is not None:
            self._receive_ascii(data)
        elif len(data) == SIZE and not self._buffer:
            self._telegram(data)
        else:
            self._collect(data)

    def _collect(self, data: bytes) -> None:
        buffer, module = self._buffer, self.module
        if buffer and module.now - self._last > self.time_out:
            buffer.clear()
        buffer += data
        while len(buffer) >= SIZE:
            telegram = bytes(buffer[:SIZE])
            del buffer[:SIZE]
            self._telegram(telegram)
            if self._line is not None:
                rest = bytes(buffer)
                buffer.clear()
                self._receive_ascii(rest)
        self._last = module.now if buffer else 0

    def _receive_ascii(self, data: bytes) -> None:
        if self._line is not None and data:
            self.transmit(self._line.answer(data))

    def _telegram(self, telegram: bytes) -> None:
        module, program = self.module, self.module.program
        fields: tuple[int, int, int, int, int, int] = TELEGRAM.unpack(telegram)
        address, number, type_, motor, value, checksum = fields
        if address != module.address and not self._addressed(address):
            return
        self._reply_address = module.host_address, module.address
        if (sum(telegram) - checksum) & 0xFF != checksum:
            self._answer(_WRONG_CHECKSUM, 0, 0)
            return
        if module.heartbeat:
            supervision.heard(module)
        if number < _FIRST_CONTROL and not program.state and not program.downloading:
            handler, motor_high, _, ranges = module.entries[number]
            if ranges is None and motor <= motor_high:
                status, value = handler(module, type_, motor, value)
            else:
                status, value = execute(module, number, type_, motor, value)
            self._answer(status, number, value)
        else:
            module.command(self, Instruction(number, type_, motor, value), SIZE)
        if module.touched:
            settle(module)

    def _addressed(self, address: int) -> bool:
        """Whether a telegram for another address than the module's is for it all the same."""
        second = self.module.second_address
        return self.any_address or (second != 0 and address == second)

    def execute(self, instruction: Instruction) -> tuple[int, int]:
        """Execute a command that came as a line of text; status and value of the reply."""
        if self.module.heartbeat:
            supervision.heard(self.module)
        return self.module.execute(instruction)

    # What the module sends

    def _answer(self, status: int, number: int, value: int) -> None:
        module = self.module
        if status < _OK:
            module.refused(status)
        host, address = self._reply_address
        body = REPLY_BODY.pack(host, address, status, number, value)
        data = body + _BYTES[sum(body) & 0xFF]
        if module.silent or module.pause or module.outbox or module.observers:
            self.transmit(data)
        else:
            self.send(data)

    def answer(self, status: int, number: int, value: int, _size: int) -> None:
        """Send a reply in the normal form."""
        self._answer(status, number, value)

    def answer_text(self, text: bytes, _size: int) -> None:
        """Send the eight characters of the version: host address first, no checksum (manual 6.7.36)."""
        self.transmit(_BYTES[self._reply_address[0]] + text)

    def answer_record(self, record: bytes, _size: int) -> None:
        """Send a stored command: host address, seven bytes, checksum (fidelity FW-82)."""
        body = _BYTES[self._reply_address[0]] + record
        self.transmit(body + _BYTES[sum(body) & 0xFF])

    def target_reached(self, mask: int, _size: int) -> None:
        """Send the second reply of command 138."""
        self._reply_address = self.module.host_address, self.module.address
        self._answer(int(Status.POSITION_REACHED), CONTROL.REQUEST_TARGET_REACHED, mask)

    def transmit(self, data: bytes) -> None:
        """Send bytes after the telegram pause (global parameter 75), unless replies are disabled (255)."""
        module = self.module
        if module.silent or not data:
            return
        if module.pause or module.outbox:
            module.post(self, data)
        else:
            self.deliver(data)

    def deliver(self, data: bytes) -> None:
        """Send bytes now."""
        module = self.module
        if module.observers:
            module.show(self, "out", data)
        self.send(data)

    # State as a plain value

    def save(self) -> Value:
        """What was received of a telegram or line, and the mode."""
        line = None if self._line is None else self._line.save()
        return bytes(self._buffer), self._last, self._reply_address, self.time_out, line

    def load(self, value: Any) -> None:
        """Go back to what `save` gave."""
        buffer, self._last, self._reply_address, self.time_out, line = value
        self._buffer = bytearray(buffer)
        self.enter_text(line is not None)
        if self._line is not None:
            self._line.load(line)

    def recipe(self) -> Callable[[FirmwareModule], SerialPort]:
        """Makes a serial port that leads nowhere on another module."""
        return partial(SerialPort, send=unconnected, any_address=self.any_address)
