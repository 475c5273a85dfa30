"""Lines for people and programs that never hold up whoever writes them.

Standard output and standard error may be pipes without a reader.  So a thread writes, and what does not fit into a
queue of some thousand lines is left out; the next line that fits says how many are missing.
"""

from __future__ import annotations

import contextlib
import os
import queue
import threading
from collections.abc import Callable
from typing import Final

LONGEST_QUEUE: Final = 4096
"""Lines."""
PATIENCE_S: Final = 1.0
"""How long `close` waits for a reader."""


class OutputLines:
    """The file descriptor `fd` as a place for lines; stays its owner's to close."""

    def __init__(self, fd: int) -> None:
        self._fd = fd
        self._lines: queue.Queue[str | None] = queue.Queue(LONGEST_QUEUE)
        self._missing = 0
        self._thread: threading.Thread | None = None
        self.lost: Callable[[OSError], object] | None = None
        """Called, in another thread, with the first error; nothing is written from then on."""

    def write(self, line: str) -> None:
        """Write a line, its end included, some time soon."""
        if self._thread is None:
            self._thread = threading.Thread(target=self._run, name="output", daemon=True)
            self._thread.start()
        if self._missing:
            line = f"({self._missing} lines are missing here: they were not read in time)\n{line}"
        try:
            self._lines.put_nowait(line)
        except queue.Full:
            self._missing += 1
        else:
            self._missing = 0

    def flush(self) -> None:
        """Nothing to do: lines are on their way."""

    def close(self) -> None:
        """Wait until everything is written, a moment at most."""
        if self._thread is not None:
            with contextlib.suppress(queue.Full):
                self._lines.put(None, timeout=PATIENCE_S)
                self._thread.join(PATIENCE_S)
            self._thread = None

    def _run(self) -> None:
        try:
            while (line := self._lines.get()) is not None:
                data = line.encode("utf-8", "backslashreplace")
                while data:
                    data = data[os.write(self._fd, data) :]
        except OSError as error:
            if self.lost is not None:
                self.lost(error)
