"""What a module under test raises, and how long its conditions may take."""

from __future__ import annotations

from typing import Final

PATIENCE_S: Final = 60.0
"""Default time-out of `until`, in the module's time."""


class TooLateError(AssertionError):
    """A condition that did not come true in time."""


class WrongUseError(ValueError):
    """Something that a test asks for and cannot have; the text says what it can."""


class NotOnRealModuleError(Exception):
    """Something that only a virtual module can do; the pytest plugin skips the test."""
