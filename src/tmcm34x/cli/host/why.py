"""`tmcm34x why`: why a motor does not turn."""

from __future__ import annotations

import click

from tmcm34x.cli.host.common import json_option, opened, port_option, print_json, show_retries
from tmcm34x.tmcl.commands import MOTORS


@click.command()
@click.argument("motor", type=click.IntRange(0, MOTORS - 1), required=False)
@click.option(
    "--drivers",
    is_flag=True,
    help="Read driver flags and load too; for them the module exchanges datagrams with its drivers.",
)
@port_option
@json_option
def command(motor: int | None, drivers: bool, url: str | None, as_json: bool) -> int:
    """Explain why MOTOR, or each motor, does not turn: a line for each reason, with the parameter and what changes it.

    The exit status is 1 where something could not be read, so that a reason may be missing.
    """
    from tmcm34x.host import settings, why

    shown: dict[int, tuple[why.Facts, list[why.Reason]]] = {}
    missing: list[str] = []
    with opened(url) as connection:
        model, _ = connection.run(settings.identify(in_download_mode=True))
        for each in range(MOTORS) if motor is None else (motor,):
            facts = connection.run(why.read(each, model, drivers=drivers))
            shown[each] = facts, why.reasons(facts)
            missing += [f"motor {each}: {line}" for line in why.unknown(facts)]
        show_retries(connection)
    if as_json:
        print_json({str(each): [reason._asdict() for reason in found] for each, (_, found) in shown.items()})
    else:
        for each, (facts, found) in shown.items():
            _show(each, bool(facts["actual_speed"]), [reason.line for reason in found])
    for line in missing:
        click.echo(f"not known: {line}", err=True)
    return 1 if missing else 0


def _show(motor: int, turning: bool, lines: list[str]) -> None:
    if turning:
        click.echo(f"motor {motor} turns")
    elif not lines:
        click.echo(
            f"motor {motor} stands, and the module shows no reason: check the motor's wiring and supply"
        )
    for line in lines:
        click.echo(f"motor {motor}: {line}")
