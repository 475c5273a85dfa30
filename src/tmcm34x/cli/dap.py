"""`tmcm34x dap`: the debug adapter for editors."""

from __future__ import annotations

import contextlib
import os
import queue
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final

import click

from tmcm34x.cli import CliError
from tmcm34x.cli.link_options import LOOPBACK_HOSTS, TcpAddress
from tmcm34x.cli.source_files import assemble_file, is_hex, read_image
from tmcm34x.debug.dap import Adapter, Services
from tmcm34x.debug.dap.messages import Framing, FramingError, RequestError, frame
from tmcm34x.server.pace import Pace
from tmcm34x.toolchain.assembler import Assembly, assemble
from tmcm34x.toolchain.disassembler import disassemble

_READ_SIZE: Final = 65536
_LONGEST_SLEEP_S: Final = 3600.0
_MOST_CHUNKS: Final = 16
"""Chunks of bytes that are read ahead."""
_LOOK_S: Final = 0.5
"""How often a reader whose bytes are not taken looks whether it is still needed."""


@click.command()
@click.option(
    "--listen",
    type=TcpAddress(),
    metavar="[HOST:]PORT",
    help="Serve editors on a TCP port instead of standard input and output; port 0 picks a free one.",
)
def command(listen: tuple[str, int] | None) -> int:
    """Serve the Debug Adapter Protocol for TMCL programs.

    An editor launches a program on a virtual module of its own, or attaches to a module, real or served, on a
    serial port or socket.
    """
    with contextlib.suppress(KeyboardInterrupt):
        if listen is None:
            _converse(_read_standard_input, _write_standard_output)
        else:
            _serve(*listen)
    return 0


def _serve(host: str, port: int) -> None:
    """Sessions with all editors that connect."""
    from tmcm34x.cli import dap_socket

    try:
        server = dap_socket.listen(host, port)
    except OSError as error:
        raise CliError(f"--listen {host}:{port}: {error.strerror or error}") from None
    if host not in LOOPBACK_HOSTS:
        click.echo("whoever reaches this port can read your sources and run programs", err=True)
    with server:
        click.echo(f"ready dap {host}:{server.getsockname()[1]}")
        dap_socket.serve(server, _converse)


def _read_standard_input() -> bytes:
    return os.read(0, _READ_SIZE)


def _write_standard_output(data: bytes) -> None:
    while data:
        data = data[os.write(1, data) :]


class _Incoming:
    """What an editor sends, read by a thread: not every system can wait for standard input and a clock at once."""

    def __init__(self, read: Callable[[], bytes]) -> None:
        self._read = read
        self._chunks: queue.Queue[bytes] = queue.Queue(_MOST_CHUNKS)
        self._wanted = True
        threading.Thread(target=self._run, name="editor", daemon=True).start()

    def take(self, wait_s: float) -> bytes | None:
        """The next bytes, none at the end; None if there are none in time."""
        try:
            return self._chunks.get(wait_s > 0, wait_s or None)
        except queue.Empty:
            return None

    def close(self) -> None:
        """Read no more than what is being read."""
        self._wanted = False

    def _run(self) -> None:
        data = b"go on"
        while data and self._wanted:
            try:
                data = self._read()
            except OSError:
                data = b""
            while self._wanted:
                with contextlib.suppress(queue.Full):
                    self._chunks.put(data, timeout=_LOOK_S)
                    break


def _converse(read: Callable[[], bytes], write: Callable[[bytes], object]) -> None:
    """One session with one editor, until it disconnects or hangs up."""

    def send(message: dict[str, Any]) -> None:
        write(frame(message))

    adapter, framing = Adapter(send, SERVICES), Framing()
    incoming = _Incoming(read)
    try:
        while not adapter.over:
            data = incoming.take(min(adapter.work(), _LONGEST_SLEEP_S))
            if data is None:
                continue
            if not data:
                break
            _take(adapter, framing, data)
    except FramingError as error:
        click.echo(f"tmcm34x dap: {error}", err=True)
    except ConnectionError:
        pass  # The editor is gone without a word, or takes nothing any more.
    finally:
        incoming.close()
        adapter.close()


def _take(adapter: Adapter, framing: Framing, data: bytes) -> None:
    try:
        for message in framing.feed(data):
            adapter.handle(message)
            if adapter.over:
                return
    except FramingError:
        adapter.handle(None)
        raise


def _read_program(path: str, include: Sequence[str], model: int) -> Assembly:
    try:
        file = Path(path)
        if file.suffix.lower() == ".bin" or is_hex(file):
            return assemble(disassemble(read_image(file)), f"{file.name}.tmc")
        return assemble_file(file, [Path(folder) for folder in include], model=model)
    except CliError as error:
        raise RequestError(error.format_message()) from None


def _pace(speed: float) -> Pace:
    return Pace(speed, time.monotonic)


SERVICES: Final = Services(_read_program, _pace)
"""What an adapter in this process needs."""
