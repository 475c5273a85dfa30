"""The sources of a program as editors name them: files, lines and labels to addresses, and back."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from tmcm34x.debug.dap import messages as m
from tmcm34x.debug.dap.messages import RequestError
from tmcm34x.debug.sessions.base import SourceMap
from tmcm34x.files import real_path
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.toolchain.assembler import Assembly, Symbol, assemble
from tmcm34x.toolchain.disassembler import disassemble, up_to_end_mark

GENERATED: Final = "disassembly.tmc"
_REFERENCE: Final = 1
_MADE: Final = "<made>"
"""Key of the one source that is in no file."""


class Sources:
    """What is known of the program's text.

    folder: where relative file names begin
    """

    def __init__(self, folder: Path) -> None:
        self.base = 1
        """What the editor counts lines from."""
        self.text: SourceMap | None = None
        self._folder = folder
        self._made = ""
        self._files: dict[str, str] = {}
        """The assembly's files by `key`."""

    def take(self, assembly: Assembly | None, *, in_file: bool = True) -> None:
        """The program comes from this file, or its source is unknown; without a file, editors ask for its text."""
        self.text = None if assembly is None else SourceMap(assembly)
        self._made, self._files = "", {}
        if assembly is None:
            return
        self._files = {self._key_of(file): file for file in assembly.sources}
        if not in_file:
            self._made = "\n".join(assembly.sources[assembly.file])
            self._files[_MADE] = assembly.file

    def take_memory(self, memory: Sequence[Instruction]) -> None:
        """Make a text for a program that has none."""
        self.take(assemble(disassemble(up_to_end_mark(memory)), GENERATED), in_file=False)

    @property
    def assembly(self) -> Assembly | None:
        """What the assembler made of the program's text."""
        return None if self.text is None else self.text.assembly

    @property
    def symbols(self) -> dict[str, Symbol]:
        """Labels and constants by name in capitals."""
        return {} if self.text is None else dict(self.text.assembly.symbols)

    def made(self, reference: int | None) -> str:
        """The text that `reference` stands for; raises `RequestError`."""
        if reference != _REFERENCE or not self._made:
            raise RequestError("no such source")
        return self._made

    # From the editor

    def key(self, source: m.Source) -> str:
        """One name for each source, whether or not the program has it; raises `RequestError`."""
        if source.source_reference:
            return _MADE
        if source.path is None:
            raise RequestError("a source has a path or a reference")
        try:
            return self._key_of(source.path)
        except (OSError, ValueError) as error:
            raise RequestError(f"no path: {error}") from None

    def _key_of(self, path: str) -> str:
        return str(real_path(self._folder / path))

    def has(self, key: str) -> bool:
        """Whether the program has this source."""
        return key in self._files

    def address(self, key: str, line: int) -> int | None:
        """Of the first command in the editor's `line` or below it."""
        file = self._files.get(key)
        if file is None or self.text is None:
            return None
        return self.text.address(file, line + 1 - self.base)

    def lines(self, key: str) -> list[int]:
        """The editor's lines with commands."""
        file, assembly = self._files.get(key), self.assembly
        places = () if assembly is None else assembly.source_map
        return sorted({self.shown_line(place.line) for place in places if place.file == file})

    # To the editor

    def shown_line(self, line: int) -> int:
        """A line as the editor counts it."""
        return line - 1 + self.base

    def source(self, file: str) -> dict[str, Any]:
        """A file of the assembly."""
        path = Path(file)
        if file == self._files.get(_MADE):
            return {"name": path.name, "sourceReference": _REFERENCE, "origin": "disassembled"}
        return {"name": path.name, "path": self._key_of(file)}

    def sources(self) -> list[dict[str, Any]]:
        """All files of the program."""
        assembly = self.assembly
        return [] if assembly is None else [self.source(file) for file in assembly.sources]

    def place(self, address: int) -> dict[str, Any]:
        """Source and line of the command at `address`, where known."""
        place = self.text.location(address) if self.text is not None else None
        if place is None:
            return {}
        return {"source": self.source(place.file), "line": self.shown_line(place.line)}
