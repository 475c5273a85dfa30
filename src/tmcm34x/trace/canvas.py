"""What pictures are drawn on: SVG text, or pixels by Pillow (extra `plot`) for PNG."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from io import BytesIO
from typing import Any, Final, Protocol

WIDTH: Final = 1200
"""Pixels of a picture side by side."""

Point = tuple[float, float]


class Canvas(Protocol):
    """Something to draw on; the origin is at the upper left."""

    def line(self, points: Sequence[Point], color: str, width: float = 1.0) -> None:
        """A line through points."""
        ...

    def text(self, x: float, y: float, text: str, color: str, anchor: str = "start") -> None:
        """A text on the base line y; `anchor` start, middle or end is at x."""
        ...


class SvgCanvas:
    """Draws into the text of an SVG file."""

    def __init__(self, height: int) -> None:
        self._parts = [
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{height}" '
            f'viewBox="0 0 {WIDTH} {height}" font-family="sans-serif" font-size="12">',
            f'<rect width="{WIDTH}" height="{height}" fill="white"/>',
        ]

    def line(self, points: Sequence[Point], color: str, width: float = 1.0) -> None:
        """A line through points."""
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        self._parts.append(
            f'<polyline points="{path}" fill="none" stroke="{color}" stroke-width="{width}" '
            'stroke-linejoin="round"/>'
        )

    def text(self, x: float, y: float, text: str, color: str, anchor: str = "start") -> None:
        """A text on the base line y."""
        self._parts.append(
            f'<text x="{x:.1f}" y="{y:.1f}" fill="{color}" text-anchor="{anchor}">{escape(text)}</text>'
        )

    def finish(self) -> str:
        """The file."""
        return "\n".join([*self._parts, "</svg>", ""])


class PngCanvas:
    """Draws pixels; lines are drawn twice as large and made smaller, for smooth edges."""

    SCALE: Final = 2

    def __init__(self, height: int) -> None:
        """Raises ImportError where Pillow is not installed."""
        from PIL import Image, ImageDraw, ImageFont

        self._image = Image.new("RGB", (WIDTH * self.SCALE, height * self.SCALE), "white")
        self._draw = ImageDraw.Draw(self._image)
        self._font: Any = ImageFont.load_default(12 * self.SCALE)

    def line(self, points: Sequence[Point], color: str, width: float = 1.0) -> None:
        """A line through points."""
        scaled = [(x * self.SCALE, y * self.SCALE) for x, y in points]
        self._draw.line(scaled, fill=color, width=round(width * self.SCALE), joint="curve")

    def text(self, x: float, y: float, text: str, color: str, anchor: str = "start") -> None:
        """A text on the base line y."""
        place = {"start": "ls", "middle": "ms", "end": "rs"}[anchor]
        self._draw.text((x * self.SCALE, y * self.SCALE), text, fill=color, font=self._font, anchor=place)

    def finish(self) -> bytes:
        """The file."""
        output = BytesIO()
        self._image.reduce(self.SCALE).save(output, "PNG")
        return output.getvalue()
