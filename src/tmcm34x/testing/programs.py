"""TMCL programs for modules under test."""

from __future__ import annotations

from pathlib import Path

from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.toolchain.assembler import Assembly, assemble
from tmcm34x.toolchain.diagnostics import render_all


def assemble_source(source: str | Path) -> tuple[Instruction, ...]:
    """The program in source text, or in the file at a path.  Raises `ValueError` with its diagnostics."""
    assembly = _assemble(source)
    if not assembly.ok:
        raise ValueError(render_all(assembly.diagnostics, assembly.sources).rstrip())
    return assembly.program


def _assemble(source: str | Path) -> Assembly:
    if isinstance(source, str):
        return assemble(source, "program")

    def read(name: str, from_file: str) -> tuple[str, str]:
        path = Path(from_file).parent / name
        return str(path), path.read_text("utf-8")

    return assemble(source.read_text("utf-8"), str(source), read)
