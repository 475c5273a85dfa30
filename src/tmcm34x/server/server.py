"""The loop that keeps a bench at the wall clock's time and its lines served.

One asyncio loop.  Virtual time moves in two cases only: bytes come in, and it is first brought to now, so that
they are executed at the right time; or the next event of the bench is due, for which a timer is set.  When
there is no next event, nothing runs.

Work that takes longer than a slice is broken off and goes on after the links have been looked at.
"""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Awaitable, Callable, Sequence
from typing import TYPE_CHECKING, Final

from tmcm34x import clock
from tmcm34x.bench.crowd import Crowd
from tmcm34x.links import CanLink, Connect, Link, Peer, Plug, Send, pacing
from tmcm34x.links.timing import LoopTiming
from tmcm34x.server.lines import Bus, ClientLine, LineRecorder
from tmcm34x.server.pace import Pace
from tmcm34x.tmcl.global_parameters import BAUD_RATES

if TYPE_CHECKING:
    from tmcm34x.bench import Rig
    from tmcm34x.links.faulty import Faults
    from tmcm34x.server.store import Store
    from tmcm34x.server.telegram_log import Sink

SLICE_S: Final = 0.0002
"""Longest work on virtual time between two looks at the links."""
MAX_LAG_S: Final = 1.0
"""A bench that lags more than this behind the wall clock gives up catching up: the time is lost."""

_UNKNOWN: Final = -1
"""The next event, when the bench may have been changed since it was asked for."""
_FAR_S: Final = 1e6
"""Longest sleep; the event loop takes no longer one."""


