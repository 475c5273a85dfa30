"""Sources on disk, for all that assembles files: the tool chain itself opens none."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from tmcm34x import files
from tmcm34x.toolchain.assembler import IncludeReader
from tmcm34x.toolchain.encoding import decode
from tmcm34x.toolchain.includes import fitting

SOURCE_LIMIT: Final = 16 * 1024 * 1024
"""Bytes of the largest file that is taken for a source or an image."""


def read_bytes(path: Path) -> bytes:
    """The contents of a source or an image.  Raises `OSError`, or `ValueError` for a name that is none."""
    if path.stat().st_size > SOURCE_LIMIT:
        raise OSError(0, f"larger than {SOURCE_LIMIT >> 20} MB")
    return files.read_bytes(path)


def read_text(path: Path) -> str:
    """The text of a source in any encoding of TMCL files.  Raises `OSError` or `ValueError` where there is none."""
    return decode(read_bytes(path))[0]


def include_reader(include_path: Sequence[Path] = ()) -> IncludeReader:
    """Finds `#include` files beside the including file and then along `include_path`."""

    def read(name: str, from_file: str) -> tuple[str, str]:
        name = name.replace("\\", "/")
        for folder in (Path(from_file).parent, *include_path):
            path = _present(folder / name)
            if path is not None:
                return short_name(path), read_text(path)
        raise FileNotFoundError(2, "no such file here or on the include path")

    return read


def _present(path: Path) -> Path | None:
    """A file of this name, or the only one whose name is so without regard to case."""
    if path.is_file():
        return path
    try:
        name = fitting(path.name, DiskFiles().names(str(path.parent)))
    except ValueError:
        return None
    return None if name is None else path.parent / name


def short_name(path: Path) -> str:
    """The name by which a file is known, the same for each way to it."""
    resolved = files.real_path(path)
    here = Path.cwd()
    return str(resolved.relative_to(here) if resolved.is_relative_to(here) else resolved)


class DiskFiles:
    """The files on disk, for the language server."""

    def read(self, name: str) -> str:
        """The text of a source; an `OSError` or `ValueError` where there is none."""
        return read_text(Path(name))

    def names(self, folder: str) -> Sequence[str]:
        """The names of the files in a folder; none where it cannot be read."""
        try:
            return sorted(path.name for path in Path(folder).iterdir() if path.is_file())
        except OSError:
            return ()
