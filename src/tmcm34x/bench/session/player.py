"""One conversation under way: sends, takes what comes back, lets time pass, and keeps an eye on promises.

A wire is an object with

    kind                    "serial" or "can"
    rig                     the bench with the module at the other end; None at a real one
    now                     the time in chip clocks
    send(data)              bytes to a serial line;  send_frame(identifier, data) on CAN
    received                a bytearray of what came back and was not taken yet; a list of frames on CAN
    advance(clocks)         time passes
    settle()                what was sent has arrived, and its answers, if any at this clock, have come back
    wait_for(size)          so many bytes (or frames) have come, or will not come any more
    wait_for_nothing()      what could still come has come
    ask(address, instruction)   status and value, outside the conversation
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple, Protocol

from tmcm34x.bench.session.condition import Condition
from tmcm34x.bench.session.errors import SessionFailedError, SessionLine, Unmet
from tmcm34x.bench.session.world import Unit
from tmcm34x.clock import MS, seconds
from tmcm34x.tmcl.datagram import (
    CAN_SIZES,
    SIZE,
    ChecksumError,
    Instruction,
    Reply,
    pack_can_request,
    pack_request,
    unpack_can_reply,
    unpack_can_request,
    unpack_reply,
    unpack_request,
)

POLL: Final = 10 * MS
"""Time between two looks at a condition while nothing happens."""
LATE: Final = 50 * MS
"""By how much a reply may come later than it was recorded."""
SERIAL: Final = "serial"
CAN: Final = "can"


class PlayedLine(Protocol):
    """The line to a module; the module docstring names what each method does."""

    kind: str
    rig: Any
    received: Any

    @property
    def now(self) -> int: ...  # noqa: D102
    def send(self, data: bytes, /) -> None: ...  # noqa: D102
    def send_frame(self, identifier: int, data: bytes, /) -> None: ...  # noqa: D102
    def advance(self, clocks: int, /) -> None: ...  # noqa: D102
    def settle(self) -> None: ...  # noqa: D102
    def wait_for(self, size: int, /) -> None: ...  # noqa: D102
    def wait_for_nothing(self) -> None: ...  # noqa: D102
    def ask(self, address: int, instruction: Instruction, /) -> tuple[int, int]: ...  # noqa: D102


class CanFrame(NamedTuple):
    """A frame of a CAN bus."""

    identifier: int
    data: bytes

    def __str__(self) -> str:
        return f"id {self.identifier}: {self.data.hex(' ')}"


class Playable(Protocol):
    """What a line of a session does; `actions` has all of them."""

    @property
    def asks(self) -> bool:
        """Whether it sends something or lets time pass, so that no reply may be waiting."""
        ...

    @property
    def needs_bench(self) -> bool:
        """Whether a real module cannot play it."""
        ...

    def play(self, player: Player, /) -> None:
        """Do it by a `Player`; raises `Unmet` when the module does otherwise."""
        ...


class Step(NamedTuple):
    """One line of a session that does something, on which models.

    at: clocks from the beginning of the case at which it was recorded; None in sessions written by hand
    """

    line: int
    text: str
    action: Playable
    models: frozenset[int]
    at: int | None = None


class _Promised(NamedTuple):
    """What is to hold from a line on to the end of the case, or is not to; `place` is the line."""

    place: SessionLine
    condition: Condition
    always: bool


class Player:
    """A conversation over `wire`, which is part `title` of the file `path`.

    Subclasses may override the methods `note_...`, which do nothing here.
    """

    def __init__(
        self, wire: PlayedLine, path: str = "", title: str = "", *, address: int = 1, host: int = 2
    ) -> None:
        self.wire = wire
        self.address, self.host = address, host
        self.asked: Instruction | None = None
        self._sent: tuple[str, bytes] | None = None
        self._place = SessionLine(path, 0, "start", title)
        self._start = wire.now
        self._promises: list[_Promised] = []

    def play(self, step: Step) -> None:
        """Do one line; raises `SessionFailedError` when the module does otherwise."""
        self._place = self._place._replace(line=step.line, text=step.text)
        action = step.action
        try:
            self.wire.settle()
            if step.at is not None:
                self._keep_time(step.at, action.asks)
            if action.asks and self.wire.received:
                raise Unmet("every reply to be expected by a line", f"one that was not: {self._waiting()}")
            action.play(self)
            if self._promises:
                self._look()
        except Unmet as unmet:
            raise self._failure(unmet) from None

    def _keep_time(self, at: int, asks: bool) -> None:
        """Send when it was sent; wait for a reply a little longer than it took."""
        due = self._start + at + (0 if asks else LATE)
        while self.now < due and (asks or not self.wire.received):
            self.pass_time(due - self.now if asks else self.next_look(due) - self.now)

    def finish(self) -> None:
        """The end: nothing may be waiting."""
        self._place = self._place._replace(text="end of the session")
        try:
            self.wire.settle()
            self.expect_silence()
        except Unmet as unmet:
            raise self._failure(unmet) from None

    def _failure(self, unmet: Unmet) -> SessionFailedError:
        return SessionFailedError(self._place, unmet, self._sent, seconds(self.wire.now))

    # Sending

    def send(self, instruction: Instruction) -> None:
        """Send a command in the form of the line."""
        if self.wire.kind == CAN:
            data = pack_can_request(instruction)
            self.wire.send_frame(self.address, data)
        else:
            data = pack_request(self.address, instruction)
            self.wire.send(data)
        self.asked = instruction
        self._sent = self._place.text, data

    def send_bytes(self, data: bytes) -> None:
        """Send bytes as they are."""
        if self.wire.kind == CAN:
            raise Unmet("a serial line for bytes", "a CAN bus")
        try:
            self.asked = unpack_request(data)[1]
        except (ValueError, ChecksumError):
            self.asked = None
        self._sent = self._place.text, data
        self.note_sent(data)
        self.wire.send(data)

    def send_frame(self, identifier: int, data: bytes) -> None:
        """Send a frame as it is."""
        if self.wire.kind != CAN:
            raise Unmet("a CAN bus for a frame", "a serial line")
        self.asked = unpack_can_request(data) if len(data) in CAN_SIZES else None
        self._sent = self._place.text, data
        self.wire.send_frame(identifier, data)

    # Taking

    def take_reply(self) -> tuple[Reply, bytes]:
        """The next reply, and its bytes."""
        if self.wire.kind == CAN:
            frame = self.take_frame()
            return unpack_can_reply(frame.data)._replace(host=frame.identifier), frame.data
        data = self.take(SIZE)
        try:
            return unpack_reply(data), data
        except ChecksumError as error:
            raise Unmet("a reply", f"a reply with {error}", data) from None

    def take(self, size: int) -> bytes:
        """The next `size` bytes."""
        received = self.wire.received
        if len(received) < size:
            self.wire.wait_for(size)
        data = bytes(received[:size])
        if len(data) < size:
            raise Unmet(f"{size} bytes", data.hex(" ") or "nothing")
        del received[:size]
        self.note_taken(data)
        return data

    def take_frame(self) -> CanFrame:
        """The next frame."""
        self.wire.wait_for(1)
        if not self.wire.received:
            raise Unmet("a frame", "nothing")
        frame = CanFrame(*self.wire.received.pop(0))
        self.note_frame(frame)
        return frame

    def expect_silence(self) -> None:
        """Nothing is waiting, and nothing comes."""
        self.wire.wait_for_nothing()
        if self.wire.received:
            raise Unmet("no reply", self._waiting())

    def _waiting(self) -> str:
        received = self.wire.received
        if self.wire.kind == CAN:
            return ", ".join(str(CanFrame(*frame)) for frame in received)
        return bytes(received).hex(" ")

    # Time and conditions

    @property
    def now(self) -> int:
        """The time in chip clocks."""
        return self.wire.now

    @property
    def unit(self) -> Unit:
        """The module that telegrams go to, else the first one."""
        rig = self.wire.rig
        for index, module in enumerate(rig.modules):
            if module.address == self.address:
                return Unit(rig, index)
        return Unit(rig)

    def ask(self, instruction: Instruction) -> tuple[int, int]:
        """Status and value of a command outside the conversation."""
        return self.wire.ask(self.address, instruction)

    def pass_time(self, clocks: int) -> None:
        """Let time pass; with promises, event by event."""
        if not self._promises:
            self.wire.advance(clocks)
            return
        until = self.now + clocks
        while self.now < until:
            self.wire.advance(self.next_look(until) - self.now)
            self._look()

    def next_look(self, until: int) -> int:
        """The clock at which a condition must be looked at next, `until` at the latest."""
        rig = self.wire.rig
        due = self.now + POLL
        return min(until, due if rig is None else max(min(rig.next_event(), due), self.now + 1))

    def promise(self, condition: Condition, always: bool) -> None:
        """Look from now on that a condition holds always, or never."""
        self._promises.append(_Promised(self._place, condition, always))

    def _look(self) -> None:
        for place, condition, always in self._promises:
            seen = condition.look(self)
            if seen.holds != always:
                self._place = place
                raise Unmet("it to hold always" if always else "it never to hold", seen.what)

    # Notes

    def note_sent(self, data: bytes) -> None:
        """`data` are about to be sent as they are."""

    def note_taken(self, data: bytes) -> None:
        """`data` were taken from a serial line."""

    def note_frame(self, frame: CanFrame) -> None:
        """`frame` was taken from the bus."""

    def note_bytes(self, data: bytes) -> None:
        """`data` are what a line expected."""

    def note_reply(self, status: int) -> None:
        """A reply with `status` was as expected."""

    def note_silence(self) -> None:
        """There was no reply, as expected."""
