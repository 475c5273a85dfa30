"""Telegrams to a module and its replies back, over any stream.

The wire is strictly request and reply, but lines are not perfect: bytes may be stray, lost or wrong, and the
reply to a command given up may come late.  So a reply is looked for in what comes, byte by byte: nine bytes with
the right sum, from the right module, to the right command.

Source: manual 6.1, 6.2, 6.7.34, 6.7.36; the two replies of their own form are those of 134 (fidelity PROG) and
136.
"""

from __future__ import annotations

import re
import time
from collections import deque
from collections.abc import Callable
from typing import Final, Self

from tmcm34x.host.exceptions import GarbledReplyError, NoReplyError, RefusedError, ReplyError
from tmcm34x.host.stream import Stream, open_stream
from tmcm34x.tmcl.commands import BY_MNEMONIC
from tmcm34x.tmcl.datagram import SIZE, Instruction, Reply, checksum, pack_request, unpack_reply
from tmcm34x.tmcl.status import Status

READ_MEMORY: Final = 134
VERSION: Final = 136
FACTORY_RESET: Final = 137

_REPEATABLE: Final = {
    READ_MEMORY,
    VERSION,
    *(BY_MNEMONIC[name].number for name in ("GAP", "GGP", "GIO", "GCO")),
}
"""Commands that only read: they may be sent again when it is not known whether they were executed."""
_EVENT: Final = bytes((Status.POSITION_REACHED, 138))
_VERSION_TEXT: Final = re.compile(rb"[0-9]{3,4}[VB][0-9.]{3,4}\Z")


OnTelegram = Callable[[bool, bytes], None]


def _ignore(sent: bool, telegram: bytes) -> None:
    """Telegrams that nobody logs."""


class Connection:
    """A line with modules on it; the module at `address` unless told otherwise.

    timeout_s: how long to wait for a reply, pause time (parameter 75) included
    retries: how often a command that the module cannot have executed, or that only reads, is sent again
    """

    def __init__(self, stream: Stream, *, address: int = 1, timeout_s: float = 1.0, retries: int = 2) -> None:
        self._stream = stream
        self.address = address
        self.timeout_s = timeout_s
        self.retries = retries
        self.on_telegram: OnTelegram = _ignore
        """Told of each telegram: whether it was sent, and its nine bytes."""
        self.events: deque[Reply] = deque(maxlen=100)
        """Second replies of command 138 that came on their own, oldest first."""

    @classmethod
    def open(cls, url: str, *, baud: int = 9600, address: int = 1, timeout_s: float = 1.0) -> Self:
        """A connection to `url`, see `stream.open_stream`.  Raises `LinkError`."""
        return cls(open_stream(url, baud), address=address, timeout_s=timeout_s)

    def close(self) -> None:
        """Hang up."""
        self._stream.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def command(self, number: int, type: int = 0, motor: int = 0, value: int = 0) -> int:  # noqa: A002
        """Have a command executed; returns the value of the reply.  Raises `HostError`."""
        return self.execute(Instruction(number, type, motor, value)).value

    def execute(self, instruction: Instruction, address: int | None = None) -> Reply:
        """Have `instruction` executed; returns the reply, whose status is 100 or 101.

        Raises `RefusedError` for any other status, `ReplyError` when no reply comes, `LinkError`.
        """
        module = self.address if address is None else address
        reply = unpack_reply(self._ask(instruction, pack_request(module, instruction)))
        if reply.status not in {Status.OK, Status.LOADED}:
            raise RefusedError(instruction, reply)
        return reply

    def version(self) -> str:
        """Type and version of the firmware, as the module writes it: `343V4.36`."""
        instruction = Instruction(VERSION)
        return self._ask(instruction, pack_request(self.address, instruction))[1:].decode("ascii")

    def read_instruction(self, address: int) -> Instruction:
        """The instruction at `address` of the program memory."""
        instruction = Instruction(READ_MEMORY, value=address)
        telegram = self._ask(instruction, pack_request(self.address, instruction))
        if telegram[1] == self.address and telegram[2] == Status.NOT_AVAILABLE and telegram[3] == READ_MEMORY:
            raise RefusedError(instruction, unpack_reply(telegram))
        return _instruction(telegram)

    def send(self, instruction: Instruction) -> None:
        """Send a command that is never answered, such as 137."""
        telegram = pack_request(self.address, instruction)
        self.on_telegram(True, telegram)
        self._stream.write(telegram)

    def wait(self, seconds: float) -> None:
        """Let time pass, or less if an event comes; what else comes in is lost."""
        self._search(bytes(SIZE), bytearray(self._stream.read(seconds)), 0)

    def exchange(self, telegram: bytes) -> bytes:
        """Send nine bytes, return the nine bytes that answer them: the one place where the line is used.

        Raises `NoReplyError`, `GarbledReplyError`, `LinkError`.
        """
        self._search(
            telegram, bytearray(self._stream.read(0)), 0
        )  # what is late is no answer, but may be an event
        self.on_telegram(True, telegram)
        self._stream.write(telegram)
        received, start = bytearray(), 0
        end_s = time.monotonic() + self.timeout_s
        while (remaining_s := end_s - time.monotonic()) > 0 and (data := self._stream.read(remaining_s)):
            received += data
            reply, start = self._search(telegram, received, start)
            if reply:
                self.on_telegram(False, reply)
                return reply
        instruction = _instruction(telegram)
        if received:
            raise GarbledReplyError(instruction, f"no reply in {received.hex(' ')}")
        raise NoReplyError(instruction, f"no reply within {self.timeout_s:g} s")

    def _ask(self, instruction: Instruction, telegram: bytes) -> bytes:
        for _ in range(self.retries):
            try:
                reply = self.exchange(telegram)
            except ReplyError:
                if instruction.number not in _REPEATABLE:
                    raise
                continue
            if not _was_damaged(instruction, reply):
                return reply
        return self.exchange(telegram)

    def _search(self, telegram: bytes, received: bytearray, start: int) -> tuple[bytes, int]:
        """The answer to `telegram` in `received` from `start` on, if any, and where to go on searching."""
        while start + SIZE <= len(received):
            window = bytes(received[start : start + SIZE])
            if _is_event(window):
                self.events.append(unpack_reply(window))
                start += SIZE
            elif _answers(telegram, window):
                return window, start
            else:
                start += 1
        return b"", start


def _instruction(telegram: bytes) -> Instruction:
    number, type_, motor = telegram[1:4]
    return Instruction(number, type_, motor, int.from_bytes(telegram[4:8], "big", signed=True))


def _is_event(window: bytes) -> bool:
    return window[2:4] == _EVENT and checksum(window[:-1]) == window[-1]


def _answers(telegram: bytes, window: bytes) -> bool:
    address, number, type_ = telegram[:3]
    if number == VERSION and type_ == 0:
        return _VERSION_TEXT.match(window[1:]) is not None
    if checksum(window[:-1]) != window[-1]:
        return False
    if number == READ_MEMORY:
        return True
    return window[1] == address and (window[3] == number or window[2] == Status.WRONG_CHECKSUM)


def _was_damaged(instruction: Instruction, reply: bytes) -> bool:
    """Whether the module says that the command did not arrive as it was sent."""
    return reply[2] == Status.WRONG_CHECKSUM and instruction.number != READ_MEMORY
