"""Clocks at which a motor comes to a position that something is compared with.

A bench has no event where a motor passes a position that nothing waits for.  Who compares positions stops there too;
the clock comes from the motion chip's closed form (`chips.tmc429.chip.Tmc429.reaches`), so that a condition such as
`ap[actual_position][0] > 20000` is seen at the very microstep.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from tmcm34x.clock import NEVER
from tmcm34x.debug.expressions import Comparison, ExpressionError, comparisons, values_of
from tmcm34x.tmcl.numbers import AP

if TYPE_CHECKING:
    from tmcm34x.debug.view import View

_AROUND: Final = (-1, 0, 1)
"""Positions beside the one that is compared with, at which <, <=, == and the like change."""


def next_crossing(view: View, compared: Sequence[Comparison]) -> int:
    """The first clock at which a motor comes to a position that it is compared with; `NEVER` where none is known."""
    return min((_next(view, comparison) for comparison in compared), default=NEVER)


def position_comparisons(text: str) -> list[Comparison]:
    """What an expression compares an actual position with; raises `ExpressionError`."""
    return [found for found in comparisons(text) if found.reference.name.lower() == "ap"]


def _next(view: View, comparison: Comparison) -> int:
    try:
        number, motor = values_of(comparison.reference.indices, view.read)
        limit = int(comparison.other(view.read))
    except (ExpressionError, ValueError):
        return NEVER
    if number != AP.ACTUAL_POSITION:
        return NEVER
    return min(view.reaches(motor, limit + beside) for beside in _AROUND)
