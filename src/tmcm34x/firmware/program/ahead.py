"""Register commands run ahead on a copy, to know when the next event is, and whether they only go round.

Commands are counted from an *origin*, the last time that something else than a register command changed what the
program sees.  When 128, 256, 512, ... register commands have been executed since, the registers are searched for a
state that comes back.  So what is found does not depend on how time is sliced, nor on whether each command is
looked at.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from tmcm34x.clock import NEVER
from tmcm34x.firmware.program.machine import Machine
from tmcm34x.firmware.program.polling import Cycle
from tmcm34x.firmware.program.registers import Registers
from tmcm34x.tmcl.commands import USER_VARIABLES

if TYPE_CHECKING:
    from tmcm34x.clock import Value

_SHORT_RUN: Final = 128
_LONG_RUN: Final = 1 << 16
"""Commands run ahead at a time: at first, and when nothing ever comes between."""
LONGEST_ROUND: Final = 1000
"""Addresses of a cycle that are listed."""
_SEARCH: Final = 1 << 13
_LONGEST_SEARCH: Final = 1 << 15
_SEARCH_SHARE: Final = 7
"""A search takes as many commands as were executed, up to 2^13; later 1/128 of them, up to 2^15."""


class Ahead:
    """Runs ahead of a program on its `machine`."""

    __slots__ = (
        "_found_at", "_length", "_machine", "_origin", "_room", "commands", "next_search", "registers", "until",
    )  # fmt: skip

    def __init__(self, machine: Machine) -> None:
        self._machine = machine
        self.registers = Registers([0] * USER_VARIABLES)
        """The copy: what the program's registers will hold at `until`."""
        self.until = 0
        """Clock of the next event found by running ahead; 0: not known."""
        self.commands = 0
        """Register commands executed up to then."""
        self.next_search = _SHORT_RUN
        """Register commands since the origin at which the registers are searched next."""
        self._room = 0
        self._length = _SHORT_RUN
        self._origin = 0
        self._found_at = 0
        """Commands executed by the program where the search began that found the last cycle."""

    @property
    def _scout(self) -> Machine:
        """A machine that counts nothing."""
        return self._machine if self._machine.counts is None else self._machine.uncounted()

    def begin(self, executed: int) -> None:
        """Make the present the origin: something else than a register command had its effect."""
        self._drop()
        self._origin = executed
        self.next_search = _SHORT_RUN

    def shorten(self) -> None:
        """Begin with short runs again."""
        self._length = _SHORT_RUN

    def look(
        self, registers: Registers, executed: int, due: int, clocks: int, *, searching: bool
    ) -> Cycle | None:
        """Find the next event, `until`, or the cycle that the registers come to.

        executed: commands that the program has executed
        due: clock at which the next one has its effect; the others follow every `clocks`
        searching: whether a cycle is looked for
        """
        copy = self.registers
        self.commands = 0
        self._begin_counting()
        if not self._machine.is_module_command(registers.counter):
            copy.assign(registers)
            since = executed - self._origin
            self._room = min(self._length, self.next_search - since) if searching else self._length
            self.commands = done = self._machine.run(copy, self._room)
            if searching and since + done == self.next_search:
                cycle = self.search(copy, executed + done, due + done * clocks, clocks)
                if cycle is not None:
                    self._drop_marks()
                    return cycle
        self.until = due + self.commands * clocks
        return None

    def concerns(self, executed: int) -> bool:
        """Whether it is time to search, when so many commands have been executed."""
        return executed - self._origin == self.next_search

    def search(self, registers: Registers, executed: int, due: int, clocks: int) -> Cycle | None:
        """Look whether registers come back to a state from here on; arguments as in `look`."""
        count = self.next_search
        self.next_search *= 2
        scratch = Registers([0] * USER_VARIABLES)
        scratch.assign(registers)
        limit = min(count, _SEARCH) if count < _SEARCH << _SEARCH_SHARE else count >> _SEARCH_SHARE
        done, contents, period = self._scout.find_cycle(scratch, min(limit, _LONGEST_SEARCH))
        if not period:
            return None
        self._found_at = executed
        first = done - period
        return Cycle(
            contents, due + first * clocks, executed + first, period * clocks, period, (), NEVER
        )  # fmt: skip

    def take(self, registers: Registers, now: int) -> int:
        """Take over what was run ahead, if nothing came between; gives back how many commands that was.

        Runs ahead farther or less far in future.
        """
        if now != self.until:
            self._drop()
            self._length = max(self._length // 2, _SHORT_RUN)
            return 0
        self.until = 0
        if self.commands:
            if self.commands == self._room:
                self._length = min(2 * self._length, _LONG_RUN)
            registers.assign(self.registers)
        return self.commands

    def _begin_counting(self) -> None:
        counts = self._machine.counts
        if counts is not None:
            counts.settle()

    def _drop(self) -> None:
        """What was run ahead is not taken over."""
        if self.until:
            self._drop_marks()
        self.until = 0

    def _drop_marks(self) -> None:
        counts = self._machine.counts
        if counts is not None:
            counts.drop()

    def round(self, cycle: Cycle) -> list[int]:
        """The addresses that a program comes to in one round of `cycle`; at most `LONGEST_ROUND`."""
        scratch = Registers([0] * USER_VARIABLES)
        scratch.restore(cycle.contents)
        values, addresses = iter(cycle.values), list[int]()
        for _ in range(min(cycle.commands, LONGEST_ROUND)):
            addresses.append(scratch.counter)
            if not self._scout.run(scratch, 1):
                scratch.counter += 1
                value = next(values, None)
                if value is not None:
                    scratch.load(value)
        return addresses

    def found(self, executed: int) -> bool:
        """Whether a program that has executed so many commands has come to where the last cycle was found.

        Before that, finding it depends on how far was looked ahead.
        """
        return executed >= self._found_at

    def save(self, executed: int) -> Value:
        """Where the search is after so many commands, which does not depend on how far was looked ahead."""
        next_search = _SHORT_RUN
        while next_search <= executed - self._origin:
            next_search *= 2
        return self._origin, next_search

    def load(self, value: Any) -> None:
        """Go back to what `save` gave."""
        self._origin, self.next_search = value
        self._found_at = 0
        self._drop()
        self.shorten()
