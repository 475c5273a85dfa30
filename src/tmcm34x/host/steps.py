"""What a host does with a module, written once for all faces: generators of steps.

A step is a command to have answered, or a pause.  An operation is a generator that yields steps and gets back what
the module answered; whatever drives it (`Connection.run`, `AsyncConnection.run`, the IDE) sends, waits, and throws a
`HostError` in where no reply comes.  So an operation has no line and no clock of its own, and can be interrupted in
the middle: what it does in `finally` is still driven.

    def counter() -> Steps[int]:
        return (yield from value(Instruction(GGP, 130)))
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import Any, Final, Generic, NamedTuple, TypeVar, cast

from tmcm34x.host.answer import Answer
from tmcm34x.host.exceptions import DamagedError, DownloadModeError, RefusedError, ReplyError
from tmcm34x.host.reading import Reading, Refused, Silent, Value
from tmcm34x.tmcl.commands import BY_MNEMONIC, MOVE_TYPES, RFS_TYPES
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.numbers import CONTROL
from tmcm34x.tmcl.status import Status

T = TypeVar("T")


class Pause(NamedTuple):
    """Let time pass; events that come meanwhile are kept."""

    seconds: float


class Clock(NamedTuple):
    """Tell the time of the line [s]."""


class Follow(NamedTuple):
    """The module has another address, bit rate or identifier now: talk to it there, where the line has such."""

    address: int | None = None
    baud: int | None = None
    can_id: int | None = None
    can_reply: int | None = None
    can_bit_rate: int | None = None


LOST: Final = (ReplyError, DamagedError)
"""What a bad line does to a command: the answer is lost, or the command itself."""
Step = Instruction | Pause | Clock | Follow
Steps = Generator[Step, Any, T]


class Work(Generic[T]):
    """An operation under way: `step` is what to do next, None when it is over and `result` is there."""

    def __init__(self, steps: Steps[T]) -> None:
        self.step: Step | None = None
        self._steps = steps
        self._result: T | None = None
        self._go(lambda: next(steps))

    def send(self, answer: object) -> None:
        """What the step gave."""
        self._go(lambda: self._steps.send(answer))

    def throw(self, error: BaseException) -> None:
        """The step failed; what the operation does about it may be further steps."""
        self._go(lambda: self._steps.throw(error))

    @property
    def result(self) -> T:
        """What the operation returns."""
        return cast("T", self._result)

    def _go(self, move: Callable[[], Step]) -> None:
        try:
            self.step = move()
        except StopIteration as end:
            self.step, self._result = None, end.value


NUMBERS: Final = {mnemonic: row.number for mnemonic, row in BY_MNEMONIC.items()}
"""Command numbers by mnemonic."""
MOVES: Final = dict(MOVE_TYPES)
SEARCHES: Final = dict(RFS_TYPES)
STOP: Final = CONTROL.STOP_APPLICATION
RUN: Final = CONTROL.RUN_APPLICATION
STEP: Final = CONTROL.STEP_APPLICATION
RESET: Final = CONTROL.RESET_APPLICATION
START_DOWNLOAD: Final = CONTROL.START_DOWNLOAD
QUIT_DOWNLOAD: Final = CONTROL.QUIT_DOWNLOAD
READ_MEMORY: Final = CONTROL.READ_PROGRAM_MEMORY
GET_STATUS: Final = CONTROL.GET_APPLICATION_STATUS
VERSION: Final = CONTROL.GET_FIRMWARE_VERSION
FACTORY_RESET: Final = CONTROL.RESTORE_FACTORY_SETTINGS
REQUEST_EVENT: Final = CONTROL.REQUEST_TARGET_REACHED
ASCII_MODE: Final = CONTROL.ENTER_ASCII_MODE

_OK: Final = int(Status.OK)
_FIRST_CONTROL: Final = CONTROL.STOP_APPLICATION


def now() -> Steps[float]:
    """The time of the line [s], of an arbitrary origin."""
    time: float = yield Clock()
    return time


def ask(instruction: Instruction) -> Steps[Answer]:
    """Whatever the module answers, refusals included."""
    answer: Answer = yield instruction
    return answer


def ask_again(instruction: Instruction) -> Steps[Answer]:
    """`ask`, and a second time where no answer came or the command arrived damaged.

    For operations of thousands of telegrams: one that is lost again and again must not spoil the whole.
    """
    try:
        answer = yield from ask(instruction)
    except ReplyError:
        return (yield from ask(instruction))
    return answer if answer.status != Status.WRONG_CHECKSUM else (yield from ask(instruction))


def value(instruction: Instruction) -> Steps[int]:
    """The value of the reply.  Raises `RefusedError`."""
    answer = yield from ask(instruction)
    return check(instruction, answer).value


def check(instruction: Instruction, answer: Answer) -> Answer:
    """The answer, if it is not a refusal."""
    if answer.status == _OK:
        return answer
    if answer.status == Status.WRONG_CHECKSUM:
        raise DamagedError(instruction, answer.reply)
    if answer.status == Status.LOADED or (
        answer.status == Status.NOT_AVAILABLE and instruction.number in _NEVER_UNAVAILABLE
    ):
        raise DownloadModeError(instruction, answer.reply)
    raise RefusedError(instruction, answer.reply)


_NEVER_UNAVAILABLE: Final = frozenset({STOP, RUN, STEP, RESET, GET_STATUS, VERSION})
"""Control functions that a module refuses with status 6 only in download mode."""


def executing() -> Steps[None]:
    """Make sure that the module executes commands.  Raises `DownloadModeError` where it stores them.

    Asks for the state of the program, which is refused in download mode and not stored: whatever looks at a module
    begins with this, so that it does not overwrite the program (fidelity PROG-15).  No reply says nothing.
    """
    instruction = Instruction(GET_STATUS)
    try:
        answer = yield from ask(instruction)
    except ReplyError:
        return
    if answer.status in {Status.LOADED, Status.NOT_AVAILABLE}:
        raise DownloadModeError(instruction, answer.reply)


def reading(instruction: Instruction, ask: Callable[[Instruction], Steps[Answer]] = ask) -> Steps[Reading]:
    """The value, or why there is none, for tables.

    Raises `LinkError` where the line is gone, `DownloadModeError` where the module has stored the command.

    ask: `ask`, or `ask_again`
    """
    try:
        answer = yield from ask(instruction)
    except ReplyError as error:
        return Silent(str(error))
    if answer.status == Status.LOADED:
        raise DownloadModeError(instruction, answer.reply)
    return Value(answer.value) if answer.status == _OK else Refused(answer.status)


def insist(instruction: Instruction, times: int = 10) -> Steps[int]:
    """A command whose repetition does no harm, sent until it is answered.  Raises what the last attempt did."""
    for _ in range(times - 1):
        try:
            return (yield from value(instruction))
        except LOST:
            continue
    return (yield from value(instruction))


def settle(write: Instruction, read: Instruction) -> Steps[None]:
    """Set a value, and where no reply came see whether it was set before it is sent again."""
    for _ in range(_ATTEMPTS):
        try:
            yield from value(write)
        except LOST:
            if check(read, (yield from ask_again(read))).value == write.value:
                return
        else:
            return
    yield from value(write)


_ATTEMPTS: Final = 5
