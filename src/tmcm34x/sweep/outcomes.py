"""Sweeps in Python: `load` a job, then `run` its rows, or `run_row` for one of them."""

from __future__ import annotations

import os
from collections.abc import Generator, Iterable
from contextlib import closing
from typing import NamedTuple

from tmcm34x.sweep import cluster, plan, runner
from tmcm34x.sweep.description import Number
from tmcm34x.sweep.plan import Job, Row
from tmcm34x.sweep.single import RowResult, result_of
from tmcm34x.sweep.work import Numbered


class Outcome(NamedTuple):
    """What came out of a row.

    row: its number, from 0
    values: what was varied, by column
    figures: by column; none where there was no run
    ending: "stopped", "break" for the condition of `stop`, "idle", "until"; empty where there was no run
    error: why the row has failed, in one line; empty where it has not
    """

    row: int
    values: dict[str, Number]
    figures: dict[str, int]
    ending: str
    error: str


def run(
    job: Job,
    wanted: Iterable[int] | None = None,
    *,
    processes: int | None = None,
    cluster_address: str | None = None,
) -> Generator[Outcome]:
    """Do the runs of a sweep; the outcomes come as runs are over, in no order.

    wanted: numbers of rows; all of them when None
    processes: of this machine; as many as there are processors when None
    cluster_address: of the scheduler of a `dask.distributed` cluster, which does the runs instead
    Closing the generator ends the runs.  Raises `SweepError`, and `IndexError` for a row that is not there.
    """
    rows = plan.rows(job.sweep)
    numbers = range(len(rows)) if wanted is None else [range(len(rows))[number] for number in wanted]
    with closing(results(job, rows, numbers, processes, cluster_address)) as coming:
        for number, result in coming:
            yield _outcome(job, rows[number], number, result)


def run_row(job: Job, number: int) -> Outcome:
    """Do the run of one row in this process; raises `IndexError` for a row that is not there."""
    row = plan.rows(job.sweep)[number]
    return _outcome(job, row, number, result_of(job, row))


def results(
    job: Job,
    rows: list[Row],
    wanted: Iterable[int],
    processes: int | None = None,
    cluster_address: str | None = None,
) -> Generator[Numbered]:
    """The same as plain results by the numbers of their rows."""
    if cluster_address is not None:
        return cluster.results(job, rows, wanted, cluster_address)
    return runner.results(job, rows, wanted, processes or os.cpu_count() or 1)


def _outcome(job: Job, row: Row, number: int, result: RowResult) -> Outcome:
    columns = [vary.column for vary in job.sweep.vary]
    values = dict(zip(columns, row, strict=True))
    figures = dict(zip(job.sweep.figures, result.figures, strict=False))
    return Outcome(number, values, figures, result.ending, result.error)
