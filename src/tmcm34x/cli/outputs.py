"""The files that commands read and write; `-` is standard input or output.

No file is both: what would write over an input, or over another output, is a usage error before anything is written.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import click

from tmcm34x.cli import CliError
from tmcm34x.files import real_path


class _InPath(click.Path):
    """The name of a file to read, which no output may have."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The path, or a usage error."""
        path: Any = super().convert(value, param, ctx)
        _claim(path, param, ctx)
        return path


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
        path: Any = super().convert(value, param, ctx)
        _claim(path, param, ctx)
        return path


def _claim(path: Path, param: click.Parameter | None, ctx: click.Context | None) -> None:
    """Note the file of an option or argument; a usage error if another one has it already and one of them writes it."""
    if ctx is None or param is None or is_standard_output(path) or not _is_plain(path):
        return
    claims: dict[Path, click.Parameter] = ctx.meta.setdefault(__name__, {})
    other = claims.setdefault(real_path(path), param)
    if other is not param and _OutPath in (type(other.type), type(param.type)):
        names = " and ".join(each.get_error_hint(ctx).replace("'", "") for each in (other, param))
        raise click.UsageError(f"{path} is both {names}: what is written needs a file of its own", ctx)


def default_output(path: Path, option: str) -> Path:
    """The name of a file to write where `option` names none; a usage error as if the option had it."""
    ctx = click.get_current_context()
    _claim(path, next(param for param in ctx.command.params if option in param.opts), ctx)
    return path


def _is_plain(path: Path) -> bool:
    """Whether writing to the path changes a file, not a device."""
    try:
        return path.is_file() or not path.exists()
    except (OSError, ValueError):
        return False


FILE_IN: Final = _InPath(dir_okay=False, path_type=Path)
"""A file to read."""
FILES_IN: Final = _InPath(path_type=Path)
"""A file to read, or a folder with such files."""
TEXT_IN: Final = _InPath(dir_okay=False, allow_dash=True, path_type=Path)
"""A file to read, or `-` for standard input."""
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
