"""The stand-alone program: run, step, stop, download, and the commands that only a program has.

One instruction takes `Module.instruction_clocks` and has its effect at their end.  Register commands run in
`machine`, many at a time; everything else goes through the module's dispatcher, as a host's command would,
with the one difference that a value read goes into the accumulator.

What others could notice comes at an event of its own: before promising when that is, the program runs its
register commands ahead on a copy.  A program that polls - reads something that cannot change before somebody
else's next event, and comes back to the very same state - is not run at all until that event, and is then put
where it would be.

A command that the module refuses has no effect; the program goes on with the next one and `last_error` tells
of it.  Erased memory (command 0) and the end of the memory stop the program.

Source: manual 2.1, 6.3, 6.4.4, 6.4.5, 6.7.16 to 6.7.32, 6.7.36; fidelity PROG-1 to PROG-20.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum
from typing import TYPE_CHECKING, Final, NamedTuple

from tmcm34x.board.board import INPUTS, Board
from tmcm34x.clock import MS, NEVER
from tmcm34x.firmware.io import ANALOG_INPUTS, DIGITAL_INPUTS
from tmcm34x.firmware.machine import ERROR_FLAGS, Machine, Registers
from tmcm34x.firmware.motion import A_ACTUAL, V_ACTUAL, V_TARGET
from tmcm34x.tmcl import axis_parameters
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
from tmcm34x.tmcl.global_parameters import GLOBAL_PARAMETERS
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.firmware.module import Module

TICK: Final = 10 * MS
"""One tick of WAIT (manual 6.7.22)."""

_RAMP_TICK: Final = 32
"""Clocks of a ramp tick at ramp divisor 0."""
_END: Final = Instruction(0)
_STOP: Final = BY_MNEMONIC["STOP"].number
_WAIT: Final = BY_MNEMONIC["WAIT"].number
_WAITS: Final = dict(WAIT_TYPES)
_GAP: Final = BY_MNEMONIC["GAP"].number
_GGP: Final = BY_MNEMONIC["GGP"].number
_GIO: Final = BY_MNEMONIC["GIO"].number
_GCO: Final = BY_MNEMONIC["GCO"].number
_RFS: Final = BY_MNEMONIC["RFS"].number
_RFS_STATUS: Final = dict(RFS_TYPES)["STATUS"]
_PROGRAM_ONLY: Final = frozenset(row.number for row in BY_MNEMONIC.values() if "direct" not in row.where)
_READING: Final = frozenset(row.number for row in BY_MNEMONIC.values() if "reads" in row.where)
_POLLS: Final = frozenset(BY_MNEMONIC[name].number for name in ("GIO", "GCO", "SIO"))
"""Commands that change nothing when repeated before anything else happens."""
_SETTINGS: Final = frozenset(
    row.number for row in axis_parameters.AXIS_PARAMETERS if row.stored or row.key in {
        "target_position", "position_reached", "reference_switch", "left_switch", "right_switch", "ramp_mode",
        "end_switch_distance", "group_index",
    }
)  # fmt: skip
"""Axis parameters that change only when somebody does something, or at an event of the motion chip."""
_ACTUAL_ACCELERATION: Final = axis_parameters.BY_KEY["actual_acceleration"].number
_ACTUAL_POSITION: Final = axis_parameters.BY_KEY["actual_position"].number
_MOVING: Final = frozenset(
    axis_parameters.BY_KEY[key].number
    for key in ("actual_position", "target_speed", "actual_speed", "actual_acceleration")
)
"""Axis parameters that follow the motion."""
_RESTLESS_GLOBALS: Final = frozenset(
    row.number for row in GLOBAL_PARAMETERS if row.key in {
        "datagram_low_word", "datagram_high_word", "program_counter", "tick_timer", "random_number",
    }
)  # fmt: skip
"""Global parameters that change by themselves."""
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


class _Cycle(NamedTuple):
    """A state that comes back every `period` clocks from `start` on, as long as nobody else acts."""

    contents: tuple[object, ...]
    start: int
    executed: int
    """Value of `Program.executed` at `start`."""
    period: int
    commands: int
    """Executed in one period."""
    values: tuple[int | None, ...]
    """What the foreign commands of one period read, in order."""
    until: int = NEVER
    """The clock at which something read may be another by itself."""


class _Anchor:
    """A state before a reading command, to compare later ones with, and what was read since."""

    def __init__(self, contents: tuple[object, ...], start: int, executed: int, horizon: int) -> None:
        self.contents = contents
        self.start = start
        self.executed = executed
        self.horizon = horizon
        """The next event on the board then: nothing read changes before."""
        self.until = NEVER
        """The clock at which something read since may be another by itself."""
        self.values: list[int | None] = []
        self.patience = 1
        """Reading commands after which another anchor is tried; doubles each time."""


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
        self.before_instruction: Callable[[int], bool] | None = None
        """Asked with the address of each command about to be executed, but not of the one that the program is
        started at; true stops the program before it."""
        self._machine = Machine(self._read_instruction)
        self._due = NEVER
        """Clock at which the command at the counter has its effect."""
        self._started = False
        """No command has been executed since the program was started."""
        self._wait: _Wait | None = None
        self._download_address = 0
        self._ahead = Registers([0] * USER_VARIABLES)
        self._ahead_until = 0
        """Clock of the next event found by running ahead; 0: not known."""
        self._ahead_commands = 0
        self._run = _SHORT_RUN
        self._probed = False
        """The register commands ahead have been searched for a cycle in vain."""
        self._cycle: _Cycle | None = None
        self._anchor: _Anchor | None = None
        self._pins_changed = False
        self._disturbed = 0
        """Clock of the last command that may have made the motion chip take another way, from its next ramp tick on."""
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

    def raise_error(self, flag: str) -> None:
        """Set one of the flags ETO, EAL, EDV, EPO, ESD."""
        self.wake()
        self.registers.errors |= ERROR_FLAGS[flag]

    def wake(self) -> None:
        """Take notice that something a program may look at changes, here and now."""
        self._ahead_until = 0
        self._probed = False
        self._cycle = self._anchor = None
        self._disturbed = self._module.now

    # Control functions

    def run(self, address: int | None = None) -> Status:
        """Start the program where it stands, or at `address` with an empty stack (129)."""
        if address is not None:
            if not 0 <= address < PROGRAM_SIZE:
                return Status.INVALID_VALUE
            self.stop()
            self.registers.counter = address
            self.registers.stack.clear()
        if self.state is not State.RUN:
            self._start(State.RUN)
        return Status.OK

    def step(self) -> Status:
        """Execute one command and stop again (130)."""
        self._start(State.STEP)
        return Status.OK

    def stop(self) -> Status:
        """Stop the program where it stands (128)."""
        self._halt()
        return Status.OK

    def reset(self) -> Status:
        """Stop, and bring counter, stack, registers and flags to their initial state (131)."""
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
        if self._cycle is not None:
            return self._cycle.until
        return self._ahead_until or self._look_ahead()

    def advance(self, now: int) -> None:
        """Execute everything that is due up to `now`; the module's chips and pins are already there."""
        if not self.state:
            return
        if self._cycle is not None:
            self._catch_up(self._cycle, now)
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
        return self.before_instruction is not None or (
            observer is not None and observer.instruction is not None
        )

    @property
    def _protection(self) -> int:
        return self._module.eeprom.global_values[81]

    def _read_instruction(self, address: int) -> Instruction:
        return self._module.eeprom.read_instruction(address)

    def _note_pins(self) -> None:
        self._pins_changed = True

    def _start(self, state: State) -> None:
        self.wake()
        self._machine.invalidate()
        self.last_error = None
        self.state = state
        self._started = True
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
        if self._watched or self.state is State.STEP:
            if self._pauses(now):
                return
            room = 1
        done = self._machine.run(self.registers, room)
        self.executed += done
        self._due += done * clocks
        if done < room:
            self._execute_foreign(now)
        self._started = False
        if self.state is State.STEP and self._wait is None:
            self._halt()

    def _pauses(self, now: int) -> bool:
        """Tell those who watch of the command to come; whether one of them stops the program before it."""
        address = self.registers.counter
        hook = self.before_instruction
        if hook is not None and not self._started and hook(address):
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
        if instruction.number == _WAIT:
            self._begin_wait(instruction, address, now)
        elif instruction.number == _STOP:
            self._go_on(address, now)
            self._halt()
        elif instruction.number == _END.number:
            self.last_error = ProgramError(address, Status.INVALID_COMMAND)
            self._halt()
        elif instruction.number in _PROGRAM_ONLY:
            self._refuse(address, _misuse(instruction), now)
        elif self._constant(instruction):
            self._poll(instruction, address, now)
        else:
            self._anchor = None
            self._disturbed = now
            self._execute_command(instruction, address, now)

    def _go_on(self, address: int, now: int) -> None:
        """The command at `address` is done."""
        self.executed += 1
        self.registers.counter = address + 1
        self._due = now + self._module.instruction_clocks

    def _refuse(self, address: int, status: Status, now: int) -> None:
        self.last_error = ProgramError(address, status)
        self._go_on(address, now)

    def _execute_command(self, instruction: Instruction, address: int, now: int) -> int | None:
        """Let the module execute a command; gives back the value read, if it reads one."""
        self._go_on(address, now)
        status, value = self._module.execute_in_program(instruction)
        if status != Status.OK:
            self.last_error = ProgramError(address, Status(status))
            return None
        if not _reads(instruction):
            return None
        self.registers.load(value)
        return value

    # WAIT

    def _begin_wait(self, instruction: Instruction, address: int, now: int) -> None:
        _, kind, motor, ticks = instruction
        self._anchor = None
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
            return lambda: axis.at_target
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
                    self._cycle = _Cycle(contents, start, executed, period * clocks, period, ())
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

    def _constant(self, instruction: Instruction) -> bool:
        """Whether executing the command again before the board's next event has no effect and the same result."""
        number, type_, motor, _ = instruction
        if number == _GAP:
            return type_ in _SETTINGS or (type_ in _MOVING and motor < MOTORS and self._steady(type_, motor))
        if number == _GGP:
            return type_ not in _RESTLESS_GLOBALS
        if number == _RFS:
            return type_ == _RFS_STATUS
        if number == _GIO and motor == ANALOG_INPUTS:
            return type_ < INPUTS and self._module.board.steady(type_)
        return number in _POLLS

    def _steady(self, parameter: int, motor: int) -> bool:
        """Whether an axis parameter that belongs to the motion keeps its value until the chip's next event."""
        axis = self._module.axes[motor]
        speed = axis.read(V_ACTUAL)
        ramp_tick = _RAMP_TICK << axis.values[153]
        if speed != axis.read(V_TARGET) or self._module.now - self._disturbed <= ramp_tick:
            return False
        if parameter == _ACTUAL_ACCELERATION:
            return not axis.read(A_ACTUAL)
        return not speed or parameter != _ACTUAL_POSITION

    def _poll(self, instruction: Instruction, address: int, now: int) -> None:
        """Execute a command that may be part of a polling loop; find out whether the loop is closed."""
        board = self._module.board
        until = _next_edge(board, instruction)
        contents, horizon, outputs = self.registers.contents(), board.next_event(), board.outputs
        anchor, cycle = self._anchor, None
        if anchor is None or anchor.horizon != horizon or anchor.until <= now:
            anchor = _Anchor(contents, now, self.executed, horizon)
        elif anchor.contents == contents:
            cycle = _Cycle(
                contents, anchor.start, anchor.executed, now - anchor.start, self.executed - anchor.executed,
                tuple(anchor.values), anchor.until,
            )  # fmt: skip
        elif len(anchor.values) == anchor.patience:
            patience = 2 * anchor.patience
            anchor = _Anchor(contents, now, self.executed, horizon)
            anchor.patience = patience
        error = self.last_error
        value = self._execute_command(instruction, address, now)
        anchor.values.append(value)
        anchor.until = min(anchor.until, until)
        steady = until > now and board.outputs == outputs and self.last_error is error
        self._anchor = anchor if steady else None
        if steady and cycle is not None and cycle.values[0] == value and not self._watched:
            self._cycle = cycle

    def _catch_up(self, cycle: _Cycle, now: int) -> None:
        """Bring a program that was not run while polling to just before what is due at `now`."""
        self._cycle = self._anchor = None
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


def _next_edge(board: Board, instruction: Instruction) -> int:
    """The next clock at which a digital input that GIO reads may change by itself; 0: not known."""
    number, port, bank, _ = instruction
    if number != _GIO or bank != DIGITAL_INPUTS:
        return NEVER
    if port < INPUTS:
        return board.next_edge(port)
    return min(map(board.next_edge, range(INPUTS)))
