"""`tmcm34x lsp`: the language server for editors."""

from __future__ import annotations

import asyncio
import contextlib
from pathlib import Path

import click

from tmcm34x.cli import CliError, spare_the_collector
from tmcm34x.cli.source_files import include_option, model_option
from tmcm34x.editor.disk import DiskFiles


@click.command()
@click.option(
    "--stdio", is_flag=True, help="Serve one editor on standard input and output; this is the default."
)
@click.option(
    "--tcp", metavar="HOST:PORT", help="Serve editors on a TCP port instead; port 0 picks a free one."
)
@include_option
@model_option
def command(stdio: bool, tcp: str | None, include_path: tuple[Path, ...], model: str) -> None:
    """Serve the Language Server Protocol for TMCL sources."""
    if stdio and tcp is not None:
        raise CliError("--stdio and --tcp exclude each other")
    from tmcm34x.editor import sessions

    spare_the_collector()
    folders = [str(folder.resolve()) for folder in include_path]
    if tcp is None:
        sessions.serve_stdio(DiskFiles(), folders, int(model))
        return
    host, _, port = tcp.rpartition(":")
    if not port.isdecimal() or int(port) > 65535:
        raise CliError(f"--tcp {tcp}: not HOST:PORT")
    serving = sessions.serve_tcp(
        host.strip("[]") or "127.0.0.1", int(port), DiskFiles(), folders, int(model), ready=_tell
    )
    try:
        with contextlib.suppress(KeyboardInterrupt):
            asyncio.run(serving)
    except OSError as error:
        raise CliError(f"--tcp {tcp}: {error.strerror or error}") from None


def _tell(host: str, port: int) -> None:
    click.echo(f"ready lsp {host}:{port}")
