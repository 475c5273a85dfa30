"""One telegram, frame or text of a recording."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final, NamedTuple

from tmcm34x.tmcl.datagram import CAN_SIZES, SIZE, Instruction, unpack_can_request, unpack_request
from tmcm34x.tmcl.telegrams import Direction, Kind, Meaning, explain

NS: Final = 1_000_000_000
CALENDAR_NS: Final = 365 * 24 * 3600 * NS
"""Times above this are those of a calendar, not of a clock that was started with the recording."""
NO_IDENTIFIER: Final = -1


class RecordingError(Exception):
    """A recording that cannot be read or written; one line."""


class Record(NamedTuple):
    """What passed at a time.

    time_ns: from an arbitrary origin, the same for all records of a recording
    line: name of the line
    direction: `>` to the module, `<` from it
    identifier: of a CAN frame, else `NO_IDENTIFIER`
    """

    time_ns: int
    line: str
    direction: Direction
    kind: Kind
    data: bytes
    identifier: int = NO_IDENTIFIER

    @property
    def meaning(self) -> Meaning:
        """What it says."""
        return explain(self.direction, self.data, self.kind)

    @property
    def instruction(self) -> Instruction | None:
        """The command of a request; None where there is none."""
        if self.direction == "<":
            return None
        try:
            if self.kind == "frame":
                return unpack_can_request(self.data)
            return unpack_request(self.data)[1] if self.kind == "telegram" else None
        except ValueError:
            return None


def origin_ns(records: Sequence[Record]) -> int:
    """The time that counts as the module's power-on.

    Times of a calendar begin at the first record; others are kept, as the clock of a virtual module is one of them.
    """
    first = records[0].time_ns if records else 0
    return first if first > CALENDAR_NS else 0


def kind_of(data: bytes, identifier: int = NO_IDENTIFIER) -> Kind:
    """What bytes are, where only their number tells."""
    if identifier != NO_IDENTIFIER:
        return "frame"
    return "telegram" if len(data) == SIZE else "incomplete"


def is_frame_of_ours(data: bytes) -> bool:
    """Whether the data of a CAN frame may be a request or a reply."""
    return len(data) in CAN_SIZES


_NAME: Final = re.compile(r"(.*) ([0-9a-f]{3}|[0-9a-f]{8})\Z")


def from_sink(time_ns: int, name: str, direction: Direction, data: bytes, kind: Kind) -> Record:
    """The record of what a server's sink gets: the name of a CAN line ends with the identifier."""
    if kind == "frame" and (match := _NAME.match(name)):
        return Record(time_ns, match.group(1), direction, kind, data, int(match.group(2), 16))
    return Record(time_ns, name, direction, kind, data)
