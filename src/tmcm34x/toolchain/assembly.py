"""What the assembler finds in a source text: symbols, the code by address, diagnostics, and where all of it stands."""

from __future__ import annotations

from collections.abc import Mapping, Set
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

from tmcm34x.tmcl.commands import Command as CommandRow
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.toolchain.diagnostics import Diagnostic, Location, has_errors
from tmcm34x.toolchain.parser import Data, SourceLine, WrittenCommand

SymbolKind = Literal["label", "constant"]


@dataclass(slots=True)
class Symbol:
    """A label or a constant: its value, and where it stands in the sources."""

    name: str
    kind: SymbolKind
    value: float
    definition: Location
    references: list[Location] = field(default_factory=list[Location])
    comment: str = ""


class Code(NamedTuple):
    """One address of the program.

    row: of the command; None for a DATA line or where the mnemonic is wrong
    instruction: None where the line has mistakes
    line: the parsed source line, number `number` of `file`
    """

    row: CommandRow | None
    instruction: Instruction | None
    file: str
    number: int
    line: SourceLine

    @property
    def appended(self) -> bool:
        """Whether it is the STOP that no source line holds."""
        return self.line.statement is None

    @property
    def location(self) -> Location:
        """Of the command without its labels and comment."""
        statement = self.line.statement
        if isinstance(statement, WrittenCommand | Data):
            return Location(self.file, self.number, statement.start + 1, statement.end + 1)
        return Location(self.file, self.number, 1, 1)


class Assembly(NamedTuple):
    """What `assemble` found.

    code: one entry an address, also where lines have mistakes
    symbols: by upper-case name
    sources: the lines of each file, by its name, in the order of reading
    lines: each file's parsed lines, by its name
    includes: the file that each `#include` took, by its own file and line
    left_out: files and lines of directives, and of what their conditions leave out
    """

    file: str
    code: tuple[Code, ...]
    symbols: Mapping[str, Symbol]
    diagnostics: tuple[Diagnostic, ...]
    sources: Mapping[str, list[str]]
    lines: Mapping[str, list[SourceLine]]
    includes: Mapping[tuple[str, int], str]
    left_out: Set[tuple[str, int]]

    @property
    def ok(self) -> bool:
        """Whether there is a program."""
        return not has_errors(self.diagnostics)

    @property
    def program(self) -> tuple[Instruction, ...]:
        """The instructions; none at all when there are errors."""
        if not self.ok:
            return ()
        return tuple(code.instruction for code in self.code if code.instruction is not None)

    @property
    def source_map(self) -> tuple[Location, ...]:
        """Where the command of each address stands."""
        return tuple(code.location for code in self.code)

    @property
    def labels(self) -> dict[str, int]:
        """The address of each label, by its name as defined."""
        return {s.name: int(s.value) for s in self.symbols.values() if s.kind == "label"}
