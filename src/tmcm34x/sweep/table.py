"""The results of a sweep as a CSV file.

Lines are written as they come, so that an interrupt costs nothing; `sort` brings them in the order of the rows.
"""

from __future__ import annotations

import csv
from collections.abc import Sequence
from io import StringIO
from pathlib import Path
from typing import TextIO

from tmcm34x.sweep.description import Sweep
from tmcm34x.sweep.plan import Row
from tmcm34x.sweep.single import Result


def columns(sweep: Sweep) -> list[str]:
    """The names of the columns."""
    return ["row", *(vary.column for vary in sweep.vary), *sweep.figures, "ending", "error"]


def line_of(cells: Sequence[object]) -> str:
    """A line of the file."""
    stream = StringIO()
    csv.writer(stream, lineterminator="\n").writerow(cells)
    return stream.getvalue()


class Table:
    """The file at `path`, made anew; raises `OSError`."""

    def __init__(self, path: Path, sweep: Sweep, rows: Sequence[Row]) -> None:
        self._path = path
        self._rows = rows
        self._figures = len(sweep.figures)
        self._head = line_of(columns(sweep))
        self._lines: dict[int, str] = {}
        self._stream: TextIO = path.open("w", encoding="utf-8", newline="")
        self._stream.write(self._head)

    def write(self, number: int, result: Result) -> None:
        """Add a row."""
        figures = result.figures or [""] * self._figures
        line = line_of([number, *self._rows[number], *figures, result.ending, result.error])
        self._lines[number] = line
        self._stream.write(line)
        self._stream.flush()

    def close(self) -> None:
        """Put the rows in order; the file is complete at any time."""
        self._stream.close()
        ordered = self._path.with_name(self._path.name + ".new")
        ordered.write_text(
            self._head + "".join(line for _, line in sorted(self._lines.items())), "utf-8", newline=""
        )
        ordered.replace(self._path)
