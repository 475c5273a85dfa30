"""`tmcm34x settings`: dump, load, diff, store."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from tmcm34x.cli import CliError
from tmcm34x.cli.host.common import (
    FILE,
    REFUSED,
    confirm,
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
from tmcm34x.cli.outputs import TEXT_OUT

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tmcm34x.host.connection import Connection
    from tmcm34x.host.settings import Failure, Settings


@click.group()
def command() -> None:
    """Save, load, compare and store parameters, user variables and coordinates of a module, as a text file.

    Files are TOML, or TMCL source where their name ends in .tmc. What could cut the line (address, bit rate, CAN
    identifiers) or wipe the program is left out; `tmcm34x backup` has all of it.
    """


@command.command()
@click.argument("file", type=TEXT_OUT, default="-")
@port_option
def dump(file: Path, url: str | None) -> int:
    """Read all settings in use and write them to FILE, or to standard output as TOML.

    The exit status is 1 where a value could not be read; the file then says which in its first line and at its end.
    """
    from tmcm34x.host import settings
    from tmcm34x.host.items import settings_items

    with opened(url) as connection:
        model, version = connection.run(settings.identify())
        with progress("reading") as show:
            readings = connection.run(settings.read(settings_items(model), show))
        show_retries(connection)
    write = settings.to_tmcl if file.suffix.lower() == ".tmc" else settings.to_toml
    text = write(model, version, readings)
    save(file, text)
    missing = settings.missing(readings)
    for line in missing:
        click.echo(f"not read: {line}", err=True)
    return 1 if missing else 0


@command.command()
@click.argument("file", type=FILE)
@other_model_option
@port_option
@yes_option
def load(file: Path, other_model: bool, url: str | None, yes: bool) -> int:
    """Set what FILE says. Axis parameters and user variables are set until power-off; `settings store` keeps them.

    Global parameters are stored at once. The exit status is 4 where the module refuses a value.
    """
    from tmcm34x.host import settings

    with opened(url) as connection:
        found = _parse(connection, file, other_model)
        stored = sum(item.table == "module" for item in found.values)
        confirm(connection, f"{len(found.values)} values are set, {stored} of them in the EEPROM", yes)
        with progress("setting") as show:
            failures = connection.run(settings.apply(found.values, show))
        click.echo(f"{len(found.values) - len(failures)} of {len(found.values)} values set")
        show_retries(connection)
    return _report(failures)


@command.command()
@click.argument("file", type=FILE)
@other_model_option
@port_option
@json_option
def diff(file: Path, other_model: bool, url: str | None, as_json: bool) -> int:
    """Show in what the module differs from FILE. The exit status is 1 where it does, or a value is not known."""
    from tmcm34x.host import settings
    from tmcm34x.host.reading import Value

    with opened(url) as connection:
        found = _parse(connection, file, other_model)
        with progress("reading") as show:
            readings = connection.run(settings.read(list(found.values), show))
        show_retries(connection)
    rows = [
        (item.path, number, readings[item].text)
        for item, number in found.values.items()
        if readings[item] != Value(number)
    ]
    if as_json:
        print_json([{"setting": path, "file": number, "module": text} for path, number, text in rows])
    else:
        for path, number, text in rows:
            click.echo(f"{path}: file {number}, module {text}")
        if not rows:
            click.echo("equal")
    return 1 if rows else 0


@command.command()
@click.argument("file", type=FILE, required=False)
@other_model_option
@port_option
@yes_option
def store(file: Path | None, other_model: bool, url: str | None, yes: bool) -> int:
    """Keep the present values in the EEPROM: all of them, or those that FILE names. FILE is not loaded."""
    from tmcm34x.host import settings
    from tmcm34x.host.items import settings_items

    with opened(url) as connection:
        model, _ = connection.run(settings.identify())
        items = settings_items(model) if file is None else list(_parse(connection, file, other_model).values)
        commands = len({item.store for item in items if item.store is not None})
        confirm(connection, f"{commands} present values are stored in the EEPROM", yes)
        with progress("storing") as show:
            failures = connection.run(settings.store(items, show))
        click.echo(f"{commands - len(failures)} of {commands} values stored")
        show_retries(connection)
    return _report(failures)


def _parse(connection: Connection, file: Path, other_model: bool) -> Settings:
    """What a file sets in this module, with a word about everything that is skipped."""
    from tmcm34x.host import settings

    model, _ = connection.run(settings.identify())
    found = settings.from_text(read_text(file), model, str(file))
    if found.model not in {None, model} and not other_model:
        raise CliError(
            f"{file}: settings of a TMCM-{found.model}, and the module is a TMCM-{model}; "
            "give --other-model to take them"
        )
    for name in found.skipped:
        click.echo(f"skipped: {name}", err=True)
    return found


def _report(failures: Sequence[Failure]) -> int:
    """Say what the module has refused; a reason that many values share is said once."""
    by_reason: dict[str, list[Failure]] = {}
    for failure in failures:
        by_reason.setdefault(failure.why.partition(": ")[2], []).append(failure)
    for reason, alike in by_reason.items():
        first = alike[0]
        if len(alike) == 1:
            click.echo(f"{first.item.path}: {first.why}", err=True)
        else:
            click.echo(f"{first.item.path} and {len(alike) - 1} more: {reason}", err=True)
    return REFUSED if failures else 0
