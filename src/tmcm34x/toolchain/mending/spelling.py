"""Names near a misspelt one.

The distance counts letters that are wrong, missing or too many, and neighbours that changed places, each as one.
All candidates of the least distance are named; which of them is meant, if any, is for the caller to decide.

Source: optimal string alignment, the restricted Damerau-Levenshtein distance.
"""

from __future__ import annotations

from collections.abc import Iterable

from tmcm34x.toolchain.diagnostics import did_you_mean

_LONGEST = 64


def limit(name: str) -> int:
    """The greatest distance at which another name may be meant: short names differ by little."""
    return 0 if len(name) < 3 else 1 if len(name) < 5 else 2 if len(name) < 9 else 3


def distance(a: str, b: str, most: int) -> int:
    """How many slips lead from `a` to `b`; `most` + 1 where there are more."""
    if abs(len(a) - len(b)) > most:
        return most + 1
    before: list[int] = []
    row = list(range(len(b) + 1))
    for i, letter in enumerate(a, 1):
        before, last, row = row, before, [i]
        for j, other in enumerate(b, 1):
            cost = min(before[j] + 1, row[j - 1] + 1, before[j - 1] + (letter != other))
            if i > 1 and j > 1 and letter == b[j - 2] and a[i - 2] == other:
                cost = min(cost, last[j - 2] + 1)
            row.append(cost)
        if min(row) > most:
            return most + 1
    return min(row[-1], most + 1)


def nearest(name: str, candidates: Iterable[str], most: int | None = None) -> tuple[str, ...]:
    """The candidates that `name` may be a misspelling of: all of the least distance, in their order.

    most: the greatest distance; by the length of the name unless given
    """
    most = limit(name) if most is None else most
    if not 0 < len(name) <= _LONGEST or most == 0:
        return ()
    found: list[str] = []
    for candidate in candidates:
        far = distance(name, candidate, most)
        if far < most:
            most, found = far, []
        if far == most:
            found.append(candidate)
    return tuple(dict.fromkeys(found))


def proposal(name: str, candidates: Iterable[str], most: int | None = None) -> str:
    """The end of a message about a name that there is not: `; did you mean ...?` with the nearest, if one is near."""
    return did_you_mean(nearest(name, candidates, most))
