"""Signal sources for the inputs IN_0..IN_7 and SHUTDOWN.

A source is a pure function of the clock: nothing happens between two readings.  Levels are those of the 10-bit
converter, 0..1023; an input reads 1 as a digital line from mid-scale up.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable
from math import pi, sin
from typing import Final, NamedTuple, Protocol

from tmcm34x.clock import NEVER

MAX: Final = 1023
"""The greatest level."""
THRESHOLD: Final = 512
"""From here up a level is a digital 1."""


class Signal(Protocol):
    """A level over time."""

    def level(self, now: int) -> int:
        """The level at clock `now`, 0..1023."""
        ...

    def next_edge(self, now: int) -> int:
        """The next clock after `now` at which the digital level may change, or `NEVER`."""
        ...


class Constant(NamedTuple):
    """A steady level: a potentiometer at rest, or a digital line."""

    value: int

    def level(self, now: int) -> int:
        """The level."""
        del now
        return self.value

    def next_edge(self, now: int) -> int:
        """It never changes."""
        del now
        return NEVER


class Square(NamedTuple):
    """Two levels in turn.

    period, high_time: clocks of a period, and of the high level at its beginning
    delay: clock at which the first period begins; low before
    """

    period: int
    high_time: int
    delay: int = 0
    high: int = MAX
    low: int = 0

    def level(self, now: int) -> int:
        """The level at clock `now`."""
        since = now - self.delay
        return self.high if since >= 0 and since % self.period < self.high_time else self.low

    def next_edge(self, now: int) -> int:
        """The next beginning or end of a high level."""
        since = now - self.delay
        if since < 0:
            return self.delay
        phase = since % self.period
        return now + (self.high_time if phase < self.high_time else self.period) - phase


class Ramp(NamedTuple):
    """A level that rises (or falls) evenly from `start` to `end` in a period, again and again."""

    period: int
    start: int = 0
    end: int = MAX
    delay: int = 0

    def level(self, now: int) -> int:
        """The level at clock `now`."""
        since = now - self.delay
        if since < 0:
            return self.start
        return self.start + (self.end - self.start) * (since % self.period) // self.period

    def next_edge(self, now: int) -> int:
        """The next crossing of the threshold or beginning of a period."""
        return _search(self, now, now + self.period - max(0, now - self.delay) % self.period)


class Sine(NamedTuple):
    """A sine around `middle`."""

    period: int
    middle: int = 512
    amplitude: int = 511
    delay: int = 0

    def level(self, now: int) -> int:
        """The level at clock `now`."""
        angle = 2 * pi * ((now - self.delay) % self.period) / self.period
        return max(0, min(MAX, round(self.middle + self.amplitude * sin(angle))))

    def next_edge(self, now: int) -> int:
        """The next crossing of the threshold, found between two turning points of the sine."""
        if abs(self.middle - THRESHOLD) > self.amplitude + 1:
            return NEVER
        quarter = self.period // 4 or 1
        return _search(self, now, now + quarter - (now - self.delay - quarter) % quarter)


class Table(NamedTuple):
    """Levels from given clocks on, by rising clock; the first is 0.

    period: clocks after which the table repeats, or 0
    interpolated: whether the level goes straight from entry to entry instead of jumping
    """

    times: tuple[int, ...]
    levels: tuple[int, ...]
    period: int = 0
    interpolated: bool = False

    def level(self, now: int) -> int:
        """The level at clock `now`."""
        place = now % self.period if self.period else now
        index = bisect_right(self.times, place) - 1
        level = self.levels[index]
        if self.interpolated and index + 1 < len(self.times):
            start, end = self.times[index], self.times[index + 1]
            level += (self.levels[index + 1] - level) * (place - start) // (end - start)
        return level

    def next_edge(self, now: int) -> int:
        """The next entry, or the crossing of the threshold before it."""
        place = now % self.period if self.period else now
        index = bisect_right(self.times, place)
        end = self.times[index] if index < len(self.times) else self.period or NEVER
        if end >= NEVER:
            return NEVER
        return _search(self, now, now - place + end) if self.interpolated else now - place + end


class Wire(NamedTuple):
    """A level made elsewhere: an output of a module, a potentiometer on an axis."""

    read: Callable[[], int]

    def level(self, now: int) -> int:
        """The level at this moment."""
        del now
        return self.read()

    def next_edge(self, now: int) -> int:
        """Not known beforehand: what drives the wire announces its changes."""
        del now
        return NEVER


def _search(source: Signal, now: int, end: int) -> int:
    """The first clock after `now` with another digital level, if it differs at `end`, else `end`."""
    before = source.level(now) >= THRESHOLD
    low, high = now, end - 1
    if (source.level(high) >= THRESHOLD) == before:
        return end
    while high - low > 1:
        middle = (low + high) // 2
        if (source.level(middle) >= THRESHOLD) == before:
            low = middle
        else:
            high = middle
    return high
