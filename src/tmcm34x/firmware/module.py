"""A whole module: board, EEPROM, firmware, ports, and the order in which they work.

At each clock the work is done in one fixed order, whatever the slicing of time: motion chips, supervision,
reference searches, the stand-alone program, delayed replies.  Commands of hosts are executed between two calls
of `advance`, at `now`.  When the world changes a pin, the firmware notices one clock later.

Ports (`firmware.ports`) are made with a module and add themselves to `FirmwareModule.ports`.

Source: manual 6, 8.1; power-on, order and time-outs: fidelity FW-90 to FW-92.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, SupportsIndex, cast

from tmcm34x import clock
from tmcm34x.clock import NEVER
from tmcm34x.firmware import power, reference, supervision
from tmcm34x.firmware.control import FIRMWARE, IN_DOWNLOAD
from tmcm34x.firmware.dispatch import execute
from tmcm34x.firmware.parameters.tables import tables
from tmcm34x.firmware.peek import peek
from tmcm34x.firmware.power import settle
from tmcm34x.firmware.program import StandAloneProgram
from tmcm34x.firmware.state import ALL_MOTORS, INSTRUCTION_CLOCKS, ModuleState
from tmcm34x.tmcl.axis_parameters import STANDARD
from tmcm34x.tmcl.numbers import GP

if TYPE_CHECKING:
    from tmcm34x.board.board import Board
    from tmcm34x.board.circuit import Circuit
    from tmcm34x.clock import Value
    from tmcm34x.firmware.roles import Port
    from tmcm34x.firmware.state import Result
    from tmcm34x.firmware.storage import Eeprom
    from tmcm34x.tmcl.datagram import Instruction


class FirmwareModule(ModuleState):
    """A TMCM-34x: `board` with `eeprom`, switched off.

    seed: start of the random numbers of global parameter 133
    instruction_clocks: time that one instruction of a stand-alone program takes
    address, host_address: written into the EEPROM as global parameters 66 and 76
    profile: "standard", or "later" for some parameters of later firmware too (fidelity TMCL-18)
    """

    __slots__ = ("program",)

    def __init__(
        self,
        board: Circuit,
        eeprom: Eeprom,
        *,
        seed: int = 0,
        instruction_clocks: int = INSTRUCTION_CLOCKS,
        address: int | None = None,
        host_address: int | None = None,
        profile: str = STANDARD,
    ) -> None:
        model = board.model.number
        super().__init__(
            board, eeprom, FIRMWARE, tables(model, profile), seed=seed, instruction_clocks=instruction_clocks
        )
        if eeprom.profile != profile:
            eeprom.take_profile(profile)
        for number, value in ((GP.SERIAL_ADDRESS, address), (GP.HOST_ADDRESS, host_address)):
            if value is not None:
                eeprom.set_global_value(number, value)
        self.program = StandAloneProgram(self)
        self.application = self.program
        board.on_pins.append(self._note_pins)

    @property
    def board(self) -> Board:
        """The circuit, where it is a board with models of the chips, as on a bench."""
        return cast("Board", self.circuit)

    def take_profile(self, profile: str) -> None:
        """Have the parameters of "standard" or "later" from now on; a module that is switched on restarts."""
        self.eeprom.take_profile(profile)
        self.tables = tables(self.circuit.model.number, profile)
        if self.powered:
            self.reset()

    # Power

    def power_on(self) -> None:
        """Start the firmware: chips and settings from the EEPROM, all else as new."""
        power.switch_on(self)

    def power_off(self) -> None:
        """Cut the power: nothing moves, nothing answers, what is not stored is lost."""
        power.switch_off(self)

    def reset(self) -> None:
        """Switch off and on."""
        power.cycle(self)

    @property
    def owes_reply(self) -> bool:
        """Whether a reply is still to come: after the telegram pause, or the second one of command 138."""
        return bool(self.outbox or self.requests)

    # Commands

    def attach(self, port: Port) -> None:
        """Take commands through a further port."""
        self.ports.append(port)
        if self.powered:
            port.power_on()

    def detach(self, port: Port) -> None:
        """Take a port away, and what is still to be sent to it."""
        self.ports.remove(port)
        self._keep_replies(lambda other: other is not port)

    def drop_replies(self) -> None:
        """Send no reply that is still to come."""
        self._keep_replies(lambda _: False)

    def _keep_replies(self, kept: Callable[[Port], bool]) -> None:
        if self.owes_reply:
            self.outbox = deque(letter for letter in self.outbox if kept(letter.port))
            self.requests = [request for request in self.requests if kept(request.port)]
            settle(self)

    def execute(self, instruction: Instruction) -> Result:
        """Execute a command as in direct mode, without any wire; status and value of its reply."""
        if self.program.state:
            self.program.wake()
        result = execute(self, *instruction)
        if self.touched:
            settle(self)
        return result

    def peek(self, instruction: Instruction) -> Result:
        """What a reading command would be answered with now, without any effect; see `firmware.peek`."""
        return peek(self, instruction)

    def command(self, port: Port, instruction: Instruction, size: int) -> None:
        """Execute a command that came through `port` in `size` bytes, and answer it."""
        number, program = instruction.number, self.program
        if program.downloading and number not in IN_DOWNLOAD:
            port.answer(program.memory.store(instruction), number, instruction.value, size)
            return
        if program.state:
            program.wake()
        answer = self.answers.get(number)
        if answer is not None:
            answer(self, port, instruction, size)
        else:
            status, value = execute(self, *instruction)
            port.answer(status, number, value, size)

    # Time

    def next_event(self) -> int:
        """The next clock at which something could be noticed from outside."""
        if self.program.state:
            return min(self.next_disturbance(), self.program.next_event())
        return self.next_disturbance()

    def next_disturbance(self) -> int:
        """The next clock at which something besides the stand-alone program has an event."""
        if not self.powered:
            return NEVER
        due = min(self.circuit.next_event(), self.due, self.pins_due)
        return min(due, self.outbox[0].due) if self.outbox else due

    def advance(self, now: int) -> None:
        """Bring the module to clock `now`."""
        circuit = self.circuit
        if self.program.state:
            self.program.foresee(now)
        disturbed = circuit.next_event() <= now
        circuit.advance(now)
        self.now = now
        motors = circuit.changed_motors() if disturbed else 0
        if not self.powered:
            return
        if motors or now >= self.due:
            disturbed = True
            supervision.advance(self, now, motors)
        if motors or now >= self.pins_due:
            disturbed = True
            self._look_for_switches()
        if self.program.state:
            self.program.advance(now, disturbed)
        if self.outbox:
            self._deliver(now)
        if self.touched:
            settle(self)

    def pass_to(self, now: int) -> None:
        """Bring the module to clock `now`, before its next event: time passes and nothing else happens.

        An event that is due all the same happens: something was done on the module since its next one was asked for.
        """
        if not self.program.state and now < self.next_disturbance():
            self.circuit.advance(now)
            self.now = now
        elif (
            now > self.now
        ):  # a program that goes on at one clock would take early notice of what has just changed
            self.advance(now)

    def _look_for_switches(self) -> None:
        self.pins_due = NEVER
        for axis in self.axes:
            if axis.search:
                reference.advance(self, axis)

    def _deliver(self, now: int) -> None:
        while self.outbox and self.outbox[0].due <= now:
            _, port, data = self.outbox.popleft()
            port.deliver(data)
        if not self.outbox:
            self.touched = ALL_MOTORS

    def _note_pins(self) -> None:
        if self.powered:
            if self.program.state or any(axis.search for axis in self.axes):
                self.pins_due = self.now + 1
            supervision.pins_changed(self)

    # State as a plain value

    def save(self) -> Value:
        """All that the module remembers: firmware, board, EEPROM, program, boot loader."""
        return (
            self.save_core(), self.circuit.save(), self.eeprom.to_bytes(), self.program.save(),
            None if self.boot is None else self.boot.save(),
        )  # fmt: skip

    def load(self, value: Any) -> None:
        """Go back to what `save` of a module of the same description gave; listeners are not called."""
        core, board, eeprom, program, boot = value
        self.eeprom.restore(eeprom)
        self.circuit.load(board)
        self.load_core(core)
        self.program.load(program)
        if self.boot is not None and boot is not None:
            self.boot.load(self, boot)

    def digest(self) -> str:
        """A fingerprint of the state: equal states have equal digests."""
        return clock.digest(self.save())

    def __reduce_ex__(self, protocol: SupportsIndex, /) -> tuple[Any, ...]:
        """A copy has a board of its own with nothing attached to it; its ports lead nowhere.

        It has the same user functions and no listeners.
        """
        boot = None if self.boot is None else type(self.boot)
        ports = tuple([port.recipe() for port in self.ports])
        parts = self.circuit, self.eeprom, self.instruction_clocks, boot, ports, self.user_functions
        return _rebuilt, (parts, self.save())


def _rebuilt(parts: tuple[Any, ...], state: Any) -> FirmwareModule:
    """The copy that `FirmwareModule.__reduce_ex__` describes."""
    board, eeprom, instruction_clocks, boot, ports, user_functions = parts
    module = FirmwareModule(board, eeprom, instruction_clocks=instruction_clocks, profile=eeprom.profile)
    if boot is not None:
        boot(module)
    for port in ports:
        port(module)
    module.user_functions.update(user_functions)
    module.load(state)
    return module
