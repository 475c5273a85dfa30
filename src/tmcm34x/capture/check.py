"""The host's side of a recording played against a virtual module, and how its replies differ from those recorded.

Every request is sent at its recorded time.  What comes before the next request of the line is compared with what was
recorded there, reply by reply; second replies of command 138 are compared apart from them, in their order.

Values that depend on the moment of the question (positions and speeds under way, tick timer, load, random numbers)
cannot be the same when times are those of a wall clock: such differences are counted apart, as `timing`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import zip_longest
from typing import TYPE_CHECKING, Final, NamedTuple

from tmcm34x.capture.fidelity import FidelityEntry, touched
from tmcm34x.capture.record import NS, Record, RecordingError, kind_of, origin_ns
from tmcm34x.clock import HZ, NEVER, run_until
from tmcm34x.firmware.ports.can import CanPort
from tmcm34x.firmware.ports.serial import SerialPort
from tmcm34x.tmcl import axis_parameters, global_parameters
from tmcm34x.tmcl.commands import BY_MNEMONIC, RFS_TYPES
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.bench.rig import Rig

TAIL: Final = HZ
"""Clocks that are waited for replies after the last record."""
_SECOND: Final = bytes((Status.POSITION_REACHED, 138))
_STATUS_AND_VALUE: Final = {"telegram": (2, slice(4, 8)), "frame": (1, slice(3, 7))}
_GAP, _GGP, _RFS, _GIO = (BY_MNEMONIC[name].number for name in ("GAP", "GGP", "RFS", "GIO"))
_TIMED_AXIS: Final = frozenset(
    axis_parameters.BY_KEY[key].number
    for key in ("actual_position", "actual_speed", "actual_acceleration", "position_reached", "load_value",
                "encoder_position")
)  # fmt: skip
_TIMED_GLOBAL: Final = frozenset(
    global_parameters.BY_KEY[key].number for key in ("tick_timer", "random_number")
)


class ReplyDifference(NamedTuple):
    """A reply that is not as recorded.

    request: the last one before it
    recorded, ours: None where there is no reply
    timing: whether it only depends on the moment of the question
    """

    request: Record | None
    recorded: Record | None
    ours: Record | None
    timing: bool

    @property
    def entries(self) -> list[FidelityEntry]:
        """The fidelity entries that the command touches."""
        instruction = None if self.request is None else self.request.instruction
        return [] if instruction is None else touched(instruction)

    def __str__(self) -> str:
        asked = "nothing" if self.request is None else self.request.meaning.text
        when = self.recorded or self.ours or self.request
        time_s = 0.0 if when is None else when.time_ns / NS
        return f"{time_s:12.6f} s  {asked}: recorded {_told(self.recorded)}, ours {_told(self.ours)}"


def _told(record: Record | None) -> str:
    return "no reply" if record is None else f"{record.meaning.text} [{record.data.hex(' ')}]"


@dataclass
class RecordedLine:
    """One line of a recording: its requests with what followed each, recorded and ours."""

    requests: list[Record | None] = field(default_factory=lambda: list[Record | None]([None]))
    recorded: list[list[Record]] = field(default_factory=lambda: [list[Record]()])
    ours: list[list[Record]] = field(default_factory=lambda: [list[Record]()])
    send: Callable[[Record], None] = lambda _: None

    def ask(self, request: Record) -> None:
        """One more request."""
        self.requests.append(request)
        self.recorded.append([])
        self.ours.append([])
        self.send(request)


def check(records: Sequence[Record], rig: Rig) -> list[ReplyDifference]:
    """Play the requests of a recording against `rig`; returns all differences, in the order of time.

    Raises `RecordingError` for a time that no clock reaches.
    """
    player = _Player(records, rig)
    player.play()
    found = [difference for line in player.lines.values() for difference in _compare(line)]
    return sorted(found, key=lambda difference: (difference.recorded or difference.ours or _END).time_ns)


_END: Final = Record(1 << 62, "", "<", "incomplete", b"")


class _Player:
    def __init__(self, records: Sequence[Record], rig: Rig) -> None:
        self._records = records
        self._rig = rig
        self._origin_ns = origin_ns(records)
        self.lines: dict[str, RecordedLine] = {}

    def play(self) -> None:
        """Send all requests at their times."""
        for record in self._records:
            clock = round((record.time_ns - self._origin_ns) * HZ / NS)
            if clock >= NEVER - TAIL:
                raise RecordingError("a record comes more than 9,000 years after the first one")
            run_until(self._rig, max(clock, self._rig.now))
            line = self._line(record)
            if record.direction == ">":
                line.ask(record._replace(time_ns=record.time_ns - self._origin_ns))
            else:
                line.recorded[-1].append(record._replace(time_ns=record.time_ns - self._origin_ns))
        run_until(self._rig, self._rig.now + TAIL)

    def _line(self, record: Record) -> RecordedLine:
        line = self.lines.get(record.line)
        if line is None:
            line = self.lines[record.line] = RecordedLine()
            line.send = self._can(line) if record.kind == "frame" else self._serial(line)
        return line

    def _serial(self, line: RecordedLine) -> Callable[[Record], None]:
        def take(data: bytes) -> None:
            line.ours[-1].append(Record(self._now_ns(), "ours", "<", kind_of(data), data))

        ports = [SerialPort(module, take) for module in self._rig.modules]

        def send(request: Record) -> None:
            for port in ports:
                port.receive(request.data)

        return send

    def _can(self, line: RecordedLine) -> Callable[[Record], None]:
        def take(identifier: int, data: bytes) -> None:
            line.ours[-1].append(Record(self._now_ns(), "ours", "<", "frame", bytes(data), identifier))

        ports = [CanPort(module, take) for module in self._rig.modules]

        def send(request: Record) -> None:
            for port in ports:
                port.receive_frame(request.identifier, request.data)

        return send

    def _now_ns(self) -> int:
        return round(self._rig.now * NS / HZ)


def _compare(line: RecordedLine) -> Iterator[ReplyDifference]:
    """The differences of one line."""
    for request, recorded, ours in zip(line.requests, line.recorded, line.ours, strict=True):
        pairs = zip_longest(_first(recorded), _first(ours))
        yield from (_difference(request, *pair) for pair in pairs if not _same(*pair))
    seconds = (_with_requests(line.requests, group) for group in (line.recorded, line.ours))
    for recorded, ours in zip_longest(*seconds):
        request = (recorded or ours or (None, None))[0]
        pair = recorded and recorded[1], ours and ours[1]
        if not _same(*pair):
            yield _difference(request, *pair)


def _with_requests(
    requests: Sequence[Record | None], groups: Sequence[Sequence[Record]]
) -> list[tuple[Record | None, Record]]:
    """The second replies of a line, each with the request before it."""
    pairs = zip(requests, groups, strict=True)
    return [(request, record) for request, records in pairs for record in _second(records)]


def _is_second(record: Record) -> bool:
    start = 1 if record.kind == "frame" else 2
    return record.data[start : start + 2] == _SECOND


def _first(records: Sequence[Record]) -> list[Record]:
    return [record for record in records if not _is_second(record)]


def _second(records: Sequence[Record]) -> list[Record]:
    return [record for record in records if _is_second(record)]


def _same(recorded: Record | None, ours: Record | None) -> bool:
    if recorded is None or ours is None:
        return recorded is ours
    return (recorded.data, recorded.identifier) == (ours.data, ours.identifier)


def _difference(request: Record | None, recorded: Record | None, ours: Record | None) -> ReplyDifference:
    return ReplyDifference(request, recorded, ours, _depends_on_time(request, recorded, ours))


def _depends_on_time(request: Record | None, recorded: Record | None, ours: Record | None) -> bool:
    instruction = None if request is None else request.instruction
    if instruction is None or recorded is None or ours is None or recorded.kind not in _STATUS_AND_VALUE:
        return False
    status, _ = _STATUS_AND_VALUE[recorded.kind]
    same_kind = recorded.kind == ours.kind and recorded.data[status] == ours.data[status] == Status.OK
    return same_kind and is_timed(instruction)


def is_timed(instruction: Instruction) -> bool:
    """Whether the value of a reading command depends on the moment of the question."""
    number, type_, bank, _ = instruction
    return (
        (number == _GAP and type_ in _TIMED_AXIS)
        or (number == _GGP and bank == 0 and type_ in _TIMED_GLOBAL)
        or (number == _RFS and type_ == dict(RFS_TYPES)["STATUS"])
        or (number == _GIO and bank == 1)
    )
