"""`tmcm34x run`: a program in virtual time, until it is over."""

from __future__ import annotations

import contextlib
import json
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TextIO

import click

from tmcm34x.bench import BenchError, Rig, load, simple_rig
from tmcm34x.cli import CliError, FiniteRange, user_functions
from tmcm34x.cli.source_files import (
    MODELS,
    append_stop_option,
    assemble_file,
    include_option,
    is_hex,
    print_diagnostics,
    read_image,
)
from tmcm34x.clock import HZ, MS, NEVER, clocks, run_until, seconds
from tmcm34x.firmware.motion import RAMP_MODE, V_ACTUAL, V_TARGET, VELOCITY, X_TARGET, Axis
from tmcm34x.firmware.program import ProgramError
from tmcm34x.server.pace import Pace
from tmcm34x.tmcl.commands import WAIT_TYPES
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.mnemonic import format_instruction
from tmcm34x.tmcl.status import STATUS_TEXTS
from tmcm34x.trace.canvas import PngCanvas, SvgCanvas
from tmcm34x.trace.figures import FiguresRecorder, MotorFigures
from tmcm34x.trace.picture import PictureRecorder, draw, picture_height
from tmcm34x.trace.recorder import Recorder, Trace
from tmcm34x.trace.table import TableRecorder
from tmcm34x.trace.waveform import WaveformRecorder

if TYPE_CHECKING:
    from tmcm34x.bench.session.watch import Watch
    from tmcm34x.firmware.module import Module
    from tmcm34x.toolchain.assembler import Assembly

STOPPED: Final = "stopped"
UNTIL: Final = "until"
IDLE: Final = "idle"
INTERRUPTED: Final = "interrupted"

ENDINGS: Final = {
    STOPPED: "the program has stopped and every motor is at rest",
    UNTIL: "the time of --until is over",
    IDLE: "nothing can change any more",
    INTERRUPTED: "interrupted",
}
"""Why a run ends, in words."""

PROGRAM_ERROR: Final = 3
"""Exit status after a program in which a command was refused, or which ran past its end."""

UNFULFILLED: Final = 4
"""Exit status when an expectation of the bench file failed."""

_MOTION: Final = frozenset({1, 2, 3, 4, 13})
"""Commands that are marked in a picture: ROR, ROL, MST, MVP, RFS."""
_WAIT_POS: Final = dict(WAIT_TYPES)["POS"]
POSITIONS: Final = 1 << 24
"""Of the motion chip's counter."""
_NEAR: Final = 2
"""Microsteps by which the pass of a target position is known."""
_MARKS: Final = 100
_IDLE_COMMANDS: Final = 300
_LOOKED_AT: Final = 20_000
"""Commands after which a picture no longer looks for motion commands."""
_SLICE_S: Final = 0.05
_PROGRESS_AFTER_S: Final = 0.7
_OUT: Final = click.Path(dir_okay=False, path_type=Path)
_IN: Final = click.Path(dir_okay=False, path_type=Path)
_EPILOG = """\b
Examples:
  tmcm34x run homing.tmc --bench examples/benches/xy-stage.toml --plot homing.svg
  tmcm34x run profile.tmc --csv profile.csv --sample 5 --until 30
"""


