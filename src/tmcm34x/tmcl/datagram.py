"""Telegrams: nine bytes on a serial line, seven or eight on CAN, in both directions.

Pure codecs, no link and no state.  `Instruction` is what a host sends and what the program memory holds;
`Reply` is what a module answers.

Source: manual 6.1, 6.2; the CAN reply's layout from the vendor's own host library (fidelity TMCL-12).
"""

from __future__ import annotations

import struct
from typing import Final, NamedTuple

SIZE: Final = 9
"""Bytes of a serial telegram."""
RECORD_SIZE: Final = 8
"""Bytes of an instruction in a program image file."""
CAN_SIZES: Final = (7, 8)

_REQUEST = struct.Struct(">BBBBi")
REPLY_BODY: Final = struct.Struct(">BBBBi")
"""Host address, module address, status, command, value: a reply without its checksum."""
TELEGRAM: Final = struct.Struct(">BBBBiB")
"""Address, command, type, motor, value, checksum: a whole request; or host and module address, status, command, value,
checksum: a whole reply."""
INSTRUCTION: Final = struct.Struct(">BBBi")
"""Command, type, motor, value: what program memory and image files hold, and a CAN request."""


class Instruction(NamedTuple):
    """One command: number, type, motor or bank, and a signed 32-bit value."""

    number: int
    type: int = 0
    motor: int = 0
    value: int = 0


END_MARK: Final = Instruction(0)
"""What erased program memory holds, and what the TMCL-IDE sends as the last instruction of a download."""


class Reply(NamedTuple):
    """A module's answer; `host` is the receiver's address, `address` the module's own."""

    host: int
    address: int
    status: int
    command: int
    value: int = 0


class ChecksumError(ValueError):
    """A telegram whose last byte is not the sum of the others."""


def checksum(data: bytes | bytearray | memoryview) -> int:
    """The 8-bit sum of `data` (manual 6.1)."""
    return sum(data) & 0xFF


def signed32(value: int) -> int:
    """`value` modulo 2**32, as a signed number."""
    return ((value + 0x8000_0000) & 0xFFFF_FFFF) - 0x8000_0000


def pack_request(address: int, instruction: Instruction) -> bytes:
    """The nine bytes that send `instruction` to module `address` (0..255)."""
    number, type_, motor, value = instruction
    total = address + number + type_ + motor + value + (value >> 8) + (value >> 16) + (value >> 24)
    return TELEGRAM.pack(address, number, type_, motor, value, total & 0xFF)


def unpack_request(telegram: bytes | bytearray | memoryview) -> tuple[int, Instruction]:
    """Address and instruction of a nine-byte telegram.

    Raises `ChecksumError` when its sum is wrong and `ValueError` when it has not nine bytes.
    """
    _check(telegram)
    address, number, type_, motor, value = _REQUEST.unpack_from(telegram)
    return address, Instruction(number, type_, motor, value)


def pack_reply(reply: Reply) -> bytes:
    """The nine bytes of `reply`."""
    body = REPLY_BODY.pack(*reply)
    return body + bytes((sum(body) & 0xFF,))


def unpack_reply(telegram: bytes | bytearray | memoryview) -> Reply:
    """The reply in nine bytes; raises like `unpack_request`."""
    _check(telegram)
    return Reply(*REPLY_BODY.unpack_from(telegram))


def pack_can_request(instruction: Instruction, size: int = 7) -> bytes:
    """The data bytes of a CAN frame with `instruction`; an eighth byte is 0."""
    return INSTRUCTION.pack(*instruction) + bytes(size - 7)


def unpack_can_request(data: bytes | bytearray | memoryview) -> Instruction:
    """The instruction in seven or eight CAN data bytes; `ValueError` for another number of them."""
    _check_can(data)
    return Instruction(*INSTRUCTION.unpack_from(data))


def pack_can_reply(reply: Reply, size: int = 7) -> bytes:
    """The data bytes of a CAN frame with `reply`: address, status, command, value; an eighth byte is 0."""
    return REPLY_BODY.pack(*reply)[1:] + bytes(size - 7)


def unpack_can_reply(data: bytes | bytearray | memoryview, host: int = 0) -> Reply:
    """The reply in seven or eight CAN data bytes; `host` fills the field that CAN leaves out."""
    _check_can(data)
    return Reply(*REPLY_BODY.unpack_from(bytes((host,)) + bytes(data)))


def pack_record(instruction: Instruction) -> bytes:
    """The eight bytes of `instruction` in a program image file: no address, 8-bit sum last."""
    body = INSTRUCTION.pack(*instruction)
    return body + bytes((sum(body) & 0xFF,))


def unpack_record(record: bytes | bytearray | memoryview) -> Instruction:
    """The instruction in eight bytes of a program image file; `ChecksumError` when the sum is wrong."""
    if len(record) != RECORD_SIZE:
        raise ValueError(f"a record has {RECORD_SIZE} bytes, not {len(record)}")
    if checksum(record[:-1]) != record[-1]:
        raise ChecksumError(f"checksum {record[-1]:#04x}, expected {checksum(record[:-1]):#04x}")
    return Instruction(*INSTRUCTION.unpack_from(record))


def _check(telegram: bytes | bytearray | memoryview) -> None:
    if len(telegram) != SIZE:
        raise ValueError(f"a telegram has {SIZE} bytes, not {len(telegram)}")
    if checksum(telegram[:-1]) != telegram[-1]:
        raise ChecksumError(f"checksum {telegram[-1]:#04x}, expected {checksum(telegram[:-1]):#04x}")


def _check_can(data: bytes | bytearray | memoryview) -> None:
    if len(data) not in CAN_SIZES:
        raise ValueError(f"a CAN frame has 7 or 8 bytes, not {len(data)}")
