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
from tmcm34x.debug.course import HELD, REFUSED
from tmcm34x.debug.expressions import ExpressionError, Reference, compile_reference, values_of
from tmcm34x.debug.view import View
from tmcm34x.debug.watches import Watch, Watches
from tmcm34x.firmware.commands.coordinates import ALL_COORDINATES, ALL_MOTORS
from tmcm34x.tmcl.commands import BY_NUMBER, PROGRAM_SIZE
from tmcm34x.tmcl.datagram import CAN_SIZES, Instruction, unpack_can_request, unpack_request
from tmcm34x.tmcl.mnemonic import format_instruction

if TYPE_CHECKING:
    from tmcm34x.bench import Rig
    from tmcm34x.debug.branches import Branch, Input
    from tmcm34x.debug.course import Course
    from tmcm34x.debug.history import History
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


class Here(NamedTuple):
    """Where a search begins: `rig` as it is now, at its clock in `branch`; module: whose program is meant."""

    history: History
    rig: Rig
    branch: Branch
    module: int = 0

    @property
    def clock(self) -> int:
        """The clock of the present moment."""
        return self.rig.now

    @property
    def program(self) -> Program:
        """The program that is meant."""
        return self.rig.modules[self.module].program

    def view(self, rig: Rig) -> View:
        """The module on a rig, by names."""
        return View.of(rig.modules[self.module], rig.worlds[self.module])

    def course_to(self, clock: int) -> Course:
        """A course along the branch that stands at `clock`; `rig` may be the one that it moves."""
        return self.history.course_to(clock, self.branch)

    def moments(
        self, course: Course, until: int, addresses: frozenset[int] | None = None
    ) -> Iterator[Moment]:
        """The moments before commands up to `until`; see `moments`."""
        return moments(course, until, addresses, self.module)


def stretches(branch: Branch, until: int) -> Iterator[tuple[int, int]]:
    """The stretches between snapshots before `until`, as first and last clock, the latest first."""
    clocks = sorted({snapshot.clock for snapshot in branch.snapshots if snapshot.clock < until})
    for start in reversed(clocks):
        yield start, until
        until = start


def last_moment(here: Here, wanted: Callable[[Moment], bool]) -> Moment | None:
    """The last moment before a command that took effect up to now, and for which `wanted` holds.

    Runs commands one by one in windows that grow, so that a command shortly before is found at once.
    """
    step = here.rig.modules[here.module].instruction_clocks
    for start, end in stretches(here.branch, here.clock):
        window = FIRST_WINDOW * step
        while True:
            begin = max(start, end - window)
            found = None
            for moment in here.moments(here.course_to(begin), end):
                if wanted(moment):
                    found = moment
            if found is not None or begin == start:
                break
            window *= GROWTH
        if found is not None:
            return found
    return None


def previous_command(here: Here, *, over: bool) -> Moment | None:
    """The moment before the last command; `over`: of those in the present routine or further out."""
    depth, executed = len(here.program.stack), here.program.executed

    def wanted(moment: Moment) -> bool:
        return moment.executed < executed and (not over or moment.depth <= depth)

    return last_moment(here, wanted)


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


def previous_stop(here: Here, sought: Sought) -> Past | None:
    """Where one of these would have held last before now.

    Hit counts are those since the beginning of the history.
    """
    finder = _Finder(here, sought)
    if sought.counts_hits:
        return finder.last_in(here.branch.oldest, here.clock)
    for start, end in stretches(here.branch, here.clock):
        found = finder.last_in(start, end)
        if found is not None:
            return found
    return None


def next_stop(here: Here, sought: Sought) -> Past | None:
    """Where one of these held first after now, on the way that the branch took; None up to its end."""
    start = here.branch.oldest if sought.counts_hits else here.clock
    return _Finder(here, sought).first_after_now(start)


def next_command(here: Here, depth: int | None) -> Moment | None:
    """The first moment after now before a command with at most `depth` CSUBs open; None: however many are open."""
    now = here.clock
    for moment in here.moments(here.course_to(now), here.branch.end):
        if moment.clock > now and (depth is None or moment.depth <= depth):
            return moment
    return None


