"""The history of the IDE's virtual module: which moment is shown, and going on from there.

While a past moment is shown, virtual time stands still: hosts on other lines reach the module of the present, whose
clock does not move.  Going on from a past moment begins a new branch, with all lines as they are
(docs/decisions/0015).
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import TYPE_CHECKING, Final

from tmcm34x.debug.branches import Branch, HistoryError
from tmcm34x.debug.history import History
from tmcm34x.debug.playback import Playback
from tmcm34x.debug.writes import described
from tmcm34x.ide import wire

if TYPE_CHECKING:
    from tmcm34x.server import Server

BUCKETS: Final = 400
"""Parts of the whole time in which telegrams are counted."""
MOST_MARKS: Final = 2000
"""Marks that are kept of a branch, the latest."""
NOT_NOW: Final = "A past moment is shown: continue from here, or return to the present."


class Past:
    """The history of `server`'s bench.

    changed: called when another moment is shown
    """

    def __init__(self, server: Server, changed: Callable[[], None]) -> None:
        self._server = server
        self._changed = changed
        self.history = History(server.rig)
        self.playback = Playback(self.history)
        self.playback.on_change.append(self._turn)
        self.history.on_change.append(self._inherit_marks)
        server.recorder = self.history
        self._marks: dict[int, list[wire.Mark]] = {0: []}
        self._was_paused = False
        self._looking = self._going_on = False

    @property
    def shown(self) -> bool:
        """Whether a past moment is shown."""
        return self.playback.shown is not None

    # What pages ask for

    def show(self, clock: float, number: int | None) -> None:
        """Show a moment of a branch; raises `wire.RefusalError`."""
        branch = self.playback.branch if number is None else self._branch(number)
        try:
            if not self.shown:
                self._server.catch_up()
            self.playback.show(round(clock), branch)
        except HistoryError as error:
            raise wire.RefusalError("history", f"{error}.") from error

    def _branch(self, number: int) -> Branch:
        for branch in self.history.branches:
            if branch.number == number:
                return branch
        raise wire.RefusalError("history", "This branch is no longer in memory.")

    def leave(self) -> None:
        """Show the present; time goes on if it did before."""
        self.playback.leave()

    def go_on(self, *, hold: bool) -> None:
        """Make the moment that is shown the present one; `hold`: time stands still until it is released."""
        if not self.shown:
            return
        self._going_on = True
        try:
            self._server.put_back(self.playback.go_on)
        finally:
            self._going_on = False
        self._server.change_pace(paused=hold or self._was_paused)
        self._changed()

    def _turn(self) -> None:
        """Another moment is shown: time stands still as long as it is a past one."""
        if self.shown and not self._looking:
            self._was_paused = self._server.pace.paused
            self._server.change_pace(paused=True)
        elif self._looking and not self.shown and not self._going_on:
            self._server.change_pace(paused=self._was_paused)
        self._looking = self.shown
        if not self._going_on:
            self._changed()

    # What pages show

    @property
    def shape(self) -> wire.History:
        """How far the history reaches."""
        history, shown = self.history, self.playback.shown
        return wire.History(
            memory=history.memory,
            limit=history.limit,
            present=history.branch.number,
            now=history.now,
            shown=-1 if shown is None else shown.branch.number,
            branches=[
                wire.Branch(b.number, b.parent, b.since, b.oldest, b.end, len(b.inputs))
                for b in history.branches
            ],
        )

    def marks(self, number: int) -> wire.Marks:
        """What happened in a branch, and how many telegrams came when; raises `wire.RefusalError`."""
        branch = self._branch(number)
        marks = [mark for mark in self._marks[number] if mark.clock >= branch.oldest]
        marks += _actions(branch)
        marks.sort(key=lambda mark: mark.clock)
        return wire.Marks(branch.oldest, branch.end, _telegrams(branch), marks[-MOST_MARKS:])

    def note(self, event: wire.Happened) -> None:
        """Something happened in the present."""
        marks = self._marks[self.history.branch.number]
        marks.append(wire.Mark(event.clock, event.kind, event.motor, event.text))
        if len(marks) > MOST_MARKS:
            del marks[: MOST_MARKS // 10]

    def _inherit_marks(self) -> None:
        """A branch began: what happened before belongs to it too."""
        branches = self.history.branches
        branch = branches[-1]
        if branch.number not in self._marks:
            parent = self._marks.get(branch.parent, [])
            self._marks[branch.number] = [mark for mark in parent if mark.clock <= branch.since]
        known = {branch.number for branch in branches}
        self._marks = {number: marks for number, marks in self._marks.items() if number in known}


def _telegrams(branch: Branch) -> list[int]:
    """How many telegrams, pieces of them and frames came in each of `BUCKETS` equal parts of the time."""
    clocks = branch.inputs.received
    span = max(1, branch.end - branch.oldest)
    edges = [branch.oldest + span * n // BUCKETS for n in range(BUCKETS)]
    places = [*(bisect_left(clocks, edge) for edge in edges), len(clocks)]
    return [after - before for before, after in pairwise(places)]


def _actions(branch: Branch) -> Iterator[wire.Mark]:
    for item in branch.inputs.others:
        if item.kind == "action":
            name, motor = item.values[0], item.values[1] if len(item.values) > 2 else -1
            kind = "fault" if name == "fault" else "action"
            yield wire.Mark(item.clock, kind, motor if name in _OF_MOTORS else -1, described(item))


_OF_MOTORS: Final = frozenset({"switch", "unplug", "fault", "push", "move"})
"""Actions on one motor."""
