"""`tmcm34x serve`: a virtual module on pseudo terminals, sockets and serial ports."""

from __future__ import annotations

import asyncio
import contextlib
import gc
import os
import stat
from collections.abc import Callable, Generator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

import click

from tmcm34x import clock
from tmcm34x.bench import BenchError, Rig, simple_rig
from tmcm34x.bench.counters import Counters
from tmcm34x.capture.record import RecordingError
from tmcm34x.cli import CliError, FiniteRange, link_options, parameter_options, user_functions
from tmcm34x.cli.memory import keep, open_eeprom
from tmcm34x.cli.outputs import FILE_OUT
from tmcm34x.cli.signals import stop_on_signals
from tmcm34x.cli.terminal import ERRORS, OUTPUT, Scarcity
from tmcm34x.firmware.storage import Eeprom, EepromError
from tmcm34x.links import CanLink, Link, Moving, Reporting
from tmcm34x.server import Server, Store, TelegramLog
from tmcm34x.server.control import Control
from tmcm34x.server.output import OutputLines
from tmcm34x.server.pace import MOST_SPEED
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.global_parameters import BAUD_RATES

if TYPE_CHECKING:
    from tmcm34x.links.faulty import Faults
    from tmcm34x.server.telegram_log import Sink

MODELS = ("341", "342", "343")
_BYTE = click.IntRange(0, 255)
_PATH = click.Path(path_type=Path)
_EXAMPLES = """\b
Examples:
  tmcm34x serve --pty /tmp/tmcm343 --tcp 17000
  tmcm34x serve --tcp 0 --model 341 --eeprom spare.eeprom --speed 10
  tmcm34x serve --bench examples/benches/rs485.toml --pty --slcan
"""


@click.command(epilog=_EXAMPLES)
@click.option("--model", type=click.Choice(MODELS), default="343", show_default=True, help="Module type.")
@click.option("--address", type=_BYTE, help="Serial address of the module, instead of the stored one.")
@click.option("--host-address", type=_BYTE, help="Address in its replies, instead of the stored one.")
@click.option(
    "--bench",
    type=_PATH,
    metavar="FILE",
    help="Bench of one or more modules with what hangs on them, instead of one module with bare motors.",
)
@link_options.options
@click.option("--serial", "serials", multiple=True, metavar="DEVICE", help="A real serial port.")
@click.option(
    "--baud",
    type=click.IntRange(1),
    default=BAUD_RATES[0],
    show_default=True,
    help="Bits per second of --serial.",
)
@click.option(
    "--each",
    is_flag=True,
    help="A pseudo terminal or socket of its own for each module of the bench, in their order: --tcp PORT is that of "
    "the first, the others follow; --pty LINK makes LINK-0, LINK-1 and so on.",
)
@click.option("--any-address", is_flag=True, help="Take telegrams for any address, as a module on USB does.")
@click.option(
    "--strict-baud",
    is_flag=True,
    help="Accept clients on a pseudo terminal only at the bit rate of global parameter 65.",
)
@click.option(
    "--eeprom",
    "eeproms",
    multiple=True,
    type=FILE_OUT,
    metavar="FILE",
    help="Image of the non-volatile memory; created when missing. Without it, memory lasts as long as the process. "
    "With --bench: once for each module, in order.",
)
@click.option(
    "--durable",
    is_flag=True,
    help="Write each change of the memory to the disk before its reply: nothing is lost when the computer loses power.",
)
@click.option(
    "--program",
    type=_PATH,
    metavar="FILE",
    help="TMCL program, source or image, to store in the program memory of the (first) module.",
)
@click.option("--run", is_flag=True, help="Start the program in its program memory.")
@click.option(
    "--instruction-time",
    type=FiniteRange(0, 1e6, min_open=True),
    default=100.0,
    show_default=True,
    metavar="US",
    help="Time that one TMCL instruction takes, in microseconds; the default is an assumption.",
)
@click.option(
    "--speed",
    type=FiniteRange(0, MOST_SPEED),
    default=1.0,
    show_default=True,
    metavar="FACTOR",
    help="Speed of virtual time: 1 is real time, 10 ten times as fast, 0.1 slow motion, 0 as fast as possible.",
)
@click.option(
    "--seed", type=int, default=0, show_default=True, help="Seed of all random numbers; a bench has its own."
)
@click.option(
    "--pace",
    is_flag=True,
    help="Transmit bytes of serial lines at their rate: 10 bits each, at the bit rate of global parameter 65.",
)
@click.option(
    "--fault",
    "faults",
    multiple=True,
    type=link_options.FaultText(),
    metavar="NAME[=VALUE][,OPTION=VALUE]...",
    help="A fault of the lines, such as garble,probability=0.05 or silent,count=3; docs/faults.md lists them.",
)
@parameter_options.option
@user_functions.option
@link_options.control
@click.option("--counters", is_flag=True, help="At the end, print what was refused, worn and lost.")
@click.option(
    "--ready-file",
    type=FILE_OUT,
    metavar="FILE",
    help="Write the `ready` lines to FILE when all links are open; it is removed at the end.",
)
@click.option(
    "--exit-after",
    type=FiniteRange(0, 1e9, min_open=True),
    metavar="SECONDS",
    help="End by itself after this time.",
)
@click.option(
    "--log-telegrams",
    metavar="FILE",
    help="Write down every telegram with its time and meaning; - is standard output.",
)
@click.option(
    "--record",
    type=_PATH,
    metavar="OUT",
    help="Record telegrams with exact times: .session, .pcapng for Wireshark, .log (candump) or .hex.",
)
@click.pass_context
def command(context: click.Context, **options: Any) -> int:
    """Serve virtual modules on serial ports, sockets and CAN.

    Prints one line for each link when it can be used, such as `ready pty /dev/pts/5`, and serves until it is
    interrupted.  Without a link, opens a pseudo terminal.
    """
    with contextlib.ExitStack() as stack:
        stack.callback(ERRORS.close)
        stack.callback(OUTPUT.close)
        log = _record(options["record"], _open_log(options["log_telegrams"], stack), stack)
        rig, stores = _build(context, options, stack)
        server = Server(
            rig,
            speed=options["speed"],
            stores=stores,
            log=log,
            any_address=options["any_address"],
            strict_baud=options["strict_baud"],
            paced=options["pace"],
            faults=_arm(options),
            lazy=len(rig.modules) > 1,
        )
        counters = Counters(rig) if options["control"] or options["counters"] else None
        address = options["control"]
        control = Control(server, address, counters or Counters(rig)) if address else None
        links, can_links = (
            link_options.make_lines(options, len(rig.modules)),
            link_options.make_can_links(options, rig),
        )
        status = asyncio.run(_serve(server, control, links, can_links, options))
        if counters is not None and options["counters"]:
            for line in counters.lines():
                click.echo(line)
        if lost := [store.error for store in stores if store.error]:
            raise CliError(f"the last memory was not saved: {lost[0]}")
        return status


