"""The Debug Adapter Protocol over a program on a virtual module, or in a real one.

`Adapter` takes messages and sends messages; it knows no transport.  Between messages somebody calls `work`, which
lets a piece of virtual time pass or looks at a real module, and tells when it wants to be called again.

Each request has one method, `on_` and its name in snake case; the type of its argument (see `messages`) checks
what the editor sent.  What a user can mend is a `RequestError` and becomes an error response.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Protocol, cast

import msgspec

from tmcm34x import clock
from tmcm34x.bench import BenchError, Rig, load, simple_rig
from tmcm34x.board.models import MODELS
from tmcm34x.debug import messages as m
from tmcm34x.debug.control import Breakpoint, Stop
from tmcm34x.debug.expressions import ExpressionError, split_assignment
from tmcm34x.debug.remote import RemoteSession
from tmcm34x.debug.session import Frame, Listener, LiveSession, Session, Text
from tmcm34x.debug.view import Item
from tmcm34x.host import Connection, HostError
from tmcm34x.host import Module as HostModule
from tmcm34x.tmcl.commands import BY_MNEMONIC, PROGRAM_SIZE
from tmcm34x.tmcl.datagram import Instruction, pack_record
from tmcm34x.tmcl.mnemonic import MnemonicError, format_instruction, parse_instruction
from tmcm34x.tmcl.status import STATUS_TEXTS, Status
from tmcm34x.toolchain.assembler import Assembly, assemble
from tmcm34x.toolchain.diagnostics import Location, render
from tmcm34x.toolchain.disassembler import disassemble, up_to_end_mark

if TYPE_CHECKING:
    from tmcm34x.firmware.module import Module

SLICE_S: Final = 0.02
"""Longest work between two looks at the editor."""
MAX_LAG_S: Final = 1.0
"""A bench that lags more than this behind the wall clock gives up catching up."""
LIVE_POLL_S: Final = 0.05

THREAD: Final = 1
GENERATED: Final = "disassembly.tmc"
_REFERENCE: Final = 1
_REFUSED: Final = "refused"
_MODELS: Final = tuple(MODELS)
_UNBREAKABLE: Final = (
    "the firmware of a real module has no breakpoints: run, stop and step are what it offers"
)
_REASONS: Final = {
    "entry": "Held before the first command",
    "breakpoint": "Held at a breakpoint",
    "step": "Held after a step",
    "pause": "Paused",
    "exception": "A command was refused",
    "end": "The program has stopped",
}
_UNSAFE_READS: Final = "Reading it does something in the module; click to read."

Send = Callable[[dict[str, Any]], None]
Target = Session | LiveSession | RemoteSession


class RequestError(Exception):
    """A request that cannot be done; the text is for the user."""


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
    """

    read_program: Callable[[str, Sequence[str]], Assembly]
    pace: Callable[[float], Pacing]
    live: Callable[[Listener], LiveSession] | None = None


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
        "filter": _REFUSED, "label": "Commands the module refuses", "default": True,
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
        self._seq = 0
        self._target: Target | None = None
        self._connection: Connection | None = None
        self._launch: m.Launch | None = None
        self._attach: m.Attach | None = None
        self._assembly: Assembly | None = None
        self._generated = ""
        self._configured = False
        self._ended = False
        self._pace: Pacing | None = None
        self._base = 1
        self._numbers = 0
        self._wanted: dict[str, list[m.SourceBreakpoint]] = {}
        """Breakpoints as they were asked for, by file name, or `labels` and `addresses` in angle brackets."""
        self._numbered: dict[str, list[int]] = {}
        self._stop_on_errors = True
        self._handles: dict[int, list[Item]] = {}
        self._references = 0
        self._deferred: list[Callable[[], None]] | None = None
        """What to tell after the response to the request being done; None between requests."""

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
        row = _REQUESTS.get(command)
        if row is None:
            raise RequestError(f"{command[:100]} is not supported")
        kind, handler, needs_target = row
        if needs_target and self._target is None:
            raise RequestError(f"{command} needs a program: launch or attach first")
        try:
            converted = msgspec.convert(arguments if arguments is not None else {}, kind)
        except msgspec.ValidationError as error:
            raise RequestError(f"{command}: {error}") from None
        return handler(self, converted)

    def _respond(self, request: int, command: str, *, body: Any = None, error: str = "") -> None:
        message: dict[str, Any] = {"type": "response", "request_seq": request, "command": command}
        message["success"] = not error
        if error:
            message["message"] = error
            body = {"error": {"id": 1, "format": error.replace("{", "(").replace("}", ")"), "showUser": True}}
        if body is not None:
            message["body"] = body
        self._emit(message)

    def _event(self, name: str, **body: Any) -> None:
        self._emit({"type": "event", "event": name, "body": body})

    def _emit(self, message: dict[str, Any]) -> None:
        self._seq += 1
        self._send({"seq": self._seq, **message})

    def _output(self, text: str, category: str = "console", place: Location | None = None) -> None:
        body: dict[str, Any] = {"category": category, "output": text + "\n"}
        if place is not None:
            body |= {"source": self._source(place.file), "line": self._shown_line(place.line)}
        self._event("output", **body)

    # Time

    def work(self) -> float:
        """Do a piece of work; gives back in how many seconds to call again, infinite if only a message can help."""
        target = self._target
        if target is None or self.over or not target.running:
            return math.inf
        if isinstance(target, Session):
            return self._pass_time(target, cast("Pacing", self._pace))
        if isinstance(target, LiveSession):
            target.look()
            return LIVE_POLL_S
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
        self._handles.clear()
        self._afterwards(lambda: self._event("stopped", **body))

    def ended(self) -> None:
        """The program has stopped, and nothing it has begun is still going on."""
        session = self._target
        if not isinstance(session, Session):
            assert session is not None
            self.held(Stop("end", 0))
        elif self._launch is not None and self._launch.stop_at_end and not self._launch.no_debug:
            self.held(Stop("end", session.program.counter))
        else:
            self._afterwards(self._end)

    def said(self, text: str, address: int) -> None:
        """A log point was passed."""
        place = self._text.location(address) if self._text else None
        self._output(text, place=place)

    def _afterwards(self, tell: Callable[[], None]) -> None:
        """Do what a request brings about after its response."""
        if self._deferred is None:
            tell()
        else:
            self._deferred.append(tell)

    def _end(self) -> None:
        if not self._ended:
            self._ended = True
            session = self._target
            failed = isinstance(session, Session) and session.program.last_error is not None
            if isinstance(session, Session):
                session.running = False
            self._event("exited", exitCode=3 if failed else 0)
            self._event("terminated")

    # Beginning

    def on_initialize(self, arguments: m.Initialize) -> dict[str, Any]:
        """Tell what we can."""
        self._base = 1 if arguments.lines_start_at1 else 0
        return CAPABILITIES

    def on_launch(self, arguments: m.Launch) -> None:
        """Assemble a program and put it into a module of its own."""
        if self._target is not None:
            raise RequestError("there is a program already")
        self._target = self._launched(arguments)
        self._launch = arguments
        self._afterwards(lambda: self._event("initialized"))

    def _launched(self, arguments: m.Launch) -> Session:
        rig = _make_rig(arguments)
        assembly = self._read_program(arguments.program, arguments.include)
        rig.modules[0].eeprom.write_program(assembly.program)
        self._pace = self._services.pace(arguments.speed)
        return Session(rig, self, self._text)

    def on_attach(self, arguments: m.Attach) -> None:
        """Take a module as it is."""
        if self._target is not None:
            raise RequestError("there is a program already")
        if arguments.port is None:
            if self._services.live is None:
                raise RequestError("attach needs a port: a serial port, or HOST:PORT")
            self._target = target = self._services.live(self)
            if target.text is not None:
                self._assembly = target.text.assembly
            elif arguments.program is None:
                self._disassemble(_memory(target.module))
        else:
            self._target = target = self._connect(arguments)
        if arguments.program is not None:
            self._read_program(arguments.program, arguments.include)
            self._compare(target, arguments.program)
        target.text = self._text
        target.view.symbols = self._assembly.symbols if self._assembly is not None else {}
        self._attach = arguments
        self._afterwards(lambda: self._event("initialized"))

    def _connect(self, arguments: m.Attach) -> RemoteSession:
        connection = Connection.open(
            cast("str", arguments.port),
            baud=arguments.baud,
            address=arguments.address,
            timeout_s=arguments.timeout,
        )
        try:
            version = HostModule(connection).version
            session = RemoteSession(connection, self)
        except HostError:
            connection.close()
            raise
        self._connection = connection
        self._output(
            f"Attached to {version} at {arguments.port}. {_UNBREAKABLE[0].upper()}{_UNBREAKABLE[1:]}."
        )
        try:
            session.memory = session.program.upload()
        except HostError as error:
            self._output(f"The program cannot be read: {error}", "stderr")
        self._disassemble(session.memory)
        return session

    def _compare(self, target: Target, path: str) -> None:
        assert self._assembly is not None
        memory = target.memory if isinstance(target, RemoteSession) else _memory(target.module)
        if tuple(memory[: len(self._assembly.program)]) != self._assembly.program:
            self._output(f"The module holds another program than {path}: lines may not fit.", "stderr")

    def _read_program(self, path: str, include: Sequence[str]) -> Assembly:
        assembly = self._services.read_program(path, include)
        for item in assembly.diagnostics:
            place = item.location
            kind = "stderr" if item.severity == "error" else "console"
            self._output(render(item, assembly.sources.get(place.file, ())), kind, place)
        if not assembly.ok:
            count = sum(item.severity == "error" for item in assembly.diagnostics)
            raise RequestError(f"{path} has {count} error{'s' * (count > 1)}; they are in the debug console")
        if not assembly.program:
            raise RequestError(f"{path} holds no program")
        self._generated = "" if Path(assembly.file).exists() else "\n".join(assembly.sources[assembly.file])
        self._assembly = assembly
        return assembly

    def _disassemble(self, memory: Sequence[Instruction]) -> None:
        """Make a source for a program that has none."""
        self._generated = disassemble(up_to_end_mark(memory))
        self._assembly = assemble(self._generated, GENERATED)

    def on_configuration_done(self, _: m.Arguments) -> None:
        """Breakpoints are set: begin."""
        if self._configured:
            return
        self._configured = True
        self._afterwards(self._begin)

    def _begin(self) -> None:
        target = self._target
        assert target is not None
        target.stop_on_errors = self._stop_on_errors
        if isinstance(target, Session):
            assert self._launch is not None
            target.stop_on_errors = self._stop_on_errors and not self._launch.no_debug
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
        """Begin anew: a new bench with the sources as they are now; a real module's program is reset and run."""
        target = self._target
        if isinstance(target, Session):
            launch = self._launch
            if arguments.arguments is not None:
                try:
                    launch = msgspec.convert(arguments.arguments, m.Launch)
                except msgspec.ValidationError as error:
                    raise RequestError(f"restart: {error}") from None
            assert launch is not None
            self._target = self._launched(launch)
            target.running = False
            self._launch = launch
            for answers in self._place_all().values():
                for answer in answers:
                    self._event("breakpoint", reason="changed", breakpoint=answer)
            self._ended = False
            self._afterwards(self._begin)
        elif isinstance(target, RemoteSession):
            target.restart()
        else:
            assert target is not None
            target.program.reset()
            target.resume()
        self._handles.clear()

    # Ending

    def on_terminate(self, _: m.Arguments) -> None:
        """Stop the program."""
        if self._attach is not None and self._target is not None:
            self._target.pause()
        self._afterwards(self._end)

    def on_disconnect(self, arguments: m.Disconnect) -> None:
        """Let go; a real module goes on unless told otherwise."""
        target = self._target
        if target is not None:
            target.set_breakpoints([])
            if arguments.terminate_debuggee and not isinstance(target, Session) and target.running:
                target.pause()
        self.close()

    def close(self) -> None:
        """The editor is gone: hang up."""
        self._target = None
        if self._connection is not None:
            self._connection.close()
            self._connection = None

    # Breakpoints

    def on_set_breakpoints(self, arguments: m.SetBreakpoints) -> dict[str, Any]:
        """All breakpoints of one source."""
        wanted = arguments.breakpoints
        if wanted is None:
            wanted = [m.SourceBreakpoint(line=line) for line in arguments.lines or ()]
        return self._set(self._file_name(arguments.source), wanted)

    def on_set_function_breakpoints(self, arguments: m.SetOtherBreakpoints) -> dict[str, Any]:
        """All breakpoints at labels."""
        return self._set("<labels>", arguments.breakpoints)

    def on_set_instruction_breakpoints(self, arguments: m.SetOtherBreakpoints) -> dict[str, Any]:
        """All breakpoints at addresses."""
        return self._set("<addresses>", arguments.breakpoints)

    def _set(self, place: str, wanted: list[m.SourceBreakpoint]) -> dict[str, Any]:
        numbers: list[int] = []
        for _ in wanted:
            self._numbers += 1
            numbers.append(self._numbers)
        self._wanted[place], self._numbered[place] = wanted, numbers
        return {"breakpoints": self._place_all()[place]}

    def _place_all(self) -> dict[str, list[dict[str, Any]]]:
        """Bring all breakpoints that were asked for to the program; what became of each."""
        made: list[Breakpoint] = []
        answers = {place: [self._place(place, index, made) for index in range(len(wanted))]
                   for place, wanted in self._wanted.items()}  # fmt: skip
        assert self._target is not None
        if self._launch is None or not self._launch.no_debug:
            self._target.set_breakpoints(made)
        return answers

    def _place(self, place: str, index: int, made: list[Breakpoint]) -> dict[str, Any]:
        wanted, number = self._wanted[place][index], self._numbered[place][index]
        try:
            if isinstance(self._target, RemoteSession):
                raise RequestError(_UNBREAKABLE)
            address = self._address_of(place, wanted)
            made.append(
                Breakpoint.make(
                    number,
                    address,
                    wanted.condition or "",
                    wanted.hit_condition or "",
                    wanted.log_message or "",
                )
            )
        except (RequestError, ExpressionError) as error:
            answer: dict[str, Any] = {"id": number, "verified": False, "message": str(error)}
            return answer | ({"line": wanted.line} if wanted.line else {})
        return {"id": number, "verified": True, **self._at(address)}

    def _address_of(self, place: str, wanted: m.SourceBreakpoint) -> int:
        if place == "<addresses>":
            return _parse_address(wanted.instruction_reference) + wanted.offset
        if place == "<labels>":
            symbol = self._assembly.symbols.get(wanted.name.upper()) if self._assembly is not None else None
            if symbol is None or symbol.kind != "label":
                raise RequestError(f"no label {wanted.name}")
            return int(symbol.value)
        address = self._text.address(place, wanted.line + 1 - self._base) if self._text else None
        if address is None:
            raise RequestError("no command of the program at this line or below it")
        return address

    def on_set_exception_breakpoints(self, arguments: m.SetExceptionBreakpoints) -> dict[str, Any]:
        """Whether to stop at refused commands."""
        self._stop_on_errors = _REFUSED in arguments.filters
        if self._target is not None:
            self._target.stop_on_errors = self._stop_on_errors
        return {"breakpoints": [{"verified": True} for _ in arguments.filters]}

    def on_breakpoint_locations(self, arguments: m.Lines) -> dict[str, Any]:
        """Lines with commands."""
        file, base = self._file_name(arguments.source), self._base
        first = arguments.line + 1 - base
        last = (arguments.line if arguments.end_line is None else arguments.end_line) + 1 - base
        lines = {place.line for place in self._source_map() if place.file == file}
        return {"breakpoints": [{"line": line - 1 + base} for line in sorted(lines) if first <= line <= last]}

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
        target = self._target
        assert target is not None
        if isinstance(target, Session) and target.running and self._pace is not None:
            pace = self._pace
            end_s, now = pace.monotonic() + SLICE_S, pace.target()
            if now < clock.NEVER:
                target.advance(now, lambda: pace.monotonic() >= end_s)
        target.pause()

    def _go(self, how: Callable[[Target], None]) -> None:
        target = self._target
        assert target is not None
        if target.running:
            raise RequestError("the program is running")
        if isinstance(target, Session) and target.over:
            self._afterwards(self._end)
            return
        self._handles.clear()
        self._draw(target)
        how(target)

    def on_goto_targets(self, arguments: m.Lines) -> dict[str, Any]:
        """The command to go on at, for a line."""
        line = arguments.line + 1 - self._base
        address = self._text.address(self._file_name(arguments.source), line) if self._text else None
        if address is None:
            return {"targets": []}
        label = format_instruction(self._instruction(address) or Instruction(0))
        return {"targets": [{"id": address, "label": f"{address}: {label}", **self._line_at(address)}]}

    def on_goto(self, arguments: m.Goto) -> None:
        """Go on elsewhere."""
        target = self._held_target()
        target.jump(arguments.target_id)
        self._handles.clear()
        self._afterwards(
            lambda: self._event("stopped", reason="goto", threadId=THREAD, allThreadsStopped=True)
        )

    def _held_target(self) -> Target:
        target = self._target
        assert target is not None
        if target.running:
            raise RequestError("the program is running")
        return target

    # Looking

    def on_stack_trace(self, arguments: m.StackTrace) -> dict[str, Any]:
        """The open routines."""
        assert self._target is not None
        frames = self._target.frames()
        first = max(0, arguments.start_frame)
        last = first + arguments.levels if arguments.levels > 0 else len(frames)
        shown = [self._frame(number, frame) for number, frame in list(enumerate(frames))[first:last]]
        return {"stackFrames": shown, "totalFrames": len(frames)}

    def _frame(self, number: int, frame: Frame) -> dict[str, Any]:
        body: dict[str, Any] = {"id": number, "name": frame.name, "line": 0, "column": 0}
        place = frame.location
        if place is not None:
            body |= {"source": self._source(place.file), "line": self._shown_line(place.line)}
            body |= {"column": place.column, "endLine": body["line"], "endColumn": place.end}
        return body | {"instructionPointerReference": hex(frame.address)}

    def on_scopes(self, _: m.Arguments) -> dict[str, Any]:
        """What there is to look at."""
        assert self._target is not None
        remote = isinstance(self._target, RemoteSession)
        scopes: list[dict[str, Any]] = []
        for title, items in self._target.view.scopes().items():
            scope = {"name": title, "variablesReference": self._handle_for(items()), "expensive": remote}
            if title == "Registers":
                scope["presentationHint"] = "registers"
            scopes.append(scope)
        return {"scopes": scopes}

    def _handle_for(self, items: list[Item]) -> int:
        self._references += 1
        self._handles[self._references] = items
        return self._references

    def on_variables(self, arguments: m.Variables) -> dict[str, Any]:
        """The values of a scope."""
        shown_hex = arguments.format is not None and arguments.format.hex
        return {
            "variables": [
                self._variable(item, shown_hex) for item in self._items(arguments.variables_reference)
            ]
        }

    def _items(self, reference: int) -> list[Item]:
        items = self._handles.get(reference)
        if items is None:
            raise RequestError("this was of an earlier stop")
        return items

    def _variable(self, item: Item, shown_hex: bool) -> dict[str, Any]:
        body: dict[str, Any] = {"name": item.name, "evaluateName": item.expression, "variablesReference": 0}
        hint: dict[str, Any] = {} if item.writable else {"attributes": ["readOnly"]}
        if item.acting:
            asked = item._replace(acting=False)
            body |= {"value": _UNSAFE_READS, "variablesReference": self._handle_for([asked])}
            hint["lazy"] = True
        else:
            body["value"] = self._value(item, shown_hex)
        if item.meaning:
            body["type"] = item.meaning
        return body | ({"presentationHint": hint} if hint else {})

    def _value(self, item: Item, shown_hex: bool) -> str:
        assert self._target is not None
        try:
            value = self._target.view.evaluate(item.expression)
        except ExpressionError as error:
            return f"<{error}>"
        choice = dict(item.choices).get(value)
        return _shown(value, shown_hex) + (f" ({choice})" if choice else "")

    def on_set_variable(self, arguments: m.SetVariable) -> dict[str, Any]:
        """Change something in a scope."""
        for item in self._items(arguments.variables_reference):
            if item.name == arguments.name:
                return self._assign(item.expression, arguments.value)
        raise RequestError(f"no value named {arguments.name}")

    def on_set_expression(self, arguments: m.SetExpression) -> dict[str, Any]:
        """Change something by name."""
        return self._assign(arguments.expression, arguments.value)

    def _assign(self, target: str, value: str) -> dict[str, Any]:
        assert self._target is not None
        return {"value": str(self._target.view.assign(target, value)), "variablesReference": 0}

    def on_evaluate(self, arguments: m.Evaluate) -> dict[str, Any]:
        """An expression; in the console also an assignment, or a command in direct mode."""
        assert self._target is not None
        text = arguments.expression.strip()
        if arguments.context == "repl":
            words = text.split(maxsplit=1)
            if words and words[0].upper() in BY_MNEMONIC:
                return {"result": self._execute(text), "variablesReference": 0}
            assignment = split_assignment(text)
            if assignment is not None:
                result = self._assign(*assignment)
                self._event("invalidated", areas=["variables"])
                return {"result": result["value"], "variablesReference": 0}
        value = self._target.view.evaluate(text)
        return {
            "result": _shown(value, arguments.format is not None and arguments.format.hex),
            "variablesReference": 0,
        }

    def _execute(self, text: str) -> str:
        assert self._target is not None
        try:
            instruction = parse_instruction(text)
        except MnemonicError as error:
            raise RequestError(str(error)) from None
        status, value = self._target.execute(instruction)
        if status != Status.OK:
            raise RequestError(f"status {status}: {STATUS_TEXTS.get(status, 'unknown status')}")
        self._event("invalidated", areas=["variables"])
        reads = "reads" in BY_MNEMONIC[text.split(maxsplit=1)[0].upper()].where
        return str(value) if reads else f"status {status}: {STATUS_TEXTS[status]}"

    def on_completions(self, arguments: m.Completions) -> dict[str, Any]:
        """Names that begin as what was typed."""
        match = re.search(r"[A-Za-z_]\w*\Z", arguments.text[: max(0, arguments.column - self._base)])
        start = match[0].upper() if match else ""
        names = [
            *BY_MNEMONIC,
            *("accumulator", "adc", "ap", "co", "counter", "gp", "in", "out", "shutdown", "x"),
        ]
        if self._assembly is not None:
            names += [symbol.name for symbol in self._assembly.symbols.values()]
        found = [name for name in names if start and name.upper().startswith(start)]
        return {
            "targets": [
                {"label": name, "length": len(start), "start": match.start()} for name in found if match
            ]
        }

    def on_exception_info(self, _: m.Arguments) -> dict[str, Any]:
        """What was refused."""
        stop = self._target.stop if self._target is not None else None
        if stop is None or stop.reason != "exception":
            raise RequestError("no command was refused")
        return {"exceptionId": _REFUSED, "description": stop.text, "breakMode": "always"}

    # Sources

    def on_source(self, arguments: m.GetSource) -> dict[str, Any]:
        """A text that we made."""
        reference = arguments.source_reference or (arguments.source and arguments.source.source_reference)
        if reference != _REFERENCE or not self._generated:
            raise RequestError("no such source")
        return {"content": self._generated, "mimeType": "text/x-tmcl"}

    def on_loaded_sources(self, _: m.Arguments) -> dict[str, Any]:
        """All files of the program."""
        files = self._assembly.sources if self._assembly is not None else ()
        return {"sources": [self._source(file) for file in files]}

    def on_disassemble(self, arguments: m.Disassemble) -> dict[str, Any]:
        """A stretch of the program memory."""
        first = _parse_address(arguments.memory_reference) + arguments.offset + arguments.instruction_offset
        addresses = range(first, first + arguments.instruction_count)
        return {"instructions": [self._disassembled(address) for address in addresses]}

    def _disassembled(self, address: int) -> dict[str, Any]:
        instruction = self._instruction(address)
        if instruction is None:
            return {"address": hex(max(0, address)), "instruction": "??", "presentationHint": "invalid"}
        labels = {value: name for name, value in self._assembly.labels.items()} if self._assembly else {}
        row: dict[str, Any] = {
            "address": hex(address),
            "instruction": format_instruction(instruction, labels),
            "instructionBytes": pack_record(instruction).hex(" "),
        }
        if address in labels:
            row["symbol"] = labels[address]
        place = self._text.location(address) if self._text else None
        if place is not None:
            row |= {"location": self._source(place.file), "line": self._shown_line(place.line)}
        return row

    def _instruction(self, address: int) -> Instruction | None:
        target = self._target
        if isinstance(target, RemoteSession):
            return target.read_instruction(address)
        if target is None or not 0 <= address < PROGRAM_SIZE:
            return None
        return target.module.eeprom.read_instruction(address)

    # Places

    @property
    def _text(self) -> Text | None:
        assembly = self._assembly
        if assembly is None:
            return None
        if self._made is None or self._made.assembly is not assembly:
            self._made = Text(assembly)
        return self._made

    _made: Text | None = None

    def _source_map(self) -> Iterable[Location]:
        return self._assembly.source_map if self._assembly is not None else ()

    def _file_name(self, source: m.Source) -> str:
        """How the assembly calls a file of the editor's."""
        if source.source_reference:
            return self._assembly.file if self._assembly is not None else GENERATED
        if source.path is None:
            raise RequestError("a source has a path or a reference")
        try:
            wanted = Path(source.path).resolve()
            for file in self._assembly.sources if self._assembly is not None else ():
                if Path(file).resolve() == wanted:
                    return file
        except (OSError, ValueError) as error:
            raise RequestError(f"no path: {error}") from None
        return source.path

    def _source(self, file: str) -> dict[str, Any]:
        path = Path(file)
        if self._generated and self._assembly is not None and file == self._assembly.file:
            return {"name": path.name, "sourceReference": _REFERENCE, "origin": "disassembled"}
        return {"name": path.name, "path": str(path.resolve())}

    def _shown_line(self, line: int) -> int:
        return line - 1 + self._base

    def _line_at(self, address: int) -> dict[str, Any]:
        place = self._text.location(address) if self._text else None
        line = {"line": self._shown_line(place.line)} if place is not None else {"line": 0}
        return {**line, "instructionPointerReference": hex(address)}

    def _at(self, address: int) -> dict[str, Any]:
        place = self._text.location(address) if self._text else None
        if place is None:
            return {"instructionReference": hex(address)}
        return {
            "source": self._source(place.file), "line": self._shown_line(place.line),
            "instructionReference": hex(address),
        }  # fmt: skip


