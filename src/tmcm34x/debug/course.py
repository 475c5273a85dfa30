"""A rig on its way along a branch of a history: what came from outside is done again at its clocks."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, Final

from tmcm34x.bench.action import Action, perform
from tmcm34x.bench.lines import LineEnd, SerialEnd, open_line
from tmcm34x.debug.branches import Snapshot
from tmcm34x.debug.inputs import RECEIVED
from tmcm34x.debug.states import load_state, pack_state
from tmcm34x.debug.view import View
from tmcm34x.firmware.program import StandAloneProgram
from tmcm34x.tmcl.datagram import Instruction

if TYPE_CHECKING:
    from tmcm34x.bench import Rig
    from tmcm34x.debug.branches import Branch, LineShape
    from tmcm34x.debug.inputs import Input
    from tmcm34x.firmware.module import FirmwareModule


class Holding:
    """Holds a program of `module` as an input did that is still to come: before a command, or after a refused one."""

    def __init__(self, module: FirmwareModule, due: Input) -> None:
        self._module = module
        self._clock = due.clock
        if due.kind == HELD:
            module.program.hook(self._before, frozenset(due.values))
        else:
            module.program.on_refusal.append(self._after)

    def _before(self, _: int) -> bool:
        return self._after()

    def _after(self) -> bool:
        return self._module.now == self._clock

    def end(self) -> None:
        """Hold it no more."""
        self._module.program.unhook(self._before)
        if self._after in self._module.program.on_refusal:
            self._module.program.on_refusal.remove(self._after)


WAYPOINTS: Final = 64
"""States on the way that a course keeps, the latest."""
WAYPOINT_EVENTS: Final = 32
"""Events from one to the next."""


class CancelledError(Exception):
    """A run along the past was given up."""


class Course:
    """A rig on its way along a branch: inputs of the branch are done again at their clocks.

    lines: the modules' ends of the lines that are plugged in, by their numbers
    done: how many inputs of the branch have been done

    On the way to a clock it keeps states, since who looks at a moment looks at others near it next: to go back to one
    of them takes no run from a snapshot.
    """

    def __init__(self, rig: Rig, branch: Branch, done: int, lines: dict[int, LineEnd] | None = None) -> None:
        self.rig = rig
        self.branch = branch
        self.done = done
        self.lines = {} if lines is None else lines
        self.cancelled = False
        """Set it, in another thread too, to have a run end with `CancelledError`."""
        self._waypoints: dict[int, Snapshot] = {}
        self._holding: Holding | None = None

    def next_event(self) -> int:
        """The next event of the rig, or the next input; raises `CancelledError`."""
        if self.cancelled:
            raise CancelledError
        due = self.upcoming
        if due is None:
            return self.rig.next_event()
        return min(self.rig.next_event(), max(due.clock, self.rig.now + 1))

    @property
    def upcoming(self) -> Input | None:
        """The input that comes next; None where all have been done."""
        return self.branch.input(self.done)

    def advance(self, now: int) -> None:
        """Bring the rig to clock `now`, and do what is due."""
        self.rig.advance(now)
        for _ in self.repeat():
            pass

    def repeat(self) -> Iterator[Input]:
        """Do the inputs that are due at the rig's clock; each is returned when it was done."""
        while (due := self.upcoming) is not None and due.clock <= self.rig.now:
            self.done += 1
            INPUTS[due.kind](self, due.number, *due.values)
            self.rig.next_event()  # worlds take notice of each input by itself
            self._expect()
            yield due

    def _expect(self) -> None:
        """Where the next input holds a program in the middle of an event, see to it that this can be done."""
        self.end_holding()
        due = self.upcoming
        if due is not None and due.kind in _HOLDS:
            self._holding = Holding(self.rig.modules[due.number], due)

    def end_holding(self) -> None:
        """Hold no program any more."""
        if self._holding is not None:
            self._holding.end()
            self._holding = None

    def go_along(self, branch: Branch, clock: int) -> None:
        """Bring the rig to `clock` of a branch; raises `HistoryError` where that cannot be reached."""
        branch.check(clock)
        if self.branch is not branch:
            self.take(branch)
            self.start_from(branch.snapshot_before(clock))
        self.go_to(clock)

    def take(self, branch: Branch) -> None:
        """Go along another branch from now on: `start_from` one of its snapshots next."""
        self.branch = branch
        self._waypoints.clear()

    def share(self, other: Course) -> None:
        """Take over what another course along the same branch, or its past, has kept on the way."""
        self._waypoints = {**other._waypoints, **self._waypoints}
        while len(self._waypoints) > WAYPOINTS:
            del self._waypoints[next(iter(self._waypoints))]

    def start_from(self, place: Snapshot) -> None:
        """Bring the rig to a snapshot of the branch, or to a state that was kept on the way."""
        self.arrange(place.lines)
        load_state(self.rig, place.state)
        self.done = place.inputs
        self._expect()

    def go_to(self, clock: int) -> None:
        """Bring the rig to `clock` from the nearest known state, or from where it is if that is nearer."""
        place = self._nearest(clock)
        if not place.clock <= self.rig.now <= clock or self.done < place.inputs:
            self.start_from(place)
        for _ in self.repeat():
            pass
        events = 0
        while (when := self.next_event()) <= clock:
            self.advance(when)
            events += 1
            if events % WAYPOINT_EVENTS == 0:
                self._keep()
        if (
            self.rig.now < clock
        ):  # to advance again at one clock would take early notice of what has just changed
            self.advance(clock)

    def _nearest(self, clock: int) -> Snapshot:
        """The last state at or before `clock` that is known; raises `HistoryError` where there is none."""
        snapshot = self.branch.snapshot_before(clock)
        nearest = max((at for at in self._waypoints if at <= clock), default=-1)
        return self._waypoints[nearest] if nearest > snapshot.clock else snapshot

    def _keep(self) -> None:
        """Keep the present state, instead of the one that was kept first where there are too many."""
        waypoints, now = self._waypoints, self.rig.now
        waypoints.pop(now, None)
        if len(waypoints) >= WAYPOINTS:
            del waypoints[next(iter(waypoints))]
        waypoints[now] = self.snapshot()

    def snapshot(self) -> Snapshot:
        """The present state."""
        return Snapshot(self.rig.now, self.done, self.shapes, pack_state(self.rig))

    @property
    def memory(self) -> int:
        """Memory of what was kept on the way [bytes]."""
        return sum(kept.size for kept in self._waypoints.values())

    # Lines

    @property
    def shapes(self) -> tuple[LineShape, ...]:
        """The lines that are plugged in, in their order."""
        return tuple((number, *end.describe()) for number, end in self.lines.items())

    def plug(self, number: int, kind: str, options: tuple[Any, ...]) -> None:
        """Plug in a line that leads nowhere."""
        self.lines[number] = open_line(self.rig, kind, options)

    def arrange(self, shapes: tuple[LineShape, ...]) -> None:
        """Have just these lines, in this order."""
        if self.shapes != shapes:
            for number in tuple(self.lines):
                self.lines.pop(number).unplug()
            for shape in shapes:
                self.plug(*shape)


