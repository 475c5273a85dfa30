"""Run control over a module at the end of a line, real or served, with what its firmware offers.

Run, stop, step and reset are control functions; the state and the counter are global parameters 128 and 130.
No command reads accumulator, X, flags and stack, and nothing can hold the program at a breakpoint.  Stepping
over and out of a CSUB is done in single steps, with the program memory at hand to see calls and returns.

Source: manual 6.7.36, 8.1.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final

from tmcm34x.debug.breaks import Wanted
from tmcm34x.debug.control import Breakpoint, Stop
from tmcm34x.debug.expressions import ExpressionError
from tmcm34x.debug.sessions.base import NOTHING_TO_DO, Frame, Listener, Text
from tmcm34x.debug.sessions.one_way import OneWay
from tmcm34x.debug.view import View
from tmcm34x.debug.watches import Watch
from tmcm34x.host import Connection, Module, Program, RefusedError
from tmcm34x.tmcl.commands import BY_MNEMONIC
from tmcm34x.tmcl.datagram import Instruction

POLL_S: Final = 0.25
"""Time between two looks at a program that runs."""
STEP_POLL_S: Final = 0.002
"""Time between two looks at a step."""

_CSUB: Final = BY_MNEMONIC["CSUB"].number
_RSUB: Final = BY_MNEMONIC["RSUB"].number
_RUNNING: Final = 1


class RemoteSession(OneWay):
    """The program of the module at the other end of `connection`.

    Calls may raise `HostError`; call `work` as often as it asks for it while `running`.
    """

    unbreakable = "the firmware of a real module has no breakpoints: run, stop and step are what it offers"
    unwatchable = "the firmware of a real module has no data breakpoints"
    irreversible = "a real module has no history: only virtual time runs backwards"
    owns_time = False
    over = False
    exit_code = 0

    def __init__(self, connection: Connection, listener: Listener) -> None:
        self.connection = connection
        self.listener = listener
        self.program = Program(connection)
        self.text: Text | None = None
        self._memory: Sequence[Instruction] = ()
        self.view = View(self.execute, self.execute)
        self.stop: Stop | None = None
        self.running = False
        self._counter = 0
        self._depth = 0
        """CSUBs entered since the step began, less those left."""
        self._goal: int | None = None
        """A step ends when `_depth` is no more than this."""
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

    def frames(self) -> list[Frame]:
        """Where the program is; no command reads the open routines."""
        name = self.text.routine(self._counter) if self.text else ""
        location = self.text.location(self._counter) if self.text else None
        return [Frame(self._counter, name or "program", location)]

    def memory(self) -> Sequence[Instruction]:
        """The program memory, as far as it is known."""
        return self._memory

    def loaded(self, program: Sequence[Instruction]) -> None:
        """The program memory holds `program` now."""
        self._memory = program

    def instruction(self, address: int) -> Instruction | None:
        """The command at `address`, where it is known."""
        return self._memory[address] if 0 <= address < len(self._memory) else None

    def set_breakpoints(self, breakpoints: Iterable[Breakpoint]) -> None:
        """The firmware has none: see `unbreakable`."""

    def set_watches(self, watches: Iterable[Watch]) -> None:
        """The firmware has none: see `unwatchable`."""

    def set_breaks(self, wanted: Wanted) -> None:
        """The firmware says nothing by itself: there are none."""

    def begin(self, *, hold: bool) -> None:
        """Take the program as it is; stop it if asked for."""
        if self.running and hold:
            self.pause()
        elif not self.running:
            self.listener.held(self.stop or Stop("pause", 0))

    def epilogue(self) -> str:
        """Nothing: the program goes on when the session ends."""
        return ""

    def check_ready(self) -> None:
        """Whether the module answers is seen when it is asked."""

    def close(self) -> None:
        """End the run control; the program goes on."""

    def controlled(self) -> None:
        """The program may have been stopped, reset or started by another command: read its state."""
        state = self.program.state
        self.running, self._counter, self._goal = state.status == _RUNNING, state.counter, None
        self.stop = None if self.running else Stop("pause", state.counter)

    def resume(self) -> None:
        """Let the program go on."""
        self.program.run()
        self._go(None)

    def restart(self) -> None:
        """Start the program from its beginning."""
        self.program.restart()
        self._go(None)

    def pause(self) -> None:
        """Stop the program where it is."""
        self.program.stop()
        self._held("pause")

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
            return NOTHING_TO_DO
        before, state = self._counter, self.program.state
        self._counter = state.counter
        if state.status:
            return POLL_S if self._goal is None else STEP_POLL_S
        if self._goal is None:
            self._held("end")
            return NOTHING_TO_DO
        self._count(before)
        if self._depth <= self._goal or state.counter == before:
            self._held("step")
            return NOTHING_TO_DO
        self.program.step()
        return STEP_POLL_S

    def _go(self, goal: int | None) -> None:
        self.stop = None
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

    def _held(self, reason: str) -> None:
        self.running = False
        self._counter = self.program.state.counter
        kind = "end" if reason == "end" else "step" if reason == "step" else "pause"
        self.stop = Stop(kind, self._counter)
        self.listener.held(self.stop)
