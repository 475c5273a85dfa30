"""What one line of a session does: each action has `play`, which raises `Unmet` when the module does otherwise.

`asks` tells that the line sends something or lets time pass, so that no reply may be waiting; `needs_bench` that a
real module cannot play it.
"""

from __future__ import annotations

from typing import NamedTuple

from tmcm34x.bench import action as bench
from tmcm34x.bench.session.condition import Condition
from tmcm34x.bench.session.errors import Unmet
from tmcm34x.bench.session.player import CanFrame, Player
from tmcm34x.bench.session.world import Deeds
from tmcm34x.clock import seconds
from tmcm34x.tmcl.datagram import Instruction, Reply


class Send(NamedTuple):
    """`> GAP 1, 0`: a command."""

    instruction: Instruction

    asks = True
    needs_bench = False

    def play(self, player: Player) -> None:
        """Send it in the form of the line."""
        player.send(self.instruction)


class SendBytes(NamedTuple):
    """`> 01 06 01`: bytes on a serial line."""

    data: bytes

    asks = True
    needs_bench = False

    def play(self, player: Player) -> None:
        """Send them as they are."""
        player.send_bytes(self.data)


class SendFrame(NamedTuple):
    """`> id 1: 06 01`: a CAN frame."""

    identifier: int
    data: bytes

    asks = True
    needs_bench = False

    def play(self, player: Player) -> None:
        """Send it as it is."""
        player.send_frame(self.identifier, self.data)


class ExpectedReply(NamedTuple):
    """`< 100 5`: a reply; the value is not looked at when `low` is None.

    command: number of the command that it answers, when that is not the last one sent
    """

    status: int
    low: int | None
    high: int
    command: int | None

    asks = False
    needs_bench = False

    def play(self, player: Player) -> None:
        """Take a reply and compare its status, value, addresses, command and sum."""
        reply, data = player.take_reply()
        number = self.command or (player.asked.number if player.asked else reply.command)
        wanted = Reply(player.host, player.address, self.status, number, reply.value)
        in_range = self.low is None or self.low <= reply.value <= self.high
        if reply != wanted or not in_range:
            raise Unmet(self.text(wanted), _describe(reply), data)
        player.note_reply(reply.status)

    def text(self, wanted: Reply) -> str:
        """What is expected, in words."""
        value = "" if self.low is None else f", value {_span(self.low, self.high)}"
        return f"{_head(wanted)}{value}"


def _head(reply: Reply) -> str:
    return f"status {reply.status} of command {reply.command} from {reply.address} to {reply.host}"


def _describe(reply: Reply) -> str:
    return f"{_head(reply)}, value {reply.value}"


def _span(low: int, high: int) -> str:
    return str(low) if low == high else f"{low}..{high}"


class Bytes(NamedTuple):
    """`< 02 01 64`: bytes on a serial line."""

    data: bytes

    asks = False
    needs_bench = False

    def play(self, player: Player) -> None:
        """Take as many bytes and compare them."""
        got = player.take(len(self.data))
        if got != self.data:
            raise Unmet(self.data.hex(" "), f"{got.hex(' ')} {got!r}")
        player.note_bytes(got)


class ExpectedFrame(NamedTuple):
    """`< id 2: 01 64`: a CAN frame."""

    identifier: int
    data: bytes

    asks = False
    needs_bench = False

    def play(self, player: Player) -> None:
        """Take a frame and compare it."""
        wanted, got = CanFrame(*self), player.take_frame()
        if got != wanted:
            raise Unmet(str(wanted), f"{got} {got.data!r}")
        if len(got.data) > 1:
            player.note_reply(got.data[1])


class Nothing(NamedTuple):
    """`< -`: no reply is waiting."""

    asks = False
    needs_bench = False

    def play(self, player: Player) -> None:
        """Look that nothing has come."""
        player.expect_silence()
        player.note_silence()


class PassTime(NamedTuple):
    """`+ 2 s`: time passes."""

    clocks: int

    asks = True
    needs_bench = False

    def play(self, player: Player) -> None:
        """Let it pass."""
        player.pass_time(self.clocks)


class Happen(NamedTuple):
    """`! power off`: something happens to the module."""

    deeds: Deeds

    asks = True
    needs_bench = True

    def play(self, player: Player) -> None:
        """Have it happen, now."""
        rig, number = player.unit
        try:
            for name, operands in self.deeds:
                rig.act(bench.Action(name, number, operands))
        except bench.ActionError as error:
            raise Unmet("something that this module can do", str(error)) from None
        player.wire.advance(0)


class Check(NamedTuple):
    """`? outputs 00000001`: a measurement."""

    condition: Condition
    text: str

    asks = False
    needs_bench = True

    def play(self, player: Player) -> None:
        """Measure and compare."""
        seen = self.condition.look(player)
        if not seen.holds:
            raise Unmet(self.text, seen.what)


class Address(NamedTuple):
    """`@ 3 host 9`: where the next telegrams go, and where replies must go."""

    module: int
    host: int | None

    asks = False
    needs_bench = False

    def play(self, player: Player) -> None:
        """Use them from here on."""
        player.address = self.module
        player.host = player.host if self.host is None else self.host


class Within(NamedTuple):
    """`within 5 s: ...`: time passes until a condition holds, but no more than this."""

    clocks: int
    condition: Condition
    text: str

    asks = True

    @property
    def needs_bench(self) -> bool:
        """Whether the condition does."""
        return self.condition.needs_bench

    def play(self, player: Player) -> None:
        """Let time pass until the condition holds."""
        until = player.now + self.clocks
        while not (seen := self.condition.look(player)).holds:
            if player.now >= until:
                raise Unmet(f"{self.text} within {seconds(self.clocks):g} s", seen.what)
            player.pass_time(player.next_look(until) - player.now)


class Promise(NamedTuple):
    """`always: ...` and `never: ...`: from here to the end of the case a condition holds, or does not."""

    condition: Condition
    always: bool

    asks = False

    @property
    def needs_bench(self) -> bool:
        """Whether the condition does."""
        return self.condition.needs_bench

    def play(self, player: Player) -> None:
        """Have it looked at from now on."""
        player.promise(self.condition, self.always)


Action = (
    Send | SendBytes | SendFrame | ExpectedReply | Bytes | ExpectedFrame | Nothing | PassTime | Happen | Check | Address
    | Within | Promise
)  # fmt: skip
