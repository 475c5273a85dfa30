"""Coverage of TMCL programs, summed over tests: what `pytest --tmcl-coverage` collects and writes.

A `Collector` takes what modules under test execute of programs that come from files.  It is `collector` while a test
run wants coverage; else nothing is counted.  Workers of pytest-xdist hand over what they collected as plain values.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from tmcm34x.files import real_path
from tmcm34x.firmware.program import AddressCounts
from tmcm34x.trace.coverage import Coverage, coverage, format_lcov, parse_lcov, summed, totals
from tmcm34x.trace.tracefile import page_beside, read_tracefile, write_tracefile

if TYPE_CHECKING:
    from tmcm34x.firmware.module import FirmwareModule
    from tmcm34x.toolchain.assembler import Assembly

TRACEFILE: Final = "coverage.info"


class Counting:
    """Counts what a module executes of a program, until `end`."""

    def __init__(self, module: FirmwareModule, assembly: Assembly, into: Collector) -> None:
        self._module = module
        self._assembly = assembly
        self._into = into
        self._counts = AddressCounts()
        module.program.count(self._counts)

    def end(self) -> None:
        """Add the counts to the collector, unless another program has come into the memory meanwhile."""
        self._module.program.count(None)
        program = self._assembly.program
        memory = self._module.program.memory
        if all(memory[address] == instruction for address, instruction in enumerate(program)):
            self._into.add(coverage(self._assembly, self._counts))
        else:
            self._into.replaced.add(self._into.name_of(self._assembly.file))


class Collector:
    """The coverage of all tests of a run.

    root: the folder from which files are named
    """

    def __init__(self, root: Path) -> None:
        self.root = real_path(root)
        self.coverage: Coverage = {}
        self.replaced: set[str] = set()
        """Programs that were not in the memory any more when their module was closed."""

    def count(self, module: FirmwareModule, assembly: Assembly) -> Counting:
        """Count what `module` executes of a program from now on."""
        return Counting(module, assembly, self)

    def add(self, counted: Coverage) -> None:
        """Add what one module executed."""
        named = {(self.name_of(file), line): counts for (file, line), counts in counted.items()}
        self.coverage = summed(self.coverage, named)

    def name_of(self, file: str) -> str:
        """A file as seen from the root folder, where it is in there."""
        path = real_path(file)
        return path.relative_to(self.root).as_posix() if path.is_relative_to(self.root) else str(path)

    # Between processes

    def save(self) -> dict[str, Any]:
        """Everything collected, as plain values."""
        return {"coverage": format_lcov(self.coverage), "replaced": sorted(self.replaced)}

    def load(self, saved: Mapping[str, Any]) -> None:
        """Add what another process collected."""
        self.coverage = summed(self.coverage, parse_lcov(saved["coverage"]))
        self.replaced.update(saved["replaced"])

    # Results

    def read(self, folder: Path) -> None:
        """Add what an earlier run has written.  Raises `CoverageError`, `UnicodeDecodeError`, `OSError`."""
        self.coverage = summed(self.coverage, read_tracefile(folder / TRACEFILE))

    def write(self, folder: Path) -> None:
        """Write the tracefile and its page.  Raises `OSError`."""
        write_tracefile(folder / TRACEFILE, self.coverage, self.root)

    def lines(self, folder: Path) -> Iterator[str]:
        """What was executed, as lines of text."""
        found = totals(self.coverage)
        width = max((len(total.file) for total in found), default=0)
        for total in found:
            commands = f"{total.executed:5} of {total.commands:5} commands"
            branches = f", {total.taken:4} of {total.branches:4} branches" if total.branches else ""
            yield f"{total.file:<{width}} {commands}{branches}"
        for name in sorted(self.replaced):
            yield f"{name}: not counted where another program had replaced it in the program memory"
        path = folder / TRACEFILE
        yield f"written: {path}, {page_beside(path)}" if found else "no program from a file was loaded"


collector: Collector | None = None
"""What collects the coverage of this test run; None where it is not asked for."""
