"""`tmcm34x fmt`: sources in columns."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from tmcm34x.cli.outputs import write
from tmcm34x.cli.source_files import each, is_standard_input, read_source, sources
from tmcm34x.toolchain.encoding import encode
from tmcm34x.toolchain.formatter import format_source, lexical_mistake


@click.command()
@click.argument("files", nargs=-1, required=True, metavar="FILE...", type=click.Path(path_type=Path))
@click.option("--check", is_flag=True, help="Change nothing; exit with status 1 when a file would change.")
def command(files: tuple[Path, ...], check: bool) -> int:
    """Lay TMCL sources out in columns: labels, mnemonics, operands, comments.

    FILE may be a folder, for all .tmc and .tmcl files in it, or - for standard input, which goes to standard output.

    A file keeps its encoding and line ends. One that holds words or characters which the language does not have is
    left as it is, with exit status 1: it may not be TMCL at all.
    """
    return each(sources(files), lambda path: _format(path, check=check))


def _format(path: Path, *, check: bool) -> int:
    """Lay one file out; the exit status."""
    text, encoding = read_source(path)
    line = lexical_mistake(text)
    if line is not None:
        click.echo(f"{path}:{line}: left as it is: not TMCL here; see tmcm34x lint", err=True)
        return 1
    formatted = format_source(text)
    if formatted != text and check:
        click.echo(f"{path}: not in columns", err=True)
        return 1
    if is_standard_input(path) and not check:
        sys.stdout.buffer.write(encode(formatted, encoding))
    elif formatted != text:
        write(path, encode(formatted, encoding))
        click.echo(f"{path}: formatted")
    return 0
