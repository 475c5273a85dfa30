"""What a program is doing, and what went wrong in it.

Source: manual 6.7.36 (135), 8.1 parameter 128; fidelity PROG-7 to PROG-9.
"""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

from tmcm34x.tmcl.status import Status


class RunState(IntEnum):
    """What the program is doing (control function 135, global parameter 128)."""

    STOP = 0
    RUN = 1
    STEP = 2
    RESET = 3


class ProgramError(NamedTuple):
    """A command of the program that was refused, or an end of the program without STOP."""

    address: int
    status: Status
