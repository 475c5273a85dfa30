"""Where the traceback of a mistake ends: in the file of the tests that made it, not inside this package."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from types import TracebackType
from typing import Final

_PACKAGE: Final = Path(__file__).parents[1]


def end_at_caller(error: BaseException, root: Path) -> bool:
    """Leave in the traceback of `error`, from the test on, only files below `root`, none installed, none of ours.

    Returns whether there is one; there is none where a fixture cannot be made.
    """
    frames = [entry for entry in _entries(error.__traceback__) if _is_below(entry, root)]
    for entry, following in pairwise(frames):
        entry.tb_next = following
    if frames:
        frames[-1].tb_next = None
        error.__cause__, error.__suppress_context__ = None, True
    return bool(frames)


def _entries(traceback: TracebackType | None) -> Iterator[TracebackType]:
    while traceback is not None:
        yield traceback
        traceback = traceback.tb_next


def _is_below(entry: TracebackType, root: Path) -> bool:
    folders = Path(entry.tb_frame.f_code.co_filename).parents
    installed = any(folder.name == "site-packages" for folder in folders)
    return root in folders and _PACKAGE not in folders and not installed