# Inputs


def _do_action(course: Course, index: int, name: str, *operands: Any) -> None:
    perform(course.rig.worlds, Action(name, index, operands))


def _do_command(course: Course, index: int, *fields: int) -> None:
    course.rig.modules[index].execute(Instruction(*fields))


def _do_assignment(course: Course, index: int, target: str, value: int) -> None:
    View.of(course.rig.modules[index], course.rig.worlds[index]).assign(target, str(value))


def _do_program(course: Course, index: int, program: tuple[tuple[int, ...], ...], run: bool) -> None:
    module = course.rig.modules[index]
    module.eeprom.write_program([Instruction(*fields) for fields in program])
    if run:
        module.program.run(0)


def _do_control(course: Course, index: int, what: str) -> None:
    CONTROLS[what](course.rig.modules[index].program)


def _do_hold(course: Course, _: int, *address: int) -> None:
    """The program was held by `Holding` in the middle of the event at this clock."""


def _do_plug(course: Course, number: int, kind: str, options: tuple[Any, ...]) -> None:
    course.plug(number, kind, options)


def _do_unplug(course: Course, number: int) -> None:
    course.lines.pop(number).unplug()


def _do_receive(course: Course, number: int, *values: Any) -> None:
    line = course.lines[number]
    receive = line.receive if isinstance(line, SerialEnd) else line.receive_frame
    receive(*values)


def change_lines(course: Course, _: int, *shapes: LineShape) -> None:
    """Go on with the lines that are plugged in now: nothing half received is kept, no reply is owed."""
    kept = {number for number, _, _ in shapes}
    for number in course.lines.keys() - kept:
        course.lines.pop(number).unplug()
    for module in course.rig.modules:
        module.drop_replies()
    for end in course.lines.values():
        if isinstance(end, SerialEnd):
            end.drop()
    for shape in shapes:
        if shape[0] not in course.lines:
            course.plug(*shape)


HELD: Final = "held"
REFUSED: Final = "refused"
_HOLDS: Final = frozenset({HELD, REFUSED})
"""Kinds of inputs that hold a program in the middle of an event: before a command, after a refused one."""
CONTROLS: Final[Mapping[str, Callable[[StandAloneProgram], object]]] = {
    "run": StandAloneProgram.run, "stop": StandAloneProgram.stop, "reset": StandAloneProgram.reset,
}  # fmt: skip
"""What a debugger does to a program besides holding it."""
INPUTS: Final[Mapping[str, Callable[..., None]]] = {
    "action": _do_action, "command": _do_command, "assignment": _do_assignment, "control": _do_control,
    "program": _do_program,
    HELD: _do_hold, REFUSED: _do_hold, "plugged": _do_plug, "unplugged": _do_unplug, RECEIVED: _do_receive,
    "lines": change_lines,
}  # fmt: skip
"""How each kind of input is done again: with the number of the module or of the line."""
