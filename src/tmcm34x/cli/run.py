"""`tmcm34x run`: a program in virtual time, until it is over."""

from __future__ import annotations

import contextlib
import json
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from tmcm34x.bench import BenchError, Rig, load, simple_rig
from tmcm34x.bench.run import INTERRUPTED, Run
from tmcm34x.cli import (
    CliError,
    FiniteRange,
    coverage,
    parameter_options,
    session_file,
    state,
    user_functions,
)
from tmcm34x.cli.outputs import FILE_IN, FILE_OUT, TEXT_OUT, only_one
from tmcm34x.cli.progress import Progress
from tmcm34x.cli.recording import Recording
from tmcm34x.cli.report import Report
from tmcm34x.cli.signals import interruptible
from tmcm34x.cli.source_files import (
    MODELS,
    append_stop_option,
    assemble_file,
    include_option,
    is_hex,
    print_diagnostics,
    read_image,
)
from tmcm34x.clock import clocks, seconds
from tmcm34x.firmware.program import AddressCounts
from tmcm34x.server.pace import Pace
from tmcm34x.tmcl.commands import INT32_MAX, INT32_MIN, USER_VARIABLES
from tmcm34x.trace.recorder import Trace

if TYPE_CHECKING:
    from tmcm34x.bench.session.watch import ExpectationWatch
    from tmcm34x.debug.conditions import Look
    from tmcm34x.tmcl.datagram import Instruction
    from tmcm34x.toolchain.assembler import Assembly

PROGRAM_ERROR: Final = 3
"""Exit status after a program in which a command was refused, or which ran past its end."""

UNFULFILLED: Final = 4
"""Exit status when an expectation of the bench file failed."""

_SLICE_S: Final = 0.05


class Assignment(click.ParamType[tuple[int, int]]):
    """`N=VALUE`: a user variable and what it is set to."""

    name = "assignment"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[int, int]:
        """Number and value, or a usage error."""
        name, _, text = str(value).partition("=")
        try:
            number, content = int(name), int(text, 0)
        except ValueError:
            self.fail(f"{value}: write N=VALUE, such as 10=1.", param, ctx)
        if not 0 <= number < USER_VARIABLES:
            self.fail(f"{value}: user variables have the numbers 0 to {USER_VARIABLES - 1}.", param, ctx)
        if not INT32_MIN <= content <= INT32_MAX:
            self.fail(f"{value}: a user variable has 32 bits.", param, ctx)
        return number, content


_TEXTS: Final = {"csv": "csv_file", "vcd": "vcd_file", "save-session": "save_session"}
"""Options whose outputs may go to standard output."""
_IN: Final = click.Path(dir_okay=False, path_type=Path)
_EPILOG = """\b
Examples:
  tmcm34x run homing.tmc --bench examples/benches/xy-stage.toml --plot homing.svg
  tmcm34x run profile.tmc --csv profile.csv --sample 5 --until 30
"""


