"""The runs of a sweep on a cluster of `dask.distributed` (extra `cluster`).

The job is sent to each worker once; after that rows and results travel as plain values.
"""

from __future__ import annotations

import logging
import re
from collections.abc import Generator, Iterable, Sequence
from importlib import import_module
from typing import Any, Final

from tmcm34x.sweep import work
from tmcm34x.sweep.description import SweepError
from tmcm34x.sweep.plan import Job, Row

_AHEAD: Final = 2
"""Slices for each thread of a worker that are given out before their turn."""
_ADDRESS: Final = re.compile(r"(?:[a-z]+://)?[^/\s]+:\d+")
_TIMEOUT_S: Final = 5
"""How long the scheduler may take to answer."""
_WORKERS_S: Final = 30
"""How long the first worker may take to come, so that a cluster can be started right before a sweep."""


def results(job: Job, rows: Sequence[Row], wanted: Iterable[int], address: str) -> Generator[work.Numbered]:
    """The results of the wanted rows as they come, in no order.

    address: of the scheduler, as in `tcp://127.0.0.1:8786`
    Raises `SweepError` without the extra, without an answer of the scheduler, and without workers that can do it.
    """
    distributed = library("distributed")
    with _client(distributed, address) as client:
        threads = _threads(client, address)
        shared = client.scatter(job, broadcast=True, hash=False)
        executor = client.get_executor(pure=False)
        left = work.RowQueue(rows, wanted, threads * _AHEAD)
        try:
            yield from left.results(
                lambda rows: executor.submit(work.do, shared, rows),
                distributed.KilledWorker,
                one_loss_is_all=False,
            )
        except ImportError as error:
            raise SweepError(f"{address}: a worker cannot do runs: {error}") from None


def _client(distributed: Any, address: str) -> Any:
    if not _ADDRESS.fullmatch(address):
        raise SweepError(f"{address}: the address of a scheduler is written as tcp://HOST:PORT")
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    try:
        return distributed.Client(address, timeout=_TIMEOUT_S, set_as_default=False)
    except (OSError, ValueError, TypeError):
        raise SweepError(f"{address}: no scheduler answers there; start one with: dask scheduler") from None


def _threads(client: Any, address: str) -> int:
    """How many threads the workers have; waits for the first one."""
    try:
        client.wait_for_workers(1, timeout=_WORKERS_S)
    except TimeoutError:
        raise SweepError(
            f"{address}: the cluster has no workers; start some with: dask worker {address}"
        ) from None
    return sum(client.nthreads().values())


def library(name: str) -> Any:
    """A library of the extra `cluster`; raises `SweepError` where it is not installed."""
    try:
        return import_module(name)
    except ImportError:
        raise SweepError(
            f"{name} is not installed; install it with: pip install 'tmcm34x[cluster]'"
        ) from None
