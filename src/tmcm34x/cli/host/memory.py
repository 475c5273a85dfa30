"""`tmcm34x download` and `upload`: the program memory of a module."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from tmcm34x.cli.host.common import (
    FILE,
    confirm,
    dry_run_option,
    opened,
    port_option,
    progress,
    show_retries,
    yes_option,
)
from tmcm34x.cli.outputs import TEXT_OUT, write
from tmcm34x.cli.source_files import append_stop_option, include_option, is_hex, read_program

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tmcm34x.host.connection import Connection
    from tmcm34x.tmcl.datagram import Instruction


@click.command()
@click.argument("file", type=FILE)
@click.option("--run", is_flag=True, help="Start the program afterwards.")
@click.option("--no-verify", is_flag=True, help="Do not read the program back.")
@include_option
@append_stop_option
@dry_run_option
@port_option
@yes_option
def download(
    *,
    file: Path,
    run: bool,
    no_verify: bool,
    include_path: tuple[Path, ...],
    append_stop: bool,
    dry_run: bool,
    url: str | None,
    yes: bool,
) -> int:
    """Store the program FILE, source or image (.bin, .hex), in the module, and read it back.

    A source is assembled for the module's model. It may be interrupted: the module leaves download mode.
    """
    from tmcm34x.host import program
    from tmcm34x.host.settings import identify

    with opened(url) as connection:
        model, _ = connection.run(identify(in_download_mode=True))
        instructions = read_program(file, include_path, append_stop=append_stop, model=model)
        if dry_run:
            return _show_differing(connection, instructions)
        confirm(connection, _what(connection, len(instructions), run), yes)
        with progress("downloading") as show:
            connection.run(
                program.download(
                    instructions,
                    verify=not no_verify,
                    progress=show,
                    tell=lambda line: click.echo(line, err=True),
                )
            )
        click.echo(f"{len(instructions)} instructions stored{'' if no_verify else ' and verified'}")
        show_retries(connection)
        if run:
            connection.run(program.restart())
            click.echo("program started")
    return 0


def _show_differing(connection: Connection, instructions: Sequence[Instruction]) -> int:
    """What a download would change."""
    from tmcm34x.host import program

    with progress("comparing") as show:
        count = connection.run(program.differing(instructions, progress=show))
    show_retries(connection)
    if not count:
        click.echo(f"the module holds these {len(instructions)} instructions already")
        return 0
    click.echo(f"{count} of {len(instructions)} instructions differ; nothing is written")
    return 1


def _what(connection: Connection, size: int, run: bool) -> str:
    """What a download does, with the program that is running now."""
    from tmcm34x.host import program
    from tmcm34x.host.exceptions import DownloadModeError
    from tmcm34x.host.steps import executing

    try:
        connection.run(executing())
        running = connection.run(program.state()).status == 1
    except DownloadModeError:
        running = False
    return (
        ("the running program is stopped; " if running else "")
        + f"the program memory is overwritten with {size} instructions"
        + (", and the program is started, which may move motors" if run else "")
    )


@click.command()
@click.option(
    "-o", "--output", type=TEXT_OUT, default="-", metavar="FILE",
    help="Where to: source as .tmc, an image as .bin or .hex; by default source on standard output.",
)  # fmt: skip
@click.option("--plain", is_flag=True, help="Leave out the comments that name parameters.")
@port_option
def upload(output: Path, plain: bool, url: str | None) -> int:
    """Read the program out of the module, up to its end mark."""
    from tmcm34x.host import program
    from tmcm34x.toolchain.disassembler import disassemble
    from tmcm34x.toolchain.formatter import format_source
    from tmcm34x.toolchain.image import pack_binary, pack_hex

    with opened(url) as connection:
        with progress("uploading") as show:
            instructions = connection.run(program.upload(progress=show))
        show_retries(connection)
    source = format_source(disassemble(instructions, explain=not plain)) if instructions else ""
    if is_hex(output):
        write(output, pack_hex(instructions).encode())
    elif output.suffix.lower() == ".bin":
        write(output, pack_binary(instructions))
    else:
        write(output, source.encode())
    click.echo(f"{len(instructions)} instructions", err=True)
    return 0
