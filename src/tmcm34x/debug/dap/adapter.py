"""The Debug Adapter Protocol over a program on a virtual module, or in a real one.

`Adapter` takes messages and sends messages; it knows no transport.  Between messages its owner calls `work`, which
lets a slice of virtual time pass or reads the state of a real module, and returns when it must be called again.

Each request has one method, `on_` and its name in snake case, here or in a part (`breakpoints`, `inspection`,
`run_control`); the type of its argument (see `messages`) checks what the editor sent.  What a user can mend is a
`RequestError` and becomes an error response.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final, cast

import msgspec

from tmcm34x.debug.branches import HistoryError
from tmcm34x.debug.breaks import BREAKS
from tmcm34x.debug.control import Stop
from tmcm34x.debug.dap import breakpoints, data_breakpoints, inspection, run_control
from tmcm34x.debug.dap import messages as m
from tmcm34x.debug.dap.breakpoints import Breakpoints
from tmcm34x.debug.dap.data_breakpoints import DataBreakpoints
from tmcm34x.debug.dap.debuggee import Debuggee, Request
from tmcm34x.debug.dap.inspection import Inspector
from tmcm34x.debug.dap.launching import Launcher, Services
from tmcm34x.debug.dap.messages import RequestError
from tmcm34x.debug.dap.run_control import THREAD, RunControl
from tmcm34x.debug.dap.sources import Sources
from tmcm34x.debug.expressions import ExpressionError
from tmcm34x.debug.sessions.base import NOTHING_TO_DO, Session
from tmcm34x.debug.sessions.search import UnfinishedError
from tmcm34x.host import HostError
from tmcm34x.toolchain.assembler import Assembly

_REASONS: Final = {
    "entry": "Held before the first command",
    "breakpoint": "Held at a breakpoint",
    "data breakpoint": "Held after a change",
    "step": "Held after a step",
    "pause": "Paused",
    "exception": "Held by a break",
    "goto": "Brought back",
    "end": "The program has stopped",
}

_SHOWN_IN_PLACE: Final = frozenset({"evaluate", "variables", "setVariable", "setExpression", "completions"})
"""Requests whose errors editors show where the value would be: a dialog would only be in the way."""

Send = Callable[[dict[str, Any]], None]

CAPABILITIES: Final = {
    **dict.fromkeys((
        "supportsConfigurationDoneRequest", "supportsConditionalBreakpoints", "supportsHitConditionalBreakpoints",
        "supportsLogPoints", "supportsFunctionBreakpoints", "supportsInstructionBreakpoints",
        "supportsDataBreakpoints", "supportsSetVariable", "supportsSetExpression", "supportsEvaluateForHovers",
        "supportsRestartRequest", "supportsStepBack", "supportsRestartFrame", "supportsTerminateRequest",
        "supportTerminateDebuggee", "supportsExceptionFilterOptions",
        "supportsBreakpointLocationsRequest", "supportsExceptionInfoRequest", "supportsGotoTargetsRequest",
        "supportsDisassembleRequest", "supportsLoadedSourcesRequest", "supportsValueFormattingOptions",
        "supportsCompletionsRequest", "supportsDelayedStackTraceLoading",
    ), True),
    "exceptionBreakpointFilters": [
        {
            "filter": row.key, "label": row.label, "default": row.default, "description": row.meaning,
            "supportsCondition": True, "conditionDescription": "an expression, such as gp[1] > 3",
        }
        for row in BREAKS.values()
    ],
}  # fmt: skip


class Adapter:
    """One debugging session with one editor.

    send: takes each message to the editor
    """

    def __init__(self, send: Send, services: Services) -> None:
        self.over = False
        """The editor has disconnected: nothing more will be sent."""
        self._send = send
        self._sources = Sources(services.folder)
        self._debuggee = Debuggee(self._sources, self._event)
        self._breakpoints = Breakpoints(self._debuggee)
        self._inspector = Inspector(self._debuggee)
        self._launcher = Launcher(services, self._sources, self, self._output)
        self._run_control = RunControl(self._debuggee, self._inspector, self._afterwards, self._end)
        self._parts: tuple[tuple[object, Mapping[str, Request]], ...] = (
            (self, _REQUESTS),
            (self._breakpoints, breakpoints.REQUESTS),
            (self._inspector, inspection.REQUESTS),
            (self._run_control, run_control.REQUESTS),
            (DataBreakpoints(self._debuggee, self._inspector), data_breakpoints.REQUESTS),
        )
        self._seq = 0
        self._launch: m.Launch | None = None
        self._attach: m.Attach | None = None
        self._configured = False
        self._ended = False
        self._deferred: list[Callable[[], None]] | None = None
        """What to tell after the response to the request being done; None between requests."""

    @property
    def target(self) -> Session | None:
        """The program being debugged, once there is one."""
        return self._debuggee.target

    # Messages

    def handle(self, message: Any) -> None:
        """Do what a message from the editor asks for.

        Raises `UnfinishedError` where the session keeps searches apart: call it again when the search has run.
        """
        if not isinstance(message, dict):
            self._respond(0, "", error="no message of the protocol")
            return
        fields = cast("dict[str, Any]", message)
        command, seq = fields.get("command"), fields.get("seq")
        if fields.get("type") == "response":
            return
        if not isinstance(command, str) or not isinstance(seq, int):
            self._respond(seq if isinstance(seq, int) else 0, str(command or "")[:100], error="no request")
            return
        self._deferred = []
        try:
            body = self._handle(command, fields.get("arguments"))
        except (RequestError, ExpressionError, HistoryError, HostError) as error:
            self._respond(seq, command, error=str(error))
        except UnfinishedError:
            self._deferred = None
            raise
        else:
            self._respond(seq, command, body=body)
            if command == "disconnect":
                self.over = True
        deferred, self._deferred = self._deferred, None
        for tell in deferred:
            tell()

    def _handle(self, command: str, arguments: Any) -> Any:
        part, row = self._handler(command)
        if row.needs_target and self.target is None:
            raise RequestError(f"{command} needs a program: launch or attach first")
        try:
            converted = msgspec.convert(arguments if arguments is not None else {}, row.kind)
        except msgspec.ValidationError as error:
            raise RequestError(f"{command}: {error}") from None
        return row.handler(part, converted)

    def _handler(self, command: str) -> tuple[object, Request]:
        """The part of this adapter that does a request, and how."""
        for part, requests in self._parts:
            if command in requests:
                return part, requests[command]
        raise RequestError(f"{command[:100]} is not supported")

    def _respond(self, request: int, command: str, *, body: Any = None, error: str = "") -> None:
        message: dict[str, Any] = {"type": "response", "request_seq": request, "command": command}
        message["success"] = not error
        if error:
            message["message"] = error
            text = error.replace("{", "(").replace("}", ")")
            body = {"error": {"id": 1, "format": text, "showUser": command not in _SHOWN_IN_PLACE}}
        if body is not None:
            message["body"] = body
        self._emit(message)

    def _event(self, name: str, **body: Any) -> None:
        self._emit({"type": "event", "event": name, "body": body})

    def _emit(self, message: dict[str, Any]) -> None:
        self._seq += 1
        self._send({"seq": self._seq, **message})

    def _output(self, text: str, category: str = "console", place: Mapping[str, Any] | None = None) -> None:
        self._event("output", category=category, output=text + "\n", **(place or {}))

    # Time

    def work(self) -> float:
        """Do a piece of work; returns in how many seconds to call again, infinite if only a message can help."""
        target = self.target
        if target is None or self.over:
            return NOTHING_TO_DO
        try:
            return target.work()
        except HostError as error:
            self._output(f"The module does not answer any more: {error}", "stderr")
            self._end()
            return NOTHING_TO_DO

    # What becomes of the program (Listener)

    def held(self, stop: Stop) -> None:
        """The program is held."""
        reason = "pause" if stop.reason == "end" else stop.reason
        description = BREAKS[stop.exception].label if stop.exception else _REASONS[stop.reason]
        body: dict[str, Any] = {"reason": reason, "description": description, "threadId": THREAD}
        body["allThreadsStopped"] = True
        if stop.text:
            body["text"] = stop.text
        if stop.breakpoints:
            body["hitBreakpointIds"] = list(stop.breakpoints)
        self._inspector.forget()
        self._afterwards(lambda: self._event("stopped", **body))
        if stop.text and stop.breakpoints:
            self._afterwards(lambda: self._output(f"Held at a breakpoint: {stop.text}.", "stderr"))

    def ended(self) -> None:
        """The program has stopped, and nothing it has begun is still going on."""
        target, launch = self._debuggee.running_or_held, self._launch
        if not target.owns_time or (launch is not None and launch.stop_at_end and not launch.no_debug):
            self.held(Stop("end", target.frames()[0].address))
        else:
            self._afterwards(self._end)

    def said(self, text: str, address: int) -> None:
        """A log point was passed."""
        self._output(text, place=self._sources.place(address))

    def _afterwards(self, tell: Callable[[], None]) -> None:
        """Do what a request brings about after its response."""
        if self._deferred is None:
            tell()
        else:
            self._deferred.append(tell)

    def _end(self) -> None:
        if not self._ended:
            self._ended = True
            target = self.target
            if target is not None and (epilogue := target.epilogue()):
                self._output(epilogue)
            self._event("exited", exitCode=0 if target is None else target.exit_code)
            self._event("terminated")

    # Beginning

    def on_initialize(self, arguments: m.Initialize) -> dict[str, Any]:
        """Tell what we can."""
        self._sources.base = 1 if arguments.lines_start_at1 else 0
        return CAPABILITIES

    def on_launch(self, arguments: m.Launch) -> None:
        """Assemble a program and put it into a module of its own."""
        self._expect_no_target()
        self._breakpoints.ignored = arguments.no_debug
        self._debuggee.target = self._launcher.launch(arguments)
        self._launch = arguments
        self._afterwards(lambda: self._event("initialized"))

    def _expect_no_target(self) -> None:
        if self.target is not None:
            raise RequestError("there is a program already")

    def on_attach(self, arguments: m.Attach) -> None:
        """Take a module as it is."""
        self._expect_no_target()
        self._debuggee.target = self._launcher.attach(arguments)
        self._debuggee.share_sources()
        self._attach = arguments
        self._afterwards(self._tell_limits)
        self._afterwards(lambda: self._event("initialized"))

    def _tell_limits(self) -> None:
        """Withdraw the capabilities that this module does not have."""
        target = self._debuggee.running_or_held
        if target.irreversible:
            self._event("capabilities", capabilities={"supportsStepBack": False})

    def on_configuration_done(self, _: m.Arguments) -> None:
        """Breakpoints are set: begin."""
        if self._configured:
            return
        self._configured = True
        self._afterwards(self._begin)

    def _begin(self) -> None:
        self._breakpoints.arm()
        if self._launch is not None:
            hold = self._launch.stop_on_entry and not self._launch.no_debug
        else:
            hold = self._attach is not None and self._attach.stop_on_entry
        self._debuggee.running_or_held.begin(hold=hold)

    def on_restart(self, arguments: m.Restart) -> None:
        """Begin anew: a new bench with the sources as they are now; a live module's program is reset and run."""
        target = self._debuggee.running_or_held
        if self._launch is not None:
            self._launch_again(target, self._launch, arguments)
        else:
            target.check_ready()
            target.restart()
        self._inspector.forget()

    def _launch_again(self, session: Session, launch: m.Launch, arguments: m.Restart) -> None:
        if arguments.arguments is not None:
            try:
                launch = msgspec.convert(arguments.arguments, m.Launch)
            except msgspec.ValidationError as error:
                raise RequestError(f"restart: {error}") from None
        self._debuggee.target = self._launcher.launch(launch)
        session.close()
        self._launch = launch
        self._breakpoints.ignored = launch.no_debug
        self._breakpoints.place_again()
        self._ended = False
        self._afterwards(self._begin)

    # What whoever runs this adapter does to its module meanwhile

    def know(self, assembly: Assembly | None) -> None:
        """The program in the module comes from this text now, or its source is unknown."""
        self._sources.take(assembly)
        self._debuggee.share_sources()
        if self.target is not None:
            self.target.loaded(() if assembly is None else assembly.program)
        self._inspector.forget()
        self._breakpoints.place_again()

    def release(self) -> None:
        """The program was stopped, reset or started by a command; a module in this process shows it by itself."""
        if self.target is not None:
            self.target.controlled()
        self._inspector.forget()

    def hits(self) -> dict[int, int]:
        """How often each breakpoint was met, by the number that its answer had."""
        return {} if self.target is None else self.target.hits()

    # Ending

    def on_terminate(self, _: m.Arguments) -> None:
        """Stop the program."""
        target = self.target
        if target is not None and not target.owns_time:
            target.pause()
        self._afterwards(self._end)

    def on_disconnect(self, arguments: m.Disconnect) -> None:
        """Detach; the program of a real module runs on unless the client asks to end it."""
        target = self.target
        if target is not None:
            target.set_breakpoints([])
            if arguments.terminate_debuggee and not target.owns_time and target.running:
                target.pause()
        self.close()

    def close(self) -> None:
        """The editor is gone: hang up."""
        target, self._debuggee.target = self.target, None
        if target is not None:
            target.close()
        self._launcher.close()


_REQUESTS: Final[Mapping[str, Request]] = {
    "initialize": Request(m.Initialize, Adapter.on_initialize, needs_target=False),
    "launch": Request(m.Launch, Adapter.on_launch, needs_target=False),
    "attach": Request(m.Attach, Adapter.on_attach, needs_target=False),
    "configurationDone": Request(m.Arguments, Adapter.on_configuration_done),
    "restart": Request(m.Restart, Adapter.on_restart),
    "terminate": Request(m.Arguments, Adapter.on_terminate, needs_target=False),
    "disconnect": Request(m.Disconnect, Adapter.on_disconnect, needs_target=False),
}
