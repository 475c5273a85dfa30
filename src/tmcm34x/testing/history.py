r"""The past of a bench, for tests and tools: run on to a condition, go back, ask what wrote a value.

    rig = tmcm34x.simple_rig()
    history = tmcm34x.History(rig)
    history.load("Loop: SGP 3, 2, 7\n WAIT TICKS, 0, 5\n JA Loop\n", run=True)
    reached = history.until("gp[3] == 7")
    history.back_to(reached - 1)
    assert history.last_write("gp[3]") is None

What is done to the bench from outside must be done by `Rig.act`, by the methods here, or over lines of a
`VirtualModule`: what a history has not seen is not there when the past is run again.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Final, Protocol, TypeVar

from tmcm34x.clock import clocks, run_until, seconds
from tmcm34x.debug.branches import HistoryError
from tmcm34x.debug.conditions import Condition
from tmcm34x.debug.history import LIMIT
from tmcm34x.debug.history import History as Kept
from tmcm34x.debug.reverse import Here, stretches
from tmcm34x.debug.view import View
from tmcm34x.debug.writes import Write, Written, last_write
from tmcm34x.testing.errors import PATIENCE_S, TooLateError
from tmcm34x.tmcl.mnemonic import parse_instruction

if TYPE_CHECKING:
    from tmcm34x.bench import Rig
    from tmcm34x.clock import Timed
    from tmcm34x.debug.branches import Branch
    from tmcm34x.tmcl.datagram import Instruction

Result = TypeVar("Result")


class Access(Protocol):
    """Calls a function while nothing else works on the bench."""

    def __call__(self, work: Callable[[], Result], /) -> Result:
        """What `work` returns."""
        ...


def _directly(work: Callable[[], Result]) -> Result:
    return work()


def _nothing() -> None:
    pass


class History:
    """The history of `rig` from now on; clocks are those of `Rig.now`, 16,000,000 a second.

    rig: a bench that `load_bench`, `simple_rig` or a `VirtualModule` has built
    module: index of the module that expressions and commands are for
    limit: of the memory [bytes]; when it is reached, the oldest past is forgotten
    Raises `BenchError` for a bench that was put together by hand.
    """

    def __init__(self, rig: Rig, *, module: int = 0, limit: int = LIMIT) -> None:
        self.rig = rig
        self.module = module
        self.kept: Final = Kept(rig, limit=limit)
        """What keeps inputs and snapshots."""
        self.access: Access = _directly
        """How the bench is reached; a `VirtualModule` lets nothing else work on it meanwhile."""
        self.time: Timed = self.kept
        """What is moved when time passes."""
        self.on_return: Callable[[], None] = _nothing
        """Called after the bench was brought back."""

    def close(self) -> None:
        """Keep nothing any more."""
        self.kept.close()

    # Where it stands

    @property
    def now(self) -> int:
        """The bench's clock."""
        return self.rig.now

    @property
    def oldest(self) -> int:
        """The oldest clock that can be reached."""
        return self.kept.oldest

    @property
    def end(self) -> int:
        """The last clock that the present branch has reached."""
        return self.kept.branch.end

    @property
    def branches(self) -> tuple[Branch, ...]:
        """All courses of events that can be reached, the present one last."""
        return tuple(self.kept.branches)

    # From outside

    def execute(self, instruction: Instruction) -> tuple[int, int]:
        """Have the module execute a command, as part of the history; status and value of its reply."""

        def work() -> tuple[int, int]:
            answer = self.rig.modules[self.module].execute(instruction)
            self.kept.record("command", self.module, tuple(instruction))
            return answer

        return self.access(work)

    def command(self, text: str) -> tuple[int, int]:
        """Execute a command such as `MVP ABS, 0, 1000`; status and value of its reply."""
        return self.execute(parse_instruction(text))

    def load(self, source: str | Path, *, run: bool = False) -> None:
        """Put a TMCL program, as source text or as a path, into the program memory, and perhaps start it.

        Raises `ValueError` with the diagnostics of a program that cannot be assembled.
        """
        from tmcm34x.testing.programs import assemble_source

        module = self.rig.modules[self.module]
        assembly = assemble_source(source, module.board.model.number)
        self.access(lambda: self.store(assembly.program, run))

    def store(self, program: tuple[Instruction, ...], run: bool) -> None:
        """Put an assembled program into the program memory, and perhaps start it."""
        module = self.rig.modules[self.module]
        module.eeprom.write_program(program)
        if run:
            module.program.run(0)
        self.kept.record("program", self.module, (tuple(map(tuple, program)), run))

    # Forward

    def next_event(self) -> int:
        """The next clock at which something could be noticed."""
        return self.time.next_event()

    def advance(self, now: int) -> None:
        """Bring the bench to clock `now`, at most `next_event()`."""
        self.time.advance(now)

    def run(self, seconds: float) -> None:
        """Let so much time pass."""
        self.access(lambda: run_until(self.time, self.rig.now + clocks(seconds)))

    def until(self, condition: str | Callable[[Rig], object], timeout: float = PATIENCE_S) -> int:
        """Let time pass until a condition holds; the clock at which it does, to the microstep.

        condition: an expression of the debugger, such as `gp[3] > 5 && ap[1][0] == 0`, `ap[1][0] passes 20000`, or a
            function that is called with the rig; looked at after each command and each event
        timeout: longest time to pass [s]
        Raises `TooLateError` when the time is over, `ExpressionError` for a text that is no condition.
        """
        sought = self._condition(condition)
        if not self.access(lambda: self._search(sought, self.rig.now + clocks(timeout))):
            raise TooLateError(f"{sought} did not come true within {timeout:g} s")
        return self.rig.now

    def _condition(self, condition: str | Callable[[Rig], object]) -> Condition:
        sought = Condition(condition, self.module)
        sought.check(self.rig)
        return sought

    def _search(self, sought: Condition, until: int) -> bool:
        look, program = sought.on(self.rig), self.rig.modules[self.module].program
        program.hook(_let_pass)
        try:
            while not (found := look.holds()) and self.rig.now < until:
                self.time.advance(min(self.time.next_event(), look.next_event(), until))
        finally:
            program.unhook(_let_pass)
        return found

    # Back

    def look_at(self, clock: int) -> Rig:
        """A rig as the bench was at `clock`, to be read only and good until the next call of a method here.

        Raises `HistoryError` where that moment cannot be reached.
        """
        return self.access(lambda: self.kept.look_at(clock))

    def back_to(self, clock: int, branch: Branch | None = None) -> None:
        """Bring the bench to a past clock, of the present course of events or of another `branch`.

        Going on repeats what happened, with all that was done from outside, until something else is done.  On a bench
        with lines to hosts nothing is repeated: they have sent what they have sent.
        Raises `HistoryError` where that moment cannot be reached.
        """
        self.access(lambda: self._return_to(clock, branch))

    def _return_to(self, clock: int, branch: Branch | None = None) -> None:
        kept = self.kept
        (kept.go_on_from if kept.has_lines else kept.return_to)(clock, branch)
        self.on_return()

    def back_until(self, condition: str | Callable[[Rig], object]) -> int:
        """Go back to where a condition last began to hold before now; that clock.

        Raises `HistoryError` where it never did; the bench is then at the oldest moment.
        """
        sought = self._condition(condition)
        clock = self.access(lambda: self._last(sought))
        self.back_to(self.oldest if clock is None else clock)
        if clock is None:
            raise HistoryError(
                f"{sought} has not come true since {seconds(self.oldest):g} s, where the history begins; "
                "the bench is there now",
                self.oldest,
            )
        return clock

    def _last(self, sought: Condition) -> int | None:
        """The last clock before now at which a condition began to hold."""
        here = self._here()
        for start, end in stretches(here.branch, here.clock):
            course, found = here.course_to(start), None
            look, program = sought.on(course.rig), course.rig.modules[self.module].program
            program.hook(_let_pass)
            held = look.holds()
            while (when := min(course.next_event(), look.next_event())) <= end and when < here.clock:
                course.advance(when)
                before, held = held, look.holds()
                found = when if held and not before else found
            program.unhook(_let_pass)
            if found is not None:
                return found
        return None

    def last_write(self, what: str) -> Write | None:
        """What wrote a value last, though it may have written what was there; None where nothing did.

        what: such as `gp[3]`, `ap[max_speed][0]`, `accumulator`
        Raises `ExpressionError` where it names nothing.
        """
        return self.access(lambda: last_write(self._here(), Written.of(self._view, what)))

    def _here(self) -> Here:
        return Here.of(self.rig, self.kept.looking, self.kept.branch, self.module)

    @property
    def _view(self) -> View:
        return View.of(self.rig.modules[self.module], self.rig.worlds[self.module])


def _let_pass(_: int) -> bool:
    """Makes each command an event."""
    return False
