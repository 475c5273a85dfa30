"""The runs of a sweep, over processes of this machine.

A process is started anew and gets the job once; rows and results are plain values.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Generator, Iterable, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from typing import Any, Final

from tmcm34x.sweep import work
from tmcm34x.sweep.plan import Job, Row
from tmcm34x.sweep.single import RowResult

_AHEAD: Final = 2
"""Slices for each process that are given out before their turn."""


def results(job: Job, rows: Sequence[Row], wanted: Iterable[int], processes: int) -> Generator[work.Numbered]:
    """The results of the wanted rows as they come, in no order; ends its processes when it is closed."""
    left = work.RowQueue(rows, wanted, processes * _AHEAD)
    while left:
        with _pool(job, processes) as submit:
            yield from left.results(submit, BrokenProcessPool, one_loss_is_all=True)


@contextmanager
def _pool(job: Job, processes: int) -> Generator[work.Submit]:
    """Processes for the job, ended behind the block also in the middle of a run."""
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(processes, mp_context=context, initializer=_begin, initargs=(job,))

    def submit(rows: list[Row]) -> Future[list[RowResult]]:
        try:
            with held_back():
                return pool.submit(_do, rows)
        except BrokenProcessPool as error:
            return _failed(error)

    try:
        yield submit
    finally:
        _end(pool)


@contextmanager
def held_back() -> Generator[None]:
    """Hold interrupts back, also from processes that start: before `_begin` one would end them with a traceback."""
    if sys.platform == "win32":
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _failed(error: Exception) -> Future[list[RowResult]]:
    future: Future[list[RowResult]] = Future()
    future.set_exception(error)
    return future


def _end(pool: ProcessPoolExecutor) -> None:
    """End the processes, also in the middle of a run, and the pool's thread.

    The interpreter's end would wake that thread through a pipe that the thread may just be closing.
    """
    processes: dict[int, Any] = getattr(pool, "_processes", None) or {}
    running = list(processes.values())
    manager: threading.Thread | None = getattr(pool, "_executor_manager_thread", None)
    pool.shutdown(wait=False, cancel_futures=True)
    for process in running:
        process.terminate()
    if manager is not None:
        manager.join()  # it waits for the processes


_jobs: list[Job] = []
"""Of this process: the one that it works at."""


def _begin(job: Job) -> None:
    """In a new process: an interrupt is the business of the process that started it, whose end is its own end too."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_starter, daemon=True).start()
    _jobs[:] = [job]


def _end_with_starter() -> None:
    starter = multiprocessing.parent_process()
    assert starter is not None
    starter.join()
    os._exit(1)


def _do(rows: Sequence[Row]) -> list[RowResult]:
    return work.do(_jobs[0], rows)
