"""The stand-alone program: run, step, stop, and the commands that only a program has.

One instruction takes `Module.instruction_clocks` and has its effect at their end.  Register commands run in
`machine`, many at a time; everything else goes through the module's dispatcher, as a host's command would,
with the one difference that a value read goes into the accumulator.

What others could notice comes at an event of its own: before promising when that is, the program runs its
register commands ahead on a copy (`ahead`).  A program that goes round in a cycle, in registers alone or polling for
what cannot change yet (`polling`), is not run at all until somebody else acts, and is then put where it would be.

A command that the module refuses has no effect; the program goes on with the next one and `last_error` tells
of it.  Erased memory (command 0) and the end of the memory stop the program.

Source: manual 2.1, 6.3, 6.4.4, 6.4.5, 6.7.16 to 6.7.32, 6.7.36; fidelity PROG-6 to PROG-18.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from tmcm34x.clock import NEVER
from tmcm34x.firmware.program import wait
from tmcm34x.firmware.program.ahead import Ahead
from tmcm34x.firmware.program.machine import Machine
from tmcm34x.firmware.program.memory import END, Memory
from tmcm34x.firmware.program.polling import Cycle, Polling
from tmcm34x.firmware.program.registers import ERROR_FLAGS, Registers
from tmcm34x.firmware.program.wait import Wait
from tmcm34x.tmcl.commands import BY_MNEMONIC, BY_NUMBER, MOTORS, PROGRAM_SIZE, RFS_TYPES, USER_VARIABLES
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.firmware.module import Module

_STOP: Final = BY_MNEMONIC["STOP"].number
_WAIT: Final = BY_MNEMONIC["WAIT"].number
_GCO: Final = BY_MNEMONIC["GCO"].number
_RFS: Final = BY_MNEMONIC["RFS"].number
_RFS_STATUS: Final = dict(RFS_TYPES)["STATUS"]
_PROGRAM_ONLY: Final = frozenset(row.number for row in BY_MNEMONIC.values() if "direct" not in row.where)
_READING: Final = frozenset(row.number for row in BY_MNEMONIC.values() if "reads" in row.where)


class State(IntEnum):
    """What the program is doing (control function 135, global parameter 128)."""

    STOP = 0
    RUN = 1
    STEP = 2
    RESET = 3


class ProgramError(NamedTuple):
    """A command of the program that was refused, or an end of the program without STOP."""

    address: int
    status: Status


Ask = Callable[[int], bool]
"""Asked with the address of a command about to be executed; true stops the program there."""


class Program:
    """The stand-alone program of one module."""

    def __init__(self, module: Module) -> None:
        self._module = module
        self.registers = Registers([0] * USER_VARIABLES)
        self.memory = Memory(module.eeprom)
        self.state = State.STOP
        self.last_error: ProgramError | None = None
        """The last command that was refused, since the program was started or reset."""
        self.executed = 0
        """Commands executed since power-on."""
        self.controls = 0
        """Times that somebody outside has started, stopped or reset the program."""
        self.wait: Wait | None = None
        """The WAIT that is being executed."""
        self.on_refusal: list[Callable[[], bool]] = []
        """Called after a command was refused, with `last_error` saying which; any true stops the program there."""
        self._hooks: dict[Ask, frozenset[int] | None] = {}
        """Who wants to be asked before which commands; None: before all."""
        self._machine = Machine(self.memory.__getitem__)
        self._due = NEVER
        """Clock at which the command at the counter has its effect."""
        self._started_at = 0
        """`executed` when the program was started."""
        self._ahead = Ahead(self._machine)
        self._polling = Polling(module)
        self._pins_changed = False
        module.board.on_pins.append(self._note_pins)

    def __getstate__(self) -> dict[str, Any]:
        """A copy has no listeners: those of the original know nothing of it."""
        return {**self.__dict__, "on_refusal": [], "_hooks": {}}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._machine.guard(frozenset())

    # What others see and set

    @property
    def downloading(self) -> bool:
        """Whether commands are stored instead of executed, between 132 and 133."""
        return self.memory.downloading

    @property
    def counter(self) -> int:
        """Address of the command being executed (global parameter 130)."""
        return self.registers.counter

    @property
    def accumulator(self) -> int:
        """The accumulator."""
        return self.registers.accumulator

    @accumulator.setter
    def accumulator(self, value: int) -> None:
        self.wake()
        self.registers.accumulator = value

    @property
    def x(self) -> int:
        """The X register."""
        return self.registers.x

    @property
    def stack(self) -> tuple[int, ...]:
        """Return addresses of the open CSUBs, the latest last."""
        return tuple(self.registers.stack)

    @property
    def variables(self) -> list[int]:
        """The user variables in RAM; call `wake` before changing one."""
        return self.registers.variables

    @property
    def flags(self) -> dict[str, bool]:
        """All flags that JC looks at, by name."""
        registers = self.registers
        return {
            "zero": registers.result == 0,
            "equal": registers.difference == 0,
            "lower": registers.difference < 0,
            "greater": registers.difference > 0,
            **{word: bool(registers.errors & bit) for word, bit in ERROR_FLAGS.items()},
        }

    @property
    def active(self) -> bool:
        """Whether the program runs or makes a step."""
        return self.state in {State.RUN, State.STEP}

    @property
    def waiting(self) -> bool:
        """Whether a WAIT is being executed."""
        return self.wait is not None

    @property
    def cycle(self) -> Cycle | None:
        """The cycle that the program goes round in until somebody else acts; None where none is known yet."""
        cycle = self._polling.cycle
        return cycle if cycle is not None and cycle.start <= self._module.now else None

    def round(self) -> list[int]:
        """The addresses of one round of `cycle`, in their order; at most 1000."""
        cycle = self.cycle
        return [] if cycle is None else self._ahead.round(cycle)

    @property
    def upcoming(self) -> int:
        """Address of the command due at the next event."""
        ahead = self._ahead
        return ahead.registers.counter if ahead.until and ahead.commands else self.registers.counter

    @property
    def hooked(self) -> bool:
        """Whether somebody wants to be asked before commands."""
        return bool(self._hooks)

    def hook(self, ask: Ask, addresses: frozenset[int] | None = None) -> None:
        """Have `ask` asked with the address of each command about to be executed; true stops the program there.

        It is not asked for the command that the program is started at.  With `addresses` it is asked only for
        those, and the others run as fast as ever; a second call changes them.
        """
        self._hooks[ask] = addresses
        self._guard()

    def unhook(self, ask: Ask) -> None:
        """Ask no more, if it was asked."""
        if ask in self._hooks:
            del self._hooks[ask]
            self._guard()

    def raise_error(self, flag: str) -> None:
        """Set one of the flags ETO, EAL, EDV, EPO, ESD."""
        self.wake()
        self.registers.errors |= ERROR_FLAGS[flag]

    def wake(self) -> None:
        """Take notice that something a program may look at changes, here and now."""
        self._ahead.begin(self.executed)
        self._polling.forget(self._module.now)

    # Control functions

    def run(self, address: int | None = None) -> Status:
        """Start the program where it stands, or at `address` with an empty stack (129)."""
        if address is not None:
            if not 0 <= address < PROGRAM_SIZE:
                return Status.INVALID_VALUE
            self.stop()
            self.registers.counter = address
            self.registers.stack.clear()
        self.controls += 1
        if self.state is not State.RUN:
            self._start(State.RUN)
        return Status.OK

    def step(self) -> Status:
        """Execute one command and stop again (130)."""
        self.controls += 1
        self._start(State.STEP)
        return Status.OK

    def stop(self) -> Status:
        """Stop the program where it stands (128)."""
        self.controls += 1
        self._halt()
        return Status.OK

    def reset(self) -> Status:
        """Stop, and bring counter, stack, registers and flags to their initial state (131)."""
        self.controls += 1
        self._halt()
        self.registers.reset()
        self._machine.invalidate()
        self.last_error = None
        return Status.OK

    def power_on(self, auto_start: bool) -> None:
        """Begin anew; `auto_start` (global parameter 77) starts the program from address 0."""
        self.memory.downloading = False
        self.executed = 0
        self.reset()
        if auto_start:
            self.run()

    def power_off(self) -> None:
        """Leave off at once."""
        self.controls += 1
        self._halt()

    def start_download(self, address: int) -> Status:
        """Stop and reset the program, and store all commands to come from `address` on (132)."""
        status = self.memory.may_download(address)
        if status is Status.OK:
            self.reset()
            self.memory.downloading = True
            self.memory.address = address
        return status

    def quit_download(self) -> Status:
        """Execute commands again instead of storing them (133)."""
        self.memory.downloading = False
        self._machine.invalidate()
        return Status.OK

    def erase(self) -> None:
        """Wipe the program memory: its protection against reading was given up."""
        self.reset()
        self.memory.erase()

    def calculate(self, instruction: Instruction) -> Status:
        """Execute CALC or CALCX for a host, on the program's own registers."""
        self.wake()
        done = self._machine.execute(self.registers, instruction)
        return Status.OK if done else Status.WRONG_TYPE

    # State as a plain value

    def save(self) -> tuple[Any, ...]:
        """Everything that the program is, apart from its memory, which is the EEPROM's."""
        return (
            self.registers.contents(), int(self.state), self.memory.downloading, self.memory.address,
            None if self.last_error is None else tuple(map(int, self.last_error)),
            self.executed, self.controls, None if self.wait is None else tuple(self.wait),
            self._due, self._started_at, self._pins_changed, self._ahead.save(), self._polling.save(),
        )  # fmt: skip

    def load(self, value: tuple[Any, ...]) -> None:
        """Go back to what `save` gave; the memory must be what it was then."""
        (
            contents, state, self.memory.downloading, self.memory.address, error,
            self.executed, self.controls, waiting,
            self._due, self._started_at, self._pins_changed, ahead, polling,
        ) = value  # fmt: skip
        self._machine.invalidate()
        self.registers.restore(contents)
        self.state = State(state)
        self.last_error = None if error is None else ProgramError(error[0], Status(error[1]))
        self.wait = None if waiting is None else Wait(*waiting)
        self._ahead.load(ahead)
        self._polling.load(polling)

    # Time

    def next_event(self) -> int:
        """The next clock at which somebody else could notice what the program does."""
        if not self.state:
            return NEVER
        if self.wait is not None:
            return self._module.now + 1 if self._pins_changed else self.wait.limit
        if self._pins_changed or self.state is State.STEP:
            self._pins_changed = False
            self.wake()
        if self.state is State.STEP or self._watched:
            return self._due
        cycle = self._polling.cycle
        if cycle is not None:
            return cycle.start if self._module.now < cycle.start else cycle.until
        return self._ahead.until or self._look_ahead()

    def advance(self, now: int, disturbed: bool = False) -> None:
        """Execute everything that is due up to `now`; the module's chips and pins are already there.

        disturbed: something besides the program had an event at `now`
        """
        if not self.state:
            return
        if self.wait is not None:
            self._check_wait(self.wait, now)
        elif not self._watched:
            self._catch_up(now)
        if disturbed or self._polling.expired(now):
            self._polling.leave()
        self._pins_changed = False
        while self._due <= now:
            self._execute_due(now)

    @property
    def _watched(self) -> bool:
        """Whether somebody looks at each single command."""
        observer = self._module.observer
        if observer is not None and observer.instruction is not None:
            return True
        return bool(self._hooks) and None in self._hooks.values()

    def _note_pins(self) -> None:
        self._pins_changed = True

    def _guard(self) -> None:
        self.wake()
        asked = (addresses for addresses in self._hooks.values() if addresses is not None)
        self._machine.guard(frozenset[int]().union(*asked))

    def _start(self, state: State) -> None:
        self.wake()
        self.state = state
        if self.wait is None:
            self._machine.invalidate()
            self.last_error = None
            self._started_at = self.executed
            self._due = self._module.now + self._module.instruction_clocks

    def _halt(self) -> None:
        self.wake()
        self.state = State.STOP
        self.wait = None
        self._due = NEVER
        self._ahead.shorten()

    def _execute_due(self, now: int) -> None:
        """Execute the register commands due up to `now`, then at most one foreign command."""
        clocks = self._module.instruction_clocks
        room = (now - self._due) // clocks + 1
        single = self._watched or self.state is State.STEP
        if single:
            if self._pauses(now):
                return
            room = 1
        done = self._machine.run(self.registers, room)
        self.executed += done
        self._due += done * clocks
        if single:
            self._search()
        if done < room and (single or not self._guarded or not self._pauses(now)):
            self._execute_foreign(now)
        if self.state is State.STEP and self.wait is None:
            self._halt()

    @property
    def _guarded(self) -> bool:
        """Whether somebody wants to be asked before the command at the counter."""
        return self.registers.counter in self._machine.guarded

    def _pauses(self, now: int) -> bool:
        """Tell those who watch of the command to come; whether one of them stops the program before it."""
        address = self.registers.counter
        if self._hooks and self.executed != self._started_at and self._asked(address):
            self._halt()
            return True
        observer = self._module.observer
        if observer is not None and observer.instruction is not None:
            observer.instruction(address, self.memory[address], now)
        return False

    def _asked(self, address: int) -> bool:
        """Ask all who want to be asked before the command at `address`."""
        answers = [
            ask(address)
            for ask, addresses in tuple(self._hooks.items())
            if addresses is None or address in addresses
        ]
        return any(answers)

    def _execute_foreign(self, now: int) -> None:
        address = self.registers.counter
        instruction = self.memory[address]
        guarded = self._guarded
        if guarded and self._machine.pass_guard(self.registers):
            self._polling.forget(now)
            self.executed += 1
            self._due = now + self._module.instruction_clocks
        elif instruction.number == _WAIT:
            self._begin_wait(instruction, address, now)
        elif instruction.number == _STOP:
            self._go_on(address, now)
            self._halt()
        elif instruction.number == END.number:
            self.last_error = ProgramError(address, Status.INVALID_COMMAND)
            self._halt()
        elif instruction.number in _PROGRAM_ONLY:
            self._refuse(address, _misuse(instruction), now)
        elif not guarded and self._polling.repeats(instruction, now):
            self._poll(instruction, address, now)
        else:
            self._polling.forget(now)
            self._execute_command(instruction, address, now)
        self._ahead.begin(self.executed)

    def _go_on(self, address: int, now: int) -> None:
        """The command at `address` is done."""
        self.executed += 1
        self.registers.counter = address + 1
        self._due = now + self._module.instruction_clocks

    def _refuse(self, address: int, status: Status, now: int) -> None:
        self._go_on(address, now)
        self._tell_refusal(address, status)

    def _tell_refusal(self, address: int, status: Status) -> None:
        self.last_error = ProgramError(address, status)
        stops = [refused() for refused in tuple(self.on_refusal)]
        if any(stops):
            self._halt()

    def _execute_command(self, instruction: Instruction, address: int, now: int) -> int | None:
        """Let the module execute a command; gives back the value read, if it reads one."""
        self._go_on(address, now)
        status, value = self._module.execute_in_program(instruction)
        if status != Status.OK:
            self._tell_refusal(address, Status(status))
            return None
        if not _reads(instruction):
            return None
        self.registers.load(value)
        return value

    # WAIT

    def _begin_wait(self, instruction: Instruction, address: int, now: int) -> None:
        self._polling.forget(now)
        begun = wait.begin(instruction, now)
        if isinstance(begun, Status):
            self._refuse(address, begun, now)
        else:
            self.wait = begun
            self._due = NEVER
            self._check_wait(begun, now)

    def _check_wait(self, waiting: Wait, now: int) -> None:
        """Go on when the wait is over; a condition that comes true at the time-out's own clock wins."""
        if not wait.fulfilled(self._module, waiting):
            if now < waiting.limit:
                return
            if waiting.conditional:
                self.registers.errors |= ERROR_FLAGS["ETO"]
        self.wait = None
        self._go_on(self.registers.counter, now)
        self._ahead.begin(self.executed)
        if self.state is State.STEP:
            self._halt()

    # Running ahead, and not running at all

    def _look_ahead(self) -> int:
        """Find the next event by running register commands on a copy."""
        clocks = self._module.instruction_clocks
        cycle = self._ahead.look(self.registers, self.executed, self._due, clocks)
        if cycle is None:
            return self._ahead.until
        self._polling.cycle = cycle
        return cycle.start

    def _search(self) -> None:
        """Where each command is looked at: search the registers for a cycle when it is time to."""
        if self._polling.cycle is None and self._ahead.concerns(self.executed):
            clocks = self._module.instruction_clocks
            self._polling.cycle = self._ahead.search(self.registers, self.executed, self._due, clocks)

    def _poll(self, instruction: Instruction, address: int, now: int) -> None:
        """Execute a command that may be part of a polling loop."""
        if self._polling.cycle is not None:
            self._execute_command(instruction, address, now)
            return
        error = self.last_error
        self._polling.meet(instruction, self.registers.contents(), self.executed, now)
        value = self._execute_command(instruction, address, now)
        self._polling.passed(value, now, refused=self.last_error is not error)

    def _catch_up(self, now: int) -> None:
        """Bring a program that was not run to just before what is due at `now`."""
        cycle = self._polling.cycle
        if cycle is not None:
            if now > cycle.start:
                self._go_round(cycle, now)
        elif self._ahead.until:
            done = self._ahead.take(self.registers, now)
            if done:
                self.executed += done
                self._due = now

    def _go_round(self, cycle: Cycle, now: int) -> None:
        """Bring a program that goes round in `cycle` to just before what is due at `now`."""
        periods = (now - cycle.start) // cycle.period
        self.registers.restore(cycle.contents)
        self.executed = cycle.executed + periods * cycle.commands
        self._due = cycle.start + periods * cycle.period
        clocks = self._module.instruction_clocks
        for value in (*cycle.values, None):
            room = -((self._due - now) // clocks)
            done = self._machine.run(self.registers, room)
            self.executed += done
            self._due += done * clocks
            if done == room:
                return
            self._go_on(self.registers.counter, self._due)
            self._ahead.begin(self.executed)
            if value is not None:
                self.registers.load(value)


def _reads(instruction: Instruction) -> bool:
    """Whether the command's value goes to the accumulator."""
    number, type_, motor, _ = instruction
    if number == _RFS:
        return type_ == _RFS_STATUS
    return number in _READING and not (number == _GCO and motor >= MOTORS)


def _misuse(instruction: Instruction) -> Status:
    """Why a command for programs alone is refused: its type, or else its value is out of range."""
    operands = BY_NUMBER[instruction.number].operands
    types = [operand for operand in operands if operand.field == "type"]
    right = all(operand.low <= instruction.type <= operand.high for operand in types)
    return Status.INVALID_VALUE if right else Status.WRONG_TYPE
