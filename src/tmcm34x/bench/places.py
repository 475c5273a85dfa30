"""Where keys and values stand in the text of a bench file.

`tomllib` reads TOML and says nothing of places; this walks through a text that it has read already, and so may take
for granted that it is right.

Source: TOML 1.0.
"""

from __future__ import annotations

import re
from typing import Final, NamedTuple

Path = tuple[str | int, ...]
"""Names of keys and indices of lists, from the whole file inward."""

_BLANK: Final = re.compile(r"(?:[ \t\r\n,]|#[^\n]*)*")
_SPACE: Final = re.compile(r"[ \t]*")
_STRING: Final = re.compile(
    r'"""(?:\\.|[^\\])*?"{3,5}|\'\'\'.*?\'{3,5}|"(?:\\.|[^"\\\n])*"|\'[^\'\n]*\'', re.DOTALL
)
_BARE_KEY: Final = re.compile(r"[A-Za-z0-9_-]+")
_SCALAR: Final = re.compile(r"[^,\]}#\n]+")
_STEP: Final = re.compile(r"([^.\[\]]+)|\[(\d+)\]")


class Span(NamedTuple):
    """A place in a line: line and columns from 1, `end` behind the last character."""

    line: int
    column: int
    end: int


class Places:
    """Where everything in `text` stands."""

    def __init__(self, text: str) -> None:
        self._text = text
        self._at = 0
        self._counts: dict[Path, int] = {}
        """How many tables each array of tables has so far."""
        self.keys: dict[Path, Span] = {}
        self.values: dict[Path, Span] = {}
        """Of values that stand in one line and are no tables."""
        self._walk()

    def find(self, path: Path) -> Span:
        """The place of a value, or of its key; of what it is in where it is not there itself."""
        return self.values.get(path) or self.find_key(path)

    def find_key(self, path: Path) -> Span:
        """The place of a key; of what it is in where it is not there itself."""
        parts = (path[:length] for length in range(len(path), 0, -1))
        return next((self.keys[part] for part in parts if part in self.keys), Span(1, 1, 1))

    # Reading

    def _walk(self) -> None:
        table: Path = ()
        while self._skip(_BLANK) < len(self._text):
            if self._text[self._at] == "[":
                table = self._header()
            else:
                self._pair(table)

    def _skip(self, pattern: re.Pattern[str]) -> int:
        match = pattern.match(self._text, self._at)
        self._at = match.end() if match else self._at
        return self._at

    def _header(self) -> Path:
        start, many = self._at, self._text.startswith("[[", self._at)
        self._at += 2 if many else 1
        *outer, last = (name for name, _ in self._names())
        self._at += 2 if many else 1
        path = (*self._inside(tuple(outer)), last)
        if many:
            self._counts[path] = self._counts.get(path, -1) + 1
            path = (*path, self._counts[path])
        span = self._span(start, self._at)
        self.keys.setdefault(path[:-1] if many else path, span)
        self.keys[path] = span
        return path

    def _inside(self, names: Path) -> Path:
        """The path of a table in which another one is: the last one of each array of tables."""
        path: Path = ()
        for name in names:
            path = (*path, name)
            if path in self._counts:
                path = (*path, self._counts[path])
        return path

    def _names(self) -> list[tuple[str, Span]]:
        """A dotted key."""
        names: list[tuple[str, Span]] = []
        while True:
            start = self._skip(_SPACE)
            quoted = self._text[start] in "\"'"
            end = self._skip(_STRING if quoted else _BARE_KEY)
            name = self._text[start:end]
            names.append((name[1:-1] if quoted else name, self._span(start, end)))
            if self._text[self._skip(_SPACE)] != ".":
                return names
            self._at += 1

    def _pair(self, table: Path) -> None:
        path = table
        for name, span in self._names():
            path = (*path, name)
            self.keys.setdefault(path, span)
        self._at += 1
        self._skip(_SPACE)
        self._value(path)

    def _value(self, path: Path) -> None:
        start = self._at
        match self._text[start]:
            case "{":
                self._inline(path)
            case "[":
                self._list(path)
            case '"' | "'":
                self._skip(_STRING)
            case _:
                self._skip(_SCALAR)
        end = start + len(self._text[start : self._at].rstrip())
        if self._text[start] != "{" and "\n" not in self._text[start:end]:
            self.values[path] = self._span(start, end)

    def _inline(self, path: Path) -> None:
        self._at += 1
        while self._text[self._skip(_BLANK)] != "}":
            self._pair(path)
        self._at += 1

    def _list(self, path: Path) -> None:
        self._at += 1
        index = 0
        while self._text[self._skip(_BLANK)] != "]":
            self.keys[*path, index] = self._span(self._at, self._at + 1)
            self._value((*path, index))
            index += 1
        self._at += 1

    def _span(self, start: int, end: int) -> Span:
        before = self._text.rfind("\n", 0, start) + 1
        return Span(self._text.count("\n", 0, start) + 1, start - before + 1, end - before + 1)


def parse_path(text: str) -> Path:
    """A path as errors of benches write it: `module[1].axis[0].motor`."""
    return tuple(name or int(index) for name, index in _STEP.findall(text))
