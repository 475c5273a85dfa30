"""Running backwards: the last command, the last breakpoint, the last write.

Nothing runs backwards really: stretches of the past are run again, the latest first, on the rig on which a history
looks at the past, until what is looked for was found in one of them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Final, NamedTuple

from tmcm34x.debug.breaks import Breaks, Wanted
from tmcm34x.debug.control import Breakpoint, Stop, StopControl, always
from tmcm34x.debug.view import View
from tmcm34x.debug.watches import WatchedValue, Watches

if TYPE_CHECKING:
    from tmcm34x.bench import Rig
    from tmcm34x.debug.branches import Branch
    from tmcm34x.debug.course import Course
    from tmcm34x.firmware.program import StandAloneProgram

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


def moments(
    course: Course, until: int, addresses: frozenset[int] | None, module: int = 0
) -> Iterator[Moment]:
    """Run a course to `until`, pausing before each command (at `addresses` only, unless None)."""
    program = course.rig.modules[module].program
    program.hook(let_pass, addresses)
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
        program.unhook(let_pass)


def comes(program: StandAloneProgram, when: int) -> bool:
    """Whether the program's next command takes effect at `when`, the next event."""
    return program.active and not program.waiting and program.next_event() == when


def let_pass(_: int) -> bool:
    """Hold before no command: a hook that makes each one an event of its own."""
    return False


class Here(NamedTuple):
    """Where a search begins, and the course on which it runs.

    branch: along which the course goes; clock: of the present moment there
    depth, executed: open CSUBs of the program that is meant, and the commands that it has executed
    module: whose program is meant
    """

    course: Course
    branch: Branch
    clock: int
    depth: int
    executed: int
    module: int = 0

    @classmethod
    def of(cls, rig: Rig, course: Course, branch: Branch, module: int = 0) -> Here:
        """Where `rig` is in a branch; it may be the rig of the course."""
        program = rig.modules[module].program
        return cls(course, branch, rig.now, len(program.stack), program.executed, module)

    @property
    def program(self) -> StandAloneProgram:
        """The program that is meant, on the rig of the course."""
        return self.course.rig.modules[self.module].program

    @property
    def view(self) -> View:
        """The module on the rig of the course, by names."""
        rig = self.course.rig
        return View.of(rig.modules[self.module], rig.worlds[self.module])

    def course_to(self, clock: int) -> Course:
        """The course, brought to `clock`."""
        self.course.go_along(self.branch, clock)
        return self.course

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
    step = here.course.rig.modules[here.module].instruction_clocks
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
    powered = _powered(here)

    def wanted(moment: Moment) -> bool:
        done = moment.executed < here.executed or moment.when <= powered
        return done and (not over or moment.depth <= here.depth)

    return last_moment(here, wanted)


def _powered(here: Here) -> int:
    """The clock at which the supply was switched last: commands are counted from there; -1 where it never was."""
    switched = (
        item.clock
        for item in here.branch.inputs.others
        if (item.kind, item.number, item.values[:1]) == ("action", here.module, ("power",))
    )
    return max((clock for clock in switched if clock <= here.clock), default=-1)


# Breakpoints


class PastStop(NamedTuple):
    """A clock at which the program would have been held, and why."""

    clock: int
    stop: Stop


class Sought(NamedTuple):
    """What holds a program: breakpoints, data breakpoints, and the breaks of `breaks.BREAKS` in force."""

    breakpoints: Sequence[Breakpoint] = ()
    watches: Sequence[WatchedValue] = ()
    breaks: Wanted = MappingProxyType({})

    @property
    def counts_hits(self) -> bool:
        """Whether anything depends on how often it was met since the beginning."""
        return any(met.enough is not always for met in (*self.breakpoints, *self.watches))


def previous_stop(here: Here, sought: Sought) -> PastStop | None:
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


def next_stop(here: Here, sought: Sought, end: int) -> PastStop | None:
    """Where one of these held first after now, on the way that the branch took; None up to `end`."""
    if not any(sought):
        return None
    start = here.branch.oldest if sought.counts_hits else here.clock
    return _Finder(here, sought).first_after_now(start, end)


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

    def last_in(self, start: int, end: int) -> PastStop | None:
        """The last place after `start` up to `end`, and before now."""
        found = None
        for place in self._places(start, end):
            if place.clock < self._now:
                found = place
        return found

    def first_after_now(self, start: int, end: int) -> PastStop | None:
        """The first place after now and before `end`; hits are counted from `start` on."""
        places = self._places(start, end)
        return next((place for place in places if self._now < place.clock < end), None)

    def _places(self, start: int, end: int) -> Iterator[PastStop]:
        """All places after `start` up to `end`."""
        course, here, sought = self._here.course_to(start), self._here, self._sought
        program, view = here.program, here.view
        control, watched = StopControl(view.read, _say_nothing), Watches(view)
        breaks = Breaks(course.rig.modules[here.module], course.rig.worlds[here.module], view.read)
        control.set_breakpoints([replace(b, hits=0) for b in sought.breakpoints if not b.message])
        watched.set([replace(w, hits=0) for w in sought.watches])
        breaks.set(sought.breaks)
        program.hook(let_pass, None if watched or breaks.each_command else control.addresses)
        try:
            for clock, stop in _stops(course, program, end, _Looks(control, watched, breaks)):
                if stop is not None:
                    yield PastStop(clock, stop)
        finally:
            program.unhook(let_pass)
            breaks.close()


class _Looks(NamedTuple):
    """What decides where a program is held."""

    control: StopControl
    watched: Watches
    breaks: Breaks


def _stops(
    course: Course, program: StandAloneProgram, end: int, looks: _Looks
) -> Iterator[tuple[int, Stop | None]]:
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
