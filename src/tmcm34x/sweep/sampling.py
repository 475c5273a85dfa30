"""Rows by chance: the same seed gives the same ones, on any machine."""

from __future__ import annotations

from collections.abc import Sequence
from random import Random

from tmcm34x.sweep.description import Number, Range, Sampling, Vary

Row = tuple[Number, ...]


def sampled(varied: Sequence[Vary], sampling: Sampling) -> list[Row]:
    """The values of each row, in the order of `varied`."""
    random = Random(sampling.seed)
    shares = _strata if sampling.kind == "latin_hypercube" else _anywhere
    columns = [[_value(vary, share) for share in shares(random, sampling.count)] for vary in varied]
    return list(zip(*columns, strict=True))


def _anywhere(random: Random, count: int) -> list[float]:
    return [random.random() for _ in range(count)]


def _strata(random: Random, count: int) -> list[float]:
    """One share of 0..1 in each of `count` equal parts of it, in an order by chance."""
    order = sorted(range(count), key=dict(enumerate(_anywhere(random, count))).__getitem__)
    return [(part + random.random()) / count for part in order]


def _value(vary: Vary, share: float) -> Number:
    """The value that is `share` of the way, 0 to below 1, through those of `vary`."""
    values = vary.values
    if not isinstance(values, Range):
        return values[int(share * len(values))]
    if values.whole:
        return int(values.low + share * (values.high - values.low + 1) // 1)
    return values.low + share * (values.high - values.low)
