"""The program memory of a module and its stand-alone program.

A download can be interrupted anywhere without leaving the module in download mode, and says that it is done only
when all has been read back.  Where a reply is lost, the memory itself tells whether the command arrived.

Source: manual 6.7.36, 8.1 (81, 128, 130); how hosts use it: fidelity PROG (download, upload, start).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final, NamedTuple

from tmcm34x.host.connection import Connection
from tmcm34x.host.exceptions import (
    DamagedError,
    DownloadModeError,
    HostError,
    ProtectedError,
    RangeError,
    RefusedError,
    ReplyError,
    VerifyError,
    unfinished,
)
from tmcm34x.host.steps import (
    LOST,
    NUMBERS,
    QUIT_DOWNLOAD,
    READ_MEMORY,
    RESET,
    RUN,
    START_DOWNLOAD,
    STEP,
    STOP,
    Steps,
    ask,
    ask_again,
    check,
    executing,
    insist,
    value,
)
from tmcm34x.tmcl.commands import PROGRAM_SIZE
from tmcm34x.tmcl.datagram import Instruction, Reply
from tmcm34x.tmcl.global_parameters import BY_KEY
from tmcm34x.tmcl.mnemonic import format_instruction
from tmcm34x.tmcl.status import Status

END: Final = Instruction(0)
"""What stands behind a program, as the TMCL-IDE writes it: erased memory, or the IDE's own end mark."""
NO_COMMANDS: Final = frozenset({END.number, 255})
"""First bytes of a memory without a program: the end mark, and an erased EEPROM."""
ATTEMPTS: Final = 8
"""How often the download of one instruction is taken up again."""

_GGP: Final = NUMBERS["GGP"]
_STATUS, _COUNTER, _PROTECTION = (
    BY_KEY[key].number for key in ("application_status", "program_counter", "code_protection")
)

Progress = Callable[[int, int], None]
"""Takes how many instructions of how many are done."""
Tell = Callable[[str], None]
"""Takes a line for the user."""


class ProgramState(NamedTuple):
    """What the stand-alone program is doing."""

    status: int
    """0 stop, 1 run, 2 step, 3 reset (global parameter 128)."""
    counter: int
    """Address of the command being executed (global parameter 130)."""


def silent(*_: object) -> None:
    """Progress and news that are not wanted."""


# Run control


def stop(tell: Tell = silent) -> Steps[None]:
    """Stop the program; a module in download mode is taken out of it first, and `tell` gets a line about it."""
    try:
        yield from insist(Instruction(STOP))
    except DownloadModeError:
        yield from quit_download()
        tell("The module was in download mode, perhaps from an interrupted download; it has left it (133).")
        yield from insist(Instruction(STOP))


def run(address: int | None = None) -> Steps[None]:
    """Start or continue the program, from `address` if one is given."""
    yield from value(Instruction(RUN, 0 if address is None else 1, 0, address or 0))


def step() -> Steps[None]:
    """Execute one command."""
    yield from value(Instruction(STEP))


def reset() -> Steps[None]:
    """Stop the program and go back to its start."""
    yield from insist(Instruction(RESET))


def restart() -> Steps[None]:
    """Start the program from its beginning."""
    yield from reset()
    yield from run()


def state() -> Steps[ProgramState]:
    """What the program is doing, and where."""
    status = yield from value(Instruction(_GGP, _STATUS))
    counter = yield from value(Instruction(_GGP, _COUNTER))
    return ProgramState(status, counter)


def quit_download() -> Steps[None]:
    """Leave download mode; sent until it is acknowledged (133)."""
    yield from insist(Instruction(QUIT_DOWNLOAD))


# The memory


def read_instruction(address: int) -> Steps[Instruction]:
    """The instruction at `address` of the program memory (134).  Raises `ProtectedError`."""
    instruction = Instruction(READ_MEMORY, value=address)
    answer = yield from ask_again(instruction)
    if answer.status == Status.NOT_AVAILABLE:
        raise (yield from _why_refused(instruction, answer.reply, 1, "reading"))
    stored = check(instruction, answer).stored
    assert stored is not None
    return stored


