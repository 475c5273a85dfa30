"""Labels and constants: where they are defined and used, renaming, the outline of a file."""

from __future__ import annotations

import re
from typing import Final, NamedTuple

from tmcm34x.editor.analysis.program import Analysis, TextPosition
from tmcm34x.toolchain.assembler import Symbol
from tmcm34x.toolchain.diagnostics import Edit, Location
from tmcm34x.toolchain.flow import CSUB
from tmcm34x.toolchain.includes import PARAMETERS, is_standard

_NAME: Final = re.compile(r"[A-Za-z_]\w*\Z", re.ASCII)


class Outline(NamedTuple):
    """A name that a file defines; `last_line` is the last one that belongs to it."""

    symbol: Symbol
    is_subroutine: bool
    last_line: int


def definition(program: Analysis, place: TextPosition) -> Location | None:
    """Where the name at a place is defined; for an `#include` the beginning of that file."""
    included = program.assembly.includes.get((place.file, place.line + 1))
    if included is not None:
        return None if is_standard(included) else Location(included, 1, 1, 1)
    found = program.symbol_at(place)
    return None if found is None or is_standard(found[0].definition.file) else found[0].definition


def references(program: Analysis, place: TextPosition, *, definition: bool = True) -> list[Location]:
    """Where the name at a place is used, and defined if wanted."""
    found = program.symbol_at(place)
    if found is None:
        return []
    symbol = found[0]
    known = definition and not is_standard(symbol.definition.file)
    return [symbol.definition, *symbol.references] if known else list(symbol.references)


def rename(program: Analysis, place: TextPosition, new_name: str) -> tuple[Edit, ...]:
    """The edits that rename the label or constant at a place; raises `ValueError` where that cannot be."""
    found = program.symbol_at(place)
    if found is None:
        raise ValueError("there is no label or constant here")
    if is_standard(found[0].definition.file):
        raise ValueError(f"{found[0].name} is a name of {PARAMETERS}, which comes with the tool chain")
    if not _NAME.match(new_name):
        raise ValueError(f"{new_name!r} is no name: a letter or _, then letters, digits and _")
    other = program.assembly.symbols.get(new_name.upper())
    if other is not None and other is not found[0]:
        raise ValueError(f"{other.name} is already a {other.kind}")
    names = {found[0].definition, *found[0].references}
    return tuple(Edit(name, new_name) for name in sorted(names))


def outline(program: Analysis, file: str) -> list[Outline]:
    """The labels and constants that a file defines, in order, with the lines that belong to each label."""
    symbols = sorted(
        (s for s in program.assembly.symbols.values() if s.definition.file == file),
        key=lambda s: s.definition,
    )
    called = {
        i.value for code in program.assembly.code if (i := code.instruction) is not None and i.number == CSUB
    }
    last = len(program.assembly.sources[file])
    outline: list[Outline] = []
    for symbol in reversed(symbols):
        first = symbol.definition.line
        if symbol.kind == "constant":
            outline.append(Outline(symbol, is_subroutine=False, last_line=first))
            continue
        outline.append(Outline(symbol, symbol.value in called, _last_filled(program, file, first, last)))
        last = max(1, first - 1)
    return outline[::-1]


def _last_filled(program: Analysis, file: str, first: int, last: int) -> int:
    """The last line from `first` to `last` that is neither blank nor a comment."""
    lines = program.assembly.lines[file]
    while last > first and lines[last - 1].statement is None and not lines[last - 1].labels:
        last -= 1
    return max(first, last)
