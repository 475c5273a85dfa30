"""`tmcm34x play`: sessions on a virtual module, or on a real one."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from tmcm34x.bench.session.errors import SessionError, SessionFailedError
from tmcm34x.bench.session.language import MODELS, Case, load
from tmcm34x.bench.session.player import CAN, SERIAL, Player
from tmcm34x.bench.session.runner import CaseResult, moving_line, run, run_real
from tmcm34x.cli import CliError
from tmcm34x.cli.outputs import FILE_IN, FILE_OUT, FILES_IN, write
from tmcm34x.cli.source_files import MODELS as MODEL_NAMES
from tmcm34x.cli.source_files import is_folder, read_bytes

if TYPE_CHECKING:
    from tmcm34x.host.connection import Connection

SUFFIX: Final = ".session"
"""Of the files that are played when a folder is named."""
_EPILOG = """\b
Examples:
  tmcm34x play homing.session --bench examples/benches/xy-stage.toml
  tmcm34x play tests/sessions/*.txt --junit sessions.xml
  tmcm34x play settings.session --port /dev/ttyUSB0
  tmcm34x play settings.session --port "can:socketcan:can0?id=1&reply=2"
"""


@click.command(epilog=_EPILOG)
@click.argument("files", type=FILES_IN, nargs=-1, required=True, metavar="FILE...")
@click.option(
    "--model",
    "models",
    type=click.Choice(MODEL_NAMES),
    multiple=True,
    help="Play only on this module type; may be given several times.",
)
@click.option(
    "--link",
    "links",
    type=click.Choice((SERIAL, CAN)),
    multiple=True,
    help="Play only over this kind of line; both where a session is for both.",
)
@click.option(
    "--bench",
    type=FILE_IN,
    metavar="FILE",
    help="What is connected to the module, for sessions without a bench of their own.",
)
@click.option("--junit", type=FILE_OUT, metavar="OUT", help="Write the results as JUnit XML.")
@click.option("--first", is_flag=True, help="End at the first failure.")
@click.option("--quiet", is_flag=True, help="Print only failures and the summary.")
@click.option(
    "--port",
    metavar="PORT",
    help="Play on the real module there: a serial port, tcp:HOST:PORT, "
    "can:INTERFACE:CHANNEL?id=1&reply=2 or slcan:DEVICE.",
)
@click.option(
    "--baud",
    type=click.IntRange(1),
    default=9600,
    show_default=True,
    help="Bits per second of a serial port.",
)
@click.option(
    "--address", type=click.IntRange(0, 255), default=1, show_default=True, help="Address of the real module."
)
@click.option(
    "--host-address",
    type=click.IntRange(0, 255),
    default=2,
    show_default=True,
    help="Host address in its replies.",
)
@click.option(
    "--yes", is_flag=True, help="Play sessions that may move a real module's motors without asking."
)
def command(**options: Any) -> int:
    """Play the sessions in FILE... (or in the *.session files of a folder) and compare what the module does.

    Without --port: on fresh virtual modules, in virtual time, on all models and kinds of lines that a session names.
    With --port: on a real module as it is, in real time; lines that need a bench are left out and counted.

    Exit status: 0 all as expected, 1 failures or sessions that cannot be read, 2 wrong usage.
    """  # fmt: skip
    cases, errors = _load(options["files"])
    for error in errors:
        click.echo(str(error), err=True)
    started_s = time.monotonic()
    results = _real(cases, options) if options["port"] else _virtual(cases, options)
    played = _show(results, options)
    if options["junit"] is not None:
        from tmcm34x.bench.session.junit import junit

        write(options["junit"], junit(played).encode("utf-8"))
    click.echo(_sum(played, len(errors), time.monotonic() - started_s))
    return int(bool(errors) or any(result.error is not None for result in played))


# Files


def _load(paths: Sequence[Path]) -> tuple[list[Case], list[SessionError]]:
    """The cases of all files, and what cannot be read."""
    cases: list[Case] = []
    errors: list[SessionError] = []
    for path in _files(paths):
        try:
            cases += load(path)
        except SessionError as error:
            errors.append(error)
    return cases, errors


def _files(paths: Sequence[Path]) -> Iterator[Path]:
    for path in paths:
        if not is_folder(path):
            yield path
            continue
        found = sorted(path.rglob(f"*{SUFFIX}"))
        if not found:
            raise CliError(f"{path}: no *{SUFFIX} files in this folder")
        yield from found


# Playing


def _virtual(cases: Sequence[Case], options: dict[str, Any]) -> Iterator[CaseResult]:
    models = frozenset(map(int, options["models"])) or MODELS
    kinds = frozenset(options["links"]) or frozenset({SERIAL, CAN})
    bench = "" if options["bench"] is None else _read_bench(options["bench"])
    return run(cases, models, kinds, bench)


def _read_bench(path: Path) -> str:
    """The text of a bench file that can be built."""
    from tmcm34x.bench import BenchError
    from tmcm34x.bench.builder import load as load_bench

    data = read_bytes(path)
    try:
        load_bench(path)
    except BenchError as error:
        raise CliError(str(error)) from None
    return data.decode("utf-8")


def _real(cases: Sequence[Case], options: dict[str, Any]) -> Iterator[CaseResult]:
    from tmcm34x.bench.session.real import kind_of, real_player
    from tmcm34x.host import Connection, HostError

    if options["bench"] is not None:
        raise click.UsageError("--bench is for virtual modules; a real one has its own.")
    try:
        with Connection.open(options["port"], baud=options["baud"], address=options["address"]) as connection:
            model = _model(connection)
            _ask(cases, model, options)

            def open_player(case: Case) -> Player:
                return real_player(connection, case, time.monotonic, options["host_address"])

            yield from run_real(cases, open_player, model, kind_of(connection.line))
    except HostError as error:
        raise CliError(str(error)) from None


def _model(connection: Connection) -> int:
    """The type of a module, by its version."""
    from tmcm34x.host.settings import identify

    model, version = connection.run(identify())
    if model not in MODELS:
        raise CliError(f"the module is a {version}, not a TMCM-341, 342 or 343")
    return model


def _ask(cases: Iterable[Case], model: int, options: dict[str, Any]) -> None:
    """Ask before a motor moves, once for all files."""
    if options["yes"]:
        return
    moving = [(case, step) for case in cases if (step := moving_line(case, model)) is not None]
    if not moving:
        return
    case, step = moving[0]
    click.echo(f"{case.path}:{step.line}: {step.text}: may move a motor of the module at {options['port']}.")
    if not sys.stdin.isatty():
        raise CliError("sessions that may move motors need --yes where there is no terminal to ask on")
    if not click.confirm(f"Play {len(moving)} such sessions?"):
        raise click.Abort


# Telling


def _show(results: Iterable[CaseResult], options: dict[str, Any]) -> list[CaseResult]:
    """Print what comes, file by file, and give it back."""
    played: list[CaseResult] = []
    progress = _Progress(options["quiet"])
    for result in results:
        progress.show(result)
        if result.error is not None:
            progress.clear()
            same = bool(played) and str(played[-1].error) == str(result.error)
            click.echo(_failure(result, same))
        played.append(result)
        if result.error is not None and options["first"]:
            break
    progress.finish()
    return played


def _failure(result: CaseResult, same: bool) -> str:
    """What went wrong, or that the same did on another model or kind of line."""
    where = f"{result.model} {result.kind}"
    if same:
        return f"    also on   {where}"
    error = result.error
    report = error.report() if isinstance(error, SessionFailedError) else str(error)
    return f"{report}\n    on        {where}"


class _Progress:
    """A line for each file; on a terminal, with the number of what has been played while it is."""

    def __init__(self, quiet: bool) -> None:
        self._quiet = quiet
        self._live = sys.stdout.isatty() and not quiet
        self._path: Path | None = None
        self._results: list[CaseResult] = []

    def show(self, result: CaseResult) -> None:
        """One more."""
        if result.case.path != self._path:
            self.finish()
            self._path, self._results = result.case.path, []
        self._results.append(result)
        if self._live:
            click.echo(f"\r{self._line()}", nl=False)

    def clear(self) -> None:
        """Make room for a failure."""
        if self._live:
            click.echo("\r\x1b[K", nl=False)

    def finish(self) -> None:
        """The file is done."""
        if self._path is not None and not self._quiet:
            self.clear()
            click.echo(self._line())
        self._path = None

    def _line(self) -> str:
        failed = sum(result.error is not None for result in self._results)
        lines = sum(result.lines for result in self._results)
        state = f"{failed} failed" if failed else "ok"
        return f"{self._path}: {len(self._results)} played, {lines} lines, {state}"


def _sum(played: Sequence[CaseResult], unread: int, wall_s: float) -> str:
    """The last line."""
    failed = sum(result.error is not None for result in played)
    lines = sum(result.lines for result in played)
    skipped = sum(result.skipped for result in played)
    parts = [f"{len(played) - failed} passed", f"{failed} failed", f"{lines} lines in {wall_s:.2f} s"]
    if skipped:
        parts.append(f"{skipped} lines left out: they need a bench or another kind of line")
    if unread:
        parts.append(f"{unread} {'file' if unread == 1 else 'files'} cannot be read")
    return ", ".join(parts)
