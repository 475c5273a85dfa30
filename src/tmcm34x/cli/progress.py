"""What a run shows while it goes on: a progress bar on a terminal, and a note when no end is in sight."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, Final, TextIO

from tmcm34x.clock import HZ

_BAR_AFTER_S: Final = 0.7
_NOTE_AFTER_S: Final = 3.0


class Progress:
    """Shows the simulated time on a terminal once a run takes longer than a moment.

    until: the clock at which the run ends at the latest, None for none
    note: gives the line to print once when a run without a limit goes on for some seconds
    """

    def __init__(self, stream: TextIO, until: int | None, note: Callable[[], str]) -> None:
        now_s = time.monotonic()
        self._stream = stream
        self._until = until
        self._note = note
        self._terminal = stream.isatty()
        self._bar_due_s = now_s + _BAR_AFTER_S
        self._note_due_s = now_s + _NOTE_AFTER_S if until is None else float("inf")
        self._due_s = min(self._bar_due_s, self._note_due_s)
        self._bar: Any = None
        self._task: Any = None

    def __enter__(self) -> None:
        """Nothing is shown yet."""

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.stop()

    def show(self, now: int) -> None:
        """Show the clock `now`, if it is time to."""
        wall_s = time.monotonic()
        if wall_s < self._due_s:
            return
        self._due_s = wall_s + 0.1
        if wall_s >= self._note_due_s:
            self._note_due_s = float("inf")
            print(self._note(), file=self._stream, flush=True)
        if self._terminal:
            bar = self._bar or self._open()
            bar.update(self._task, completed=now, simulated=f"{now / HZ:.1f} s simulated")

    def _open(self) -> Any:
        from rich.console import Console
        from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
        from rich.progress import Progress as Bar

        bar = self._bar = Bar(
            BarColumn(), TextColumn("{task.fields[simulated]}"), TimeElapsedColumn(),
            console=Console(stderr=True), transient=True,
        )  # fmt: skip
        self._task = bar.add_task("", total=self._until, simulated="")
        bar.start()
        return bar
