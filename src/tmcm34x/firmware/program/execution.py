"""A program at work: when its next event is, and what is done then.

One instruction takes `FirmwareModule.instruction_clocks` and has its effect at their end.  Register commands run in
`machine`, many at a time; everything else goes through the module's dispatcher, as a host's command would,
with the one difference that a value read goes into the accumulator.

What others could notice comes at an event of its own: before promising when that is, the program runs its
register commands ahead on a copy (`ahead`).  A program that goes round in a cycle, in registers alone or polling for
what cannot change yet (`polling`), is not run at all until something else happens, and is then put where it would be.

A command that the module refuses has no effect; the program goes on with the next one and `last_error` tells
of it.  Erased memory (command 0) and the end of the memory stop the program.

Source: manual 2.1, 6.3, 6.4.4, 6.4.5, 6.7.16 to 6.7.32; fidelity PROG-6 to PROG-14.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from tmcm34x.clock import NEVER
from tmcm34x.firmware.dispatch import execute_in_program
from tmcm34x.firmware.program import wait
from tmcm34x.firmware.program.ahead import Ahead
from tmcm34x.firmware.program.counts import AddressCounts
from tmcm34x.firmware.program.hooks import Ask, Hooks
from tmcm34x.firmware.program.machine import Machine
from tmcm34x.firmware.program.memory import Memory
from tmcm34x.firmware.program.module_commands import PROGRAM_ONLY, STOP, WAIT, misuse, reads
from tmcm34x.firmware.program.moving import Following, Pursuit
from tmcm34x.firmware.program.polling import Cycle, CycleSearch
from tmcm34x.firmware.program.registers import ERROR_FLAGS, Registers
from tmcm34x.firmware.program.state import ProgramError, RunState
from tmcm34x.firmware.program.wait import Wait
from tmcm34x.tmcl.commands import USER_VARIABLES
from tmcm34x.tmcl.datagram import END_MARK, Instruction
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.firmware.state import ModuleState


class Execution:
    """The program of a module: its state, and how time changes it."""

    def __init__(self, module: ModuleState) -> None:
        self._module = module
        self.registers = Registers([0] * USER_VARIABLES)
        self.memory = Memory(module.eeprom)
        self.state = RunState.STOP
        self.last_error: ProgramError | None = None
        """The last command that was refused, since the program was started or reset."""
        self.executed = 0
        """Commands executed since power-on."""
        self.controls = 0
        """Number of starts, stops and resets from outside the program."""
        self.wait: Wait | None = None
        """The WAIT that is being executed."""
        self.on_refusal: list[Callable[[], bool]] = []
        """Called after a command was refused, with `last_error` saying which; any true stops the program there."""
        self._hooks = Hooks()
        self._machine = Machine(self.memory.__getitem__)
        self._due = NEVER
        """Clock at which the command at the counter has its effect."""
        self._started_at = 0
        """`executed` when the program was started."""
        self._ahead = Ahead(self._machine)
        self._polling = CycleSearch(module)
        self._following = Following(module, self._machine)
        self._pins_changed = False
        """Since the last event, while the program is active; the module has its next event one clock later."""
        module.circuit.on_pins.append(self._note_pins)

    @property
    def active(self) -> bool:
        """Whether the program runs or makes a step."""
        return self.state in {RunState.RUN, RunState.STEP}

    @property
    def waiting(self) -> bool:
        """Whether a WAIT is being executed."""
        return self.wait is not None

    @property
    def cycle(self) -> Cycle | None:
        """The cycle that the program repeats until something outside acts; None where none is known yet."""
        cycle = None if self._pins_changed else self._polling.cycle
        return cycle if cycle is not None and cycle.start <= self._module.now else None

    @property
    def counts(self) -> AddressCounts | None:
        """Where executed commands are counted, if they are."""
        return self._machine.counts

    def count(self, counts: AddressCounts | None) -> None:
        """Count executed commands in `counts` from now on; polling loops are then executed too.

        The former counts, if any, are complete when they are replaced: None counts no longer.
        """
        self.wake()
        self._machine.count(counts)

    @property
    def hooked(self) -> bool:
        """Whether an observer checks commands before they are executed."""
        return self._hooks.wanted

    def hook(self, ask: Ask, addresses: frozenset[int] | None = None) -> None:
        """Have `ask` asked with the address of each command about to be executed; true stops the program there.

        It is not asked for the command that the program is started at.  With `addresses` it is asked only for
        those, and the others run as fast as ever; a second call changes them.
        """
        self._hooks.put(ask, addresses)
        self._guard()

    def unhook(self, ask: Ask) -> None:
        """Ask no more, if it was asked."""
        if self._hooks.drop(ask):
            self._guard()

    def raise_error(self, flag: str) -> None:
        """Set one of the flags ETO, EAL, EDV, EPO, ESD."""
        self.wake()
        self.registers.errors |= ERROR_FLAGS[flag]

    def wake(self) -> None:
        """Take notice that something a program may look at changes, here and now."""
        self._ahead.begin(self.executed)
        self._polling.forget(self._module.now)
        self._following.pursuit = None

    # Time

    def next_event(self) -> int:
        """The next clock at which the program has an effect outside itself."""
        if not self.state:
            return NEVER
        if self.wait is not None:
            return self.wait.limit
        if self.state is RunState.STEP or self._watched:
            return self._due
        if self._following.pursuit is not None:
            return self._following.pursuit.due
        cycle = self._polling.cycle
        if cycle is not None and self.counts is None:
            return cycle.start if self._module.now < cycle.start else cycle.until
        return self._ahead.until or self._look_ahead()

    def foresee(self, now: int) -> None:
        """Ask for what is to be read before `now`, to which the motion chips are brought next."""
        if self._following.pursuit is not None:
            self._following.pursuit.foresee(now)

    def advance(self, now: int, disturbed: bool = False) -> None:
        """Execute everything that is due up to `now`; the program runs, the module's chips and pins are already there.

        disturbed: something besides the program had an event at `now`
        """
        if self.wait is not None:
            self._check_wait(self.wait, now)
        elif self._following.pursuit is not None:
            self._follow(self._following.pursuit, now)
        elif not self._watched:
            self._catch_up(now, None if self.counts is not None else self._polling.cycle)
        if disturbed or self._polling.expired(now):
            self._polling.leave()
            self._following.pursuit = None
        while self._due <= now:
            self._execute_due(now)
        if self._pins_changed:
            self._pins_changed = False
            self.wake()

    @property
    def _watched(self) -> bool:
        """Whether an observer follows each single command."""
        if any(observer.instruction is not None for observer in self._module.observers):
            return True
        return self._hooks.everywhere

    def _note_pins(self) -> None:
        self._pins_changed = bool(self.state)

    def _guard(self) -> None:
        self.wake()
        self._machine.guard(self._hooks.addresses)

    def _start(self, state: RunState) -> None:
        self.wake()
        self._pins_changed = False
        self.state = state
        if self.wait is None:
            self._machine.invalidate()
            self.last_error = None
            self._started_at = self.executed
            self._due = self._module.now + self._module.instruction_clocks

    def _halt(self) -> None:
        self.wake()
        self.state = RunState.STOP
        self.wait = None
        self._due = NEVER
        self._ahead.shorten()

    def _execute_due(self, now: int) -> None:
        """Execute the register commands due up to `now`, then at most one module command."""
        clocks = self._module.instruction_clocks
        room = (now - self._due) // clocks + 1
        single = self._watched or self.state is RunState.STEP
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
            self._execute_module_command(now)
        if self.state is RunState.STEP and self.wait is None:
            self._halt()

    @property
    def _guarded(self) -> bool:
        """Whether an observer checks the command at the counter before it is executed."""
        return self.registers.counter in self._machine.guarded

    def _pauses(self, now: int) -> bool:
        """Tell those who watch of the command to come; whether one of them stops the program before it."""
        address = self.registers.counter
        if self._hooks.wanted and self.executed != self._started_at and self._hooks.stop(address):
            self._halt()
            return True
        for observer in self._module.observers:
            if observer.instruction is not None:
                observer.instruction(address, self.memory[address], now)
        return False

    def _execute_module_command(self, now: int) -> None:
        address = self.registers.counter
        instruction = self.memory[address]
        guarded = self._guarded
        self._following.meet()
        if self.counts is not None:
            self.counts.module_command(address, now)
        if guarded and self._machine.pass_guard(self.registers):
            self._polling.forget(now)
            self.executed += 1
            self._due = now + self._module.instruction_clocks
        elif instruction.number == WAIT:
            self._begin_wait(instruction, address, now)
        elif instruction.number == STOP:
            self._go_on(address, now)
            self._halt()
        elif instruction.number == END_MARK.number:
            self.last_error = ProgramError(address, Status.INVALID_COMMAND)
            self._halt()
        elif instruction.number in PROGRAM_ONLY:
            self._refuse(address, misuse(instruction), now)
        elif not guarded and self._polling.repeats(instruction, self.registers.accumulator, now):
            self._poll(instruction, address, now)
        else:
            self._polling.forget(now)
            value = self._execute_command(instruction, address, now)
            if value is not None and self.counts is None and not guarded and not self._watched:
                self._following.passed(instruction, self.registers, self.executed, value, now)
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
        status, value = execute_in_program(self._module, instruction)
        if status != Status.OK:
            self._tell_refusal(address, Status(status))
            return None
        if not reads(instruction):
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
        if self.counts is not None:
            self.counts.done_waiting(self.registers.counter, now)
        self._go_on(self.registers.counter, now)
        self._ahead.begin(self.executed)
        if self.state is RunState.STEP:
            self._halt()

    # Running ahead, and not running at all

    def _look_ahead(self) -> int:
        """Find the next event by running register commands on a copy."""
        clocks, searching = self._module.instruction_clocks, self._polling.cycle is None
        cycle = self._ahead.look(self.registers, self.executed, self._due, clocks, searching=searching)
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

    def _follow(self, pursuit: Pursuit, now: int) -> None:
        """Bring a program that follows a motor to just before what is due at `now`."""
        for reading in pursuit.take():
            if reading.first:
                self.registers.restore(pursuit.contents)
                self.executed = reading.executed
            else:
                self._run_until(reading.when)
            self._polling.forget(reading.when)
            self._go_on(self.registers.counter, reading.when)
            self.registers.load(reading.value)
            self._ahead.begin(self.executed)
        self._run_until(now)

    def _run_until(self, now: int) -> int:
        """Execute register commands before `now`, and no other; how many more could have been."""
        clocks = self._module.instruction_clocks
        room = -((self._due - now) // clocks)
        done = self._machine.run(self.registers, room)
        self.executed += done
        self._due += done * clocks
        return room - done

    def _catch_up(self, now: int, cycle: Cycle | None) -> None:
        """Bring a program that was not run to just before what is due at `now`; cycle: that it has gone round in."""
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
        for value in (*cycle.values, None):
            if not self._run_until(now):
                return
            self._go_on(self.registers.counter, self._due)
            self._ahead.begin(self.executed)
            if value is not None:
                self.registers.load(value)
