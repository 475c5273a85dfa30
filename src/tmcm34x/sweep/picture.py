"""A picture of a sweep: each figure against each value that was varied, a mark for each row."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Final, NamedTuple

from tmcm34x.files import read_text
from tmcm34x.sweep.description import Sweep
from tmcm34x.trace.canvas import WIDTH, SvgCanvas
from tmcm34x.trace.picture import COLORS, FAINT, GRID, INK, round_numbers

_TOP: Final = 40
_LEFT: Final = 80
_PANEL: Final = 180
_GAP: Final = 60
_MARK: Final = 3.0
"""Half the size of a mark."""


class Scale(NamedTuple):
    """From values to pixels along one side of a panel."""

    low: float
    high: float
    start: float
    length: float

    def at(self, value: float) -> float:
        """The pixel of a value."""
        return self.start + (value - self.low) / (self.high - self.low) * self.length


def scale(values: Iterable[float], start: float, length: float) -> tuple[Scale, list[float]]:
    """A scale with room for all values, and its ticks."""
    found = list(values)
    low, high = min(found), max(found)
    ticks = round_numbers(low, high if high > low else low + 1)
    return Scale(ticks[0], ticks[-1], start, length), ticks


def summary(table: Path, sweep: Sweep) -> str:
    """The SVG text; raises `ValueError` where no row has figures, and `OSError`."""
    lines = csv.DictReader(read_text(table).splitlines())
    done = [line for line in lines if line["ending"]]
    if not done:
        raise ValueError("no row has figures: there is nothing to draw")
    canvas = SvgCanvas(_TOP + len(sweep.figures) * (_PANEL + _GAP))
    canvas.text(_LEFT, 22, sweep.title or sweep.program, INK)
    width = (WIDTH - 20) / len(sweep.vary)
    for down, figure in enumerate(sweep.figures):
        for across, vary in enumerate(sweep.vary):
            points = [(float(line[vary.column]), float(line[figure])) for line in done]
            corner = across * width + _LEFT, _TOP + down * (_PANEL + _GAP)
            _panel(canvas, corner, width - _LEFT, points, COLORS[down % len(COLORS)])
            canvas.text(corner[0] + 6, corner[1] - 2, f"{figure} against {vary.column}", INK)
    return canvas.finish()


def _panel(
    canvas: SvgCanvas,
    corner: tuple[float, float],
    width: float,
    points: Sequence[tuple[float, float]],
    color: str,
) -> None:
    left, top = corner
    across, columns = scale((x for x, _ in points), left, width)
    down, lines = scale((y for _, y in points), top + _PANEL, 14 - _PANEL)
    for tick in columns:
        canvas.line([(across.at(tick), top + 14), (across.at(tick), top + _PANEL)], GRID)
        canvas.text(across.at(tick), top + _PANEL + 16, f"{tick:g}", FAINT, "middle")
    for tick in lines:
        canvas.line([(left, down.at(tick)), (left + width, down.at(tick))], GRID)
        canvas.text(left - 6, down.at(tick) + 4, f"{tick:g}", FAINT, "end")
    for point in dict.fromkeys(points):
        x, y = across.at(point[0]), down.at(point[1])
        canvas.line([(x - _MARK, y), (x + _MARK, y)], color, 1.5)
        canvas.line([(x, y - _MARK), (x, y + _MARK)], color, 1.5)
