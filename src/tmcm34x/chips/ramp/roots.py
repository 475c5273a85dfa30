"""Braking velocities that were computed once: all moves with the same braking factors have the same.

A list has an entry for each distance up to the farthest that was asked for, FARTHEST at most.  All lists together have
MOST entries at most; the ones that were begun first are dropped for others.
"""

from __future__ import annotations

from typing import Final

MOST: Final = 1 << 20
"""Entries of all lists together, 8 bytes each, and 32 more where the velocity is known: two of the longest lists."""

_lists: dict[tuple[int, int], list[int]] = {}


def roots(factor: int, shift: int, farthest: int) -> list[int]:
    """The braking velocity [1/256] at each distance from 0 to at least `farthest`; 0 where it is not known yet.

    Whoever computes one writes it into the list.
    """
    known = _lists.get((factor, shift))
    if known is None or len(known) <= farthest:
        known = _longer(factor, shift, farthest + 1)
    return known


def entries() -> int:
    """How many entries all lists have together."""
    return sum([len(known) for known in list(_lists.values())])


def _longer(factor: int, shift: int, length: int) -> list[int]:
    """The list with so many entries, now the last one begun."""
    known = _lists.pop((factor, shift), [])
    surplus = entries() + length - MOST
    for first in list(_lists):
        if surplus <= 0:
            break
        surplus -= len(_lists.pop(first, []))
    known += [0] * (length - len(known))
    _lists[factor, shift] = known
    return known
