"""The Debug Adapter Protocol on the wire: what requests carry, and how messages are framed.

Source: Debug Adapter Protocol 1.x, "Base Protocol" and the requests named like the structs here.  Fields that
are not named here are ignored, as the protocol wants it.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Annotated, Any, Final

from msgspec import Meta, Struct, field

LARGEST: Final = 4 * 1024 * 1024
"""Bytes of the longest message."""
_LONGEST_HEADER: Final = 4096
_LENGTH: Final = re.compile(rb"^content-length:[ \t]*(\d{1,9})[ \t]*$", re.IGNORECASE | re.MULTILINE)

Text = Annotated[str, Meta(max_length=100_000)]
Line = Annotated[int, Meta(ge=0, le=10_000_000)]


class RequestError(Exception):
    """A request that cannot be done; the text is for the user."""


class Arguments(Struct, rename="camel"):
    """Of a request that carries nothing we need."""


class Initialize(Arguments):
    """What the editor counts from."""

    lines_start_at1: bool = field(default=True, name="linesStartAt1")
    columns_start_at1: bool = field(default=True, name="columnsStartAt1")


class Launch(Arguments):
    """A program on a virtual module of its own."""

    program: Text
    """Source, .bin or .hex."""
    model: Annotated[int | None, Meta(description="341, 342 or 343")] = None
    bench: Text | None = None
    """What hangs on the module; bare motors without it."""
    include: list[Text] = []
    stop_on_entry: bool = False
    stop_at_end: bool = False
    """Hold once more when all is over, to look at what has become."""
    speed: Annotated[float, Meta(ge=0, le=1e6)] = 0.0
    """Of virtual time: 1 is real time, 0 as fast as possible."""
    instruction_time: Annotated[float, Meta(gt=0, le=1e6)] | None = None
    """Time of one instruction [us]."""
    seed: int = 0
    no_debug: bool = False


class Attach(Arguments):
    """A module at the end of a line, or, without a port, the one of whoever runs this adapter."""

    port: Text | None = None
    baud: Annotated[int, Meta(ge=1, le=10_000_000)] = 9600
    address: Annotated[int, Meta(ge=0, le=255)] = 1
    timeout: Annotated[float, Meta(gt=0, le=60)] = 1.0
    program: Text | None = None
    """The source of what is in the module; disassembled without it."""
    include: list[Text] = []
    stop_on_entry: bool = False


class Source(Arguments):
    """A file, or a text that we made."""

    path: Text | None = None
    source_reference: int | None = None


class SourceBreakpoint(Arguments):
    """A breakpoint as it was asked for: by line, by label or by address."""

    line: Line = 0
    name: Text = ""
    instruction_reference: Text = ""
    offset: int = 0
    condition: Text | None = None
    hit_condition: Text | None = None
    log_message: Text | None = None


class SetBreakpoints(Arguments):
    """All breakpoints of one source."""

    source: Source
    breakpoints: list[SourceBreakpoint] | None = None
    lines: list[Line] | None = None


class SetOtherBreakpoints(Arguments):
    """All breakpoints at labels, or all at addresses."""

    breakpoints: list[SourceBreakpoint]


class DataBreakpointInfo(Arguments):
    """Whether a value can be watched: a member of a scope, or an expression."""

    name: Text
    variables_reference: int | None = None


class DataBreakpoint(Arguments):
    """A data breakpoint as it was asked for."""

    data_id: Text
    condition: Text | None = None
    hit_condition: Text | None = None


class SetDataBreakpoints(Arguments):
    """All data breakpoints."""

    breakpoints: list[DataBreakpoint]


class FilterOption(Arguments):
    """A break by its key, perhaps with a condition."""

    filter_id: Text
    condition: Text | None = None


class SetExceptionBreakpoints(Arguments):
    """Which breaks are in force."""

    filters: list[Text] = []
    filter_options: list[FilterOption] = []


class Lines(Arguments):
    """Some lines of a source."""

    source: Source
    line: Line
    end_line: Line | None = None


class GetSource(Arguments):
    """A text that we made."""

    source_reference: int = 0
    source: Source | None = None


class StackTrace(Arguments):
    """Some of the open routines."""

    start_frame: int = 0
    levels: int = 0


class Format(Arguments):
    """How to show numbers."""

    hex: bool = False


class Variables(Arguments):
    """A scope to look at."""

    variables_reference: int
    format: Format | None = None


class SetVariable(Arguments):
    """A new value for something in a scope."""

    variables_reference: int
    name: Text
    value: Text


class SetExpression(Arguments):
    """A new value for something with a name."""

    expression: Text
    value: Text


class Evaluate(Arguments):
    """An expression, or in the console a command."""

    expression: Text
    context: Text = ""
    format: Format | None = None


class Completions(Arguments):
    """What was typed in the console so far."""

    text: Text
    column: int


class Goto(Arguments):
    """Where to go on."""

    target_id: int


class StepBack(Arguments):
    """How far to go back: a "statement", a "line" or a single "instruction"."""

    granularity: Text = "statement"


class RestartFrame(Arguments):
    """Which routine to begin anew, by its number in the stack."""

    frame_id: int


class Disassemble(Arguments):
    """A stretch of the program memory."""

    memory_reference: Text
    instruction_count: Annotated[int, Meta(ge=0, le=10_000)]
    offset: int = 0
    instruction_offset: int = 0


class Restart(Arguments):
    """Perhaps with other settings."""

    arguments: Any = None


class Disconnect(Arguments):
    """Whether the program is to stop."""

    terminate_debuggee: bool = False


class FramingError(ValueError):
    """Bytes that are no messages; the line cannot be read any further."""


def frame(message: dict[str, Any]) -> bytes:
    """A message as bytes."""
    body = json.dumps(message, separators=(",", ":"), ensure_ascii=False).encode("utf-8", "replace")
    return b"Content-Length: %d\r\n\r\n%s" % (len(body), body)


class Framing:
    """Bytes to messages."""

    def __init__(self) -> None:
        self._received = bytearray()

    def feed(self, data: bytes) -> Iterator[Any]:
        """The messages that `data` completes; None for one that is no JSON.  Raises `FramingError`."""
        received = self._received
        received += data
        while (end := received.find(b"\r\n\r\n", 0, _LONGEST_HEADER)) >= 0:
            length = _LENGTH.search(bytes(received[:end]).replace(b"\r", b""))
            if length is None:
                raise FramingError("a header without Content-Length")
            size = int(length[1])
            if size > LARGEST:
                raise FramingError(f"a message of {size} bytes; {LARGEST} is the limit")
            start = end + 4
            if len(received) < start + size:
                return
            body = bytes(received[start : start + size])
            del received[: start + size]
            yield _parse(body)
        if len(received) >= _LONGEST_HEADER and not _LENGTH.search(bytes(received[:_LONGEST_HEADER])):
            raise FramingError("no header")


def _parse(body: bytes) -> Any:
    try:
        return json.loads(body)
    except (ValueError, RecursionError):
        return None
