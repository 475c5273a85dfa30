"""The ASCII interface of a real module: lines instead of telegrams, and the way back.

Source: manual 6.6; fidelity PROG-40 to PROG-46.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from tmcm34x.host.connection import Connection

REPLY_S: Final = 1.0
"""How long a line that comes back may take."""
_PART_S: Final = 0.05
_REPLY: Final = re.compile(rb"[A-Za-z]{2} \d+ -?\d+\r")
"""Host's letter, module's letter, status and value; an echo of the line may stand before it."""
_FIRST_LETTER: Final = ord("A") - 1
_LAST_CAPITAL: Final = 26
_FIRST_SMALL: Final = ord("a") - 33
_RETURN: Final = b"\r"


def letter(address: int) -> str:
    """The letter of an address: `A` is module 1, `a` is module 33."""
    return chr((_FIRST_LETTER if address <= _LAST_CAPITAL else _FIRST_SMALL) + address)


class Terminal:
    """Whether the module speaks ASCII, and what is sent to it then."""

    def __init__(self) -> None:
        self.on = False

    def leave(self, address: int) -> bytes:
        """What must be sent before binary telegrams are understood again."""
        if not self.on:
            return b""
        self.on = False
        return f"\r{letter(address)}BIN\r".encode("ascii")

    def send(self, connection: Connection, address: int, line: str) -> str:
        """Send a line, with the module's letter in front of it; what came back, without its line end.

        A telegram that was on its way when the module changed its interface is the beginning of a line for it: that
        ends first.
        """
        words = line.strip().encode("ascii", "replace")
        connection.line.waiting()
        connection.line.write(_RETURN + letter(address).encode("ascii") + words + _RETURN)
        back = self._reply(connection)
        if words.upper() == b"BIN":
            self.on = False
        return back.decode("latin-1").replace("\r", "\n").strip()

    @staticmethod
    def _reply(connection: Connection) -> bytes:
        """What comes until there is a whole reply, or the time is over."""
        line, back = connection.line, b""
        end = line.now() + REPLY_S
        while not _REPLY.search(back) and line.now() < end:
            back += line.read(1, _PART_S) + line.waiting()
        return back
