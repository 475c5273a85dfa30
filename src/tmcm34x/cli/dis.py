"""`tmcm34x dis`: image to source."""

from __future__ import annotations

from pathlib import Path

import click

from tmcm34x.cli.outputs import TEXT_IN, TEXT_OUT, write
from tmcm34x.cli.source_files import (
    assemble_file,
    include_option,
    model_option,
    print_diagnostics,
    read_image,
)
from tmcm34x.toolchain.disassembler import disassemble, up_to_end_mark
from tmcm34x.toolchain.formatter import format_source
from tmcm34x.toolchain.likeness import disassemble_like


@click.command()
@click.argument("file", type=TEXT_IN)
@click.option(
    "-o",
    "--output",
    type=TEXT_OUT,
    default="-",
    metavar="OUT.tmc",
    help="Source to write; standard output without it.",
)
@click.option(
    "--end-mark", is_flag=True, help="Stop at the first opcode 0, which ends an upload from a module."
)
@click.option("--plain", is_flag=True, help="Leave out the comments that name parameters.")
@click.option(
    "--like", type=click.Path(dir_okay=False, path_type=Path), metavar="OLD.tmc",
    help="Take labels, constants and comments from this source where the code is the same.",
)  # fmt: skip
@include_option
@model_option
def command(
    *,
    file: Path,
    output: Path,
    end_mark: bool,
    plain: bool,
    like: Path | None,
    include_path: tuple[Path, ...],
    model: str,
) -> int:
    """Turn the image FILE (.bin, or Intel HEX as .hex) into source that assembles to the same image."""
    program = read_image(file)
    if end_mark:
        program = up_to_end_mark(program)
    if like is None:
        text = format_source(disassemble(program, explain=not plain))
    else:
        old = assemble_file(like, include_path, model=int(model))
        if not old.ok:
            print_diagnostics(old.diagnostics, old.sources)
            return 1
        text = format_source(disassemble_like(program, old))
    write(output, text.encode())
    return 0
