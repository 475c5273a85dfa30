"""What benchmarks must reach: each figure beside its mark, and an exit status."""

from __future__ import annotations


class Marks:
    """Rows of figures; `status` is 1 when one has missed its mark."""

    def __init__(self) -> None:
        self.status = 0

    def at_least(self, name: str, figure: float, mark: float, unit: str = "") -> None:
        """A figure that must not be lower."""
        self._row(name, figure, f"at least {mark:,g}", unit, figure >= mark)

    def at_most(self, name: str, figure: float, mark: float, unit: str = "") -> None:
        """A figure that must not be higher."""
        self._row(name, figure, f"at most {mark:,g}", unit, figure <= mark)

    def _row(self, name: str, figure: float, bound: str, unit: str, reached: bool) -> None:
        self.status |= not reached
        missed = "" if reached else ": MISSED"
        digits = ",.0f" if figure >= 100 else ".3g"
        print(f"{name:44} {figure:>10{digits}} {unit:6} (must be {bound}){missed}")
