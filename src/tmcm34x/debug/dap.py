"""The Debug Adapter Protocol over a program on a virtual module, or in a real one.

`Adapter` takes messages and sends messages; it knows no transport.  Between messages somebody calls `work`, which
lets a piece of virtual time pass or looks at a real module, and tells when it wants to be called again.

Each request has one method, `on_` and its name in snake case, here or in a part (`breakpoints`, `inspection`); the
type of its argument (see `messages`) checks what the editor sent.  What a user can mend is a `RequestError` and
becomes an error response.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple, Protocol, TypeVar, cast

import msgspec

from tmcm34x import clock
from tmcm34x.bench import BenchError, Rig, load, simple_rig
from tmcm34x.board.models import MODELS
from tmcm34x.debug import breakpoints, inspection
from tmcm34x.debug import messages as m
from tmcm34x.debug.breakpoints import REFUSED, UNBREAKABLE, Breakpoints
from tmcm34x.debug.control import Stop
from tmcm34x.debug.debuggee import Debuggee, Request, Target
from tmcm34x.debug.expressions import ExpressionError
from tmcm34x.debug.inspection import Inspector
from tmcm34x.debug.messages import RequestError
from tmcm34x.debug.remote import RemoteSession
from tmcm34x.debug.session import Listener, LiveSession, Session, error_text
from tmcm34x.debug.sources import Sources
from tmcm34x.host import Connection, HostError
from tmcm34x.host import Module as HostModule
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.mnemonic import format_instruction
from tmcm34x.toolchain.assembler import Assembly
from tmcm34x.toolchain.diagnostics import Location, render

SLICE_S: Final = 0.02
"""Longest work between two looks at the editor."""
MAX_LAG_S: Final = 1.0
"""A bench that lags more than this behind the wall clock gives up catching up."""
LIVE_POLL_S: Final = 0.05

THREAD: Final = 1
_MODELS: Final = tuple(MODELS)
_REASONS: Final = {
    "entry": "Held before the first command",
    "breakpoint": "Held at a breakpoint",
    "step": "Held after a step",
    "pause": "Paused",
    "exception": "A command was refused",
    "end": "The program has stopped",
}

_SHOWN_IN_PLACE: Final = frozenset({"evaluate", "variables", "setVariable", "setExpression", "completions"})
"""Requests whose errors editors show where the value would be: a dialog would only be in the way."""

Send = Callable[[dict[str, Any]], None]
TargetType = TypeVar("TargetType", bound=Target)


class Pacing(Protocol):
    """How virtual time follows the wall clock: `server.pace.Pace` is one."""

    monotonic: Callable[[], float]

    def draw(self, now: int) -> None:
        """Begin a new line here."""
        ...

    def target(self) -> int:
        """The clock that virtual time should show now."""
        ...

    def due_s(self, when: int) -> float:
        """The wall clock's time at which `when` is due [s]."""
        ...


class Services(NamedTuple):
    """What the adapter needs of the world outside.

    read_program: the assembly of a source or an image, by path and include folders; raises `RequestError`
    pace: makes a pacing of a speed
    live: opens the module of whoever runs this adapter, for `attach` without a port
    folder: where relative file names begin
    """

    read_program: Callable[[str, Sequence[str]], Assembly]
    pace: Callable[[float], Pacing]
    live: Callable[[Listener], LiveSession | RemoteSession] | None = None
    folder: Path = Path()


CAPABILITIES: Final = {
    **dict.fromkeys((
        "supportsConfigurationDoneRequest", "supportsConditionalBreakpoints", "supportsHitConditionalBreakpoints",
        "supportsLogPoints", "supportsFunctionBreakpoints", "supportsInstructionBreakpoints", "supportsSetVariable",
        "supportsSetExpression", "supportsEvaluateForHovers", "supportsRestartRequest", "supportsTerminateRequest",
        "supportTerminateDebuggee", "supportsBreakpointLocationsRequest", "supportsExceptionInfoRequest",
        "supportsGotoTargetsRequest", "supportsDisassembleRequest", "supportsLoadedSourcesRequest",
        "supportsValueFormattingOptions", "supportsCompletionsRequest", "supportsDelayedStackTraceLoading",
    ), True),
    "exceptionBreakpointFilters": [{
        "filter": REFUSED, "label": "Commands the module refuses", "default": True,
        "description": "Stop after a command that was answered with an error status, and at an end without STOP",
    }],
}  # fmt: skip


