"""`tmcm34x ide`: the TMCL-IDE in the browser."""

from __future__ import annotations

import asyncio
import secrets
import socket
import webbrowser
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from tmcm34x.cli import CliError, link_options, parameter_options, spare_the_collector
from tmcm34x.cli.outputs import FILE_OUT
from tmcm34x.cli.signals import stop_on_signals
from tmcm34x.cli.terminal import ERRORS, Scarcity, logging_here

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tmcm34x.firmware.storage import Eeprom
    from tmcm34x.host.url import Url
    from tmcm34x.ide.hub import Hub
    from tmcm34x.ide.modules import Modules, Recipe
    from tmcm34x.ide.target import Target
    from tmcm34x.ide.telegrams import Telegrams
    from tmcm34x.ide.virtual import Virtual
    from tmcm34x.links.faulty import Faults


PORT: Final = 8343
"""What a browser remembers of the IDE (layout, theme, unsaved texts) belongs to its port."""


_VIRTUAL: Final = ("bench", "model", "eeprom", "parameters", "ptys", "tcps", "slcans", "buses", "control")
"""Options that say what a virtual module is."""
_EXAMPLES = """\b
Examples:
  tmcm34x ide examples
  tmcm34x ide conveyor.tmc --bench bench.toml
  tmcm34x ide --port /dev/ttyUSB0 --baud 9600
  tmcm34x ide --port tcp:127.0.0.1:17000
  tmcm34x ide --port "can:socketcan:can0?id=1&reply=2"
  tmcm34x ide program.tmc --tcp 17000 --pty /tmp/tmcm343 --control /tmp/bench
"""


@click.command(epilog=_EXAMPLES)
@click.argument("paths", nargs=-1, type=click.Path(exists=True, path_type=Path), metavar="[FILES or FOLDER]")
@click.option(
    "--port",
    metavar="URL",
    help="A real module: a serial device, tcp:HOST:PORT, can:INTERFACE:CHANNEL?id=1&reply=2 or slcan:DEVICE.",
)
@click.option(
    "--baud", type=click.IntRange(1), default=9600, show_default=True, help="Bits per second of --port."
)
@click.option(
    "--address",
    type=click.IntRange(0, 255),
    default=1,
    show_default=True,
    help="Address of the module at --port.",
)
@click.option(
    "--model",
    type=click.Choice(["341", "342", "343"]),
    help="Virtual module type, without --bench; by default that of --eeprom, or 343.",
)
@click.option(
    "--bench",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    metavar="FILE",
    help="What hangs on the virtual module.",
)
@click.option(
    "--eeprom", type=FILE_OUT, metavar="FILE", help="Image of its non-volatile memory; created when missing."
)
@click.option(
    "--listen",
    type=link_options.TcpAddress(),
    metavar="HOST:PORT",
    help=f"Where the browser finds the IDE; by default on loopback at port {PORT}, or a free one where that is taken.",
)
@parameter_options.option
@link_options.options
@link_options.control
@click.option("--no-browser", is_flag=True, help="Do not open a browser.")
def command(paths: tuple[Path, ...], listen: tuple[str, int] | None, no_browser: bool, **options: Any) -> int:
    """Open the TMCL-IDE in the browser: editor, debugger, axes, plots and bench.

    Without --port it works on a virtual module, which other hosts can reach too by --pty, --tcp, --slcan and --can;
    the page can change to another module and back.
    The address of the page, token included, is printed on a line of its own and is valid for this run only.
    """
    if options["port"] and any(options[name] for name in _VIRTUAL):
        raise CliError(
            "--port is a real module: --model, --bench, --eeprom, --parameters, --control and links "
            "are for virtual ones"
        )
    if options["bench"] and options["model"]:
        raise CliError("the bench file says which model it is: leave --model out")
    listener = bind_usual() if listen is None else _bind(*listen)
    host = link_options.LOOPBACK if listen is None else listen[0]
    with listener, logging_here():
        return asyncio.run(_serve(paths, options, listener, host, no_browser))


def bind_usual() -> socket.socket:
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
    from tmcm34x.ide.workspace import OpenFolder

    port = listener.getsockname()[1]
    token = secrets.token_urlsafe(24)
    workspace, show = OpenFolder.of(paths)
    telegrams = Telegrams()
    loopback = host in link_options.LOOPBACK_HOSTS
    modules = _modules(options, telegrams, loopback)
    hub = Hub(workspace, _target(modules, options), telegrams, show, modules, named=bool(paths))
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
    scarcity = Scarcity(_report)
    loop.set_exception_handler(
        lambda loop, context: scarcity.covers(context) or loop.default_exception_handler(context)
    )
    await hub.open()
    try:
        await _open_links(hub)
        spare_the_collector()
        click.echo(f"ready ide {url}")
        if not no_browser:
            await asyncio.to_thread(webbrowser.open, url)
        await server.serve(sockets=[listener])
    finally:
        if doubts := await hub.close():
            _report(f"not known to be at rest: {doubts}")
    return 0


