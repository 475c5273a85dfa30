"""Where commands write to: files, or standard output for `-`."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import click

from tmcm34x.cli import CliError


class _OutPath(click.Path):
    """The name of a file to write; a usage error for `-` where standard output cannot take it.

    texts: whether `-` is standard output
    """

    def __init__(self, *, texts: bool) -> None:
        super().__init__(dir_okay=False, allow_dash=True, path_type=Path)
        self._texts = texts

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The path, or a usage error."""
        if value == "":
            self.fail("an empty name: name a file", param, ctx)
        if is_standard_output(value) and not self._texts:
            self.fail("this is not written to standard output: name a file", param, ctx)
        return super().convert(value, param, ctx)


TEXT_OUT: Final = _OutPath(texts=True)
"""A file to write, or `-` for standard output."""
FILE_OUT: Final = _OutPath(texts=False)
"""A file to write, never standard output."""


def is_standard_output(path: Path | str | None) -> bool:
    """Whether the name of an output means standard output."""
    return path is not None and str(path) == "-"


def only_one(outputs: Mapping[str, object]) -> bool:
    """Whether one of some options goes to standard output; a usage error where several of them do.

    outputs: the options by their names on the command line; True is an option that prints to standard output by itself
    """
    dashes = [name for name, value in outputs.items() if value is True or value == Path("-")]
    if len(dashes) > 1:
        raise click.UsageError(
            f"{' and '.join(dashes)} both write to standard output; name a file for one of them"
        )
    return bool(dashes)


def write(path: Path, data: bytes) -> None:
    """Write a file, or to standard output; a `CliError` with one line where that cannot be."""
    if is_standard_output(path):
        sys.stdout.buffer.write(data)
        return
    try:
        path.write_bytes(data)
    except OSError as error:
        raise CliError(f"{path}: {error.strerror}") from None
