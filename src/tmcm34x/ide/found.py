"""Motors of a real module that turn, or may turn, though this server has not set them in motion."""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import TYPE_CHECKING

from tmcm34x.host import commands
from tmcm34x.host.polling import AXIS_BANK
from tmcm34x.ide import wire
from tmcm34x.tmcl.commands import MOTORS

if TYPE_CHECKING:
    from tmcm34x.ide.target import Target


class FoundMotors:
    """Looks at the motors of `target` once on each line; `changed` is called when `text` is another.

    started: gives the motors that were set in motion through this server
    """

    def __init__(
        self, target: Target, started: Callable[[], Collection[int]], changed: Callable[[], None]
    ) -> None:
        self._target = target
        self._started = started
        self._changed = changed
        self._line = -1
        """The line on which the motors were looked at."""
        self.text = ""
        """For people; empty where nothing was found."""

    def clear(self) -> None:
        """A person has read it, or the program that turned the motors was stopped."""
        self.text = ""

    def lose(self) -> None:
        """The line is lost: look again on the next one."""
        self._line = -1

    async def look(self, quiet: Callable[[], bool]) -> None:
        """Read the speeds, if that was not done on this line; again later where `quiet` holds when it is done."""
        if self._line == self._target.line:
            return
        self._line = self._target.line
        items = [wire.Watched(AXIS_BANK, commands.SPEED, motor) for motor in range(MOTORS)]
        speeds = await self._target.read(items)
        if quiet():
            self.lose()
            return
        text = self._say(speeds)
        if text != self.text:
            self.text = text
            self._changed()

    def _say(self, speeds: list[int | None]) -> str:
        started = self._started()
        turning = [
            f"motor {n} (speed {speed})" for n, speed in enumerate(speeds) if speed and n not in started
        ]
        unknown = [f"motor {n}" for n, speed in enumerate(speeds) if speed is None]
        found = f"Not started by this IDE, but turning: {', '.join(turning)}." if turning else ""
        if unknown:
            found = f"{found} The speed is unknown of {', '.join(unknown)}: they may turn.".strip()
        return found