class _Finder:
    """Looks for places in a stretch at which something holds, as `BenchSession.advance` looks for the next."""

    def __init__(self, here: Here, sought: Sought) -> None:
        self._here = here
        self._now = here.clock
        self._sought = sought

    def last_in(self, start: int, end: int) -> Past | None:
        """The last place after `start` up to `end`, and before now."""
        found = None
        for place in self._places(start, end):
            if place.clock < self._now:
                found = place
        return found

    def first_after_now(self, start: int) -> Past | None:
        """The first place after now, up to the end of the branch; hits are counted from `start` on."""
        places = self._places(start, self._here.branch.end)
        return next((place for place in places if place.clock > self._now), None)

    def _places(self, start: int, end: int) -> Iterator[Past]:
        """All places after `start` up to `end`."""
        course, here, sought = self._here.course_to(start), self._here, self._sought
        program, view = course.rig.modules[here.module].program, here.view(course.rig)
        control, watched = Control(view.read, _say_nothing), Watches(view)
        breaks = Breaks(course.rig.modules[here.module], course.rig.worlds[here.module], view.read)
        control.set_breakpoints([replace(b, hits=0) for b in sought.breakpoints if not b.message])
        watched.set([replace(w, hits=0) for w in sought.watches])
        breaks.set(sought.breaks)
        program.hook(_let_pass, None if watched or breaks.each_command else control.addresses)
        try:
            for clock, stop in _stops(course, program, end, _Looks(control, watched, breaks)):
                if stop is not None:
                    yield Past(clock, stop)
        finally:
            program.unhook(_let_pass)
            breaks.close()


class _Looks(NamedTuple):
    """What decides where a program is held."""

    control: Control
    watched: Watches
    breaks: Breaks


def _stops(course: Course, program: Program, end: int, looks: _Looks) -> Iterator[tuple[int, Stop | None]]:
    """Run a course to `end`, and look at each place where something may hold."""
    control, watched, breaks = looks
    while (when := min(course.next_event(), watched.next_event())) <= end:
        if comes(program, when) and control.concerns(program.upcoming):
            course.advance(max(course.rig.now, when - 1))
            yield course.rig.now, control.look(program.counter, len(program.stack))
        course.advance(when)
        yield when, breaks.look(program.counter)
        yield when, watched.look(program.counter)


def _say_nothing(_: str, __: int) -> None:
    """Log points are silent while the past is run again."""


# Writes


def last_write(here: Here, text: str) -> Write | None:
    """What wrote a value last, though it may have written what was there before; None where nothing did.

    text: a reference such as `gp[3]`, `ap[max_speed][0]`, `accumulator`
    Raises `ExpressionError` where `text` names nothing.
    """
    finder = _WriteFinder(here, compile_reference(text))
    for start, end in stretches(here.branch, here.clock):
        found = finder.last_in(start, end)
        if found is not None:
            return found
    return None


class _WriteFinder:
    """Looks for the last write of a value in a stretch."""

    def __init__(self, here: Here, reference: Reference) -> None:
        self._here = here
        self._reference = reference
        self._indices = values_of(reference.indices, here.view(here.rig).read)
        self._writes = WRITERS.get(reference.name.lower(), {})
        self._found: Write | None = None
        here.view(here.rig).read(reference.name, self._indices)
        self._view = here.view(here.history.past)
        self._before = 0

    def last_in(self, start: int, end: int) -> Write | None:
        """The last write after `start` up to `end`."""
        course = self._here.course_to(start)
        rig, program = course.rig, course.rig.modules[self._here.module].program
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
        """The value now; 0 without power."""
        try:
            return self._view.read(self._reference.name, self._indices)
        except ExpressionError:
            return 0

    def _instruction(self, address: int) -> Instruction | None:
        eeprom = self._here.history.past.modules[self._here.module].eeprom
        return eeprom.read_instruction(address) if 0 <= address < PROGRAM_SIZE else None

    def _sent(self, done: Input) -> Instruction | None:
        """The command in an input for this module."""
        if done.kind == "command" and done.number == self._here.module:
            return Instruction(*done.values)
        return telegram(done)

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


def telegram(done: Input) -> Instruction | None:
    """The command in a whole telegram or frame that came over a line; None for anything else."""
    if done.kind != "received":
        return None
    if isinstance(done.values[0], int):
        data = done.values[1]
        return unpack_can_request(data) if len(data) in CAN_SIZES else None
    data = done.values[0]
    try:
        return unpack_request(data)[1]
    except ValueError:
        return None


def described(done: Input) -> str:
    """An input in words."""
    sent = Instruction(*done.values) if done.kind == "command" else telegram(done)
    if sent is not None:
        return f"command of a host: {format_instruction(sent)}"
    return _DESCRIBED.get(done.kind, _plain)(done)


def _plain(done: Input) -> str:
    return f"{done.kind}: {' '.join(map(str, done.values))}".removesuffix(": ")


_DESCRIBED: Final[Mapping[str, Callable[[Input], str]]] = {
    "assignment": lambda done: f"debugger: {done.values[0]} = {done.values[1]}",
    "control": lambda done: f"debugger: {done.values[0]}",
    "received": lambda done: "bytes of a host",
    "plugged": lambda _: "a line was plugged in",
    "unplugged": lambda _: "a line was unplugged",
    "lines": lambda _: "the bench went on from a past moment",
    HELD: lambda _: "the debugger held the program",
    REFUSED: lambda _: "the debugger held the program after a refused command",
}
"""Inputs in words, by their kind; the others are named with their values."""
