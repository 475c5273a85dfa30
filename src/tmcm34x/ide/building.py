"""From source text to a program and its listing, with the editor's pages before the files on disk."""

from __future__ import annotations

import posixpath
from collections.abc import Mapping, Sequence
from hashlib import blake2b
from typing import TYPE_CHECKING, NamedTuple

from tmcm34x.ide import wire
from tmcm34x.tmcl.datagram import Instruction, pack_record
from tmcm34x.tmcl.mnemonic import format_instruction

if TYPE_CHECKING:
    from tmcm34x.ide.workspace import Workspace
    from tmcm34x.toolchain.assembler import Assembly
    from tmcm34x.toolchain.diagnostics import Diagnostic


class Built(NamedTuple):
    """What the assembler made: the answer for the page, and all that it found."""

    answer: wire.Assembled
    assembly: Assembly


def build(workspace: Workspace, path: str, texts: Mapping[str, str], model: int) -> Built:
    """Assemble and check `path`; `texts` stand before the files on disk."""
    from tmcm34x.toolchain.assembler import assemble
    from tmcm34x.toolchain.linter import lint

    def read(name: str) -> str:
        return texts[name] if name in texts else workspace.read(name).text

    def include(name: str, including: str) -> tuple[str, str]:
        found = posixpath.normpath(posixpath.join(posixpath.dirname(including), name.replace("\\", "/")))
        try:
            return found, read(found)
        except wire.RefusalError as error:
            raise FileNotFoundError(str(error)) from error

    assembly = assemble(read(path), path, include, append_stop=True, model=model)
    findings = (*assembly.diagnostics, *lint(assembly, model=model))
    listing = _listing(path, assembly) if assembly.ok else None
    lines = [code.location.line if code.location.file == path else 0 for code in assembly.code]
    return Built(wire.Assembled([_problem(item) for item in findings], listing, lines), assembly)


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


def _problem(item: Diagnostic) -> wire.Problem:
    file, line, column, end = item.location
    place = wire.Place(file, line, column, line, end)
    return wire.Problem(place, item.severity, item.code, item.text)
