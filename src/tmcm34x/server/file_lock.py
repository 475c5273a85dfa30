"""A lock on an open file that one process has at a time, and that ends with it: `flock`, or `msvcrt` on Windows."""

from __future__ import annotations

import os
import sys
from typing import Final

_FAR: Final = 1 << 40
"""Locks on Windows are on bytes, and keep others from reading them: this one is beyond any file's end."""


def lock(fd: int) -> None:
    """Lock the file for this process; raises `BlockingIOError` if another one has it."""
    if sys.platform == "win32":
        import msvcrt

        place = os.lseek(fd, 0, os.SEEK_CUR)
        os.lseek(fd, _FAR, os.SEEK_SET)
        try:
            msvcrt.locking(fd, msvcrt.LK_NBLCK, 1)
        except OSError as error:
            raise BlockingIOError(error.errno, error.strerror) from error
        finally:
            os.lseek(fd, place, os.SEEK_SET)
    else:
        import fcntl

        fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