def _memory(module: Module) -> tuple[Instruction, ...]:
    return tuple(map(module.eeprom.read_instruction, range(PROGRAM_SIZE)))


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


def _parse_address(text: str) -> int:
    try:
        return int(text, 0)
    except ValueError:
        raise RequestError(f"{text[:100]!r} is no address") from None


def _shown(value: int, shown_hex: bool) -> str:
    return f"${value & 0xFFFFFFFF:X}" if shown_hex else str(value)


class _Request(NamedTuple):
    kind: type[m.Arguments]
    handler: Callable[[Adapter, Any], Any]
    needs_target: bool = True


_REQUESTS: Final = {
    "initialize": _Request(m.Initialize, Adapter.on_initialize, False),
    "launch": _Request(m.Launch, Adapter.on_launch, False),
    "attach": _Request(m.Attach, Adapter.on_attach, False),
    "configurationDone": _Request(m.Arguments, Adapter.on_configuration_done),
    "setBreakpoints": _Request(m.SetBreakpoints, Adapter.on_set_breakpoints),
    "setFunctionBreakpoints": _Request(m.SetOtherBreakpoints, Adapter.on_set_function_breakpoints),
    "setInstructionBreakpoints": _Request(m.SetOtherBreakpoints, Adapter.on_set_instruction_breakpoints),
    "setExceptionBreakpoints": _Request(m.SetExceptionBreakpoints, Adapter.on_set_exception_breakpoints, False),
    "breakpointLocations": _Request(m.Lines, Adapter.on_breakpoint_locations),
    "threads": _Request(m.Arguments, Adapter.on_threads, False),
    "continue": _Request(m.Arguments, Adapter.on_continue),
    "next": _Request(m.Arguments, Adapter.on_next),
    "stepIn": _Request(m.Arguments, Adapter.on_step_in),
    "stepOut": _Request(m.Arguments, Adapter.on_step_out),
    "pause": _Request(m.Arguments, Adapter.on_pause),
    "restart": _Request(m.Restart, Adapter.on_restart),
    "gotoTargets": _Request(m.Lines, Adapter.on_goto_targets),
    "goto": _Request(m.Goto, Adapter.on_goto),
    "stackTrace": _Request(m.StackTrace, Adapter.on_stack_trace),
    "scopes": _Request(m.Arguments, Adapter.on_scopes),
    "variables": _Request(m.Variables, Adapter.on_variables),
    "setVariable": _Request(m.SetVariable, Adapter.on_set_variable),
    "setExpression": _Request(m.SetExpression, Adapter.on_set_expression),
    "evaluate": _Request(m.Evaluate, Adapter.on_evaluate),
    "completions": _Request(m.Completions, Adapter.on_completions),
    "exceptionInfo": _Request(m.Arguments, Adapter.on_exception_info),
    "source": _Request(m.GetSource, Adapter.on_source),
    "loadedSources": _Request(m.Arguments, Adapter.on_loaded_sources),
    "disassemble": _Request(m.Disassemble, Adapter.on_disassemble),
    "terminate": _Request(m.Arguments, Adapter.on_terminate, False),
    "disconnect": _Request(m.Disconnect, Adapter.on_disconnect, False),
}  # fmt: skip
