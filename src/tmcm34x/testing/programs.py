"""TMCL programs: assembled for modules under test, and run to their end."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from tmcm34x.bench.run import Run
from tmcm34x.clock import clocks
from tmcm34x.editor import disk
from tmcm34x.testing.errors import WrongUseError
from tmcm34x.testing.rigs import make_rig
from tmcm34x.toolchain.assembler import Assembly, assemble
from tmcm34x.toolchain.diagnostics import render_all

if TYPE_CHECKING:
    from tmcm34x.firmware.module import FirmwareModule
    from tmcm34x.testing.coverage import Counting


def assemble_source(source: str | Path, model: int = 343) -> Assembly:
    """The program in source text, or in the file at a path.  Raises `ValueError` with its diagnostics.

    model: 341, 342 or 343, which `#if MODEL == 342` asks
    """
    assembly = _assemble(source, model)
    if not assembly.ok:
        raise WrongUseError(render_all(assembly.diagnostics, assembly.sources).rstrip())
    return assembly


def _assemble(source: str | Path, model: int) -> Assembly:
    if isinstance(source, str):
        return assemble(source, "program", model=model)
    return assemble(disk.read_text(source), str(source), disk.include_reader(), model=model)


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
    rig = make_rig(model, bench, seed)
    module = rig.modules[0]
    assembly = assemble_source(source, module.board.model.number)
    module.eeprom.write_program(assembly.program)
    counting = counting_of(source, module, assembly)
    run = Run(rig)
    run.start()
    run.go(None if limit_s is None else rig.now + clocks(limit_s))
    if counting is not None:
        counting.end()
    return run


def counting_of(source: str | Path, module: FirmwareModule, assembly: Assembly) -> Counting | None:
    """Counts what a module executes of a program from a file, where the coverage of this test run is wanted."""
    from tmcm34x.testing.coverage import collector

    return collector.count(module, assembly) if collector is not None and isinstance(source, Path) else None
