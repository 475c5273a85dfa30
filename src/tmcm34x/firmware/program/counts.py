"""How often each command of a program was executed, how often it jumped, and how long it waited.

Register commands are counted where they are executed: generated functions add to `marks`, one for each block of
commands and one for each JC that jumps.  What was run ahead and never taken over is dropped.
"""

from __future__ import annotations

from typing import NamedTuple

from tmcm34x.tmcl.commands import PROGRAM_SIZE


class _Meaning(NamedTuple):
    """What a mark counts: executions of the commands from `first` to before `end`, or jumps of the one at `first`."""

    first: int
    end: int
    jumps: bool


class AddressCounts:
    """Counts by address, 0..2047."""

    def __init__(self) -> None:
        self.executed = [0] * PROGRAM_SIZE
        self.jumped = [0] * PROGRAM_SIZE
        """How often a JC has jumped."""
        self.waited = [0] * PROGRAM_SIZE
        """Clocks spent in a WAIT, besides the time that every command takes."""
        self.marks: list[int] = []
        """Of register commands executed since the last `settle`; generated functions add to it."""
        self._meanings: list[_Meaning] = []
        self._begun = 0

    def mark(self, first: int, end: int) -> int:
        """A new mark for the commands from `first` to before `end`."""
        return self._new(_Meaning(first, end, jumps=False))

    def jump(self, address: int) -> int:
        """A new mark for the jumps of the JC at `address`."""
        return self._new(_Meaning(address, address + 1, jumps=True))

    def settle(self) -> None:
        """Add the marks to the counts: these commands were executed."""
        for mark, (first, end, jumps) in zip(self.marks, self._meanings, strict=True):
            if mark:
                counts = self.jumped if jumps else self.executed
                for address in range(first, end):
                    counts[address] += mark
        self.drop()

    def drop(self) -> None:
        """Forget the marks: these commands were run ahead in vain."""
        self.marks[:] = [0] * len(self.marks)

    def forget(self) -> None:
        """The functions that add to the marks are gone."""
        self.settle()
        self.marks.clear()
        self._meanings.clear()

    def module_command(self, address: int, now: int) -> None:
        """A command that is no register command is executed at clock `now`."""
        if address < PROGRAM_SIZE:
            self.executed[address] += 1
            self._begun = now

    def done_waiting(self, address: int, now: int) -> None:
        """The WAIT at `address` is over."""
        self.waited[address] += now - self._begun

    def _new(self, meaning: _Meaning) -> int:
        self._meanings.append(meaning)
        self.marks.append(0)
        return len(self.marks) - 1