async def _open_links(hub: Hub) -> None:
    from tmcm34x.ide.wire import RefusalError

    try:
        await hub.open_links()
    except RefusalError as error:
        raise CliError(str(error).rstrip(".")) from error


def _modules(options: dict[str, Any], telegrams: Telegrams, local: bool) -> Modules:
    """What pages may connect to, the virtual module of the options included."""
    from tmcm34x.ide.modules import Modules
    from tmcm34x.ide.wire import RefusalError

    async def open_links(virtual: Virtual) -> list[str]:
        try:
            links = link_options.make_links(options)
            can_links = link_options.make_can_links(options, virtual.rig)
            ready = await link_options.open_links(virtual.server, [(link, None) for link in links], can_links)
            return [*ready, *await _open_control(virtual, options["control"])]
        except CliError as error:
            raise RefusalError("links", f"{error}.") from error

    make = partial(_make, options, telegrams)
    return Modules(telegrams, make, open_links, local=local, named=_url(options), recipe=_recipe(options))


async def _open_control(virtual: Virtual, address: str | None) -> list[str]:
    """The socket through which other programs control the bench, if one was asked for."""
    if address is None:
        return []
    from tmcm34x.bench.counters import Counters
    from tmcm34x.server.control import Control

    control = Control(virtual.server, address, Counters(virtual.rig), virtual.not_now)
    return [await link_options.open_control(virtual.server, control)]


def _faults(options: dict[str, Any]) -> Faults | None:
    """Faults of lines come through the control socket."""
    if options["control"] is None:
        return None
    from tmcm34x.links.faulty import Faults

    return Faults()


def _url(options: dict[str, Any]) -> Url | None:
    """The line that was named."""
    from tmcm34x.host.exceptions import LinkError
    from tmcm34x.host.url import parse_url

    if not options["port"]:
        return None
    try:
        url = parse_url(options["port"], baud=options["baud"], address=options["address"])
    except LinkError as error:
        raise CliError(str(error)) from error
    if url.scheme == "virtual":
        raise CliError("--port is a real module: a virtual one is named by --model or --bench")
    return url


def _recipe(options: dict[str, Any]) -> Recipe:
    """The virtual module of the options."""
    from tmcm34x.cli.memory import open_eeprom
    from tmcm34x.files import read_text
    from tmcm34x.ide.modules import Recipe

    path: Path | None = options["bench"]
    if path is not None:
        try:
            return Recipe(bench=read_text(path), name=path.name)
        except (OSError, UnicodeDecodeError) as error:
            raise CliError(f"{path}: not a text file in UTF-8") from error
    model = options["model"]
    if model is None and options["eeprom"] is not None:
        file, eeprom = open_eeprom(Path(options["eeprom"]), _report)
        file.close()
        model = eeprom and eeprom.model
    return Recipe(int(model or 343))


def _make(
    options: dict[str, Any],
    telegrams: Telegrams,
    recipe: Recipe,
    memories: Sequence[Eeprom | None],
    keep: bool,
) -> Virtual:
    """A virtual module with the memory in the file of the options, if that is to be kept."""
    from tmcm34x.cli.memory import keep as keep_in
    from tmcm34x.cli.memory import open_eeprom
    from tmcm34x.ide.modules import rig_of
    from tmcm34x.ide.virtual import Virtual
    from tmcm34x.server import Server

    path = options["eeprom"] if keep else None
    file, eeprom = open_eeprom(Path(path), _report) if path else (None, None)
    try:
        rig = rig_of(recipe, [eeprom, *memories[1:]] if file else memories)
    except ValueError:
        if file is not None:
            file.close()
        raise
    parameter_options.apply(options["parameters"], rig)
    stores = [] if file is None else [keep_in(rig.modules[0].eeprom, file, _report)]
    return Virtual(
        Server(rig, stores=stores, log=telegrams, faults=_faults(options)), recipe.name, path or ""
    )


def _target(modules: Modules, options: dict[str, Any]) -> Target:
    from tmcm34x.host.exceptions import LinkError
    from tmcm34x.ide.wire import RefusalError

    try:
        url = _url(options)
        return modules.virtual(modules.recipe, keep=True) if url is None else modules.real(url)
    except LinkError as error:
        raise CliError(str(error)) from error
    except RefusalError as error:
        bench = options["bench"]
        raise CliError((f"{bench}: " if bench else "") + str(error).rstrip(".")) from error


def _report(line: str) -> None:
    ERRORS.write(f"tmcm34x ide: {line}\n")
