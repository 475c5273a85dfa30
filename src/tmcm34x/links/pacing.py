"""Bytes that take their time: a line at a bit rate, whatever carries it.

Ten bits a byte (start, eight data, stop), both directions apart.  A telegram is there when its last bit is; between
the end of a request and the start of its reply passes one more character time, in which an RS485 transceiver turns
from receiving to sending (an assumption, fidelity WIRE-10).

A timer of an event loop is late by as much as the computer is busy.  Such delays do not add up: the next request counts
from when the reply was due.

Leaves out: two ends that send at once on a half-duplex line disturb each other on real RS485, and do not here.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from functools import partial
from typing import Final

from tmcm34x.links import Connect, Peer, Send
from tmcm34x.links.timing import Timing
from tmcm34x.tmcl.datagram import SIZE

BITS: Final = 10
"""Bits of a byte on the line."""
TURNAROUND: Final = 1
"""Characters between a request and its reply."""
LATENCY_MS: Final = 10
"""How much later than its neighbour a byte may be delivered: a telegram's length at the lowest rate, 9600."""

BitRate = Callable[[], int]
"""Gives the present bits per second of a line."""


def pace(connect: Connect, bit_rate: BitRate, timing: Timing) -> Connect:
    """`connect` for lines whose bytes take their time."""
    return lambda name, send: _PacedLine(connect, name, send, bit_rate, timing)


class _PacedLine:
    """One client's line."""

    def __init__(self, connect: Connect, name: str, send: Send, bit_rate: BitRate, timing: Timing) -> None:
        self._timing = timing
        self._bit_rate = bit_rate
        self._send = send
        self._late_s = 0.0
        self._replies = _Wire(bit_rate, timing, self._answer)
        self._requests = _Wire(bit_rate, timing, self._deliver)
        self._end_s: float | None = None
        self._peer: Peer = connect(name, self._reply)

    def receive(self, data: bytes) -> None:
        """Take bytes that the client sends now.

        A client waits for a reply before it goes on: by what the timer was late with the last one, it is late too.
        """
        self._requests.send(data, self._timing.time() - self._late_s)

    def disconnect(self) -> None:
        """The client is gone, and with it what is still on its way."""
        self._requests.clear()
        self._replies.clear()
        self._peer.disconnect()

    def _deliver(self, data: bytes) -> None:
        # What is answered at once is sent as from the end of the request, however late the timer was.
        self._end_s = self._requests.due_s
        try:
            self._peer.receive(data)
        finally:
            self._end_s = None

    def _answer(self, data: bytes) -> None:
        self._late_s = self._timing.time() - self._replies.due_s
        self._send(data)

    def _reply(self, data: bytes) -> None:
        start_s = self._timing.time() if self._end_s is None else self._end_s
        self._replies.send(data, start_s + TURNAROUND * BITS / self._bit_rate())


class _Wire:
    """One direction of a line: bytes in order, each piece delivered when its last bit has passed."""

    def __init__(self, bit_rate: BitRate, timing: Timing, deliver: Send) -> None:
        self._bit_rate = bit_rate
        self._timing = timing
        self._deliver = deliver
        self._queue: deque[tuple[float, bytes]] = deque()
        self._free_s = 0.0
        self._armed = False
        self.due_s = 0.0
        """When the last bit of the piece that is being delivered has passed [s]."""

    def send(self, data: bytes, start_s: float) -> None:
        """Begin to send at `start_s` or when the bytes before have passed."""
        end_s = max(start_s, self._free_s)
        byte_s = BITS / self._bit_rate()
        for piece in _pieces(data):
            end_s += len(piece) * byte_s
            self._queue.append((end_s, piece))
        self._free_s = end_s
        self._arm()

    def clear(self) -> None:
        """Forget what has not been delivered."""
        self._queue.clear()

    def _arm(self) -> None:
        if self._queue and not self._armed:
            self._armed = True
            self._timing.call_later(max(0.0, self._queue[0][0] - self._timing.time()), self._run)

    def _run(self) -> None:
        self._armed = False
        if self._queue:
            self.due_s, piece = self._queue.popleft()
            self._deliver(piece)
        self._arm()


def _pieces(data: bytes) -> Iterator[bytes]:
    """Telegrams, and what is left over of one."""
    return map(partial(_piece, data), range(0, len(data), SIZE))


def _piece(data: bytes, start: int) -> bytes:
    return data[start : start + SIZE]
