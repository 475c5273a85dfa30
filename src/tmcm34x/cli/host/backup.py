"""`tmcm34x backup`, `restore`, `clone`, `compare`: whole modules."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import click

from tmcm34x.cli import CliError
from tmcm34x.cli.host.common import (
    FILE,
    REFUSED,
    confirm,
    dry_run_option,
    host_errors,
    json_option,
    opened,
    other_model_option,
    port_option,
    print_json,
    progress,
    read_text,
    save,
    show_retries,
    yes_option,
)
from tmcm34x.cli.outputs import TEXT_OUT, is_standard_output

if TYPE_CHECKING:
    from tmcm34x.host.backup import Backup, RowDifference
    from tmcm34x.host.connection import Connection

_SHOWN: Final = 40
_RECALL: Final = (
    "stored values are read by putting each into use for a moment (RSAP) and setting the present one again; where the "
    "two differ the motor's current or microsteps change for that moment"
)
_PORT: Final = re.compile(r"\A(serial|tcp|can|slcan|virtual|[a-z0-9+]+://)[:/]?|\A(/dev/|COM\d+)|:\d+\Z")

in_use_option = click.option(
    "--in-use-only",
    is_flag=True,
    help="Do not read the stored values; the backup then says that it is not complete.",
)
keep_address_option = click.option(
    "--keep-address",
    is_flag=True,
    help="Leave address, bit rate and the other communication settings of the module as they are.",
)


@click.command()
@click.argument("file", type=TEXT_OUT)
@in_use_option
@port_option
@yes_option
def backup(file: Path, in_use_only: bool, url: str | None, yes: bool) -> int:
    """Save everything that the module keeps in FILE, or write it to standard output for -: TOML, for version control.

    Settings in use and stored ones apart, user variables, coordinates, driver chain, microstep table and the program.
    The exit status is 1, and the first line of FILE says so, where something could not be read. A FILE with a complete
    backup is then left alone, and the new one goes beside it.
    """
    with opened(url) as connection:
        if not in_use_only:
            confirm(connection, _RECALL, yes)
        found = _read(connection, "backing up", stored=not in_use_only)
    from tmcm34x.host.backup import to_text

    target = _beside(file) if not found.complete and _is_complete(file) else file
    save(target, to_text(found))
    if target != file:
        click.echo(f"{file}: holds a complete backup, and is left as it is")
    return _say_complete(target, found)


def _is_complete(file: Path) -> bool:
    """Whether a file holds a backup from which nothing is missing."""
    try:
        return file.read_bytes().startswith(b"# Complete backup")
    except OSError:
        return False


def _beside(file: Path) -> Path:
    """The name of an incomplete backup beside a complete one."""
    return file.with_name(f"{file.stem}-incomplete{file.suffix}")


def _say_complete(file: Path, found: Backup) -> int:
    lines = [f"{file}: complete"]
    if not found.complete:
        lines = [f"{file}: INCOMPLETE, {len(found.not_read)} not read:"]
        lines += [f"  {line}" for line in found.not_read[:_SHOWN]]
    click.echo("\n".join(lines), err=is_standard_output(file))
    return 0 if found.complete else 1


@click.command()
@click.argument("file", type=FILE)
@keep_address_option
@other_model_option
@dry_run_option
@port_option
@yes_option
def restore(
    *, file: Path, keep_address: bool, other_model: bool, dry_run: bool, url: str | None, yes: bool
) -> int:
    """Bring the backup in FILE back into the module, and read everything back.

    The differences are shown first. The exit status is 1 where the module is not equal afterwards, 4 where it refused a
    value.
    """
    from tmcm34x.host.backup import from_text

    with host_errors():
        wanted = from_text(read_text(file), str(file))
    with opened(url) as connection:
        return _restore(connection, wanted, _How(keep_address, other_model, dry_run, yes))


@click.command()
@click.argument("source", metavar="FROM")
@click.argument("target", metavar="TO")
@keep_address_option
@other_model_option
@dry_run_option
@yes_option
def clone(
    *, source: str, target: str, keep_address: bool, other_model: bool, dry_run: bool, yes: bool
) -> int:
    """Make the module TO equal to FROM, a backup or another module, each named as with --port.

    It is `backup` and `restore` in one: the differences are shown first, and everything is read back. The exit status
    is 1 where the module is not equal afterwards, 4 where it refused a value.
    """
    _check_line(source, target, keep_address)
    wanted = _load(source, yes)
    if wanted.not_read:
        raise CliError(f"{source}: the backup is not complete: {wanted.not_read[0]}; nothing is written")
    with opened(target) as connection:
        return _restore(connection, wanted, _How(keep_address, other_model, dry_run, yes))


def _check_line(source: str, target: str, keep_address: bool) -> None:
    """Two modules on one line must not get one address."""
    if not (is_port(source) and is_port(target)) or keep_address:
        return
    from tmcm34x.host.url import parse_url

    with host_errors():
        lines = [parse_url(name)[:2] for name in (source, target)]
    if lines[0] == lines[1] and lines[0][0] != "virtual":
        raise CliError(
            "both modules are on one line and would have the same address: give --keep-address, or connect the second "
            "one to a port of its own"
        )


@click.command()
@click.argument("left", metavar="A")
@click.argument("right", metavar="B")
@json_option
@yes_option
def compare(left: str, right: str, as_json: bool, yes: bool) -> int:
    """Compare two modules or backups, row by row; A and B are files, or modules named as with --port.

    The exit status is 1 where they differ, or where something of one of them is not known.
    """
    from tmcm34x.host.backup import compare as compare_backups

    first, second = _load(left, yes), _load(right, yes)
    different = compare_backups(first, second)
    if as_json:
        print_json([row._asdict() for row in different])
        return 1 if different else 0
    _show(different, left, right)
    if not different:
        rows = len(first.present) + len(first.stored)
        click.echo(f"equal: {rows} values and {len(first.program or ())} instructions")
    return 1 if different else 0


def is_port(name: str) -> bool:
    """Whether a name is a module's rather than a file's; a link to a pseudo terminal may have any name."""
    path = Path(name)
    try:
        return path.is_char_device() or (_PORT.search(name) is not None and not path.is_file())
    except OSError:  # No name for a file; what opens it says why.
        return False


def _load(name: str, yes: bool) -> Backup:
    """A module or a file."""
    from tmcm34x.host.backup import from_text

    if not is_port(name):
        with host_errors():
            return from_text(read_text(Path(name)), name)
    with opened(name) as connection:
        confirm(connection, _RECALL, yes)
        return _read(connection, f"reading {name}")


def _read(connection: Connection, label: str, *, stored: bool = True) -> Backup:
    from tmcm34x.host import backup as backups

    with progress(label) as show:
        found = connection.run(backups.read(stored=stored, progress=show))
    show_retries(connection)
    return found


class _How(NamedTuple):
    """The options of `restore` and `clone`."""

    keep_address: bool
    other_model: bool
    dry_run: bool
    yes: bool


def _restore(connection: Connection, wanted: Backup, how: _How) -> int:
    from tmcm34x.host import restore as restores
    from tmcm34x.host.items import COMMUNICATION

    keep = COMMUNICATION if how.keep_address else ()
    confirm(connection, _RECALL, how.yes)
    present = _read(connection, "reading the module")
    wanted = _fitting(wanted, present.model, how.other_model)
    plan = restores.plan(wanted, present, keep)
    if not plan.differences:
        click.echo("equal already: nothing is written")
        return 0
    _show(plan.differences, "backup", "module")
    for line in plan.warnings:
        click.echo(line)
    if how.dry_run:
        click.echo(f"{len(plan.differences)} differences; nothing is written")
        return 1
    confirm(connection, f"{len(plan.differences)} differences are written, with the EEPROM", how.yes)
    with progress("restoring") as show:
        failures = connection.run(restores.restore(wanted, present, keep, show))
    for failure in failures:
        click.echo(f"{failure.item.path}: {failure.why}", err=True)
    return _say_equal(restores.unequal(wanted, _read(connection, "reading back"), keep), failures)


def _fitting(wanted: Backup, model: int, other_model: bool) -> Backup:
    """What of a backup the model takes.  Raises `CliError` where it is of another one and the user has not said so."""
    from tmcm34x.host.restore import for_model

    if model == wanted.model:
        return wanted
    if not other_model:
        raise CliError(
            f"the backup is of a TMCM-{wanted.model}, and the module is a TMCM-{model}; "
            "give --other-model to take what this model has too"
        )
    wanted, left_out = for_model(wanted, model)
    click.echo(f"left out, because a TMCM-{model} has other drivers: {', '.join(left_out)}")
    return wanted


def _say_equal(unequal: Sequence[RowDifference], failures: Sequence[Any]) -> int:
    if unequal:
        click.echo("NOT equal after the restore:")
        _show(unequal, "backup", "module")
    else:
        click.echo("read back: equal in every row; ASCII mode and automatic start act at the next power-on")
    return REFUSED if failures else 1 if unequal else 0


def _show(rows: Iterable[RowDifference], left: str, right: str) -> None:
    listed = list(rows)
    for row in listed[:_SHOWN]:
        click.echo(f"{row.path}: {left} {row.left}, {right} {row.right}")
    if len(listed) > _SHOWN:
        click.echo(f"and {len(listed) - _SHOWN} more")