class Server:
    """A bench with its links.

    speed: see `Pace`
    monotonic: the wall clock [s]
    stores: what keeps the modules' memories
    log: where telegrams are written down
    any_address: serial ports take telegrams for all addresses, as on USB
    strict_baud: bytes of a client count only at the bit rate of the module's global parameter 65, if its link has one
    paced: bytes of serial lines take their time at that bit rate
    faults: what goes wrong on the lines
    lazy: modules that have nothing to do are left alone, for benches of many: see `bench.crowd`

    `open` and `close` belong to a running event loop; `catch_up` needs none.
    """

    def __init__(
        self,
        rig: Rig,
        *,
        speed: float = 1.0,
        monotonic: Callable[[], float] = time.monotonic,
        stores: Sequence[Store] = (),
        log: Sink | None = None,
        any_address: bool = False,
        strict_baud: bool = False,
        paced: bool = False,
        faults: Faults | None = None,
        lazy: bool = False,
    ) -> None:
        self.rig = rig
        self.crowd = Crowd(rig) if lazy else None
        """The modules one by one, for lines."""
        self.part: clock.TimedBench = rig if self.crowd is None else self.crowd
        """What is advanced: bench or crowd, or the bench with what takes samples or keeps a history of it."""
        self.recorder: LineRecorder | None = None
        """What keeps telegrams and frames; set it before links are opened."""
        self.pace = Pace(speed, monotonic)
        self.pace.draw(rig.now)
        self._stores = stores
        self.log = log
        self.any_address = any_address
        self._strict_baud = strict_baud
        self._paced = paced
        self._latency_ms = pacing.LATENCY_MS if paced else 0
        self.faults = faults
        self.on_close: list[Callable[[], Awaitable[None]]] = []
        """Called before the links are closed: the control socket's end, for one."""
        self._links: list[Link | CanLink] = []
        self._bus: Bus | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._timer: asyncio.TimerHandle | None = None
        self._timer_s = 0.0
        self._next = _UNKNOWN

    def start(self) -> None:
        """Keep the bench at the wall clock's time on the running event loop; opening a link does it too."""
        if self._loop is None:
            self._loop = asyncio.get_running_loop()
            for store in self._stores:
                store.start()
        self.settle()

    async def open(self, link: Link, only: int | None = None) -> str:
        """Serve clients of `link`; returns the address that they use.  Raises `LinkError`.

        only: the one module that is on the line; None: all
        """
        self.start()
        baud_rate = link.baud_rate if self._strict_baud else None
        latency_ms = link.latency_ms + self._latency_ms

        def connect(name: str, send: Send) -> Peer:
            return ClientLine(self, name, send, latency_ms=latency_ms, baud_rate=baud_rate, only=only)

        address = await link.open(self._disturbed(connect, link))
        self._links.append(link)
        self.settle()
        return address

    def _disturbed(self, connect: Connect, link: Link) -> Connect:
        """`connect` with faults and pace: a fault strikes at the module's end of the wire."""
        timing = LoopTiming(asyncio.get_running_loop())
        if self.faults is not None:
            self.faults.timing = timing
            if isinstance(link, Plug):
                self.faults.cuts(link)
            connect = self.faults.wrap(connect)
        return pacing.pace(connect, self._bit_rate, timing) if self._paced else connect

    def _bit_rate(self) -> int:
        return BAUD_RATES[self.rig.modules[0].baud_index]

    async def open_can(self, link: CanLink) -> str:
        """Serve clients of `link` on the modules' CAN bus; returns the address that they use.  Raises `LinkError`."""
        self.start()
        if self._bus is None:
            self._bus = Bus(self)
        connect = self._bus.connect
        if self.faults is not None:
            self.faults.timing = LoopTiming(asyncio.get_running_loop())
            if isinstance(link, Plug):
                self.faults.cuts(link)
            connect = self.faults.wrap_bus(connect)
        address = await link.open(connect)
        self._links.append(link)
        self.settle()
        return address

    async def close(self) -> None:
        """Hang up everywhere and save what is not saved yet."""
        for close in self.on_close:
            await close()
        self.on_close.clear()
        for link in self._links:
            link.close()
        self._links.clear()
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        self._loop = None
        for store in self._stores:
            await store.close()

    def connect(self, name: str, send: Send) -> Peer:
        """The modules' end of a new line of a client in this process: a `Connect`, without pace and faults."""
        return ClientLine(self, name, send, latency_ms=self._latency_ms)

    def catch_up(self) -> bool:
        """Bring virtual time to now, or as near as one slice of work allows; says whether it got there.

        Call it before anything that looks at the bench or touches it from outside, and `settle` afterwards.
        """
        done = self.arrive()
        if self.crowd is not None:
            self.crowd.gather()
        return done

    def arrive(self) -> bool:
        """The same for a line, which brings the modules that it needs there by itself; `look_ahead` afterwards."""
        target = self.pace.target()
        if target < self.rig.now:
            target = self._turn_back()
        when, self._next = self._next, _UNKNOWN
        if when <= target and not self._work(target):
            return False
        if target < clock.NEVER:
            self.part.pass_to(target)
        return True

    def _turn_back(self) -> int:
        """The wall clock has gone back: time goes on from where the bench is, which is given back."""
        now = self.rig.now
        self.pace.draw(now)
        return now

    def settle(self) -> None:
        """Something may have been done on the bench: look ahead."""
        if self.crowd is not None:
            self.crowd.forget()
        self.look_ahead()

    def look_ahead(self) -> None:
        """Set the timer for the next event."""
        self._next = when = self.part.next_event()
        if when < clock.NEVER and self._loop is not None:
            self._set_timer(self._loop, self.pace.due_s(when))

    def change_pace(self, speed: float | None = None, paused: bool | None = None) -> None:
        """Go on at another speed, or stop, or go on."""
        self.catch_up()
        self.pace.draw(self.rig.now, speed, paused)
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        self.settle()

    async def run_until(self, until: int) -> None:
        """Bring virtual time to clock `until` as fast as possible; links are served between slices of work."""
        rig, part = self.rig, self.part
        while rig.now < until:
            self._next = _UNKNOWN
            end_s = self.pace.monotonic() + SLICE_S
            while (when := part.next_event()) <= until and self.pace.monotonic() < end_s:
                part.advance(when)
            if when > until:
                part.advance(until)
            self.pace.draw(rig.now)
            self.settle()
            await asyncio.sleep(0)

    def restore(self, snapshot: bytes) -> None:
        """Go back to a snapshot of the bench; raises `bench.snapshot.SnapshotError` and changes nothing then."""
        self.put_back(lambda: self._restore(snapshot))

    def _restore(self, snapshot: bytes) -> None:
        before = self.rig.now
        self.rig.restore(snapshot)
        if self.recorder is not None:
            self.recorder.restored(before)

    def put_back(self, bring: Callable[[], None]) -> None:
        """Have `bring` make another moment of the bench the present one."""
        self.catch_up()
        try:
            bring()
            for store in self._stores:
                store.renew_soon()
        finally:
            self._next = _UNKNOWN
            self.pace.draw(self.rig.now)
            self.settle()

    def _work(self, target: int) -> bool:
        """Run the events up to `target`, for one slice at most; says whether all are done."""
        part, monotonic = self.part, self.pace.monotonic
        end_s = monotonic() + SLICE_S
        while (when := part.next_event()) <= target:
            if when == clock.NEVER:
                break
            part.advance(when)
            if (wall_s := monotonic()) >= end_s:
                if wall_s - self.pace.due_s(self.rig.now) > MAX_LAG_S:
                    self.pace.draw(self.rig.now)
                return part.next_event() > target
        return True

    def _set_timer(self, loop: asyncio.AbstractEventLoop, due_s: float) -> None:
        # A timer that fires too early does no harm, so a pending one is only ever replaced by an earlier one.
        if self._timer is not None:
            if self._timer_s <= due_s:
                return
            self._timer.cancel()
            self._timer = None
        if due_s < math.inf:
            self._timer_s = due_s
            self._timer = loop.call_later(min(due_s - self.pace.monotonic(), _FAR_S), self._wake)

    def _wake(self) -> None:
        self._timer = None
        self.arrive()
        self.look_ahead()
