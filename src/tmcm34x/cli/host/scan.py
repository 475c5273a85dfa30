"""`tmcm34x scan`: which modules are there."""

from __future__ import annotations

from contextlib import closing

import click

from tmcm34x.cli import CliError
from tmcm34x.cli.host.common import complete_port, host_errors, json_option, print_json, progress


@click.command()
@click.argument("ports", nargs=-1, metavar="[PORT]...", shell_complete=complete_port)
@click.option(
    "--baud", "bauds", multiple=True, type=int, help="Only this bit rate; may be given several times."
)
@click.option(
    "--address", "addresses", multiple=True, type=click.IntRange(0, 2047),
    help="Only this address or CAN identifier; may be given several times.",
)  # fmt: skip
@click.option(
    "--wait", "wait_s", type=click.FloatRange(0, 60), default=0.03, show_default=True, metavar="SECONDS",
    help="How long to wait for each reply, beside its time on the wire.",
)  # fmt: skip
@click.option("--first", is_flag=True, help="Stop at the first module.")
@json_option
def command(
    *,
    ports: tuple[str, ...],
    bauds: tuple[int, ...],
    addresses: tuple[int, ...],
    wait_s: float,
    first: bool,
    as_json: bool,
) -> int:
    """Look for modules on each PORT, all serial ports by default: bit rates, addresses 1 to 255, CAN identifiers.

    Only the version is asked for, which changes nothing. Likely rates and addresses come first. The exit status is 1
    where no module replies.
    """
    from tmcm34x.host import scan

    with host_errors():
        attempts = scan.plan(ports or scan.serial_ports(), addresses=addresses or scan.ADDRESSES, bauds=bauds)
        if not attempts:
            raise CliError("this computer has no serial port; name one, such as tcp:HOST:PORT")
        found: list[scan.Found] = []
        with (
            progress("scanning") as show,
            closing(
                scan.scan(
                    attempts,
                    lambda done, total, _: show(done, total),
                    lambda line: click.echo(line, err=True),
                    wait_s,
                )
            ) as modules,
        ):
            for module in modules:
                found.append(module)
                if not as_json:
                    click.echo(
                        f"{module.url}  TMCM-{module.model} {module.version}, address {module.address}"
                    )
                if first:
                    break
    if as_json:
        print_json([module._asdict() for module in found])
    elif not found:
        click.echo(
            "no module replies; check power and wiring, and that no other program uses the port", err=True
        )
    return 0 if found else 1
