"""One command and its answer, as pages show them.

Source: manual 6.1, 6.2; the replies of 134 and 136 have forms of their own (manual 6.7.36).
"""

from __future__ import annotations

from typing import Final

from tmcm34x.ide.wire import Exchange
from tmcm34x.tmcl.commands import BY_NUMBER
from tmcm34x.tmcl.datagram import Instruction, checksum, unpack_reply
from tmcm34x.tmcl.mnemonic import format_instruction
from tmcm34x.tmcl.numbers import CONTROL
from tmcm34x.tmcl.status import STATUS_TEXTS, Status

STOP_PROGRAM: Final = CONTROL.STOP_APPLICATION
RUN_PROGRAM: Final = CONTROL.RUN_APPLICATION
STEP_PROGRAM: Final = CONTROL.STEP_APPLICATION
RESET_PROGRAM: Final = CONTROL.RESET_APPLICATION
START_DOWNLOAD: Final = CONTROL.START_DOWNLOAD
QUIT_DOWNLOAD: Final = CONTROL.QUIT_DOWNLOAD
READ_MEMORY: Final = CONTROL.READ_PROGRAM_MEMORY
VERSION: Final = CONTROL.GET_FIRMWARE_VERSION
FACTORY_RESET: Final = CONTROL.RESTORE_FACTORY_SETTINGS
ASCII_MODE: Final = CONTROL.ENTER_ASCII_MODE


def text_of(instruction: Instruction) -> str:
    """The command as a person would write it, or its meaning and numbers."""
    return format_instruction(instruction)


def answered(instruction: Instruction, sent: bytes, received: bytes) -> Exchange:
    """An exchange that was answered with nine bytes."""
    status, value, meaning = _explain(instruction, received)
    return Exchange(text_of(instruction), sent.hex(" "), received.hex(" "), status, value, meaning)


def unanswered(instruction: Instruction, sent: bytes, why: str) -> Exchange:
    """A command to which nothing came."""
    return Exchange(text_of(instruction), sent.hex(" "), "", 0, 0, why)


def _explain(instruction: Instruction, received: bytes) -> tuple[int, int, str]:
    if instruction.number == VERSION and instruction.type == 0:
        return Status.OK, 0, received[1:].decode("latin-1")
    if instruction.number == READ_MEMORY and received[3] != READ_MEMORY:
        return Status.OK, instruction.value, format_instruction(stored(received))
    reply = unpack_reply(received)
    meaning = STATUS_TEXTS.get(reply.status, "unknown status")
    row = BY_NUMBER.get(instruction.number)
    if row is not None and not row.mnemonic and reply.status == Status.OK:
        meaning = f"{row.title}: {meaning}"
    return reply.status, reply.value, meaning


def stored(received: bytes) -> Instruction:
    """The instruction in the reply of command 134."""
    number, type_, motor = received[1:4]
    return Instruction(number, type_, motor, int.from_bytes(received[4:8], "big", signed=True))


def whole(received: bytes) -> bool:
    """Whether the last byte is the sum of the others."""
    return checksum(received[:-1]) == received[-1]
