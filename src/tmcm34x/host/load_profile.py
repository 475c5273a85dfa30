"""The load of a motor at one velocity after the other, as the TMCL-IDE's stallGuard tool measures it.

Source: manual 5.4, 7.1 (206).
"""

from __future__ import annotations

import statistics
from collections.abc import Callable, Iterable
from typing import Final, NamedTuple

from tmcm34x.host import commands
from tmcm34x.host.motion import send, until
from tmcm34x.host.steps import Pause, Steps, now

SETTLE_S: Final = 0.05
"""From the moment at which a velocity is reached to the first load value."""
SAMPLES: Final = 10
SAMPLE_S: Final = 0.02
"""Between two load values."""
_LOOK_S: Final = 0.005


class LoadReading(NamedTuple):
    """Load values at one velocity."""

    velocity: int
    mean: float
    deviation: float
    """Standard deviation of the values."""


def measure(motor: int, velocities: Iterable[int], tell: Callable[[LoadReading], None]) -> Steps[None]:
    """Turn a motor at each velocity [velocity units] and measure; `tell` takes each result, the motor turns on."""
    for velocity in velocities:
        tell((yield from _measure(motor, velocity)))


def _measure(motor: int, velocity: int) -> Steps[LoadReading]:
    yield from send(commands.rotate(motor, velocity))
    yield from until("actual_speed", motor, velocity)
    yield from _let_pass(SETTLE_S)
    loads: list[int] = []
    for _ in range(SAMPLES):
        yield from _let_pass(SAMPLE_S)
        loads.append((yield from send(commands.read_axis("load_value", motor))))
    return LoadReading(velocity, statistics.fmean(loads), statistics.pstdev(loads))


def _let_pass(seconds: float) -> Steps[None]:
    """Let time of the line pass, which on a bench may be slower or faster than that of pauses."""
    end = (yield from now()) + seconds
    while (yield from now()) < end:
        yield Pause(_LOOK_S)
