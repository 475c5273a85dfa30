"""Lines with faults: `Faults` holds those in force and wraps the module's end of lines of any kind.

It takes a `Connect` and gives one back, so that the same faults strike on pseudo terminals, TCP and in memory
(`MemoryClient(faults.wrap(server.connect))`).  The same seed and the same requests give the same faults: every line
and every fault draws random numbers of its own.

A request or a reply is nine bytes, or what comes at once where that is not a multiple of nine.  Replies keep their
order: one that comes after a delayed one waits for it.
"""

from __future__ import annotations

import random
from collections import deque
from collections.abc import Callable, Iterator
from functools import partial
from typing import Final

from tmcm34x.links import BusPeer, Connect, ConnectBus, Peer, Plug, Send, SendFrame
from tmcm34x.links.faults import Fault, FaultError, Piece, kind_named, parse
from tmcm34x.links.timing import Timing
from tmcm34x.tmcl.datagram import (
    SIZE,
    Instruction,
    Reply,
    pack_can_reply,
    pack_can_request,
    pack_reply,
    pack_request,
    unpack_can_reply,
    unpack_can_request,
    unpack_reply,
    unpack_request,
)
from tmcm34x.tmcl.numbers import CONTROL
from tmcm34x.tmcl.status import Status

HARMLESS: Final = Instruction(CONTROL.GET_APPLICATION_STATUS)
"""Get application status: changes nothing in any state of a module, and has a reply even while downloading."""


class Armed:
    """A fault in force, and how often it has struck."""

    def __init__(self, fault: Fault, number: int, end_s: float | None) -> None:
        self.fault = fault
        self.number = number
        self.hits = 0
        self._end_s = end_s
        self._passed = 0

    def over(self, now_s: float) -> bool:
        """Whether it strikes no more."""
        return self.hits == self.fault.at_most or (self._end_s is not None and now_s >= self._end_s)

    def strikes(self, draw: random.Random) -> bool:
        """Whether it strikes the present request or reply; counts it."""
        if self._passed < self.fault.after:
            self._passed += 1
            return False
        if self.fault.probability < 1 and draw.random() >= self.fault.probability:
            return False
        self.hits += 1
        return True


class Faults:
    """The faults in force on some lines.

    timing: of delays and durations; needed once a line is open
    seed: of everything random
    """

    def __init__(self, timing: Timing | None = None, seed: int = 0) -> None:
        self.timing = timing
        self.seed = seed
        self.armed: Final[list[Armed]] = []
        self.struck: dict[str, int] = {}
        """How many requests, replies or lines each kind has struck."""
        self._plugs: list[Plug] = []
        self._lines = 0
        self._count = 0

    def add(self, fault: Fault | str) -> Armed:
        """Put a fault in force, given as such or as text.  Raises `FaultError`."""
        if isinstance(fault, str):
            fault = parse(fault)
        ends = fault.duration_s is not None and fault.kind.strikes != "line"
        self._count += 1
        armed = Armed(fault, self._count, self._now_s() + (fault.duration_s or 0.0) if ends else None)
        self.armed.append(armed)
        return armed

    def clear(self, name: str | None = None) -> None:
        """End the faults of one kind, or all.  Raises `FaultError` for a name that no fault has."""
        kind = None if name is None else kind_named(name)
        self.armed[:] = [each for each in self.armed if kind is not None and each.fault.kind is not kind]

    def cut(self, fault: Fault) -> None:
        """Do at once what `disconnect` or `unplug` does."""
        for plug in tuple(self._plugs):
            if fault.kind.name == "disconnect":
                plug.hang_up()
                continue
            plug.unplug()
            if fault.duration_s is not None:
                self.call_later(fault.duration_s, plug.plug_in)

    def cuts(self, plug: Plug) -> None:
        """Let `disconnect` and `unplug` act on this."""
        self._plugs.append(plug)

    def wrap(self, connect: Connect) -> Connect:
        """`connect` with these faults on its lines."""
        return lambda name, send: _Line(self, connect, name, send)

    def wrap_bus(self, connect: ConnectBus) -> ConnectBus:
        """The same for CAN clients."""
        return lambda name, send: _Node(self, connect, name, send)

    def striking(
        self, strikes: str, draws: Draws, *, can: bool = False
    ) -> Iterator[tuple[Fault, random.Random]]:
        """The faults that strike a request, a reply or the line now, with their random numbers."""
        if not self.armed:
            return
        now_s = self._now_s()
        for armed in tuple(self.armed):
            kind = armed.fault.kind
            if armed.over(now_s):
                self.armed.remove(armed)
            elif kind.strikes == strikes and (kind.can or not can) and armed.strikes(draw := draws.of(armed)):
                self.struck[kind.name] = self.struck.get(kind.name, 0) + 1
                yield armed.fault, draw

    def call_later(self, delay_s: float, action: Callable[[], None]) -> None:
        """Call `action` in `delay_s` seconds."""
        if self.timing is None:
            raise FaultError("a fault that takes time needs a timing")
        self.timing.call_later(delay_s, action)

    def draws(self) -> Draws:
        """The random numbers of one more line."""
        self._lines += 1
        return Draws(f"{self.seed} {self._lines}")

    def _now_s(self) -> float:
        return 0.0 if self.timing is None else self.timing.time()


