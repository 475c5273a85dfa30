"""A program as an editor sees it: its texts, its names, its findings.

Lines and columns of places count from 0, as editors do, in characters; `Location`s count from 1, as people do.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Final, NamedTuple

from tmcm34x.tmcl.commands import BY_MNEMONIC
from tmcm34x.toolchain import parser
from tmcm34x.toolchain.assembler import Assembly, Code, Symbol
from tmcm34x.toolchain.diagnostics import Diagnostic, Location
from tmcm34x.toolchain.tokens import Token, tokenize

_SAP: Final = BY_MNEMONIC["SAP"].number


class TextPosition(NamedTuple):
    """A place between two characters."""

    file: str
    line: int
    column: int


class Analysis:
    """One program, with the files that it includes, and all that is known about it."""

    def __init__(self, assembly: Assembly, findings: Sequence[Diagnostic], model: int = 343) -> None:
        self.assembly = assembly
        self.findings = (*assembly.diagnostics, *findings)
        self.model = model

    def text(self, file: str, line: int) -> str:
        """One line; empty where there is none."""
        lines = self.assembly.sources.get(file, [])
        return lines[line] if 0 <= line < len(lines) else ""

    def token_at(self, place: TextPosition) -> Token | None:
        """The word that a place touches."""
        tokens = tokenize(self.text(place.file, place.line))
        touching = [token for token in tokens if token.start <= place.column <= token.end]
        names = [token for token in touching if token.kind != "operator"]
        return (names or touching or [None])[-1]

    def symbol_at(self, place: TextPosition) -> tuple[Symbol, Location] | None:
        """The label or constant at a place, and where exactly its name stands."""
        token = self.token_at(place)
        symbol = self.assembly.symbols.get(token.text.upper()) if token is not None else None
        if symbol is None:
            return None
        for name in (symbol.definition, *symbol.references):
            here = name.file == place.file and name.line == place.line + 1
            if here and name.column - 1 <= place.column <= name.end - 1:
                return symbol, name
        return None

    @cached_property
    def codes(self) -> Mapping[tuple[str, int], tuple[int, Code]]:
        """Address and code of each line that holds an instruction; lines count from 0."""
        return {
            (code.file, code.number - 1): (n, code)
            for n, code in enumerate(self.assembly.code)
            if not code.appended
        }

    def line_at(self, file: str, line: int) -> parser.SourceLine | None:
        """One parsed line, counted from 0; None where there is none."""
        lines = self.assembly.lines.get(file, [])
        return lines[line] if 0 <= line < len(lines) else None

    def diagnostics(self, file: str) -> list[Diagnostic]:
        """The findings in one file; those of files that it includes stand at the include line."""
        found: list[Diagnostic] = []
        for item in self.findings:
            if item.location.file == file:
                found.append(item)
            elif item.severity != "information":
                place = self._include_of(file, item.location.file)
                if place is not None:
                    text = f"{item.location.file}:{item.location.line}: {item.text}"
                    found.append(item._replace(location=place, text=text, fixes=()))
        return found

    def _include_of(self, file: str, included: str) -> Location | None:
        """The line of `file` by which `included` comes in, directly or through others."""
        seen: set[str] = set()
        while included not in seen:
            seen.add(included)
            for (name, number), target in self.assembly.includes.items():
                if target != included:
                    continue
                if name == file:
                    return Location(file, number, 1, len(self.assembly.sources[file][number - 1]) + 1)
                included = name
                break
        return None

    @cached_property
    def set_values(self) -> Mapping[tuple[int, int], list[tuple[int, int]]]:
        """Addresses and values of the SAP commands, by parameter and motor, in order."""
        values: dict[tuple[int, int], list[tuple[int, int]]] = {}
        for address, code in enumerate(self.assembly.code):
            instruction = code.instruction
            if instruction is not None and instruction.number == _SAP:
                key = (instruction.type, instruction.motor)
                values.setdefault(key, []).append((address, instruction.value))
        return values