def upload(
    address: int = 0, size: int | None = None, progress: Progress = silent
) -> Steps[tuple[Instruction, ...]]:
    """Read `size` instructions from `address` on; without a size, up to the end mark.  Raises `ProtectedError`."""
    total = PROGRAM_SIZE - address if size is None else size
    instructions: list[Instruction] = []
    for offset in range(total):
        instruction = yield from read_instruction(address + offset)
        if size is None and instruction.number == END.number:
            break
        instructions.append(instruction)
        progress(offset + 1, total)
    return tuple(instructions)


def download(
    instructions: Sequence[Instruction],
    *,
    address: int = 0,
    verify: bool = True,
    progress: Progress = silent,
    tell: Tell = silent,
) -> Steps[None]:
    """Store `instructions` from `address` on, with an end mark behind them, and read them back.

    Stops a running program, and leaves it reset.  Raises `VerifyError` at the first instruction that comes back
    differently, `ProtectedError` where the memory is protected, `RangeError` where it is too small; `ReplyError` and
    `LinkError` say how much is stored.
    """
    marked = with_end_mark(instructions, address)
    total = len(marked) * (2 if verify else 1)
    so_far = 0

    def show(done: int) -> None:
        nonlocal so_far
        so_far = done
        progress(done, total)

    with unfinished(lambda: "nothing is stored"):
        yield from stop(tell)
    try:
        with unfinished(lambda: _so_far(so_far, len(marked))):
            yield from store(marked, address, lambda done, _: show(done))
            if verify:
                yield from check_stored(marked, address, lambda done, _: show(len(marked) + done))
            yield from reset()
    except KeyboardInterrupt:
        tell(f"Interrupted: {_so_far(so_far, len(marked))}.")
        raise


def _so_far(done: int, size: int) -> str:
    """What a download that has ended early has done."""
    if done >= size:
        return f"all {size} instructions are stored, {done - size} of them verified"
    return f"{done} of {size} instructions are stored, so the program is not complete; download it again"


def differing(
    instructions: Sequence[Instruction], address: int = 0, progress: Progress = silent
) -> Steps[int]:
    """How many instructions of the memory are not what a download of `instructions` would leave there."""
    marked = with_end_mark(instructions, address)
    count = 0
    for offset, expected in enumerate(marked):
        count += (yield from read_instruction(address + offset)) != expected
        progress(offset + 1, len(marked))
    return count


def with_end_mark(instructions: Sequence[Instruction], address: int = 0) -> list[Instruction]:
    """`instructions` with an end mark, where there is room for one.  Raises `RangeError`."""
    room = PROGRAM_SIZE - address
    if not 0 < len(instructions) <= room:
        raise RangeError(
            f"{len(instructions)} instructions do not fit at address {address}: there is room for {room}"
            if instructions
            else "the program has no instructions"
        )
    return [*instructions, END] if len(instructions) < room else list(instructions)


def store(instructions: Sequence[Instruction], address: int, progress: Progress = silent) -> Steps[None]:
    """Write the program memory from `address` on; whatever happens, the module leaves download mode."""
    done, attempts = 0, 0
    while done < len(instructions):
        start = done
        try:
            done = yield from _store_some(instructions, done, address, progress)
        except LOST:
            attempts = 0 if done > start else attempts + 1
            if attempts >= ATTEMPTS:
                raise
            done = yield from _find_place(instructions, done, address)


def _store_some(
    instructions: Sequence[Instruction], done: int, address: int, progress: Progress
) -> Steps[int]:
    """Store what is left, as far as the replies come; returns how many are stored for certain."""
    yield from _start_download(address + done)
    try:
        while done < len(instructions):
            instruction = instructions[done]
            try:
                answer = yield from ask(instruction)
            except ReplyError:
                return (yield from _recover(instructions, done, address))
            if answer.status == Status.WRONG_CHECKSUM:
                raise DamagedError(instruction, answer.reply)
            if answer.status != Status.LOADED:
                raise RefusedError(instruction, answer.reply)
            done += 1
            progress(done, len(instructions))
    finally:
        yield from quit_download()
    return done


