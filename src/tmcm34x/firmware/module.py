"""A whole module: board, EEPROM, firmware, ports, and the order in which they work.

At each clock the work is done in one fixed order, whatever the slicing of time: motion chips, supervision,
reference searches, the stand-alone program, delayed replies.  Commands of hosts are executed between two calls
of `advance`, at `now`.  When the world changes a pin, the firmware notices one clock later.

Source: manual 6, 8.1; power-on, order and time-outs: fidelity FW-90 to FW-92.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, Final, NamedTuple, Protocol

from tmcm34x.board.board import Board
from tmcm34x.chips.registers import FIELDS
from tmcm34x.clock import MS, NEVER
from tmcm34x.firmware.can import CanPort
from tmcm34x.firmware.dispatch import Dispatcher, Handler, Result
from tmcm34x.firmware.drivers import Drivers
from tmcm34x.firmware.encoder import Encoders
from tmcm34x.firmware.motion import Axis, Motion
from tmcm34x.firmware.parameters import restore_axes
from tmcm34x.firmware.peek import peek
from tmcm34x.firmware.program import Program
from tmcm34x.firmware.reference import ReferenceSearch
from tmcm34x.firmware.serial import SerialPort
from tmcm34x.firmware.storage import Eeprom, EepromError
from tmcm34x.firmware.supervision import Supervision
from tmcm34x.tmcl.commands import BOOT_KEY, CONTROL_FUNCTIONS, COORDINATES, MOTORS
from tmcm34x.tmcl.datagram import Instruction, pack_record
from tmcm34x.tmcl.global_parameters import EEPROM_MAGIC
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from collections.abc import Mapping

INSTRUCTION_CLOCKS: Final = MS // 10
"""Time of one instruction of a program: an assumption of the right order of magnitude (fidelity FW-92)."""

_CONTROL: Final = frozenset(row.number for row in CONTROL_FUNCTIONS)
QUIT_DOWNLOAD: Final = 133
_IN_DOWNLOAD: Final = frozenset({QUIT_DOWNLOAD, 136})
"""Control functions that are executed in download mode too (fidelity PROG-15)."""
BOOT: Final = 242

_SMGP: Final = FIELDS["LSMD"][0]
_IF_CONFIGURATION: Final = FIELDS["EN_REFR"][0]

Control = Callable[["Module", "Port", Instruction, int], None]
"""Executes a command that came through a port in so many bytes, and answers it, or not."""

UserFunction = Callable[["Module", int, int, int], Result]
"""Takes type, motor and value of UF0..UF7; returns status and value of the reply."""


class Port(Protocol):
    """What the module needs of a port to answer a command that came through it."""

    def power_on(self) -> None:
        """Begin anew."""
        ...

    def answer(self, status: int, number: int, value: int, size: int, /) -> None:
        """Send a reply in the normal form, to a request of `size` bytes."""
        ...

    def answer_text(self, text: bytes, size: int, /) -> None:
        """Send the eight characters of the version."""
        ...

    def answer_record(self, record: bytes, size: int, /) -> None:
        """Send the seven bytes of a stored command."""
        ...

    def target_reached(self, mask: int, size: int) -> None:
        """Send the second reply of command 138."""
        ...

    def deliver(self, data: bytes, /) -> None:
        """Send bytes now."""
        ...


class Observer(Protocol):
    """Somebody who looks on: a recorder, a debugger."""

    def telegram(self, port: Port, direction: str, data: bytes, now: int) -> None:
        """Bytes came in ("in") or go out ("out")."""
        ...

    @property
    def instruction(self) -> Callable[[int, Instruction, int], object] | None:
        """Called with address, instruction and clock before the program executes one; None: not wanted.

        A program that somebody looks at in this way runs command by command.
        """
        ...

    def event(self, kind: str, motor: int, now: int) -> None:
        """Something happened to a motor, or (-1) to the module.

        kind: "stall", "deviation", "shutdown", "heartbeat", "reference" (search done), "power"
        """
        ...


class _Letter(NamedTuple):
    """A reply that waits for the end of the telegram pause."""

    due: int
    port: Port
    data: bytes


class Module:
    """A TMCM-34x: `board` with `eeprom`, switched off.

    seed: start of the random numbers of global parameter 133
    instruction_clocks: time that one instruction of a stand-alone program takes
    address, host_address: written into the EEPROM as global parameters 66 and 76
    """

    def __init__(
        self,
        board: Board,
        eeprom: Eeprom,
        *,
        seed: int = 0,
        instruction_clocks: int = INSTRUCTION_CLOCKS,
        address: int | None = None,
        host_address: int | None = None,
    ) -> None:
        if eeprom.model != board.model.number:
            raise EepromError(f"EEPROM image is of a TMCM-{eeprom.model}, not of a {board.model.name}")
        self.board = board
        self.eeprom = eeprom
        self.instruction_clocks = instruction_clocks
        self.now = board.now
        self.powered = False
        self.observer: Observer | None = None
        self.user_functions: dict[int, UserFunction] = {}
        """What UF0..UF7 do, by 0..7."""
        self.user_parameters: dict[int, int] = {}
        """Global parameters of bank 1, by number: none in plain firmware (manual 8.2)."""
        self.on_boot: Callable[[Port], None] | None = None
        """Called with the port through which command 242 came with its key; None: there is no boot loader."""
        self.on_power: Callable[[], None] | None = None
        """Called at the end of power-on."""
        for number, value in ((66, address), (76, host_address)):
            if value is not None:
                eeprom.set_global_value(number, value)

        self.axes = tuple(Axis(board, motor) for motor in range(MOTORS))
        self.supervision = Supervision(self)
        self.motion = Motion(self.axes, self.supervision.started)
        self.drivers = Drivers(board)
        self.encoders = Encoders(board)
        self.searches = tuple(ReferenceSearch(self, motor) for motor in range(MOTORS))
        self.program = Program(self)
        self.coordinates: list[list[int]] = []
        """Coordinates 0..20 in RAM, for each motor."""
        self.dispatcher = Dispatcher(self)
        self.handlers: list[Handler] = self.dispatcher.handlers
        self.controls: Mapping[int, Control] = _SPECIAL
        """Commands that answer in a way of their own, by number."""
        self.ports: list[SerialPort | CanPort] = []

        self.address = self.host_address = self.pause = self.heartbeat = self.baud_index = 0
        self.silent = False
        """Global parameter 255: no replies."""
        self.tick_origin = 0
        """Millisecond of the clock at which the tick timer would have been 0."""
        self.touched = False
        """Something was done after which `settle` must be called at this clock."""
        self.outbox: deque[_Letter] = deque()
        self._pins_due = NEVER
        self._random = seed & _RANDOM_MASK
        board.on_pins.append(self._note_pins)

    # Power

    def power_on(self) -> None:
        """Start the firmware: chips and settings from the EEPROM, all else as new."""
        if self.powered:
            return
        if self.eeprom.global_values[64] != EEPROM_MAGIC:
            self.eeprom.restore_defaults()
        self.powered = True
        self._reset_state()
        self._start_chips()
        self._restore()
        for port in self.ports:
            port.power_on()
        self.tell("power", -1)
        self.program.power_on(bool(self.eeprom.global_values[77]))
        self.settle()
        if self.on_power is not None:
            self.on_power()

    def power_off(self) -> None:
        """Cut the power: nothing moves, nothing answers, what is not stored is lost."""
        if self.powered:
            self.stop_firmware()
            self.powered = False

    def stop_firmware(self) -> None:
        """Everything stands still, motors are without current, what is not stored is lost."""
        self.program.power_off()
        self._reset_state()
        self.silent = False

    def reset(self) -> None:
        """Switch off and on."""
        self.power_off()
        self.power_on()

    def _reset_state(self) -> None:
        self.board.reset()
        self.drivers.forget()
        self.supervision.reset()
        for search in self.searches:
            search.reset()
        self.outbox.clear()
        self._pins_due = NEVER

    def _start_chips(self) -> None:
        """Tell the motion chips what board they are on (fidelity FW-90)."""
        model = self.board.model
        self.drivers.write_cells(0, self.eeprom.driver_chain + self.eeprom.microstep_table)
        for chip in range(len(model.parts)):
            transfer = self.board.bus(chip)
            transfer(_SMGP.write(model.smgp))
            transfer(_IF_CONFIGURATION.write(model.if_configuration))

    def _restore(self) -> None:
        """RAM from the EEPROM (manual 8.1, parameters 84 and 85)."""
        settings = self.eeprom.global_values
        self.silent = False
        self.tick_origin = self.now // MS
        self.baud_index = settings[65]
        self.encoders.interface = settings[74]
        self.program.variables[:] = (
            [0] * len(self.eeprom.variables) if settings[85] else self.eeprom.variables
        )
        self.coordinates = [
            [0, *stored] if settings[84] else [0] * COORDINATES for stored in self.eeprom.coordinates
        ]
        restore_axes(self)
        self.take_settings()

    def take_settings(self) -> None:
        """Take up the global parameters that are looked at often."""
        settings = self.eeprom.global_values
        self.address, self.host_address = settings[66], settings[76]
        self.pause, self.heartbeat = settings[75], settings[68]
        if not self.heartbeat:
            self.supervision.heartbeat_due = NEVER
        self.supervision.shutdown_changed()
        self.touched = True

    # Ports

    def open_serial_port(self, send: Callable[[bytes], None], *, any_address: bool = False) -> SerialPort:
        """A further serial port; `send` takes what it answers, `any_address` is for USB."""
        port = SerialPort(self, send, any_address=any_address)
        self._plug(port)
        return port

    def open_can_port(self, send: Callable[[int, bytes], None]) -> CanPort:
        """A further CAN port; `send` takes identifier and data of each frame it answers."""
        port = CanPort(self, send)
        self._plug(port)
        return port

    def _plug(self, port: SerialPort | CanPort) -> None:
        self.ports.append(port)
        if self.powered:
            port.power_on()

    @property
    def owes_reply(self) -> bool:
        """Whether a reply is still to come: after the telegram pause, or the second one of command 138."""
        return bool(self.outbox) or self.supervision.requested

    # Commands

    def execute(self, instruction: Instruction) -> Result:
        """Execute a command as in direct mode, without any wire; status and value of its reply."""
        if self.program.state:
            self.program.wake()
        result = self.dispatcher.execute(instruction)
        if self.touched:
            self.settle()
        return result

    def peek(self, instruction: Instruction) -> Result:
        """What a reading command would be answered with now, without any effect; see `firmware.peek`."""
        return peek(self, instruction)

    def execute_in_program(self, instruction: Instruction) -> Result:
        """Execute a command of the stand-alone program; control functions are not for programs."""
        if instruction.number in _CONTROL:
            return Status.NOT_AVAILABLE, instruction.value
        return self.dispatcher.execute(instruction)

    def command(self, port: Port, instruction: Instruction, size: int) -> None:
        """Execute a command that came through `port` in `size` bytes, and answer it."""
        number, type_, motor, value = instruction
        program = self.program
        if program.downloading and number not in _IN_DOWNLOAD:
            port.answer(program.memory.store(instruction), number, value, size)
            return
        if program.state:
            program.wake()
        special = self.controls.get(number)
        if special is not None:
            special(self, port, instruction, size)
        else:
            status, value = self.handlers[number](type_, motor, value)
            port.answer(status, number, value, size)

    def stop(self, motor: int) -> None:
        """Stop a motor along its ramp, whatever it was doing."""
        self.searches[motor].abort()
        self.motion.stop(motor)

    def halt(self, motor: int) -> None:
        """Stop a motor at once, whatever it was doing."""
        self.searches[motor].abort()
        self.motion.halt(motor)

    def raise_error(self, flag: str) -> None:
        """Set an error flag of the program: ETO, EAL, EDV, EPO, ESD."""
        self.program.raise_error(flag)

    def tell(self, kind: str, motor: int) -> None:
        """Tell the observer, if there is one, of an event."""
        if self.observer is not None:
            self.observer.event(kind, motor, self.now)

    def random_number(self) -> int:
        """The next of a sequence that begins with the seed, 0..2^31 - 1 (fidelity FW-52)."""
        self._random = (self._random * _RANDOM_FACTOR + 1) & _RANDOM_MASK
        return self.last_random_number

    @property
    def last_random_number(self) -> int:
        """The last number of the sequence."""
        return self._random >> 33

    def post(self, port: Port, data: bytes) -> None:
        """Send a reply after the telegram pause, in the order of the commands."""
        due = self.now + self.pause * MS
        if self.outbox:
            due = max(due, self.outbox[-1].due)
        self.outbox.append(_Letter(due, port, data))

    def settle(self) -> None:
        """Do what follows from a command at once: 138's second reply, another baud rate."""
        self.touched = False
        self.supervision.answer_requests()
        if not self.outbox:
            self.baud_index = self.eeprom.global_values[65]

    # Time

    def next_event(self) -> int:
        """The next clock at which something could be noticed from outside."""
        due = self.next_disturbance()
        if self.program.state:
            due = min(due, self.program.next_event())
        return due

    def next_disturbance(self) -> int:
        """The next clock at which something besides the stand-alone program has an event."""
        if not self.powered:
            return NEVER
        due = min(self.board.next_event(), self.supervision.due, self._pins_due)
        return min(due, self.outbox[0].due) if self.outbox else due

    def advance(self, now: int) -> None:
        """Bring the module to clock `now`."""
        board = self.board
        chips = disturbed = board.next_event() <= now
        board.advance(now)
        self.now = now
        if not self.powered:
            return
        supervision = self.supervision
        if chips or now >= supervision.due:
            disturbed = True
            supervision.advance(now, chips)
        if chips or now >= self._pins_due:
            disturbed = True
            self._pins_due = NEVER
            for search in self.searches:
                if search.state:
                    search.advance(now)
        if self.program.state:
            self.program.advance(now, disturbed)
        if self.outbox:
            self._deliver(now)
        if self.touched:
            self.settle()

    def _deliver(self, now: int) -> None:
        while self.outbox and self.outbox[0].due <= now:
            _, port, data = self.outbox.popleft()
            port.deliver(data)
        self.touched = self.touched or not self.outbox

    def _note_pins(self) -> None:
        if self.powered:
            if self.program.state or any(search.state for search in self.searches):
                self._pins_due = self.now + 1
            self.supervision.pins_changed()


