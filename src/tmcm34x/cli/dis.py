"""`tmcm34x dis`: image to source."""

from __future__ import annotations

from pathlib import Path

import click

from tmcm34x.cli.source_files import read_image, write
from tmcm34x.toolchain.disassembler import disassemble, up_to_end_mark
from tmcm34x.toolchain.formatter import format_source

_PATH = click.Path(dir_okay=False, path_type=Path)


@click.command()
@click.argument("file", type=click.Path(dir_okay=False, allow_dash=True, path_type=Path))
@click.option(
    "-o", "--output", type=_PATH, metavar="OUT.tmc", help="Source to write; standard output without it."
)
@click.option(
    "--end-mark", is_flag=True, help="Stop at the first opcode 0, which ends an upload from a module."
)
@click.option("--plain", is_flag=True, help="Leave out the comments that name parameters.")
def command(file: Path, output: Path | None, end_mark: bool, plain: bool) -> None:
    """Turn the image FILE (.bin, or Intel HEX as .hex) into source that assembles to the same image."""
    program = read_image(file)
    if end_mark:
        program = up_to_end_mark(program)
    text = format_source(disassemble(program, explain=not plain))
    if output is None:
        click.echo(text, nl=False)
    else:
        write(output, text.encode())
