"""What telegrams say, for logs and for people: one line for each.

Takes what `datagram` codes, the frames of CAN, lines of the ASCII interface, and the two replies of their own form,
those of 134 and 136.

Source: manual 6.1, 6.2, 6.7.36; the form of 134's reply: fidelity FW-82.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, Literal, NamedTuple

from tmcm34x.tmcl.commands import BY_NUMBER
from tmcm34x.tmcl.datagram import (
    SIZE,
    Instruction,
    Reply,
    unpack_can_reply,
    unpack_can_request,
    unpack_reply,
    unpack_request,
)
from tmcm34x.tmcl.mnemonic import format_instruction
from tmcm34x.tmcl.status import STATUS_TEXTS, Status

Direction = Literal[">", "<"]
Kind = Literal["telegram", "frame", "text", "incomplete"]
"""What bytes are: nine of a serial line, those of a CAN frame, of the ASCII interface, or too few."""


class Meaning(NamedTuple):
    """What bytes say.

    address: of the module that a command is for or a reply comes from; None where there is none
    status: of a reply that has one, else 0
    """

    text: str
    address: int | None = None
    status: int = 0


def explain(direction: Direction, data: bytes, kind: Kind) -> Meaning:
    """What bytes to a module (`>`) or from one say."""
    try:
        return _EXPLAIN[kind, direction](data)
    except ValueError:
        return Meaning("no telegram")


def _request(data: bytes) -> Meaning:
    address, instruction = unpack_request(data)
    return Meaning(_command(instruction), address)


def _command(instruction: Instruction) -> str:
    row = BY_NUMBER.get(instruction.number)
    if row is None or row.mnemonic:
        return format_instruction(instruction)
    return f"{instruction.number} {row.title}, {instruction.value}"


def _reply(data: bytes) -> Meaning:
    if len(data) == SIZE and data[1:4].isdigit() and data[4:5] in b"VB":
        return Meaning(f"version {data[1:].decode('latin-1')}", None, Status.OK)
    return _replied(unpack_reply(data))


def _replied(reply: Reply) -> Meaning:
    text = STATUS_TEXTS.get(reply.status)
    if text is None:
        return Meaning("a reply of its own form")
    return Meaning(f"{reply.status} {text}, value {reply.value}", reply.address, reply.status)


def _text(data: bytes) -> Meaning:
    return Meaning(repr(data.decode("latin-1")))


def _incomplete(_: bytes) -> Meaning:
    return Meaning("incomplete")


_EXPLAIN: Final[dict[tuple[Kind, Direction], Callable[[bytes], Meaning]]] = {
    ("telegram", ">"): _request,
    ("telegram", "<"): _reply,
    ("frame", ">"): lambda data: Meaning(_command(unpack_can_request(data))),
    ("frame", "<"): lambda data: _replied(unpack_can_reply(data)),
    ("text", ">"): _text,
    ("text", "<"): _text,
    ("incomplete", ">"): _incomplete,
    ("incomplete", "<"): _incomplete,
}
