"""A host on a module's serial port, and what there is to compare of a module."""

from __future__ import annotations

from tmcm34x.board.board import Board
from tmcm34x.board.models import MODELS
from tmcm34x.chips import registers
from tmcm34x.clock import MS, run_until
from tmcm34x.firmware.module import FirmwareModule
from tmcm34x.firmware.ports.serial import SerialPort
from tmcm34x.firmware.storage import Eeprom
from tmcm34x.tmcl.datagram import Instruction, Reply, pack_request, unpack_reply
from tmcm34x.tmcl.mnemonic import parse_instruction


def switched_on(model: int = 343, *, eeprom: Eeprom | None = None, **options) -> FirmwareModule:
    module = FirmwareModule(Board(MODELS[model]), eeprom or Eeprom(model), **options)
    module.power_on()
    return module


class Host:
    """Asks a module over a serial port of its own."""

    def __init__(self, module: FirmwareModule, *, address: int = 1) -> None:
        self.module = module
        self.address = address
        self.received: list[bytes] = []
        self.port = SerialPort(module, self.received.append)

    def send(self, number: int, type_: int = 0, motor: int = 0, value: int = 0) -> None:
        self.port.receive(pack_request(self.address, Instruction(number, type_, motor, value)))

    def replies(self) -> list[Reply]:
        """What has come since the last time."""
        found = [unpack_reply(telegram) for telegram in self.received]
        self.received.clear()
        return found

    def ask(self, line: str) -> Reply:
        """The one reply to a command."""
        self.send(*parse_instruction(line))
        (reply,) = self.replies()
        return reply

    def do(self, line: str) -> int:
        """The value of the reply to a command that succeeds."""
        reply = self.ask(line)
        assert reply.status == 100, (line, reply)
        return reply.value

    def status(self, line: str) -> int:
        """The status of the reply to a command."""
        return self.ask(line).status

    def wait_ms(self, milliseconds: float) -> None:
        run_until(self.module, self.module.now + round(milliseconds * MS))


def chip_state(chip) -> tuple:
    """Everything in a motion chip, fractions included."""
    words = [
        chip.transfer(registers.read(area, index))
        for area in range(4)
        for index in range(16)
        if (area, index) != (3, 8)
    ]
    cells = [chip.transfer(registers.read_ram(address)) for address in range(64)]
    return (
        *words,
        *cells,
        *(chip.state(motor).save()[1:7] + chip.state(motor).save()[8:] for motor in range(3)),
    )


def module_state(module: FirmwareModule) -> tuple:
    """Everything that a command could change."""
    board, axes = module.board, module.axes
    return (
        module.now,
        module.powered,
        module.eeprom.to_bytes(),
        [dict(axis.values) for axis in module.axes],
        [(axis.open, axis.scaled) for axis in module.axes],
        module.coordinates,
        [chip_state(chip) for chip in board.chips],
        (board.outputs, tuple(board.currents), tuple(board.enabled)),
        (module.due, module.shut_down, [(axis.moving, axis.power_due, axis.free_due) for axis in axes]),
        (module.program.registers.contents(), module.program.state, module.program.downloading),
        [axis.search for axis in module.axes],
        (
            module.silent,
            module.tick_origin,
            module.address,
            module.host_address,
            module.pause,
            module.heartbeat,
        ),
        [(letter.due, letter.data) for letter in module.outbox],
    )
