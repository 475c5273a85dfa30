"""`tmcm34x fmt`: sources in columns."""

from __future__ import annotations

from pathlib import Path

import click

from tmcm34x.cli.source_files import read_source, write
from tmcm34x.toolchain.formatter import format_source


@click.command()
@click.argument(
    "files", nargs=-1, required=True, metavar="FILE...", type=click.Path(dir_okay=False, path_type=Path)
)
@click.option("--check", is_flag=True, help="Change nothing; exit with status 1 when a file would change.")
def command(files: tuple[Path, ...], check: bool) -> int:
    """Lay TMCL sources out in columns: labels, mnemonics, operands, comments."""
    texts = [(path, read_source(path)) for path in files]
    changed = [(path, formatted) for path, text in texts if (formatted := format_source(text)) != text]
    for path, formatted in changed:
        if check:
            click.echo(f"{path}: not in columns", err=True)
        else:
            write(path, formatted.encode())
            click.echo(f"{path}: formatted")
    return 1 if check and changed else 0
