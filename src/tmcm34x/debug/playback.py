"""Which moment of a bench is shown: the present, or a past one, on the rig on which its history looks at the past."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from tmcm34x.bench import Rig
    from tmcm34x.debug.branches import Branch
    from tmcm34x.debug.history import History


class Shown(NamedTuple):
    """A past moment that is shown."""

    clock: int
    branch: Branch


class Playback:
    """What is shown of `history`; to show something changes nothing on the bench itself."""

    def __init__(self, history: History) -> None:
        self.history = history
        self.shown: Shown | None = None
        """The past moment; None for the present."""
        self.on_change: list[Callable[[], None]] = []
        """Called when another moment is shown."""

    @property
    def rig(self) -> Rig:
        """The rig that is shown: to be read only, where it is a past one."""
        shown = self.shown
        return self.history.rig if shown is None else self.history.look_at(*shown)

    def seek(self) -> None:
        """Bring the rig that is shown to the moment that is shown: a search may have left it elsewhere."""
        if self.shown is not None:
            self.history.look_at(*self.shown)

    @property
    def branch(self) -> Branch:
        """The branch that is shown."""
        return self.history.branch if self.shown is None else self.shown.branch

    def show(self, clock: int, branch: Branch | None = None) -> None:
        """Show a past moment; raises `HistoryError` where it cannot be reached."""
        branch = branch or self.branch
        self.history.look_at(clock, branch)
        self.shown = Shown(clock, branch)
        self._changed()

    def leave(self) -> None:
        """Show the present again."""
        if self.shown is not None:
            self.shown = None
            self._changed()

    def go_on(self) -> None:
        """Make the moment that is shown the present one, in a new branch."""
        if self.shown is not None:
            self.history.go_on_from(*self.shown)
            self.leave()

    def _changed(self) -> None:
        for listener in self.on_change:
            listener()
