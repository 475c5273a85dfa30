"""A CAN adapter that speaks Lawicel's SLCAN on a pseudo terminal, with the module on its bus.

Any program that drives such an adapter can open it: python-can's `slcan`, PyTrinamic's `slcan_tmcl`, `slcand`.  A
channel that is closed neither sends nor receives; one that only listens does not send; one with another bit rate than
the module is not understood.

Leaves out: acceptance filters (M, m) and bus timing registers (s), which are taken and have no effect.  Remote
frames are taken and reach no node.

Source: LAWICEL CANUSB manual; fidelity WIRE-7.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Final, NamedTuple

from tmcm34x.links import EXTENDED, BusPeer, ConnectBus, Peer, Send

assert sys.platform != "win32"

from tmcm34x.links.posix.pty import PtyLink  # noqa: E402 - on Windows a checker finds nothing there

BIT_RATES: Final = (10_000, 20_000, 50_000, 100_000, 125_000, 250_000, 500_000, 800_000, 1_000_000)
"""Bits per second by the digit of the command S."""
LONGEST_LINE: Final = 64
LARGEST_IDENTIFIER: Final = 0x7FF
LARGEST_EXTENDED_IDENTIFIER: Final = (1 << 29) - 1

_OK: Final = ""
_ERROR: Final = b"\a"
_MINUTE_MS: Final = 60_000


class SlcanLink:
    """A pseudo terminal with an adapter behind it.

    link: symbolic link to create, as for `PtyLink`
    milliseconds: the clock of the time stamps
    """

    kind = "slcan"

    def __init__(self, link: str | None, milliseconds: Callable[[], int]) -> None:
        self._pty = PtyLink(link)
        self._milliseconds = milliseconds

    async def open(self, connect: ConnectBus) -> str:
        """Create the terminal; returns its path, or that of the symbolic link."""

        def plug_in(_: str, send: Send) -> Peer:
            return SlcanAdapter(connect, send, self._milliseconds)

        return await self._pty.open(plug_in)

    def close(self) -> None:
        """Remove the symbolic link and hang up."""
        self._pty.close()

    def hang_up(self) -> None:
        """Replace the terminal by another one."""
        self._pty.hang_up()

    def unplug(self) -> None:
        """Remove the terminal."""
        self._pty.unplug()

    def plug_in(self) -> None:
        """Make another terminal."""
        self._pty.plug_in()


class _Refused(Exception):  # noqa: N818
    """A line that the adapter answers with BELL."""


class SlcanAdapter:
    """The adapter: lines of text from and to the host, frames to and from the bus."""

    def __init__(self, connect: ConnectBus, send: Send, milliseconds: Callable[[], int]) -> None:
        self._bus: BusPeer = connect("slcan", self._deliver)
        self._send = send
        self._milliseconds = milliseconds
        self._line = bytearray()
        self._bit_rate = 0
        self._open = False
        self._listening = False
        self._stamped = False

    def receive(self, data: bytes) -> None:
        """Take characters from the host; each CR ends a line."""
        *lines, rest = (self._line + data).split(b"\r")
        self._line = bytearray(rest[: LONGEST_LINE + 1])
        for line in lines:
            try:
                self._execute(line.decode("ascii"))
            except (_Refused, ValueError):
                self._send(_ERROR)

    def disconnect(self) -> None:
        """The host has closed the terminal: the channel closes with it."""
        self._open = False
        self._bus.disconnect()

    def _deliver(self, identifier: int, data: bytes) -> None:
        if self._open:
            stamp = f"{self._milliseconds() % _MINUTE_MS:04X}" if self._stamped else ""
            extended = identifier & EXTENDED
            name = f"T{identifier & ~EXTENDED:08X}" if extended else f"t{identifier:03X}"
            self._send(f"{name}{len(data)}{data.hex().upper()}{stamp}\r".encode("ascii"))

    def _execute(self, line: str) -> None:
        """Do what a line says and answer it; a frame goes out after the answer, as its replies do."""
        frame = _FRAMES.get(line[:1]) if self._open and not self._listening else None
        if frame is None:
            self._answer(self._set(line))
            return
        identifier, data = frame.read(line[1:])
        self._answer(frame.answer)
        self._bus.receive_frame(identifier, data, self._bit_rate)

    def _answer(self, text: str) -> None:
        self._send(f"{text}\r".encode("ascii"))

    def _set(self, line: str) -> str:
        """Do what a line without a frame for the bus says; returns the answer, CR excluded."""
        operand = line[1:]
        match line[:1]:
            case "":
                return _OK
            case "S" if not self._open and operand.isdecimal() and int(operand) < len(BIT_RATES):
                self._bit_rate = BIT_RATES[int(operand)]
                return _OK
            case "O" | "L" if not self._open and not operand:
                self._open, self._listening = True, line == "L"
                return _OK
            case "C":
                self._open = False
                return _OK
            case "r" | "R" if self._open and not self._listening:
                return "Z" if line[0] == "R" else "z"
            case "Z" if not self._open and operand in {"0", "1"}:
                self._stamped = operand == "1"
                return _OK
            case "s" | "M" | "m" if not self._open:
                return _OK
            case "F" if self._open:
                return "F00"
            case "V" | "v" | "N":
                return _IDENTITY[line[0]]
            case _:
                raise _Refused


class _Frame(NamedTuple):
    """A kind of frame that a host may send: digits of its identifier, largest one, flag, answer."""

    digits: int
    largest: int
    flag: int
    answer: str

    def read(self, operand: str) -> tuple[int, bytes]:
        """Identifier and data; raises `_Refused` or `ValueError`."""
        identifier, size = int(operand[: self.digits], 16), int(operand[self.digits : self.digits + 1])
        data = bytes.fromhex(operand[self.digits + 1 :])
        if size > 8 or len(data) != size or identifier > self.largest:
            raise _Refused
        return identifier | self.flag, data


_FRAMES: Final = {
    "t": _Frame(3, LARGEST_IDENTIFIER, 0, "z"),
    "T": _Frame(8, LARGEST_EXTENDED_IDENTIFIER, EXTENDED, "Z"),
}

_IDENTITY: Final = {"V": "V1011", "v": "v0343", "N": "N034X"}
"""Hardware and software version, firmware version, serial number."""
