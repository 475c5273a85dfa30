"""Clients of a server: their lines to the modules, and the CAN bus."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Final, Protocol

from tmcm34x.bench.lines import CanEnd, SerialEnd
from tmcm34x.links import BusPeer, Send, SendFrame
from tmcm34x.server.telegram_log import LineLog

if TYPE_CHECKING:
    from tmcm34x.bench import Rig
    from tmcm34x.bench.crowd import Crowd
    from tmcm34x.bench.lines import LineEnd
    from tmcm34x.server.pace import Pace
    from tmcm34x.server.telegram_log import Sink
    from tmcm34x.tmcl.telegrams import Direction

TIME_OUT_S: Final = 0.005
"""A partial telegram is dropped when the next bytes come later than this after the last ones (fidelity WIRE-3)."""


class LineRecorder(Protocol):
    """Keeps what comes over lines; each method is called at the bench's clock, after it has happened."""

    def plugged(self, end: LineEnd, /) -> None:
        """A client has come; what the line receives is for `end.record`."""
        ...

    def unplugged(self, end: LineEnd, /) -> None:
        """The client has gone."""
        ...

    def restored(self, before: int, /) -> None:
        """The bench was brought from clock `before` to a state from elsewhere."""
        ...


class Served(Protocol):
    """A bench as its lines need it: `server.server.Server`, which says what the attributes are."""

    rig: Rig
    crowd: Crowd | None
    pace: Pace
    log: Sink | None
    recorder: LineRecorder | None
    any_address: bool

    def arrive(self) -> bool:
        """Bring the bench to the present clock before bytes are received."""
        ...

    def look_ahead(self) -> None:
        """Bytes were received: the next event may be another one."""
        ...

    def catch_up(self) -> bool:
        """Bring all modules to the present clock before anything else is done."""
        ...

    def settle(self) -> None:
        """Something else was done."""
        ...


class ClientLine:
    """One client's line to the modules.

    A telegram that stops in the middle is given up after a time of the wall's, whatever the speed: it is the
    client that does not go on.
    """

    def __init__(
        self,
        server: Served,
        name: str,
        send: Send,
        *,
        latency_ms: int = 0,
        baud_rate: Callable[[], int] | None = None,
        only: int | None = None,
    ) -> None:
        self._server = server
        self._pace = server.pace
        self._log = None if server.log is None else LineLog(server.log, name)
        self._send = send
        self._baud_rate = baud_rate
        reply = send if self._log is None else self._log_and_send
        self._end = SerialEnd(
            server.rig, reply, any_address=server.any_address, only=only, crowd=server.crowd
        )
        self._time_out_s = TIME_OUT_S + latency_ms / 1000
        self._last_s = -math.inf
        if server.recorder is not None:
            server.recorder.plugged(self._end)

    def receive(self, data: bytes) -> None:
        """Take bytes that the client sent."""
        server = self._server
        server.arrive()
        wall_s = self._pace.wall_s
        if self._log is not None:
            self._log.add(server.rig.now, ">", data, text=self._end.speaks_ascii)
        over = wall_s - self._last_s > self._time_out_s
        baud_rate = None if self._baud_rate is None else self._baud_rate()
        self._end.receive(data, over, baud_rate)
        self._last_s = wall_s
        server.look_ahead()

    def disconnect(self) -> None:
        """The client is gone."""
        server = self._server
        server.catch_up()
        self._end.unplug()
        if server.recorder is not None:
            server.recorder.unplugged(self._end)
        server.settle()

    def _log_and_send(self, data: bytes) -> None:
        assert self._log is not None
        self._log.add(self._server.rig.now, "<", data, text=self._end.speaks_ascii)
        self._send(data)


class Bus:
    """The CAN bus that joins all modules and all CAN clients; what one client sends reaches all others.

    The log gets each frame once: a request from the client that sends it, a reply with the client that asked last.
    """

    def __init__(self, server: Served) -> None:
        self.server = server
        self.clients: list[_Node] = []
        self.asking: _Node | None = None
        self.end = CanEnd(server.rig, self._reply, crowd=server.crowd)
        if server.recorder is not None:
            server.recorder.plugged(self.end)

    def connect(self, name: str, send: SendFrame) -> BusPeer:
        """A further client."""
        self.clients.append(node := _Node(self, name, send))
        return node

    def leave(self, node: _Node) -> None:
        """A client is gone."""
        self.clients.remove(node)
        if self.asking is node:
            self.asking = None

    def _reply(self, identifier: int, data: bytes) -> None:
        for client in self.clients[:1] if self.asking is None else (self.asking,):
            client.log("<", identifier, data)
        for client in self.clients:
            client.send(identifier, data)


class _Node:
    """One client on the bus."""

    def __init__(self, bus: Bus, name: str, send: SendFrame) -> None:
        self._bus = bus
        self._log = None if bus.server.log is None else LineLog(bus.server.log, name)
        self.send = send

    def receive_frame(self, identifier: int, data: bytes, bit_rate: int | None) -> None:
        """Take a frame from the client; modules with another bit rate do not understand it."""
        server = self._bus.server
        server.arrive()
        self._bus.asking = self
        self.log(">", identifier, data)
        for client in self._bus.clients:
            if client is not self:
                client.send(identifier, data)
        self._bus.end.receive_frame(identifier, data, bit_rate)
        server.look_ahead()

    def disconnect(self) -> None:
        """The client leaves the bus."""
        self._bus.leave(self)

    def log(self, direction: Direction, identifier: int, data: bytes) -> None:
        """Write a frame down."""
        if self._log is not None:
            self._log.add_frame(self._bus.server.rig.now, direction, identifier, data)
