"""`tmcm34x asm`: source to image, listing and symbol file."""

from __future__ import annotations

from pathlib import Path

import click

from tmcm34x.cli import CliError
from tmcm34x.cli.outputs import TEXT_IN, TEXT_OUT, default_output, is_standard_output, only_one, write
from tmcm34x.cli.source_files import (
    append_stop_option,
    assemble_file,
    include_option,
    is_hex,
    is_standard_input,
    model_option,
    print_diagnostics,
)
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.toolchain.formatter import format_source
from tmcm34x.toolchain.image import pack_binary, pack_hex
from tmcm34x.toolchain.linter import lint
from tmcm34x.toolchain.listing import listing, symbol_file
from tmcm34x.toolchain.structure import emit_tmcl


@click.command()
@click.argument("file", type=TEXT_IN)
@click.option(
    "-o", "--output", type=TEXT_OUT, metavar="OUT", help="Image to write: .bin, or Intel HEX as .hex."
)
@include_option
@click.option(
    "--listing",
    "listing_file",
    type=TEXT_OUT,
    metavar="FILE",
    help="Write addresses and bytes beside the source.",
)
@click.option(
    "--symbols", "symbols_file", type=TEXT_OUT, metavar="FILE", help="Write names with their values."
)
@click.option(
    "--emit-tmcl", "plain_file", type=TEXT_OUT, metavar="FILE",
    help="Write the program as one plain source: included files, #if and local labels resolved.",
)  # fmt: skip
@append_stop_option
@model_option
def command(
    *,
    file: Path,
    output: Path | None,
    include_path: tuple[Path, ...],
    listing_file: Path | None,
    symbols_file: Path | None,
    plain_file: Path | None,
    append_stop: bool,
    model: str,
) -> int:
    """Assemble FILE.

    FILE may be - for standard input, and OUT - for standard output. Without -o the image goes to FILE.bin. Mistakes go
    to standard error, all of them, and the exit status is 1; warnings about parameters that the model does not have are
    printed too and change nothing.
    """
    to_standard_output = only_one({
        "-o": output, "--listing": listing_file, "--symbols": symbols_file, "--emit-tmcl": plain_file,
    })  # fmt: skip
    assembly = assemble_file(file, include_path, append_stop=append_stop, model=int(model))
    warnings = tuple(item for item in lint(assembly, model=int(model)) if item.code == "W302")
    print_diagnostics((*assembly.diagnostics, *warnings), assembly.sources)
    if not assembly.ok:
        return 1
    program = assembly.program
    if output is None and is_standard_input(file):
        raise CliError("-: name the image with -o")
    target = output or default_output(file.with_suffix(".bin"), "-o")
    _write_image(target, program)
    if listing_file is not None:
        write(listing_file, listing(assembly).encode())
    if plain_file is not None:
        write(plain_file, format_source(emit_tmcl(assembly)).encode())
    if symbols_file is not None:
        write(symbols_file, symbol_file(assembly).encode())
    if is_standard_output(target):
        return 0
    appended = ", the last one an appended STOP" if assembly.code and assembly.code[-1].appended else ""
    click.echo(
        f"{target}: {len(program)} instruction{'s' * (len(program) != 1)}{appended}", err=to_standard_output
    )
    return 0


def _write_image(target: Path, program: tuple[Instruction, ...]) -> None:
    """Write the image in the form that its suffix names; `-` is standard output, in binary form."""
    write(target, pack_hex(program).encode() if is_hex(target) else pack_binary(program))
