"""Program images as files: the TMCL-IDE's binary form, and Intel HEX with the same bytes.

A binary image has no header: eight bytes an instruction (opcode, type, motor, value with its most significant
byte first, 8-bit sum of these seven).  In the HEX form the first byte has address 0.

Leaves out: segments and linear addresses above 64 KB, which a memory of 2,048 instructions never needs.

Source: facts of the TMCL-IDE's own files; Intel, Hexadecimal Object File Format Specification, revision A (1988).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from typing import Final

from tmcm34x.tmcl.commands import PROGRAM_SIZE
from tmcm34x.tmcl.datagram import RECORD_SIZE, ChecksumError, Instruction, pack_record, unpack_record

_HEX_BYTES: Final = 16
"""Data bytes of a HEX line: two instructions."""
_HEX_LINE: Final = re.compile(r":((?:[0-9A-Fa-f]{2}){5,})\Z")
_DATA, _END, _SEGMENT, _SEGMENT_START, _LINEAR, _LINEAR_START = range(6)


class ImageError(ValueError):
    """A file that is not a program image, with the position as byte offset or line."""


def pack_binary(program: Iterable[Instruction]) -> bytes:
    """The binary image of `program`."""
    return b"".join(map(pack_record, program))


def unpack_binary(data: bytes) -> tuple[Instruction, ...]:
    """The program in a binary image; raises `ImageError` for a truncated, damaged or oversized one."""
    if len(data) > PROGRAM_SIZE * RECORD_SIZE:
        raise ImageError(f"{len(data)} bytes; a program has at most {PROGRAM_SIZE * RECORD_SIZE}")
    program: list[Instruction] = []
    for offset in range(0, len(data), RECORD_SIZE):
        record = data[offset : offset + RECORD_SIZE]
        if len(record) < RECORD_SIZE:
            raise ImageError(f"offset {offset}: truncated, {len(record)} of {RECORD_SIZE} bytes")
        try:
            program.append(unpack_record(record))
        except ChecksumError as error:
            raise ImageError(f"offset {offset + RECORD_SIZE - 1}: {error}") from None
    return tuple(program)


def pack_hex(program: Iterable[Instruction]) -> str:
    """The image of `program` as Intel HEX."""
    data = pack_binary(program)
    lines = [
        _hex_line(_DATA, address, data[address : address + _HEX_BYTES])
        for address in range(0, len(data), _HEX_BYTES)
    ]
    return "\n".join([*lines, _hex_line(_END, 0, b""), ""])


def unpack_hex(text: str) -> tuple[Instruction, ...]:
    """The program in an Intel HEX text; raises `ImageError` like `unpack_binary`, and where bytes are missing."""
    memory: dict[int, int] = {}
    for number, address, data in _hex_records(text):
        for offset, byte in enumerate(data, address):
            if offset in memory:
                raise ImageError(f"line {number}: byte {offset} is given twice")
            memory[offset] = byte
    for offset in range(len(memory)):
        if offset not in memory:
            raise ImageError(f"offset {offset}: this byte is missing")
    return unpack_binary(bytes(memory[offset] for offset in range(len(memory))))


def _hex_records(text: str) -> Iterator[tuple[int, int, bytes]]:
    """Line number, address and bytes of each data record up to the end record."""
    for number, line in enumerate(text.splitlines(), 1):
        if line.strip():
            kind, address, data = _hex_record(number, line.strip())
            if kind == _END:
                return
            if kind == _DATA:
                yield number, address, data
    raise ImageError("truncated: there is no end record")


def _hex_record(number: int, line: str) -> tuple[int, int, bytes]:
    """Kind, address and bytes of a record; raises `ImageError` for one that is damaged or has no place here."""
    match = _HEX_LINE.match(line)
    if match is None:
        raise ImageError(f"line {number}: not an Intel HEX record")
    record = bytes.fromhex(match[1])
    length, address, kind, data = record[0], int.from_bytes(record[1:3], "big"), record[3], record[4:-1]
    if sum(record) & 0xFF:
        expected = -sum(record[:-1]) & 0xFF
        raise ImageError(f"line {number}: checksum {record[-1]:#04x}, expected {expected:#04x}")
    if length != len(data):
        raise ImageError(f"line {number}: {len(data)} data bytes, {length} announced")
    if kind in (_SEGMENT, _LINEAR) and any(data):
        raise ImageError(f"line {number}: address above 64 KB")
    if kind > _LINEAR_START:
        raise ImageError(f"line {number}: record type {kind}")
    return kind, address, data


def _hex_line(kind: int, address: int, data: bytes) -> str:
    record = bytes((len(data), address >> 8, address & 0xFF, kind)) + data
    return f":{record.hex().upper()}{-sum(record) & 0xFF:02X}"