class Draws:
    """The random numbers of one line, apart for each fault."""

    def __init__(self, seed: str) -> None:
        self._seed = seed
        self._randoms: dict[int, random.Random] = {}

    def of(self, armed: Armed) -> random.Random:
        """Those of one fault."""
        if armed.number not in self._randoms:
            self._randoms[armed.number] = random.Random(f"{self._seed} {armed.number}")
        return self._randoms[armed.number]


class _Delivery:
    """What is on its way to a client, in order."""

    def __init__(self, faults: Faults) -> None:
        self._faults = faults
        self.waiting: Final[deque[Callable[[], object]]] = deque()
        """What is sent when its time has come."""
        self.held: Final[list[Callable[[], object]]] = []
        """What is kept until `release`."""
        self._last_s = 0.0

    def put(self, delay_s: float, send: Callable[[], object]) -> None:
        """Call `send` after a time, and after what was put before."""
        timing = self._faults.timing
        if (not delay_s and not self.waiting) or timing is None:
            send()
            return
        now_s = timing.time()
        self._last_s = max(now_s + delay_s, self._last_s)
        self.waiting.append(send)
        timing.call_later(self._last_s - now_s, self._next)

    def hold(self, send: Callable[[], object]) -> None:
        """Keep something until `release`."""
        self.held.append(send)

    def release(self) -> None:
        """Put what was kept."""
        held = self.held.copy()
        self.held.clear()
        for send in held:
            self.put(0.0, send)

    def clear(self) -> None:
        """Forget all of it."""
        self.waiting.clear()
        self.held.clear()

    def _next(self) -> None:
        if self.waiting:
            self.waiting.popleft()()


class _Faulty:
    """What a serial line and a CAN client share."""

    can = False

    def __init__(self, faults: Faults) -> None:
        self._faults = faults
        self._draws = faults.draws()
        self._delivery = _Delivery(faults)
        self._refused: tuple[int, Instruction] | None = None
        self._armed, self._held, self._waiting = faults.armed, self._delivery.held, self._delivery.waiting
        """All of them empty where a line is as if there were no faults, which costs it nothing but these looks."""

    def _on_request(self, ask: Callable[[bytes], None], data: bytes) -> None:
        """Ask the module what is in `data`, or something harmless, or nothing."""
        self._refused = None
        struck = {
            fault.kind.name: fault for fault, _ in self._faults.striking("request", self._draws, can=self.can)
        }
        if "silent" in struck:
            return
        if "status" in struck and (harmless := self._harmless(int(struck["status"].value), data)):
            data = harmless
        ask(data)

    def _harmless(self, status: int, data: bytes) -> bytes | None:
        """A request in place of `data`, whose reply will be rewritten."""
        raise NotImplementedError

    def _refuse(self, reply: Reply) -> Reply:
        """The reply to what was asked for instead of the refused command, made into that of a refusal."""
        if self._refused is None or reply.command != HARMLESS.number:
            return reply
        (status, asked), self._refused = self._refused, None
        if status == Status.WRONG_CHECKSUM:  # manual 6.2: answered with zeros
            return reply._replace(status=status, command=0, value=0)
        return reply._replace(status=status, command=asked.number, value=asked.value)

    def _on_reply(self, send: Callable[[bytes], object], data: bytes) -> None:
        """Send what becomes of a reply."""
        for fault, _ in self._faults.striking("line", self._draws, can=self.can):
            self._faults.cut(fault)
            return
        pieces = [Piece(data)]
        for fault, draw in self._faults.striking("reply", self._draws, can=self.can):
            if fault.kind.change is None:
                self._delivery.hold(partial(send, data))
                return
            pieces = list(_changed(fault, draw, pieces))
        for piece in pieces:
            self._delivery.put(piece.delay_s, partial(send, piece.data))


