"""What the IDE asks of a module, wherever it is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol, TypeVar

from tmcm34x.board.models import Model
from tmcm34x.debug.sessions.base import Listener
from tmcm34x.debug.sessions.live import LiveSession
from tmcm34x.debug.sessions.remote import RemoteSession
from tmcm34x.ide import wire
from tmcm34x.ide.sampling import Samples
from tmcm34x.ide.state import Groups
from tmcm34x.tmcl.datagram import Instruction

T = TypeVar("T")
Tell = Callable[[wire.Event], None]
"""Takes an event for all pages."""


class Target(Protocol):
    """A module at the end of a line."""

    source: wire.Source
    model: Model
    known: bool
    """Whether the module has said that it is a `model`."""
    ability: wire.Ability
    samples: Samples
    line: int
    """Another number whenever the line is opened anew: what was begun on the old one is over."""

    @property
    def place(self) -> str:
        """Port, address or bench, for people."""
        ...

    async def open(self, tell: Tell) -> None:
        """Begin; `tell` takes events until `close`."""
        ...

    async def close(self) -> None:
        """Let go of everything."""
        ...

    @property
    def link(self) -> wire.Link:
        """Whether the module can be reached, and why not."""
        ...

    async def exchange(self, instruction: Instruction) -> wire.Exchange:
        """Send a command and wait for its answer; status 0 is none in time."""
        ...

    async def ask(self, instruction: Instruction) -> wire.Exchange:
        """As `exchange`, for operations: sent again where no whole answer came and that does no harm."""
        ...

    def urgent(self, instructions: Sequence[Instruction]) -> None:
        """Send commands at once, before all that is queued and without waiting for answers; nothing where no line is.

        What is queued and could set a motor in motion is not sent any more.
        """
        ...

    async def send_ascii(self, line: str) -> str:
        """Send a line to the ASCII interface; what came back.  Raises `wire.RefusalError`."""
        ...

    @property
    def now(self) -> float:
        """The module's time, or that of the line [clocks]."""
        ...

    def session(self, listener: Listener) -> LiveSession | RemoteSession:
        """Run control of the module's program; to be called in `debug`.  Raises `HostError`."""
        ...

    async def debug(self, work: Callable[[], T], *, polling: bool = False) -> T:
        """Do something with the session where and when the module may be touched.

        polling: sent for the display alone, so logs need not show it
        """
        ...

    def hush(self, on: bool) -> None:
        """Send nothing of one's own accord, because the module would store it as part of a program."""
        ...

    async def read(self, items: Sequence[wire.Watched]) -> list[int | None]:
        """Values of parameters and coordinates, None where there are none; leaves no trace in logs."""
        ...

    def state(self) -> Groups:
        """Everything that is shown live, as of now."""
        ...

    def watched(self, items: Sequence[wire.Watched]) -> list[int | None]:
        """Present values of watched parameters, None where there are none."""
        ...

    def watch(self, items: Sequence[wire.Watched]) -> None:
        """All parameters that some page watches."""
        ...
