"""The results of a sweep as a CSV file, and that as Parquet.

Lines are written as they come, so that an interrupt costs nothing; `sort` brings them in the order of the rows.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from io import StringIO
from pathlib import Path
from typing import TextIO

from tmcm34x.files import read_text
from tmcm34x.sweep.cluster import library
from tmcm34x.sweep.description import Sweep, SweepError, numbers_of
from tmcm34x.sweep.plan import Row
from tmcm34x.sweep.single import RowResult


def columns(sweep: Sweep) -> list[str]:
    """The names of the columns."""
    return ["row", *(vary.column for vary in sweep.vary), *sweep.figures, "ending", "error"]


def line_of(cells: Sequence[object]) -> str:
    """A line of the file."""
    stream = StringIO()
    csv.writer(stream, lineterminator="\n").writerow(cells)
    return stream.getvalue()


def kept_lines(path: Path, sweep: Sweep, rows: Sequence[Row]) -> dict[int, str]:
    """The lines of an earlier table of the same sweep, by row, without those of failed rows; none without a file.

    A last line that was cut off is left out.  Raises `SweepError` for the table of something else, and `OSError`.
    """
    if not path.exists():
        return {}
    head, *found = csv.reader(
        line for line in read_text(path).splitlines(keepends=True) if line.endswith("\n")
    )
    if head != columns(sweep):
        raise SweepError(
            f"{path}: its columns are not those of this sweep; give another --out, or leave --resume out"
        )
    kept: dict[int, str] = {}
    for cells in found:
        if len(cells) == len(head):
            number = _row_of(cells, rows)
            if number is None:
                raise SweepError(
                    f"{path}: row {cells[0]} has other values than in this sweep; leave --resume out"
                )
            if not cells[-1]:
                kept[number] = line_of(cells)
    return kept


def _row_of(cells: Sequence[str], rows: Sequence[Row]) -> int | None:
    """The number of a line's row, if its values are those of the row."""
    number = int(cells[0]) if cells[0].isdecimal() else len(rows)
    same = number < len(rows) and cells[1 : 1 + len(rows[number])] == [str(value) for value in rows[number]]
    return number if same else None


class ResultTable:
    """The file at `path`, made anew with the lines of rows that are done already; raises `OSError`."""

    def __init__(self, path: Path, sweep: Sweep, rows: Sequence[Row], kept: Mapping[int, str]) -> None:
        self._path = path
        self._rows = rows
        self._figures = len(sweep.figures)
        self._head = line_of(columns(sweep))
        self._lines = dict(kept)
        self._replace()
        self._stream: TextIO = path.open("a", encoding="utf-8", newline="")

    def write(self, number: int, result: RowResult) -> None:
        """Add a row."""
        figures = result.figures or [""] * self._figures
        line = line_of([number, *self._rows[number], *figures, result.ending, result.error])
        self._lines[number] = line
        self._stream.write(line)
        self._stream.flush()

    def close(self) -> None:
        """Put the rows in order."""
        self._stream.close()
        self._replace()

    def _replace(self) -> None:
        """The file anew, in the order of the rows; it is complete at any time."""
        ordered = self._path.with_name(self._path.name + ".new")
        lines = "".join(line for _, line in sorted(self._lines.items()))
        ordered.write_text(self._head + lines, "utf-8", newline="")
        ordered.replace(self._path)


def write_parquet(table: Path, sweep: Sweep, out: Path) -> None:
    """The same table in Parquet, with types: whole numbers, and floating point where a value was written so.

    Raises `SweepError` without the extra `cluster`, and `OSError`.
    """
    csv_reader, parquet = library("pyarrow.csv"), library("pyarrow.parquet")
    options = csv_reader.ConvertOptions(column_types=_types(sweep), strings_can_be_null=False)
    parquet.write_table(csv_reader.read_csv(table, convert_options=options), out)


def _types(sweep: Sweep) -> dict[str, str]:
    varied = {
        vary.column: "float64" if any(isinstance(value, float) for value in numbers_of(vary)) else "int64"
        for vary in sweep.vary
    }
    return {
        "row": "int64",
        **varied,
        **dict.fromkeys(sweep.figures, "int64"),
        "ending": "string",
        "error": "string",
    }