def _arm(options: dict[str, Any]) -> Faults | None:
    """The faults that were asked for."""
    if not options["faults"] and not options["control"]:
        return None
    from tmcm34x.links.faulty import Faults

    faults = Faults(seed=options["seed"])
    for fault in options["faults"]:
        faults.add(fault)
    return faults


def _build(
    context: click.Context, options: dict[str, Any], stack: contextlib.ExitStack
) -> tuple[Rig, list[Store]]:
    """The modules with their memories, and what keeps these in files."""
    files = [open_eeprom(path, _report) for path in options["eeproms"]]
    for file, _ in files:
        stack.callback(file.close)
    eeproms = [eeprom for _, eeprom in files]
    try:
        rig = _load_bench(context, options, eeproms) if options["bench"] else _build_module(options, eeproms)
    except (EepromError, BenchError) as error:
        raise CliError(str(error)) from error
    if options["any_address"] and rig.modules[1:]:
        raise CliError(
            "--any-address is for one module: here all of them would answer every telegram at once"
        )
    if len(files) > len(rig.modules):
        raise CliError(f"{len(files)} EEPROM files for {len(rig.modules)} modules")
    parameter_options.apply(options["parameters"], rig)
    if options["user_functions"]:
        user_functions.attach(options["user_functions"], rig.modules, _report)
    module = rig.modules[0]
    if options["program"] is not None:
        module.eeprom.write_program(_program(options["program"], module.board.model.number))
        module.reset()
    if options["run"]:
        module.program.run(0)
    durable = options["durable"]
    stores = [
        keep(module.eeprom, file, _report, durable=durable)
        for module, (file, _) in zip(rig.modules, files, strict=False)
    ]
    return rig, stores


def _build_module(options: dict[str, Any], eeproms: list[Eeprom | None]) -> Rig:
    return simple_rig(
        int(options["model"]),
        eeproms[0] if eeproms else None,
        seed=options["seed"],
        address=options["address"],
        host_address=options["host_address"],
        instruction_clocks=max(1, clock.clocks(options["instruction_time"] * 1e-6)),
    )


