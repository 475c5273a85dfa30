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

LOOPBACK: Final = "127.0.0.1"
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
        if not port.isdecimal() or int(port) > 65535:
            self.fail(f"{value!r} is not [HOST:]PORT with a port of 0 to 65535", param, ctx)
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
        help="CAN adapter that speaks SLCAN on a pseudo terminal, with the modules on its bus; LINK as with --pty.",
    ),
    click.option(
        "--can",
        "buses",
        multiple=True,
        type=CanAddress(),
        metavar="INTERFACE:CHANNEL",
        help="CAN bus that python-can knows, such as socketcan:can0, at the bit rate of the first module.",
    ),
)


def options(command: Callable[..., int]) -> Callable[..., int]:
    """Give a command the options `--pty`, `--tcp`, `--slcan` and `--can`."""
    for option in reversed(_OPTIONS):
        command = option(command)
    return command


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


async def open_links(server: Server, links: Sequence[Link], can_links: Sequence[CanLink]) -> list[str]:
    """Open them, print where each is, and give that back."""
    from tmcm34x.links import LinkError

    ready: list[str] = []
    try:
        for link in links:
            ready.append(f"{link.kind} {await server.open(link)}")
            click.echo(f"ready {ready[-1]}")
        for can_link in can_links:
            ready.append(f"{can_link.kind} {await server.open_can(can_link)}")
            click.echo(f"ready {ready[-1]}")
    except LinkError as error:
        raise CliError(str(error)) from error
    return ready
