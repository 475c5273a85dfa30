"""What reading a value gave: the value, a refusal, nothing there, or no reply.  Four types for four things.

match reading:
case Value(number): ...
case Refused(status): ...
case Absent(why): ...
case Silent(why): ...
"""

from __future__ import annotations

from dataclasses import dataclass

from tmcm34x.tmcl.status import STATUS_TEXTS


@dataclass(frozen=True, slots=True)
class Value:
    """The value in a reply."""

    value: int

    @property
    def text(self) -> str:
        """For a table cell."""
        return str(self.value)


@dataclass(frozen=True, slots=True)
class Refused:
    """The module answered with an error status."""

    status: int

    @property
    def text(self) -> str:
        """For a table cell."""
        return f"refused: status {self.status}, {STATUS_TEXTS.get(self.status, 'unknown status')}"


@dataclass(frozen=True, slots=True)
class Absent:
    """This model does not have it; nothing was sent."""

    why: str

    @property
    def text(self) -> str:
        """For a table cell."""
        return f"not available: {self.why}"


@dataclass(frozen=True, slots=True)
class Silent:
    """No reply came."""

    why: str

    @property
    def text(self) -> str:
        """For a table cell."""
        return f"no reply: {self.why}"


Reading = Value | Refused | Absent | Silent
