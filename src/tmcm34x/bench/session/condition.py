"""Conditions: what is to hold within a time, always, or never.

A condition is a measurement (`outputs 00000001`), or a command with the reply it is to get (`GAP 8, 0 is 100 1`).
Commands are asked again and again, so only those are taken that read and change nothing.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Protocol

from tmcm34x.bench.session.phrase import NUMBER, LineError, check_span, read_byte, read_number, read_phrase
from tmcm34x.bench.session.world import MEASUREMENTS, Look, MeasuredValue
from tmcm34x.tmcl.commands import BY_MNEMONIC, RFS_TYPES
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.mnemonic import MnemonicError, parse_instruction
from tmcm34x.toolchain.mending.spelling import proposal

if TYPE_CHECKING:
    from tmcm34x.bench.session.world import Unit

_IS: Final = re.compile(r"(.+?)\s+is\s+(.+)\Z")
_STATUS: Final = re.compile(rf"(\d+)(?:\s+({NUMBER}))?(?:\.\.({NUMBER}))?\Z")
_READING: Final = frozenset(BY_MNEMONIC[name].number for name in ("GAP", "GGP", "GIO", "GCO"))
_RFS: Final = BY_MNEMONIC["RFS"].number
_RFS_STATUS: Final = dict(RFS_TYPES)["STATUS"]


class Subject(Protocol):
    """What a condition is about: a module, and what hangs on it."""

    @property
    def unit(self) -> Unit:
        """The module on its bench."""
        ...

    def ask(self, instruction: Instruction) -> tuple[int, int]:
        """Status and value of a command."""
        ...


class Answered(NamedTuple):
    """A command and the reply that it is to get; the value is not looked at when `low` is None."""

    instruction: Instruction
    status: int
    low: int | None
    high: int

    needs_bench = False

    def look(self, subject: Subject) -> MeasuredValue:
        """Ask the module."""
        status, value = subject.ask(self.instruction)
        holds = status == self.status and (self.low is None or self.low <= value <= self.high)
        return MeasuredValue(holds, f"{status} {value}")


class Measured(NamedTuple):
    """A measurement on the bench."""

    measure: Look
    values: tuple[Any, ...]

    needs_bench = True

    def look(self, subject: Subject) -> MeasuredValue:
        """Measure."""
        return self.measure(subject.unit, *self.values)


Condition = Answered | Measured


def read_condition(text: str, start: int = 0) -> Condition:
    """The condition in `text` from character `start` on.  Raises `LineError`."""
    match = _IS.match(text, start)
    if match is None:
        if text[start:].split(maxsplit=1)[:1] and text[start:].split(maxsplit=1)[0].upper() in BY_MNEMONIC:
            raise LineError(
                "expected `is` and the reply after the command, such as `GAP 8, 0 is 100 1`", start
            )
        return Measured(*read_phrase(text, MEASUREMENTS, start))
    instruction = read_instruction(match.group(1), start)
    if not _reads(instruction):
        raise LineError("expected a command that only reads: GAP, GGP, GIO, GCO or RFS STATUS", start)
    status = _STATUS.match(match.group(2).rstrip())
    if status is None:
        raise LineError("expected a status with a value or a range a..b", match.start(2))
    number, low, high = status.groups()
    lowest = None if low is None else read_number(low)
    highest = read_number(high or low or "0")
    check_span(lowest, highest, match.start(2))
    return Answered(instruction, read_byte(number, "a status", match.start(2)), lowest, highest)


def _reads(instruction: Instruction) -> bool:
    asks_search = instruction.number == _RFS and instruction.type == _RFS_STATUS
    return instruction.number in _READING or asks_search


def read_instruction(text: str, start: int = 0) -> Instruction:
    """The command in `text`, which stands at character `start` of its line.  Raises `LineError`."""
    try:
        return parse_instruction(text)
    except MnemonicError as error:
        name = text.split(maxsplit=1)[0] if text.split() else ""
        hint = "" if error.known else proposal(name.upper(), BY_MNEMONIC)
        place = text.find(error.word) if error.word else 0
        raise LineError(f"{error}{hint}", start + max(place, 0)) from None
