"""What run control is over a program that was there before the session and goes on after it."""

from __future__ import annotations

from typing import Protocol

from tmcm34x.debug.control import Stop
from tmcm34x.debug.sessions.base import Listener


class _Session(Protocol):
    """What the session itself has."""

    listener: Listener

    @property
    def running(self) -> bool: ...
    @property
    def stop(self) -> Stop | None: ...
    def pause(self) -> None: ...


class Guest:
    """Run control over the program of a module whose time is not the session's."""

    owns_time = False
    over = False
    exit_code = 0

    def begin(self: _Session, *, hold: bool) -> None:
        """Take the program as it is; hold it if asked for."""
        if self.running and hold:
            self.pause()
        elif not self.running:
            self.listener.held(self.stop or Stop("pause", 0))

    def epilogue(self) -> str:
        """Nothing: the program goes on when the session ends."""
        return ""
