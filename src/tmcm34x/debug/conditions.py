"""Conditions on a bench: an expression of the debugger, a position that is passed, or a function of the rig.

gp[3] > 5 && ap[actual_speed][0] == 0
ap[actual_position][0] passes 20000
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

from tmcm34x.clock import NEVER
from tmcm34x.debug.crossings import next_crossing, position_comparisons
from tmcm34x.debug.expressions import ExpressionError, Read, compile_expression
from tmcm34x.debug.view import View
from tmcm34x.debug.watches import PASSES, WatchedValue, Watches

if TYPE_CHECKING:
    from tmcm34x.bench import Rig


class Look(NamedTuple):
    """A condition on one rig, to be asked at each event and after each command.

    holds: whether it holds now; what has no value, as without power, does not
    next_event: the next clock at which it may come to hold without an event of the rig, or `NEVER`
    """

    holds: Callable[[], bool]
    next_event: Callable[[], int]


class Condition:
    """Something that may hold.

    what: an expression, `VALUE passes LIMIT`, or a function that is called with the rig
    module: index of the module whose names an expression uses
    Raises `ExpressionError` for an expression that is not well formed.
    """

    def __init__(self, what: str | Callable[[Rig], object], module: int = 0) -> None:
        self._what = what
        self._module = module
        if isinstance(what, str):
            self._make = _passing(what) if PASSES.match(what.strip()) else _expression(what)

    def __str__(self) -> str:
        return self._what if isinstance(self._what, str) else getattr(self._what, "__name__", "the condition")

    def on(self, rig: Rig) -> Look:
        """The condition on a rig."""
        what = self._what
        if not isinstance(what, str):
            return Look(lambda: bool(what(rig)), _never)
        return self._make(View.of(rig.modules[self._module], rig.worlds[self._module]))

    def check(self, rig: Rig) -> None:
        """Raise `ExpressionError` where an expression names nothing that there is on a rig."""
        if isinstance(self._what, str):
            view = View.of(rig.modules[self._module], rig.worlds[self._module])
            view.evaluate(WatchedValue.make(0, self._what).watched)


def _expression(text: str) -> Callable[[View], Look]:
    expression, compared = compile_expression(text), position_comparisons(text)

    def holds(read: Read) -> bool:
        try:
            return bool(expression(read))
        except ExpressionError:
            return False

    return lambda view: Look(lambda: holds(view.read), lambda: next_crossing(view, compared))


def _passing(text: str) -> Callable[[View], Look]:
    WatchedValue.make(0, text)

    def on(view: View) -> Look:
        watches = Watches(view)
        watches.set([WatchedValue.make(0, text)])
        return Look(lambda: watches.look(0) is not None, watches.next_event)

    return on


def _never() -> int:
    return NEVER
