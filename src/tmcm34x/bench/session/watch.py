"""The expectations of a bench file: events with `expect`, looked at while a rig runs.

An `ExpectationWatch` is a recorder: whoever runs the rig calls `after` at its events and whenever `due` has come, and
`finish` at the end.
"""

from __future__ import annotations

from typing import NamedTuple

from tmcm34x.bench.rig import Expectation, Rig
from tmcm34x.bench.session.actions import Promise, Within
from tmcm34x.bench.session.language import read_expectation
from tmcm34x.bench.session.player import POLL
from tmcm34x.bench.session.wires import SILENCE
from tmcm34x.bench.session.world import MeasuredValue, Unit
from tmcm34x.clock import NEVER, seconds
from tmcm34x.tmcl.datagram import Instruction


class Awaited(NamedTuple):
    """An expectation and what its text says."""

    expectation: Expectation
    content: Within | Promise


class Unfulfilled(NamedTuple):
    """An expectation that failed, at which clock, and what was seen."""

    expectation: Expectation
    now: int
    seen: str

    def __str__(self) -> str:
        what = f"{self.expectation.text!r} of {self.expectation.where}"
        return f"{what} failed at {seconds(self.now):.6f} s: {self.seen}"


class _Subject(NamedTuple):
    """What a condition looks at."""

    unit: Unit

    def ask(self, instruction: Instruction) -> tuple[int, int]:
        module = self.unit.module
        return module.peek(instruction) if module.powered else SILENCE


class ExpectationWatch:
    """Looks after the expectations of `rig`.

    failures: those that failed so far
    """

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        self._waiting = [Awaited(row, read_expectation(row.text)) for row in sorted(rig.expectations)]
        self._active: list[Awaited] = []
        self.failures: list[Unfulfilled] = []
        self.due = rig.now
        """The clock at which it must look, whatever happens."""
        self.after(rig.now)

    def before(self, now: int) -> None:
        """Nothing to see."""

    def after(self, now: int) -> None:
        """Look at all expectations that are in force."""
        while self._waiting and self._waiting[0].expectation.when <= now:
            self._active.append(self._waiting.pop(0))
        self._active = [awaited for awaited in self._active if self._goes_on(awaited, now)]
        self.due = self._next(now)

    def finish(self) -> None:
        """The run is over: what has not come true by now does not; what was to be looked at later is looked at now."""
        now = self._rig.now
        for awaited in (*self._active, *self._waiting):
            content, seen = awaited.content, self._look(awaited)
            if seen.holds != (isinstance(content, Within) or content.always):
                self._fail(awaited.expectation, now, f"{seen.what}, when the run ended")
        self._active, self._waiting = [], []

    def _goes_on(self, awaited: Awaited, now: int) -> bool:
        expectation, content = awaited
        seen = self._look(awaited)
        if isinstance(content, Promise):
            failed = seen.holds != content.always
        elif seen.holds:
            return False
        else:
            failed = now >= expectation.when + content.clocks
        if failed:
            self._fail(expectation, now, seen.what)
        return not failed

    def _look(self, awaited: Awaited) -> MeasuredValue:
        return awaited.content.condition.look(_Subject(Unit(self._rig, awaited.expectation.unit)))

    def _fail(self, expectation: Expectation, now: int, seen: str) -> None:
        self.failures.append(Unfulfilled(expectation, now, seen))

    def _next(self, now: int) -> int:
        due = self._waiting[0].expectation.when if self._waiting else NEVER
        for expectation, content in self._active:
            end = expectation.when + content.clocks if isinstance(content, Within) else NEVER
            due = min(due, end, now + POLL)
        return due
