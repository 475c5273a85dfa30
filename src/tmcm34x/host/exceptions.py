"""What can go wrong between a host and a module: one tree.

HostError
├── LinkError                the port or socket cannot be opened
│   └── LostLinkError        it is gone: unplugged, or the other side has hung up
├── ReplyError               the module's answer did not arrive
│   ├── NoReplyError         nothing came in time
│   │   └── LateReplyError   the answer to an earlier command came: the time-out is too short
│   └── GarbledReplyError    bytes came, but no reply to this command
├── RefusedError             the module answered with an error status, and has done nothing
│   ├── DamagedError         the command arrived damaged each time that it was sent (status 1)
│   ├── DownloadModeError    the module stores commands instead of executing them
│   └── ProtectedError       the program memory is protected against reading or overwriting
├── NotAvailableError        this model does not have it; nothing was sent
├── RangeError               the value is outside the table's range; nothing was sent
├── NotReachedError          a motor did not reach its target, or a search its end, in time
├── VerifyError              what was read back is not what was written
└── FileError                a settings or backup file is not usable: path, line and reason

No reply, a refusal, "not on this model" and the value 0 are four different things: the first three are exceptions
here, and types in `reading` where values stand in tables.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import contextmanager
from typing import Final

from tmcm34x.tmcl.commands import BY_NUMBER
from tmcm34x.tmcl.datagram import Instruction, Reply
from tmcm34x.tmcl.mnemonic import format_instruction
from tmcm34x.tmcl.status import STATUS_TEXTS, Status

LEAVE_DOWNLOAD: Final = (
    "`tmcm34x stop` (command 133) ends that, also where another host is just loading a program"
)
"""What a person can do about a module in download mode."""


class HostError(Exception):
    """Any failure of a conversation with a module; the text is one line."""


class LinkError(HostError):
    """The port or socket cannot be opened or used."""


class LostLinkError(LinkError):
    """The port or socket was there and is gone; what was under way may have been done in part."""


class ReplyError(HostError):
    """The answer to `instruction` did not arrive; whether it was executed is not known."""

    def __init__(self, instruction: Instruction, what: str) -> None:
        super().__init__(f"{named(instruction)}: {what}")
        self.instruction = instruction


class NoReplyError(ReplyError):
    """Nothing came in time: no power, wrong port, address or bit rate, or replies switched off."""


class LateReplyError(NoReplyError):
    """Nothing came in time, but answers to earlier commands did: the time-out is too short."""


class GarbledReplyError(ReplyError):
    """Bytes came, but no reply to this command: wrong bit rate, a bad line, or another host on it."""


class RefusedError(HostError):
    """The module answered with an error status, and has done nothing."""

    def __init__(self, instruction: Instruction, reply: Reply) -> None:
        super().__init__(f"{named(instruction)}: {refusal_text(instruction, reply.status)}")
        self.instruction = instruction
        self.reply = reply

    @property
    def status(self) -> int:
        """The status code (manual 6.2.1)."""
        return self.reply.status


class DamagedError(RefusedError):
    """The command arrived damaged each time that it was sent: status 1."""


class DownloadModeError(RefusedError):
    """The module stores commands instead of executing them: status 101, or 6 to a control function."""

    def __init__(self, instruction: Instruction, reply: Reply) -> None:
        super().__init__(instruction, reply)
        self.args = (
            f"{named(instruction)}: the module is in download mode and stores commands instead of "
            f"executing them; {LEAVE_DOWNLOAD}",
        )


class ProtectedError(RefusedError):
    """The program memory is protected against reading or overwriting (global parameter 81)."""

    def __init__(self, instruction: Instruction, reply: Reply, what: str) -> None:
        super().__init__(instruction, reply)
        self.args = (
            f"the program memory is protected against {what} (global parameter 81); giving up a protection against "
            "reading erases the program",
        )


class NotAvailableError(HostError):
    """This model does not have it; nothing was sent."""


class RangeError(HostError, ValueError):
    """The value is outside the table's range; nothing was sent."""


class NotReachedError(HostError):
    """A motor did not reach its target, or a reference search its end, in time."""


class VerifyError(HostError):
    """What was read back is not what was written."""


class FileError(HostError):
    """A settings or backup file that is not usable.

    line: where in the file, 0 if no line can be named
    """

    def __init__(self, path: str, line: int, text: str) -> None:
        super().__init__(f"{path}:{line}: {text}" if line else f"{path}: {text}")
        self.line = line


def named(instruction: Instruction) -> str:
    """A command in an error: the mnemonic and its operands, or the title of a control function and its number."""
    row = BY_NUMBER.get(instruction.number)
    if row is None or row.mnemonic:
        return format_instruction(instruction)
    place = f" at {instruction.value}" if instruction.value else ""
    return f"{row.title}{place} ({row.number})"


@contextmanager
def unfinished(
    what: Callable[[], str], errors: tuple[type[HostError], ...] = (ReplyError, LinkError, DownloadModeError)
) -> Generator[None]:
    """Have the error that ends an operation in the middle say what was done until then, and what was not."""
    try:
        yield
    except errors as error:
        text = str(error)
        error.args = (f"{text}{'' if text.endswith('?') else ';'} {what()}",)
        raise


_ADVICE = {
    Status.WRONG_CHECKSUM: "the module receives damaged telegrams; check wiring, termination and bit rate",
    Status.EEPROM_LOCKED: "unlock it with SGP 73, 0, 4321",
    Status.LOADED: f"the module is in download mode and has not executed it; {LEAVE_DOWNLOAD}",
}


def refusal_text(instruction: Instruction, status: int) -> str:
    """What an error status says, with advice where there is some."""
    text = f"status {status}, {STATUS_TEXTS.get(status, 'unknown status')}"
    advice = _ADVICE.get(Status(status)) if status in STATUS_TEXTS else None
    return f"{text}: {advice}" if advice else text
