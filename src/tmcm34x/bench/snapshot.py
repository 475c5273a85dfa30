"""Snapshots: the complete state of a rig as bytes.

4 bytes   "T34S"
u16       format, 2 (little endian)
16 bytes  fingerprint of the rig's description: a snapshot fits rigs of the same description only
16 bytes  BLAKE2b of the rest
rest      `clock.pack` of the state
"""

from __future__ import annotations

import struct
from hashlib import blake2b
from typing import Final

from tmcm34x.clock import DIGEST_SIZE, Value, pack, unpack

FORMAT: Final = 2
"""Raised whenever the state has another form."""

_MAGIC: Final = b"T34S"
_HEADER: Final = struct.Struct(f"<4sH{DIGEST_SIZE}s{DIGEST_SIZE}s")


class SnapshotError(ValueError):
    """Bytes that are no snapshot of this bench; one line."""


def pack_snapshot(state: Value, fingerprint: bytes) -> bytes:
    """The bytes of a state of a rig with this fingerprint."""
    packed = pack(state)
    return _HEADER.pack(_MAGIC, FORMAT, fingerprint, _check(packed)) + packed


def _check(packed: bytes) -> bytes:
    return blake2b(packed, digest_size=DIGEST_SIZE).digest()


def unpack_snapshot(data: bytes, fingerprint: bytes) -> Value:
    """The state in a snapshot of a rig with this fingerprint; raises `SnapshotError`."""
    if data[: len(_MAGIC)] != _MAGIC or len(data) < _HEADER.size:
        raise SnapshotError("not a snapshot of a bench")
    _, version, of, check = _HEADER.unpack_from(data)
    if version != FORMAT:
        raise SnapshotError(f"a snapshot of format {version}; this version reads format {FORMAT}")
    if of != fingerprint:
        raise SnapshotError("a snapshot of another bench: its description is not that of this one")
    packed = data[_HEADER.size :]
    if _check(packed) != check:
        raise SnapshotError("a damaged snapshot: its contents are not what was written")
    try:
        return unpack(packed)
    except ValueError as error:
        raise SnapshotError("a damaged snapshot: its contents cannot be read") from error
