"""`tmcm34x serve`: a virtual module on pseudo terminals, sockets and serial ports."""

from __future__ import annotations

import asyncio
import contextlib
import signal
import sys
from pathlib import Path
from typing import Any

import click

from tmcm34x import clock
from tmcm34x.bench import simple_rig
from tmcm34x.cli import CliError
from tmcm34x.firmware.storage import Eeprom, EepromError
from tmcm34x.links import Link, LinkError
from tmcm34x.links.pty import PtyLink
from tmcm34x.links.tcp import TcpLink
from tmcm34x.server import EepromFile, EepromFileError, Server, Store, TelegramLog
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.global_parameters import BAUD_RATES


class _TcpAddress(click.ParamType[tuple[str, int]]):
    """`[HOST:]PORT`, with an IPv6 address in brackets; loopback where no host is given."""

    name = "[HOST:]PORT"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[str, int]:
        host, _, port = value.rpartition(":")
        if not port.isdecimal() or int(port) > 65535:
            self.fail(f"{value!r} is not [HOST:]PORT with a port of 0 to 65535", param, ctx)
        return host.strip("[]") or "127.0.0.1", int(port)


_ADDRESS = click.IntRange(0, 255)
_EXAMPLES = """\b
Examples:
  tmcm34x serve --pty /tmp/tmcm343 --tcp 17000
  tmcm34x serve --tcp 0 --model 341 --eeprom spare.eeprom --speed 10
"""


@click.command(epilog=_EXAMPLES)
@click.option(
    "--model", type=click.Choice(["341", "342", "343"]), default="343", show_default=True, help="Module type."
)
@click.option("--address", type=_ADDRESS, help="Serial address of the module, instead of the stored one.")
@click.option("--host-address", type=_ADDRESS, help="Address in its replies, instead of the stored one.")
@click.option(
    "--pty",
    "ptys",
    multiple=True,
    is_flag=False,
    flag_value="",
    metavar="[LINK]",
    help="Pseudo terminal; LINK is a symbolic link to create and to remove at the end.",
)
@click.option(
    "--tcp",
    "tcps",
    multiple=True,
    type=_TcpAddress(),
    metavar="[HOST:]PORT",
    help="Telegrams over a socket, on loopback unless told otherwise; port 0 picks one.",
)
@click.option("--serial", "serials", multiple=True, metavar="DEVICE", help="A real serial port.")
@click.option(
    "--baud", type=click.IntRange(1), default=BAUD_RATES[0], show_default=True, help="Its bits per second."
)
@click.option(
    "--eeprom",
    type=click.Path(dir_okay=False),
    metavar="FILE",
    help="Image of the non-volatile memory; created when missing. Without it, memory lasts as long as the process.",
)
@click.option(
    "--program",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="TMCL program (source or .bin) to store in the program memory.",
)
@click.option("--run", is_flag=True, help="Start the stored program.")
@click.option(
    "--instruction-time",
    type=click.FloatRange(0, 1e6, min_open=True),
    default=100.0,
    show_default=True,
    metavar="US",
    help="Time that one TMCL instruction takes, in microseconds; the default is an assumption.",
)
@click.option(
    "--speed",
    type=click.FloatRange(0),
    default=1.0,
    show_default=True,
    metavar="FACTOR",
    help="Of virtual time: 1 is real time, 10 ten times as fast, 0.1 slow motion, 0 as fast as possible.",
)
@click.option("--seed", type=int, default=0, show_default=True, help="Of everything random.")
@click.option(
    "--log-telegrams",
    metavar="FILE",
    help="Write down every telegram with its time and meaning; - is the terminal.",
)
def command(**options: Any) -> int:
    """Serve a virtual module on serial ports and sockets.

    Prints one line for each link when it can be used, such as `ready pty /dev/pts/5`, and serves until it is
    interrupted.  Without a link, opens a pseudo terminal.
    """
    links = _make_links(options)
    model = int(options["model"])
    program = None if options["program"] is None else _read_program(options["program"])
    with contextlib.ExitStack() as stack:
        log = _open_log(options["log_telegrams"], stack)
        eeprom, stores = _open_eeprom(options["eeprom"], model, stack)
        if program is not None:
            eeprom.write_program(program)
        rig = simple_rig(
            model,
            eeprom,
            seed=options["seed"],
            address=options["address"],
            host_address=options["host_address"],
            instruction_clocks=max(1, round(options["instruction_time"] * 1e-6 * clock.HZ)),
        )
        if options["run"]:
            rig.modules[0].program.run(0)
        return asyncio.run(_serve(Server(rig, speed=options["speed"], stores=stores, log=log), links))


def _make_links(options: dict[str, Any]) -> list[Link]:
    links: list[Link] = [PtyLink(link or None) for link in options["ptys"]]
    links += [TcpLink(host, port) for host, port in options["tcps"]]
    if options["serials"]:
        from tmcm34x.links.serial import SerialLink

        links += [SerialLink(device, options["baud"]) for device in options["serials"]]
    return links or [PtyLink()]


def _read_program(path: Path) -> tuple[Instruction, ...]:
    """The program in a source file or an image."""
    from tmcm34x.cli.source_files import assemble_file, is_hex, print_diagnostics, read_image

    if path.suffix.lower() == ".bin" or is_hex(path):
        return read_image(path)
    assembly = assemble_file(path)
    if not assembly.ok:
        print_diagnostics(assembly.diagnostics, assembly.sources)
        raise click.exceptions.Exit(1)
    return assembly.program


def _open_eeprom(path: str | None, model: int, stack: contextlib.ExitStack) -> tuple[Eeprom, list[Store]]:
    """The memory, and what keeps it in its file if it has one; a new image is written at once."""
    if path is None:
        return Eeprom(model), []
    try:
        file = EepromFile(path)
        stack.callback(file.close)
        image = file.load()
        eeprom = Eeprom(model) if image is None else Eeprom.from_bytes(image)
        if image is None:
            file.save(eeprom.to_bytes())
    except EepromFileError as error:
        raise CliError(str(error)) from error
    except EepromError as error:
        raise CliError(f"{path}: {error}") from error
    if eeprom.model != model:
        raise CliError(f"{path}: EEPROM image of a TMCM-{eeprom.model}, not a TMCM-{model}")
    return eeprom, [Store(eeprom, file, _report)]


def _open_log(path: str | None, stack: contextlib.ExitStack) -> TelegramLog | None:
    if path is None:
        return None
    if path == "-":
        return TelegramLog(sys.stdout)
    try:
        return TelegramLog(stack.enter_context(Path(path).open("w", encoding="utf-8")))
    except OSError as error:
        raise CliError(f"{path}: {error.strerror}") from error


def _report(line: str) -> None:
    click.echo(f"tmcm34x serve: {line}", err=True)


async def _serve(server: Server, links: list[Link]) -> int:
    loop = asyncio.get_running_loop()
    stopped: asyncio.Future[None] = loop.create_future()

    def stop(error: Exception | None = None) -> None:
        if not stopped.done():
            stopped.set_exception(error) if error else stopped.set_result(None)

    # A bug must not be logged and forgotten: it ends the server.
    loop.set_exception_handler(
        lambda _, context: stop(context.get("exception", RuntimeError(context["message"])))
    )
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        loop.add_signal_handler(number, stop)
    try:
        for link in links:
            address = await server.open(link)
            click.echo(f"ready {link.kind} {address}")
        await stopped
    except LinkError as error:
        raise CliError(str(error)) from error
    finally:
        await server.close()
    return 0
