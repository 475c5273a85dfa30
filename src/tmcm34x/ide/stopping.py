"""Motors on their way to rest: stop commands are repeated until each has confirmed a speed of 0.

Source: manual 6.7.3 (MST), 6.7.13 (RFS STOP), axis parameter 3.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Final

from tmcm34x.host import commands
from tmcm34x.host.polling import AXIS_BANK
from tmcm34x.ide import wire
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.ide.target import Target

RETRY_S: Final = 0.25
"""Between two commands to stop."""


class Stopping:
    """Motors of `target` that are being stopped; `changed` is called with a motor whenever its state changes."""

    def __init__(self, target: Target, changed: Callable[[int], None]) -> None:
        self._target = target
        self._changed = changed
        self._tasks: dict[int, asyncio.Task[None]] = {}
        self.doubts: dict[int, str] = {}
        """Motors that have not confirmed rest, each with the reason."""

    def begin(self, motors: Iterable[int], *, searching: bool = False) -> None:
        """Bring motors to rest; a motor that is on its way there already stays on it."""
        for motor in motors:
            if motor not in self._tasks:
                self.doubts[motor] = "not asked yet"
                self._tasks[motor] = asyncio.ensure_future(self._stop(motor, searching))
                self._changed(motor)

    def drop(self, motor: int) -> None:
        """A person has decided otherwise about a motor."""
        task = self._tasks.pop(motor, None)
        if task is not None:
            task.cancel()
            self.doubts.pop(motor, None)
            self._changed(motor)

    async def rest(self, patience_s: float) -> bool:
        """Wait until all have confirmed rest; False when `patience_s` was not enough."""
        if self._tasks:
            await asyncio.wait(self._tasks.values(), timeout=patience_s)
        return not self._tasks

    async def _stop(self, motor: int, searching: bool) -> None:
        if searching:
            await self._target.exchange(commands.stop_search(motor))
        while why := await self._try(motor):
            if self.doubts.get(motor) != why:
                self.doubts[motor] = why
                self._changed(motor)
            await asyncio.sleep(RETRY_S)
        if self._tasks.get(motor) is asyncio.current_task():
            del self._tasks[motor], self.doubts[motor]
            self._changed(motor)

    async def _try(self, motor: int) -> str:
        """Send the command and read the speed; why the motor is not known to be at rest."""
        exchange = await self._target.exchange(commands.stop(motor))
        if exchange.status != Status.OK:
            return exchange.meaning
        (speed,) = await self._target.read([wire.Watched(AXIS_BANK, commands.SPEED, motor)])
        if speed is None:
            return "its speed cannot be read"
        return f"speed {speed}" if speed else ""
