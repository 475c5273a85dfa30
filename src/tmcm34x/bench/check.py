"""A bench file as an editor checks it: all that is wrong, with line and column.

What is wrong is what `description` and `builder` say, one mistake at a time; this finds the place of it in the text,
and looks at the rest without it.  What may only follow from an earlier mistake is not said.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import count, islice
from typing import Final, cast

from tmcm34x.bench.builder import build
from tmcm34x.bench.description import Bench, from_table
from tmcm34x.bench.places import Path, Places, Span, parse_path
from tmcm34x.bench.rig import BenchError
from tmcm34x.files import parse_toml
from tmcm34x.toolchain.diagnostics import Diagnostic, Location

MOST: Final = 50
"""Mistakes that are looked for in one file."""
_SYNTAX: Final = re.compile(r" \(at (?:line (\d+), column (\d+)|end of document)\)\Z")
_PATH: Final = re.compile(r"((?:[A-Za-z_]\w*)(?:\.[A-Za-z_]\w*|\[\d+\])*): (.*)\Z", re.DOTALL)
_UNKNOWN: Final = re.compile(r"unknown field (\w+)")
_MISSING: Final = re.compile(r"missing required field (\w+)")
_TABLE: Final = re.compile(r"^\s*\[+\s*modul", re.MULTILINE)
_MODULE: Final = ("module",)


def is_bench(path: str, text: str) -> bool:
    """Whether a TOML file is meant as a bench: it has a module, or its path says so."""
    return path.endswith(".toml") and (bool(_TABLE.search(text)) or "bench" in path.lower())


def check(text: str, path: str) -> list[Diagnostic]:
    """What is wrong with the text of a bench file, in its order; of the syntax the first mistake alone."""
    try:
        table = parse_toml(text)
    except ValueError as error:
        return [_syntax(str(error), text, path)]
    places = Places(text)
    found = [_mistake(each, places, path) for each in islice(_Search(table).mistakes(), MOST)]
    return sorted(found, key=lambda item: (item.location.line, item.location.column))


class _Mistake:
    """What `message` says, and where: `place` is the table or value, `at` what must go for the rest to be seen."""

    def __init__(self, message: str, gone: frozenset[Path]) -> None:
        match = _PATH.match(message)
        place, what = (match[1], match[2]) if match else ("", message)
        self.place = _original(parse_path(place), gone)
        self.text = f"{_written(self.place)}: {what}" if self.place else message
        unknown, missing = _UNKNOWN.search(what), _MISSING.search(what)
        self.unknown = unknown is not None
        self.at = (*self.place, unknown[1]) if unknown else self.place
        self.known = (*self.place, missing[1]) in gone if missing else _touched(self.place, gone)
        """It follows from a mistake that was found before."""


class _Search:
    """Goes through the mistakes of a table: each is left out before the next one is looked for."""

    def __init__(self, table: dict[str, object]) -> None:
        self._table = table
        self._gone: frozenset[Path] = frozenset()
        self._doubted: set[Path] = set()
        """What was left out because it could not be read."""

    def mistakes(self) -> Iterator[_Mistake]:
        while True:
            try:
                bench = from_table(cast("dict[str, object]", _left(self._table, self._gone)))
            except BenchError as error:
                mistake = _Mistake(str(error), self._gone)
                if not mistake.known:
                    yield mistake
                at = self._leave_out(mistake)
                if not mistake.unknown:
                    self._doubted.add(at)
            else:
                mistake = self._built(bench)
                if mistake is None:
                    return
                if not mistake.known and not self._doubts(mistake):
                    yield mistake
                at = self._leave_out(mistake)
            if not at:
                return

    def _built(self, bench: Bench) -> _Mistake | None:
        try:
            build(bench)
        except BenchError as error:
            return _Mistake(str(error), self._gone)
        return None

    def _doubts(self, mistake: _Mistake) -> bool:
        """Whether the mistake may come from what was left out beside it, or from a module that was."""
        tables = {mistake.place[:-1], _MODULE}
        return any(path[:-1] in tables for path in self._doubted)

    def _leave_out(self, mistake: _Mistake) -> Path:
        """From now on look at the rest; what was left out, the empty path where that is everything."""
        at = mistake.at
        while at and (at in self._gone or not _exists(self._table, at)):
            at = at[:-1]
        self._gone |= {at}
        return at


def _left(value: object, gone: frozenset[Path], path: Path = ()) -> object:
    """A value without what is gone."""
    if isinstance(value, dict):
        items = cast("dict[str, object]", value).items()
        return {name: _left(inner, gone, (*path, name)) for name, inner in items if (*path, name) not in gone}
    if isinstance(value, list):
        numbered = enumerate(cast("list[object]", value))
        return [_left(inner, gone, (*path, n)) for n, inner in numbered if (*path, n) not in gone]
    return value


def _original(path: Path, gone: frozenset[Path]) -> Path:
    """A path in the whole table, from one in what was left of it."""
    result: Path = ()
    for step in path:
        result = (*result, _nth_left(result, step, gone) if isinstance(step, int) else step)
    return result


def _nth_left(path: Path, index: int, gone: frozenset[Path]) -> int:
    left = (n for n in count() if (*path, n) not in gone)
    return next(islice(left, index, None))


def _written(path: Path) -> str:
    return "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in path).removeprefix(".")


def _touched(place: Path, gone: frozenset[Path]) -> bool:
    """Whether a value is gone, or a list has become shorter."""
    return any(path == place or (path[:-1] == place and isinstance(path[-1], int)) for path in gone)


def _exists(value: object, path: Path) -> bool:
    for step in path:
        if isinstance(value, dict) and step in value:
            value = cast("dict[object, object]", value)[step]
        elif isinstance(value, list) and isinstance(step, int) and step < len(cast("list[object]", value)):
            value = cast("list[object]", value)[step]
        else:
            return False
    return True


def _syntax(message: str, text: str, path: str) -> Diagnostic:
    place = _SYNTAX.search(message)
    if place and place[1]:
        line, column = int(place[1]), int(place[2])
    else:  # the end of the text: what is not closed is before it
        lines = text.rstrip().split("\n")
        line, column = len(lines), len(lines[-1]) + 1
    return _diagnostic(path, Span(line, column, column + 1), "toml", _SYNTAX.sub("", message))


def _mistake(mistake: _Mistake, places: Places, path: str) -> Diagnostic:
    span = places.find_key(mistake.at) if mistake.unknown else places.find(mistake.place)
    return _diagnostic(path, span, "bench", mistake.text)


def _diagnostic(path: str, span: Span, code: str, text: str) -> Diagnostic:
    location = Location(path, span.line, span.column, max(span.end, span.column + 1))
    return Diagnostic(location, "error", code, text[:1].lower() + text[1:])
