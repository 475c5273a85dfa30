"""What run control over a program with a history has in common: going back."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final, TypeVar

from tmcm34x.debug.control import Reason, Stop, StopControl
from tmcm34x.debug.reverse import Sought, previous_command, previous_stop
from tmcm34x.debug.writes import Write, Written, last_write

if TYPE_CHECKING:
    from tmcm34x.debug.breaks import Breaks
    from tmcm34x.debug.reverse import Here
    from tmcm34x.debug.view import View
    from tmcm34x.debug.watches import Watches

Found = TypeVar("Found")

BEFORE_COMMANDS: Final[frozenset[Reason]] = frozenset({"breakpoint", "step", "goto", "entry"})
"""Reasons for which a program is held before its next command; for others, after an event."""


class Backward:
    """Run control that goes back along a history."""

    control: StopControl
    watches: Watches
    breaks: Breaks
    view: View

    def _here(self) -> Here:
        """Where it is; raises `HistoryError` where there is no history."""
        raise NotImplementedError

    def _go_back(self, clock: int, stop: Stop) -> None:
        """Go to `clock`, just before a command, and hold there for this reason."""
        raise NotImplementedError

    def step_back(self, *, over: bool = True) -> None:
        """Go back to just before the last command; `over`: a CSUB with all that it called counts as one.

        Raises `HistoryError` where there is no history.
        """
        here = self._here()
        moment = self._find(("command", over), lambda start: previous_command(start, over=over))
        if moment is None:
            self._go_to_beginning(here, "")
        else:
            self._go_back(moment.clock, Stop("step", moment.address))

    def reverse_continue(self) -> None:
        """Go back to where a breakpoint or data breakpoint would have held last, or to the beginning."""
        here = self._here()
        sought = self._sought
        found = self._find(("stop",), lambda start: previous_stop(start, sought))
        if found is None:
            self._go_to_beginning(here, ": nothing held before" if any(sought) else "")
        else:
            self._go_back(*found)

    def who_wrote(self, text: str) -> Write | None:
        """What wrote a value last; goes to just before that.  Raises `ExpressionError` where `text` names nothing."""
        written, here = Written.of(self.view, text), self._here()
        write = self._find(("write", text), lambda start: last_write(start, written))
        if write is not None:
            self._go_back(max(here.branch.oldest, write.clock - 1), Stop("goto", write.address, write.cause))
        return write

    def _find(self, what: tuple[Any, ...], search: Callable[[Here], Found]) -> Found:
        """What `search` finds from here; `what` says what it looks for."""
        del what
        return search(self._here())

    @property
    def _sought(self) -> Sought:
        """What holds the program."""
        return Sought(self.control.breakpoints, self.watches.all, self.breaks.wanted)

    def _go_to_beginning(self, here: Here, why: str) -> None:
        self._go_back(here.branch.oldest, Stop("entry", -1, f"the beginning of the history{why}"))
