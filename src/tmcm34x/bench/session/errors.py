"""What can be wrong with a session, or with the module that it is played on.

SessionError
├── SessionSyntaxError    the text cannot be read: file, line, column, problem
└── SessionFailedError        the module did not do as the session says
"""

from __future__ import annotations

from typing import NamedTuple


class SessionError(Exception):
    """A session that cannot be read, or that failed."""


class SessionSyntaxError(SessionError):
    """A line that cannot be read; `line` and `column` count from 1, 0 where there is none."""

    def __init__(self, path: str, line: int, column: int, problem: str) -> None:
        where = ":".join([path, *(str(n) for n in (line, column) if n)])
        super().__init__(f"{where}: {problem}")
        self.path, self.line, self.column, self.problem = path, line, column, problem


class Unmet(Exception):  # noqa: N818
    """Raised by an action that did not find what it expects; `data` are the bytes that came instead."""

    def __init__(self, expected: str, got: str, data: bytes = b"") -> None:
        super().__init__(f"expected {expected}, got {got}")
        self.expected, self.got, self.data = expected, got, data


class SessionLine(NamedTuple):
    """A line of a session file."""

    path: str
    line: int
    text: str
    title: str


class SessionFailedError(SessionError):
    """A module that did not do as a line says.

    sent: the last thing that was sent, as it stands in the session and as bytes
    """

    def __init__(self, place: SessionLine, unmet: Unmet, sent: tuple[str, bytes] | None, at_s: float) -> None:
        super().__init__(f"{place.path}:{place.line}: {place.text}: {unmet}")
        self.place, self.unmet, self.sent, self.at_s = place, unmet, sent, at_s

    def report(self) -> str:
        """All that is known, over several lines."""
        rows = [("in", self.place.title), ("at", f"{self.at_s:.6f} s")]
        if self.sent is not None:
            text, data = self.sent
            rows.append(("sent", f"{text}  [{data.hex(' ')}]" if data else text))
        rows.append(("expected", self.unmet.expected))
        dump = f"  [{self.unmet.data.hex(' ')}]" if self.unmet.data else ""
        rows.append(("got", self.unmet.got + dump))
        head = f"{self.place.path}:{self.place.line}: {self.place.text}"
        return "\n".join([head, *(f"    {name:<9} {text}" for name, text in rows)])
