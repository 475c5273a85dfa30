"""Virtual time: an integer count of chip clocks, and the loop that moves it.

All of the product below `server` tells the time in clocks of the board's 16 MHz oscillator, counted
from power-on.  Nobody waits: a part says when something could next be noticed (`next_event`), and
whoever runs it brings it there (`advance`).  The result does not depend on how the way is sliced.

Source: TMCM-343 hardware manual V1.07 p. 23 for the frequency (docs/fidelity.md, chips).
"""

from __future__ import annotations

from typing import Final, Protocol

HZ: Final = 16_000_000
"""Clocks per second."""

NEVER: Final = 1 << 62
"""A clock that is not reached: more than nine thousand years."""

MS: Final = HZ // 1000
"""Clocks per millisecond, the firmware's tick."""


class Part(Protocol):
    """Something that lives in virtual time."""

    def next_event(self) -> int:
        """The next clock at which somebody else could notice a change, or `NEVER`.

        Later than the clock last given to `advance`; asking twice gives the same answer.
        """
        ...

    def advance(self, now: int) -> None:
        """Bring the part to clock `now`, at most `next_event()`; going back is an error."""
        ...


def run_until(part: Part, until: int) -> None:
    """Bring `part` to clock `until`, stopping at each of its events.

    Events at `until` itself have happened when this returns.
    """
    while (when := part.next_event()) <= until:
        part.advance(when)
    part.advance(until)


def clocks(seconds: float) -> int:
    """The number of clocks in `seconds`, rounded to the nearest."""
    return round(seconds * HZ)


def seconds(clocks: int) -> float:
    """The time in seconds of a number of clocks."""
    return clocks / HZ
