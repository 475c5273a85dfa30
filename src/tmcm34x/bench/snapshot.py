"""Snapshots: the complete state of a rig as bytes.

4 bytes   "T34S"
u16       format, 1 (little endian)
16 bytes  fingerprint of the rig's description: a snapshot fits rigs of the same description only
rest      `clock.pack` of the state
"""

from __future__ import annotations

import struct
from typing import Final

from tmcm34x.clock import DIGEST_SIZE, Value, pack, unpack

FORMAT: Final = 1
"""Raised whenever the state has another form."""

_MAGIC: Final = b"T34S"
_HEADER: Final = struct.Struct(f"<4sH{DIGEST_SIZE}s")


class SnapshotError(ValueError):
    """Bytes that are no snapshot of this bench; one line."""


def pack_snapshot(state: Value, fingerprint: bytes) -> bytes:
    """The bytes of a state of a rig with this fingerprint."""
    return _HEADER.pack(_MAGIC, FORMAT, fingerprint) + pack(state)


def unpack_snapshot(data: bytes, fingerprint: bytes) -> Value:
    """The state in a snapshot of a rig with this fingerprint; raises `SnapshotError`."""
    if data[: len(_MAGIC)] != _MAGIC or len(data) < _HEADER.size:
        raise SnapshotError("not a snapshot of a bench")
    _, version, of = _HEADER.unpack_from(data)
    if version != FORMAT:
        raise SnapshotError(f"a snapshot of format {version}; this version reads format {FORMAT}")
    if of != fingerprint:
        raise SnapshotError("a snapshot of another bench: its description is not that of this one")
    try:
        return unpack(data[_HEADER.size :])
    except ValueError as error:
        raise SnapshotError("a damaged snapshot: its contents cannot be read") from error
