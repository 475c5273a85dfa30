"""Running backwards: the last command, the last breakpoint, the last write.

Nothing runs backwards really: stretches of the past are run again, the latest first, on the rig on which a history
looks at the past, until what is looked for was found in one of them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Final, NamedTuple

from tmcm34x.debug.breaks import Breaks, Wanted
from tmcm34x.debug.control import Breakpoint, Control, Stop, always
from tmcm34x.debug.expressions import Reference, compile_reference, values_of
from tmcm34x.debug.view import View
from tmcm34x.debug.watches import Watch, Watches
from tmcm34x.firmware.commands.coordinates import ALL_COORDINATES, ALL_MOTORS
from tmcm34x.tmcl.commands import BY_NUMBER, PROGRAM_SIZE
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.mnemonic import format_instruction

if TYPE_CHECKING:
    from tmcm34x.bench import Rig
    from tmcm34x.debug.history import Course, History, Input
    from tmcm34x.firmware.program import Program

USER_BANK: Final = 2
OUTPUT_BANK: Final = 2

FIRST_WINDOW: Final = 256
"""Commands of the first stretch that is run command by command; each further one is `GROWTH` times as long."""
GROWTH: Final = 16


class Moment(NamedTuple):
    """Just before a command of the program takes effect.

    clock: of the bench then; when: the clock at which the command takes effect
    address, depth: the program's counter and its open CSUBs; executed: commands executed before
    """

    clock: int
    when: int
    address: int
    depth: int
    executed: int


class Write(NamedTuple):
    """What changed a value last.

    clock: when; address: of the command of the program, -1 where it was none
    cause: in words; before, after: the value
    """

    clock: int
    address: int
    cause: str
    before: int
    after: int


def moments(
    course: Course, until: int, addresses: frozenset[int] | None, module: int = 0
) -> Iterator[Moment]:
    """Run a course to `until`, pausing before each command (at `addresses` only, unless None)."""
    program = course.rig.modules[module].program
    program.hook(_let_pass, addresses)
    try:
        while (when := course.next_event()) <= until:
            if comes(program, when):
                address = program.upcoming
                if addresses is None or address in addresses:
                    if course.rig.now < when - 1:
                        course.advance(when - 1)
                    yield Moment(course.rig.now, when, address, len(program.stack), program.executed)
            course.advance(when)
        course.advance(until)
    finally:
        program.unhook(_let_pass)


def comes(program: Program, when: int) -> bool:
    """Whether the program's next command takes effect at `when`, the next event."""
    return program.active and not program.waiting and program.next_event() == when


def _let_pass(_: int) -> bool:
    return False


def stretches(history: History, until: int) -> Iterator[tuple[int, int]]:
    """The stretches between snapshots before `until`, as first and last clock, the latest first."""
    clocks = sorted({snapshot.clock for snapshot in history.branch.snapshots if snapshot.clock < until})
    for start in reversed(clocks):
        yield start, until
        until = start


def last_moment(
    history: History,
    until: int,
    wanted: Callable[[Rig, Moment], bool],
    *,
    addresses: frozenset[int] | None = None,
    module: int = 0,
) -> Moment | None:
    """The last moment before a command that took effect up to `until`, and for which `wanted` holds.

    Runs commands one by one in windows that grow, so that a command shortly before is found at once.
    """
    step = history.rig.modules[module].instruction_clocks
    for start, end in stretches(history, until):
        window = FIRST_WINDOW * step if addresses is None else end - start
        while True:
            begin = max(start, end - window)
            found = None
            for moment in moments(history.course_to(begin), end, addresses, module):
                if wanted(history.past, moment):
                    found = moment
            if found is not None or begin == start:
                break
            window *= GROWTH
        if found is not None:
            return found
    return None


def previous_command(history: History, module: int = 0, *, over: bool) -> Moment | None:
    """The moment before the last command; `over`: of those in the present routine or further out."""
    program = history.rig.modules[module].program
    depth = len(program.stack)
    executed = program.executed

    def wanted(_: Rig, moment: Moment) -> bool:
        return moment.executed < executed and (not over or moment.depth <= depth)

    return last_moment(history, history.rig.now, wanted, module=module)


# Breakpoints


class Past(NamedTuple):
    """A clock at which the program would have been held, and why."""

    clock: int
    stop: Stop


class Sought(NamedTuple):
    """What holds a program: breakpoints, data breakpoints, and the breaks of `breaks.BREAKS` in force."""

    breakpoints: Sequence[Breakpoint] = ()
    watches: Sequence[Watch] = ()
    breaks: Wanted = MappingProxyType({})

    @property
    def counts_hits(self) -> bool:
        """Whether anything depends on how often it was met since the beginning."""
        return any(met.enough is not always for met in (*self.breakpoints, *self.watches))


def previous_stop(history: History, sought: Sought, module: int = 0) -> Past | None:
    """Where one of these would have held last before now.

    Hit counts are those since the beginning of the history.
    """
    finder = _Finder(history, sought, module)
    until = history.rig.now
    if sought.counts_hits:
        return finder.last_in(history.oldest, until)
    for start, end in stretches(history, until):
        found = finder.last_in(start, end)
        if found is not None:
            return found
    return None


