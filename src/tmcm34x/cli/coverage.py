"""`tmcm34x run --coverage` and `--profile`: the files and tables about what a program executed."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from tmcm34x.cli import CliError
from tmcm34x.trace.coverage import (
    Coverage,
    CoverageError,
    added,
    coverage,
    format_costs,
    line_costs,
    subroutine_costs,
)
from tmcm34x.trace.tracefile import read_tracefile, write_tracefile

if TYPE_CHECKING:
    from tmcm34x.firmware.module import FirmwareModule
    from tmcm34x.firmware.program import AddressCounts
    from tmcm34x.toolchain.assembler import Assembly

_MOST_LINES: Final = 20


def check(options: dict[str, Any], assembly: Assembly | None) -> Coverage:
    """What the tracefile counts so far; whatever cannot work is an error before the run."""
    path: Path | None = options["coverage_file"]
    if (path is not None or options["profile"]) and assembly is None:
        raise CliError(
            f"{options['file']}: coverage and profile need the source of the program, not an image"
        )
    if path is None:
        return {}
    if path.suffix.lower() == ".html":
        raise CliError(
            f"{path}: name the tracefile, such as {path.with_suffix('.info')}; the page goes beside it"
        )
    try:
        return read_tracefile(path)
    except (CoverageError, UnicodeDecodeError) as error:
        raise CliError(f"{path}: {error}; it is left as it is") from None
    except OSError as error:
        raise CliError(f"{path}: {error.strerror}") from None


def write(path: Path, assembly: Assembly, counts: AddressCounts, earlier: Coverage) -> None:
    """Write the tracefile, and the page beside it."""
    try:
        result = added(coverage(assembly, counts), earlier, assembly.left_out)
        write_tracefile(path, result, Path(), assembly.sources)
    except OSError as error:
        raise CliError(f"{error.filename}: {error.strerror}") from None


def profile(assembly: Assembly, counts: AddressCounts, module: FirmwareModule) -> str:
    """The tables of subroutines and lines."""
    clocks = module.instruction_clocks
    subroutines = subroutine_costs(assembly, counts, clocks)
    total = sum(cost.clocks for cost in subroutines)
    lines = line_costs(assembly, counts, clocks)[:_MOST_LINES]
    return "\n\n".join([
        "by subroutine, without those it calls", format_costs(subroutines, total),
        "by line, the most expensive first", format_costs(lines, total),
    ])  # fmt: skip
