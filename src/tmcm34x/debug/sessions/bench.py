"""Run control over a program on a bench of the session's own, in virtual time.

Holding a program holds the whole bench: at a breakpoint the motors stand still in mid-motion, just before the clock
at which the command would have its effect.  Nothing is disturbed: a run that was held anywhere, inspected and
continued ends like one that was not (fidelity DBG-1).  Commands without a breakpoint run at full speed, unless a step
is under way.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Final, Protocol

from tmcm34x.clock import MS, NEVER, Timed
from tmcm34x.debug.branches import HistoryError
from tmcm34x.debug.breaks import error_text
from tmcm34x.debug.control import Stop
from tmcm34x.debug.history import History
from tmcm34x.debug.reverse import Here
from tmcm34x.debug.sessions.backward import BEFORE_COMMANDS, Backward
from tmcm34x.debug.sessions.base import NOTHING_TO_DO, Listener, SourceMap
from tmcm34x.debug.sessions.local import LocalSession

if TYPE_CHECKING:
    from tmcm34x.bench import Rig
    from tmcm34x.firmware.module import FirmwareModule
    from tmcm34x.tmcl.datagram import Instruction

REFUSED: Final = 3
"""Exit code of a run in which the module refused a command."""
SLICE_S: Final = 0.02
"""Longest work between two requests [s]."""
MAX_LAG_S: Final = 1.0
"""A bench that lags more than this behind the wall clock does not catch up [s]."""


class Pacing(Protocol):
    """How virtual time follows the wall clock: `server.pace.Pace` is one."""

    monotonic: Callable[[], float]

    def draw(self, now: int) -> None:
        """Begin a new line here."""
        ...

    def target(self) -> int:
        """The clock that virtual time should show now."""
        ...

    def due_s(self, when: int) -> float:
        """The wall clock's time at which `when` is due [s]."""
        ...


def at_rest(module: FirmwareModule) -> bool:
    """Whether each motor goes on as it does now: it stands, turns evenly, or is held by a switch."""
    if any(axis.search for axis in module.axes):
        return False
    return module.board.next_event() >= NEVER or all(axis.steady for axis in module.axes)


def _never() -> bool:
    return False