class Adapter:
    """One debugging session with one editor.

    send: takes each message to the editor
    """

    def __init__(self, send: Send, services: Services) -> None:
        self.over = False
        """The editor has disconnected: nothing more will be sent."""
        self._send = send
        self._services = services
        self._sources = Sources(services.folder)
        self._debuggee = Debuggee(self._sources, self._event)
        self._breakpoints = Breakpoints(self._debuggee)
        self._inspector = Inspector(self._debuggee)
        self._parts: tuple[tuple[object, Mapping[str, Request]], ...] = (
            (self, _REQUESTS),
            (self._breakpoints, breakpoints.REQUESTS),
            (self._inspector, inspection.REQUESTS),
        )
        self._seq = 0
        self._connection: Connection | None = None
        self._launch: m.Launch | None = None
        self._attach: m.Attach | None = None
        self._configured = False
        self._ended = False
        self._pace: Pacing | None = None
        self._deferred: list[Callable[[], None]] | None = None
        """What to tell after the response to the request being done; None between requests."""

    @property
    def target(self) -> Target | None:
        """The program being debugged, once there is one."""
        return self._debuggee.target

    # Messages

    def receive(self, message: Any) -> None:
        """Take a message from the editor."""
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
        except (RequestError, ExpressionError, HostError) as error:
            self._respond(seq, command, error=str(error))
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
        """Do a piece of work; gives back in how many seconds to call again, infinite if only a message can help."""
        target = self.target
        if isinstance(target, LiveSession):
            target.look()
            return LIVE_POLL_S
        if target is None or self.over or not target.running:
            return math.inf
        if isinstance(target, Session):
            return self._pass_time(target, cast("Pacing", self._pace))
        try:
            return target.poll()
        except HostError as error:
            self._output(f"The module does not answer any more: {error}", "stderr")
            self._end()
            return math.inf

    def _pass_time(self, session: Session, pace: Pacing) -> float:
        end_s = pace.monotonic() + SLICE_S
        reached = session.advance(pace.target(), lambda: pace.monotonic() >= end_s)
        if not session.running:
            return math.inf
        due_s = pace.due_s(session.rig.now if not reached else session.rig.next_event())
        if not reached:
            if pace.monotonic() - due_s > MAX_LAG_S:
                pace.draw(session.rig.now)
            return 0.0
        if session.rig.next_event() >= clock.NEVER:
            return math.inf
        return max(0.0, due_s - pace.monotonic())

    # What becomes of the program (Listener)

    def held(self, stop: Stop) -> None:
        """The program is held."""
        reason = "pause" if stop.reason == "end" else stop.reason
        body: dict[str, Any] = {"reason": reason, "description": _REASONS[stop.reason], "threadId": THREAD}
        body["allThreadsStopped"] = True
        if stop.text:
            body["text"] = stop.text
        if stop.breakpoints:
            body["hitBreakpointIds"] = list(stop.breakpoints)
        self._inspector.forget()
        self._afterwards(lambda: self._event("stopped", **body))

    def ended(self) -> None:
        """The program has stopped, and nothing it has begun is still going on."""
        target = self._debuggee.running_or_held
        if not isinstance(target, Session):
            self.held(Stop("end", 0))
        elif self._launch is not None and self._launch.stop_at_end and not self._launch.no_debug:
            self.held(Stop("end", target.program.counter))
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
            failed = isinstance(target, Session) and target.program.last_error is not None
            if isinstance(target, Session):
                target.running = False
                self._output(self._epilogue(target))
            self._event("exited", exitCode=3 if failed else 0)
            self._event("terminated")

    @staticmethod
    def _epilogue(session: Session) -> str:
        """What became of the program, in one line."""
        error = session.program.last_error
        ending = "was stopped" if session.program.active else "has ended"
        text = f"The program {ending} after {session.rig.now / clock.MS:.0f} ms of the module's time"
        return f"{text}." if error is None else f"{text}: {error_text(session.module, error)}"

    # Beginning

    def on_initialize(self, arguments: m.Initialize) -> dict[str, Any]:
        """Tell what we can."""
        self._sources.base = 1 if arguments.lines_start_at1 else 0
        return CAPABILITIES

    def on_launch(self, arguments: m.Launch) -> None:
        """Assemble a program and put it into a module of its own."""
        self._expect_no_target()
        self._breakpoints.ignored = arguments.no_debug
        self._debuggee.target = self._launched(arguments)
        self._launch = arguments
        self._afterwards(lambda: self._event("initialized"))

    def _expect_no_target(self) -> None:
        if self.target is not None:
            raise RequestError("there is a program already")

    def _launched(self, arguments: m.Launch) -> Session:
        rig = _make_rig(arguments)
        assembly = self._read_program(arguments.program, arguments.include)
        rig.modules[0].eeprom.write_program(assembly.program)
        self._pace = self._services.pace(arguments.speed)
        return Session(rig, self, self._sources.text)

    def on_attach(self, arguments: m.Attach) -> None:
        """Take a module as it is."""
        self._expect_no_target()
        if arguments.port is None:
            self._debuggee.target = target = self._live()
            if target.text is not None:
                self._sources.take(target.text.assembly)
        else:
            self._debuggee.target = self._connect(arguments)
        if arguments.program is not None:
            self._read_program(arguments.program, arguments.include)
            self._compare(arguments.program)
        elif self._sources.text is None:
            self._sources.take_memory(self._debuggee.memory())
        self._debuggee.share_sources()
        self._attach = arguments
        self._afterwards(lambda: self._event("initialized"))

    def _live(self) -> LiveSession | RemoteSession:
        if self._services.live is None:
            raise RequestError("attach needs a port: a serial port, or HOST:PORT")
        return self._services.live(self)

    def _connect(self, arguments: m.Attach) -> RemoteSession:
        port = cast("str", arguments.port)
        connection = Connection.open(
            port, baud=arguments.baud, address=arguments.address, timeout_s=arguments.timeout
        )
        try:
            version = HostModule(connection).version
            session = RemoteSession(connection, self)
        except HostError:
            connection.close()
            raise
        self._connection = connection
        self._output(f"Attached to {version} at {port}. {UNBREAKABLE[0].upper()}{UNBREAKABLE[1:]}.")
        try:
            session.memory = session.program.upload()
        except HostError as error:
            self._output(f"The program cannot be read: {error}", "stderr")
        return session

    def _compare(self, path: str) -> None:
        assembly = self._sources.assembly
        program = () if assembly is None else assembly.program
        if tuple(self._debuggee.memory()[: len(program)]) != program:
            self._output(f"The module holds another program than {path}: lines may not fit.", "stderr")

    def _read_program(self, path: str, include: Sequence[str]) -> Assembly:
        assembly = self._services.read_program(path, include)
        for item in assembly.diagnostics:
            place = item.location
            kind = "stderr" if item.severity == "error" else "console"
            self._output(render(item, assembly.sources.get(place.file, ())), kind, self._at(place))
        if not assembly.ok:
            count = sum(item.severity == "error" for item in assembly.diagnostics)
            many = count > 1
            raise RequestError(f"{path} has {count} error{'s' * many}, see the debug console")
        if not assembly.program:
            raise RequestError(f"{path} holds no program")
        self._sources.take(assembly, in_file=Path(assembly.file).exists())
        return assembly

    def _at(self, place: Location) -> dict[str, Any]:
        return {
            "source": self._sources.source(place.file),
            "line": self._sources.shown_line(place.line),
        }

    def on_configuration_done(self, _: m.Arguments) -> None:
        """Breakpoints are set: begin."""
        if self._configured:
            return
        self._configured = True
        self._afterwards(self._begin)

    def _begin(self) -> None:
        target = self._debuggee.running_or_held
        self._breakpoints.arm()
        if isinstance(target, Session):
            assert self._launch is not None
            self._draw(target)
            target.start(hold=self._launch.stop_on_entry and not self._launch.no_debug)
        elif target.running and self._attach is not None and self._attach.stop_on_entry:
            target.pause()
        elif not target.running:
            self.held(target.stop or Stop("pause", 0))

    def _draw(self, target: Target) -> None:
        if isinstance(target, Session):
            cast("Pacing", self._pace).draw(target.rig.now)

    def on_restart(self, arguments: m.Restart) -> None:
        """Begin anew: a new bench with the sources as they are now; a live module's program is reset and run."""
        target = self._debuggee.running_or_held
        if isinstance(target, Session):
            self._launch_again(target, arguments)
        else:
            self._powered(target).restart()
        self._inspector.forget()

    def _launch_again(self, session: Session, arguments: m.Restart) -> None:
        assert self._launch is not None
        launch = self._launch
        if arguments.arguments is not None:
            try:
                launch = msgspec.convert(arguments.arguments, m.Launch)
            except msgspec.ValidationError as error:
                raise RequestError(f"restart: {error}") from None
        self._debuggee.target = self._launched(launch)
        session.running = False
        self._launch = launch
        self._breakpoints.ignored = launch.no_debug
        self._breakpoints.place_again()
        self._ended = False
        self._afterwards(self._begin)

    # What whoever runs this adapter does to its module meanwhile

    def know(self, assembly: Assembly | None) -> None:
        """The program in the module comes from this text now, or from nobody knows where."""
        self._sources.take(assembly)
        self._debuggee.share_sources()
        if isinstance(self.target, RemoteSession):
            self.target.memory = () if assembly is None else assembly.program
        self._inspector.forget()
        self._breakpoints.place_again()

    def release(self) -> None:
        """The program was stopped, reset or started by a command; a module in this process shows it by itself."""
        if isinstance(self.target, RemoteSession):
            self.target.release()
        self._inspector.forget()

    # Ending

    def on_terminate(self, _: m.Arguments) -> None:
        """Stop the program."""
        if self._attach is not None and self.target is not None:
            self.target.pause()
        self._afterwards(self._end)

    def on_disconnect(self, arguments: m.Disconnect) -> None:
        """Let go; a real module goes on unless told otherwise."""
        target = self.target
        if target is not None:
            target.set_breakpoints([])
            if arguments.terminate_debuggee and not isinstance(target, Session) and target.running:
                target.pause()
        self.close()

    def close(self) -> None:
        """The editor is gone: hang up."""
        self._debuggee.target = None
        if self._connection is not None:
            self._connection.close()
            self._connection = None

    # Going on

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

    def on_pause(self, _: m.Arguments) -> None:
        """Hold."""
        target = self._debuggee.running_or_held
        if isinstance(target, Session) and target.running and self._pace is not None:
            pace = self._pace
            end_s, now = pace.monotonic() + SLICE_S, pace.target()
            if now < clock.NEVER:
                target.advance(now, lambda: pace.monotonic() >= end_s)
        target.pause()

    def _go(self, how: Callable[[Target], None]) -> None:
        target = self._debuggee.held
        if isinstance(target, Session) and target.over:
            self._afterwards(self._end)
            return
        self._inspector.forget()
        self._draw(target)
        how(self._powered(target))

    def _powered(self, target: TargetType) -> TargetType:
        if isinstance(target, LiveSession) and not target.module.powered:
            raise RequestError("the module has no power")
        return target

    def on_goto_targets(self, arguments: m.Lines) -> dict[str, Any]:
        """The command to go on at, for a line."""
        address = self._sources.address(self._sources.key(arguments.source), arguments.line)
        if address is None:
            return {"targets": []}
        text = format_instruction(self._debuggee.instruction(address) or Instruction(0))
        line = self._sources.place(address).get("line", 0)
        target = {"id": address, "label": f"{address}: {text}", "line": line}
        return {"targets": [{**target, "instructionPointerReference": hex(address)}]}

    def on_goto(self, arguments: m.Goto) -> None:
        """Go on elsewhere."""
        self._debuggee.held.jump(arguments.target_id)
        self._inspector.forget()
        self._afterwards(
            lambda: self._event("stopped", reason="goto", threadId=THREAD, allThreadsStopped=True)
        )


