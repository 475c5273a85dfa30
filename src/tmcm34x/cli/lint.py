"""`tmcm34x lint`: likely mistakes in sources."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from tmcm34x.cli import CliError
from tmcm34x.cli.source_files import (
    append_stop_option,
    assemble_file,
    each,
    include_option,
    model_option,
    print_diagnostics,
    program_of,
    sources,
)
from tmcm34x.toolchain import linter
from tmcm34x.toolchain.assembler import Assembly
from tmcm34x.toolchain.diagnostics import Diagnostic

_CODE = click.Choice(sorted(linter.RULES), case_sensitive=False)


def _explain(context: click.Context, _parameter: click.Parameter, code: str | None) -> None:
    from tmcm34x.toolchain.explanations import CODES, page, title

    if code is None:
        return
    if code.upper() not in CODES:
        raise CliError(
            f"--explain {code}: no such code; there are {CODES[0]} to {CODES[-1]}, see docs/lint.md"
        )
    click.echo(f"{code.upper()}: {title(code.upper())}\n\n{page(code.upper())}", nl=False)
    context.exit(0)


@click.command()
@click.argument("files", nargs=-1, required=True, metavar="FILE...", type=click.Path(path_type=Path))
@include_option
@append_stop_option
@model_option
@click.option(
    "--off",
    "off",
    multiple=True,
    type=_CODE,
    metavar="CODE",
    help="Turn a rule off; may be given several times.",
)
@click.option(
    "--on",
    "on",
    multiple=True,
    type=_CODE,
    metavar="CODE",
    help="Turn a rule on that is off; may be given several times.",
)
@click.option(
    "--explain", metavar="CODE", is_eager=True, expose_value=False, callback=_explain,
    help="Print what a diagnostic means, with an example and its cure.",
)  # fmt: skip
@click.option(
    "--map", "show_map", is_flag=True, help="Print calls, stack, times and variables of each program."
)
def command(
    *,
    files: tuple[Path, ...],
    include_path: tuple[Path, ...],
    append_stop: bool,
    model: str,
    off: tuple[str, ...],
    on: tuple[str, ...],
    show_map: bool,
) -> int:
    """Point out likely mistakes in TMCL programs.

    FILE may be a folder, for all .tmc and .tmcl files in it, or - for standard input. Errors, warnings and information
    go to standard error; the exit status is 1 when there are errors or warnings. A comment `// lint: ignore W101`
    suppresses a rule on its line, `// lint: off W101` in its program. A file that another one in its folder includes
    is judged as a part of that program.
    """
    rules = (linter.DEFAULT | frozenset(on)) - frozenset(off)
    shown: set[Diagnostic] = set()

    def show(path: Path) -> int:
        assembly, found = _judge(path, include_path, rules, append_stop=append_stop, model=int(model))
        print_diagnostics((item for item in found if item not in shown), assembly.sources)
        shown.update(found)
        if show_map:
            _print_map(assembly)
        return int(any(item.severity != "information" for item in found))

    return each(sources(files), show)


def _judge(
    path: Path, include_path: tuple[Path, ...], rules: frozenset[str], *, append_stop: bool, model: int
) -> tuple[Assembly, tuple[Diagnostic, ...]]:
    """The program that a file is or belongs to, and what is found in the file."""
    program = program_of(path)
    assembly = assemble_file(program, include_path, append_stop=append_stop, model=model)
    found = (*assembly.diagnostics, *linter.lint(assembly, model=model, rules=rules))
    if program != path:
        found = tuple(item for item in found if Path(item.location.file).name == path.name)
    return assembly, found


def _print_map(assembly: Assembly) -> None:
    from tmcm34x.toolchain.map import program_map

    if assembly.ok:
        sys.stdout.write(program_map(assembly))
