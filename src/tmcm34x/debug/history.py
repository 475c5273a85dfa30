"""The history of a bench: every past moment can be reached again.

Runs are deterministic, so a past moment is the nearest snapshot before it, run on to its clock.  What comes from
outside meanwhile is kept as `Input`s with their clocks: actions on the bench, what comes over lines, and what a
debugger does.  Snapshots stand close together near the present and farther apart the older they are, so that the
memory stays within a limit.

The past is looked at on a second rig of the same description: to look at it changes nothing.  `return_to` brings the
bench itself back.  Going on from there repeats what happened; the first other input begins a new branch, and the
branch that is left stays reachable until its memory is needed.  `go_on_from` begins a branch at once, for a bench
whose lines have hosts at their other ends: what they have sent once is not sent again.

A history stands between a bench and who moves its time: it is a `TimedBench` itself.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Final

from tmcm34x.bench.lines import SerialEnd
from tmcm34x.clock import HZ, NEVER
from tmcm34x.debug.branches import Branch
from tmcm34x.debug.course import Course, change_lines
from tmcm34x.debug.inputs import INPUT_SIZE, RECEIVED, Input, size, telegrams_size

if TYPE_CHECKING:
    from tmcm34x.bench import Rig
    from tmcm34x.bench.action import Action
    from tmcm34x.bench.lines import LineEnd

LIMIT: Final = 64 << 20
"""Default memory of a history [bytes]."""
DENSE_STEPS: Final = 250
"""Steps of time from one snapshot to the next, as they are taken: each goes to an event, but for few."""
DENSE_INPUTS: Final = 5000
"""Inputs from one snapshot to the next: to do all of them again takes 20 ms."""
DENSE_CLOCKS: Final = 15 * HZ
"""Longest virtual time from one snapshot to the next while anything happens."""
SPARE: Final = 0.05
"""Part of the limit that is freed when it is reached."""


class History:
    """The history of `rig` from now on.

    limit: of the memory [bytes]

    Raises `BenchError` for a bench of which no second one can be built.
    """

    def __init__(self, rig: Rig, *, limit: int = LIMIT) -> None:
        self.rig = rig
        self.limit = limit
        self.on_change: list[Callable[[], None]] = []
        """Called when a branch begins or the bench is brought back."""
        self.on_restore: list[Callable[[], None]] = []
        """Called when the bench was brought to a state that is not of its past."""
        self.branch = Branch(0, rig.now, rig.now, rig=rig)
        """The present branch."""
        self.pass_to: Callable[[int], None] = rig.pass_to
        """Brings the bench to a clock before its next event: what happens by time alone needs no notice."""
        self.next_event: Callable[[], int] = rig.next_event
        """The next clock at which something happens, inputs that are repeated included."""
        self._looking = Course(rig.replica(), self.branch, 0)
        self._course = Course(rig, self.branch, 0)
        self._apart: Course | None = None
        self._abandoned: list[Branch] = []
        self._branches = 1
        self._lines = 0
        self._numbers: dict[LineEnd, int] = {}
        self._repeating = False
        self._ahead = False
        """Whether inputs of the branch are still to come: the bench was brought back, and goes the same way again."""
        self._size = self._sized = 0
        """Memory of the snapshots, and of so many inputs of the present branch; of those that are no telegrams, all."""
        self._steps_left = 0
        """Steps of time until the next snapshot."""
        self._inputs_due = 0
        """The number of inputs kept at which it is due; 0 where an input may begin a branch."""
        self._snapshot_due = 0
        """The clock at which it is due."""
        self._snapshot()
        self._looking.start_from(self.branch.snapshots[0])
        rig.on_action.append(self._note_action)

    def close(self) -> None:
        """Record nothing any more."""
        self.rig.on_action.remove(self._note_action)

    # Where it stands

    @property
    def branches(self) -> Sequence[Branch]:
        """All branches that can be reached, the present one last."""
        return (*self._abandoned, self.branch)

    @property
    def oldest(self) -> int:
        """The oldest clock of the present branch that can be reached."""
        return self.branch.oldest

    @property
    def past(self) -> Rig:
        """The rig on which the past is looked at; `look_at` brings it somewhere."""
        return self._looking.rig

    @property
    def memory(self) -> int:
        """Memory of all snapshots and inputs, and of what looking at the past keeps besides [bytes]."""
        return self._size + self._fresh_size + self._looking.memory

    @property
    def _fresh_size(self) -> int:
        """What is to be added to it for the inputs since the last snapshot [bytes]."""
        branch = self.branch
        return telegrams_size(branch.inputs.contents[self._sized - branch.forgotten :])

    @property
    def _done(self) -> int:
        """How many inputs of the branch the bench has had."""
        return self._course.done if self._ahead else self.branch.count

    @property
    def has_lines(self) -> bool:
        """Whether lines are plugged in, with hosts at their other ends."""
        return bool(self._course.lines)

    def _measure(self) -> None:
        """Add up everything anew: branches share what they have of a common past."""
        branches = self.branches
        snapshots = {id(s): s for branch in branches for s in branch.snapshots}
        images = {id(image): len(image) for s in snapshots.values() for image in s.state.images}
        contents = {id(content): content for branch in branches for content in branch.inputs.contents}
        self._size = sum(s.size for s in snapshots.values()) + sum(images.values()) + size(contents.values())
        self._sized = self.branch.count

    # Time

    @property
    def now(self) -> int:
        """The bench's clock."""
        return self.rig.now

    def advance(self, now: int) -> None:
        """Bring the bench to clock `now`; nothing happens where it is there already."""
        if now <= self.rig.now:
            return
        if self._ahead:
            self._repeat(now)
        else:
            self.rig.advance(now)
        self._steps_left -= 1
        if not self._steps_left or now >= self._snapshot_due:
            self._snapshot()

    def _repeat(self, now: int) -> None:
        course = self._course
        self._repeating = True
        try:
            course.advance(now)
        finally:
            self._repeating = False
            self._go_ahead(course.done < course.branch.count)

    def _go_ahead(self, ahead: bool) -> None:
        """Repeat the branch's inputs, or no more."""
        self._ahead = ahead
        self.next_event = self._course.next_event if ahead else self.rig.next_event

    # Inputs

    def record(self, kind: str, index: int, values: tuple[Any, ...]) -> None:
        """Keep an input that was just done at the bench's clock."""
        if not self._repeating:
            self._record(self.rig.now, kind, index, values)
            if len(self.branch.inputs) >= self._inputs_due:
                self._snapshot()

    def record_hold(self, kind: str, index: int, values: tuple[Any, ...]) -> None:
        """Keep that a program is held in the middle of the event that is under way: `HELD` or `REFUSED`."""
        if not self._repeating:
            self._record(self.rig.modules[index].now, kind, index, values)

    def _record(self, now: int, kind: str, index: int, values: tuple[Any, ...]) -> None:
        if self._ahead or now < self.branch.reached:
            self._begin_branch(self.branch, now, self._done)
        self.branch.inputs.append(Input(now, kind, index, values))
        self._size += INPUT_SIZE

    def _note_action(self, action: Action, _: int) -> None:
        self.record("action", action.module, (action.name, *action.operands))

    def _begin_branch(self, parent: Branch, clock: int, done: int) -> None:
        """Leave the present branch for a new one that shares the past of `parent`."""
        self._leave_for(parent.fork(self._branches, clock, done))
        self._changed()

    def _leave_for(self, branch: Branch) -> None:
        """Go on in a new branch."""
        self._abandoned.append(self.branch)
        self._take(branch)
        self._course.end_holding()
        self._branches += 1
        self._measure()

    def _take(self, branch: Branch, *, ahead: bool = False) -> None:
        """Be in a branch; at its end, unless inputs are still to come or time is: no snapshot is due before."""
        self.branch.stop(self.rig.now)
        branch.rig = self.rig
        self.branch = self._course.branch = branch
        self._go_ahead(ahead)
        self._steps_left, self._snapshot_due, self._inputs_due = NEVER, branch.reached + 1, 0
        for end, number in self._numbers.items():
            end.record = self._taker(end, number)

    # What comes over lines; a `server.lines.Recorder`

    def plugged(self, end: LineEnd) -> None:
        """A line was plugged in: keep what it receives."""
        number = self._lines = self._lines + 1
        self._course.lines[number] = end
        self._numbers[end] = number
        self.record("plugged", number, end.describe())
        end.record = self._taker(end, number)

    def _taker(self, end: LineEnd, number: int) -> Callable[..., None]:
        """What takes the values that a line receives, for the present branch."""
        return self._bytes_taker(number) if isinstance(end, SerialEnd) else self._frame_taker(number)

    def _bytes_taker(self, number: int) -> Callable[[bytes, bool, int | None], None]:
        """`record` without the calls and the look-ups that each telegram would have to pay for."""
        rig, inputs, late = self.rig, self.branch.inputs, -number
        contents = inputs.contents
        add_clock, add_line, add_content = inputs.clocks.append, inputs.lines.append, contents.append

        def take(data: bytes, over: bool, baud_rate: int | None) -> None:
            if baud_rate is None and len(contents) < self._inputs_due:
                add_clock(rig.now)
                add_line(late if over else number)
                add_content(data)
            else:
                self.record(RECEIVED, number, (data, over, baud_rate))

        return take

    def _frame_taker(self, number: int) -> Callable[..., None]:
        return lambda *values: self.record(RECEIVED, number, values)

    def unplugged(self, end: LineEnd) -> None:
        """A line was unplugged."""
        end.record = None
        number = self._numbers.pop(end)
        del self._course.lines[number]
        self.record("unplugged", number, ())

    def restored(self, before: int) -> None:
        """The bench was brought from clock `before` to a state from elsewhere: a branch without a past begins."""
        now = self.rig.now
        self.branch.stop(before)
        self._leave_for(Branch(self._branches, now, now))
        self._snapshot()
        self._changed()
        for listener in self.on_restore:
            listener()

    # The past

    def look_at(self, clock: int, branch: Branch | None = None) -> Rig:
        """A rig as the bench was at `clock`: to be read only, and good until the next call.

        Raises `HistoryError` where that moment cannot be reached.
        """
        return self.course_to(clock, branch).rig

    def course_to(self, clock: int, branch: Branch | None = None) -> Course:
        """A course along a branch that stands at `clock`, on the rig for looking at the past.

        Raises `HistoryError` where that moment cannot be reached.
        """
        self._looking.go_along(branch or self.branch, clock)
        return self._looking

    @property
    def looking(self) -> Course:
        """The course on which the past is looked at."""
        return self._looking

    def course_apart(self, branch: Branch) -> Course:
        """A course on a rig of its own along a copy of a branch, for a search in another thread; one at a time."""
        if self._apart is None:
            self._apart = Course(self.rig.replica(), branch, 0)
        course, looking = self._apart, self._looking
        frozen = branch.copy()
        course.take(frozen)
        course.cancelled = False
        if looking.branch is branch:
            course.share(looking)
        course.start_from(frozen.snapshots[0])
        return course

    def return_to(self, clock: int, branch: Branch | None = None) -> None:
        """Bring the bench itself back to `clock`; going on repeats the branch until something else is done."""
        branch = branch or self.branch
        course = self.course_to(clock, branch)
        if branch is not self.branch:
            self._abandoned = [*(b for b in self._abandoned if b is not branch), self.branch]
        self.branch.stop(self.rig.now)
        self.rig.load(course.rig.save())
        self._course.done = course.done
        self._take(branch, ahead=course.done < branch.count)
        self._changed()

    def go_on_from(self, clock: int, branch: Branch | None = None) -> None:
        """Bring the bench itself back to `clock` in a new branch.

        Lines stay plugged in as they are now.  Those that were there at `clock` speak binary or text as they did then;
        nothing that was half received then is kept, and no reply that was owed then is sent.
        """
        branch = branch or self.branch
        course, shapes = self.course_to(clock, branch), self._course.shapes
        done = course.done
        course.end_holding()
        change_lines(course, 0, *shapes)
        self.branch.stop(self.rig.now)
        self.rig.load(course.rig.save())
        self._begin_branch(branch, clock, done)
        self._record(clock, "lines", 0, shapes)
        self._looking.take(self.branch)
        self._looking.done = self.branch.count
        self._snapshot()

    def _changed(self) -> None:
        for listener in self.on_change:
            listener()

    # Memory

    def _snapshot(self) -> None:
        branch, course = self.branch, self._course
        before = branch.snapshots[-1].state.images if branch.snapshots else ()
        course.done = self._done
        snapshot = course.snapshot()
        branch.snapshots.append(snapshot)
        self._size += snapshot.size + sum(
            len(image) for image in snapshot.state.images if image not in before
        )
        self._size += self._fresh_size
        self._sized = branch.count
        self._steps_left = DENSE_STEPS
        self._snapshot_due = self.rig.now + DENSE_CLOCKS
        if self._size > self.limit:
            self._make_room(self.limit - round(self.limit * SPARE))
        self._inputs_due = len(branch.inputs) + DENSE_INPUTS

    def _make_room(self, limit: int) -> None:
        """Drop the oldest branches that were left, then what is missed least."""
        while self._size > limit and self._drop_something():
            self._measure()

    def _drop_something(self) -> bool:
        """Whether there was something to drop."""
        branch = self.branch
        if self._abandoned:
            gone = self._abandoned.pop(0)
            if self._looking.branch is gone:
                self._looking.take(branch)
                self._looking.start_from(branch.snapshots[0])
        elif len(branch.snapshots) > 2 and size(branch.inputs.contents) < self.limit // 2:
            branch.thin()
        elif len(branch.snapshots) > 1:
            branch.forget_oldest()
        else:
            return False
        return True
