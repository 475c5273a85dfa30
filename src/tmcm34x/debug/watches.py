"""Data breakpoints: hold when a value changes, or when it passes a limit.

    gp[3]                                 any change of user variable 3
    ap[actual_position][0] passes 20000   motor 0 reaches or crosses 20,000, in either direction

A value is compared after each command of the program and at each event of the bench; an actual position also at the
clock at which the motor comes to the limit (`crossings`).  What acts when it is read cannot be watched.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from tmcm34x.clock import NEVER
from tmcm34x.debug.control import Stop, always, compile_hits
from tmcm34x.debug.crossings import next_crossing, position_comparisons
from tmcm34x.debug.expressions import Comparison, Expression, ExpressionError, compile_expression

if TYPE_CHECKING:
    from tmcm34x.debug.view import View

PASSES: Final = re.compile(r"(?P<value>.+?)\s+passes\s+(?P<limit>.+)\Z", re.DOTALL)


@dataclass(slots=True)
class WatchedValue:
    """One data breakpoint.

    text: as it was asked for; watched: the expression in it; value, limit: what is watched, and what it must pass
    (None for any change)
    condition: hold only when it is not 0
    compared: the actual positions in it, and what they are compared with
    """

    number: int
    text: str
    watched: str
    value: Expression
    limit: Expression | None = None
    compared: tuple[Comparison, ...] = ()
    condition: Expression | None = None
    enough: Callable[[int], bool] = always
    hits: int = field(default=0, compare=False)
    last: int | None = field(default=None, compare=False)

    @classmethod
    def make(cls, number: int, text: str, condition: str = "", hits: str = "") -> WatchedValue:
        """A data breakpoint from what was typed; raises `ExpressionError`."""
        text = text.strip()
        match = PASSES.match(text)
        watched = match["value"] if match else text
        limit = compile_expression(match["limit"]) if match else None
        compare = f"{watched} > ({match['limit']})" if match else watched
        return cls(
            number,
            text,
            watched,
            compile_expression(watched),
            limit,
            tuple(position_comparisons(compare)),
            compile_expression(condition) if condition.strip() else None,
            compile_hits(hits) if hits.strip() else always,
        )


class Watches:
    """All data breakpoints of a session, and the values that they saw last."""

    def __init__(self, view: View) -> None:
        self._view = view
        self._watches: list[WatchedValue] = []

    def __bool__(self) -> bool:
        return bool(self._watches)

    @property
    def all(self) -> list[WatchedValue]:
        """All data breakpoints."""
        return list(self._watches)

    def set(self, watches: Iterable[WatchedValue]) -> None:
        """Take these instead of the present ones; what they watch is compared with what it is now."""
        self._watches = list(watches)
        self.look_again()

    def look_again(self) -> None:
        """Compare with the present values from here on: the program was moved, not run."""
        for watch in self._watches:
            watch.last = self._value(watch.value)

    def next_event(self) -> int:
        """The next clock at which a motor comes to a position that it is compared with, or `NEVER`."""
        return min((next_crossing(self._view, watch.compared) for watch in self._watches), default=NEVER)

    def look(self, address: int) -> Stop | None:
        """Compare all values with those of the last look; a stop where one of them has changed enough.

        address: of the program's next command
        """
        texts = [text for watch in self._watches if (text := self._changed(watch))]
        return Stop("data breakpoint", address, "; ".join(texts)) if texts else None

    def _changed(self, watch: WatchedValue) -> str:
        before, now = watch.last, self._value(watch.value)
        watch.last = now
        if before == now or not self._passed(watch, before, now) or not self._meets(watch):
            return ""
        shown = "no value" if before is None else str(before)
        return f"{watch.text}: {shown} → {'no value' if now is None else now}"

    def _passed(self, watch: WatchedValue, before: int | None, now: int | None) -> bool:
        if watch.limit is None:
            return True
        limit = self._value(watch.limit)
        if limit is None or before is None or now is None:
            return False
        return before < limit <= now or before > limit >= now

    def _meets(self, watch: WatchedValue) -> bool:
        if watch.condition is not None and not self._value(watch.condition):
            return False
        watch.hits += 1
        return watch.enough(watch.hits)

    def _value(self, expression: Expression) -> int | None:
        """The value now; None while it has none, as when the module has no power."""
        try:
            return int(expression(self._view.read))
        except ExpressionError:
            return None
