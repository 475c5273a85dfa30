"""Reading TMCL sources and images for commands, and printing what is wrong with them."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

import click

from tmcm34x.cli import CliError
from tmcm34x.editor import disk
from tmcm34x.editor.disk import SOURCE_LIMIT, DiskFiles, include_reader, short_name
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.toolchain.assembler import Assembly, assemble
from tmcm34x.toolchain.diagnostics import Diagnostic, render_all
from tmcm34x.toolchain.encoding import Encoding, EncodingError, decode
from tmcm34x.toolchain.image import ImageError, unpack_binary, unpack_hex
from tmcm34x.toolchain.includes import MOST_NEIGHBOURS, SOURCES, programs_with

PROGRAM_SUFFIXES: Final = frozenset({".tmc", ".tmcl"})
"""Files that stand for themselves in a folder."""
HEX_SUFFIXES: Final = frozenset({".hex", ".ihx", ".ihex"})
MODELS: Final = ("341", "342", "343")

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
        try:
            found = sorted(
                each for each in path.rglob("*") if each.suffix.lower() in PROGRAM_SUFFIXES and each.is_file()
            )
        except OSError as error:  # a folder that goes away meanwhile
            raise CliError(f"{error.filename or path}: {error.strerror}") from None
        if not found:
            raise CliError(f"{path}: no TMCL sources in this folder ({', '.join(sorted(PROGRAM_SUFFIXES))})")
        yield from found


def each(paths: Iterable[Path], action: Callable[[Path], int]) -> int:
    """The greatest exit status of an action on files; one that cannot be read does not keep it from the others."""
    status = 0
    for path in paths:
        try:
            status = max(status, action(path))
        except CliError as error:
            click.echo(f"{click.get_current_context().command_path}: {error.format_message()}", err=True)
            status = max(status, error.exit_code)
    return status


def is_folder(path: Path) -> bool:
    """Whether an argument names a folder; a name that the system refuses is reported when it is read."""
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
        return sys.stdin.buffer.read(SOURCE_LIMIT)
    try:
        return disk.read_bytes(path)
    except (OSError, ValueError) as error:
        raise CliError(f"{path}: {getattr(error, 'strerror', None) or error}") from None


def read_source(path: Path) -> tuple[str, Encoding]:
    """The text of a source file and how it is stored; a `CliError` with one line where it holds none."""
    try:
        return decode(read_bytes(path))
    except EncodingError as error:
        raise CliError(f"{path}: {error}") from None


def read_image(path: Path) -> tuple[Instruction, ...]:
    """The program in a binary image, or in an Intel HEX file by its suffix."""
    data = read_bytes(path)
    try:
        return unpack_hex(data.decode("latin-1")) if is_hex(path) else unpack_binary(data)
    except ImageError as error:
        raise CliError(f"{path}: {error}") from None


def is_hex(path: Path) -> bool:
    """Whether the suffix is one of Intel HEX."""
    return path.suffix.lower() in HEX_SUFFIXES


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
        read_source(path)[0],
        _short(path),
        include_reader(include_path),
        append_stop=append_stop,
        model=model,
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
    return short_name(path)
