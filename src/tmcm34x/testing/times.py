"""How fast the time of a virtual module passes, and how much of it."""

from __future__ import annotations

import math
from typing import Literal

from tmcm34x.testing.errors import WrongUseError

Pace = Literal["virtual"] | float
"""Time moves on with what the test and the host do, or this many times real time."""


def check_pace(pace: Pace) -> float:
    """The factor of real time; 0 for virtual time.  Raises `ValueError`."""
    if pace == "virtual":
        return 0.0
    if isinstance(pace, str) or not math.isfinite(pace) or pace <= 0:
        raise WrongUseError(f"pace is 'virtual' or a factor of real time above 0, not {pace!r}")
    return float(pace)


def check_time(seconds: float) -> None:
    """Raises `ValueError` for what is no time to let pass [s]."""
    if isinstance(seconds, str) or not 0 <= seconds < 1e9:
        raise WrongUseError(f"a time must be a finite number of seconds, 0 or more, not {seconds!r}")
