"""The stand-alone program: run, step, stop, download, and the commands that only a program has.

One instruction takes `Module.instruction_clocks` and has its effect at their end.  Register commands run in
`machine`, many at a time; everything else goes through the module's dispatcher, as a host's command would,
with the one difference that a value read goes into the accumulator.

What others could notice comes at an event of its own: before promising when that is, the program runs its
register commands ahead on a copy.  A program that polls for what cannot change yet (`polling`) is not run at
all until somebody else acts, and is then put where it would be.

A command that the module refuses has no effect; the program goes on with the next one and `last_error` tells
of it.  Erased memory (command 0) and the end of the memory stop the program.

Source: manual 2.1, 6.3, 6.4.4, 6.4.5, 6.7.16 to 6.7.32, 6.7.36; fidelity PROG-6 to PROG-18.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum
from typing import TYPE_CHECKING, Final, NamedTuple

from tmcm34x.clock import MS, NEVER
from tmcm34x.firmware.machine import ERROR_FLAGS, Machine, Registers
from tmcm34x.firmware.polling import Cycle, Polling
from tmcm34x.tmcl.commands import (
    BY_MNEMONIC,
    BY_NUMBER,
    MOTORS,
    PROGRAM_SIZE,
    RFS_TYPES,
    USER_VARIABLES,
    WAIT_TYPES,
)
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.firmware.module import Module

TICK: Final = 10 * MS
"""One tick of WAIT (manual 6.7.22)."""

_END: Final = Instruction(0)
_STOP: Final = BY_MNEMONIC["STOP"].number
_WAIT: Final = BY_MNEMONIC["WAIT"].number
_WAITS: Final = dict(WAIT_TYPES)
_GCO: Final = BY_MNEMONIC["GCO"].number
_RFS: Final = BY_MNEMONIC["RFS"].number
_RFS_STATUS: Final = dict(RFS_TYPES)["STATUS"]
_PROGRAM_ONLY: Final = frozenset(row.number for row in BY_MNEMONIC.values() if "direct" not in row.where)
_READING: Final = frozenset(row.number for row in BY_MNEMONIC.values() if "reads" in row.where)
_SHORT_RUN: Final = 128
_LONG_RUN: Final = 1 << 16
"""Register commands run ahead at a time: at first, and when nobody ever comes between."""


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


class _Wait(NamedTuple):
    """The WAIT being executed: its condition, none for TICKS, and the clock at which it ends anyway."""

    done: Callable[[], bool] | None
    limit: int


class Program:
    """The stand-alone program of one module."""

    def __init__(self, module: Module) -> None:
        self._module = module
        self.registers = Registers([0] * USER_VARIABLES)
        self.state = State.STOP
        self.downloading = False
        self.last_error: ProgramError | None = None
        """The last command that was refused, since the program was started or reset."""
        self.executed = 0
        """Commands executed since power-on."""
        self.controls = 0
        """Times that somebody outside has started, stopped or reset the program."""
        self.on_refusal: Callable[[], bool] | None = None
        """Asked after a command was refused, with `last_error` telling which; true stops the program there."""
        self._hook: Callable[[int], bool] | None = None
        self._hooked_everywhere = False
        self._machine = Machine(self._read_instruction)
        self._due = NEVER
        """Clock at which the command at the counter has its effect."""
        self._started_at = 0
        """`executed` when the program was started."""
        self._wait: _Wait | None = None
        self._download_address = 0
        self._ahead = Registers([0] * USER_VARIABLES)
        self._ahead_until = 0
        """Clock of the next event found by running ahead; 0: not known."""
        self._ahead_commands = 0
        self._run = _SHORT_RUN
        self._probed = False
        """The register commands ahead have been searched for a cycle in vain."""
        self._polling = Polling(module)
        self._pins_changed = False
        module.board.on_pins.append(self._note_pins)

    # What others see and set

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
        return self._wait is not None

    @property
    def upcoming(self) -> int:
        """Address of the command due at the next event."""
        return self._ahead.counter if self._ahead_until and self._ahead_commands else self.registers.counter

    @property
    def hooked(self) -> bool:
        """Whether somebody wants to be asked before commands."""
        return self._hook is not None

    def hook(self, ask: Callable[[int], bool] | None, addresses: frozenset[int] | None = None) -> None:
        """Have `ask` asked with the address of each command about to be executed; true stops the program there.

        It is not asked for the command that the program is started at.  With `addresses` it is asked only for
        those, and the others run as fast as ever.  None: nobody is asked any more.
        """
        self.wake()
        self._hook = ask
        self._hooked_everywhere = ask is not None and addresses is None
        self._machine.guard(addresses if ask is not None and addresses is not None else frozenset())

    def raise_error(self, flag: str) -> None:
        """Set one of the flags ETO, EAL, EDV, EPO, ESD."""
        self.wake()
        self.registers.errors |= ERROR_FLAGS[flag]

    def wake(self) -> None:
        """Take notice that something a program may look at changes, here and now."""
        self._ahead_until = 0
        self._probed = False
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
        self.downloading = False
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
        if not 0 <= address < PROGRAM_SIZE:
            return Status.INVALID_VALUE
        if self._protection & 2:
            return Status.NOT_AVAILABLE
        self.reset()
        self.downloading = True
        self._download_address = address
        return Status.OK

    def load(self, instruction: Instruction) -> Status:
        """Store the next command of a download; control functions are refused, and so is a 2,049th command."""
        row = BY_NUMBER.get(instruction.number)
        if row is not None and "control" in row.where:
            return Status.NOT_AVAILABLE
        if self._download_address >= PROGRAM_SIZE:
            return Status.INVALID_VALUE
        self._module.eeprom.write_instruction(self._download_address, instruction)
        self._download_address += 1
        return Status.LOADED

    def quit_download(self) -> Status:
        """Execute commands again instead of storing them (133)."""
        self.downloading = False
        self._machine.invalidate()
        return Status.OK

    def read(self, address: int) -> Instruction | Status:
        """The stored command at `address`, or the status that refuses it (134)."""
        if not 0 <= address < PROGRAM_SIZE:
            return Status.INVALID_VALUE
        if self._protection & 1:
            return Status.NOT_AVAILABLE
        return self._module.eeprom.read_instruction(address)

    def erase(self) -> None:
        """Wipe the program memory: its protection against reading was given up."""
        self.reset()
        self._module.eeprom.erase_program()

    def calculate(self, instruction: Instruction) -> Status:
        """Execute CALC or CALCX for a host, on the program's own registers."""
        self.wake()
        done = self._machine.execute(self.registers, instruction)
        return Status.OK if done else Status.WRONG_TYPE

    # Time

    def next_event(self) -> int:
        """The next clock at which somebody else could notice what the program does."""
        if not self.state:
            return NEVER
        if self._wait is not None:
            return self._module.now + 1 if self._pins_changed else self._wait.limit
        if self._watched or self.state is State.STEP:
            self.wake()
            return self._due
        if self._pins_changed:
            self.wake()
            self._pins_changed = False
        cycle = self._polling.cycle
        if cycle is not None:
            return cycle.until
        return self._ahead_until or self._look_ahead()

    def advance(self, now: int) -> None:
        """Execute everything that is due up to `now`; the module's chips and pins are already there."""
        if not self.state:
            return
        if self._polling.cycle is not None:
            self._catch_up(self._polling.cycle, now)
        elif self._wait is not None:
            self._check_wait(self._wait, now)
        elif self._ahead_until:
            self._commit(now)
        self._pins_changed = False
        while self._due <= now:
            self._execute_due(now)

    @property
    def _watched(self) -> bool:
        """Whether somebody looks at each single command."""
        observer = self._module.observer
        return self._hooked_everywhere or (observer is not None and observer.instruction is not None)

    @property
    def _protection(self) -> int:
        return self._module.eeprom.global_values[81]

    def _read_instruction(self, address: int) -> Instruction:
        return self._module.eeprom.read_instruction(address)

    def _note_pins(self) -> None:
        self._pins_changed = True

    def _start(self, state: State) -> None:
        self.wake()
        self.state = state
        if self._wait is None:
            self._machine.invalidate()
            self.last_error = None
            self._started_at = self.executed
            self._due = self._module.now + self._module.instruction_clocks

    def _halt(self) -> None:
        self.wake()
        self.state = State.STOP
        self._wait = None
        self._due = NEVER
        self._run = _SHORT_RUN

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
        if done < room and (single or not self._guarded or not self._pauses(now)):
            self._execute_foreign(now)
        if self.state is State.STEP and self._wait is None:
            self._halt()

    @property
    def _guarded(self) -> bool:
        """Whether somebody wants to be asked before the command at the counter."""
        return self.registers.counter in self._machine.guarded

    def _pauses(self, now: int) -> bool:
        """Tell those who watch of the command to come; whether one of them stops the program before it."""
        address = self.registers.counter
        hook = self._hook
        if hook is not None and self.executed != self._started_at and hook(address):
            self._halt()
            return True
        observer = self._module.observer
        if observer is not None and observer.instruction is not None:
            observer.instruction(address, self._instruction(address), now)
        return False

    def _instruction(self, address: int) -> Instruction:
        return self._read_instruction(address) if address < PROGRAM_SIZE else _END

    def _execute_foreign(self, now: int) -> None:
        address = self.registers.counter
        instruction = self._instruction(address)
        self._probed = False
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
        elif instruction.number == _END.number:
            self.last_error = ProgramError(address, Status.INVALID_COMMAND)
            self._halt()
        elif instruction.number in _PROGRAM_ONLY:
            self._refuse(address, _misuse(instruction), now)
        elif not guarded and self._polling.repeats(instruction, now):
            self._poll(instruction, address, now)
        else:
            self._polling.forget(now)
            self._execute_command(instruction, address, now)

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
        if self.on_refusal is not None and self.on_refusal():
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
        _, kind, motor, ticks = instruction
        self._polling.forget(now)
        if kind > max(_WAITS.values()):
            self._refuse(address, Status.WRONG_TYPE, now)
        elif ticks < 0 or (motor >= MOTORS and kind != _WAITS["TICKS"]):
            self._refuse(address, Status.INVALID_VALUE, now)
        elif kind == _WAITS["TICKS"]:
            self._wait = _Wait(None, now + ticks * TICK)
            self._due = NEVER
            self._check_wait(self._wait, now)
        else:
            self._wait = _Wait(self._condition(kind, motor), now + ticks * TICK if ticks else NEVER)
            self._due = NEVER
            self._check_wait(self._wait, now)

    def _condition(self, kind: int, motor: int) -> Callable[[], bool]:
        axis = self._module.axes[motor]
        if kind == _WAITS["POS"]:
            return lambda: axis.reached
        if kind == _WAITS["REFSW"]:
            return lambda: axis.left_switch
        if kind == _WAITS["LIMSW"]:
            return lambda: axis.left_switch or axis.right_switch
        search = self._module.searches[motor]
        return lambda: not search.state

    def _check_wait(self, wait: _Wait, now: int) -> None:
        """Go on when the wait is over; a condition that comes true at the time-out's own clock wins."""
        if wait.done is None or not wait.done():
            if now < wait.limit:
                return
            if wait.done is not None:
                self.registers.errors |= ERROR_FLAGS["ETO"]
        self._wait = None
        self._go_on(self.registers.counter, now)
        if self.state is State.STEP:
            self._halt()

    # Running ahead

    def _look_ahead(self) -> int:
        """Find the next event by running register commands on a copy."""
        machine, clocks, counter = self._machine, self._module.instruction_clocks, self.registers.counter
        done = 0
        if not machine.is_foreign(counter):
            ahead = self._ahead
            ahead.assign(self.registers)
            done = machine.run(ahead, self._run)
            if done == self._run and not self._probed:
                self._probed = True
                ahead.assign(self.registers)
                done, contents, period = machine.find_cycle(ahead, self._run)
                if period:
                    start, executed = self._due + done * clocks, self.executed + done
                    self._polling.cycle = Cycle(contents, start, executed, period * clocks, period, (), NEVER)
                    return NEVER
            if done == self._run and not machine.reaches_foreign(counter, self.registers.stack):
                return NEVER
        self._ahead_commands = done
        self._ahead_until = self._due + done * clocks
        return self._ahead_until

    def _commit(self, now: int) -> None:
        """Take over what was run ahead, if nobody came between, and run ahead farther or less far in future."""
        if now != self._ahead_until:
            self._run = max(self._run // 2, _SHORT_RUN)
        elif self._ahead_commands:
            if self._ahead_commands == self._run:
                self._run = min(2 * self._run, _LONG_RUN)
            self.registers.assign(self._ahead)
            self.executed += self._ahead_commands
            self._due = now
        self._ahead_until = 0

    # Polling

    def _poll(self, instruction: Instruction, address: int, now: int) -> None:
        """Execute a command that may be part of a polling loop."""
        error = self.last_error
        self._polling.meet(instruction, self.registers.contents(), self.executed, now)
        value = self._execute_command(instruction, address, now)
        self._polling.passed(value, now, refused=self.last_error is not error)

    def _catch_up(self, cycle: Cycle, now: int) -> None:
        """Bring a program that was not run while polling to just before what is due at `now`."""
        self._polling.leave()
        periods = (now - cycle.start) // cycle.period
        if periods < 0:
            return
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