_RANDOM_FACTOR: Final = 6364136223846793005
_RANDOM_MASK: Final = 2**64 - 1

# Control functions that a port answers in a way of their own.


def _read_program(module: Module, port: Port, instruction: Instruction, size: int) -> None:
    """134: the whole stored command, in a form of its own (fidelity FW-82)."""
    stored = module.program.memory.read(instruction.value)
    if isinstance(stored, Instruction):
        port.answer_record(pack_record(stored)[:-1], size)
    else:
        port.answer(stored, instruction.number, instruction.value, size)


def _tell_version(module: Module, port: Port, instruction: Instruction, size: int) -> None:
    """136: type 0 is answered with eight characters and no checksum (manual 6.7.36)."""
    if instruction.type == 0:
        port.answer_text(module.board.model.version.encode("ascii"), size)
    else:
        status, value = module.dispatcher.execute(instruction)
        port.answer(status, instruction.number, value, size)


def _restore_factory_settings(module: Module, port: Port, instruction: Instruction, size: int) -> None:
    """137: no reply when it is done."""
    status, value = module.dispatcher.execute(instruction)
    if status != Status.OK:
        port.answer(status, instruction.number, value, size)


def _announce_target(module: Module, port: Port, instruction: Instruction, size: int) -> None:
    """138: one reply now, another when all motors of the mask are at their targets (manual 6.7.34)."""
    status, value = module.dispatcher.execute(instruction)
    port.answer(status, instruction.number, value, size)
    if status == Status.OK:
        module.supervision.request_target_reached(port, value, size)


def _enter_ascii_mode(module: Module, port: Port, instruction: Instruction, size: int) -> None:
    """139: the reply is still binary (manual 6.6; fidelity FW-83)."""
    serial = isinstance(port, SerialPort)
    status = Status.OK if serial else Status.NOT_AVAILABLE
    port.answer(status, instruction.number, instruction.value, size)
    if serial:
        port.ascii_mode = True


def _boot(module: Module, port: Port, instruction: Instruction, size: int) -> None:
    """242: to the boot loader if there is one and the key fits, else a command like any unknown one."""
    if module.on_boot is not None and instruction[1:] == BOOT_KEY:
        module.on_boot(port)
    else:
        port.answer(Status.INVALID_COMMAND, instruction.number, instruction.value, size)


_SPECIAL: Final[Mapping[int, Control]] = {
    134: _read_program,
    136: _tell_version,
    137: _restore_factory_settings,
    138: _announce_target,
    139: _enter_ascii_mode,
    BOOT: _boot,
}
