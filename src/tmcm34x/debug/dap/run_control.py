"""Going on, holding and stepping, as the editor asks for it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

from tmcm34x.debug.dap import messages as m
from tmcm34x.debug.dap.debuggee import Debuggee, Request
from tmcm34x.debug.dap.inspection import Inspector
from tmcm34x.debug.sessions.base import Session
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.mnemonic import format_instruction

THREAD: Final = 1
"""The one thread of a module: its stand-alone program."""


class RunControl:
    """Requests that let the program go on or hold it.

    afterwards: calls a function after the response to the present request
    end: ends the debugging session
    """

    def __init__(
        self,
        debuggee: Debuggee,
        inspector: Inspector,
        afterwards: Callable[[Callable[[], None]], None],
        end: Callable[[], None],
    ) -> None:
        self._debuggee = debuggee
        self._inspector = inspector
        self._afterwards = afterwards
        self._end = end

    def on_threads(self, _: m.Arguments) -> dict[str, Any]:
        """There is one program."""
        return {"threads": [{"id": THREAD, "name": "TMCL program"}]}

    def on_continue(self, _: m.Arguments) -> dict[str, Any]:
        """Go on."""
        self._go(lambda target: target.resume())
        return {"allThreadsContinued": True}

    def on_next(self, _: m.Arguments) -> None:
        """One command, a CSUB with all that it calls."""
        self._go(lambda target: target.step_over())

    def on_step_in(self, _: m.Arguments) -> None:
        """One command."""
        self._go(lambda target: target.step_in())

    def on_step_out(self, _: m.Arguments) -> None:
        """Until the CSUB has returned."""
        self._go(lambda target: target.step_out())

    def on_step_back(self, arguments: m.StepBack) -> None:
        """One command back; a CSUB with all that it called counts as one, but for single instructions."""
        target = self._debuggee.held
        self._inspector.forget()
        target.step_back(over=arguments.granularity != "instruction")

    def on_reverse_continue(self, _: m.Arguments) -> None:
        """Back to where a breakpoint holds, or to the beginning."""
        target = self._debuggee.held
        self._inspector.forget()
        target.reverse_continue()

    def on_pause(self, _: m.Arguments) -> None:
        """Hold."""
        self._debuggee.running_or_held.pause()

    def _go(self, how: Callable[[Session], None]) -> None:
        target = self._debuggee.held
        if target.over:
            self._afterwards(self._end)
            return
        self._inspector.forget()
        target.check_ready()
        how(target)

    def on_goto_targets(self, arguments: m.Lines) -> dict[str, Any]:
        """Where to go on: the command at a line, and every label."""
        sources = self._debuggee.sources
        address = sources.address(sources.key(arguments.source), arguments.line)
        targets: list[dict[str, Any]] = []
        if address is not None:
            text = format_instruction(self._debuggee.instruction(address) or Instruction(0))
            targets.append(self._goto_target(address, f"{address}: {text}"))
        labels = {} if sources.assembly is None else sources.assembly.labels
        targets += [self._goto_target(at, f"{name}:") for name, at in labels.items() if at != address]
        return {"targets": targets}

    def _goto_target(self, address: int, label: str) -> dict[str, Any]:
        line = self._debuggee.sources.place(address).get("line", 0)
        reference = hex(address)
        return {"id": address, "label": label, "line": line, "instructionPointerReference": reference}

    def on_goto(self, arguments: m.Goto) -> None:
        """Go on elsewhere."""
        self._debuggee.held.jump(arguments.target_id)
        self._moved("goto")

    def on_restart_frame(self, arguments: m.RestartFrame) -> None:
        """Go back to the first command of a routine."""
        self._debuggee.held.restart_frame(arguments.frame_id)
        self._moved("restart")

    def _moved(self, reason: str) -> None:
        self._inspector.forget()
        event = self._debuggee.event
        self._afterwards(lambda: event("stopped", reason=reason, threadId=THREAD, allThreadsStopped=True))


REQUESTS: Final[Mapping[str, Request]] = {
    "threads": Request(m.Arguments, RunControl.on_threads, needs_target=False),
    "continue": Request(m.Arguments, RunControl.on_continue),
    "next": Request(m.Arguments, RunControl.on_next),
    "stepIn": Request(m.Arguments, RunControl.on_step_in),
    "stepOut": Request(m.Arguments, RunControl.on_step_out),
    "stepBack": Request(m.StepBack, RunControl.on_step_back),
    "reverseContinue": Request(m.Arguments, RunControl.on_reverse_continue),
    "pause": Request(m.Arguments, RunControl.on_pause),
    "gotoTargets": Request(m.Lines, RunControl.on_goto_targets),
    "goto": Request(m.Goto, RunControl.on_goto),
    "restartFrame": Request(m.RestartFrame, RunControl.on_restart_frame),
}
