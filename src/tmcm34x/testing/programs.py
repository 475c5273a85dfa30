"""TMCL programs: assembled for modules under test, and run to their end."""

from __future__ import annotations

from pathlib import Path

from tmcm34x.bench.run import Run
from tmcm34x.clock import clocks
from tmcm34x.editor import disk
from tmcm34x.testing.rigs import make_rig
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
    return assemble(disk.read_text(source), str(source), disk.include_reader())


def run_program(
    source: str | Path,
    *,
    model: int | None = None,
    bench: str | Path | None = None,
    limit_s: float | None = None,
    seed: int = 0,
) -> Run:
    """Run a stand-alone program in virtual time to its end; the run tells why it ended and what was refused.

    source: TMCL source text, or the `Path` of a file
    model: 341, 342 or 343; the bench's own, or a 343, when None
    bench: path of a bench file, or its text; bare motors when None
    limit_s: seconds after which the run ends at the latest
    seed: of everything random, without a bench
    Raises `ValueError` for a program that cannot be assembled, `BenchError`, `OSError`.
    """
    program = assemble_source(source)
    rig = make_rig(model, bench, seed)
    rig.modules[0].eeprom.write_program(program)
    run = Run(rig)
    run.start()
    run.go(None if limit_s is None else rig.now + clocks(limit_s))
    return run
