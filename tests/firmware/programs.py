"""Modules with a program in them, for the tests of stand-alone TMCL."""

from __future__ import annotations

from tmcm34x.board.board import Board
from tmcm34x.board.models import MODELS
from tmcm34x.clock import MS, run_until
from tmcm34x.firmware.module import FirmwareModule
from tmcm34x.firmware.ports.serial import SerialPort
from tmcm34x.firmware.storage import Eeprom
from tmcm34x.tmcl.datagram import Instruction, Reply, pack_request, unpack_reply
from tmcm34x.tmcl.mnemonic import parse_instruction
from tmcm34x.toolchain.assembler import assemble

CLOCKS = 1600
"""Of an instruction, as modules have them when nobody says otherwise."""


def program_of(source: str) -> tuple[Instruction, ...]:
    assembly = assemble(source)
    assert assembly.ok, assembly.diagnostics
    return assembly.program


def module_with(source: str = "", *, model: int = 343, auto_start: bool = False) -> FirmwareModule:
    """A module that is switched on, with the program of `source` in its memory."""
    eeprom = Eeprom(model)
    eeprom.write_program(program_of(source))
    if auto_start:
        eeprom.set_global_value(77, 1)
    module = FirmwareModule(Board(MODELS[model]), eeprom)
    module.power_on()
    return module


def started(source: str, *, model: int = 343) -> FirmwareModule:
    """A module whose program has just been started at address 0."""
    module = module_with(source, model=model)
    module.program.run()
    return module


def direct(module: FirmwareModule, line: str) -> tuple[int, int]:
    """Execute a command as a host's; status and value."""
    return module.execute(parse_instruction(line))


class Wire:
    """A host on a serial port of the module."""

    def __init__(self, module: FirmwareModule) -> None:
        self.received = bytearray()
        self.port = SerialPort(module, self.received.extend)

    def send(self, data: bytes) -> bytes:
        """What comes back at once."""
        self.port.receive(data)
        answer = bytes(self.received)
        self.received.clear()
        return answer

    def ask(self, number: int, type_: int = 0, motor: int = 0, value: int = 0) -> Reply:
        """The reply to a command."""
        return unpack_reply(self.send(pack_request(1, Instruction(number, type_, motor, value))))


def run_ms(module: FirmwareModule, milliseconds: float) -> None:
    run_until(module, module.now + round(milliseconds * MS))


def run_instructions(module: FirmwareModule, count: int) -> None:
    run_until(module, module.now + count * CLOCKS)


def run_to_stop(module: FirmwareModule, limit_ms: float = 60_000) -> None:
    """Run until the program has stopped."""
    limit = module.now + round(limit_ms * MS)
    while module.program.active and module.now < limit:
        module.advance(min(module.next_event(), limit))
    assert not module.program.active
