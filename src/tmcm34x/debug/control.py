"""Where to hold a program: breakpoints, and the end of a step.

`StopControl` only decides; who asks it before each command, and what holding means, is in `session`.
"""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Final, Literal, NamedTuple

from tmcm34x.debug.expressions import Expression, ExpressionError, Read, compile_expression, compile_message

Reason = Literal["entry", "breakpoint", "data breakpoint", "step", "pause", "exception", "goto", "end"]

_HITS: Final = re.compile(r"\s*(>=|<=|==|=|>|<|%)?\s*(\d{1,9})\s*\Z")
_COMPARE: Final[Mapping[str, Callable[[int, int], bool]]] = MappingProxyType({
    ">=": operator.ge, "<=": operator.le, "==": operator.eq, "=": operator.eq, ">": operator.gt, "<": operator.lt,
    "%": lambda hits, number: number > 0 and hits % number == 0,
})  # fmt: skip


class Stop(NamedTuple):
    """Why and where a program is held.

    breakpoints: numbers of those that were met
    exception: key of the break that holds (`breaks.BREAKS`)
    """

    reason: Reason
    address: int
    text: str = ""
    breakpoints: tuple[int, ...] = ()
    exception: str = ""


def compile_hits(text: str) -> Callable[[int], bool]:
    """A hit condition: `5` and `>= 5` from the fifth hit on, `== 5`, `> 5`, `< 5`, `<= 5`, `% 5` every fifth.

    Raises `ExpressionError`.  A plain number: fidelity DBG-2.
    """
    match = _HITS.match(text)
    if match is None:
        raise ExpressionError(f"a hit condition is a number, perhaps after >= > == < <= or %, not {text!r}")
    compare, number = _COMPARE[match[1] or ">="], int(match[2])
    return lambda hits: compare(hits, number)


def always(_: int) -> bool:
    """The hit condition of a breakpoint without one."""
    return True


@dataclass(slots=True)
class Breakpoint:
    """A place to hold at, or to tell a message at.

    condition: hold only when it is not 0; message: tell it instead of holding
    fault: what cannot be read in its texts: it holds each time, and says this
    Build one from texts with `make`.
    """

    number: int
    address: int
    condition: Expression | None = None
    enough: Callable[[int], bool] = always
    message: Callable[[Read], str] | None = None
    fault: str = ""
    hits: int = field(default=0, compare=False)

    @classmethod
    def make(
        cls, number: int, address: int, condition: str = "", hits: str = "", message: str = ""
    ) -> Breakpoint:
        """A breakpoint from its text; one that cannot be read holds each time, with the reason in `fault`."""
        made = cls(number, address)
        try:
            made.condition = compile_expression(condition) if condition.strip() else None
            made.enough = compile_hits(hits) if hits.strip() else always
            made.message = compile_message(message) if message else None
        except ExpressionError as error:
            made.fault = f"the breakpoint cannot be read: {error}"
        return made


class StopControl:
    """Breakpoints and the step under way.

    read: gives the values of names in conditions and messages
    say: takes the messages of log points, with their addresses
    """

    def __init__(self, read: Read, say: Callable[[str, int], None]) -> None:
        self._read = read
        self._say = say
        self._breakpoints: dict[int, list[Breakpoint]] = {}
        self._depth: int | None = None
        self._reason: Reason | None = None

    @property
    def idle(self) -> bool:
        """Whether no command has to be checked before it is executed."""
        return not self._breakpoints and self._reason is None

    @property
    def breakpoints(self) -> list[Breakpoint]:
        """All breakpoints."""
        return [breakpoint_ for row in self._breakpoints.values() for breakpoint_ in row]

    @property
    def addresses(self) -> frozenset[int] | None:
        """Of the commands that have to be checked before they are executed; None: of all."""
        return None if self._reason is not None else frozenset(self._breakpoints)

    def set_breakpoints(self, breakpoints: Iterable[Breakpoint]) -> None:
        """Take these instead of the present ones; those with a number from before keep their hits."""
        hits = self.hits()
        self._breakpoints.clear()
        for breakpoint_ in breakpoints:
            breakpoint_.hits = hits.get(breakpoint_.number, breakpoint_.hits)
            self._breakpoints.setdefault(breakpoint_.address, []).append(breakpoint_)

    def hits(self) -> dict[int, int]:
        """How often each breakpoint was met with its condition true, by its number."""
        return {breakpoint_.number: breakpoint_.hits for breakpoint_ in self.breakpoints}

    def forget_hits(self) -> None:
        """Count from 0 again."""
        for breakpoint_ in self.breakpoints:
            breakpoint_.hits = 0

    def step(self, depth: int | None, reason: Reason = "step") -> None:
        """Hold before the next command with no more than `depth` CSUBs open; None: whatever is open."""
        self._depth, self._reason = depth, reason

    def clear_step(self) -> None:
        """No step is under way any more."""
        self._reason = None

    def concerns(self, address: int) -> bool:
        """Whether `look` may do anything before the command at `address`."""
        return self._reason is not None or address in self._breakpoints

    def look(self, address: int, depth: int) -> Stop | None:
        """Whether to hold before the command at `address`, with `depth` CSUBs open; counts hits, tells messages."""
        stop = None
        met = {
            b.number: why
            for b in self._breakpoints.get(address, ())
            if (why := self._why_hold(b)) is not None
        }
        if met:
            stop = Stop("breakpoint", address, "; ".join(filter(None, met.values())), tuple(met))
        elif self._reason is not None and (self._depth is None or depth <= self._depth):
            stop = Stop(self._reason, address)
        if stop is not None:
            self._reason = None
        return stop

    def _why_hold(self, breakpoint_: Breakpoint) -> str | None:
        """None where a breakpoint does not hold now; else what is wrong with it, empty where nothing is."""
        fault = breakpoint_.fault
        try:
            if breakpoint_.condition is not None and not breakpoint_.condition(self._read):
                return None
        except ExpressionError as error:
            fault = f"the condition has no value: {error}"
        breakpoint_.hits += 1
        if fault or not breakpoint_.enough(breakpoint_.hits):
            return fault or None
        if breakpoint_.message is not None:
            self._say(breakpoint_.message(self._read), breakpoint_.address)
            return None
        return ""
