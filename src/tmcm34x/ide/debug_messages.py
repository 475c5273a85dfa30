"""Messages of the Debug Adapter Protocol between the IDE's debugger and its windows."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Final, NamedTuple, cast

if TYPE_CHECKING:
    from tmcm34x.debug.control import Stop

Message = dict[str, Any]
Send = Callable[[Message], None]


class DebugWindow:
    """One of those who share the session."""

    def __init__(self, send: Send) -> None:
        self._send = send
        self._seq = 0

    def take(self, message: Mapping[str, Any]) -> None:
        """Send a message, numbered as the protocol wants."""
        self._seq += 1
        self._send({**message, "seq": self._seq})


class Emission(NamedTuple):
    """A message of the adapter's, and what was so when it came."""

    message: Message
    asker: DebugWindow | None
    request: Message
    now: float
    held: Stop | None
    attaching: bool


_MOVING: Final = frozenset({
    "continue", "next", "stepIn", "stepOut", "stepBack", "reverseContinue", "pause", "goto", "restartFrame", "restart",
})  # fmt: skip
"""Requests that move the program: what an earlier one looks for in the past is wanted no more."""


def moves_program(request: Message) -> bool:
    """Whether a request moves the program, or may: in the console a text may be a command."""
    arguments = request.get("arguments")
    console = isinstance(arguments, dict) and cast(Message, arguments).get("context") == "repl"
    command = str(request.get("command"))
    return command in _MOVING or (command == "evaluate" and console)


def is_logged(message: Mapping[str, Any]) -> bool:
    """Whether it comes from a log point."""
    return message["event"] == "output" and "line" in message["body"]


def event_of(name: str, **body: Any) -> Message:
    """An event, not numbered yet."""
    return {"type": "event", "event": name, "body": body}


def request_of(command: str, **arguments: Any) -> Message:
    """A request of the IDE itself, whose response goes to no window."""
    return {"type": "request", "command": command, "seq": 0, "arguments": arguments}


def response_to(request: Message, error: str = "") -> Message:
    """A response without a body, or one that says why there is none."""
    message: Message = {
        "type": "response", "request_seq": request.get("seq", 0), "command": request.get("command", ""),
        "success": not error,
    }  # fmt: skip
    return message | ({"message": error} if error else {})
