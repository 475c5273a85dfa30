"""Virtual time that moves on with what a host does on its lines.

Time passes in three ways, and stands still otherwise:

- Every request and reply takes the time of its bits, and a request `REQUEST` at least.
- A pause of the host between two requests counts as long as it lasted, if it lasted `PAUSE_S` or more; so host code
  that sleeps sees the module go on.
- While the module owes a reply (telegram pause, second reply of command 138), time runs ahead to it: at once for the
  telegram pause, else when the host has been quiet for `PAUSE_S`.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from tmcm34x.clock import HZ, MS, NEVER, Timed, clocks, run_until
from tmcm34x.links import BusPeer, CanLink, Connect, ConnectBus, Link, Peer, Plug, Send, SendFrame
from tmcm34x.tmcl.global_parameters import BAUD_RATES, CAN_BIT_RATES
from tmcm34x.tmcl.numbers import GP

if TYPE_CHECKING:
    from tmcm34x.bench import Rig
    from tmcm34x.links.timing import VirtualTiming
    from tmcm34x.server import Server
    from tmcm34x.trace.picture import PictureRecorder

PAUSE_S: Final = 0.005
REQUEST: Final = MS
"""Clocks that a request takes at least, with what the host does before the next one."""
FAR: Final = 3600 * HZ
"""Clocks that time runs ahead at most to a reply that the module owes."""
_BITS_OF_BYTE: Final = 10
_BITS_OF_FRAME: Final = 111
"""Of a CAN frame with eight bytes, stuff bits left out."""


class Clockwork:
    """The virtual time of a bench, of its delayed replies, and of the picture of its motors."""

    def __init__(self, rig: Rig, server: Server, timing: VirtualTiming, picture: PictureRecorder) -> None:
        self._rig = rig
        self.part: Timed = rig
        """What is advanced: the bench, or the bench with what keeps a history of it."""
        self._server = server
        self._timing = timing
        self._picture = picture

    def next_event(self) -> int:
        """The next clock at which something could be noticed."""
        return min(self.part.next_event(), self._timing.next_event())

    def advance(self, now: int) -> None:
        """Go to `now`, at most the next event."""
        self.part.advance(now)
        self._server.pace.draw(now)
        self._timing.advance(now)
        self._picture.after(now)

    def go_on(self, until: int, longest: int) -> None:
        """Go to the next event, `longest` clocks on, or `until`, whatever comes first."""
        self.advance(min(self.next_event(), self._rig.now + longest, until))

    def search(self, holds: Callable[[], object], until: int, longest: int) -> bool:
        """Go on until `holds` or `until`, looking at each event and every `longest` clocks; says whether it holds."""
        rig = self._rig
        found = bool(holds())
        while not found and rig.now < until:
            self.go_on(until, longest)
            found = bool(holds())
        return found


class VirtualPace:
    """Moves the time of `clockwork` on; see the module's text."""

    def __init__(self, rig: Rig, clockwork: Clockwork) -> None:
        self._rig = rig
        self._clockwork = clockwork
        self._last_s = 0.0
        self._requests = 0
        self.loop: asyncio.AbstractEventLoop | None = None
        """The event loop of lines to other programs."""

    def begin(self, bits: int, bit_rate: int) -> None:
        """A request of so many bits has arrived."""
        now_s = time.monotonic()
        pause_s = now_s - self._last_s if self._last_s else 0.0
        self._requests += 1
        passed = max(REQUEST, bits * HZ // bit_rate)
        if pause_s >= PAUSE_S:
            passed = max(passed, clocks(pause_s))
        run_until(self._clockwork, self._rig.now + passed)

    def end(self, bits: int, bit_rate: int) -> None:
        """The request has been executed and answered with so many bits, or not."""
        if bits:
            run_until(self._clockwork, self._rig.now + bits * HZ // bit_rate)
        if any(module.outbox for module in self._rig.modules):
            self.pay(lambda: not any(module.outbox for module in self._rig.modules))
        self._last_s = time.monotonic()
        if self.loop is not None and self._owed():
            self.loop.call_later(PAUSE_S, self._pay_if_quiet, self._requests)

    def pay(self, paid: Callable[[], bool]) -> None:
        """Run ahead to a reply that the module owes, if there is one to come."""
        until = self._rig.now + FAR
        while not paid() and (when := self._clockwork.next_event()) < min(until, NEVER):
            run_until(self._clockwork, when)

    def _owed(self) -> bool:
        return any(module.owes_reply for module in self._rig.modules)

    def _pay_if_quiet(self, requests: int) -> None:
        if requests == self._requests:
            self.pay(lambda: not self._owed())

    @property
    def bit_rate(self) -> int:
        """Of the serial line."""
        return BAUD_RATES[self._rig.modules[0].baud_index]

    @property
    def can_bit_rate(self) -> int:
        """Of the CAN bus."""
        return CAN_BIT_RATES[self._rig.modules[0].eeprom.global_values[GP.CAN_BIT_RATE]]

    def wrap(self, connect: Connect) -> Connect:
        """`connect` with this pace."""
        return lambda name, send: _Line(self, connect, name, send)

    def wrap_bus(self, connect: ConnectBus) -> ConnectBus:
        """The same for CAN clients."""
        return lambda name, send: _Node(self, connect, name, send)


class _Line:
    """One client's serial line."""

    def __init__(self, pace: VirtualPace, connect: Connect, name: str, send: Send) -> None:
        self._pace = pace
        self._send = send
        self._bits = 0
        self._peer: Peer = connect(name, self._reply)
        self.disconnect = self._peer.disconnect

    def receive(self, data: bytes) -> None:
        """Take what the host sends."""
        pace = self._pace
        pace.begin(_BITS_OF_BYTE * len(data), pace.bit_rate)
        self._bits = 0
        self._peer.receive(data)
        pace.end(self._bits, pace.bit_rate)

    def _reply(self, data: bytes) -> None:
        self._bits += _BITS_OF_BYTE * len(data)
        self._send(data)


class _Node:
    """One client of a CAN bus."""

    def __init__(self, pace: VirtualPace, connect: ConnectBus, name: str, send: SendFrame) -> None:
        self._pace = pace
        self._send = send
        self._bits = 0
        self._peer: BusPeer = connect(name, self._reply)
        self.disconnect = self._peer.disconnect

    def receive_frame(self, identifier: int, data: bytes, bit_rate: int | None) -> None:
        """Take a frame."""
        pace = self._pace
        pace.begin(_BITS_OF_FRAME, pace.can_bit_rate)
        self._bits = 0
        self._peer.receive_frame(identifier, data, bit_rate)
        pace.end(self._bits, pace.can_bit_rate)

    def _reply(self, identifier: int, data: bytes) -> None:
        self._bits += _BITS_OF_FRAME
        self._send(identifier, data)


class PacedLink:
    """A link whose clients move virtual time on."""

    def __init__(self, link: Link, pace: VirtualPace) -> None:
        self._link = link
        self._pace = pace
        self.kind, self.latency_ms = link.kind, link.latency_ms
        self.close = link.close
        if isinstance(link, Plug):
            self.hang_up, self.unplug, self.plug_in = link.hang_up, link.unplug, link.plug_in

    @property
    def baud_rate(self) -> Callable[[], int] | None:
        """That of the link."""
        return self._link.baud_rate

    async def open(self, connect: Connect) -> str:
        """Open the link."""
        return await self._link.open(self._pace.wrap(connect))


class PacedCanLink:
    """A CAN link whose clients move virtual time on."""

    def __init__(self, link: CanLink, pace: VirtualPace) -> None:
        self._link = link
        self._pace = pace
        self.kind = link.kind
        self.close = link.close

    async def open(self, connect: ConnectBus) -> str:
        """Open the link."""
        return await self._link.open(self._pace.wrap_bus(connect))
