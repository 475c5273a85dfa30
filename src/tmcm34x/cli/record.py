"""`tmcm34x record`: telegrams between hosts and a module, recorded as they pass."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tmcm34x.cli import CliError
from tmcm34x.cli.link_options import TcpAddress, make_links, make_ptys
from tmcm34x.cli.signals import stop_on_signals

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from tmcm34x.capture.files import RecordingWriter
    from tmcm34x.capture.proxy import Tape
    from tmcm34x.links import Link

_EPILOG = """\b
Examples:
  tmcm34x record night.session --pty /tmp/module --to /dev/ttyUSB0
  tmcm34x record night.pcapng --tcp 17001 --to tcp://192.168.0.7:4001
  tmcm34x record night.log --to "can:socketcan:can0?reply=2"
  tmcm34x serve --tcp 17000 --record night.session     (a virtual module, with exact times)
"""


@click.command(epilog=_EPILOG)
@click.argument("out", type=click.Path(path_type=Path))
@click.option(
    "--to",
    "target",
    required=True,
    metavar="PORT",
    help="The module: a serial port, tcp://HOST:PORT, or a CAN bus to listen to, can:INTERFACE:CHANNEL?reply=2.",
)
@click.option(
    "--baud", type=click.IntRange(1), default=9600, show_default=True, help="Bits per second of serial ports."
)
@click.option(
    "--pty",
    "ptys",
    multiple=True,
    is_flag=False,
    flag_value="",
    metavar="[LINK]",
    help="A pseudo terminal for the host; LINK is a symbolic link to create.",
)
@click.option(
    "--serial",
    "serials",
    multiple=True,
    metavar="DEVICE",
    help="A second serial port, to which the host is connected.",
)
@click.option(
    "--tcp",
    "tcps",
    multiple=True,
    type=TcpAddress(),
    metavar="[HOST:]PORT",
    help="A socket for the host, on loopback by default.",
)
@click.option("--slcan", is_flag=True, help="The module's side is an SLCAN adapter; record frames.")
@click.option("--anonymous", is_flag=True, help="Leave out texts, and name lines by number.")
def command(out: Path, target: str, **options: Any) -> int:
    """Pass telegrams between hosts and a module, and record them in OUT.

    OUT is a session with times (.session), a file for Wireshark (.pcapng), a candump log (.log; frames only) or a text
    log (.hex).  Without --pty, --serial or --tcp a pseudo terminal is opened; a CAN bus is only listened to, and needs
    none.  Ends when interrupted, or when the module's side hangs up.
    """  # fmt: skip
    from tmcm34x.capture.files import RecordingWriter
    from tmcm34x.capture.latency import count
    from tmcm34x.capture.record import RecordingError

    try:
        with RecordingWriter(out, anonymous=options["anonymous"]) as recorder:
            status = asyncio.run(_record(recorder, target, options))
    except RecordingError as error:
        raise CliError(str(error)) from None
    click.echo(f"{out}: {count(recorder.count, 'record')}")
    return status


async def _record(recorder: RecordingWriter, target: str, options: dict[str, Any]) -> int:
    from tmcm34x.capture.proxy import Tape
    from tmcm34x.links import LinkOpenError

    loop = asyncio.get_running_loop()
    over: asyncio.Future[Exception | None] = loop.create_future()

    def end(error: Exception | None = None) -> None:
        if not over.done():
            over.set_result(error)

    loop.set_exception_handler(
        lambda _, context: end(context.get("exception", RuntimeError(context["message"])))
    )
    stop_on_signals(loop, end)
    open_lines = _open_bus if target.startswith("can:") else _open_lines
    try:
        close = await open_lines(Tape(recorder, end), target, options)
        error = await over
        await close()
    except LinkOpenError as problem:
        raise CliError(str(problem)) from None
    if isinstance(error, LinkOpenError):
        click.echo(f"tmcm34x record: {error}", err=True)
        return 1
    if error is not None:
        raise error
    return 0


async def _open_bus(tape: Tape, target: str, options: dict[str, Any]) -> Callable[[], Awaitable[None]]:
    """Listen to a CAN bus; returns what ends that."""
    from tmcm34x.capture.proxy import BusTap
    from tmcm34x.host.exceptions import LinkError as UrlError
    from tmcm34x.host.url import parse_url
    from tmcm34x.links.can import CanBusLink

    if any(options[name] for name in ("ptys", "serials", "tcps", "slcan")):
        raise click.UsageError(
            "a CAN bus is listened to: --pty, --serial, --tcp and --slcan are for other lines"
        )
    try:
        url = parse_url(target)
    except UrlError as error:
        raise CliError(str(error)) from None
    if url.can.reply is None:
        raise CliError(
            f"{target}: the identifier of replies distinguishes them from requests; reply=any does not"
        )
    interface, _, channel = url.target.partition(":")
    link = CanBusLink(interface, channel, url.can.bitrate)
    click.echo(f"ready {link.kind} {await link.open(BusTap(tape, url.can.reply).connect)}")
    return link.finish


async def _open_lines(tape: Tape, target: str, options: dict[str, Any]) -> Callable[[], Awaitable[None]]:
    """Put lines for hosts and the module's together; returns what closes all."""
    from tmcm34x.capture.proxy import Proxy, SlcanLog

    proxy = Proxy(tape, SlcanLog) if options["slcan"] else Proxy(tape)
    links = _links(options)
    close = await _open_module(proxy, target, options["baud"])
    for link in links:
        click.echo(f"ready {link.kind} {await link.open(proxy.connect)}")

    async def close_all() -> None:
        for link in links:
            link.close()
        close()

    return close_all


def _links(options: dict[str, Any]) -> list[Link]:
    """Where hosts come."""
    from tmcm34x.links.serial import SerialLink

    links: list[Link] = [SerialLink(device, options["baud"]) for device in options["serials"]]
    links += make_links(options)
    return links or make_ptys([""])


async def _open_module(proxy: Any, target: str, baud: int) -> Any:
    """Connect to the module; returns what closes the connection."""
    from tmcm34x.capture.proxy import open_serial, open_tcp
    from tmcm34x.links.serial import SerialLink

    address = target.removeprefix("tcp:").removeprefix("//")
    if address == target:
        link = SerialLink(target, baud)
        await open_serial(proxy, link)
        return link.close
    host, _, port = address.rpartition(":")
    if not port.isdecimal():
        raise CliError(f"{target}: expected a serial port or tcp://HOST:PORT")
    transport = await open_tcp(proxy, host.strip("[]") or "127.0.0.1", int(port))
    return transport.abort
