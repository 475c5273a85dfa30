"""Breakpoints as the editor asks for them, at lines, labels and addresses, brought to the program."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from tmcm34x.debug.breaks import BREAKS
from tmcm34x.debug.control import Breakpoint
from tmcm34x.debug.dap import messages as m
from tmcm34x.debug.dap.debuggee import Debuggee, Request, parse_address
from tmcm34x.debug.dap.messages import RequestError
from tmcm34x.debug.expressions import Expression, ExpressionError, compile_expression

_LABELS: Final = "<labels>"
_ADDRESSES: Final = "<addresses>"
MOST_TEXT: Final = 1 << 20
"""Characters of all breakpoints together, those of a breakpoint itself being `_FIXED`."""
_FIXED: Final = 100
_NOWHERE: Final = "no command of the program at this line or below it"

_NOT_LOADED: Final = "this file is not in the module's program: download it first"

Answers = list[dict[str, Any]]


class Breakpoints:
    """All that were asked for, whether or not the program has a place for them."""

    def __init__(self, debuggee: Debuggee) -> None:
        self.ignored = False
        """Run without holding anywhere."""
        self._breaks: dict[str, Expression | None] = {row.key: None for row in BREAKS.values() if row.default}
        self._debuggee = debuggee
        self._numbers = 0
        self._wanted: dict[str, list[m.SourceBreakpoint]] = {}
        """By key of the source, or by what else they name."""
        self._numbered: dict[str, list[int]] = {}

    def on_set_breakpoints(self, arguments: m.SetBreakpoints) -> dict[str, Any]:
        """All breakpoints of one source."""
        wanted = arguments.breakpoints
        if wanted is None:
            wanted = [m.SourceBreakpoint(line=line) for line in arguments.lines or ()]
        return self._set(self._debuggee.sources.key(arguments.source), wanted)

    def on_set_function_breakpoints(self, arguments: m.SetOtherBreakpoints) -> dict[str, Any]:
        """All breakpoints at labels."""
        return self._set(_LABELS, arguments.breakpoints)

    def on_set_instruction_breakpoints(self, arguments: m.SetOtherBreakpoints) -> dict[str, Any]:
        """All breakpoints at addresses."""
        return self._set(_ADDRESSES, arguments.breakpoints)

    def on_set_exception_breakpoints(self, arguments: m.SetExceptionBreakpoints) -> dict[str, Any]:
        """Which breaks are in force; the answers come in the order in which they were asked for."""
        self._breaks = {}
        asked = [*map(m.FilterOption, arguments.filters), *arguments.filter_options]
        answers = [self._choose(option) for option in asked]
        self.arm()
        return {"breakpoints": answers}

    def _choose(self, option: m.FilterOption) -> dict[str, Any]:
        try:
            if option.filter_id not in BREAKS:
                raise RequestError(f"no break {option.filter_id!r}; there are {', '.join(BREAKS)}")
            condition = (option.condition or "").strip()
            self._breaks[option.filter_id] = compile_expression(condition) if condition else None
        except (RequestError, ExpressionError) as error:
            return {"verified": False, "message": str(error)}
        return {"verified": True}

    def on_breakpoint_locations(self, arguments: m.Lines) -> dict[str, Any]:
        """Lines with commands."""
        sources = self._debuggee.sources
        last = arguments.line if arguments.end_line is None else arguments.end_line
        lines = sources.lines(sources.key(arguments.source))
        return {"breakpoints": [{"line": line} for line in lines if arguments.line <= line <= last]}

    def arm(self) -> None:
        """Have the program held by the breaks in force."""
        target = self._debuggee.target
        if target is not None:
            target.set_breaks({} if self.ignored else self._breaks)

    def place_again(self) -> None:
        """The program is another one, or another text: tell the editor where its breakpoints are now."""
        for answers in self._place_all().values():
            for answer in answers:
                self._debuggee.event("breakpoint", reason="changed", breakpoint=answer)

    def _set(self, key: str, wanted: list[m.SourceBreakpoint]) -> dict[str, Any]:
        others = {other: points for other, points in self._wanted.items() if other != key and points}
        if _size(others) + _size({key: wanted}) > MOST_TEXT:
            raise RequestError("these are more breakpoints than are kept: remove others first")
        first = self._numbers + 1
        self._numbers += len(wanted)
        self._wanted = {**others, key: wanted}
        self._numbered = {other: self._numbered[other] for other in others}
        self._numbered[key] = list(range(first, self._numbers + 1))
        return {"breakpoints": self._place_all()[key]}

    def _place_all(self) -> Mapping[str, Answers]:
        made: list[Breakpoint] = []
        answers = {
            key: [
                self._place(key, number, point, made)
                for number, point in zip(self._numbered[key], wanted, strict=True)
            ]
            for key, wanted in self._wanted.items()
        }
        self._debuggee.running_or_held.set_breakpoints([] if self.ignored else made)
        return answers

    def _place(
        self, key: str, number: int, wanted: m.SourceBreakpoint, made: list[Breakpoint]
    ) -> dict[str, Any]:
        try:
            address = self._address(key, wanted)
        except RequestError as error:
            answer: dict[str, Any] = {"id": number, "verified": False, "message": str(error)}
            return answer | ({"line": wanted.line} if wanted.line else {})
        texts = (wanted.condition or "", wanted.hit_condition or "", wanted.log_message or "")
        placed = Breakpoint.make(number, address, *texts)
        made.append(placed)
        message = placed.fault or self._debuggee.running_or_held.steps_for_breakpoints
        told = {"message": message} if message else {}
        place = self._debuggee.sources.place(address)
        return {"id": number, "verified": True, "instructionReference": hex(address), **told, **place}

    def _address(self, key: str, wanted: m.SourceBreakpoint) -> int:
        if key == _ADDRESSES:
            return parse_address(wanted.instruction_reference) + wanted.offset
        sources = self._debuggee.sources
        if key == _LABELS:
            symbol = sources.symbols.get(wanted.name.upper())
            if symbol is None or symbol.kind != "label":
                raise RequestError(f"no label {wanted.name}")
            return int(symbol.value)
        if not sources.has(key):
            raise RequestError(_NOT_LOADED)
        address = sources.address(key, wanted.line)
        if address is None:
            raise RequestError(_NOWHERE)
        return address


def _size(wanted: Mapping[str, list[m.SourceBreakpoint]]) -> int:
    """About how much is kept of breakpoints, in characters."""
    texts = sum(
        len(text or "")
        for points in wanted.values()
        for point in points
        for text in (point.condition, point.hit_condition, point.log_message, point.name)
    )
    return texts + sum(len(key) + _FIXED * len(points) for key, points in wanted.items())


REQUESTS: Final[Mapping[str, Request]] = {
    "setBreakpoints": Request(m.SetBreakpoints, Breakpoints.on_set_breakpoints),
    "setFunctionBreakpoints": Request(m.SetOtherBreakpoints, Breakpoints.on_set_function_breakpoints),
    "setInstructionBreakpoints": Request(m.SetOtherBreakpoints, Breakpoints.on_set_instruction_breakpoints),
    "setExceptionBreakpoints": Request(
        m.SetExceptionBreakpoints, Breakpoints.on_set_exception_breakpoints, needs_target=False
    ),
    "breakpointLocations": Request(m.Lines, Breakpoints.on_breakpoint_locations),
}
