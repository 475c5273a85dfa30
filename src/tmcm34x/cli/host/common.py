"""What all commands that talk to a module share: the port, questions before something acts, errors, progress."""

from __future__ import annotations

import contextlib
import json
import os
import sys
from collections.abc import Callable, Generator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from tmcm34x.cli import CliError
from tmcm34x.cli.outputs import is_standard_output

if TYPE_CHECKING:
    from tmcm34x.host.connection import Connection

ENVIRONMENT: Final = "TMCM34X_PORT"
NO_REPLY: Final = 3
REFUSED: Final = 4


def complete_port(_: click.Context, __: click.Parameter, incomplete: str) -> list[str]:
    """What a URL may begin with: the serial ports of this computer, and the other kinds of lines."""
    from tmcm34x.host.scan import serial_ports

    known = (
        *serial_ports(),
        "serial:",
        "tcp:",
        "can:",
        "slcan:",
        "virtual:341",
        "virtual:342",
        "virtual:343",
    )
    return [name for name in known if name.startswith(incomplete)]


port_option = click.option(
    "--port",
    "url",
    metavar="URL",
    envvar=ENVIRONMENT,
    shell_complete=complete_port,
    help="The module, such as serial:/dev/ttyUSB0?baud=9600&address=1, tcp:HOST:PORT, can:socketcan:can0?id=1&reply=2, "
    f"slcan:/dev/ttyACM0?id=1, virtual:343; by default the environment variable {ENVIRONMENT}.",
)
json_option = click.option("--json", "as_json", is_flag=True, help="Print JSON for scripts.")
yes_option = click.option("--yes", is_flag=True, help="Do not ask before motors move or memory is written.")
other_model_option = click.option(
    "--other-model",
    is_flag=True,
    help="Take a file of another model; what this one does not have is left out.",
)
dry_run_option = click.option(
    "--dry-run",
    is_flag=True,
    help="Only show what is different: write nothing, and exit with 1 where something would be written.",
)
FILE: Final = click.Path(dir_okay=False, path_type=Path)


class SilentModuleError(CliError):
    """A module that does not reply, or a line that is gone."""

    exit_code = NO_REPLY


class RefusingModuleError(CliError):
    """A module that refuses."""

    exit_code = REFUSED


@contextlib.contextmanager
def host_errors() -> Generator[None]:
    """Errors of the host library as one line and an exit status."""
    from tmcm34x.host import exceptions

    try:
        yield
    except (exceptions.FileError, exceptions.RangeError) as error:
        raise CliError(str(error)) from error
    except exceptions.ReplyError as error:
        raise SilentModuleError(str(error)) from error
    except exceptions.LostLinkError as error:
        raise SilentModuleError(str(error)) from error
    except exceptions.LinkError as error:
        raise CliError(str(error)) from error
    except exceptions.HostError as error:
        raise RefusingModuleError(str(error)) from error


@contextlib.contextmanager
def opened(url: str | None) -> Generator[Connection]:
    """The connection to a module.  Raises `CliError`."""
    from tmcm34x.host.connection import Connection

    if not url:
        raise CliError(
            f"name the module with --port or {ENVIRONMENT}, such as serial:/dev/ttyUSB0?baud=9600&address=1 "
            "(`tmcm34x scan` finds modules)"
        )
    with host_errors(), Connection.open(url) as connection:
        yield connection


def confirm(connection: Connection, what: str, yes: bool) -> None:
    """Ask before something acts on a module that may be real.  Raises `CliError` where no terminal is there to ask."""
    if yes or not connection.line.real:
        return
    click.echo(f"{connection.line.name}: {what}", err=True)
    if not sys.stdin.isatty():
        raise CliError("not done: give --yes to do it without being asked")
    if not click.confirm("Go on?", err=True):
        raise click.Abort


@contextlib.contextmanager
def progress(label: str) -> Generator[Callable[[int, int], None]]:
    """A progress bar on a terminal's standard error; nothing elsewhere."""
    if not sys.stderr.isatty():
        yield lambda done, total: None
        return
    with click.progressbar(length=1, label=label, file=sys.stderr) as bar:

        def show(done: int, total: int) -> None:
            bar.length = max(total, 1)
            bar.update(done - bar.pos)

        yield show


def show_retries(connection: Connection) -> None:
    """Say how good the line was, where it was not."""
    counts = connection.counts
    if counts.retried or counts.garbled or counts.late or counts.misdirected:
        click.echo(
            f"line: {counts.sent} telegrams, {counts.retried} sent again, {counts.garbled} damaged replies, "
            f"{counts.late} late, {counts.misdirected} for another host",
            err=True,
        )


def print_json(value: Any) -> None:
    """A value for scripts."""
    click.echo(json.dumps(value, indent=2))


def save(path: Path, text: str) -> None:
    """Write a file, whole or not at all: a full disk leaves the old one as it was; or to standard output.

    A link stays one.  Raises `CliError`.
    """
    import tempfile

    from tmcm34x.files import followed

    if is_standard_output(path):
        click.echo(text, nl=False)
        return
    temporary = ""
    try:
        place = followed(path)
        descriptor, temporary = tempfile.mkstemp(dir=place.parent, prefix=f".{place.name}.")
        with os.fdopen(descriptor, "w", encoding="utf-8", newline="\n") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        Path(temporary).chmod(0o644)
        Path(temporary).replace(place)
    except OSError as error:
        with contextlib.suppress(OSError):
            if temporary:
                Path(temporary).unlink(missing_ok=True)
        raise CliError(f"{path}: {error.strerror}; nothing is saved") from error


def read_text(path: Path) -> str:
    """The text of a file, in any encoding that sources may have.  Raises `CliError`."""
    from tmcm34x import files
    from tmcm34x.toolchain.encoding import EncodingError, decode

    try:
        text, _ = decode(files.read_bytes(path))
    except OSError as error:
        raise CliError(f"{path}: {error.strerror}") from error
    except EncodingError as error:
        raise CliError(f"{path}: {error}") from error
    return text.replace("\r\n", "\n").replace("\r", "\n")
