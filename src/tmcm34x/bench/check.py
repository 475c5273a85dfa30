"""A bench file as an editor checks it: what is wrong, with line and column.

What is wrong is what `description` and `builder` say: this only finds the place of it in the text.
"""

from __future__ import annotations

import re
from typing import Final

from tmcm34x.bench.builder import build
from tmcm34x.bench.description import parse
from tmcm34x.bench.places import Places, Span, parse_path
from tmcm34x.bench.rig import BenchError
from tmcm34x.files import parse_toml
from tmcm34x.toolchain.diagnostics import Diagnostic, Location

_SYNTAX: Final = re.compile(r" \(at (?:line (\d+), column (\d+)|end of document)\)\Z")
_PATH: Final = re.compile(r"((?:[A-Za-z_]\w*)(?:\.[A-Za-z_]\w*|\[\d+\])*): (.*)\Z", re.DOTALL)
_UNKNOWN: Final = re.compile(r"unknown field (\w+)\Z")
_TABLE: Final = re.compile(r"^\s*\[+\s*modul", re.MULTILINE)


def is_bench(path: str, text: str) -> bool:
    """Whether a TOML file is meant as a bench: it has a module, or its path says so."""
    return path.endswith(".toml") and (bool(_TABLE.search(text)) or "bench" in path.lower())


def check(text: str, path: str) -> list[Diagnostic]:
    """What is wrong with the text of a bench file; the first mistake, since what follows may come from it."""
    try:
        parse_toml(text)
    except ValueError as error:
        return [_syntax(str(error), text, path)]
    try:
        build(parse(text))
    except BenchError as error:
        return [_mistake(str(error), text, path)]
    return []


def _syntax(message: str, text: str, path: str) -> Diagnostic:
    place = _SYNTAX.search(message)
    if place and place[1]:
        line, column = int(place[1]), int(place[2])
    else:  # the end of the text: what is not closed is before it
        lines = text.rstrip().split("\n")
        line, column = len(lines), len(lines[-1]) + 1
    return _diagnostic(path, Span(line, column, column + 1), "toml", _SYNTAX.sub("", message))


def _mistake(message: str, text: str, path: str) -> Diagnostic:
    match = _PATH.match(message)
    place, what = (match[1], match[2]) if match else ("", message)
    steps, places = parse_path(place), Places(text)
    unknown = _UNKNOWN.search(what)
    span = places.find_key((*steps, unknown[1])) if unknown else places.find(steps)
    return _diagnostic(path, span, "bench", message)


def _diagnostic(path: str, span: Span, code: str, text: str) -> Diagnostic:
    location = Location(path, span.line, span.column, max(span.end, span.column + 1))
    return Diagnostic(location, "error", code, text[:1].lower() + text[1:])
