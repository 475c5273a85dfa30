"""The history of a bench: every past moment can be reached again.

Runs are deterministic, so a past moment is the nearest snapshot before it, run on to its clock.  What comes from
outside meanwhile is kept as `Input`s with their clocks: actions on the bench, telegrams, commands and assignments of
a debugger.  Snapshots stand close together near the present and farther apart the older they are, so that the memory
stays within a limit.

The past is looked at on a second rig of the same description: to look at it changes nothing.  `return_to` brings the
bench itself back.  Going on from there repeats what happened; the first other input begins a new branch, and the
branch that is left stays reachable until its memory is needed.

A history stands between a bench and who moves its time: it is a `Part` itself.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from tmcm34x.bench.action import Action, perform
from tmcm34x.clock import HZ, MS, NEVER, run_until
from tmcm34x.debug.view import View
from tmcm34x.tmcl.datagram import Instruction

if TYPE_CHECKING:
    from tmcm34x.bench import Rig

LIMIT: Final = 64 << 20
"""Default memory of a history [bytes]."""
DENSE_EVENTS: Final = 1000
"""Events from one snapshot to the next, as they are taken."""
DENSE_CLOCKS: Final = 10 * HZ
"""Longest virtual time from one snapshot to the next while anything happens."""
INPUT_SIZE: Final = 200
"""Memory of an input, roughly [bytes]."""


class HistoryError(ValueError):
    """A moment that cannot be reached; one line with what can."""


class Input(NamedTuple):
    """Something that came from outside at a clock: a key of `INPUTS`, the module's index, and plain values."""

    clock: int
    kind: str
    module: int
    values: tuple[Any, ...]


def _do_action(rig: Rig, module: int, name: str, *operands: Any) -> None:
    perform(rig, Action(name, module, operands))


def _do_command(rig: Rig, module: int, *fields: int) -> None:
    rig.modules[module].execute(Instruction(*fields))


def _do_assignment(rig: Rig, module: int, target: str, value: int) -> None:
    View.of(rig.modules[module], rig.worlds[module]).assign(target, str(value))


INPUTS: Final[Mapping[str, Callable[..., None]]] = {
    "action": _do_action,
    "command": _do_command,
    "assignment": _do_assignment,
}
"""How each kind of input is done again."""


class Snapshot(NamedTuple):
    """The state of the bench at a clock, after so many inputs of its branch."""

    clock: int
    inputs: int
    data: bytes


@dataclass
class Branch:
    """One course of events: all its inputs and snapshots from the beginning on.

    number: from 0, in the order in which they began
    since: the clock at which it left an earlier branch
    end: the last clock that it has reached
    """

    number: int
    since: int
    end: int
    inputs: list[Input] = field(default_factory=list[Input])
    snapshots: list[Snapshot] = field(default_factory=list[Snapshot])

    def snapshot_before(self, clock: int) -> Snapshot:
        """The last snapshot at or before `clock`; raises `HistoryError` where there is none."""
        index = bisect_right(self.snapshots, clock, key=lambda snapshot: snapshot.clock)
        if not index:
            oldest = self.snapshots[0].clock
            raise HistoryError(
                f"{clock / MS:.0f} ms is no longer in memory; the oldest moment is {oldest / MS:.0f} ms"
            )
        return self.snapshots[index - 1]

    def fork(self, number: int, clock: int, inputs: int) -> Branch:
        """A branch that has the past of this one up to `clock` and so many inputs."""
        kept = [s for s in self.snapshots if s.clock <= clock and s.inputs <= inputs]
        return Branch(number, clock, clock, self.inputs[:inputs], kept)


class Course:
    """A rig on its way along a branch: inputs of the branch are done again at their clocks."""

    def __init__(self, rig: Rig, branch: Branch, done: int) -> None:
        self.rig = rig
        self.branch = branch
        self.done = done
        """How many inputs of the branch have been done."""

    def next_event(self) -> int:
        """The next event of the rig, or the next input."""
        inputs = self.branch.inputs
        due = inputs[self.done].clock if self.done < len(inputs) else NEVER
        return min(self.rig.next_event(), max(due, self.rig.now + 1))

    def advance(self, now: int) -> None:
        """Bring the rig to clock `now`, and do what is due."""
        self.rig.advance(now)
        for _ in self.repeat():
            pass

    def repeat(self) -> Iterator[Input]:
        """Do the inputs that are due at the rig's clock; each is returned when it was done."""
        inputs = self.branch.inputs
        while self.done < len(inputs) and inputs[self.done].clock <= self.rig.now:
            done = inputs[self.done]
            self.done += 1
            INPUTS[done.kind](self.rig, done.module, *done.values)
            yield done

    def start_from(self, snapshot: Snapshot) -> None:
        """Bring the rig to a snapshot of the branch."""
        self.rig.restore(snapshot.data)
        self.done = snapshot.inputs

    def go_to(self, clock: int) -> None:
        """Bring the rig to `clock` from the nearest snapshot, or from where it is if that is nearer."""
        snapshot = self.branch.snapshot_before(clock)
        if not snapshot.clock <= self.rig.now <= clock:
            self.start_from(snapshot)
        for _ in self.repeat():
            pass
        run_until(self, clock)


