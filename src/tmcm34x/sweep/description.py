"""The sweep file: what its tables and keys mean."""

from __future__ import annotations

import tomllib
from math import isfinite
from pathlib import Path
from typing import Annotated, Final, Literal

import msgspec
from msgspec import Meta

from tmcm34x.bench.tables import Struct
from tmcm34x.bench.validation import TableError, convert
from tmcm34x.files import parse_toml, read_text

Number = int | float

_OWN: Final = frozenset({"row", "ending", "error"})
"""Columns of each table."""


class SweepError(ValueError):
    """A sweep that cannot be done; one line."""


class Range(Struct, frozen=True):
    """Values from `low` to `high`, both included; whole numbers where both are written as such.

    count: so many of them at equal distances; needed where rows are combinations, not used by sampling
    """

    low: Number
    high: Number
    count: Annotated[int, Meta(ge=1, le=100_000)] | None = None

    @property
    def whole(self) -> bool:
        """Whether its values are whole numbers."""
        return isinstance(self.low, int) and isinstance(self.high, int)


class Sampling(Struct, frozen=True):
    """Rows by chance instead of all combinations.

    kind: `latin_hypercube` takes one value from each of `count` equal parts of each range
    count: of rows
    seed: the same seed gives the same rows
    """

    kind: Literal["random", "latin_hypercube"]
    count: Annotated[int, Meta(ge=1, le=1_000_000)]
    seed: int = 0


class Vary(Struct, frozen=True):
    """What changes from run to run, and its values.

    what: a constant of the source; `ap[n][motor]`, `gp[n]`, `gp[n][bank]` and what else the debugger can assign to;
        a path into the bench file such as `bench.module[0].axis[0].load.mass_kg`; `seed`
    name: of its column; `what` unless given
    """

    what: Annotated[str, Meta(min_length=1)]
    values: Annotated[list[Number], Meta(min_length=1)] | Range
    name: str = ""

    @property
    def column(self) -> str:
        """The name of its column."""
        return self.name or self.what


class Sweep(Struct, frozen=True):
    """The whole file.

    program: TMCL source, beside the sweep file
    vary: the rows are all combinations, unless there is `sampling`; the last one changes fastest
    figures: expressions of the debugger at the end of each run, by the names of their columns
    until_s: simulated time by which a run must be over
    bench: bench file, beside the sweep file; bare motors without it
    model: of the module without a bench
    stop: expression of the debugger that ends a run when it is not 0
    pareto: two columns, and whether a low or a high value of each is wanted; see `pareto`
    """

    program: str
    vary: Annotated[list[Vary], Meta(min_length=1)]
    figures: Annotated[dict[str, str], Meta(min_length=1)]
    until_s: Annotated[float, Meta(gt=0, le=1e7)]
    title: str = ""
    bench: str | None = None
    model: Literal[341, 342, 343] = 343
    stop: str | None = None
    sampling: Sampling | None = None
    pareto: dict[str, Literal["low", "high"]] = msgspec.field(
        default_factory=dict[str, Literal["low", "high"]]
    )


def parse(text: str) -> Sweep:
    """The sweep in the text of a file; raises `SweepError` with the path to what is wrong."""
    try:
        sweep = convert(parse_toml(text), Sweep)
    except tomllib.TOMLDecodeError as error:
        raise SweepError(str(error)) from None
    except TableError as error:
        raise SweepError(str(error)) from None
    _check(sweep)
    return sweep


def read(path: Path) -> Sweep:
    """The sweep in a file; raises `SweepError`."""
    try:
        return parse(read_text(path))
    except OSError as error:
        raise SweepError(f"{path}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise SweepError(f"{path}: not a text file in UTF-8") from None
    except SweepError as error:
        raise SweepError(f"{path}: {error}") from None


def _check(sweep: Sweep) -> None:
    """What the limits of a struct do not catch."""
    seen = set(_OWN)
    columns = [(f"vary[{n}]", vary.column) for n, vary in enumerate(sweep.vary)]
    for path, column in [*columns, *((f"figures.{name}", name) for name in sweep.figures)]:
        if column in seen:
            raise SweepError(f"{path}: there are two columns named {column}; give one a name of its own")
        seen.add(column)
    numbers = [
        (f"vary[{n}].values", value) for n, vary in enumerate(sweep.vary) for value in numbers_of(vary)
    ]
    for path, value in [*numbers, ("until_s", sweep.until_s)]:
        if not isfinite(value):
            raise SweepError(f"{path}: {value} is not a number for a sweep")
    if sweep.pareto and len(sweep.pareto) != 2:
        raise SweepError("pareto: a front is between two columns")
    for name in sweep.pareto:
        if name not in seen - _OWN:
            raise SweepError(f"pareto.{name}: there is no column of this name")
    for n, vary in enumerate(sweep.vary):
        if isinstance(vary.values, Range):
            _check_range(f"vary[{n}].values", vary.values, sweep.sampling)


def _check_range(path: str, values: Range, sampling: Sampling | None) -> None:
    if values.low > values.high:
        raise SweepError(f"{path}: low is greater than high")
    if sampling is None and values.count is None:
        raise SweepError(f"{path}: without [sampling] a range has a count")


def numbers_of(vary: Vary) -> list[Number]:
    """The values of a list, or both ends of a range."""
    values = vary.values
    return [values.low, values.high] if isinstance(values, Range) else values