@click.command(epilog=_EPILOG)
@click.argument("file", type=FILE_IN)
@click.option("--model", type=click.Choice(MODELS), help="Module type; 343 unless the bench says otherwise.")
@click.option(
    "--until",
    type=FiniteRange(0),
    metavar="SECONDS",
    help="End after this simulated time at the latest.",
)
@click.option(
    "--speed",
    type=FiniteRange(0),
    default=0.0,
    show_default=True,
    metavar="FACTOR",
    help="Speed of virtual time: 1 is real time, 0 as fast as possible.",
)
@click.option(
    "--bench", type=FILE_IN, metavar="FILE", help="What is connected to the module; bare motors without it."
)
@click.option(
    "--csv", "csv_file", type=TEXT_OUT, metavar="OUT", help="Write positions and speeds as a table."
)
@click.option(
    "--sample",
    type=FiniteRange(0, min_open=True),
    default=10.0,
    show_default=True,
    metavar="MS",
    help="Time between rows of the table.",
)
@click.option(
    "--vcd", "vcd_file", type=TEXT_OUT, metavar="OUT", help="Write waveforms for GTKWave or Surfer."
)
@click.option(
    "--plot", "plot_file", type=FILE_OUT, metavar="OUT", help="Draw a picture: .svg, or .png with Pillow."
)
@click.option(
    "--trace", "trace_on", is_flag=True, help="Print each command on standard error as it is executed."
)
@click.option("--json", "as_json", is_flag=True, help="Print the summary as JSON.")
@click.option(
    "--instruction-time",
    type=FiniteRange(0, 1e6, min_open=True),
    metavar="US",
    help="Time of one TMCL instruction in microseconds; 100 unless the bench says otherwise, an assumption.",
)
@click.option(
    "--seed", type=int, default=0, show_default=True, help="Seed of all random numbers; a bench has its own."
)
@click.option(
    "--set",
    "variables",
    multiple=True,
    type=Assignment(),
    metavar="N=VALUE",
    help="Set user variable N before the start; may be given several times.",
)
@click.option(
    "--break",
    "condition",
    metavar="EXPR",
    help="End when this expression of the debugger is not 0, such as 'ap[1][0] > 5000 && gp[3] == 1'.",
)
@click.option("--save-state", type=FILE_OUT, metavar="OUT", help="Write the state of the bench at the end.")
@click.option(
    "--save-session",
    type=TEXT_OUT,
    metavar="OUT",
    help="Write a session that reaches the moment of the end, for tmcm34x play.",
)
@click.option(
    "--from-state",
    type=_IN,
    metavar="FILE",
    help="Go on from a state that --save-state wrote, on the same bench.",
)
@click.option(
    "--coverage",
    "coverage_file",
    type=FILE_OUT,
    metavar="OUT.info",
    help="Add which lines and branches were executed to an lcov tracefile, with an HTML page beside it.",
)
@click.option("--profile", is_flag=True, help="Print what took the time, by subroutine and line.")
@parameter_options.option
@user_functions.option
@append_stop_option
@include_option
def command(**options: Any) -> int:
    """Run the TMCL program FILE (source, .bin or .hex) in virtual time and sum up what it did.

    The run ends when the program has stopped and every motor is at rest, at --until, or when nothing can change
    any more; the summary names the reason.

    Exit status: 0, 1 after mistakes in the source, 3 when the module refused a command of the program or the program
    ran past its end, 4 when an expectation of the bench file failed, 130 when interrupted.
    """
    file = Path(options["file"])
    aside = _summary_aside(options)
    session_file.check(options)
    rig = _make_rig(options)
    program, assembly = _read_program(file, options, rig.modules[0].board.model.number)
    if program is None:
        return 1
    rig.modules[0].eeprom.write_program(program)
    earlier = coverage.check(options, assembly)
    if options["from_state"]:
        state.read(options["from_state"], rig, program, options["file"])
    counts = AddressCounts() if options["coverage_file"] or options["profile"] else None
    rig.modules[0].program.count(counts)
    with contextlib.ExitStack() as files:
        recording = Recording(rig, options, files, file.name)
        watch = _watch(rig, recording)
        look = _condition(options["condition"], rig)
        trace = Trace(rig, recording.recorders)
        run = Run(rig, trace) if look is None else Run(rig, trace, look.holds, look.next_event)
        report = Report(run, recording.figures, file, assembly)
        _go(run, report, recording, options)
        recording.finish()
    failures = [str(failure) for failure in watch.failures] if watch else []
    summary = {**report.summary(), "failures": failures}
    click.echo(json.dumps(summary, indent=2) if options["as_json"] else str(report), err=aside)
    run.module.program.count(None)
    if options["save_state"]:
        state.write(options["save_state"], rig)
    if options["save_session"]:
        session_file.write(options, rig, program)
    if counts is not None and assembly is not None:
        if options["coverage_file"]:
            coverage.write(options["coverage_file"], assembly, counts, earlier)
        if options["profile"]:
            click.echo("\n" + coverage.profile(assembly, counts, run.module), err=aside or options["as_json"])
    if run.ending == INTERRUPTED:
        return 130
    for failure in failures:
        _report(f"{options['bench']}: {failure}")
    if failures:
        return UNFULFILLED
    return PROGRAM_ERROR if run.refusals else 0


