"""`tmcm34x lint`: likely mistakes in sources."""

from __future__ import annotations

from pathlib import Path

import click

from tmcm34x.cli.source_files import (
    append_stop_option,
    assemble_file,
    include_option,
    model_option,
    print_diagnostics,
    program_of,
)
from tmcm34x.toolchain import linter


@click.command()
@click.argument(
    "files", nargs=-1, required=True, metavar="FILE...", type=click.Path(dir_okay=False, path_type=Path)
)
@include_option
@append_stop_option
@model_option
def command(*, files: tuple[Path, ...], include_path: tuple[Path, ...], append_stop: bool, model: str) -> int:
    """Point out likely mistakes in TMCL programs.

    Errors, warnings and information go to standard error; the exit status is 1 when there are errors or warnings.
    A comment `// lint: ignore W101` keeps a rule quiet on its line. A file that another one in its folder includes is
    judged as a part of that program.
    """
    severities: set[str] = set()
    for path in files:
        program = program_of(path)
        assembly = assemble_file(program, include_path, append_stop=append_stop)
        found = (*assembly.diagnostics, *linter.lint(assembly, model=int(model)))
        if program != path:
            found = tuple(item for item in found if Path(item.location.file).name == path.name)
        print_diagnostics(found, assembly.sources)
        severities.update(item.severity for item in found)
    return 1 if severities - {"information"} else 0
