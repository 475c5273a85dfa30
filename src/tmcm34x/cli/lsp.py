"""`tmcm34x lsp`: the language server for editors."""

from __future__ import annotations

import asyncio
import contextlib
from pathlib import Path

import click

from tmcm34x.cli import CliError, spare_the_collector
from tmcm34x.cli.link_options import TcpAddress
from tmcm34x.cli.source_files import include_option, model_option
from tmcm34x.editor.disk import DiskFiles


@click.command()
@click.option(
    "--stdio", is_flag=True, help="Serve one editor on standard input and output; this is the default."
)
@click.option(
    "--tcp",
    type=TcpAddress(),
    metavar="[HOST:]PORT",
    help="Serve editors on a TCP port instead; port 0 picks a free one.",
)
@include_option
@model_option
def command(stdio: bool, tcp: tuple[str, int] | None, include_path: tuple[Path, ...], model: str) -> None:
    """Serve the Language Server Protocol for TMCL sources."""
    if stdio and tcp is not None:
        raise CliError("--stdio and --tcp exclude each other")
    from tmcm34x.editor import sessions

    spare_the_collector()
    folders = [str(folder.absolute()) for folder in include_path]
    if tcp is None:
        sessions.serve_stdio(DiskFiles(), folders, int(model))
        return
    host, port = tcp
    serving = sessions.serve_tcp(host, port, DiskFiles(), folders, int(model), ready=_tell)
    try:
        with contextlib.suppress(KeyboardInterrupt):
            asyncio.run(serving)
    except OSError as error:
        raise CliError(f"--tcp {host}:{port}: {error.strerror or error}") from None


def _tell(host: str, port: int) -> None:
    click.echo(f"ready lsp {host}:{port}")
