"""The boot loader: how a host writes another firmware into the module.

Command 242 with its key leaves the firmware, without a reply: motors are without current, programs do not run.  What
is answered then are the version, with a B where the firmware's has its V, and the commands of `COMMANDS`; all else is
an invalid command.  The EEPROM is not touched.

An image is taken when its length and sum are written and fit, and when it holds the version string of this module
type.  The module then starts, and starts again after power-on; an image that was not finished leaves it in the boot
loader.  The code in an image is not executed: the module goes on with the firmware of this package.

Source: the protocol of the vendor's later modules, as its host library's update tool uses it; how far it is that of
these modules is not public (fidelity FW-100 to FW-104).
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import TYPE_CHECKING, Final, NamedTuple

from tmcm34x.firmware.serial import SerialPort
from tmcm34x.tmcl.commands import BOOT_KEY
from tmcm34x.tmcl.datagram import signed32
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.firmware.dispatch import Result
    from tmcm34x.firmware.module import Module, Port
    from tmcm34x.tmcl.datagram import Instruction

PAGE: Final = 0x400
"""Bytes of a flash page."""
START: Final = 0x4000
"""Address of the first byte of a firmware."""
SIZE: Final = 0x3C000
"""Bytes of flash memory for it."""
ERASED: Final = 0xFF

GET_VERSION: Final = 136
START_APPLICATION: Final = 205
BOOT: Final = 242


class BootCommand(NamedTuple):
    """One row of `COMMANDS`."""

    number: int
    name: str
    meaning: str


COMMANDS: Final = (
    BootCommand(200, "erase", "Erases the firmware."),
    BootCommand(
        201, "write buffer", "Puts 32 bits, low byte first, at word type + 256 * motor of the page buffer."
    ),
    BootCommand(202, "write page", "Writes the page buffer to the page at an address."),
    BootCommand(203, "get checksum", "The sum of all bytes up to and including an address."),
    BootCommand(204, "read memory", "The 32 bits at an address."),
    BootCommand(
        205, "start application", "Starts the firmware, without a reply; stays here if there is no whole one."
    ),
    BootCommand(206, "get information", "Type 0: bytes of a page; 1: first address; 2: bytes of memory."),
    BootCommand(208, "write length", "Type 0: bytes of the firmware; 1: their sum, which must fit."),
)
"""The commands of the boot loader."""


class BootLoader:
    """The boot loader of `module`, put in by making one.

    `active` tells whether it, and not the firmware, answers.
    """

    def __init__(self, module: Module) -> None:
        number = module.board.model.number
        self.version = f"{number}B1.00"
        self.active = False
        self._module = module
        self._wanted = re.compile(rb"%dV\d\.\d\d" % number)
        self._memory = bytearray()
        self._buffer = bytearray((ERASED,)) * PAGE
        self._length = 0
        self._whole = True
        self._firmware = list(module.handlers)
        self._controls = module.controls
        self._handlers: dict[int, Callable[[int, int, int], Result]] = {
            200: self._erase,
            201: self._write_buffer,
            202: self._write_page,
            203: self._get_checksum,
            204: self._read_memory,
            206: self._get_information,
            208: self._write_length,
        }
        module.on_boot = self._enter_from
        module.on_power = self._take_over

    # Coming and going

    def _enter_from(self, port: Port) -> None:
        del port
        self._enter()

    def _take_over(self) -> None:
        """Power-on: to the firmware, if there is a whole one."""
        if not self._whole:
            self._enter()
        elif self.active:
            self._leave()

    def _enter(self) -> None:
        module = self._module
        module.stop_firmware()
        for port in module.ports:
            if isinstance(port, SerialPort):
                port.ascii_mode = False
        module.handlers[:] = [self._unknown] * len(module.handlers)
        for number, handler in self._handlers.items():
            module.handlers[number] = handler
        module.controls = {
            GET_VERSION: _tell_version(self.version),
            START_APPLICATION: self._start,
            BOOT: _no_reply,
        }
        self.active = True

    def _start(self, module: Module, port: Port, instruction: Instruction, size: int) -> None:
        del port, instruction, size
        if self._whole:
            module.reset()

    def _leave(self) -> None:
        module = self._module
        module.handlers[:] = self._firmware
        module.controls = self._controls
        self.active = False

    # Commands

    @staticmethod
    def _unknown(type_: int, motor: int, value: int) -> Result:
        del type_, motor
        return Status.INVALID_COMMAND, value

    def _erase(self, type_: int, motor: int, value: int) -> Result:
        del type_, motor
        self._memory = bytearray((ERASED,)) * SIZE
        self._length = 0
        self._whole = False
        return Status.OK, value

    def _write_buffer(self, type_: int, motor: int, value: int) -> Result:
        offset = 4 * (type_ + 256 * motor)
        if offset >= PAGE:
            return Status.INVALID_VALUE, value
        self._buffer[offset : offset + 4] = value.to_bytes(4, "little", signed=True)
        return Status.OK, value

    def _write_page(self, type_: int, motor: int, value: int) -> Result:
        del type_, motor
        offset = value - START
        if value % PAGE or not 0 <= offset < SIZE:
            return Status.INVALID_VALUE, value
        if not self._memory:
            return Status.NOT_AVAILABLE, value
        self._memory[offset : offset + PAGE] = self._buffer
        self._buffer[:] = bytes((ERASED,)) * PAGE
        self._whole = False
        return Status.OK, value

    def _get_checksum(self, type_: int, motor: int, value: int) -> Result:
        del type_, motor
        if not START <= value < START + SIZE:
            return Status.INVALID_VALUE, value
        return Status.OK, signed32(sum(self._memory[: value - START + 1]))

    def _read_memory(self, type_: int, motor: int, value: int) -> Result:
        del type_, motor
        offset = value - START
        if not 0 <= offset <= SIZE - 4:
            return Status.INVALID_VALUE, value
        word = self._memory[offset : offset + 4] or bytes((ERASED,)) * 4
        return Status.OK, int.from_bytes(word, "little", signed=True)

    def _get_information(self, type_: int, motor: int, value: int) -> Result:
        del motor
        answers = (PAGE, START, SIZE)
        return (Status.OK, answers[type_]) if type_ < len(answers) else (Status.WRONG_TYPE, value)

    def _write_length(self, type_: int, motor: int, value: int) -> Result:
        del motor
        if type_ == 0:
            self._length = value
            return (Status.OK if 0 < value <= SIZE else Status.INVALID_VALUE), value
        if type_ != 1:
            return Status.WRONG_TYPE, value
        image = self._memory[: self._length] if 0 < self._length <= SIZE else b""
        self._whole = signed32(sum(image)) == value and self._wanted.search(image) is not None
        return (Status.OK if self._whole else Status.INVALID_VALUE), value


def _tell_version(version: str) -> Callable[[Module, Port, Instruction, int], None]:
    """136: the version, as text or as a number with version 1.00."""

    def tell(module: Module, port: Port, instruction: Instruction, size: int) -> None:
        if instruction.type == 0:
            port.answer_text(version.encode("ascii"), size)
        else:
            port.answer(Status.OK, GET_VERSION, module.board.model.number << 16 | 1 << 8, size)

    return tell


def _no_reply(module: Module, port: Port, instruction: Instruction, size: int) -> None:
    """242 with its key is never answered."""
    if instruction[1:] != BOOT_KEY:
        port.answer(Status.INVALID_COMMAND, instruction.number, instruction.value, size)
    del module
