"""Recordings as pcapng files, which Wireshark reads with the dissector of `dissector`.

The link type is LINKTYPE_USER0 (147).  Every packet is a record:

    byte 0     version of this layout, 1
    byte 1     direction: 0 to the module, 1 from it
    byte 2     kind: 0 telegram of nine bytes, 1 CAN frame, 2 text, 3 incomplete
    byte 3     0
    bytes 4-7  identifier of a CAN frame, most significant byte first, bit 31 set for 29 bits; else 0
    then       the bytes that passed

Each line is an interface of the file, by its name.  Times are in nanoseconds.

Source: IETF draft-ietf-opsawg-pcapng (section header, interface description, enhanced packet blocks).
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator
from typing import Final, NamedTuple

from tmcm34x.capture.record import NO_IDENTIFIER, NS, Record, RecordingError
from tmcm34x.tmcl.telegrams import Direction, Kind

LINKTYPE_USER0: Final = 147
VERSION: Final = 1
DIRECTIONS: Final[tuple[Direction, Direction]] = (">", "<")
KINDS: Final[tuple[Kind, ...]] = ("telegram", "frame", "text", "incomplete")
HEAD: Final = struct.Struct(">BBBxI")

SECTION: Final = 0x0A0D0D0A
INTERFACE: Final = 1
PACKET: Final = 6
BYTE_ORDER: Final = 0x1A2B3C4D
_IF_NAME, _IF_TSRESOL, _END = 2, 9, 0
_NANOSECONDS: Final = 9
_MICROSECONDS: Final = 6
_LARGEST: Final = 1 << 20
"""Bytes of the largest block that is taken for one."""


class PcapngWriter:
    """Turns records into blocks, one after the other."""

    def __init__(self) -> None:
        self._interfaces: dict[str, int] = {}
        self._started = False

    def blocks(self, record: Record) -> bytes:
        """What a record adds to the file."""
        data = b"" if self._started else section()
        self._started = True
        if record.line not in self._interfaces:
            self._interfaces[record.line] = len(self._interfaces)
            data += _interface(record.line)
        return data + _packet(self._interfaces[record.line], record)


def section() -> bytes:
    """The block that a file begins with."""
    return _block(SECTION, struct.pack("<IHHq", BYTE_ORDER, 1, 0, -1))


def _interface(name: str) -> bytes:
    options = _option(_IF_NAME, name.encode("utf-8")) + _option(_IF_TSRESOL, bytes((_NANOSECONDS,)))
    return _block(INTERFACE, struct.pack("<HHI", LINKTYPE_USER0, 0, 0) + options + _option(_END, b""))


def _packet(interface: int, record: Record) -> bytes:
    identifier = 0 if record.identifier == NO_IDENTIFIER else record.identifier
    payload = (
        HEAD.pack(VERSION, DIRECTIONS.index(record.direction), KINDS.index(record.kind), identifier)
        + record.data
    )
    high, low = record.time_ns >> 32, record.time_ns & 0xFFFF_FFFF
    return _block(
        PACKET, struct.pack("<IIIII", interface, high, low, len(payload), len(payload)) + _padded(payload)
    )


def _option(code: int, value: bytes) -> bytes:
    return struct.pack("<HH", code, len(value)) + _padded(value)


def _padded(data: bytes) -> bytes:
    return data + bytes(-len(data) % 4)


def _block(kind: int, body: bytes) -> bytes:
    size = struct.pack("<I", len(body) + 12)
    return struct.pack("<I", kind) + size + body + size


def write(records: Iterable[Record]) -> bytes:
    """A whole file."""
    writer = PcapngWriter()
    return b"".join(map(writer.blocks, records)) or section()


def read(data: bytes) -> list[Record]:
    """The records of a file; a block that was cut off at its end is left out.  Raises `RecordingError`."""
    return list(_Reader(data).records())


class _Interface(NamedTuple):
    """An interface of a file: its times count ticks of a resolution."""

    name: str
    link_type: int
    resolution: int


class _Reader:
    """A file of either byte order, with interfaces of any resolution."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._order = "<"
        self._interfaces: list[_Interface] = []

    def records(self) -> Iterator[Record]:
        if self._data[:4] != struct.pack("<I", SECTION):
            raise RecordingError("not a pcapng file")
        for kind, body in self._blocks():
            if kind == SECTION:
                self._interfaces.clear()
            elif kind == INTERFACE:
                self._interfaces.append(self._read_interface(body))
            elif kind == PACKET and (record := self._read_packet(body)) is not None:
                yield record

    def _blocks(self) -> Iterator[tuple[int, bytes]]:
        place = 0
        while place + 12 <= len(self._data):
            (kind,) = struct.unpack_from("<I", self._data, place)
            if kind == SECTION:
                magic = struct.unpack_from("<I", self._data, place + 8)[0]
                self._order = "<" if magic == BYTE_ORDER else ">"
            kind, size = struct.unpack_from(self._order + "II", self._data, place)
            if size < 12 or size % 4 or size > _LARGEST:
                raise RecordingError(f"byte {place} begins no block of a pcapng file")
            if place + size > len(self._data):
                return
            yield kind, self._data[place + 8 : place + size - 4]
            place += size

    def _read_interface(self, body: bytes) -> _Interface:
        if len(body) < 8:
            raise RecordingError("the description of an interface is too short")
        link_type: int = struct.unpack_from(self._order + "H", body)[0]
        name, resolution, place = f"interface {len(self._interfaces)}", _MICROSECONDS, 8
        while place + 4 <= len(body):
            code, size = struct.unpack_from(self._order + "HH", body, place)
            value = body[place + 4 : place + 4 + size]
            if code == _IF_NAME:
                name = value.decode("utf-8", "replace")
            elif code == _IF_TSRESOL and value:
                resolution = value[0]
            place += 4 + size + -size % 4
        return _Interface(name, link_type, resolution)

    def _read_packet(self, body: bytes) -> Record | None:
        if len(body) < 20:
            raise RecordingError("a packet is too short")
        number: int
        number, high, low, size, _ = struct.unpack_from(self._order + "IIIII", body)
        if number >= len(self._interfaces):
            raise RecordingError(f"a packet of interface {number}, which the file does not describe")
        name, link_type, resolution = self._interfaces[number]
        payload = body[20 : 20 + size]
        if link_type != LINKTYPE_USER0 or len(payload) < HEAD.size:
            return None
        return _record(_nanoseconds(high << 32 | low, resolution), name, payload)


def _record(time_ns: int, name: str, payload: bytes) -> Record | None:
    """The record in a packet; None for another version of the layout."""
    head: tuple[int, int, int, int] = HEAD.unpack_from(payload)
    version, direction, kind, identifier = head
    if version != VERSION or direction >= len(DIRECTIONS) or kind >= len(KINDS):
        return None
    can = KINDS[kind] == "frame"
    data = payload[HEAD.size :]
    return Record(
        time_ns, name, DIRECTIONS[direction], KINDS[kind], data, identifier if can else NO_IDENTIFIER
    )


def _nanoseconds(ticks: int, resolution: int) -> int:
    """The time of so many units; bit 7 of the resolution tells powers of two from powers of ten."""
    per_second = 1 << (resolution & 0x7F) if resolution & 0x80 else 10**resolution
    return ticks * NS // per_second
