"""Options that say where hosts reach a virtual module: what `serve` and `ide` share."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Final

import click

from tmcm34x.cli import CliError
from tmcm34x.tmcl.numbers import GP

if TYPE_CHECKING:
    from tmcm34x.bench import Rig
    from tmcm34x.links import CanLink, Link
    from tmcm34x.links.faults import Fault
    from tmcm34x.server import Server
    from tmcm34x.server.control import Control

LOOPBACK: Final = "127.0.0.1"
LARGEST_PORT: Final = 65535
"""Of TCP."""
LOOPBACK_HOSTS: Final = frozenset({LOOPBACK, "localhost", "::1"})
"""Hosts that are reachable from this machine only."""


class TcpAddress(click.ParamType[tuple[str, int]]):
    """`[HOST:]PORT`, with an IPv6 address in brackets; loopback where no host is given."""

    name = "[HOST:]PORT"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[str, int]:
        """Take it apart."""
        host, _, port = value.rpartition(":")
        if not port.isdecimal() or int(port) > LARGEST_PORT:
            self.fail(f"{value!r} is not [HOST:]PORT with a port of 0 to {LARGEST_PORT}", param, ctx)
        return host.strip("[]") or LOOPBACK, int(port)


class CanAddress(click.ParamType[tuple[str, str]]):
    """`INTERFACE:CHANNEL`, as python-can names them."""

    name = "INTERFACE:CHANNEL"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[str, str]:
        """Take it apart."""
        interface, _, channel = value.partition(":")
        if not interface or not channel:
            self.fail(f"{value!r} is not INTERFACE:CHANNEL", param, ctx)
        return interface, channel


class FaultText(click.ParamType["Fault"]):
    """A fault of a line, as `links.faults` writes it."""

    name = "FAULT"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Fault:
        """Take it apart."""
        from tmcm34x.links.faults import FaultError, parse

        try:
            return parse(value)
        except FaultError as error:
            self.fail(str(error), param, ctx)


_OPTIONS: Final = (
    click.option(
        "--pty",
        "ptys",
        multiple=True,
        is_flag=False,
        flag_value="",
        metavar="[LINK]",
        help="Pseudo terminal; LINK is a symbolic link to create and to remove at the end.",
    ),
    click.option(
        "--tcp",
        "tcps",
        multiple=True,
        type=TcpAddress(),
        metavar="[HOST:]PORT",
        help="Telegrams over a socket, on loopback by default; port 0 picks one.",
    ),
    click.option(
        "--slcan",
        "slcans",
        multiple=True,
        is_flag=False,
        flag_value="",
        metavar="[LINK]",
        help="SLCAN adapter on a pseudo terminal, with the modules on its bus; LINK as with --pty.",
    ),
    click.option(
        "--can",
        "buses",
        multiple=True,
        type=CanAddress(),
        metavar="INTERFACE:CHANNEL",
        help="CAN bus of python-can, such as socketcan:can0, at the bit rate of the first module.",
    ),
)


def options(command: Callable[..., int]) -> Callable[..., int]:
    """Give a command the options `--pty`, `--tcp`, `--slcan` and `--can`."""
    for option in reversed(_OPTIONS):
        command = option(command)
    return command


control: Final = click.option(
    "--control",
    metavar="ADDRESS",
    help="Socket through which `tmcm34x bench` and other programs control the bench: [HOST:]PORT or a path "
    "(docs/control.md).",
)


def make_links(options: dict[str, Any]) -> list[Link]:
    """The serial lines that were asked for."""
    from tmcm34x.links.tcp import TcpLink

    return [
        *make_ptys(options["ptys"]),
        *(TcpLink(host, port) for host, port in options["tcps"]),
    ]


def make_ptys(paths: Sequence[str]) -> list[Link]:
    """Pseudo terminals, each with a symbolic link where a path is given."""
    if not paths:
        return []
    if sys.platform == "win32" or not _have_terminals():
        raise CliError(f"{_NO_TERMINALS}: use --tcp [HOST:]PORT or --serial DEVICE")
    from tmcm34x.links.posix.pty import PtyLink

    return [PtyLink(path or None) for path in paths]


_NO_TERMINALS: Final = "there are no pseudo terminals on this system"


def _have_terminals() -> bool:
    return importlib.util.find_spec("termios") is not None


def make_lines(options: dict[str, Any], modules: int) -> list[tuple[Link, int | None]]:
    """The serial lines that were asked for, each with the number of the one module on it, or None for all."""
    if options["each"]:
        return [(link, n) for n in range(modules) for link in make_links(_of_module(options, n))]
    links = make_links(options)
    if options["serials"]:
        from tmcm34x.links.serial import SerialLink

        links += [SerialLink(device, options["baud"]) for device in options["serials"]]
    if not (links or options["slcans"] or options["buses"]):
        links = make_ptys([""])
    return [(link, None) for link in links]


def _of_module(options: dict[str, Any], number: int) -> dict[str, Any]:
    """The options `--pty` and `--tcp` for one module of many."""
    if options["serials"] or not (options["ptys"] or options["tcps"]):
        raise click.UsageError("--each is for --pty and --tcp")
    if any(port + number > LARGEST_PORT for _, port in options["tcps"]):
        raise CliError(f"there are no ports above {LARGEST_PORT} for all modules: use a lower --tcp, or 0")
    return {
        "ptys": [path and f"{path}-{number}" for path in options["ptys"]],
        "tcps": [(host, port and port + number) for host, port in options["tcps"]],
    }


def make_can_links(options: dict[str, Any], rig: Rig) -> list[CanLink]:
    """The CAN buses that were asked for, at the bit rate of the first module."""
    if not options["slcans"] and not options["buses"]:
        return []
    from tmcm34x import clock
    from tmcm34x.links.can import CanBusLink
    from tmcm34x.tmcl.global_parameters import CAN_BIT_RATES

    bit_rate = CAN_BIT_RATES[rig.modules[0].eeprom.global_values[GP.CAN_BIT_RATE]]
    return [
        *_make_slcans(options["slcans"], lambda: rig.now // clock.MS),
        *(CanBusLink(interface, channel, bit_rate) for interface, channel in options["buses"]),
    ]


def _make_slcans(paths: Sequence[str], milliseconds: Callable[[], int]) -> list[CanLink]:
    if not paths:
        return []
    if sys.platform == "win32" or not _have_terminals():
        raise CliError(f"{_NO_TERMINALS}, and so no SLCAN adapters: use --can INTERFACE:CHANNEL")
    from tmcm34x.links.posix.slcan import SlcanLink

    return [SlcanLink(path or None, milliseconds) for path in paths]


async def open_links(
    server: Server, links: Sequence[tuple[Link, int | None]], can_links: Sequence[CanLink]
) -> list[str]:
    """Open them, serial ones each with the number of the one module on it or None; print and return where each is."""
    from tmcm34x.links import LinkOpenError

    ready: list[str] = []
    try:
        for link, only in links:
            ready.append(f"{link.kind} {await server.open(link, only)}")
            click.echo(f"ready {ready[-1]}")
        for can_link in can_links:
            ready.append(f"{can_link.kind} {await server.open_can(can_link)}")
            click.echo(f"ready {ready[-1]}")
    except LinkOpenError as error:
        raise CliError(str(error)) from error
    return ready


async def open_control(server: Server, control: Control) -> str:
    """Open the control socket, which is closed with the links of `server`; print and return where it is."""
    from tmcm34x.links import LinkOpenError

    server.on_close.append(control.close)

    try:
        ready = f"control {await control.open()}"
    except LinkOpenError as error:
        raise CliError(str(error)) from error
    click.echo(f"ready {ready}")
    return ready