class History:
    """The history of `rig` from now on.

    build: makes another rig of the same description, on which the past is looked at
    limit: of the memory [bytes]
    """

    def __init__(self, rig: Rig, build: Callable[[], Rig], *, limit: int = LIMIT) -> None:
        self.rig = rig
        self.limit = limit
        self.on_change: list[Callable[[], None]] = []
        """Called when a branch begins or the bench is brought back."""
        self._build = build
        self._past: Course | None = None
        self._abandoned: list[Branch] = []
        self._course = Course(rig, Branch(0, rig.now, rig.now), 0)
        self._branches = 1
        self._events = 0
        self._repeating = False
        self._size = 0
        self._snapshot_due = 0
        self._snapshot()
        rig.on_action.append(self._note_action)

    def close(self) -> None:
        """Record nothing any more."""
        self.rig.on_action.remove(self._note_action)

    # Where it stands

    @property
    def branch(self) -> Branch:
        """The present branch."""
        return self._course.branch

    @property
    def branches(self) -> Sequence[Branch]:
        """All branches that can be reached, the present one last."""
        return (*self._abandoned, self.branch)

    @property
    def oldest(self) -> int:
        """The oldest clock of the present branch that can be reached."""
        return self.branch.snapshots[0].clock

    @property
    def past(self) -> Rig:
        """The rig on which the past is looked at; `look_at` brings it somewhere."""
        return self._looking.rig

    @property
    def memory(self) -> int:
        """Memory of all snapshots and inputs [bytes]."""
        return self._size + INPUT_SIZE * sum(len(branch.inputs) for branch in self.branches)

    def _measure(self) -> None:
        """Add up the snapshots anew: branches share those of their common past."""
        snapshots = {id(s): len(s.data) for branch in self.branches for s in branch.snapshots}
        self._size = sum(snapshots.values())

    # Time

    def next_event(self) -> int:
        """The next clock at which something happens, inputs that are repeated included."""
        return self._course.next_event() if self._repeats else self.rig.next_event()

    def advance(self, now: int) -> None:
        """Bring the bench to clock `now`."""
        if self._repeats:
            self._repeat(now)
        else:
            self.rig.advance(now)
        if now > self.branch.end:
            self.branch.end = now
            self._events += 1
            if self._events >= DENSE_EVENTS or now >= self._snapshot_due:
                self._snapshot()

    @property
    def _repeats(self) -> bool:
        """Whether inputs of the branch are still to come."""
        return self._course.done < len(self._course.branch.inputs)

    def _repeat(self, now: int) -> None:
        self._repeating = True
        try:
            self._course.advance(now)
        finally:
            self._repeating = False

    # Inputs

    def record(self, kind: str, module: int, values: tuple[Any, ...]) -> None:
        """Keep an input that was just done at the bench's clock."""
        if self._repeating:
            return
        course, now = self._course, self.rig.now
        if self._repeats or now < course.branch.end:
            self._begin_branch(now)
        course.branch.inputs.append(Input(now, kind, module, values))
        course.done += 1

    def _note_action(self, action: Action, _: int) -> None:
        self.record("action", action.module, (action.name, *action.operands))

    def _begin_branch(self, now: int) -> None:
        course = self._course
        self._abandoned.append(course.branch)
        course.branch = course.branch.fork(self._branches, now, course.done)
        self._branches += 1
        self._changed()

    # The past

    def look_at(self, clock: int, branch: Branch | None = None) -> Rig:
        """A rig as the bench was at `clock`: to be read only, and good until the next call.

        Raises `HistoryError` where that moment cannot be reached.
        """
        branch = branch or self.branch
        return self.course_to(self._reached(clock, branch), branch).rig

    @staticmethod
    def _reached(clock: int, branch: Branch) -> int:
        if clock > branch.end:
            raise HistoryError(
                f"{clock / MS:.0f} ms has not come yet; the branch ends at {branch.end / MS:.0f} ms"
            )
        return clock

    def course_to(self, clock: int, branch: Branch | None = None) -> Course:
        """A course along a branch that stands at `clock`, on the rig for looking at the past."""
        course, branch = self._looking, branch or self.branch
        if course.branch is not branch:
            self._past = course = Course(course.rig, branch, 0)
            course.start_from(branch.snapshot_before(clock))
        course.go_to(clock)
        return course

    @property
    def _looking(self) -> Course:
        if self._past is None:
            self._past = Course(self._build(), self.branch, 0)
            self._past.start_from(self.branch.snapshots[0])
        return self._past

    def return_to(self, clock: int, branch: Branch | None = None) -> None:
        """Bring the bench itself back to `clock`; going on repeats the branch until something else is done."""
        branch = branch or self.branch
        course = self.course_to(self._reached(clock, branch), branch)
        if branch is not self.branch:
            self._abandoned = [*(b for b in self._abandoned if b is not branch), self.branch]
            self._course.branch = branch
        self.rig.load(course.rig.save())
        self._course.done = course.done
        self._changed()

    def _changed(self) -> None:
        for listener in self.on_change:
            listener()

    # Memory

    def _snapshot(self) -> None:
        branch = self.branch
        data = self.rig.snapshot()
        branch.snapshots.append(Snapshot(self.rig.now, self._course.done, data))
        self._events = 0
        self._size += len(data)
        self._snapshot_due = self.rig.now + DENSE_CLOCKS
        while self.memory > self.limit and self._make_room():
            self._measure()

    def _make_room(self) -> bool:
        """Drop the oldest branch that was left, or the snapshot that is missed least; whether there was one."""
        if self._abandoned:
            del self._abandoned[0]
            return True
        snapshots, end = self.branch.snapshots, self.branch.end
        if len(snapshots) <= 2:
            if len(snapshots) == 2:
                del snapshots[0]
                return True
            return False
        gaps = [
            (snapshots[n + 1].clock - snapshots[n - 1].clock) / (end - snapshots[n].clock + 1)
            for n in range(1, len(snapshots) - 1)
        ]
        del snapshots[1 + gaps.index(min(gaps))]
        return True
