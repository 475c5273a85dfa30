"""Reading TMCL sources and images for commands, and telling what is wrong with them.

The tool chain itself opens no files; what it needs to read comes through `include_reader`.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

import click

from tmcm34x import files
from tmcm34x.cli import CliError
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.toolchain.assembler import Assembly, IncludeReader, assemble
from tmcm34x.toolchain.diagnostics import Diagnostic, render_all
from tmcm34x.toolchain.encoding import Encoding, EncodingError, decode
from tmcm34x.toolchain.image import ImageError, unpack_binary, unpack_hex
from tmcm34x.toolchain.includes import MOST_NEIGHBOURS, SOURCES, fitting, programs_with

PROGRAM_SUFFIXES: Final = frozenset({".tmc", ".tmcl"})
"""Files that stand for themselves in a folder."""
HEX_SUFFIXES: Final = frozenset({".hex", ".ihx", ".ihex"})
MODELS: Final = ("341", "342", "343")
_SOURCE_LIMIT: Final = 16 * 1024 * 1024
"""Bytes of the largest file that is taken for a source or an image."""

include_option = click.option(
    "-I", "--include", "include_path", multiple=True, metavar="DIR",
    type=click.Path(file_okay=False, path_type=Path),
    help="Look for #include files here too; may be given several times.",
)  # fmt: skip
append_stop_option = click.option(
    "--append-stop/--no-append-stop",
    default=True,
    show_default=True,
    help="Put a STOP at the end of a program that does not end with one, as the TMCL-IDE does.",
)
model_option = click.option(
    "--model",
    type=click.Choice(MODELS),
    default="343",
    show_default=True,
    help="The module the program is for.",
)


def sources(paths: Iterable[Path]) -> Iterator[Path]:
    """The files that arguments name: each folder's sources in the place of the folder."""
    for path in paths:
        if not is_folder(path):
            yield path
            continue
        found = sorted(
            each for each in path.rglob("*") if each.suffix.lower() in PROGRAM_SUFFIXES and each.is_file()
        )
        if not found:
            raise CliError(f"{path}: no TMCL sources in this folder ({', '.join(sorted(PROGRAM_SUFFIXES))})")
        yield from found


def is_folder(path: Path) -> bool:
    """Whether an argument names a folder; a name that the system does not take is left to whoever reads it."""
    try:
        return path.is_dir()
    except OSError:
        return False


def is_standard_input(path: Path) -> bool:
    """Whether an argument means standard input."""
    return str(path) == "-"


def read_bytes(path: Path) -> bytes:
    """The contents of a file, or of standard input for `-`; a `CliError` with one line where there are none."""
    if is_standard_input(path):
        return sys.stdin.buffer.read(_SOURCE_LIMIT)
    try:
        if path.stat().st_size > _SOURCE_LIMIT:
            raise CliError(f"{path}: larger than {_SOURCE_LIMIT >> 20} MB")
        return files.read_bytes(path)
    except (OSError, ValueError) as error:
        raise CliError(f"{path}: {getattr(error, 'strerror', None) or error}") from None


def write(path: Path, data: bytes) -> None:
    """Writes a file; a `CliError` with one line where that cannot be."""
    try:
        path.write_bytes(data)
    except OSError as error:
        raise CliError(f"{path}: {error.strerror}") from None


def read_source(path: Path) -> tuple[str, Encoding]:
    """The text of a source file and how it is stored; a `CliError` with one line where it holds none."""
    try:
        return decode(read_bytes(path))
    except EncodingError as error:
        raise CliError(f"{path}: {error}") from None


def read_text(name: str) -> str:
    """The text of an included file; an `OSError` or `ValueError` where there is none, for the tool chain to report."""
    path = Path(name)
    if path.stat().st_size > _SOURCE_LIMIT:
        raise OSError(0, f"larger than {_SOURCE_LIMIT >> 20} MB")
    return decode(path.read_bytes())[0]


def read_image(path: Path) -> tuple[Instruction, ...]:
    """The program in a binary image, or in an Intel HEX file by its suffix."""
    data = read_bytes(path)
    try:
        return unpack_hex(data.decode("latin-1")) if is_hex(path) else unpack_binary(data)
    except ImageError as error:
        raise CliError(f"{path}: {error}") from None


def is_hex(path: Path) -> bool:
    """Whether the name says Intel HEX."""
    return path.suffix.lower() in HEX_SUFFIXES


def include_reader(include_path: Sequence[Path] = ()) -> IncludeReader:
    """Finds `#include` files beside the including file and then along `include_path`."""

    def read(name: str, from_file: str) -> tuple[str, str]:
        name = name.replace("\\", "/")
        for folder in (Path(from_file).parent, *include_path):
            path = _present(folder / name)
            if path is not None:
                return _short(path), read_text(str(path))
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


class DiskFiles:
    """The files on disk, for the language server."""

    def read(self, name: str) -> str:
        """The text of a source; an `OSError` or `ValueError` where there is none."""
        return read_text(name)

    def names(self, folder: str) -> Sequence[str]:
        """The names of the files in a folder; none where it cannot be read."""
        try:
            return sorted(path.name for path in Path(folder).iterdir() if path.is_file())
        except OSError:
            return ()


def program_of(path: Path) -> Path:
    """The program in the folder that includes `path`; `path` itself where none does."""
    if is_standard_input(path):
        return path
    files = DiskFiles()
    names = [name for name in files.names(str(path.parent)) if Path(name).suffix.lower() in SOURCES]
    if len(names) > MOST_NEIGHBOURS:
        return path
    programs = programs_with(path.name, names, lambda name: files.read(str(path.parent / name)))
    return path.parent / next(programs, path.name)


def assemble_file(
    path: Path, include_path: Sequence[Path] = (), *, append_stop: bool = True, model: int = 343
) -> Assembly:
    """The assembly of a source file, its mistakes included; those are not printed."""
    return assemble(
        read_source(path)[0], _short(path), include_reader(include_path), append_stop=append_stop, model=model
    )


def read_program(
    path: Path, include_path: Sequence[Path] = (), *, append_stop: bool = True, model: int = 343
) -> tuple[Instruction, ...]:
    """The program in a source file or an image; mistakes are printed and end the command with status 1."""
    if path.suffix.lower() == ".bin" or is_hex(path):
        return read_image(path)
    assembly = assemble_file(path, include_path, append_stop=append_stop, model=model)
    if not assembly.ok:
        print_diagnostics(assembly.diagnostics, assembly.sources)
        raise click.exceptions.Exit(1)
    return assembly.program


def print_diagnostics(diagnostics: Iterable[Diagnostic], sources: Mapping[str, Sequence[str]]) -> None:
    """Diagnostics with their source lines on standard error."""
    click.echo(render_all(diagnostics, sources), err=True, nl=False)


def _short(path: Path) -> str:
    """The name by which a file is known, the same for each way to it."""
    if is_standard_input(path):
        return "standard input"
    resolved = path.resolve()
    here = Path.cwd()
    return str(resolved.relative_to(here) if resolved.is_relative_to(here) else resolved)
