"""Ctrl-C while nothing is under way that would have to be tidied up: while modules are imported, and at the very end.

Python would raise `KeyboardInterrupt` in the middle of an import, print where that was, and in some places lose it.
The command imports this before anything else; so it imports next to nothing itself.
"""

from __future__ import annotations

import os
import signal

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from types import FrameType

    Handler = Callable[[int, FrameType | None], object]

STATUS = 130
"""Exit status of a command that Ctrl-C has ended: 128 and the number of the signal, as shells count."""


def leave_on_interrupt() -> None:
    """From now on Ctrl-C ends the process at once, with status 130; where it is ignored it stays ignored."""
    _replace(signal.default_int_handler, _leave)


class Leaving:
    """`with Leaving():` Ctrl-C inside ends the process at once."""

    def __enter__(self) -> None:
        leave_on_interrupt()

    def __exit__(self, *_: object) -> None:
        _replace(_leave, signal.default_int_handler)


def _replace(present: Handler, handler: Handler) -> None:
    """Change what SIGINT does, if it is `present`; only the main thread may."""
    if signal.getsignal(signal.SIGINT) is present:
        try:
            signal.signal(signal.SIGINT, handler)
        except ValueError:
            return


def _leave(*_: object) -> None:
    os._exit(STATUS)
