"""A picture of a run: position and speed over time, and what the program did."""

from __future__ import annotations

from collections.abc import Sequence
from math import floor, log10
from typing import TYPE_CHECKING, Final, NamedTuple

from tmcm34x.clock import HZ, MS, seconds
from tmcm34x.trace.canvas import WIDTH, Canvas
from tmcm34x.trace.recorder import spots

if TYPE_CHECKING:
    from tmcm34x.bench import Rig


class Note(NamedTuple):
    """A note in the picture: when, and in a few words."""

    when: int
    text: str


class PictureRecorder:
    """Collects positions and speeds of all motors, and marks, for `draw`.

    There are at most `samples` of them: when it is time for more, every second one is given up and the time between
    them doubles.
    """

    def __init__(self, rig: Rig, samples: int = 4000) -> None:
        self._rig = rig
        self._spots = spots(rig)
        self._limit = max(samples, 16)
        self._period = MS
        self.due = rig.now
        self.times: list[int] = []
        self.positions: list[list[int]] = [[] for _ in self._spots]
        self.speeds: list[list[int]] = [[] for _ in self._spots]
        self.marks: list[Note] = []
        for number, module in enumerate(rig.modules):
            module.board.on_output.append(lambda bits, number=number: self._note_outputs(number, bits))
        self.after(rig.now)

    def before(self, now: int) -> None:
        """Nothing to see."""

    def after(self, now: int) -> None:
        """Take a sample when one is due."""
        if now < self.due:
            return
        self.times.append(now)
        for spot, positions, speeds in zip(self._spots, self.positions, self.speeds, strict=True):
            positions.append(spot.position)
            speeds.append(spot.speed)
        if len(self.times) >= self._limit:
            self._thin()
        self.due = now + self._period

    def mark(self, when: int, text: str) -> None:
        """Add a note to the picture."""
        self.marks.append(Note(when, text))

    def _note_outputs(self, number: int, bits: int) -> None:
        self.mark(self._rig.modules[number].now, f"outputs {bits:08b}")

    def _thin(self) -> None:
        self._period *= 2
        for values in (self.times, *self.positions, *self.speeds):
            del values[1::2]

    def moved(self) -> tuple[int, ...]:
        """The motors that did something, by their place in the rig; the first one if none did."""
        moving = [
            n for n in range(len(self._spots)) if any(self.speeds[n]) or len(set(self.positions[n])) > 1
        ]
        return tuple(moving) or (0,)

    def label(self, n: int) -> str:
        """How a motor is called."""
        spot = self._spots[n]
        return (
            f"module {spot.number} motor {spot.motor}"
            if len(self._rig.modules) > 1
            else f"motor {spot.motor}"
        )


_MARGIN: Final = 90
_PANEL: Final = 220
_LANE: Final = 70
_GAP: Final = 46
COLORS: Final = (
    "#2563eb",
    "#d97706",
    "#059669",
    "#c026d3",
    "#dc2626",
    "#0891b2",
    "#65a30d",
    "#7c3aed",
    "#64748b",
)
INK: Final = "#1f2937"
GRID: Final = "#e5e7eb"
FAINT: Final = "#9ca3af"
_LABELS: Final = 40
"""Marks beyond so many are drawn without their texts."""


def picture_height(picture: PictureRecorder) -> int:
    """Pixels that `draw` needs below each other."""
    return 2 * (_PANEL + _GAP) + (_LANE + _GAP if picture.marks else 0) + 40


def draw(picture: PictureRecorder, canvas: Canvas, title: str) -> None:
    """Draw positions and speeds over time, and the marks below them."""
    motors = picture.moved()
    span = picture.times[0], max(picture.times[-1], picture.times[0] + MS)
    canvas.text(_MARGIN, 22, title, INK)
    for place, n in enumerate(motors):
        x = WIDTH - 20 - 130 * (len(motors) - place)
        canvas.line([(x, 18), (x + 22, 18)], COLORS[n % len(COLORS)], 2.5)
        canvas.text(x + 28, 22, picture.label(n), INK)
    top = 40
    for name, values in (
        ("position [microsteps]", picture.positions),
        ("speed [velocity units]", picture.speeds),
    ):
        _draw_panel(canvas, top, span, _Curves(name, picture.times, [(n, values[n]) for n in motors]))
        top += _PANEL + _GAP
    if picture.marks:
        _draw_marks(canvas, top, span, picture.marks)


def _x(when: int, span: tuple[int, int]) -> float:
    return _MARGIN + (when - span[0]) / (span[1] - span[0]) * (WIDTH - _MARGIN - 20)


class _Curves(NamedTuple):
    """What one panel shows: values over times, by the motor's place in the rig."""

    name: str
    times: Sequence[int]
    values: Sequence[tuple[int, Sequence[int]]]


def _draw_panel(canvas: Canvas, top: float, span: tuple[int, int], curves: _Curves) -> None:
    low = min(min(values) for _, values in curves.values)
    high = max(max(values) for _, values in curves.values)
    ticks = round_numbers(low, high if high > low else low + 1)
    low, high = min(low, ticks[0]), max(high, ticks[-1], low + 1)

    def y(value: float) -> float:
        return top + _PANEL - (value - low) / (high - low) * _PANEL

    for tick in ticks:
        canvas.line([(_MARGIN, y(tick)), (WIDTH - 20, y(tick))], GRID)
        canvas.text(_MARGIN - 8, y(tick) + 4, f"{tick:g}", FAINT, "end")
    for tick in round_numbers(seconds(span[0]), seconds(span[1])):
        x = _x(round(tick * HZ), span)
        if _MARGIN <= x <= WIDTH - 20:
            canvas.line([(x, top), (x, top + _PANEL)], GRID)
            canvas.text(x, top + _PANEL + 16, f"{tick:g} s", FAINT, "middle")
    canvas.text(_MARGIN + 6, top + 14, curves.name, INK)
    for n, values in curves.values:
        points = [(_x(when, span), y(value)) for when, value in zip(curves.times, values, strict=True)]
        canvas.line(points, COLORS[n % len(COLORS)], 1.5)


def _draw_marks(canvas: Canvas, top: float, span: tuple[int, int], marks: Sequence[Note]) -> None:
    canvas.text(_MARGIN + 6, top - 6, "program", INK)
    canvas.line([(_MARGIN, top), (WIDTH - 20, top)], GRID)
    rows = [float(_MARGIN)] * 4
    for mark in marks:
        x = _x(mark.when, span)
        canvas.line([(x, top), (x, top + 8)], COLORS[0])
        width = 6.5 * len(mark.text) + 8
        left = min(x, WIDTH - width)
        row = next((n for n, free in enumerate(rows) if free <= left), None)
        if row is not None and len(marks) <= _LABELS:
            canvas.text(left, top + 22 + 14 * row, mark.text, FAINT)
            rows[row] = left + width


def round_numbers(low: float, high: float) -> list[float]:
    """Four to ten round numbers around low..high."""
    step = 10 ** floor(log10((high - low) / 4))
    step *= next((factor for factor in (1, 2, 5) if (high - low) / (step * factor) <= 8), 10)
    first, last = floor(low / step), -floor(-high / step)
    return [n * step for n in range(first, last + 1)]
