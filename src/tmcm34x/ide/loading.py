"""Programs into the module's memory and out of it again.

Source: manual 6.7.36, control functions 128 to 134.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import takewhile
from typing import TYPE_CHECKING, Final

from tmcm34x.host import program
from tmcm34x.host.exceptions import HostError, ProtectedError, VerifyError
from tmcm34x.host.steps import Steps
from tmcm34x.ide import wire
from tmcm34x.ide.building import identity
from tmcm34x.ide.driving import run
from tmcm34x.ide.virtual import Virtual
from tmcm34x.tmcl.commands import PROGRAM_SIZE
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.firmware.storage import Eeprom
    from tmcm34x.ide.target import Target, Tell

_EACH: Final = 64
"""Instructions between two messages of progress."""


class Loading:
    """The program memory of `target`.

    tell: takes what pages should see
    hush: switches everything off that sends of its own accord, because the module would store it
    busy: a program is being stored
    listing: the program that the memory is known to hold
    """

    def __init__(self, target: Target, tell: Tell, hush: Callable[[bool], None]) -> None:
        self._target = target
        self._tell = tell
        self._hush = hush
        self.busy = False
        self._abort = False
        self.listing: wire.Listing | None = None
        self._loaded: tuple[Instruction, ...] = ()
        """The program that was last stored from here, whole."""
        self._revision = -1

    def abort(self) -> None:
        """Break a download off."""
        self._abort = True

    async def command(self, instruction: Instruction, expected: int = Status.OK) -> wire.Exchange:
        """A command that must succeed for the work to go on.  Raises `wire.RefusalError`."""
        exchange = await self._target.exchange(instruction)
        if exchange.status != expected:
            raise wire.RefusalError("module", f"{exchange.text}: {exchange.meaning}.")
        return exchange

    async def put(
        self, listing: wire.Listing, instructions: tuple[Instruction, ...], *, replace: bool
    ) -> None:
        """Have the memory hold `instructions`; `replace` allows it over a program that is not known."""
        same = self.listing is not None and self.listing.identity == listing.identity
        if same and (isinstance(self._target, Virtual) or await self._compare(instructions)):
            return
        if not replace:
            await self._expect_known()
        await self._store(instructions)

    async def _expect_known(self) -> None:
        """Refuse to write over a program that was not stored from here."""
        if isinstance(self._target, Virtual):
            return
        try:
            known = bool(self._loaded) and await self._compare(self._loaded)
            if known or await self._ask(program.is_empty()):
                return
        except ProtectedError as error:
            raise wire.RefusalError("unknown", f"The module may hold another program: {error}.") from error
        raise wire.RefusalError("unknown", "The module holds a program that this IDE has not loaded.")

    async def holds(self, instructions: Sequence[Instruction]) -> bool:
        """Whether the memory holds these instructions, and nothing behind them.  Raises `wire.RefusalError`."""
        if isinstance(self._target, Virtual):
            return bool(instructions) and _stored(self._target.module.eeprom) == list(instructions)
        same = bool(instructions) and await self._compare(program.with_end_mark(instructions))
        if same:
            self._loaded = tuple(instructions)
        return same

    async def _compare(self, instructions: Sequence[Instruction]) -> bool:
        """Whether the memory holds these instructions.  Raises `wire.RefusalError` where it cannot be read."""
        return await self._ask(program.holds(instructions))

    async def _ask(self, steps: Steps[bool]) -> bool:
        try:
            return await run(self._target.ask, steps)
        except ProtectedError:
            raise
        except HostError as error:
            raise wire.RefusalError("module", f"{error}.") from error

    async def _store(self, instructions: tuple[Instruction, ...]) -> None:
        """Store a program and read it back."""
        self.busy, self._abort, self._loaded = True, False, ()
        self._hush(True)

        def progress(done: int, total: int) -> None:
            if self._abort:
                raise wire.RefusalError("aborted", _aborted(min(done, len(instructions))))
            if done % _EACH == 0:
                self._tell(wire.Progress("Downloading", done, total))

        try:
            await run(self._target.ask, program.download(instructions, progress=progress, tell=self._say))
        except VerifyError as error:
            raise wire.RefusalError(
                "verify", f"The program is not stored as it should be: {error}."
            ) from error
        except HostError as error:
            raise wire.RefusalError("module", f"The download was aborted: {error}.") from error
        finally:
            self.busy = False
            self._hush(False)
            self._tell(wire.Progress("Downloading", 1, 1))
        self._loaded = instructions
        self._look()

    def _look(self) -> None:
        """What the memory holds now is not another host's."""
        if isinstance(self._target, Virtual):
            self._revision = self._target.module.eeprom.revision

    def _say(self, line: str) -> None:
        self._tell(wire.Output("information", line))

    async def memory(self) -> list[Instruction]:
        """The program in the memory, read beside the line where there is a way.  Raises `wire.RefusalError`."""
        if self.busy:
            raise wire.RefusalError("busy", "A download is under way.")
        if isinstance(self._target, Virtual):
            return _stored(self._target.module.eeprom)
        return await self.read()

    async def read(self) -> list[Instruction]:
        """The program in the memory, up to its end mark."""

        def progress(done: int, total: int) -> None:
            if done % _EACH == 0:
                self._tell(wire.Progress("Reading", done, total))

        try:
            return list(await run(self._target.ask, program.upload(progress=progress)))
        except HostError as error:
            raise wire.RefusalError("module", f"{error}.") from error
        finally:
            self._tell(wire.Progress("Reading", 1, 1))

    def know(self, listing: wire.Listing | None) -> None:
        """The memory holds this program, or an unknown one."""
        self.listing = listing
        self._look()

    @property
    def revision(self) -> int:
        """Of the memory, when it was looked at last."""
        return self._revision

    def stored_by_other_host(self) -> list[Instruction] | None:
        """The program that another host has stored meanwhile, as far as it can be seen without the line; None for none.

        An empty list where it has erased the one that was known.
        """
        if self.busy or not isinstance(self._target, Virtual) or self._target.module.program.downloading:
            return None
        eeprom = self._target.module.eeprom
        if eeprom.revision == self._revision:
            return None
        self._revision = eeprom.revision
        found = _stored(eeprom)
        known = "" if self.listing is None else self.listing.identity
        return found if (identity(found) if found else "") != known else None


def _stored(eeprom: Eeprom) -> list[Instruction]:
    return list(takewhile(_is_command, map(eeprom.read_instruction, range(PROGRAM_SIZE))))


def _is_command(instruction: Instruction) -> bool:
    return instruction.number not in program.NO_COMMANDS


def _aborted(done: int) -> str:
    return (
        f"The download was aborted (STOP ALL). The program that was in the module is lost; {done} instructions were "
        "stored."
    )
