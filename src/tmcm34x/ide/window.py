"""A window of the page, as everything that serves it knows it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from tmcm34x.ide import wire


class Window(Protocol):
    """One window; `page.Page` is its web socket.

    number: counts windows from 1
    heard_s: when it last said something, by the event loop's clock
    rate_hz: states a second that it wants
    watches: parameters that it shows by itself
    wants_polls: whether its telegram log shows the questions that the IDE asks by itself
    """

    number: int
    heard_s: float
    rate_hz: int
    watches: list[wire.Watched]
    wants_polls: bool

    def send(self, event: wire.Event) -> None:
        """Send an event, in order."""
        ...

    def begin_anew(self) -> None:
        """Send the state of another module whole, behind what has been sent so far."""
        ...

    def hurry(self) -> None:
        """Send the state now: something happened that a person waits for."""
        ...

    def follow_log(self, call: wire.FollowLog) -> None:
        """Send log lines from those on that the window has, or none."""
        ...