class BenchSession(Backward, LocalSession):
    """A program on a bench whose time this session moves.

    The program is held from the start: `start`, then `resume` or a step, then `advance` as long as `running`; or
    `begin`, then `work` as often as it asks for it, with a `pace`.
    """

    owns_time = True

    def __init__(
        self,
        rig: Rig,
        listener: Listener,
        text: SourceMap | None = None,
        *,
        module: int = 0,
        pace: Pacing | None = None,
        keeps_history: bool = False,
    ) -> None:
        super().__init__(rig.modules[module], rig.worlds[module], listener, text)
        self.rig = rig
        self.pace = pace
        self.history: History | None = None
        """What the program can be taken back to; None until it is started, and unless the session keeps it."""
        self._keeps_history = keeps_history
        self._number = module
        self.running = False
        self.over = False
        self._passed = NEVER
        """The clock of the command before which the program was last held."""

    def start(self, address: int = 0, *, hold: bool = True) -> None:
        """Start the program, and by default hold it before its first command."""
        self.program.run(address)
        self.breaks.look_again()
        self._begin_history()
        if hold:
            self.control.step(None, "entry")
        self.resume()
        if hold:
            self.advance(NEVER)

    def _begin_history(self) -> None:
        if self.history is not None:
            self.history.close()
            self.view.on_write.remove(self._note_assignment)
        if not self.irreversible:
            self.history = History(self.rig)
            self.view.on_write.append(self._note_assignment)

    def _note_assignment(self, target: str, value: int) -> None:
        if self.history is not None:
            self.history.record("assignment", self._number, (target, value))

    def execute(self, instruction: Instruction) -> tuple[int, int]:
        """Execute a command in direct mode; it is part of the history."""
        result = super().execute(instruction)
        if self.history is not None:
            self.history.record("command", self._number, tuple(instruction))
        return result

    @property
    def irreversible(self) -> str:
        """Why the program cannot be taken back; empty where it can."""
        if self.module.user_functions:
            return "user functions in Python may have state that no snapshot contains"
        return "" if self._keeps_history else "this session keeps no history"

    @property
    def _time(self) -> Timed:
        """What moves the bench: its history, where there is one."""
        return self.history or self.rig

    def begin(self, *, hold: bool) -> None:
        """Start the program; hold it before its first command if asked for."""
        self._draw()
        self.start(hold=hold)

    @property
    def exit_code(self) -> int:
        """3 when a command of the program was refused; otherwise 0."""
        return REFUSED if self.program.last_error is not None else 0

    def epilogue(self) -> str:
        """How the program ended, in one line."""
        error = self.program.last_error
        ending = "was stopped" if self.program.active else "has ended"
        text = f"The program {ending} after {self.rig.now / MS:.0f} ms of the module's time"
        return f"{text}." if error is None else f"{text}: {error_text(self.module, error)}"

    def check_ready(self) -> None:
        """A bench of the session's own is always ready."""

    def close(self) -> None:
        """End the run control; the bench stays as it is."""
        self.set_breakpoints([])
        self.breaks.close()
        self.running = False

    # Going on

    def resume(self) -> None:
        """Let time go on until something holds it."""
        self._draw()
        self._stop = None
        self.running = not self.over
        self._attach()

    def restart(self) -> None:
        """Start the program from its beginning, on the bench as it is."""
        self.start(hold=False)

    def step_in(self) -> None:
        """Execute one command."""
        self._step(None)

    def step_over(self) -> None:
        """Execute one command, a CSUB with all that it calls."""
        self._step(len(self.program.stack))

    def step_out(self) -> None:
        """Go on until the innermost CSUB has returned; from the outermost level, until something else holds."""
        depth = len(self.program.stack)
        if depth:
            self._step(depth - 1)
        else:
            self.resume()

    def pause(self) -> None:
        """Hold everything here and now."""
        self._catch_up()
        if self.running:
            self.control.clear_step()
            self._hold(Stop("pause", self.program.counter))

    def jump(self, address: int) -> None:
        """Have the program go on at `address`; raises `ExpressionError` in the middle of a WAIT."""
        self.view.assign("counter", str(address))

    # Going back

    def go_to(self, clock: int) -> None:
        """Bring everything back to `clock`, and hold there; raises `HistoryError` where that cannot be reached."""
        self._go_back(clock, Stop("goto", -1))

    def _known_history(self) -> History:
        if self.history is None:
            raise HistoryError(self.irreversible or "the program has not been started")
        return self.history

    def _here(self) -> Here:
        history = self._known_history()
        return Here.of(self.rig, history.looking, history.branch, self._number)

    def _go_back(self, clock: int, stop: Stop) -> None:
        self._known_history().return_to(clock)
        self.over = False
        self._passed = clock + 1 if stop.reason in BEFORE_COMMANDS else NEVER
        self.breaks.look_again()
        self.watches.look_again()
        self.control.clear_step()
        self._hold(stop._replace(address=self.program.counter))

    def _step(self, depth: int | None) -> None:
        self.control.step(depth)
        self.resume()

    # Time

    def work(self) -> float:
        """Let virtual time follow the wall clock for a slice; returns in how many seconds to call again."""
        pace = self.pace
        if pace is None or not self.running:
            return NOTHING_TO_DO
        end_s = pace.monotonic() + SLICE_S
        reached = self.advance(pace.target(), lambda: pace.monotonic() >= end_s)
        if not self.running:
            return NOTHING_TO_DO
        due_s = pace.due_s(self.rig.now if not reached else self.rig.next_event())
        if not reached:
            if pace.monotonic() - due_s > MAX_LAG_S:
                pace.draw(self.rig.now)
            return 0.0
        if self.rig.next_event() >= NEVER:
            return NOTHING_TO_DO
        return max(0.0, due_s - pace.monotonic())

    def _draw(self) -> None:
        """Virtual time goes on from here, at its pace."""
        if self.pace is not None:
            self.pace.draw(self.rig.now)

    def _catch_up(self) -> None:
        """Bring the bench to where the pace says it is, within a slice of work."""
        pace = self.pace
        if pace is None or not self.running:
            return
        end_s, now = pace.monotonic() + SLICE_S, pace.target()
        if now < NEVER:
            self.advance(now, lambda: pace.monotonic() >= end_s)

    def advance(self, until: int, interrupted: Callable[[], bool] = _never) -> bool:
        """Let time go on to `until`, unless something holds it before; whether it got that far or was held.

        interrupted: asked after each event whether to break off
        """
        rig = self.rig
        while self.running and not self._ends():
            when = min(self._time.next_event(), self.watches.next_event())
            if when > until or when >= NEVER:
                if rig.now < until < NEVER:
                    self._time.advance(until)
                break
            if self._holds_before(when):
                break
            self._time.advance(when)
            self._look_back()
            if interrupted():
                return not self.running
        return True

    def _holds_before(self, when: int) -> bool:
        """Whether the next command, if it is due at `when`, is one to hold before; the bench is then just there."""
        program = self.program
        if self.control.idle or when == self._passed or program.waiting or not program.active:
            return False
        if program.next_event() != when or not self.control.concerns(program.upcoming):
            return False
        if self.rig.now < when - 1:
            self._time.advance(when - 1)
        stop = self.control.look(program.counter, len(program.stack))
        if stop is None:
            return False
        self._passed = when
        self._hold(stop)
        return True

    def _look_back(self) -> None:
        broken, changed = self.breaks.look(self.program.counter), self.watches.look(self.program.counter)
        if (stop := broken or changed) is not None:
            self.control.clear_step()
            self._hold(stop)

    def _ends(self) -> bool:
        """Whether nothing is going on any more; tells of it once."""
        if self.program.active:
            return False
        if not (at_rest(self.module) if self.module.powered else self.rig.next_event() >= NEVER):
            return False
        self.running = False
        self.over = True
        self.listener.ended()
        return True

    def _hold(self, stop: Stop) -> None:
        self._stop = stop
        self.running = False
        self._attach()
        self.listener.held(stop)

    def _attach(self) -> None:
        """Have the program pause before the commands that matter; this session asks `control` by itself."""
        each = bool(self.watches) or self.breaks.each_command
        if self.control.idle and not each:
            self.program.unhook(_let_pass)
        else:
            self.program.hook(_let_pass, None if each else self.control.addresses)


def _let_pass(_: int) -> bool:
    return False
