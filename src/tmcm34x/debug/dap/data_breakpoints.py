"""Data breakpoints as the editor asks for them: values whose changes hold the program."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from tmcm34x.debug.dap import messages as m
from tmcm34x.debug.dap.debuggee import Debuggee, Request
from tmcm34x.debug.dap.inspection import Inspector
from tmcm34x.debug.dap.messages import RequestError
from tmcm34x.debug.expressions import ExpressionError
from tmcm34x.debug.watches import WatchedValue


class DataBreakpoints:
    """Requests about data breakpoints; they are named by the expression they watch."""

    def __init__(self, debuggee: Debuggee, inspector: Inspector) -> None:
        self._debuggee = debuggee
        self._inspector = inspector
        self._numbers = 0

    def on_data_breakpoint_info(self, arguments: m.DataBreakpointInfo) -> dict[str, Any]:
        """Whether a value can be watched, and by which identifier."""
        session = self._debuggee.running_or_held
        text = self._inspector.expression(arguments.variables_reference, arguments.name)
        reason = session.unwatchable
        if not reason:
            try:
                session.view.evaluate(WatchedValue.make(0, text).watched)
            except ExpressionError as error:
                reason = str(error)
        if reason:
            return {"dataId": None, "description": reason}
        return {"dataId": text, "description": text, "accessTypes": ["write"], "canPersist": True}

    def on_set_data_breakpoints(self, arguments: m.SetDataBreakpoints) -> dict[str, Any]:
        """All data breakpoints, instead of the present ones."""
        watches: list[WatchedValue] = []
        answers = [self._place(wanted, watches) for wanted in arguments.breakpoints]
        self._debuggee.running_or_held.set_watches(watches)
        return {"breakpoints": answers}

    def _place(self, wanted: m.DataBreakpoint, watches: list[WatchedValue]) -> dict[str, Any]:
        self._numbers += 1
        reason = self._debuggee.running_or_held.unwatchable
        try:
            if reason:
                raise RequestError(reason)
            watches.append(
                WatchedValue.make(
                    self._numbers, wanted.data_id, wanted.condition or "", wanted.hit_condition or ""
                )
            )
        except (RequestError, ExpressionError) as error:
            return {"id": self._numbers, "verified": False, "message": str(error)}
        return {"id": self._numbers, "verified": True}


REQUESTS: Final[Mapping[str, Request]] = {
    "dataBreakpointInfo": Request(m.DataBreakpointInfo, DataBreakpoints.on_data_breakpoint_info),
    "setDataBreakpoints": Request(m.SetDataBreakpoints, DataBreakpoints.on_set_data_breakpoints),
}