def _load_bench(context: click.Context, options: dict[str, Any], eeproms: list[Eeprom | None]) -> Rig:
    from tmcm34x.bench import load

    for name in ("model", "address", "host_address", "instruction_time", "seed"):
        if context.get_parameter_source(name) is click.core.ParameterSource.COMMANDLINE:
            raise click.UsageError(f"--{name.replace('_', '-')} is for the bench file to say")
    return load(options["bench"], eeproms)


def _program(path: Path, model: int) -> tuple[Instruction, ...]:
    from tmcm34x.cli.source_files import read_program

    return read_program(path, model=model)


def _open_log(path: str | None, stack: contextlib.ExitStack) -> TelegramLog | None:
    if path is None:
        return None
    if path == "-":
        return TelegramLog(OUTPUT)
    try:
        stream = Path(path).open("w", encoding="utf-8")  # noqa: SIM115
    except OSError as error:
        raise CliError(f"{path}: {error.strerror}") from error
    stack.callback(_close, stream)
    if stat.S_ISREG(os.fstat(stream.fileno()).st_mode):
        return TelegramLog(stream)
    stack.callback((output := OutputLines(stream.fileno())).close)
    return TelegramLog(output)


def _record(path: Path | None, log: TelegramLog | None, stack: contextlib.ExitStack) -> Sink | None:
    """A recording of the lines beside the text log."""
    if path is None:
        return log
    from tmcm34x.capture.files import RecordingWriter
    from tmcm34x.capture.tap import Tap

    try:
        return Tap(stack.enter_context(RecordingWriter(path)), log)
    except RecordingError as error:
        raise CliError(str(error)) from None


def _close(stream: TextIO) -> None:
    # That the disk is full has been reported when a line was written.
    with contextlib.suppress(OSError):
        stream.close()


def _report(line: str) -> None:
    ERRORS.write(f"tmcm34x serve: {line}\n")


def _announce(kind: str, address: str) -> None:
    OUTPUT.write(f"ready {kind} {address}\n")


def _watch(log: object, loop: asyncio.AbstractEventLoop, stop: Callable[[Exception], None]) -> None:
    """End the server when its telegram log can be written no more."""
    if isinstance(log, TelegramLog):
        log.lost = stop
        if isinstance(log.stream, OutputLines):
            log.stream.lost = partial(loop.call_soon_threadsafe, stop)


async def _serve(
    server: Server,
    control: Control | None,
    links: list[tuple[Link, int | None]],
    can_links: list[CanLink],
    options: dict[str, Any],
) -> int:
    loop = asyncio.get_running_loop()
    stopped: asyncio.Future[None] = loop.create_future()

    def stop(error: Exception | None = None) -> None:
        if not stopped.done():
            stopped.set_exception(error) if error else stopped.set_result(None)

    scarcity = Scarcity(_report)

    def judge(_: object, context: dict[str, Any]) -> None:
        """A bug must not be logged and forgotten: it ends the server."""
        if not scarcity.covers(context):
            stop(context.get("exception", RuntimeError(context["message"])))

    loop.set_exception_handler(judge)
    _watch(getattr(server.log, "also", server.log), loop, stop)
    for link in (*[link for link, _ in links], *can_links):
        if isinstance(link, Reporting):
            link.report = _report
        if isinstance(link, Moving):
            link.moved = partial(_announce, link.kind)
    stop_on_signals(loop, stop)
    try:
        ready = await link_options.open_links(server, links, can_links)
        if control is not None:
            ready.append(await link_options.open_control(server, control))
        with _ready_file(options["ready_file"], ready):
            if options["exit_after"] is not None:
                loop.call_later(options["exit_after"], stop)
            gc.freeze()  # all of it lives as long as the process: no need to look for garbage in it
            await stopped
    except BrokenPipeError:
        raise
    except RecordingError as error:
        raise CliError(str(error)) from error
    except OSError as error:
        output = "telegram log" if options["log_telegrams"] else "standard output"
        raise CliError(f"{output}: {error.strerror}") from error
    finally:
        await server.close()
    return 0


@contextlib.contextmanager
def _ready_file(path: Path | None, ready: list[str]) -> Generator[None]:
    """Writes the file, if it is wanted, and removes it at the end."""
    if path is None:
        yield
        return
    _write_ready(path, ready)
    try:
        yield
    finally:
        with contextlib.suppress(OSError):
            path.unlink()


def _write_ready(path: Path, ready: list[str]) -> None:
    """Write the file in one step: whoever sees it sees all of it."""
    new = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        new.write_text("".join(f"{line}\n" for line in ready), encoding="utf-8")
        new.replace(path)
    except OSError as error:
        raise CliError(f"{path}: {error.strerror}") from error
