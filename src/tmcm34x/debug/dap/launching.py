"""How a debugging session gets its program: on a bench of its own, or in a module at the end of a line."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple, Protocol, cast

from tmcm34x import clock
from tmcm34x.bench import BenchError, Rig, load, simple_rig
from tmcm34x.board.models import MODELS
from tmcm34x.debug.dap import messages as m
from tmcm34x.debug.dap.messages import RequestError
from tmcm34x.debug.dap.sources import Sources
from tmcm34x.debug.sessions.base import Listener, Session
from tmcm34x.debug.sessions.bench import BenchSession, Pacing
from tmcm34x.debug.sessions.remote import RemoteSession
from tmcm34x.firmware.module import INSTRUCTION_CLOCKS
from tmcm34x.host import Connection, HostError
from tmcm34x.host.settings import identify
from tmcm34x.toolchain.assembler import Assembly
from tmcm34x.toolchain.diagnostics import Location, render

_MODELS: Final = tuple(MODELS)


class Services(NamedTuple):
    """What the adapter needs of its owner.

    read_program: the assembly of a source or an image, by path, include folders and model; raises `RequestError`
    pace: makes a pacing of a speed
    live: opens the module of the adapter's owner, for `attach` without a port
    folder: where relative file names begin
    """

    read_program: Callable[[str, Sequence[str], int], Assembly]
    pace: Callable[[float], Pacing]
    live: Callable[[Listener], Session] | None = None
    folder: Path = Path()


class ConsoleOutput(Protocol):
    """Writes a line to the editor's debug console."""

    def __call__(self, text: str, category: str = ..., place: Mapping[str, Any] | None = ...) -> None:
        """Write it; `place` is the line of a source that it is about."""
        ...


class Launcher:
    """Opens sessions as the editor asks for them, and reads their sources."""

    def __init__(
        self, services: Services, sources: Sources, listener: Listener, output: ConsoleOutput
    ) -> None:
        self._services = services
        self._sources = sources
        self._listener = listener
        self._output = output
        self._connection: Connection | None = None

    def launch(self, arguments: m.Launch) -> BenchSession:
        """Assemble a program and put it into a module with a bench of its own."""
        rig = _make_rig(arguments)
        model = rig.modules[0].board.model.number
        assembly = self._read_program(arguments.program, arguments.include, model)
        rig.modules[0].eeprom.write_program(assembly.program)
        pace = self._services.pace(arguments.speed)
        keeps = not arguments.no_debug
        return BenchSession(rig, self._listener, self._sources.text, pace=pace, keeps_history=keeps)

    def attach(self, arguments: m.Attach) -> Session:
        """Run control over a module as it is, with a program's source where it is named."""
        session = self._live() if arguments.port is None else self._connect(arguments)
        if arguments.program is not None:
            self._read_program(arguments.program, arguments.include, session.model)
            self._compare(arguments.program, session)
        elif self._sources.text is None:
            self._sources.take_memory(session.memory())
        return session

    def close(self) -> None:
        """Close the line that `attach` opened."""
        if self._connection is not None:
            self._connection.close()
            self._connection = None

    def _live(self) -> Session:
        if self._services.live is None:
            raise RequestError("attach needs a port: a serial port, or HOST:PORT")
        session = self._services.live(self._listener)
        if session.text is not None:
            self._sources.take(session.text.assembly)
        return session

    def _connect(self, arguments: m.Attach) -> RemoteSession:
        port = cast("str", arguments.port)
        connection = Connection.open(
            port, baud=arguments.baud, address=arguments.address, timeout=arguments.timeout
        )
        try:
            _, version = connection.run(identify())
            session = RemoteSession(connection, self._listener)
        except HostError:
            connection.close()
            raise
        self._connection = connection
        reason = session.steps_for_breakpoints
        self._output(f"Attached to {version} at {port}. {reason[0].upper()}{reason[1:]}.")
        try:
            session.loaded(session.program.upload())
        except HostError as error:
            self._output(f"The program cannot be read: {error}", "stderr")
        return session

    def _compare(self, path: str, session: Session) -> None:
        assembly = self._sources.assembly
        program = () if assembly is None else assembly.program
        if tuple(session.memory()[: len(program)]) != program:
            self._output(f"The module holds another program than {path}: lines may not fit.", "stderr")

    def _read_program(self, path: str, include: Sequence[str], model: int) -> Assembly:
        assembly = self._services.read_program(path, include, model)
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


def _make_rig(arguments: m.Launch) -> Rig:
    if arguments.model is not None and arguments.model not in MODELS:
        raise RequestError(f"model is one of {', '.join(map(str, _MODELS))}")
    micro_s = arguments.instruction_time
    if arguments.bench is None:
        step = INSTRUCTION_CLOCKS if micro_s is None else max(1, clock.clocks(micro_s * 1e-6))
        return simple_rig(arguments.model or _MODELS[-1], seed=arguments.seed, instruction_clocks=step)
    try:
        rig = load(arguments.bench, instruction_us=micro_s)
    except (BenchError, OSError) as error:
        raise RequestError(str(error)) from None
    module = rig.modules[0]
    if arguments.model not in {None, module.board.model.number}:
        raise RequestError(f"{arguments.bench}: the module is a {module.board.model.name}")
    return rig