def _make_rig(arguments: m.Launch) -> Rig:
    if arguments.model is not None and arguments.model not in MODELS:
        raise RequestError(f"model is one of {', '.join(map(str, _MODELS))}")
    if arguments.bench is None:
        rig = simple_rig(arguments.model or _MODELS[-1], seed=arguments.seed)
    else:
        try:
            rig = load(arguments.bench)
        except (BenchError, OSError) as error:
            raise RequestError(str(error)) from None
    module = rig.modules[0]
    if arguments.model not in {None, module.board.model.number}:
        raise RequestError(f"{arguments.bench}: the module is a {module.board.model.name}")
    if arguments.instruction_time:
        module.instruction_clocks = max(1, clock.clocks(arguments.instruction_time * 1e-6))
    return rig


_REQUESTS: Final[Mapping[str, Request]] = {
    "initialize": Request(m.Initialize, Adapter.on_initialize, needs_target=False),
    "launch": Request(m.Launch, Adapter.on_launch, needs_target=False),
    "attach": Request(m.Attach, Adapter.on_attach, needs_target=False),
    "configurationDone": Request(m.Arguments, Adapter.on_configuration_done),
    "threads": Request(m.Arguments, Adapter.on_threads, needs_target=False),
    "continue": Request(m.Arguments, Adapter.on_continue),
    "next": Request(m.Arguments, Adapter.on_next),
    "stepIn": Request(m.Arguments, Adapter.on_step_in),
    "stepOut": Request(m.Arguments, Adapter.on_step_out),
    "pause": Request(m.Arguments, Adapter.on_pause),
    "restart": Request(m.Restart, Adapter.on_restart),
    "gotoTargets": Request(m.Lines, Adapter.on_goto_targets),
    "goto": Request(m.Goto, Adapter.on_goto),
    "terminate": Request(m.Arguments, Adapter.on_terminate, needs_target=False),
    "disconnect": Request(m.Disconnect, Adapter.on_disconnect, needs_target=False),
}
