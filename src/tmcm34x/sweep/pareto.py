"""The Pareto front of a sweep: the rows of which no other is better in both columns."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Literal

Number = int | float


def front(rows: Iterable[Mapping[str, Number]], wanted: Mapping[str, Literal["low", "high"]]) -> list[int]:
    """The places of the rows on the front of two columns, the best of the first column before the others.

    Of rows that are equal in both columns the first one counts.
    """
    (first, second), signs = wanted, [1 if wish == "low" else -1 for wish in wanted.values()]
    points = [(signs[0] * row[first], signs[1] * row[second], place) for place, row in enumerate(rows)]
    best: list[tuple[Number, Number, int]] = []
    for point in sorted(points):
        if not best or point[1] < best[-1][1]:
            best.append(point)
    return [place for _, _, place in best]
