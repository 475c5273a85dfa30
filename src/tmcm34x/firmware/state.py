"""What a module remembers, in one place: `ModuleState`.

Everything that the firmware does is a function of a `ModuleState` and of operands; nothing else keeps state, apart
from the chips on the board, the EEPROM, the program (`program`) and what a port has received of a telegram (`ports`).

Listeners (`observers` and the lists `on_...`) are no state: a copy has none, and its ports lead nowhere.

Source: manual 6 to 8; fidelity FW-90 to FW-92.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Protocol

from tmcm34x.clock import MS, NEVER
from tmcm34x.firmware.axis import AxisState
from tmcm34x.firmware.roles import Port
from tmcm34x.firmware.storage import EepromError
from tmcm34x.tmcl.commands import COORDINATES, MOTORS
from tmcm34x.tmcl.numbers import GP
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.board.circuit import Circuit
    from tmcm34x.clock import Value
    from tmcm34x.firmware.roles import Observer, ProgramControl
    from tmcm34x.firmware.storage import Eeprom
    from tmcm34x.tmcl.axis_parameters import AxisParameter
    from tmcm34x.tmcl.datagram import Instruction
    from tmcm34x.tmcl.global_parameters import GlobalParameter

ALL_MOTORS: Final = (1 << MOTORS) - 1
"""Bits of all motors."""

INSTRUCTION_CLOCKS: Final = MS // 10
"""Time of one instruction of a program: an assumption of the right order of magnitude (fidelity FW-92)."""

_RANDOM_FACTOR: Final = 6364136223846793005
_RANDOM_MASK: Final = 2**64 - 1

Result = tuple[int, int]
"""Status and value of the reply."""
Handler = Callable[["ModuleState", int, int, int], Result]
"""Does a command: takes type, motor and value."""
UserFunction = Callable[[Any, int, int, int], Result]
"""Takes module, type, motor and value of UF0..UF7; returns status and value of the reply."""


class CommandEntry(NamedTuple):
    """What a command number does: its handler, and the ranges that its row sets for the operands."""

    handler: Handler
    motor_high: int = 255
    """Largest motor or bank."""
    reads: bool = False
    ranges: tuple[int, int, int, int, int, int] | None = None
    """Lowest and highest type, motor and value, where more than `motor_high` is set."""


AxisReader = Callable[["ModuleState", AxisState, int], int]
"""Reads the axis parameter of that number."""
AxisWriter = Callable[["ModuleState", AxisState, int, int], Status]
"""Writes a value to the axis parameter of that number."""
GlobalReader = Callable[["ModuleState", int], int]
GlobalWriter = Callable[["ModuleState", int, int], Status]


@dataclass(frozen=True, slots=True)
class Tables:
    """How the parameters of a model are read and written, by number."""

    axis_readers: tuple[AxisReader | None, ...]
    """For GAP, 0..255; None for a number that is not there."""
    axis_writers: tuple[tuple[AxisParameter, AxisWriter] | None, ...]
    """For SAP and AAP."""
    stored: frozenset[int]
    """Axis parameters that STAP and RSAP know."""
    globals: frozenset[int]
    """All global parameters of bank 0."""
    global_readers: tuple[GlobalReader | None, ...]
    """For GGP, 0..255."""
    global_writers: Mapping[int, tuple[GlobalParameter, GlobalWriter]]
    """For SGP and AGP."""


OwnReply = Callable[["ModuleState", Port, "Instruction", int], None]
"""Does a command that came through a port in so many bytes, and answers it, or not."""


class Boot(Protocol):
    """A boot loader in the module."""

    def take_over(self, core: ModuleState, /) -> None:
        """Power-on: answer instead of the firmware if there is no whole one."""
        ...

    def enter(self, core: ModuleState, /) -> None:
        """Leave the firmware."""
        ...

    def save(self) -> Value:
        """What it remembers."""
        ...

    def load(self, core: ModuleState, value: Any, /) -> None:
        """Go back to what `save` gave."""
        ...


class Letter(NamedTuple):
    """A reply that waits for the end of the telegram pause."""

    due: int
    port: Port
    data: bytes


class EventRequest(NamedTuple):
    """A command 138 that waits for its motors."""

    port: Port
    mask: int
    size: int


_PLAIN: Final = (
    "now", "powered", "address", "second_address", "host_address", "pause", "heartbeat", "can_heartbeat",
    "baud_index", "silent", "tick_origin", "touched", "encoder_interface", "shut_down", "shutdown_due", "poll_due",
    "heartbeat_due", "can_heartbeat_due", "due", "pins_due", "random_state",
)  # fmt: skip
"""Attributes of a `ModuleState` that are numbers."""


class ModuleState:
    """What the firmware of a module on `circuit` with `eeprom` works on; see the module.

    firmware: what each command number 0..255 does, and the commands that a port answers in a form of their own
    tables: how parameters are read and written
    seed: start of the random numbers of global parameter 133
    instruction_clocks: time that one instruction of a stand-alone program takes
    """

    __slots__ = (
        *_PLAIN, "answers", "application", "axes", "boot", "circuit", "coordinates", "eeprom", "entries", "firmware",
        "instruction_clocks", "observers", "on_event", "on_refusal", "outbox", "ports", "requests",
        "tables", "user_functions", "user_parameters",
    )  # fmt: skip

    def __init__(
        self,
        circuit: Circuit,
        eeprom: Eeprom,
        firmware: tuple[Sequence[CommandEntry], Mapping[int, OwnReply]],
        tables: Tables,
        *,
        seed: int,
        instruction_clocks: int,
    ) -> None:
        if eeprom.model != circuit.model.number:
            raise EepromError(f"EEPROM image is of a TMCM-{eeprom.model}, not of a {circuit.model.name}")
        self.circuit = circuit
        self.eeprom = eeprom
        self.instruction_clocks = instruction_clocks
        self.firmware = firmware
        """What commands do while the firmware is in charge, not the boot loader: `entries` and `answers`."""
        self.entries, self.answers = firmware
        self.tables = tables
        self.application: ProgramControl
        """The stand-alone program, as commands see it."""
        self.boot: Boot | None = None
        self.user_functions: dict[int, UserFunction] = {}
        """What UF0..UF7 do, by 0..7."""
        self.user_parameters: dict[int, int] = {}
        """Global parameters of bank 1, by number: none in plain firmware (manual 8.2)."""
        self.observers: list[Observer] = []
        self.on_event: list[Callable[[str], None]] = []
        """Called with the kind of each event that observers are told of, for who needs no telegrams."""
        self.on_refusal: list[Callable[[int], None]] = []
        """Called with the status of each command of a host that is refused, as it is answered."""

        self.now = circuit.now
        self.powered = False
        self.axes = tuple(AxisState(circuit, motor) for motor in range(MOTORS))
        self.coordinates: list[list[int]] = [[0] * COORDINATES for _ in range(MOTORS)]
        """Coordinates 0..20 in RAM, for each motor."""
        self.encoder_interface = 0
        """Global parameter 74."""
        self.ports: list[Port] = []
        self.outbox: deque[Letter] = deque()
        self.requests: list[EventRequest] = []

        self.address = self.second_address = self.host_address = 0
        self.pause = self.heartbeat = self.can_heartbeat = self.baud_index = 0
        self.silent = False
        """Global parameter 255: no replies."""
        self.tick_origin = 0
        """Millisecond of the clock at which the tick timer would have been 0."""
        self.touched = 0
        """Motors, as bits, that something was done to after which `settle` must be called at this clock."""
        self.shut_down = False
        """Whether the SHUTDOWN pin is active."""
        self.shutdown_due = self.poll_due = self.heartbeat_due = self.can_heartbeat_due = NEVER
        """Clocks at which supervision has something to do; see `supervision`."""
        self.due = NEVER
        """The first of them, and of those of the axes."""
        self.pins_due = NEVER
        """The clock at which a pin that changed is noticed."""
        self.random_state = seed & _RANDOM_MASK

    def forget(self) -> None:
        """Power-on: everything that is not in the EEPROM is as new; random numbers and clock go on."""
        for axis in self.axes:
            axis.reset(self.now)
        self.shut_down = False
        self.shutdown_due = self.poll_due = self.heartbeat_due = self.can_heartbeat_due = self.due = NEVER
        self.pins_due = NEVER
        self.outbox.clear()
        self.requests.clear()

    def take_settings(self) -> None:
        """Take up the global parameters that are looked at often."""
        settings = self.eeprom.global_values
        self.address, self.host_address = settings[GP.SERIAL_ADDRESS], settings[GP.HOST_ADDRESS]
        self.second_address = settings.get(GP.SERIAL_SECONDARY_ADDRESS, 0)
        self.pause, self.heartbeat = settings[GP.TELEGRAM_PAUSE], settings[GP.SERIAL_HEARTBEAT]
        self.can_heartbeat = settings.get(GP.CAN_HEARTBEAT, 0)

    def tell(self, kind: str, motor: int) -> None:
        """Tell the observers of an event."""
        for observer in self.observers:
            observer.event(kind, motor, self.now)
        for listener in self.on_event:
            listener(kind)

    def show(self, port: Port, direction: str, data: bytes) -> None:
        """Tell the observers of bytes that came in ("in") or go out ("out")."""
        for observer in self.observers:
            observer.telegram(port, direction, data, self.now)

    def refused(self, status: int) -> None:
        """A command of a host is answered with a status below `Status.OK`."""
        for listener in self.on_refusal:
            listener(status)

    # Random numbers (fidelity FW-52)

    def random_number(self) -> int:
        """The next of a sequence that begins with the seed, 0..2^31 - 1."""
        self.random_state = (self.random_state * _RANDOM_FACTOR + 1) & _RANDOM_MASK
        return self.last_random_number

    @property
    def last_random_number(self) -> int:
        """The last number of the sequence."""
        return self.random_state >> 33

    # Replies

    def post(self, port: Port, data: bytes) -> None:
        """Send a reply after the telegram pause, in the order of the commands."""
        due = self.now + self.pause * MS
        if self.outbox:
            due = max(due, self.outbox[-1].due)
        self.outbox.append(Letter(due, port, data))

    # State as a plain value

    def save_core(self) -> Value:
        """The state that is here; board, EEPROM and program are apart."""
        number = self.ports.index
        return (
            tuple(getattr(self, name) for name in _PLAIN),
            tuple(axis.save() for axis in self.axes),
            tuple(map(tuple, self.coordinates)),
            tuple(sorted(self.user_parameters.items())),
            tuple((letter.due, number(letter.port), letter.data) for letter in self.outbox),
            tuple((number(row.port), row.mask, row.size) for row in self.requests),
            tuple(port.save() for port in self.ports),
        )

    def load_core(self, value: Any) -> None:
        """Go back to what `save_core` gave; replies to ports that are not there are lost."""
        plain, axes, coordinates, parameters, outbox, requests, ports = value
        for name, number in zip(_PLAIN, plain, strict=True):
            setattr(self, name, number)
        for axis, saved in zip(self.axes, axes, strict=True):
            axis.load(saved)
        self.coordinates = [list(positions) for positions in coordinates]
        self.user_parameters = dict(parameters)
        for port, saved in zip(self.ports, ports, strict=False):
            port.load(saved)
        here = range(len(self.ports))
        self.outbox = deque(Letter(due, self.ports[n], data) for due, n, data in outbox if n in here)
        self.requests = [EventRequest(self.ports[n], mask, size) for n, mask, size in requests if n in here]
