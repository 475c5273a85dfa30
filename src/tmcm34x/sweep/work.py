"""Rows that wait to be done, and rows that workers have: the same for processes and for a cluster.

Workers are given slices of rows and return what they have done of a slice in a short time, so that short runs cost few
messages and long ones lose little.  Slices become smaller towards the end, so that all workers end at about the same
time.  A slice whose worker was lost is given out again, row by row; a row with which its worker is lost alone has
failed.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from typing import Final

from tmcm34x.sweep.plan import Job, Row
from tmcm34x.sweep.single import RowResult, result_of

_LARGEST: Final = 256
"""Rows of a slice."""
_SLICE_S: Final = 0.2
"""After so long a worker returns what it has done of a slice."""
LOST: Final = RowResult(error="the process that did the run has ended before it was over")

Numbered = tuple[int, RowResult]
"""The number of a row, and its result."""
Submit = Callable[[list[Row]], "Future[list[RowResult]]"]


def do(job: Job, rows: Sequence[Row]) -> list[RowResult]:
    """The results of the first rows of a slice: of one at least, and of as many as a short time is enough for."""
    end = time.monotonic() + _SLICE_S
    done: list[RowResult] = []
    for row in rows:
        done.append(result_of(job, row))
        if time.monotonic() > end:
            break
    return done


class RowQueue:
    """The wanted rows of a sweep.

    crew: slices that are with workers at the same time
    """

    def __init__(self, rows: Sequence[Row], wanted: Iterable[int], crew: int) -> None:
        self._rows = rows
        self._crew = crew
        self._waiting = deque(wanted)
        self._doubtful: deque[int] = deque()
        """Rows of slices whose worker was lost."""
        self._given: dict[Future[list[RowResult]], list[int]] = {}
        self._size = 1

    def __bool__(self) -> bool:
        return bool(self._waiting or self._doubtful or self._given)

    def results(self, submit: Submit, lost: type[Exception], *, one_loss_is_all: bool) -> Iterator[Numbered]:
        """Results as they come, until all rows are done, or until a worker is lost and with it all others.

        lost: what a slice raises whose worker was lost
        one_loss_is_all: the loss of one worker loses all slices; go on with new workers then, while there is work
        """
        while self:
            self._give(submit, 1 if self._doubtful and one_loss_is_all else self._crew)
            for future in wait(self._given, return_when=FIRST_COMPLETED).done:
                try:
                    done = future.result()
                except lost:
                    yield from self._lose([*self._given] if one_loss_is_all else [future])
                    if one_loss_is_all:
                        return
                else:
                    yield from self._take(future, done)

    def _give(self, submit: Submit, crew: int) -> None:
        while len(self._given) < crew and (numbers := self._next()):
            self._given[submit([self._rows[number] for number in numbers])] = numbers

    def _next(self) -> list[int]:
        """The next slice: a doubtful row alone, or rows that wait, half of a fair share of them at most."""
        if self._doubtful:
            return [self._doubtful.popleft()]
        fair = max(1, len(self._waiting) // (2 * self._crew))
        size = min(self._size, fair, len(self._waiting))
        return [self._waiting.popleft() for _ in range(size)]

    def _take(self, future: Future[list[RowResult]], done: list[RowResult]) -> Iterator[Numbered]:
        """What was done of a slice; the rest waits again."""
        numbers = self._given.pop(future)
        rest = numbers[len(done) :]
        self._waiting.extendleft(reversed(rest))
        self._size = min(_LARGEST, max(1, len(done) if rest else max(self._size, 2 * len(done))))
        yield from zip(numbers, done, strict=False)

    def _lose(self, futures: Iterable[Future[list[RowResult]]]) -> Iterator[Numbered]:
        numbers = [number for future in futures for number in self._given.pop(future)]
        if len(numbers) == 1:
            yield numbers[0], LOST
        else:
            self._doubtful.extend(numbers)
