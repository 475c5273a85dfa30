"""`tmcm34x sweep`: a program many times, with values that change."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Iterator
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING

import click

from tmcm34x.bench import BenchError
from tmcm34x.bench.description import read as read_bench
from tmcm34x.cli import CliError
from tmcm34x.cli.source_files import include_option, include_reader, read_source
from tmcm34x.sweep import plan
from tmcm34x.sweep.description import Sweep, SweepError, read
from tmcm34x.sweep.runner import results
from tmcm34x.sweep.single import check_expressions
from tmcm34x.sweep.sources import gather
from tmcm34x.sweep.table import Table

if TYPE_CHECKING:
    from tmcm34x.sweep.runner import Numbered

_OUT = click.Path(dir_okay=False, path_type=Path)
_EPILOG = """\b
Example:
  tmcm34x sweep examples/sweeps/xy-stage.toml --out xy-stage.csv
"""


@click.command(epilog=_EPILOG)
@click.argument("file", type=_OUT)
@click.option(
    "--out", type=_OUT, metavar="OUT.csv", help="The table of results.  [default: FILE with the ending .csv]"
)
@click.option(
    "--processes",
    type=click.IntRange(1, 1024),
    default=os.cpu_count() or 1,
    help="Runs at the same time.  [default: the number of processors]",
)
@include_option
def command(file: Path, out: Path | None, processes: int, include_path: tuple[Path, ...]) -> int:
    """Run a program once for each row of the sweep FILE (TOML) and write figures of each run as CSV.

    docs/sweeps.md says what the file holds.  The table does not depend on the number of processes.

    Exit status: 0, 1 when rows have failed, 2 after mistakes in the sweep, 130 when interrupted; what is done is kept.
    """
    job, rows = _job(file, include_path)
    out = out or file.with_suffix(".csv")
    try:
        table = Table(out, job.sweep, rows)
    except OSError as error:
        raise CliError(f"{out}: {error.strerror}") from None
    failed = done = 0
    interrupted = False
    try:
        with closing(results(job, rows, range(len(rows)), processes)) as coming:
            for number, result in _watched(coming, len(rows)):
                table.write(number, result)
                done += 1
                if result.error:
                    failed += 1
                    _report(f"row {number} ({_values(job.sweep, rows[number])}): {result.error}")
    except KeyboardInterrupt:
        interrupted = True
    finally:
        table.close()
    click.echo(f"{out}: {done} of {len(rows)} rows" + (f", {failed} failed" if failed else ""))
    return 130 if interrupted else 1 if failed else 0


def _job(file: Path, include_path: tuple[Path, ...]) -> tuple[plan.Job, list[plan.Row]]:
    """What the sweep file asks for, checked; a mistake is a usage error."""
    try:
        sweep = read(file)
    except SweepError as error:
        raise CliError(str(error)) from None
    program = file.parent / sweep.program
    text, _ = read_source(program)
    try:
        bench = None if sweep.bench is None else read_bench(file.parent / sweep.bench)
        model = sweep.model if bench is None else bench.module[0].model
        sources = gather(text, str(program), include_reader(include_path), model)
        job, rows = plan.Job(sweep, sources, bench), plan.rows(sweep)
        plan.check(job)
        check_expressions(job)
    except (SweepError, BenchError) as error:
        raise CliError(f"{file}: {error}") from None
    return job, rows


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
