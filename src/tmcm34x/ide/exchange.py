"""One command and its answer, as pages show them; what they say is the host library's."""

from __future__ import annotations

from tmcm34x.host.answer import decode, meaning
from tmcm34x.ide.wire import Exchange
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.mnemonic import format_instruction


def answered(instruction: Instruction, sent: bytes, received: bytes) -> Exchange:
    """An exchange that was answered with nine bytes."""
    answer = decode(instruction, received)
    return Exchange(
        format_instruction(instruction), sent.hex(" "), received.hex(" "), answer.status, answer.value,
        meaning(instruction, answer),
    )  # fmt: skip


def unanswered(instruction: Instruction, sent: bytes, why: str) -> Exchange:
    """A command to which nothing came."""
    return Exchange(format_instruction(instruction), sent.hex(" "), "", 0, 0, why)
