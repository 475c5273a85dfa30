"""The line to a real module: time is that of the wall, and answers are waited for."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from tmcm34x.bench.session.errors import Unmet
from tmcm34x.bench.session.player import SERIAL
from tmcm34x.clock import HZ, seconds
from tmcm34x.tmcl.datagram import SIZE, ChecksumError, Instruction, pack_request, unpack_reply

if TYPE_CHECKING:
    from tmcm34x.host.line import Line

ANSWER_S: Final = 1.0
"""How long an answer is waited for."""
QUIET_S: Final = 0.1
"""How long a line must be quiet where no answer is expected."""


class RealSerial:
    """A serial line or socket with a module at its other end.

    monotonic: the wall clock [s]
    """

    kind = SERIAL
    rig = None

    def __init__(self, line: Line, monotonic: Callable[[], float]) -> None:
        self._line = line
        self._monotonic = monotonic
        self._start_s = monotonic()
        self.received = bytearray()

    @property
    def now(self) -> int:
        """The time since the line was opened, in chip clocks."""
        return round((self._monotonic() - self._start_s) * HZ)

    def send(self, data: bytes) -> None:
        """Send bytes."""
        self._line.write(data)

    def send_frame(self, identifier: int, data: bytes) -> None:
        """A serial line carries no frames; the player knows."""
        raise NotImplementedError

    def advance(self, clocks: int) -> None:
        """Wait; what comes meanwhile is kept."""
        self._collect(seconds(clocks), lambda: False)

    def settle(self) -> None:
        """Take what has come."""
        self.received += self._line.waiting()

    def wait_for(self, size: int) -> None:
        """Wait until so many bytes have come, or no more do."""
        self._collect(ANSWER_S, lambda: len(self.received) >= size)

    def wait_for_nothing(self) -> None:
        """Wait whether something comes."""
        self._collect(QUIET_S, lambda: bool(self.received))

    def ask(self, address: int, instruction: Instruction) -> tuple[int, int]:
        """Status and value of a command."""
        if self.received:
            raise Unmet("every reply to be expected by a line", f"one that was not: {self.received.hex(' ')}")
        self.send(pack_request(address, instruction))
        self.wait_for(SIZE)
        data = bytes(self.received[:SIZE])
        del self.received[:SIZE]
        try:
            reply = unpack_reply(data)
        except (ValueError, ChecksumError):
            raise Unmet("a reply", data.hex(" ") or "nothing") from None
        return reply.status, reply.value

    def _collect(self, longest_s: float, done: Callable[[], bool]) -> None:
        end_s = self._monotonic() + longest_s
        while not done() and (left_s := end_s - self._monotonic()) > 0:
            self.received += self._line.read(1, left_s)