class _Finder:
    """Looks for the last place in a stretch at which something holds, as `BenchSession.advance` looks for the next."""

    def __init__(self, history: History, sought: Sought, module: int) -> None:
        self._history = history
        self._sought = sought
        self._module = module
        self._found: Past | None = None

    def last_in(self, start: int, end: int) -> Past | None:
        """The last place after `start` up to `end`, and before now."""
        self._found = None
        course = self._history.course_to(start)
        program = course.rig.modules[self._module].program
        view = View.of(course.rig.modules[self._module], course.rig.worlds[self._module])
        control, watched = Control(view.read, _say_nothing), Watches(view)
        breaks = Breaks(course.rig.modules[self._module], course.rig.worlds[self._module], view.read)
        control.set_breakpoints([replace(b, hits=0) for b in self._sought.breakpoints if not b.message])
        watched.set([replace(w, hits=0) for w in self._sought.watches])
        breaks.set(self._sought.breaks)
        addresses = None if watched or breaks.each_command else control.addresses
        program.hook(_let_pass, addresses)
        try:
            self._run(course, end, control, watched, breaks)
        finally:
            program.unhook(_let_pass)
            breaks.close()
        return self._found

    def _run(self, course: Course, end: int, control: Control, watched: Watches, breaks: Breaks) -> None:
        program = course.rig.modules[self._module].program
        while (when := min(course.next_event(), watched.next_event())) <= end:
            if comes(program, when) and control.concerns(program.upcoming):
                course.advance(max(course.rig.now, when - 1))
                self._note(control.look(program.counter, len(program.stack)), course.rig.now)
            course.advance(when)
            self._note(breaks.look(program.counter), when)
            self._note(watched.look(program.counter), when)

    def _note(self, stop: Stop | None, clock: int) -> None:
        if stop is not None and clock < self._history.rig.now:
            self._found = Past(clock, stop)


def _say_nothing(_: str, __: int) -> None:
    """Log points are silent while the past is run again."""


# Writes


def last_write(history: History, text: str, module: int = 0) -> Write | None:
    """What wrote a value last, though it may have written what was there before; None where nothing did.

    text: a reference such as `gp[3]`, `ap[max_speed][0]`, `accumulator`
    Raises `ExpressionError` where `text` names nothing.
    """
    finder = _WriteFinder(history, compile_reference(text), module)
    for start, end in stretches(history, history.rig.now):
        found = finder.last_in(start, end)
        if found is not None:
            return found
    return None


class _WriteFinder:
    """Looks for the last write of a value in a stretch."""

    def __init__(self, history: History, reference: Reference, module: int) -> None:
        self._history = history
        self._reference = reference
        self._module = module
        self._indices = values_of(reference.indices, View.of(history.rig.modules[module]).read)
        self._writes = WRITERS.get(reference.name.lower(), {})
        self._found: Write | None = None
        self._before = self._value()

    def last_in(self, start: int, end: int) -> Write | None:
        """The last write after `start` up to `end`."""
        course = self._history.course_to(start)
        rig, program = course.rig, course.rig.modules[self._module].program
        self._found, self._before = None, self._value()
        program.hook(_let_pass, None)
        try:
            while (when := course.next_event()) <= end:
                command = program.upcoming if program.active and program.next_event() == when else -1
                instruction = self._instruction(command)
                rig.advance(when)
                self._compare(when, command, instruction, _cause(instruction))
                for done in course.repeat():
                    self._compare(when, -1, self._sent(done), described(done))
        finally:
            program.unhook(_let_pass)
        return self._found

    def _compare(self, clock: int, address: int, instruction: Instruction | None, cause: str) -> None:
        before, after = self._before, self._value()
        self._before = after
        if after != before or (instruction is not None and self._is_written_by(instruction)):
            self._found = Write(clock, address, cause, before, after)

    def _value(self) -> int:
        rig = self._history.past
        return View.of(rig.modules[self._module]).read(self._reference.name, self._indices)

    def _instruction(self, address: int) -> Instruction | None:
        eeprom = self._history.past.modules[self._module].eeprom
        return eeprom.read_instruction(address) if 0 <= address < PROGRAM_SIZE else None

    def _sent(self, done: Input) -> Instruction | None:
        """The command in an input for this module."""
        if done.module != self._module or done.kind != "command":
            return None
        return Instruction(*done.values)

    def _is_written_by(self, instruction: Instruction) -> bool:
        """Whether a command names this very value."""
        row = BY_NUMBER.get(instruction.number)
        motors = self._writes.get(row.mnemonic) if row is not None else None
        if motors is None or not self._indices or instruction.type != self._indices[0]:
            return False
        second = self._indices[1] if len(self._indices) > 1 else motors[0]
        return instruction.motor == second or instruction.motor in motors[1:]


WRITERS: Final[Mapping[str, Mapping[str, tuple[int, ...]]]] = {
    "ap": {"SAP": (0,), "AAP": (0,), "RSAP": (0,)},
    "gp": {"SGP": (USER_BANK,), "AGP": (USER_BANK,), "RSGP": (USER_BANK,)},
    "co": {"SCO": (0,), "CCO": (0, ALL_MOTORS), "ACO": (0,), "GCO": (0, ALL_COORDINATES)},
    "out": {"SIO": (OUTPUT_BANK,)},
}
"""Commands that write a value they name: by its name and the mnemonic, the motor or bank where the value has one index,
and further motors that stand for all.  Everything else is seen by its effect."""


def _cause(instruction: Instruction | None) -> str:
    return format_instruction(instruction) if instruction else "no command: the module itself"


def described(done: Input) -> str:
    """An input in words."""
    if done.kind == "command":
        return f"command of a host: {format_instruction(Instruction(*done.values))}"
    if done.kind == "assignment":
        return f"debugger: {done.values[0]} = {done.values[1]}"
    return f"{done.kind}: {' '.join(map(str, done.values))}"
