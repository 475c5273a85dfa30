"""What windows have set in the session that they share: breakpoints by source, data breakpoints and breaks."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final, NamedTuple

from tmcm34x.debug.breaks import BREAKS
from tmcm34x.ide.debug_messages import Message, event_of, request_of


class SourceMarks(NamedTuple):
    """The breakpoints of one source as they were asked for, and where the adapter has put them."""

    source: Message
    breakpoints: list[Any]
    placed: list[Message]

    def event(self) -> Message:
        """The event that tells windows of it."""
        return event_of(
            "tmcl_breakpoints", source=self.source, breakpoints=self.breakpoints, placed=self.placed
        )


class Kept:
    """Kept while the session, the line or the module is another one."""

    def __init__(self) -> None:
        self._marks: dict[str, SourceMarks] = {}
        self._data: list[Any] = []
        self._placed: list[Message] = []
        """What became of the data breakpoints."""
        self._filters: list[str] = [row.key for row in BREAKS.values() if row.default]

    def __bool__(self) -> bool:
        return bool(self._marks or self._data)

    @property
    def breakpoints(self) -> bool:
        """Whether there are any."""
        return any(marks.breakpoints for marks in self._marks.values())

    def events(self) -> Iterator[Message]:
        """What a new window must know."""
        yield event_of("tmcl_filters", filters=self._filters)
        for marks in self._marks.values():
            yield marks.event()
        yield self._data_event()

    def _data_event(self) -> Message:
        return event_of("tmcl_data_breakpoints", breakpoints=self._data, placed=self._placed)

    def requests(self) -> Iterator[Message]:
        """What sets it in a new session."""
        yield request_of("setExceptionBreakpoints", filters=self._filters)
        for marks in tuple(self._marks.values()):
            yield request_of("setBreakpoints", source=marks.source, breakpoints=marks.breakpoints)
        if self._data:
            yield request_of("setDataBreakpoints", breakpoints=self._data)

    def remember(self, command: str, arguments: Message, body: Message) -> Message | None:
        """Remember what a request has set; the event that tells other windows of it, if it has set anything."""
        keep = _REMEMBERED.get(command)
        return None if keep is None else keep(self, arguments, body)

    def keep_breakpoints(self, arguments: Message, body: Message) -> Message:
        """Remember where a source has breakpoints; the event that tells of it."""
        source = arguments["source"]
        marks = SourceMarks(source, arguments.get("breakpoints", []), body["breakpoints"])
        self._marks[source.get("path", "")] = marks
        if not marks.placed:
            del self._marks[source.get("path", "")]
        return marks.event()

    def keep_data(self, arguments: Message, body: Message) -> Message:
        """Remember the data breakpoints; the event that tells of them."""
        self._data, self._placed = arguments["breakpoints"], body["breakpoints"]
        return self._data_event()

    def keep_filters(self, arguments: Message, _: Message) -> Message:
        """Remember which breaks are in force; the event that tells of it."""
        self._filters = arguments.get("filters", [])
        return event_of("tmcl_filters", filters=self._filters)

    def move(self, place: Message) -> None:
        """The adapter has put a breakpoint elsewhere."""
        for marks in self._marks.values():
            for at, known in enumerate(marks.placed):
                if known["id"] == place["id"]:
                    marks.placed[at] = place


_REMEMBERED: Final[Mapping[str, Callable[[Kept, Message, Message], Message]]] = {
    "setBreakpoints": Kept.keep_breakpoints, "setDataBreakpoints": Kept.keep_data,
    "setExceptionBreakpoints": Kept.keep_filters,
}  # fmt: skip
