"""A search along the past in another thread, while who keeps the bench's time goes on.

A session that keeps searches apart raises `UnfinishedError` where one is needed.  Who called it has the search run,
and calls again: the method finds then what was found, and goes on with that.  Nothing may have been done before.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from tmcm34x.debug.course import CancelledError
from tmcm34x.debug.reverse import Here

if TYPE_CHECKING:
    from tmcm34x.debug.playback import Playback

Outcome = Callable[[], Any]
"""Returns what was found, or raises what a search has raised."""


class UnfinishedError(Exception):
    """`search` has to run first."""

    def __init__(self, search: PlaybackSearch) -> None:
        super().__init__("a search has to run first")
        self.search = search


class PlaybackSearch:
    """A search of a session that looks at `playback`.

    look: what finds it; found: where to leave the outcome, under `what`
    """

    def __init__(
        self,
        playback: Playback,
        module: int,
        what: tuple[Any, ...],
        look: Callable[[Here], Any],
        found: dict[tuple[Any, ...], Outcome],
    ) -> None:
        self._playback = playback
        self._module = module
        self._what, self._look, self._found = what, look, found
        self._here: Here | None = None
        self._outcome: Outcome | None = None
        self.cancelled = False

    def begin(self) -> None:
        """Take the present moment as where it begins; no other search of this history may be running."""
        playback = self._playback
        self._branch = playback.branch
        course = playback.history.course_apart(self._branch)
        self._here = Here.of(playback.rig, course, course.branch, self._module)

    def run(self) -> None:
        """Look, in any thread."""
        assert self._here is not None
        try:
            found = self._look(self._here)
        except CancelledError:
            self.cancelled = True
        except Exception as error:  # raised again where the session asks for what was found
            self._outcome = _raising(error)
        else:
            self._outcome = lambda: found

    def cancel(self) -> None:
        """Give it up."""
        self.cancelled = True
        if self._here is not None:
            self._here.course.cancelled = True

    def keep(self) -> None:
        """Leave what was found where the session finds it."""
        assert self._here is not None
        assert self._outcome is not None
        self._found[self._what] = self._outcome
        looking = self._playback.history.looking
        if looking.branch is self._branch:
            looking.share(self._here.course)

    def forget(self) -> None:
        """The session has used what was found."""
        self._found.pop(self._what, None)


def _raising(error: Exception) -> Outcome:
    def outcome() -> Any:
        raise error

    return outcome
