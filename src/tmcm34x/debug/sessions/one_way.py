"""What run control says where a program cannot be taken back."""

from __future__ import annotations

from tmcm34x.debug.branches import HistoryError
from tmcm34x.debug.writes import Write


class OneWay:
    """Run control over a program whose time only goes forward."""

    irreversible: str
    """Why the program cannot be taken back."""

    def step_back(self, *, over: bool) -> None:
        """Not possible: see `irreversible`."""
        raise HistoryError(self.irreversible)

    def reverse_continue(self) -> None:
        """Not possible: see `irreversible`."""
        raise HistoryError(self.irreversible)

    def who_wrote(self, text: str) -> Write | None:
        """Not known: see `irreversible`."""
        raise HistoryError(f"{text}: {self.irreversible}")
