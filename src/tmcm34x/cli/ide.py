"""`tmcm34x ide`: the TMCL-IDE in the browser."""

from __future__ import annotations

import asyncio
import secrets
import socket
import webbrowser
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from tmcm34x.cli import CliError, link_options, parameter_options, spare_the_collector
from tmcm34x.cli.signals import stop_on_signals

if TYPE_CHECKING:
    from tmcm34x.ide.target import Target
    from tmcm34x.ide.telegrams import Telegrams


PORT: Final = 8343
"""What a browser remembers of the IDE (layout, theme, unsaved texts) belongs to its port."""


_VIRTUAL: Final = ("bench", "model", "eeprom", "parameters", "ptys", "tcps", "slcans", "buses")
"""Options that say what a virtual module is."""
_EXAMPLES = """\b
Examples:
  tmcm34x ide examples
  tmcm34x ide conveyor.tmc --bench bench.toml
  tmcm34x ide --port /dev/ttyUSB0 --baud 9600
  tmcm34x ide --port tcp://127.0.0.1:17000
  tmcm34x ide program.tmc --tcp 17000 --pty /tmp/tmcm343
"""


@click.command(epilog=_EXAMPLES)
@click.argument("paths", nargs=-1, type=click.Path(exists=True, path_type=Path), metavar="[FILES or FOLDER]")
@click.option("--port", metavar="URL", help="A real module: serial device, or tcp://HOST:PORT.")
@click.option(
    "--baud", type=click.IntRange(1), default=9600, show_default=True, help="Bits per second of --port."
)
@click.option(
    "--address", type=click.IntRange(0, 255), default=1, show_default=True, help="Address of the module."
)
@click.option(
    "--model", type=click.Choice(["341", "342", "343"]), help="Virtual module type; a TMCM-343 otherwise."
)
@click.option(
    "--bench",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    metavar="FILE",
    help="What hangs on the virtual module.",
)
@click.option(
    "--eeprom", type=click.Path(dir_okay=False), metavar="FILE", help="Image of its non-volatile memory."
)
@click.option(
    "--listen",
    type=link_options.TcpAddress(),
    metavar="HOST:PORT",
    help=f"Where the browser finds the IDE; otherwise loopback and port {PORT}, or a free one where that is taken.",
)
@parameter_options.option
@link_options.options
@click.option("--no-browser", is_flag=True, help="Do not open a browser.")
def command(paths: tuple[Path, ...], listen: tuple[str, int] | None, no_browser: bool, **options: Any) -> int:
    """The TMCL-IDE in the browser: editor, debugger, axes, plots and bench.

    Without --port, on a virtual module, which other hosts may reach too by --pty, --tcp, --slcan and --can.
    Prints its address, token included, on a line of its own; the address is good for this run only.
    """
    if options["port"] and any(options[name] for name in _VIRTUAL):
        raise CliError(
            "--port is a real module: --model, --bench, --eeprom, --parameters and links are for virtual ones"
        )
    if options["bench"] and options["model"]:
        raise CliError("the bench file says which model it is: leave --model away")
    listener = _bind_usual() if listen is None else _bind(*listen)
    host = link_options.LOOPBACK if listen is None else listen[0]
    return asyncio.run(_serve(paths, options, listener, host, no_browser))


def _bind_usual() -> socket.socket:
    """The port of most starts, so that the browser finds again what it has remembered for it."""
    try:
        return _bind(link_options.LOOPBACK, PORT)
    except CliError:
        return _bind(link_options.LOOPBACK, 0)


def _bind(host: str, port: int) -> socket.socket:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    # asyncio sends small messages at once only on sockets that say that they are TCP.
    listener = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((host, port))
    except OSError as error:
        listener.close()
        raise CliError(f"{host}:{port}: {error.strerror}") from error
    listener.listen(64)
    return listener


async def _serve(
    paths: tuple[Path, ...], options: dict[str, Any], listener: socket.socket, host: str, no_browser: bool
) -> int:
    from tmcm34x.ide.application import LOOPBACK, Application
    from tmcm34x.ide.hub import Hub
    from tmcm34x.ide.telegrams import Telegrams
    from tmcm34x.ide.workspace import Workspace

    port = listener.getsockname()[1]
    token = secrets.token_urlsafe(24)
    workspace, show = Workspace.of(paths)
    telegrams = Telegrams()
    hub = Hub(workspace, _target(options, telegrams), telegrams, show)
    loopback = host in link_options.LOOPBACK_HOSTS
    application = Application(hub, token, [f"{name}:{port}" for name in LOOPBACK] if loopback else [])
    application.name_cookie(port)
    name = f"[{host}]" if ":" in host else host
    url = f"http://{name}:{port}/?token={token}"
    server = application.server()
    loop = asyncio.get_running_loop()

    def end() -> None:
        hub.halt()
        server.should_exit = True

    stop_on_signals(loop, end)
    await hub.open()
    try:
        hub.links = await _open_links(hub.target, options)
        spare_the_collector()
        click.echo(f"ready ide {url}")
        if not no_browser:
            await asyncio.to_thread(webbrowser.open, url)
        await server.serve(sockets=[listener])
    finally:
        if doubts := await hub.close():
            _report(f"not known to be at rest: {doubts}")
    return 0


async def _open_links(target: Target, options: dict[str, Any]) -> list[str]:
    from tmcm34x.ide.virtual import Virtual

    if not isinstance(target, Virtual):
        return []
    links = link_options.make_links(options)
    return await link_options.open_links(
        target.server, links, link_options.make_can_links(options, target.rig)
    )


def _target(options: dict[str, Any], telegrams: Telegrams) -> Target:
    if options["port"]:
        from tmcm34x.host.exceptions import LinkError
        from tmcm34x.ide.remote import Remote

        try:
            return Remote(options["port"], options["baud"], options["address"], telegrams)
        except LinkError as error:
            raise CliError(str(error)) from error
    return _virtual(options, telegrams)


def _virtual(options: dict[str, Any], telegrams: Telegrams) -> Target:
    from tmcm34x.bench import BenchError, load, simple_rig
    from tmcm34x.cli.memory import keep, open_eeprom
    from tmcm34x.firmware.storage import EepromError
    from tmcm34x.ide.virtual import Virtual
    from tmcm34x.server import Server

    path: str | None = options["eeprom"]
    file = eeprom = None
    try:
        if path is not None:
            file, eeprom = open_eeprom(Path(path), _report)
        if options["bench"]:
            rig, place = load(options["bench"], [eeprom]), options["bench"].name
        else:
            number = int(options["model"] or (eeprom.model if eeprom else 343))
            rig, place = simple_rig(number, eeprom), "bare motors"
    except (EepromError, BenchError) as error:
        raise CliError(str(error)) from error
    parameter_options.apply(options["parameters"], rig)
    stores = [] if file is None else [keep(rig.modules[0].eeprom, file, _report)]
    return Virtual(Server(rig, stores=stores, log=telegrams), place, path or "")


def _report(line: str) -> None:
    click.echo(f"tmcm34x ide: {line}", err=True)
