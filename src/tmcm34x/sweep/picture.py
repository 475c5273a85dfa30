"""A picture of a sweep: each figure against each value that was varied, a mark for each row."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Final, NamedTuple

from tmcm34x.files import read_text
from tmcm34x.sweep.description import Sweep
from tmcm34x.sweep.pareto import front
from tmcm34x.trace.canvas import WIDTH, SvgCanvas
from tmcm34x.trace.picture import COLORS, FAINT, GRID, INK, round_numbers

_TOP: Final = 56
_LEFT: Final = 80
_PANEL: Final = 180
_GAP: Final = 60
_MARK: Final = 3.0
"""Half the size of a mark."""


class PixelScale(NamedTuple):
    """From values to pixels along one side of a panel."""

    low: float
    high: float
    start: float
    length: float

    def at(self, value: float) -> float:
        """The pixel of a value."""
        return self.start + (value - self.low) / (self.high - self.low) * self.length


def scale(values: Iterable[float], start: float, length: float) -> tuple[PixelScale, list[float]]:
    """A scale with room for all values, and its ticks."""
    found = list(values)
    low, high = min(found), max(found)
    ticks = round_numbers(low, high if high > low else low + 1)
    return PixelScale(ticks[0], ticks[-1], start, length), ticks


def summary(table: Path, sweep: Sweep) -> str:
    """The SVG text; raises `ValueError` where no row has figures, and `OSError`."""
    lines = csv.DictReader(read_text(table).splitlines())
    done = [line for line in lines if line["ending"]]
    if not done:
        raise ValueError("no row has figures: there is nothing to draw")
    canvas = SvgCanvas(_TOP + (len(sweep.figures) + bool(sweep.pareto)) * (_PANEL + _GAP))
    canvas.text(_LEFT, 22, sweep.title or sweep.program, INK)
    width = (WIDTH - 20) / len(sweep.vary)
    for down, figure in enumerate(sweep.figures):
        for across, vary in enumerate(sweep.vary):
            points = [(float(line[vary.column]), float(line[figure])) for line in done]
            corner = across * width + _LEFT, _TOP + down * (_PANEL + _GAP)
            _panel(canvas, corner, width - _LEFT, points, COLORS[down % len(COLORS)])
            canvas.text(corner[0] + 6, corner[1] - 2, f"{figure} against {vary.column}", INK)
    if sweep.pareto:
        _front(canvas, (_LEFT, _TOP + len(sweep.figures) * (_PANEL + _GAP)), sweep, done)
    return canvas.finish()


def _front(
    canvas: SvgCanvas, corner: tuple[float, float], sweep: Sweep, done: Sequence[dict[str, str]]
) -> None:
    """All rows by the two columns of the front, and a line through those on it."""
    rows = [{name: float(line[name]) for name in sweep.pareto} for line in done]
    first, second = sweep.pareto
    points = [(row[first], row[second]) for row in rows]
    place = _panel(canvas, corner, WIDTH - 20 - _LEFT, points, COLORS[0])
    best = front(rows, sweep.pareto)
    canvas.line([place(points[number]) for number in best], COLORS[1], 2)
    for number in best:
        x, y = place(points[number])
        canvas.text(x + 5, y - 5, f"row {done[number]['row']}", INK)
    heading = " and ".join(f"{name} ({wish})" for name, wish in sweep.pareto.items())
    canvas.text(corner[0] + 6, corner[1] - 2, f"Pareto front: {heading}", INK)


def _panel(
    canvas: SvgCanvas,
    corner: tuple[float, float],
    width: float,
    points: Sequence[tuple[float, float]],
    color: str,
) -> Callable[[tuple[float, float]], tuple[float, float]]:
    """Draw the points with their scales; returns what gives the place of a point in the picture."""
    left, top = corner
    across, columns = scale((x for x, _ in points), left, width)
    down, lines = scale((y for _, y in points), top + _PANEL, 14 - _PANEL)
    for tick in columns:
        canvas.line([(across.at(tick), top + 14), (across.at(tick), top + _PANEL)], GRID)
        canvas.text(across.at(tick), top + _PANEL + 16, f"{tick:,.9g}", FAINT, "middle")
    for tick in lines:
        canvas.line([(left, down.at(tick)), (left + width, down.at(tick))], GRID)
        canvas.text(left - 6, down.at(tick) + 4, f"{tick:,.9g}", FAINT, "end")

    def place(point: tuple[float, float]) -> tuple[float, float]:
        return across.at(point[0]), down.at(point[1])

    for point in dict.fromkeys(points):
        x, y = place(point)
        canvas.line([(x - _MARK, y), (x + _MARK, y)], color, 1.5)
        canvas.line([(x, y - _MARK), (x, y + _MARK)], color, 1.5)
    return place
