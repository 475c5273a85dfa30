"""A program with all its files in memory, assembled with other values of its constants."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from tmcm34x.sweep.description import Number, SweepError
from tmcm34x.toolchain.assembler import Assembly, IncludeReader, assemble
from tmcm34x.toolchain.mending.spelling import proposal
from tmcm34x.toolchain.tokens import split_lines


class ProgramSources(NamedTuple):
    """A program's text and the files that it includes.

    included: full name and text, by the name in the `#include` and the including file
    places: file and line of the definition of each constant, by upper-case name
    """

    file: str
    text: str
    included: Mapping[tuple[str, str], tuple[str, str]]
    places: Mapping[str, tuple[str, int]]
    model: int

    def constant(self, name: str) -> str:
        """The key of a constant; raises `SweepError` where the program has none of this name."""
        key = name.upper()
        if key not in self.places:
            raise SweepError(f"{self.file} has no constant named {name}{proposal(key, self.places)}")
        return key

    def assemble(self, constants: Mapping[str, Number]) -> Assembly:
        """The program with these values, by the keys of the constants; raises `SweepError` for what is no program."""
        changes = {self.places[key]: f"{key} = {value}" for key, value in constants.items()}

        def include(name: str, from_file: str) -> tuple[str, str]:
            found = self.included.get((name, from_file))
            if found is None:
                raise FileNotFoundError(2, "no such file")
            return found[0], _changed(*found, changes)

        text = _changed(self.file, self.text, changes)
        assembly = assemble(text, self.file, include, append_stop=True, model=self.model)
        if not assembly.ok:
            first = next(each for each in assembly.diagnostics if each.severity == "error")
            raise SweepError(f"{first.location.file}, line {first.location.line}: {first.text}")
        return assembly


def gather(text: str, file: str, include: IncludeReader, model: int) -> ProgramSources:
    """The program in `text` and the files that it includes; raises `SweepError` for what is no program."""
    included: dict[tuple[str, str], tuple[str, str]] = {}

    def reading(name: str, from_file: str) -> tuple[str, str]:
        found = included[name, from_file] = include(name, from_file)
        return found

    assembly = assemble(text, file, reading, append_stop=True, model=model)
    places = {
        key: (symbol.definition.file, symbol.definition.line)
        for key, symbol in assembly.symbols.items()
        if symbol.kind == "constant"
    }
    sources = ProgramSources(file, text, included, places, model)
    sources.assemble({})
    return sources


def _changed(file: str, text: str, changes: Mapping[tuple[str, int], str]) -> str:
    lines = split_lines(text)
    for (name, number), line in changes.items():
        if name == file:
            lines[number - 1] = line
    return "\n".join(lines)
