"""What `tmcm34x run` writes down while a program runs: table, waveforms, picture, trace."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TextIO

from tmcm34x.cli import CliError
from tmcm34x.cli.outputs import is_standard_output
from tmcm34x.clock import MS, seconds
from tmcm34x.tmcl.commands import BY_MNEMONIC
from tmcm34x.tmcl.mnemonic import format_instruction
from tmcm34x.trace.canvas import PngCanvas, SvgCanvas
from tmcm34x.trace.figures import FiguresRecorder
from tmcm34x.trace.picture import PictureRecorder, draw, picture_height
from tmcm34x.trace.recorder import Recorder
from tmcm34x.trace.table import TableRecorder
from tmcm34x.trace.waveform import WaveformRecorder

if TYPE_CHECKING:
    from tmcm34x.bench import Rig
    from tmcm34x.firmware.module import FirmwareModule
    from tmcm34x.tmcl.datagram import Instruction

_MOTION: Final = frozenset(BY_MNEMONIC[name].number for name in ("ROR", "ROL", "MST", "MVP", "RFS"))
"""Commands that are marked in a picture."""
_MARKS: Final = 100
_LOOKED_AT: Final = 20_000
"""Commands after which a picture no longer looks for motion commands."""


class Recording:
    """The recorders of one run; `finish` at its end completes their files.

    options: those of the command line
    files: closes the files
    """

    def __init__(self, rig: Rig, options: dict[str, Any], files: contextlib.ExitStack, title: str) -> None:
        self.figures = FiguresRecorder(rig)
        self.recorders: list[Recorder] = [self.figures]
        self.watcher = Watcher(rig.modules[0])
        self._finishers: list[Callable[[], None]] = []
        if options["csv_file"]:
            stream = _open(options["csv_file"], files)
            table = TableRecorder(rig, stream, max(1, round(options["sample"] * MS)))
            self.add(table, table.close)
        if options["vcd_file"]:
            self.watcher.waveform = WaveformRecorder(rig, _open(options["vcd_file"], files))
            self.add(self.watcher.waveform, self.watcher.waveform.close)
        if options["plot_file"]:
            self.watcher.picture = PictureRecorder(rig)
            self.add(self.watcher.picture, _painter(self.watcher.picture, options["plot_file"], title))
        if options["trace_on"]:
            self.watcher.stream = sys.stderr

    def finish(self) -> None:
        """The run is over."""
        for finish in self._finishers:
            finish()

    def add(self, recorder: Recorder, finish: Callable[[], None]) -> None:
        """A further recorder, and what is to be done at its end."""
        self.recorders.append(recorder)
        self._finishers.append(finish)


def _open(path: Path, files: contextlib.ExitStack) -> TextIO:
    if is_standard_output(path):
        return sys.stdout
    try:
        return files.enter_context(path.open("w", encoding="utf-8", newline="\n"))
    except OSError as error:
        raise CliError(f"{path}: {error.strerror}") from None


def _painter(picture: PictureRecorder, path: Path, title: str) -> Callable[[], None]:
    """Draws the picture into its file; what cannot work is reported before the run."""
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
    """Observes the module whose program runs, for the recorders that need each command."""

    def __init__(self, module: FirmwareModule) -> None:
        self.stream: TextIO | None = None
        self.waveform: WaveformRecorder | None = None
        self.picture: PictureRecorder | None = None
        self._module = module
        self._seen = 0

    @property
    def instruction(self) -> Callable[[int, Instruction, int], None] | None:
        """Wanted as long as a recorder has use for it."""
        marking = self.picture is not None and self._seen < _LOOKED_AT and len(self.picture.marks) < _MARKS
        return self._note if marking or self.stream is not None or self.waveform is not None else None

    def telegram(self, port: object, direction: str, data: bytes, now: int) -> None:
        """Not recorded: a run has no telegrams."""

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
