"""Why a port or a socket cannot be used, in words for its user."""

from __future__ import annotations

import errno
import os


def reason(error: Exception) -> str:
    """The system's words for an error, or the error's own where the system has none."""
    number = getattr(error, "errno", None)
    return os.strerror(number) if number and number > 0 else str(error)


def port_reason(error: Exception) -> str:
    """`reason` for a serial port, of which another program may have exclusive use."""
    return "another program is using it" if is_in_use(error) else reason(error)


def is_in_use(error: Exception) -> bool:
    """Whether another program has exclusive use of a port, or has read what this one was to read."""
    return getattr(error, "errno", None) in {errno.EAGAIN, errno.EBUSY}
