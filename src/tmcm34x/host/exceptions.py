"""What can go wrong between a host and a module: one tree.

HostError
├── LinkError                the port or socket cannot be opened, or is gone
├── ReplyError               the module's answer did not arrive
│   ├── NoReplyError         nothing came in time
│   └── GarbledReplyError    bytes came, but no reply to this command
├── RefusedError             the module answered with an error status
└── VerifyError              what was read back is not what was written
"""

from __future__ import annotations

from tmcm34x.tmcl.datagram import Instruction, Reply
from tmcm34x.tmcl.mnemonic import format_instruction
from tmcm34x.tmcl.status import STATUS_TEXTS


class HostError(Exception):
    """Any failure of a conversation with a module; the text is one line."""


class LinkError(HostError):
    """The port or socket cannot be opened, or is gone."""


class ReplyError(HostError):
    """The answer to `instruction` did not arrive; whether it was executed is not known."""

    def __init__(self, instruction: Instruction, what: str) -> None:
        super().__init__(f"{format_instruction(instruction)}: {what}")
        self.instruction = instruction


class NoReplyError(ReplyError):
    """Nothing came in time: no module at this address, wrong bit rate, or replies switched off."""


class GarbledReplyError(ReplyError):
    """Bytes came, but no reply to this command."""


class RefusedError(HostError):
    """The module answered with an error status, and has done nothing."""

    def __init__(self, instruction: Instruction, reply: Reply) -> None:
        text = STATUS_TEXTS.get(reply.status, "unknown status")
        super().__init__(f"{format_instruction(instruction)}: status {reply.status}, {text}")
        self.instruction = instruction
        self.reply = reply

    @property
    def status(self) -> int:
        """The status code (manual 6.2.1)."""
        return self.reply.status


class VerifyError(HostError):
    """What was read back is not what was written."""
