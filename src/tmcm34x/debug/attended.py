"""A bench whose session looks at it after each event, so that it holds at the clock at which something happens."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from tmcm34x.clock import NEVER

if TYPE_CHECKING:
    from tmcm34x.clock import TimedBench


class Attending(Protocol):
    """A session."""

    @property
    def attends(self) -> bool:
        """Whether there is anything to look for."""
        ...

    def next_look(self) -> int:
        """The next clock at which to look besides events, or `NEVER`."""
        ...

    def attend(self) -> None:
        """Look, at the bench's clock."""
        ...


class Attended:
    """A bench, or the history of one, as a `TimedBench`; `session` is who looks."""

    def __init__(self, bench: TimedBench) -> None:
        self._bench = bench
        self.session: Attending | None = None

    def next_event(self) -> int:
        """The bench's next event, or the clock of the next look."""
        session = self.session
        due = NEVER if session is None or not session.attends else session.next_look()
        return min(due, self._bench.next_event())

    def advance(self, now: int) -> None:
        """Bring the bench to `now`, and look."""
        self._bench.advance(now)
        self._look()

    def pass_to(self, now: int) -> None:
        """The same, before its next event."""
        self._bench.pass_to(now)
        self._look()

    def _look(self) -> None:
        if (session := self.session) is not None and session.attends:
            session.attend()
