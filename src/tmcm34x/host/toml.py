"""TOML for settings and backups: a small writer, and a reader whose errors name path and line.

The standard library reads TOML; it neither writes it nor says where a value stands.  What is written here is read by
any TOML reader.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Final, cast

from tmcm34x.files import parse_toml
from tmcm34x.host.exceptions import FileError
from tmcm34x.toolchain.mending.spelling import proposal

_HEADER: Final = re.compile(r"\s*\[{1,2}\s*([^\[\]]+?)\s*\]{1,2}\s*(?:#.*)?\Z")
_KEY: Final = re.compile(r"\s*([A-Za-z0-9_\-.\"' ]+?)\s*=")
_POSITION: Final = re.compile(r"\(at line (\d+), column \d+\)")


def table(name: str, rows: Iterable[tuple[str, object]]) -> Iterator[str]:
    """The lines of a table, nothing for one without rows."""
    lines = [f"{key} = {literal(value)}" for key, value in rows]
    if lines:
        yield ""
        yield f"[{name}]"
        yield from lines


def literal(value: object) -> str:
    """A value as TOML writes it: integers, booleans, lists of them, and strings."""
    match value:
        case bool():
            return str(value).lower()
        case int():
            return str(value)
        case str():
            return _string(value)
        case _:
            return f"[{', '.join(literal(item) for item in cast('Iterable[object]', value))}]"


def _string(text: str) -> str:
    """A string; several lines as such, where nothing in them has to be escaped."""
    if "\n" in text and "'''" not in text and all(c in "\n\t" or c >= " " for c in text):
        return f"'''\n{text}'''"
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n").replace("\t", "\\t")
    return '"' + "".join(c if c >= " " and c != "\x7f" else f"\\u{ord(c):04x}" for c in escaped) + '"'


class Document:
    """A TOML file that a person may have edited."""

    def __init__(self, text: str, path: str) -> None:
        """Raises `FileError` where the text is no TOML."""
        self.path = path
        self._lines = text.splitlines()
        try:
            self.root: dict[str, Any] = parse_toml(text)
        except tomllib.TOMLDecodeError as error:
            raise self._syntax(str(error)) from error

    def table(self, name: str) -> Mapping[str, Any]:
        """The table `name`, dots and all; empty where there is none."""
        found: Any = self.root
        for part in name.split("."):
            found = cast("dict[str, Any]", found).get(part, {})
            if not isinstance(found, dict):
                raise self.error(name, "must be a table")
        return cast("Mapping[str, Any]", found)

    def integer(self, path: str, value: Any, low: int, high: int) -> int:
        """A value that must be a whole number in a range.  Raises `FileError`."""
        if isinstance(value, bool) or not isinstance(value, int):
            raise self.error(path, f"must be a whole number, not {value!r}")
        if not low <= value <= high:
            raise self.error(path, f"must be {low}..{high}, not {value}")
        return value

    def unknown(self, path: str, key: str, known: Iterable[str]) -> FileError:
        """What to raise for a key that nothing has, with the nearest that something has."""
        return self.error(path, f"there is no such name{proposal(key, known)}")

    def error(self, path: str, what: str) -> FileError:
        """A `FileError` about `path`, with its line."""
        return FileError(self.path, self.line(path), f"{path}: {what}")

    def line(self, path: str) -> int:
        """The line that gives `path`, counted from 1; 0 where none is found."""
        header = ""
        found = 0
        for number, text in enumerate(self._lines, 1):
            if match := _HEADER.match(text):
                header = _plain(match[1])
                found = found or (number if header == path else 0)
            elif match := _KEY.match(text):
                name = _plain(match[1])
                if (f"{header}.{name}" if header else name) == path:
                    return number
        return found

    def _syntax(self, message: str) -> FileError:
        match = _POSITION.search(message)
        text = _POSITION.sub("", message).strip()
        return FileError(self.path, int(match[1]) if match else len(self._lines), f"not TOML: {text}")


def _plain(name: str) -> str:
    return ".".join(part.strip().strip("\"'") for part in name.split("."))
