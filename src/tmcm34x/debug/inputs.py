"""What came from outside, in its order.

A history keeps each request of the hosts, hundreds of thousands of them: a telegram takes its bytes and a place in
three columns, and becomes an `Input` when it is asked for.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from itertools import compress
from operator import not_
from typing import Any, Final, NamedTuple, TypeAlias, overload

CELLS_SIZE: Final = 60
"""Memory of an input in the columns, roughly [bytes]."""
BYTES_SIZE: Final = 40
"""Memory of the bytes of a telegram besides their number, roughly [bytes]."""
INPUT_SIZE: Final = 200
"""Memory of the content of any other input besides that, roughly [bytes]."""
RECEIVED: Final = "received"
"""The kind of what came over a line."""

Content: TypeAlias = bytes | tuple[Any, ...]


class Input(NamedTuple):
    """Something that came from outside at a clock.

    kind: a key of `course.INPUTS`; number: of the module or the line; values: plain values
    """

    clock: int
    kind: str
    number: int
    values: tuple[Any, ...]


class Inputs(Sequence[Input]):
    """Inputs whose clocks do not fall.

    clocks, lines, contents: the columns; who adds to one adds to all.  Bytes on a serial line at the module's own bit
    rate are there as they came, with the number of the line, negative where they were too late to complete a telegram;
    anything else that came over a line with its number and its values.  Of other inputs the line is 0 and the content
    is kind, number and values.
    """

    __slots__ = ("clocks", "contents", "lines")

    def __init__(self) -> None:
        self.clocks: list[int] = []
        self.lines: list[int] = []
        self.contents: list[Content] = []

    def append(self, item: Input) -> None:
        """Add an input."""
        line, content = _content(item)
        self.clocks.append(item.clock)
        self.lines.append(line)
        self.contents.append(content)

    def __len__(self) -> int:
        return len(self.clocks)

    @overload
    def __getitem__(self, index: int) -> Input: ...
    @overload
    def __getitem__(self, index: slice) -> Inputs: ...
    def __getitem__(self, index: int | slice) -> Input | Inputs:
        if isinstance(index, slice):
            return self._part(index)
        return _input(self.clocks[index], self.lines[index], self.contents[index])

    def __iter__(self) -> Iterator[Input]:
        return map(_input, self.clocks, self.lines, self.contents)

    def _part(self, index: slice) -> Inputs:
        part = Inputs()
        part.clocks, part.lines = self.clocks[index], self.lines[index]
        part.contents = self.contents[index]
        return part

    def forget(self, count: int) -> None:
        """Drop the first ones."""
        del self.clocks[:count], self.lines[:count], self.contents[:count]

    @property
    def received(self) -> Sequence[int]:
        """The clocks at which something came over lines."""
        return tuple(compress(self.clocks, self.lines))

    @property
    def others(self) -> Iterator[Input]:
        """Those that did not come over lines."""
        return map(self.__getitem__, compress(range(len(self)), map(not_, self.lines)))


def size(contents: Collection[Content]) -> int:
    """Memory of inputs with these contents, roughly [bytes]."""
    return telegrams_size(contents) + INPUT_SIZE * list(map(type, contents)).count(tuple)


def telegrams_size(contents: Collection[Content]) -> int:
    """The same if all of them are telegrams, or without the `INPUT_SIZE` of each one that is not."""
    return (CELLS_SIZE + BYTES_SIZE) * len(contents) + sum(map(len, contents))


def _content(item: Input) -> tuple[int, Content]:
    """The line and the content of an input."""
    match item:
        case Input(_, "received", number, (bytes() as data, over, None)):
            return -number if over else number, data
        case Input(_, "received", number, values):
            return number, values
        case Input(_, kind, number, values):
            return 0, (kind, number, values)


def _input(clock: int, line: int, content: Content) -> Input:
    if isinstance(content, bytes):
        return Input(clock, RECEIVED, abs(line), (content, line < 0, None))
    return Input(clock, RECEIVED, line, content) if line else Input(clock, *content)
