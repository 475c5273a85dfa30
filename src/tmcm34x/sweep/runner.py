"""The runs of a sweep, over processes of this machine.

A process is started anew and gets the job once; rows and results are plain values.  At any time a few rows are with the
processes, so that the loss of one concerns few rows: each of those is done again in a process of its own, and the one
with which that process ends as well has failed.
"""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Generator, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from itertools import islice
from typing import Any, Final, NamedTuple

from tmcm34x.sweep.plan import Job, Row
from tmcm34x.sweep.single import Result, result_of

_AHEAD: Final = 4
"""Rows for each process that are given out before their turn."""
_LOST: Final = Result(error="the process that did the run has ended before it was over")

Numbered = tuple[int, Result]
"""The number of a row, and its result."""


def results(job: Job, rows: Sequence[Row], wanted: Iterable[int], processes: int) -> Generator[Numbered]:
    """The results of the wanted rows as they come, in no order; ends its processes when it is closed."""
    waiting = iter(wanted)
    while given := dict.fromkeys(islice(waiting, processes * _AHEAD)):
        yield from _share(_Share(job, rows, waiting, processes), given)
        for number in given:
            yield number, _alone(job, rows[number])


class _Share(NamedTuple):
    """What processes work at together; `waiting` gives the numbers of the rows that are not given out yet."""

    job: Job
    rows: Sequence[Row]
    waiting: Iterator[int]
    processes: int


def _share(share: _Share, given: dict[int, None]) -> Iterator[Numbered]:
    """Results until all rows are done or a process is lost; `given` are then the rows that were given out."""
    pool = _pool(share.job, share.processes)
    try:
        pending = {pool.submit(_do, share.rows[number]): number for number in given}
        while pending:
            for future in wait(pending, return_when=FIRST_COMPLETED).done:
                result = _result(future)
                if result is None:
                    return
                number = pending.pop(future)
                del given[number]
                yield number, result
                for following in islice(share.waiting, 1):
                    given[following] = None
                    pending[pool.submit(_do, share.rows[following])] = following
    except BrokenProcessPool:
        return
    finally:
        _end(pool)


def _result(future: Future[Result]) -> Result | None:
    """None where the process was lost."""
    try:
        return future.result()
    except BrokenProcessPool:
        return None


def _alone(job: Job, row: Row) -> Result:
    """The result of a row in a process of its own."""
    pool = _pool(job, 1)
    try:
        return _result(pool.submit(_do, row)) or _LOST
    finally:
        _end(pool)


def _pool(job: Job, processes: int) -> ProcessPoolExecutor:
    context = multiprocessing.get_context("spawn")
    return ProcessPoolExecutor(processes, mp_context=context, initializer=_begin, initargs=(job,))


def _end(pool: ProcessPoolExecutor) -> None:
    """Finished processes go; those in the middle of a run are ended."""
    processes: dict[int, Any] = getattr(pool, "_processes", None) or {}
    running = list(processes.values())
    pool.shutdown(wait=False, cancel_futures=True)
    for process in running:
        process.terminate()
    for process in running:
        process.join()


_jobs: list[Job] = []
"""Of this process: the one that it works at."""


def _begin(job: Job) -> None:
    """In a new process: an interrupt is the business of the process that started it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _jobs[:] = [job]


def _do(row: Row) -> Result:
    return result_of(_jobs[0], row)
