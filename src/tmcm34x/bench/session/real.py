"""The line to a real module: time is that of the wall, and answers are waited for."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final

from tmcm34x.bench.session.errors import Unmet
from tmcm34x.bench.session.player import CAN, SERIAL, Player
from tmcm34x.clock import HZ, seconds
from tmcm34x.host.can_line import CanLine
from tmcm34x.tmcl.datagram import (
    SIZE,
    ChecksumError,
    Instruction,
    Reply,
    pack_can_request,
    pack_request,
    unpack_can_reply,
    unpack_reply,
)

if TYPE_CHECKING:
    from tmcm34x.bench.session.language import Case
    from tmcm34x.host.connection import Connection
    from tmcm34x.host.line import Line

ANSWER_S: Final = 1.0
"""How long an answer is waited for."""
QUIET_S: Final = 0.1
"""How long a line must be quiet where no answer is expected."""
HOST: Final = 2
"""Address in replies, and their identifier on CAN, unless said otherwise."""


class _RealWire:
    """What both kinds of lines have.

    monotonic: the wall clock [s]
    """

    rig = None
    received: Any
    """A bytearray, or a list of frames."""

    def __init__(self, monotonic: Callable[[], float]) -> None:
        self._monotonic = monotonic
        self._start_s = monotonic()

    @property
    def now(self) -> int:
        """The time since the line was opened, in chip clocks."""
        return round((self._monotonic() - self._start_s) * HZ)

    def advance(self, clocks: int) -> None:
        """Wait; what comes meanwhile is kept."""
        self._collect(seconds(clocks), lambda: False)

    def settle(self) -> None:
        """Take what has come."""
        self._take(0.0)

    def wait_for(self, size: int) -> None:
        """Wait until so many bytes or frames have come, or no more do."""
        self._collect(ANSWER_S, lambda: len(self.received) >= size)

    def wait_for_nothing(self) -> None:
        """Wait whether something comes."""
        self._collect(QUIET_S, lambda: bool(self.received))

    def ask(self, address: int, instruction: Instruction) -> tuple[int, int]:
        """Status and value of a command."""
        if self.received:
            raise Unmet("every reply to be expected by a line", f"one that was not: {self._waiting()}")
        self._send(address, instruction)
        reply = self._reply()
        return reply.status, reply.value

    def _collect(self, longest_s: float, done: Callable[[], bool]) -> None:
        end_s = self._monotonic() + longest_s
        while not done() and (left_s := end_s - self._monotonic()) > 0:
            self._take(left_s)

    def _take(self, longest_s: float) -> None:
        """Take what has come, or what comes first in this time."""
        raise NotImplementedError

    def _waiting(self) -> str:
        raise NotImplementedError

    def _send(self, address: int, instruction: Instruction) -> None:
        raise NotImplementedError

    def _reply(self) -> Reply:
        """The reply that is waited for."""
        raise NotImplementedError


class RealSerial(_RealWire):
    """A serial line or socket with a module at its other end."""

    kind = SERIAL

    def __init__(self, line: Line, monotonic: Callable[[], float]) -> None:
        super().__init__(monotonic)
        self._line = line
        self.received = bytearray()

    def send(self, data: bytes) -> None:
        """Send bytes."""
        self._line.write(data)

    def send_frame(self, identifier: int, data: bytes) -> None:
        """A serial line carries no frames; the player knows."""
        raise NotImplementedError

    def _take(self, longest_s: float) -> None:
        self.received += self._line.read(1, longest_s) if longest_s else self._line.waiting()

    def _waiting(self) -> str:
        return self.received.hex(" ")

    def _send(self, address: int, instruction: Instruction) -> None:
        self.send(pack_request(address, instruction))

    def _reply(self) -> Reply:
        self.wait_for(SIZE)
        data = bytes(self.received[:SIZE])
        del self.received[:SIZE]
        try:
            return unpack_reply(data)
        except (ValueError, ChecksumError):
            raise Unmet("a reply", data.hex(" ") or "nothing") from None


class RealCan(_RealWire):
    """A CAN bus with a module on it."""

    kind = CAN

    def __init__(self, line: CanLine, monotonic: Callable[[], float]) -> None:
        super().__init__(monotonic)
        self._line = line
        self.received: list[tuple[int, bytes]] = []

    def send(self, data: bytes) -> None:
        """A bus carries frames; the player knows."""
        raise NotImplementedError

    def send_frame(self, identifier: int, data: bytes) -> None:
        """Send a frame."""
        self._line.send_frame(identifier, data)

    def _take(self, longest_s: float) -> None:
        frame = self._line.receive_frame(longest_s)
        while frame is not None:
            self.received.append(frame)
            frame = self._line.receive_frame(0.0)

    def _waiting(self) -> str:
        return ", ".join(f"{identifier:#05x} {data.hex(' ')}" for identifier, data in self.received)

    def _send(self, address: int, instruction: Instruction) -> None:
        self.send_frame(address, pack_can_request(instruction))

    def _reply(self) -> Reply:
        self.wait_for(1)
        data = self.received.pop(0)[1] if self.received else b""
        try:
            return unpack_can_reply(data)
        except ValueError:
            raise Unmet("a reply", data.hex(" ") or "nothing") from None


def kind_of(line: Line) -> str:
    """The kind of a line, as sessions name it."""
    return CAN if isinstance(line, CanLine) else SERIAL


def real_player(
    connection: Connection, case: Case, monotonic: Callable[[], float], host: int = HOST
) -> Player:
    """Plays a case on the module at the other end of a connection.

    host: the address in replies on a serial line; on CAN the line has both identifiers
    """
    line = connection.line
    path = str(case.path)
    if isinstance(line, CanLine):
        address, reply = line.identifiers
        return Player(RealCan(line, monotonic), path, case.title, address=address, host=reply or HOST)
    return Player(RealSerial(line, monotonic), path, case.title, address=connection.address, host=host)