def _recover(instructions: Sequence[Instruction], done: int, address: int) -> Steps[int]:
    yield from quit_download()
    return (yield from _find_place(instructions, done, address))


def _find_place(instructions: Sequence[Instruction], done: int, address: int) -> Steps[int]:
    """Whether the instruction whose reply was lost is stored; where the memory cannot be read, store it again."""
    try:
        found = yield from read_instruction(address + done)
    except ProtectedError:
        return done
    return done + (found == instructions[done])


def _start_download(address: int) -> Steps[None]:
    instruction = Instruction(START_DOWNLOAD, value=address)
    for attempt in range(ATTEMPTS):
        try:
            answer = yield from ask(instruction)
            if answer.status != Status.NOT_AVAILABLE:
                check(instruction, answer)
                return
        except LOST:
            yield from quit_download()  # it may have arrived
            if attempt == ATTEMPTS - 1:
                raise
            continue
        raise (yield from _why_refused(instruction, answer.reply, 2, "overwriting"))


def check_stored(
    instructions: Sequence[Instruction], address: int, progress: Progress = silent
) -> Steps[None]:
    """Read the program memory back.  Raises `VerifyError`."""
    for offset, expected in enumerate(instructions):
        try:
            found = yield from read_instruction(address + offset)
            if found != expected:  # the sum of a reply misses some damages: see whether it is the same again
                found = yield from read_instruction(address + offset)
        except ProtectedError as error:
            raise VerifyError(f"the program is stored but cannot be read back: {error}") from error
        if found != expected:
            raise VerifyError(
                f"address {address + offset}: {format_instruction(found)} instead of {format_instruction(expected)}"
            )
        progress(offset + 1, len(instructions))


def holds(instructions: Sequence[Instruction], address: int = 0) -> Steps[bool]:
    """Whether the memory holds `instructions` from `address` on.  Raises `HostError` where it cannot be read."""
    for offset, instruction in enumerate(instructions):
        if (yield from read_instruction(address + offset)) != instruction:
            return False
    return True


def is_empty() -> Steps[bool]:
    """Whether the memory holds no program: an end mark or erased cells.  Raises `HostError`."""
    return (yield from read_instruction(0)).number in NO_COMMANDS


def _why_refused(instruction: Instruction, reply: Reply, bit: int, what: str) -> Steps[HostError]:
    """Why the memory is not available: protection, or download mode."""
    try:
        yield from executing()
    except DownloadModeError:
        return DownloadModeError(instruction, reply)
    protection = yield from ask(Instruction(_GGP, _PROTECTION))
    if protection.status == Status.OK and protection.value & bit:
        return ProtectedError(instruction, reply, what)
    return RefusedError(instruction, reply)


class Program:
    """The stand-alone program of the module at the other end of `connection`."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def download(
        self,
        instructions: Sequence[Instruction],
        *,
        address: int = 0,
        verify: bool = True,
        progress: Progress = silent,
    ) -> None:
        """See the function of this name."""
        self._connection.run(download(instructions, address=address, verify=verify, progress=progress))

    def upload(
        self, *, address: int = 0, size: int | None = None, progress: Progress = silent
    ) -> tuple[Instruction, ...]:
        """Read `size` instructions from `address` on; without a size, up to the end mark."""
        return self._connection.run(upload(address, size, progress))

    def run(self, address: int | None = None) -> None:
        """Start or continue the program, from `address` if one is given."""
        self._connection.run(run(address))

    def restart(self) -> None:
        """Start the program from its beginning."""
        self._connection.run(restart())

    def stop(self) -> None:
        """Stop the program; `run` continues it."""
        self._connection.run(stop())

    def step(self) -> None:
        """Execute one command."""
        self._connection.run(step())

    def reset(self) -> None:
        """Stop the program and go back to its start."""
        self._connection.run(reset())

    @property
    def state(self) -> ProgramState:
        """What the program is doing, and where."""
        return self._connection.run(state())
