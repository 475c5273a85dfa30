"""What a module answers, decoded; and which commands may be sent again.

Source: manual 6.1, 6.2, 6.7.34, 6.7.36; the form of 134's reply: fidelity FW-82.
"""

from __future__ import annotations

import re
from typing import Final, NamedTuple

from tmcm34x.host.exceptions import GarbledReplyError, LateReplyError, NoReplyError, ReplyError
from tmcm34x.tmcl.commands import BY_MNEMONIC, BY_NUMBER, MOTORS, RFS_TYPES
from tmcm34x.tmcl.datagram import SIZE, Instruction, Reply, unpack_reply
from tmcm34x.tmcl.global_parameters import BY_KEY as GLOBAL_KEYS
from tmcm34x.tmcl.mnemonic import format_instruction
from tmcm34x.tmcl.numbers import CONTROL
from tmcm34x.tmcl.status import STATUS_TEXTS, Status

_GAP, _GGP, GIO, _GCO, _RFS, _SGP = (
    BY_MNEMONIC[name].number for name in ("GAP", "GGP", "GIO", "GCO", "RFS", "SGP")
)
_QUIT_DOWNLOAD: Final = CONTROL.QUIT_DOWNLOAD
READ_MEMORY: Final = CONTROL.READ_PROGRAM_MEMORY
GET_STATUS: Final = CONTROL.GET_APPLICATION_STATUS
VERSION: Final = CONTROL.GET_FIRMWARE_VERSION
_EVENT: Final = bytes((Status.POSITION_REACHED, 138))
VERSION_TEXT: Final = re.compile(rb"[0-9]{3,4}[VB][0-9.]{3,4}\Z")
_OK: Final = int(Status.OK)
WRONG_CHECKSUM: Final = int(Status.WRONG_CHECKSUM)
ADDRESS_CHANGE: Final = (_SGP, GLOBAL_KEYS["serial_address"].number, 0)
_RANDOM: Final = (_GGP, GLOBAL_KEYS["random_number"].number, 0)
_RFS_STATUS: Final = dict(RFS_TYPES)["STATUS"]
_RFS_STOP: Final = dict(RFS_TYPES)["STOP"]
_MST: Final = BY_MNEMONIC["MST"].number
_STOP_PROGRAM: Final = CONTROL.STOP_APPLICATION
_RESET_PROGRAM: Final = CONTROL.RESET_APPLICATION
_ALWAYS: Final = frozenset({_GAP, GIO, READ_MEMORY, GET_STATUS, VERSION, _QUIT_DOWNLOAD})


def repeatable(instruction: Instruction) -> bool:
    """Whether a command may be sent again when it is not known whether it was executed.

    Those that only read, and 133, which leaves download mode however often it comes.
    """
    number, type_, motor, _ = instruction
    if number in _ALWAYS:
        return True
    if number == _GGP:
        return (number, type_, motor) != _RANDOM
    return (number == _GCO and motor < MOTORS) or (number == _RFS and type_ == _RFS_STATUS)


def stopping(instruction: Instruction) -> bool:
    """Whether a command stops something: it goes out at once, and the reply to an earlier one like it is as good."""
    number, type_ = instruction[:2]
    return number in {_MST, _STOP_PROGRAM, _RESET_PROGRAM, _QUIT_DOWNLOAD} or (
        number == _RFS and type_ == _RFS_STOP
    )


class Answer(NamedTuple):
    """What a module answered.

    stored: the instruction that 134 reads
    text: what 136 tells, type and version
    telegram: the bytes as they came
    """

    status: int
    value: int
    telegram: bytes
    stored: Instruction | None = None
    text: str = ""

    @property
    def reply(self) -> Reply:
        """All fields of a reply in the normal form."""
        return unpack_reply(self.telegram)


def decode(instruction: Instruction, telegram: bytes) -> Answer:
    """The answer in the nine bytes that answered a command, where it is known that they did."""
    number, type_ = instruction[:2]
    if number == VERSION and type_ == 0 and VERSION_TEXT.match(telegram[1:]):
        return Answer(_OK, 0, telegram, text=telegram[1:].decode("ascii"))
    if number == READ_MEMORY and telegram[3] != READ_MEMORY:
        stored = Instruction(telegram[1], telegram[2], telegram[3], value_of(telegram))
        return Answer(_OK, stored.value, telegram, stored=stored)
    return Answer(telegram[2], value_of(telegram), telegram)


def meaning(instruction: Instruction, answer: Answer) -> str:
    """What an answer says, for people: the version, the stored instruction, or the status by its name."""
    if answer.text:
        return answer.text
    if answer.stored is not None:
        return format_instruction(answer.stored)
    text = STATUS_TEXTS.get(answer.status, "unknown status")
    row = BY_NUMBER.get(instruction.number)
    controls = row is not None and not row.mnemonic and answer.status == _OK
    return f"{row.title}: {text}" if row is not None and controls else text


OWN_FORMS: Final = frozenset({READ_MEMORY, VERSION})
DAMAGED: Final = bytes((Status.WRONG_CHECKSUM, 0, 0, 0, 0, 0))
"""Status, command and value of a module's report that a telegram arrived damaged (manual 6.2)."""
PLAIN: Final = frozenset(STATUS_TEXTS) - {Status.WRONG_CHECKSUM, Status.POSITION_REACHED}
"""Statuses of replies that need no second thought."""
REFUSALS: Final = frozenset({
    Status.NOT_AVAILABLE, Status.INVALID_VALUE, Status.LOADED, Status.INVALID_COMMAND, Status.WRONG_TYPE,
})  # fmt: skip


def is_whole(window: bytes) -> bool:
    """Whether the last byte is the sum of the others."""
    return sum(window[:-1]) & 0xFF == window[-1]


def is_event(window: bytes) -> bool:
    """Whether nine bytes are the second reply of command 138."""
    return window[2:4] == _EVENT and is_whole(window)


def value_of(window: bytes) -> int:
    """The value field of nine bytes."""
    return int.from_bytes(window[4:8], "big", signed=True)


def normal(window: bytes) -> Answer:
    """A reply in the normal form."""
    return Answer(window[2], value_of(window), window)


def failure(instruction: Instruction, received: bytes, *, late: bool, misdirected: bool) -> ReplyError:
    """Why a command has no answer, by what came.

    late: replies to earlier commands came
    misdirected: replies to commands of another host came
    """
    if late:
        return LateReplyError(
            instruction,
            "replies came that may be those of earlier commands; raise the time-out of the connection",
        )
    if received and misdirected:
        return GarbledReplyError(
            instruction, "replies to commands of another host came; only one host may use the line at a time"
        )
    if (address := _address_in(received, instruction.number)) is not None:
        return GarbledReplyError(
            instruction,
            f"the reply came from address {address}, which was not asked; give address={address} in the URL if that "
            "is the module that is meant (on CAN, one that is called by its second identifier, 83)",
        )
    if received:
        return GarbledReplyError(
            instruction,
            f"no reply in {received[:32].hex(' ')}; check the bit rate, the wiring and the other end of the line",
        )
    return NoReplyError(
        instruction, "no reply in time; check power, wiring, address and bit rate (`tmcm34x scan` finds them)"
    )


def _address_in(received: bytes, number: int) -> int | None:
    """The address in a whole reply to command `number`, where there is one."""
    windows = (received[start : start + SIZE] for start in range(len(received) - SIZE + 1))
    whole = (
        window for window in windows if window[3] == number and window[2] in STATUS_TEXTS and is_whole(window)
    )
    return next((window[1] for window in whole), None)
