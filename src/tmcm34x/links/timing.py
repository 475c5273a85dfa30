"""When bytes are due: the wall clock on an event loop, or virtual time inside one process.

What delays bytes (`faults`, `pacing`) asks one of these for the time and for a later call, and does not know which.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from heapq import heappop, heappush
from typing import Final, Protocol

from tmcm34x import clock

Action = Callable[[], None]

_COARSE_S: Final = 0.0015
"""An event loop's timer may be this late: it rounds up to whole milliseconds."""
_NAP_S: Final = 0.0002
"""Longest sleep that holds up the event loop."""


class Timing(Protocol):
    """A clock with timers."""

    def time(self) -> float:
        """The present time [s]."""
        ...

    def call_later(self, delay_s: float, action: Action) -> object:
        """Call `action` in `delay_s` seconds, not before this returns."""
        ...


class LoopTiming:
    """The clock of an event loop, with timers that are exact to about 0.1 ms and keep their order."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._due: list[tuple[float, int, Action]] = []
        self._count = 0

    def time(self) -> float:
        """The loop's time [s]."""
        return self._loop.time()

    def call_later(self, delay_s: float, action: Action) -> None:
        """Call `action` in `delay_s` seconds: coarsely by the loop's timer, then in short sleeps."""
        due_s = self._loop.time() + delay_s
        self._count += 1
        heappush(self._due, (due_s, self._count, action))
        self._loop.call_at(due_s - _COARSE_S, self._approach)

    def _approach(self) -> None:
        """Come to what is due first; there are as many of these calls as actions."""
        rest_s = self._due[0][0] - self._loop.time()
        if rest_s > 0:
            time.sleep(min(rest_s, _NAP_S))
            self._loop.call_soon(self._approach)
        else:
            heappop(self._due)[2]()


class VirtualTiming:
    """Timers in virtual time: a `clock.Part`, for lines inside one process.

    Whoever runs a bench runs this beside it, up to the same clocks.
    """

    def __init__(self, now: int = 0) -> None:
        self.now = now
        self._due: list[tuple[int, int, Action]] = []
        self._count = 0

    def time(self) -> float:
        """The present clock [s]."""
        return self.now / clock.HZ

    def call_later(self, delay_s: float, action: Action) -> None:
        """Call `action` at a clock at least one later than now."""
        self._count += 1
        heappush(self._due, (self.now + max(1, clock.clocks(delay_s)), self._count, action))

    def next_event(self) -> int:
        """The clock of the next call, or `NEVER`."""
        return self._due[0][0] if self._due else clock.NEVER

    def advance(self, now: int) -> None:
        """Make the calls that are due at `now`."""
        self.now = now
        while self._due and self._due[0][0] <= now:
            heappop(self._due)[2]()
