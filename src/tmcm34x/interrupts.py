"""Ctrl-C while nothing is under way that would have to be tidied up: while modules are imported, and at the very end.

Python would raise `KeyboardInterrupt` in the middle of an import, print where that was, and in some places lose it:
what a finalizer or the callback of a weak reference raises goes no further, and imports have such callbacks.
The command imports this before anything else; so it imports next to nothing itself.
"""

from __future__ import annotations

import os
import signal
import sys

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


def keep_interrupts() -> None:
    """From now on an interrupt that Python would lose is raised at the next call or return of the main thread."""
    sys.unraisablehook = _unraisable


def _unraisable(lost: sys.UnraisableHookArgs) -> None:
    if lost.exc_type is KeyboardInterrupt:
        sys.setprofile(_raise_outside)
    else:
        sys.__unraisablehook__(lost)


def _raise_outside(frame: FrameType, *_: object) -> None:
    """Raise the interrupt in the first frame that is not the hook's own, where it would be lost again."""
    if frame.f_code is not _unraisable.__code__:
        sys.setprofile(None)
        raise KeyboardInterrupt


def _replace(present: Handler, handler: Handler) -> None:
    """Change what SIGINT does, if it is `present`; only the main thread may."""
    if signal.getsignal(signal.SIGINT) is present:
        try:
            signal.signal(signal.SIGINT, handler)
        except ValueError:
            return


def _leave(*_: object) -> None:
    os._exit(STATUS)
