"""From a sweep file to its job: program, bench and names, all checked."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from tmcm34x.bench import BenchError
from tmcm34x.bench.description import read as read_bench
from tmcm34x.editor import disk
from tmcm34x.sweep import plan
from tmcm34x.sweep.description import Sweep, SweepError, read
from tmcm34x.sweep.single import check_expressions
from tmcm34x.sweep.sources import gather


def load(file: str | Path, include_path: Sequence[Path] = ()) -> plan.Job:
    """The job of the sweep file `file`; raises `SweepError` with one line for any mistake in it, before any run.

    include_path: folders where `#include` files are looked for too
    """
    path = Path(file)
    sweep = read(path)
    text = _source(path.parent / sweep.program)
    try:
        return _checked(path, sweep, text, include_path)
    except (SweepError, BenchError) as error:
        raise SweepError(f"{path}: {error}") from None


def _source(program: Path) -> str:
    try:
        return disk.read_text(program)
    except (OSError, ValueError) as error:
        raise SweepError(f"{program}: {getattr(error, 'strerror', None) or error}") from None


def _checked(path: Path, sweep: Sweep, text: str, include_path: Sequence[Path]) -> plan.Job:
    bench = None if sweep.bench is None else read_bench(path.parent / sweep.bench)
    model = sweep.model if bench is None else bench.module[0].model
    reader = disk.include_reader(include_path)
    job = plan.Job(sweep, gather(text, str(path.parent / sweep.program), reader, model), bench)
    plan.check(job)
    check_expressions(job)
    return job
