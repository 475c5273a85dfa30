"""Run control over a module at the end of a line, real or served, with what its firmware offers.

Run, stop, step and reset are control functions; the state and the counter are global parameters 128 and 130.
No command reads accumulator, X, flags and stack.  Nothing holds a program that runs by itself at a breakpoint, so while
there are breakpoints it goes on in single steps, as it does over and out of a CSUB: with the program memory at hand to
see calls and returns.

Source: manual 6.7.36, 8.1.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from typing import Final

from tmcm34x.debug.breaks import Wanted
from tmcm34x.debug.control import Breakpoint, Stop, StopControl
from tmcm34x.debug.expressions import ExpressionError
from tmcm34x.debug.sessions.base import Listener, SourceMap, StackFrame
from tmcm34x.debug.sessions.guest import Guest
from tmcm34x.debug.sessions.one_way import OneWay
from tmcm34x.debug.view import View
from tmcm34x.debug.watches import WatchedValue
from tmcm34x.host import Connection, HostError, Module, Program, RefusedError
from tmcm34x.host.program import ProgramState
from tmcm34x.tmcl.commands import BY_MNEMONIC
from tmcm34x.tmcl.datagram import Instruction

POLL_S: Final = 0.25
"""Time between two looks at a program that runs."""
STEP_POLL_S: Final = 0.002
"""Time between two looks at a step."""
HELD_POLL_S: Final = 1.0
"""Time between two looks at a program that stands: another host may start it."""

_CSUB: Final = BY_MNEMONIC["CSUB"].number
_RSUB: Final = BY_MNEMONIC["RSUB"].number
_STOP: Final = BY_MNEMONIC["STOP"].number
_RUNNING: Final = 1
_ON: Final = -math.inf
"""The goal of single steps that only a breakpoint or the end of the program ends."""


def _always() -> bool:
    return True


def _never(_instruction: Instruction) -> str:
    return ""


class RemoteSession(OneWay, Guest):
    """The program of the module at the other end of `connection`.

    Calls may raise `HostError`; call `work` as often as it asks for it while `running`.
    """

    steps_for_breakpoints = (
        "while there are breakpoints the program of a real module runs in single steps, slower than by itself"
    )
    unwatchable = "the firmware of a real module has no data breakpoints"
    foreign = False
    irreversible = "a real module has no history: only virtual time runs backwards"

    def __init__(self, connection: Connection, listener: Listener) -> None:
        self.connection = connection
        self.listener = listener
        self.program = Program(connection)
        self.text: SourceMap | None = None
        self._memory: Sequence[Instruction] = ()
        self.view = View(self.execute, self._write)
        self.control = StopControl(self.view.read, listener.said)
        self.permitted: Callable[[], bool] = _always
        """Asked before each further step: where it says no, the program is held."""
        self.refused: Callable[[Instruction], str] = _never
        """Asked before a value is written: why it may not be, empty where it may."""
        self.stop: Stop | None = None
        self.running = False
        self._counter = 0
        self._depth = 0
        """CSUBs entered since the step began, less those left."""
        self._goal: float | None = None
        """Single steps end when `_depth` is no more than this; None while the program runs by itself."""
        self.held_here = False
        """The program stands where this session has held it."""
        self.controlled()

    @property
    def model(self) -> int:
        """Type of the module: 341, 342 or 343; the module is asked."""
        return Module(self.connection).model

    def execute(self, instruction: Instruction) -> tuple[int, int]:
        """Have a command executed; a `HostError` where no answer comes."""
        try:
            reply = self.connection.execute(instruction)
        except RefusedError as error:
            return error.reply.status, error.reply.value
        return reply.status, reply.value

    def _write(self, instruction: Instruction) -> tuple[int, int]:
        if why := self.refused(instruction):
            raise ExpressionError(why)
        return self.execute(instruction)

    def frames(self) -> list[StackFrame]:
        """Where the program is; no command reads the open routines."""
        name = self.text.routine(self._counter) if self.text else ""
        location = self.text.location(self._counter) if self.text else None
        return [StackFrame(self._counter, name or "program", location)]

    def memory(self) -> Sequence[Instruction]:
        """The program memory, as far as it is known."""
        return self._memory

    def loaded(self, program: Sequence[Instruction]) -> None:
        """The program memory holds `program` now."""
        self._memory = program
        self.control.forget_hits()

    @property
    def counter(self) -> int:
        """The address at which the program was seen last."""
        return self._counter

    @property
    def in_steps(self) -> bool:
        """Whether the program goes on in single steps."""
        return self.running and self._goal is not None

    def instruction(self, address: int) -> Instruction | None:
        """The command at `address`, where it is known."""
        return self._memory[address] if 0 <= address < len(self._memory) else None

    def set_breakpoints(self, breakpoints: Iterable[Breakpoint]) -> None:
        """Hold at these from the next `resume` or `restart` on: see `steps_for_breakpoints`."""
        self.control.set_breakpoints(breakpoints)

    def hits(self) -> dict[int, int]:
        """How often each breakpoint was met, by its number."""
        return self.control.hits()

    def set_watches(self, watches: Iterable[WatchedValue]) -> None:
        """The firmware has none: see `unwatchable`."""

    def set_breaks(self, wanted: Wanted) -> None:
        """The firmware says nothing by itself: there are none."""

    def check_ready(self) -> None:
        """Whether the module answers is seen when it is asked."""

    def close(self) -> None:
        """End the run control; the program goes on."""

    def controlled(self) -> None:
        """The program may have been stopped, reset or started by another command: read its state."""
        stepping, state = self.in_steps, self.program.state
        self.running, self._counter, self._goal = state.status == _RUNNING, state.counter, None
        self.stop = None if self.running else Stop("pause", state.counter)
        self.held_here = False
        if stepping and self.stop is not None:
            self.listener.held(self.stop)

    def resume(self) -> None:
        """Let the program go on: by itself, or in single steps while there are breakpoints."""
        if self.control.idle:
            self.program.run()
            self._go(None)
        else:
            self._go(_ON)
            self.program.step()

    def restart(self) -> None:
        """Start the program from its beginning."""
        self.program.reset()
        self._counter = 0
        stop = self.control.look(0, 0)
        if stop is None:
            self.resume()
        else:
            self._hold(stop)

    def pause(self) -> None:
        """Stop the program where it is."""
        self.program.stop()
        self._counter = self.program.state.counter
        self._hold(Stop("pause", self._counter))

    def step_in(self) -> None:
        """Execute one command."""
        self._go(1)
        self.program.step()

    def step_over(self) -> None:
        """Execute one command, a CSUB with all that it calls, step by step."""
        self._go(0)
        self.program.step()

    def step_out(self) -> None:
        """Execute commands step by step until one more RSUB than CSUB was met."""
        self._go(-1)
        self.program.step()

    def jump(self, address: int) -> None:
        """Start the program at `address`, and stop it there: the firmware cannot move its counter."""
        raise ExpressionError(f"the module's firmware cannot go to address {address} without running")

    def restart_frame(self, number: int) -> None:
        """The firmware cannot: its counter does not move without running."""
        raise ExpressionError(f"the module's firmware cannot go back to routine {number}")

    def work(self) -> float:
        """Read the state of the program; returns in how many seconds to read it again."""
        if not self.running:
            self._look_for_others()
            return HELD_POLL_S
        before, state = self._counter, self.program.state
        if state.status and self._goal is not None:
            return STEP_POLL_S  # the counter was read after the status, and may be that behind the step
        self._counter = state.counter
        if state.status:
            return POLL_S
        stop = Stop("end", state.counter) if self._goal is None else self._after_step(self._goal, before)
        if stop is not None:
            self._hold(stop)
            return HELD_POLL_S
        self._step_on()
        return STEP_POLL_S

    def _look_for_others(self) -> None:
        """Another host may have started the program, or moved its counter; a module that is silent tells nothing."""
        with suppress(HostError):
            self._compare(self.program.state)

    def _compare(self, state: ProgramState) -> None:
        if state.status == _RUNNING or state.counter != self._counter:
            self.controlled()

    def _after_step(self, goal: float, before: int) -> Stop | None:
        """Why the program is held after the single step from `before`; None where another one follows."""
        self._count(before)
        if self._stops(before):
            return Stop("end", self._counter)
        if self._counter == before and self._ends(before, goal):
            return Stop("end" if goal == _ON else "step", before)
        met = self.control.look(self._counter, 0)
        return met or (Stop("step", self._counter) if self._depth <= goal else None)

    def _stops(self, address: int) -> bool:
        """Whether the command executed is a STOP: a further step would execute what stands behind it (PROG-8)."""
        executed = self.instruction(address)
        return executed is not None and executed.number == _STOP

    def _ends(self, address: int, goal: float) -> bool:
        """Whether the command that has left the counter where it was is the last one, and no jump to itself."""
        executed = self.instruction(address)
        return goal != _ON or executed is None or not executed.number

    def _step_on(self) -> None:
        """The next single step; by itself where no breakpoint is left to hold at."""
        if not self.permitted():
            self._hold(Stop("pause", self._counter))
        elif self._goal == _ON and self.control.idle:
            self.program.run()
            self._goal = None
        else:
            self.program.step()

    def _go(self, goal: float | None) -> None:
        self.stop = None
        self.held_here = False
        self.running = True
        self._goal, self._depth = goal, 0

    def _count(self, before: int) -> None:
        executed = self.instruction(before)
        if executed is None:
            return
        if executed.number == _CSUB and self._counter == executed.value:
            self._depth += 1
        elif executed.number == _RSUB and self._counter != before + 1:
            self._depth -= 1

    def _hold(self, stop: Stop) -> None:
        self.running = False
        self.held_here = stop.reason != "end"
        self.stop = stop
        self.listener.held(stop)