def _summary_aside(options: dict[str, Any]) -> bool:
    """Whether the summary makes room for something else on standard output."""
    outputs = {f"--{name}": options[key] for name, key in _TEXTS.items()}
    return only_one({**outputs, "--json": options["as_json"]}) and not options["as_json"]


def _go(run: Run, report: Report, recording: Recording, options: dict[str, Any]) -> None:
    """Run to the end, at the pace that is wanted, or until interrupted."""
    start_s = time.monotonic()
    until = None if options["until"] is None else clocks(options["until"])
    pace = Pace(options["speed"], time.monotonic)
    progress = Progress(sys.stderr, until, lambda: _note(run, report))
    run.module.observers.append(recording.watcher)
    with progress, interruptible():
        try:
            run.start(None if options["from_state"] else 0)
            for when in run.events(until):
                if pace.speed:
                    _keep_pace(run, when, pace)
                progress.show(run.rig.now)
        except KeyboardInterrupt:
            run.finish(INTERRUPTED)
    report.wall_s = time.monotonic() - start_s


def _keep_pace(run: Run, when: int, pace: Pace) -> None:
    """Come near to `when` in real time."""
    while (limit := pace.target()) < when:
        run.approach(limit)
        time.sleep(min(max(0.0, pace.due_s(when) - pace.monotonic()), _SLICE_S))


def _note(run: Run, report: Report) -> str:
    """Why a run goes on and on."""
    turning = [f"motor {motor.motor} of module {motor.module} turns" for motor in run.turning()]
    now = seconds(run.rig.now)
    return "; ".join([
        f"tmcm34x run: {now:.1f} s simulated and no end in sight: the program {report.standing()}", *turning,
        "interrupt it, or end it with --until SECONDS",
    ])  # fmt: skip


def _condition(text: str | None, rig: Rig) -> Look | None:
    """The condition of --break; a mistake in it is a usage error."""
    if text is None:
        return None
    from tmcm34x.debug.conditions import Condition
    from tmcm34x.debug.expressions import ExpressionError

    try:
        condition = Condition(text)
        condition.check(rig)
    except ExpressionError as error:
        raise CliError(f"--break {text}: {error}") from None
    return condition.on(rig)


def _watch(rig: Rig, recording: Recording) -> ExpectationWatch | None:
    """What looks after the expectations of the bench file, if it has any."""
    if not rig.expectations:
        return None
    from tmcm34x.bench.session.watch import ExpectationWatch

    watch = ExpectationWatch(rig)
    recording.add(watch, watch.finish)
    return watch


def _read_program(
    path: Path, options: dict[str, Any], model: int
) -> tuple[tuple[Instruction, ...] | None, Assembly | None]:
    """The program, and its assembly if it is source; mistakes are printed."""
    if path.suffix.lower() == ".bin" or is_hex(path):
        return read_image(path), None
    assembly = assemble_file(path, options["include_path"], append_stop=options["append_stop"], model=model)
    print_diagnostics(assembly.diagnostics, assembly.sources)
    return (assembly.program if assembly.ok else None), assembly


def _make_rig(options: dict[str, Any]) -> Rig:
    """The bench, with what the options set in its first module."""
    if options["bench"] is None:
        rig = simple_rig(int(options["model"] or MODELS[-1]), seed=options["seed"])
    else:
        try:
            rig = load(options["bench"])
        except BenchError as error:
            raise CliError(str(error)) from None
    module = rig.modules[0]
    if options["model"] not in {None, str(module.board.model.number)}:
        raise CliError(
            f"{options['bench']}: the module is a {module.board.model.name}, not a {options['model']}"
        )
    if options["instruction_time"]:
        module.instruction_clocks = max(1, clocks(options["instruction_time"] * 1e-6))
    parameter_options.apply(options["parameters"], rig)
    if options["user_functions"]:
        user_functions.attach(options["user_functions"], rig.modules, _report)
    for number, value in options["variables"]:
        module.program.variables[number] = value
    return rig


def _report(line: str) -> None:
    click.echo(f"tmcm34x run: {line}", err=True)
