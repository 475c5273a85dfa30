"""The module's state, packed for pages: a few bytes, and only what changed.

Source: `wire.GROUPS`, which is the layout.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Sequence
from typing import Final

from tmcm34x.ide import wire

_LAYOUTS: Final = tuple(group.layout for group in wire.GROUPS)
_INDEX: Final = {group.name: index for index, group in enumerate(wire.GROUPS)}
_WATCHED: Final = struct.Struct("<i")

Groups = list[bytes]
"""One packed group for each of `wire.GROUPS`."""


NOW: Final = -1.0
"""Of `seen`: all values are of now."""
ALL_UNKNOWN: Final = 0xFFFFFFFF


def empty() -> Groups:
    """A module of which nothing is known yet."""
    return [bytes(layout.size) for layout in _LAYOUTS]


def unknown(group: str, missing: Iterable[str]) -> int:
    """The bits of `missing` rows of a group, as `quality` has them."""
    rows = [row.name for row in wire.GROUPS[_INDEX[group]].rows]
    return sum(1 << rows.index(name) for name in missing)


def put(state: Groups, group: str, *values: float) -> None:
    """Pack `values` as `group`."""
    index = _INDEX[group]
    state[index] = _LAYOUTS[index].pack(*values)


def bits(*flags: bool) -> int:
    """Flags as a number, the first in bit 0."""
    return sum(1 << bit for bit, on in enumerate(flags) if on)


class Frames:
    """State frames of one page: remembers what that page has."""

    def __init__(self) -> None:
        self._sent: list[bytes] = [b""] * len(_LAYOUTS)
        self._watched = b""

    def frame(self, state: Sequence[bytes], watched: Sequence[int | None] = ()) -> bytes:
        """The frame that brings the page up to `state`; empty when it is there already."""
        mask = 0
        parts = [b""]
        for index, group in enumerate(state):
            if group != self._sent[index]:
                self._sent[index] = group
                mask |= 1 << index
                parts.append(group)
        values = _pack_watched(watched) if watched else b""
        if values != self._watched:
            self._watched = values
            mask |= 1 << wire.WATCH_BIT
            parts.append(values)
        if not mask:
            return b""
        parts[0] = bytes((mask,))
        return b"".join(parts)


def _pack_watched(watched: Sequence[int | None]) -> bytes:
    known = bits(*(value is not None for value in watched))
    return bytes((known,)) + b"".join(_WATCHED.pack(value or 0) for value in watched)
