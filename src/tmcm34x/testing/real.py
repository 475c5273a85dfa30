"""A real module for a test: what needs a bench raises `NotOnRealModuleError`.

The line belongs to the host under test.  What the test itself asks goes over a connection that is opened for each
question and closed again, so a serial port must not be opened for exclusive use by the host meanwhile.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final, NoReturn

from tmcm34x.host import Connection, HostError, RefusedError, program
from tmcm34x.host.settings import identify
from tmcm34x.host.url import parse_url
from tmcm34x.testing.base import ModuleUnderTest
from tmcm34x.testing.errors import NotOnRealModuleError
from tmcm34x.tmcl.datagram import Instruction

if TYPE_CHECKING:
    from pathlib import Path

    from tmcm34x.bench.rig import Rig
    from tmcm34x.bench.session.world import Unit
    from tmcm34x.bench.world import AxisView
    from tmcm34x.host.module import Module as HostModule
    from tmcm34x.host.steps import Steps
    from tmcm34x.testing.history import History

POLL_S: Final = 0.01


class RealModule(ModuleUnderTest):
    """The module at a serial port, `tcp://HOST:PORT`, `can:INTERFACE:CHANNEL?id=1&reply=2` or `slcan:DEVICE`.

    Raises `HostError` when it does not reply.
    """

    real = True

    def __init__(self, port: str, *, baud: int = 9600, address: int = 1) -> None:
        self.where = port
        self._baud = baud
        self._address = address
        self._url = parse_url(port)
        self._start_s = time.monotonic()
        self._loaded = False
        with self._open() as connection:
            self.model, _ = connection.run(identify())

    def _open(self) -> Connection:
        return Connection.open(self.where, baud=self._baud, address=self._address)

    def close(self) -> None:
        """Stop the program that the test has loaded, and the motors: the next test must not find them moving."""
        if self._loaded:
            self._run(program.stop())
        for motor in range(3):
            self.command(f"MST {motor}")

    # Lines

    @property
    def port(self) -> str:
        """The device name of the serial port."""
        return self._target("serial", "serial port")

    @property
    def url(self) -> str:
        """The address of the socket."""
        return f"tcp://{self._target('tcp', 'socket')}"

    @property
    def address(self) -> str:
        """`HOST:PORT` of the socket."""
        return self._target("tcp", "socket")

    @property
    def serial_url(self) -> str:
        """The serial port or the socket, as pyserial's `serial_for_url` takes it."""
        return f"socket://{self._url.target}" if self._url.scheme == "tcp" else self.port

    def open_port(self, link: str | None = None) -> str:
        """The device name of the serial port; not available under another name."""
        return self.port if link is None else self._refuse("a port under a name of its own")

    def connect(self) -> HostModule:
        """The module through this project's host library, on a connection of its own."""
        from tmcm34x.host.module import Module as HostModule

        return HostModule(self._open())

    @property
    def can(self) -> dict[str, Any]:
        """Arguments for `can.Bus(**module.can)` of python-can."""
        if self._url.scheme == "slcan":
            interface, channel = "slcan", self._url.target
        else:
            interface, _, channel = self._target("can", "CAN bus").partition(":")
        return {"interface": interface, "channel": channel, "bitrate": self._url.can.bitrate}

    def _target(self, scheme: str, what: str) -> str:
        if self._url.scheme != scheme:
            raise NotOnRealModuleError(f"{self.where} is no {what}")
        return self._url.target

    # Time

    @property
    def now(self) -> float:
        """Seconds since the test began."""
        return time.monotonic() - self._start_s

    def run(self, seconds: float) -> None:
        """Wait."""
        time.sleep(seconds)

    def run_until(self, holds: Callable[[], Any], timeout: float) -> bool:
        """Wait until `holds`, or the time is over."""
        end_s = time.monotonic() + timeout
        while not holds():
            if time.monotonic() >= end_s:
                return False
            time.sleep(POLL_S)
        return True

    # The module

    def _run(self, steps: Steps[None]) -> None:
        with self._open() as connection:
            connection.run(steps)

    def load(self, source: str | Path, *, run: bool = False) -> None:
        """Download a TMCL program, verify it, and perhaps start it.  Raises `ValueError`, `HostError`."""
        from tmcm34x.testing.programs import assemble_source

        assembly = assemble_source(source, self.model)
        self._loaded = True
        self._run(program.download(assembly.program))
        if run:
            self._run(program.run())

    def covers(self, source: Path) -> None:
        """No effect: what a real module executes is not seen, and the test has its worth without."""

    def execute(self, instruction: Instruction, module: int = 0) -> tuple[int, int]:
        """Send a command on a connection of its own; status and value of the reply."""
        if module:
            self._refuse("a second module")
        with self._open() as connection:
            try:
                reply = connection.execute(instruction)
            except RefusedError as error:
                reply = error.reply
        return reply.status, reply.value

    def ask(self, instruction: Instruction, module: int = 0) -> tuple[int, int]:
        """The same: a real module has no way to look without asking."""
        return self.execute(instruction, module)

    # The bench

    def _refuse(self, what: str) -> NoReturn:
        raise NotOnRealModuleError(f"{what} is not available on a real module")

    @property
    def rig(self) -> Rig:
        """Not available."""
        self._refuse("the bench")

    @property
    def unit(self) -> Unit:
        """Not available."""
        self._refuse("a measurement on the bench")

    def view(self, motor: int, module: int = 0) -> AxisView:
        """Not available."""
        self._refuse("a view of the axis")

    def act(self, name: str, *operands: Any, module: int = 0) -> None:
        """Not available."""
        self._refuse(f"the action {name!r} of a bench")

    def fault(self, name: str, value: float | None = None, **options: Any) -> None:
        """Not available."""
        self._refuse(f"the fault {name!r} of the line")

    def clear_faults(self, name: str | None = None) -> None:
        """There are none."""

    @property
    def history(self) -> History:
        """Not available."""
        self._refuse("going back in time")

    def snapshot(self) -> bytes:
        """Not available."""
        self._refuse("a snapshot")

    def restore(self, snapshot: bytes) -> None:
        """Not available."""
        self._refuse("a snapshot")


def reach(port: str, baud: int, address: int) -> RealModule | str:
    """The module at a port, or why there is none."""
    try:
        return RealModule(port, baud=baud, address=address)
    except HostError as error:
        return str(error)
