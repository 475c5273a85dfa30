"""From source text to a program and its listing, with the editor's pages before the files on disk."""

from __future__ import annotations

import posixpath
from collections.abc import Mapping, Sequence
from hashlib import blake2b
from typing import TYPE_CHECKING, NamedTuple

from tmcm34x.ide import wire
from tmcm34x.tmcl.datagram import Instruction, pack_record
from tmcm34x.tmcl.mnemonic import format_instruction
from tmcm34x.toolchain.includes import MOST_NEIGHBOURS, SOURCES, fitting, programs_with

if TYPE_CHECKING:
    from tmcm34x.ide.workspace import OpenFolder
    from tmcm34x.toolchain.assembler import Assembly
    from tmcm34x.toolchain.diagnostics import Diagnostic


class Built(NamedTuple):
    """What the assembler made: the answer for the page, and all that it found."""

    answer: wire.Assembled
    assembly: Assembly


def build(
    workspace: OpenFolder,
    path: str,
    texts: Mapping[str, str],
    model: int,
    *,
    as_part: bool = False,
    append_stop: bool = True,
) -> Built:
    """Assemble and check `path`.

    texts: stand before the files on disk
    as_part: takes the program in the folder that includes `path`, where there is one
    append_stop: puts a STOP at the end, as the TMCL-IDE does
    """
    from tmcm34x.toolchain.assembler import assemble
    from tmcm34x.toolchain.linter import lint

    files = _Files(workspace, texts)
    assembly = assemble(files.read(path), path, files.include, append_stop=append_stop, model=model)
    if as_part and (root := files.program_of(path)) != path:
        whole = assemble(files.read(root), root, files.include, append_stop=append_stop, model=model)
        assembly = whole if path in whole.sources else assembly
    findings = (*assembly.diagnostics, *lint(assembly, model=model))
    listing = _listing(assembly.file, assembly) if assembly.ok else None
    lines = [code.location.line if code.location.file == path else 0 for code in assembly.code]
    return Built(wire.Assembled([problem(item) for item in findings], listing, lines), assembly)


def recognise(
    workspace: OpenFolder, program: Sequence[Instruction], model: int
) -> tuple[wire.Listing | None, Assembly | None]:
    """A program that was found in a module: with the file of the folder that makes it, or as instructions alone.

    Neither where there are no instructions.
    """
    if not program:
        return None, None
    wanted = identity(program)
    for path in _programs(workspace):
        try:
            answer, assembly = build(workspace, path, {}, model)
        except wire.RefusalError:
            continue
        if answer.listing is not None and answer.listing.identity == wanted:
            return answer.listing, assembly
    lines = [
        wire.ListingLine(address, "", 0, pack_record(instruction).hex(" "), format_instruction(instruction))
        for address, instruction in enumerate(program)
    ]
    return wire.Listing("", wanted, lines, []), None


def _programs(workspace: OpenFolder) -> list[str]:
    """The files of the folder that may be programs, at most `MOST_NEIGHBOURS`."""
    paths = [entry.path for entry in workspace.files() if not entry.folder]
    return [path for path in paths if posixpath.splitext(path)[1].lower() in SOURCES][:MOST_NEIGHBOURS]


class _Files:
    """The editor's pages, and the files on disk behind them."""

    def __init__(self, workspace: OpenFolder, texts: Mapping[str, str]) -> None:
        self._workspace = workspace
        self._texts = texts

    def read(self, name: str) -> str:
        """The text of a file; raises `RefusalError` where there is none."""
        return self._texts[name] if name in self._texts else self._workspace.read(name).text

    def include(self, name: str, including: str) -> tuple[str, str]:
        """The file that an `#include` names, without regard to case where only one fits."""
        place = posixpath.normpath(posixpath.join(posixpath.dirname(including), name.replace("\\", "/")))
        folder, base = posixpath.split(place)
        found = posixpath.join(folder, fitting(base, self._names(folder)) or base)
        return found, self._included(found)

    def program_of(self, path: str) -> str:
        """The program in the folder of `path` that includes it; `path` itself where none does."""
        folder, base = posixpath.split(path)
        names = [name for name in self._names(folder) if posixpath.splitext(name)[1].lower() in SOURCES]
        if len(names) > MOST_NEIGHBOURS:
            return path
        programs = programs_with(base, names, lambda name: self._included(posixpath.join(folder, name)))
        return posixpath.join(folder, next(programs, base))

    def _included(self, name: str) -> str:
        try:
            return self.read(name)
        except wire.RefusalError as error:
            raise FileNotFoundError(str(error)) from error

    def _names(self, folder: str) -> list[str]:
        """The files in a folder, those among the pages that are not on disk included."""
        pages = [base for parent, base in map(posixpath.split, self._texts) if parent == folder]
        return sorted({*pages, *self._workspace.names(folder)})


def identity(program: Sequence[Instruction]) -> str:
    """The same text for the same instructions."""
    digest = blake2b(digest_size=12)
    for instruction in program:
        digest.update(pack_record(instruction))
    return digest.hexdigest()


def _listing(path: str, assembly: Assembly) -> wire.Listing:
    lines = [
        wire.ListingLine(
            address, code.location.file, code.location.line, pack_record(instruction).hex(" "),
            format_instruction(instruction),
        )
        for address, code in enumerate(assembly.code)
        if (instruction := code.instruction) is not None
    ]  # fmt: skip
    symbols = [
        wire.SymbolShape(symbol.name, symbol.kind, f"{symbol.value:.12g}")
        for symbol in assembly.symbols.values()
    ]  # fmt: skip
    return wire.Listing(path, identity(assembly.program), lines, symbols)


def problem(item: Diagnostic) -> wire.Problem:
    """A diagnostic as pages get it."""
    file, line, column, end = item.location
    place = wire.SourceRange(file, line, column, line, end)
    return wire.Problem(place, item.severity, item.code, item.text)