def _changed(fault: Fault, draw: random.Random, pieces: list[Piece]) -> Iterator[Piece]:
    assert fault.kind.change is not None
    for piece in pieces:
        for made in fault.kind.change(draw, fault.value, piece.data):
            yield Piece(made.data, made.delay_s + piece.delay_s)


class _Line(_Faulty):
    """One client's serial line."""

    def __init__(self, faults: Faults, connect: Connect, name: str, send: Send) -> None:
        super().__init__(faults)
        self._send = send
        self._peer: Peer = connect(name, self._reply)

    def receive(self, data: bytes) -> None:
        """Take a request, or several."""
        if self._held:
            self._delivery.release()
        if self._armed:
            self._receive(data)
        else:
            self._peer.receive(data)

    def _receive(self, data: bytes) -> None:
        """Take a request, or several, while a fault is in force."""
        step = len(data) if len(data) % SIZE else SIZE
        for start in range(0, len(data), step):
            self._on_request(self._peer.receive, data[start : start + step])

    def disconnect(self) -> None:
        """The client is gone."""
        self._delivery.clear()
        self._peer.disconnect()

    def _harmless(self, status: int, data: bytes) -> bytes | None:
        try:
            address, instruction = unpack_request(data)
        except ValueError:
            return None
        self._refused = status, instruction
        return pack_request(address, HARMLESS)

    def _reply(self, data: bytes) -> None:
        if self._refused is not None:
            data = pack_reply(self._refuse(unpack_reply(data)))
        if self._armed or self._waiting:
            self._on_reply(self._send, data)
        else:
            self._send(data)


class _Node(_Faulty):
    """One client of a CAN bus."""

    can = True

    def __init__(self, faults: Faults, connect: ConnectBus, name: str, send: SendFrame) -> None:
        super().__init__(faults)
        self._send = send
        self._peer: BusPeer = connect(name, self._reply)

    def receive_frame(self, identifier: int, data: bytes, bit_rate: int | None) -> None:
        """Take a frame."""
        if self._held:
            self._delivery.release()
        if not self._armed:
            self._refused = None
            self._peer.receive_frame(identifier, data, bit_rate)
            return
        self._on_request(lambda asked: self._peer.receive_frame(identifier, asked, bit_rate), data)

    def disconnect(self) -> None:
        """The client is gone."""
        self._delivery.clear()
        self._peer.disconnect()

    def _harmless(self, status: int, data: bytes) -> bytes | None:
        try:
            self._refused = status, unpack_can_request(data)
        except ValueError:
            return None
        return pack_can_request(HARMLESS, len(data))

    def _reply(self, identifier: int, data: bytes) -> None:
        if self._refused is not None:
            data = pack_can_reply(self._refuse(unpack_can_reply(data)), len(data))
        if self._armed or self._waiting:
            self._on_reply(partial(self._whole, identifier, len(data)), data)
        else:
            self._send(identifier, data)

    def _whole(self, identifier: int, size: int, data: bytes) -> None:
        """Send a frame; one that has lost bytes is lost."""
        if len(data) == size:
            self._send(identifier, data)
