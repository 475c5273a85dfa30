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
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final, NamedTuple, cast

from tmcm34x.firmware import power
from tmcm34x.firmware.dispatch import do_unknown
from tmcm34x.firmware.state import CommandEntry
from tmcm34x.tmcl.commands import BOOT_KEY
from tmcm34x.tmcl.datagram import signed32
from tmcm34x.tmcl.numbers import CONTROL
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.clock import Value
    from tmcm34x.firmware.roles import Port
    from tmcm34x.firmware.state import Handler, ModuleState, OwnReply, Result
    from tmcm34x.tmcl.datagram import Instruction

PAGE: Final = 0x400
"""Bytes of a flash page."""
START: Final = 0x4000
"""Address of the first byte of a firmware."""
SIZE: Final = 0x3C000
"""Bytes of flash memory for it."""
ERASED: Final = 0xFF
_BINARY_VERSION: Final = 1 << 8
"""Version 1.00 in the reply of 136 type 1."""


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
_NUMBERS: Final = {row.name: row.number for row in COMMANDS}


class BootLoader:
    """The boot loader of a module, put in by making one.

    `active` tells whether it, and not the firmware, answers.
    """

    __slots__ = ("active", "buffer", "length", "memory", "model", "version", "whole")

    def __init__(self, core: ModuleState) -> None:
        self.model = core.circuit.model.number
        self.version = f"{self.model}B1.00"
        self.active = False
        self.memory = bytearray()
        """The flash; nothing before the first erase: the firmware of this package cannot be read."""
        self.buffer = bytearray((ERASED,)) * PAGE
        self.length = 0
        self.whole = True
        core.boot = self

    def take_over(self, core: ModuleState) -> None:
        """Power-on: to the firmware, if there is a whole one."""
        if not self.whole:
            self.enter(core)
        elif self.active:
            core.entries, core.answers = core.firmware
            self.active = False

    def enter(self, core: ModuleState) -> None:
        """Leave the firmware."""
        power.stop_firmware(core)
        for port in core.ports:
            port.enter_text(False)
        core.entries, core.answers = ENTRIES, ANSWERS
        self.active = True

    def fits(self, total: int) -> bool:
        """Whether what was written is a firmware for this module, with bytes of that sum."""
        image = self.memory[: self.length] if 0 < self.length <= SIZE else b""
        version = re.search(rb"%dV\d\.\d\d" % self.model, image)
        return signed32(sum(image)) == total and version is not None

    def save(self) -> Value:
        """The flash and what was received of it."""
        return self.active, bytes(self.memory), bytes(self.buffer), self.length, self.whole

    def load(self, core: ModuleState, value: Any) -> None:
        """Go back to what `save` gave."""
        self.active, memory, buffer, self.length, self.whole = value
        self.memory, self.buffer = bytearray(memory), bytearray(buffer)
        core.entries, core.answers = (ENTRIES, ANSWERS) if self.active else core.firmware


def _of(core: ModuleState) -> BootLoader:
    return cast(BootLoader, core.boot)


def _erase(core: ModuleState, _type: int, _motor: int, value: int) -> Result:
    boot = _of(core)
    boot.memory = bytearray((ERASED,)) * SIZE
    boot.length = 0
    boot.whole = False
    return Status.OK, value


def _write_buffer(core: ModuleState, type_: int, motor: int, value: int) -> Result:
    offset = 4 * (type_ + 256 * motor)
    if offset >= PAGE:
        return Status.INVALID_VALUE, value
    _of(core).buffer[offset : offset + 4] = value.to_bytes(4, "little", signed=True)
    return Status.OK, value


def _write_page(core: ModuleState, _type: int, _motor: int, value: int) -> Result:
    boot = _of(core)
    offset = value - START
    if value % PAGE or not 0 <= offset < SIZE:
        return Status.INVALID_VALUE, value
    if not boot.memory:
        return Status.NOT_AVAILABLE, value
    boot.memory[offset : offset + PAGE] = boot.buffer
    boot.buffer[:] = bytes((ERASED,)) * PAGE
    boot.whole = False
    return Status.OK, value


def _get_checksum(core: ModuleState, _type: int, _motor: int, value: int) -> Result:
    if not START <= value < START + SIZE:
        return Status.INVALID_VALUE, value
    return Status.OK, signed32(sum(_of(core).memory[: value - START + 1]))


def _read_memory(core: ModuleState, _type: int, _motor: int, value: int) -> Result:
    offset = value - START
    if not 0 <= offset <= SIZE - 4:
        return Status.INVALID_VALUE, value
    word = _of(core).memory[offset : offset + 4] or bytes((ERASED,)) * 4
    return Status.OK, int.from_bytes(word, "little", signed=True)


def _get_information(_core: ModuleState, type_: int, _motor: int, value: int) -> Result:
    answers = (PAGE, START, SIZE)
    return (Status.OK, answers[type_]) if type_ < len(answers) else (Status.WRONG_TYPE, value)


def _write_length(core: ModuleState, type_: int, _motor: int, value: int) -> Result:
    boot = _of(core)
    if type_ == 0:
        boot.length = value
        return (Status.OK if 0 < value <= SIZE else Status.INVALID_VALUE), value
    if type_ != 1:
        return Status.WRONG_TYPE, value
    boot.whole = boot.fits(value)
    return (Status.OK if boot.whole else Status.INVALID_VALUE), value


_HANDLERS: Final[Mapping[str, Handler]] = {
    "erase": _erase,
    "write buffer": _write_buffer,
    "write page": _write_page,
    "get checksum": _get_checksum,
    "read memory": _read_memory,
    "get information": _get_information,
    "write length": _write_length,
}


def _entries() -> tuple[CommandEntry, ...]:
    entries = [CommandEntry(do_unknown)] * 256
    for name, handler in _HANDLERS.items():
        entries[_NUMBERS[name]] = CommandEntry(handler)
    return tuple(entries)


ENTRIES: Final = _entries()
"""What each command number 0..255 does while the boot loader is in charge."""


def _answer_version(core: ModuleState, port: Port, instruction: Instruction, size: int) -> None:
    """136: the version, as text or as a number with version 1.00."""
    if instruction.type == 0:
        port.answer_text(_of(core).version.encode("ascii"), size)
    else:
        version = core.circuit.model.number << 16 | _BINARY_VERSION
        port.answer(Status.OK, instruction.number, version, size)


def _start(core: ModuleState, port: Port, instruction: Instruction, size: int) -> None:
    """205 is never answered."""
    del port, instruction, size
    if _of(core).whole:
        power.cycle(core)


def _enter_again(_core: ModuleState, port: Port, instruction: Instruction, size: int) -> None:
    """242 with its key is never answered."""
    if instruction[1:] != BOOT_KEY:
        port.answer(Status.INVALID_COMMAND, instruction.number, instruction.value, size)


ANSWERS: Final[Mapping[int, OwnReply]] = {
    CONTROL.GET_FIRMWARE_VERSION: _answer_version,
    _NUMBERS["start application"]: _start,
    CONTROL.ENTER_BOOT_LOADER: _enter_again,
}
"""How ports answer the commands that are not answered with status and value."""