@click.command(epilog=_EPILOG)
@click.argument("file", type=_IN)
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
    help="Of virtual time: 1 is real time, 0 as fast as possible.",
)
@click.option("--bench", type=_IN, metavar="FILE", help="What hangs on the module; bare motors without it.")
@click.option("--csv", "csv_file", type=_OUT, metavar="OUT", help="Write positions and speeds as a table.")
@click.option(
    "--sample",
    type=FiniteRange(0, min_open=True),
    default=10.0,
    show_default=True,
    metavar="MS",
    help="Time between rows of the table.",
)
@click.option("--vcd", "vcd_file", type=_OUT, metavar="OUT", help="Write waveforms for GTKWave or Surfer.")
@click.option(
    "--plot", "plot_file", type=_OUT, metavar="OUT", help="Draw a picture: .svg, or .png with Pillow."
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
@click.option("--seed", type=int, default=0, show_default=True, help="Of everything random, without a bench.")
@user_functions.option
@append_stop_option
@include_option
def command(**options: Any) -> int:
    """Run the TMCL program FILE (source, .bin or .hex) in virtual time and sum up what it did.

    The run ends when the program has stopped and every motor is at rest, at --until, or when nothing can change
    any more; the summary says which.

    Exit status: 0, 1 after mistakes in the source, 3 when the module refused a command of the program or the program
    ran past its end, 4 when an expectation of the bench file failed.
    """
    program, assembly = _read_program(
        options["file"], options["include_path"], append_stop=options["append_stop"]
    )
    if program is None:
        return 1
    rig = _make_rig(options, program)
    with contextlib.ExitStack() as files:
        run = Run(rig, Path(options["file"]), assembly)
        watch = _watch(run)
        _attach_recorders(run, options, files)
        start = time.monotonic()
        until = None if options["until"] is None else clocks(options["until"])
        run.go(until, Pace(options["speed"], time.monotonic), _Progress(sys.stderr, until))
        run.wall_s = time.monotonic() - start
        for finish in run.finishers:
            finish()
    click.echo(json.dumps(run.summary(), indent=2) if options["as_json"] else run.report())
    if run.ending == INTERRUPTED:
        return 130
    for failure in watch.failures if watch else ():
        _report(f"{options['bench']}: {failure}")
    if watch and watch.failures:
        return UNFULFILLED
    return PROGRAM_ERROR if run.error else 0


def _watch(run: Run) -> Watch | None:
    """What looks after the expectations of the bench file, if it has any."""
    if not run.rig.expectations:
        return None
    from tmcm34x.bench.session.watch import Watch

    watch = Watch(run.rig)
    run.recorders.append(watch)
    run.finishers.append(watch.finish)
    return watch


def _read_program(
    path: Path, include_path: tuple[Path, ...], *, append_stop: bool
) -> tuple[tuple[Instruction, ...] | None, Assembly | None]:
    """The program, and its assembly if it is source; mistakes are printed."""
    if path.suffix.lower() == ".bin" or is_hex(path):
        return read_image(path), None
    assembly = assemble_file(path, include_path, append_stop=append_stop)
    print_diagnostics(assembly.diagnostics, assembly.sources)
    return (assembly.program if assembly.ok else None), assembly


def _make_rig(options: dict[str, Any], program: tuple[Instruction, ...]) -> Rig:
    """The bench, with the program in the memory of its first module."""
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
    if options["user_functions"]:
        user_functions.attach(options["user_functions"], rig.modules, _report)
    module.eeprom.write_program(program)
    return rig


def _report(line: str) -> None:
    click.echo(f"tmcm34x run: {line}", err=True)


def _attach_recorders(run: Run, options: dict[str, Any], files: contextlib.ExitStack) -> None:
    watcher = run.watcher
    if options["csv_file"]:
        stream = _open(options["csv_file"], files)
        run.recorders.append(TableRecorder(run.rig, stream, max(1, round(options["sample"] * MS))))
    if options["vcd_file"]:
        watcher.waveform = WaveformRecorder(run.rig, _open(options["vcd_file"], files))
        run.recorders.append(watcher.waveform)
        run.finishers.append(watcher.waveform.close)
    if options["plot_file"]:
        watcher.picture = PictureRecorder(run.rig)
        run.recorders.append(watcher.picture)
        run.finishers.append(_painter(watcher.picture, options["plot_file"], run.file.name))
    if options["trace_on"]:
        watcher.stream = sys.stderr


def _open(path: Path, files: contextlib.ExitStack) -> TextIO:
    try:
        return files.enter_context(path.open("w", encoding="utf-8", newline="\n"))
    except OSError as error:
        raise CliError(f"{path}: {error.strerror}") from None


def _painter(picture: PictureRecorder, path: Path, title: str) -> Callable[[], None]:
    """Draws the picture into its file; what cannot work is told before the run."""
    kinds = {".svg": SvgCanvas, ".png": PngCanvas}
    kind = kinds.get(path.suffix.lower())
    if kind is None:
        raise CliError(f"{path}: pictures are .svg or .png")
    try:
        kind(1)
        path.open("wb").close()
    except ImportError:
        raise CliError(f"{path}: PNG pictures need Pillow (tmcm34x[plot]); SVG ones do not") from None
    except OSError as error:
        raise CliError(f"{path}: {error.strerror}") from None

    def paint() -> None:
        canvas = kind(picture_height(picture))
        draw(picture, canvas, title)
        image = canvas.finish()
        path.write_bytes(image.encode() if isinstance(image, str) else image)

    return paint


class Watcher:
    """Looks at the program of the first module, for those who want to know of each command."""

    def __init__(self, module: Module) -> None:
        self.stream: TextIO | None = None
        self.waveform: WaveformRecorder | None = None
        self.picture: PictureRecorder | None = None
        self._module = module
        self._seen = 0

    @property
    def instruction(self) -> Callable[[int, Instruction, int], None] | None:
        """Wanted as long as somebody has use for it."""
        marking = self.picture is not None and self._seen < _LOOKED_AT and len(self.picture.marks) < _MARKS
        return self._note if marking or self.stream is not None or self.waveform is not None else None

    def telegram(self, port: object, direction: str, data: bytes, now: int) -> None:
        """No telegrams here."""

    def event(self, kind: str, motor: int, now: int) -> None:
        """Mark what happens to motors."""
        if self.picture is not None and motor >= 0:
            self.picture.mark(now, f"{kind} {motor}")

    def _note(self, address: int, instruction: Instruction, now: int) -> None:
        self._seen += 1
        if self.stream is not None:
            program = self._module.program
            text = format_instruction(instruction)
            self.stream.write(
                f"{seconds(now):12.6f}  {address:4}  {text:<28}  A {program.accumulator}  X {program.x}\n"
            )
        if self.waveform is not None:
            self.waveform.instruction(address, now)
        if self.picture is not None and instruction.number in _MOTION:
            self.picture.mark(now, format_instruction(instruction))


@dataclass
class Run:
    """A program at work on a rig, and what became of it."""

    rig: Rig
    file: Path
    assembly: Assembly | None = None
    recorders: list[Recorder] = field(default_factory=list[Recorder])
    finishers: list[Callable[[], None]] = field(default_factory=list[Callable[[], None]])
    ending: str = ""
    error: ProgramError | None = None
    """The first command that was refused."""
    wall_s: float = 0.0

    def __post_init__(self) -> None:
        self.module = self.rig.modules[0]
        self.watcher = Watcher(self.module)
        self.figures = FiguresRecorder(self.rig)

    def go(self, until: int | None, pace: Pace, progress: _Progress) -> None:
        """Start the program and run it to its end."""
        self.module.observer = self.watcher
        trace = Trace(self.rig, [*self.recorders, self.figures])
        self.module.program.run(0)
        with progress:
            try:
                self.ending = self._loop(trace, NEVER if until is None else until, pace, progress)
            except KeyboardInterrupt:
                self.ending = INTERRUPTED

    def _loop(self, trace: Trace, until: int, pace: Pace, progress: _Progress) -> str:
        program = self.module.program
        while True:
            self.error = self.error or program.last_error
            ending = _ending(self.rig)
            when = min(trace.next_event(), until)
            if ending == STOPPED:
                return STOPPED
            if ending == IDLE or when >= NEVER:
                self._let_idle(trace, until)
                return IDLE
            if pace.speed:
                self._keep_pace(trace, when, pace)
            trace.advance(when)
            if when >= until:
                self.error = self.error or program.last_error
                return UNTIL
            progress.show(when)

    def _let_idle(self, trace: Trace, until: int) -> None:
        """Give a program that polls the time to come to its loop."""
        run_until(trace, min(until, trace.now + _IDLE_COMMANDS * self.module.instruction_clocks))

    @staticmethod
    def _keep_pace(trace: Trace, when: int, pace: Pace) -> None:
        """Come near to `when` in real time."""
        while (limit := pace.target()) < when:
            if limit > trace.now:
                trace.advance(limit)
            time.sleep(min(max(0.0, pace.due_s(when) - pace.monotonic()), _SLICE_S))

    # What to tell

    def summary(self) -> dict[str, Any]:
        """Everything, for JSON."""
        program = self.module.program
        return {
            "ending": self.ending,
            "simulated_s": seconds(self.rig.now),
            "wall_s": round(self.wall_s, 6),
            "instructions": program.executed,
            "motors": [motor._asdict() for motor in self.figures.figures()],
            "variables": {str(n): value for n, value in enumerate(program.variables) if value},
            "outputs": self.module.board.outputs,
            "error": self._error_summary(),
        }

    def _error_summary(self) -> dict[str, Any] | None:
        if self.error is None:
            return None
        return {
            "address": self.error.address,
            "status": int(self.error.status),
            "place": self._place(self.error.address),
            "text": self._error_text(self.error),
        }

    def _place(self, address: int) -> str:
        """Where a command stands: file and line where known."""
        if self.assembly is not None and address < len(self.assembly.source_map):
            location = self.assembly.source_map[address]
            return f"{location.file}:{location.line}"
        return f"{self.file}: address {address}"

    def _error_text(self, error: ProgramError) -> str:
        stored = (
            self.module.eeprom.read_instruction(error.address) if error.address < 2048 else Instruction(0)
        )
        if stored.number == 0:
            return "the program ran past its end; is a STOP missing?"
        return f"{format_instruction(stored)}: {STATUS_TEXTS[error.status]} (status {error.status:d})"

    def report(self) -> str:
        """Everything, for people."""
        now = seconds(self.rig.now)
        rows = [("ended", ENDINGS[self.ending]), ("simulated", f"{now:.6f} s{self._rate(now)}")]
        rows.append(("executed", f"{self.module.program.executed} instructions"))
        rows += [(self._name(motor), _motor_text(motor)) for motor in self.figures.figures() if _told(motor)]
        variables = {n: value for n, value in enumerate(self.module.program.variables) if value}
        if variables:
            rows.append(("variables", ", ".join(f"{n} = {value}" for n, value in variables.items())))
        if self.module.board.outputs:
            rows.append(("outputs", f"{self.module.board.outputs:08b}"))
        if self.error is not None:
            rows.append(("error", f"{self._place(self.error.address)}: {self._error_text(self.error)}"))
        return "\n".join(f"{name:<11} {text}" for name, text in rows)

    def _rate(self, now: float) -> str:
        return (
            f" in {self.wall_s:.2f} s, {now / self.wall_s:.0f} times real time" if self.wall_s > 0.005 else ""
        )

    def _name(self, motor: MotorFigures) -> str:
        return f"motor {motor.module}.{motor.motor}" if len(self.rig.modules) > 1 else f"motor {motor.motor}"


def _told(motor: MotorFigures) -> bool:
    return bool(motor.distance or motor.position or motor.module == 0)


def _motor_text(motor: MotorFigures) -> str:
    return f"distance {motor.distance}, peak speed {motor.peak_speed}, position {motor.position}"


def _ending(rig: Rig) -> str:
    """Why the run is over now; empty while it is not."""
    programs = [module.program for module in rig.modules]
    if any(program.next_event() < NEVER for program in programs):
        return ""
    if not all(map(_settled, rig.modules)):
        return ""
    axes = [axis for module in rig.modules for axis in module.axes]
    turning = any(axis.read(V_ACTUAL) for axis in axes)
    active = any(program.active for program in programs)
    if not turning and not active and not any(map(_searching, rig.modules)):
        return STOPPED
    if any(map(_awaits_pass, rig.modules)):
        return ""
    return IDLE if _uneventful(rig) else ""


def _uneventful(rig: Rig) -> bool:
    """Whether nothing is ahead but that evenly turning motors pass their target positions, which concerns nobody.

    A target position less than half a turn of the counter ahead must be passed first: what comes behind it, such as
    a switch, is not known before.
    """
    passes = NEVER
    for module in rig.modules:
        for axis in module.axes:
            chip, smda = module.board.wiring(axis.motor)
            motion = module.board.chips[chip].motion(smda)
            if motion.rate_hz:
                way = axis.read(X_TARGET) - motion.position
                steps = ((way if motion.rate_hz > 0 else -way) - 1) % POSITIONS + 1 - _NEAR
                if steps < POSITIONS // 2:
                    return False
                passes = min(passes, module.now + int(steps / abs(motion.rate_hz) * HZ))
    return rig.next_event() >= passes


def _awaits_pass(module: Module) -> bool:
    """Whether the program waits until a turning motor passes its target position."""
    program = module.program
    if not program.waiting:
        return False
    _, kind, motor, _ = module.eeprom.read_instruction(program.counter)
    return kind == _WAIT_POS and bool(module.axes[motor].read(V_ACTUAL))


def _searching(module: Module) -> bool:
    return any(search.state for search in module.searches)


def _settled(module: Module) -> bool:
    """Whether each motor goes on as it does now: at rest, turning evenly, or held by a switch."""
    return all(
        axis.read(V_ACTUAL) == axis.read(V_TARGET) if axis.read(RAMP_MODE) == VELOCITY else _arrived(axis)
        for axis in module.axes
    ) or _held(module)


def _arrived(axis: Axis) -> bool:
    return axis.at_target and not axis.read(V_ACTUAL)


def _held(module: Module) -> bool:
    """Whether motors that want to move are held by switches, all of them at rest."""
    return module.board.next_event() >= NEVER and not any(axis.read(V_ACTUAL) for axis in module.axes)


class _Progress:
    """Shows the simulated time on a terminal once a run takes longer than a moment."""

    def __init__(self, stream: TextIO, until: int | None) -> None:
        self._until = until
        self._due_s = time.monotonic() + _PROGRESS_AFTER_S if stream.isatty() else float("inf")
        self._bar: Any = None
        self._task: Any = None

    def __enter__(self) -> None:
        """Nothing is shown yet."""

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.stop()

    def show(self, now: int) -> None:
        """Tell the time, if it is time to."""
        if time.monotonic() < self._due_s:
            return
        self._due_s = time.monotonic() + 0.1
        bar = self._bar or self._open()
        bar.update(self._task, completed=now, simulated=f"{now / HZ:.1f} s simulated")

    def _open(self) -> Any:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

        bar = self._bar = Progress(
            BarColumn(), TextColumn("{task.fields[simulated]}"), TimeElapsedColumn(),
            console=Console(stderr=True), transient=True,
        )  # fmt: skip
        self._task = bar.add_task("", total=self._until, simulated="")
        bar.start()
        return bar
