"""`tmcm34x sweep`: a program many times, with values that change."""

from __future__ import annotations

import os
import sys
from collections.abc import Generator, Iterable, Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tmcm34x.cli import CliError
from tmcm34x.cli.outputs import FILE_IN, FILE_OUT, write
from tmcm34x.cli.signals import interruptible
from tmcm34x.cli.source_files import include_option
from tmcm34x.sweep import plan
from tmcm34x.sweep.description import Sweep, SweepError
from tmcm34x.sweep.loading import load
from tmcm34x.sweep.outcomes import results
from tmcm34x.sweep.picture import summary
from tmcm34x.sweep.single import result_of
from tmcm34x.sweep.table import ResultTable, columns, kept_lines, write_parquet
from tmcm34x.trace.canvas import SvgCanvas
from tmcm34x.trace.picture import PictureRecorder, draw, picture_height

if TYPE_CHECKING:
    from tmcm34x.bench import Rig
    from tmcm34x.sweep.work import Numbered

_EPILOG = """\b
Examples:
  tmcm34x sweep examples/sweeps/xy-stage.toml --out xy-stage.csv
  tmcm34x sweep examples/sweeps/xy-stage.toml --row 33 --plot row-33.svg
"""


@click.command(epilog=_EPILOG)
@click.argument("file", type=FILE_IN)
@click.option(
    "--out",
    type=FILE_OUT,
    metavar="OUT.csv",
    help="The table of results.  [default: FILE with the ending .csv]",
)
@click.option(
    "--processes",
    type=click.IntRange(1, 1024),
    default=os.cpu_count() or 1,
    help="Runs at the same time.  [default: the number of processors]",
)
@click.option(
    "--resume", is_flag=True, help="Keep the rows that OUT.csv has already; failed ones are done again."
)
@click.option(
    "--row", type=click.IntRange(0), metavar="N", help="Do the run of row N alone and print its figures."
)
@click.option(
    "--plot", type=FILE_OUT, metavar="OUT.svg", help="With --row: draw positions and speeds of the run."
)
@click.option(
    "--cluster",
    metavar="ADDRESS",
    help="Do the runs on the dask.distributed cluster with this scheduler, such as tcp://127.0.0.1:8786.",
)
@click.option("--parquet", type=FILE_OUT, metavar="OUT.parquet", help="Write the table in Parquet too.")
@click.option(
    "--picture", type=FILE_OUT, metavar="OUT.svg", help="Draw each figure against each varied value."
)
@include_option
def command(**options: Any) -> int:
    """Run a program once for each row of the sweep FILE (TOML) and write figures of each run as CSV.

    docs/sweeps.md says what the file holds.  The table does not depend on the number of processes.

    Exit status: 0, 1 when rows have failed, 2 after mistakes in the sweep, 130 when interrupted; what is done is kept.
    """
    file: Path = options["file"]
    job, rows = _job(file, options["include_path"])
    if options["row"] is not None:
        return _single(job, rows, options["row"], options["plot"])
    if options["plot"]:
        raise click.UsageError("--plot draws one run: give --row N too")
    out: Path = options["out"] or file.with_suffix(".csv")
    try:
        kept = kept_lines(out, job.sweep, rows) if options["resume"] else {}
        table = ResultTable(out, job.sweep, rows, kept)
    except SweepError as error:
        raise CliError(str(error)) from None
    except (OSError, UnicodeDecodeError) as error:
        raise CliError(f"{out}: {getattr(error, 'strerror', 'not a text file in UTF-8')}") from None
    tally = _Tally(len(kept))
    try:
        wanted = [n for n in range(len(rows)) if n not in kept]
        with interruptible():
            coming = results(job, rows, wanted, options["processes"], options["cluster"])
            _run_all(job, rows, coming, table, tally=tally, count=len(wanted))
    except KeyboardInterrupt:
        tally.status = 130
    except SweepError as error:
        raise CliError(str(error)) from None
    finally:
        table.close()
    failed = f", {tally.failed} failed" if tally.failed else ""
    click.echo(f"{out}: {tally.done} of {len(rows)} rows{failed}")
    if options["parquet"]:
        _parquet(out, job.sweep, options["parquet"])
    if options["picture"] and tally.status != 130:
        _summary(out, job.sweep, options["picture"])
    return tally.status


def _parquet(table: Path, sweep: Sweep, path: Path) -> None:
    try:
        write_parquet(table, sweep, path)
    except SweepError as error:
        raise CliError(str(error)) from None
    except OSError as error:
        raise CliError(f"{path}: {error.strerror or error}") from None


def _summary(table: Path, sweep: Sweep, path: Path) -> None:
    try:
        image = summary(table, sweep)
    except ValueError as error:
        raise CliError(f"{path}: {error}") from None
    write(path, image.encode())


@dataclass
class _Tally:
    """How many rows are in the table, how many of them have failed, and the exit status that follows."""

    done: int
    failed: int = 0
    status: int = 0


def _run_all(
    job: plan.Job,
    rows: list[plan.Row],
    coming: Generator[Numbered],
    table: ResultTable,
    *,
    tally: _Tally,
    count: int,
) -> None:
    with closing(coming):
        for number, result in _watched(coming, count):
            table.write(number, result)
            tally.done += 1
            if result.error:
                tally.failed += 1
                tally.status = 1
                _report(f"row {number} ({_values(job.sweep, rows[number])}): {result.error}")


def _single(job: plan.Job, rows: list[plan.Row], number: int, plot: Path | None) -> int:
    """Do the run of one row, and print what its line in the table holds."""
    if number >= len(rows):
        raise CliError(f"--row {number}: the rows are 0 to {len(rows) - 1}")
    pictures: list[PictureRecorder] = []

    def observe(rig: Rig) -> PictureRecorder:
        pictures.append(PictureRecorder(rig))
        return pictures[-1]

    result = result_of(job, rows[number], observe if plot else None)
    figures = result.figures or [""] * len(job.sweep.figures)
    cells = [number, *rows[number], *figures, result.ending, result.error]
    for name, cell in zip(columns(job.sweep), cells, strict=True):
        if cell != "":
            click.echo(f"{name}: {cell}")
    if plot and result.ending:
        _draw(pictures[0], plot, f"row {number}: {_values(job.sweep, rows[number])}")
    return 1 if result.error else 0


def _draw(picture: PictureRecorder, path: Path, title: str) -> None:
    canvas = SvgCanvas(picture_height(picture))
    draw(picture, canvas, title)
    write(path, canvas.finish().encode())


def _job(file: Path, include_path: tuple[Path, ...]) -> tuple[plan.Job, list[plan.Row]]:
    """What the sweep file asks for, checked; a mistake is a usage error."""
    try:
        job = load(file, include_path)
        return job, plan.rows(job.sweep)
    except SweepError as error:
        raise CliError(str(error)) from None


def _values(sweep: Sweep, row: plan.Row) -> str:
    return ", ".join(f"{vary.column} {value}" for vary, value in zip(sweep.vary, row, strict=True))


def _report(line: str) -> None:
    click.echo(f"tmcm34x sweep: {line}", err=True)


def _watched(coming: Iterable[Numbered], count: int) -> Iterator[Numbered]:
    """The same, with a progress bar on a terminal."""
    if not sys.stderr.isatty():
        yield from coming
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeRemainingColumn

    console = Console(stderr=True)
    with Progress(
        BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(), console=console, transient=True
    ) as bar:
        task = bar.add_task("", total=count)
        for each in coming:
            bar.advance(task)
            yield each
