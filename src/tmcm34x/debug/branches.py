"""Courses of events: what came from outside with its clocks, and snapshots on the way."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from tmcm34x.clock import MS
from tmcm34x.debug.inputs import Inputs

if TYPE_CHECKING:
    from tmcm34x.bench import Rig
    from tmcm34x.debug.inputs import Input
    from tmcm34x.debug.states import PackedState

SNAPSHOT_SIZE: Final = 200
"""Memory of a snapshot besides its state, roughly [bytes]."""
SPARSE: Final = 64
"""Snapshots of which one is dropped at a time, at most."""


class HistoryError(ValueError):
    """A moment that cannot be reached; one line with what can.

    nearest: the reachable clock nearest to it; None where there is none
    """

    def __init__(self, text: str, nearest: int | None = None) -> None:
        super().__init__(text)
        self.nearest = nearest


LineShape = tuple[int, str, tuple[Any, ...]]
"""A line that is plugged in: its number, and what `bench.lines.open_line` needs."""


class Snapshot(NamedTuple):
    """The state of a bench at a clock, after so many inputs of its branch, with the lines that it had."""

    clock: int
    inputs: int
    lines: tuple[LineShape, ...]
    state: PackedState

    @property
    def size(self) -> int:
        """Its memory, without that of EEPROM images [bytes]."""
        return len(self.state.rest) + SNAPSHOT_SIZE


@dataclass
class Branch:
    """One course of events: its inputs and snapshots from the oldest moment on that is still in memory.

    number: from 0, in the order in which they began
    since, parent: the clock at which it left an earlier branch, and that one's number; -1 of the first
    reached: the last clock that is known to have been reached
    rig: the bench whose time adds to it; None of a branch that was left
    forgotten: how many inputs came before those that are kept
    """

    number: int
    since: int
    reached: int
    parent: int = -1
    inputs: Inputs = field(default_factory=Inputs, repr=False)
    snapshots: list[Snapshot] = field(default_factory=list[Snapshot], repr=False)
    forgotten: int = 0
    rig: Rig | None = field(default=None, repr=False)

    @property
    def end(self) -> int:
        """The last clock that it has reached."""
        return self.reached if self.rig is None else max(self.reached, self.rig.now)

    def stop(self, now: int) -> None:
        """Its bench goes elsewhere from clock `now`: no more of its time belongs to the branch."""
        if self.rig is not None:
            self.reached, self.rig = max(self.reached, now), None

    @property
    def oldest(self) -> int:
        """The oldest clock that can be reached."""
        return self.snapshots[0].clock

    @property
    def count(self) -> int:
        """How many inputs there have been."""
        return self.forgotten + len(self.inputs)

    def input(self, number: int) -> Input | None:
        """Input `number`, from 0; None where it has not come."""
        return self.inputs[number - self.forgotten] if number < self.count else None

    def check(self, clock: int) -> None:
        """Raise `HistoryError` where `clock` cannot be reached."""
        if clock > self.end:
            text = f"{clock / MS:.0f} ms has not come yet; the branch ends at {self.end / MS:.0f} ms"
            raise HistoryError(text, self.end)
        if clock < self.oldest:
            text = (
                f"{clock / MS:.0f} ms is no longer in memory; the oldest moment is {self.oldest / MS:.0f} ms"
            )
            raise HistoryError(text, self.oldest)

    def snapshot_before(self, clock: int) -> Snapshot:
        """The last snapshot at or before `clock`; raises `HistoryError` where there is none."""
        self.check(clock)
        return self.snapshots[bisect_right(self.snapshots, clock, key=_clock_of) - 1]

    def fork(self, number: int, clock: int, inputs: int) -> Branch:
        """A branch that has the past of this one up to `clock` and so many inputs."""
        kept = [s for s in self.snapshots if s.clock <= clock and s.inputs <= inputs]
        past = self.inputs[: inputs - self.forgotten]
        return Branch(number, clock, clock, self.number, past, kept, self.forgotten)

    def copy(self) -> Branch:
        """The same course of events as far as it has come: what happens to this one changes nothing there."""
        return replace(self, inputs=self.inputs[:], snapshots=self.snapshots[:], reached=self.end, rig=None)

    def forget_oldest(self) -> None:
        """Drop the oldest snapshot, and the inputs before the next one."""
        del self.snapshots[0]
        gone = self.snapshots[0].inputs - self.forgotten
        self.inputs.forget(gone)
        self.forgotten += gone

    def thin(self) -> None:
        """Drop snapshots that are missed least: whose loss widens the gaps least in relation to their age."""
        snapshots, end = self.snapshots, self.end
        gaps = [
            ((snapshots[n + 1].clock - snapshots[n - 1].clock) / (end - snapshots[n].clock + 1), n)
            for n in range(1, len(snapshots) - 1)
        ]
        dropped: set[int] = set()
        for _, n in sorted(gaps)[: 1 + len(gaps) // SPARSE]:
            if n - 1 not in dropped and n + 1 not in dropped:
                dropped.add(n)
        self.snapshots = [snapshot for n, snapshot in enumerate(snapshots) if n not in dropped]


def _clock_of(snapshot: Snapshot) -> int:
    return snapshot.clock
