"""From a sweep to its rows: what changes, and its value in each one."""

from __future__ import annotations

import re
from itertools import product
from math import prod
from typing import Any, Final, NamedTuple

import msgspec

from tmcm34x.bench.description import Bench
from tmcm34x.debug.expressions import ExpressionError, Reference, compile_reference
from tmcm34x.sweep.description import Number, Range, Sweep, SweepError, Vary
from tmcm34x.sweep.sampling import Row, sampled
from tmcm34x.sweep.sources import ProgramSources

MOST_ROWS: Final = 1_000_000
"""Of one sweep."""
SEED: Final = "seed"
_BENCH: Final = "bench."
_STEP: Final = re.compile(r"\[(\d+)\]|\.?([A-Za-z_]\w*)")
_ASSIGNABLE: Final = frozenset({"ap", "gp", "co", "in", "adc", "out"})
"""Names with indices that can be set before the program starts."""

Path = tuple[str | int, ...]


class Job(NamedTuple):
    """All that a process needs to do the run of a row: plain values, sent to it once."""

    sweep: Sweep
    sources: ProgramSources
    bench: Bench | None


def rows(sweep: Sweep) -> list[Row]:
    """The values of each row, in the order of `sweep.vary`; raises `SweepError` where they are too many."""
    if sweep.sampling is not None:
        return sampled(sweep.vary, sweep.sampling)
    return list(product(*_columns(sweep)))


def _columns(sweep: Sweep) -> list[list[Number]]:
    """The values of each name, whose combinations are the rows."""
    columns = [_values(vary) for vary in sweep.vary]
    count = prod(map(len, columns))
    if count > MOST_ROWS:
        raise SweepError(f"vary: {count} rows are more than {MOST_ROWS}")
    return columns


def _values(vary: Vary) -> list[Number]:
    values = vary.values
    if not isinstance(values, Range):
        return values
    count = values.count or 1
    span, last = values.high - values.low, max(count - 1, 1)
    found = [values.low + span * n / last for n in range(count)]
    return [round(value) for value in found] if values.whole else found


def check(job: Job) -> None:
    """Raises `SweepError` for a name that the program, the debugger or the bench does not know, and too many rows."""
    if job.sweep.sampling is None:
        _columns(job.sweep)
    for n, vary in enumerate(job.sweep.vary):
        try:
            _check_name(job, vary.what)
        except (SweepError, ExpressionError) as error:
            raise SweepError(f"vary[{n}].what: {error}") from None


def _check_name(job: Job, what: str) -> None:
    if what == SEED:
        return
    if what.startswith(_BENCH):
        if job.bench is None:
            raise SweepError(f"{what}: the sweep has no bench")
        place(msgspec.to_builtins(job.bench), what)
    elif reference(what) is None:
        job.sources.constant(what)


def reference(what: str) -> Reference | None:
    """What the debugger assigns to, or None for a constant; raises `ExpressionError`."""
    if "[" not in what:
        return None
    found = compile_reference(what)
    if found.name.lower() not in _ASSIGNABLE:
        raise SweepError(f"{what} is not one of {', '.join(sorted(_ASSIGNABLE))} with indices")
    return found


def bench_path(what: str) -> Path:
    """The steps of `bench.module[0].axis[1]`, without the first one; raises `SweepError`."""
    text, at = what.removeprefix(_BENCH), 0
    path: list[str | int] = []
    while at < len(text):
        step = _STEP.match(text, at)
        if step is None:
            raise SweepError(f"{what} is no path into a bench file")
        path.append(step[2] if step[1] is None else int(step[1]))
        at = step.end()
    if not path:
        raise SweepError(f"{what} is no path into a bench file")
    return tuple(path)


def place(table: Any, what: str) -> tuple[Any, str | int]:
    """The table or list that holds the last step of a path, and that step; raises `SweepError` where there is none."""
    *steps, last = bench_path(what)
    for step in steps:
        table = _inner(table, step, what)
    _inner(table, last, what)
    return table, last


def _inner(table: Any, step: str | int, what: str) -> Any:
    kind = dict if isinstance(step, str) else list
    try:
        if isinstance(table, kind):
            return table[step]  # pyright: ignore[reportArgumentType, reportCallIssue, reportUnknownVariableType]
    except LookupError:
        pass
    known = f"; there are {', '.join(table)}" if isinstance(table, dict) else ""  # pyright: ignore[reportUnknownArgumentType]
    raise SweepError(f"{what}: the bench has no {step} there{known}")
