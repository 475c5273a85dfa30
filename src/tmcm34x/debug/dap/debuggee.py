"""What the parts of a debug adapter share: the program being debugged, its sources, and the way to the editor."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

from tmcm34x.debug.dap import messages as m
from tmcm34x.debug.dap.messages import RequestError
from tmcm34x.debug.dap.sources import Sources
from tmcm34x.debug.sessions.base import Session
from tmcm34x.tmcl.datagram import Instruction


class Tell(Protocol):
    """Sends an event to the editor."""

    def __call__(self, name: str, **body: Any) -> None:
        """Send it."""
        ...


class Request(NamedTuple):
    """How a request is done: what it carries, the method that does it, whether there must be a program."""

    kind: type[m.Arguments]
    handler: Callable[[Any, Any], Any]
    needs_target: bool = True


@dataclass
class Debuggee:
    """The program being debugged, once there is one."""

    sources: Sources
    event: Tell
    target: Session | None = None

    @property
    def running_or_held(self) -> Session:
        """The program; raises `RequestError` while there is none."""
        if self.target is None:
            raise RequestError("there is no program: launch or attach first")
        return self.target

    @property
    def held(self) -> Session:
        """The program, which is not running; raises `RequestError`."""
        target = self.running_or_held
        if target.running:
            raise RequestError("the program is running")
        return target

    def share_sources(self) -> None:
        """The program's text has changed: let the target know."""
        if self.target is not None:
            self.target.text = self.sources.text
            self.target.view.symbols = self.sources.symbols

    def place(self, address: int) -> dict[str, Any]:
        """Source and line of the command at `address`; empty where they are not known."""
        return {} if self.running_or_held.foreign else self.sources.place(address)

    def instruction(self, address: int) -> Instruction | None:
        """The command at `address`, where there is one and it is known."""
        return None if self.target is None else self.target.instruction(address)


def parse_address(text: str) -> int:
    """An address as editors send it: hexadecimal with `0x`; raises `RequestError`."""
    try:
        return int(text, 0)
    except ValueError:
        raise RequestError(f"{text[:100]!r} is no address") from None
