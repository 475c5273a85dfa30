"""What wrote a value last: a command of the program, a host, a debugger, the bench, or the module itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Final, NamedTuple

from tmcm34x.debug.course import HELD, REFUSED
from tmcm34x.debug.expressions import ExpressionError, compile_reference, values_of
from tmcm34x.debug.inputs import RECEIVED
from tmcm34x.debug.reverse import Here, let_pass, stretches
from tmcm34x.firmware.commands.coordinates import ALL_COORDINATES, ALL_MOTORS
from tmcm34x.tmcl.commands import BY_NUMBER, PROGRAM_SIZE
from tmcm34x.tmcl.datagram import CAN_SIZES, Instruction, unpack_can_request, unpack_request
from tmcm34x.tmcl.mnemonic import format_instruction

if TYPE_CHECKING:
    from tmcm34x.debug.inputs import Input
    from tmcm34x.debug.view import View

USER_BANK: Final = 2
OUTPUT_BANK: Final = 2


class Write(NamedTuple):
    """What changed a value last.

    clock: when; address: of the command of the program, -1 where it was none
    cause: in words; before, after: the value
    """

    clock: int
    address: int
    cause: str
    before: int
    after: int


class Written(NamedTuple):
    """A value whose last write is looked for: a name of `View`, and its indices."""

    name: str
    indices: tuple[int, ...]

    @classmethod
    def of(cls, view: View, text: str) -> Written:
        """What `text` names now, such as `gp[3]`, `ap[max_speed][0]`, `accumulator`; raises `ExpressionError`."""
        reference = compile_reference(text)
        indices = values_of(reference.indices, view.read)
        view.read(reference.name, indices)
        return cls(reference.name, indices)


def last_write(here: Here, written: Written) -> Write | None:
    """What wrote a value last, though it may have written what was there before; None where nothing did."""
    finder = _WriteFinder(here, written)
    for start, end in stretches(here.branch, here.clock):
        found = finder.last_in(start, end)
        if found is not None:
            return found
    return None


class _WriteFinder:
    """Looks for the last write of a value in a stretch."""

    def __init__(self, here: Here, written: Written) -> None:
        self._here = here
        self._name, self._indices = written
        self._writes = WRITERS.get(written.name.lower(), {})
        self._found: Write | None = None
        self._view = here.view
        self._before = 0

    def last_in(self, start: int, end: int) -> Write | None:
        """The last write after `start` up to `end`."""
        course = self._here.course_to(start)
        rig, program = course.rig, self._here.program
        self._found, self._before = None, self._value()
        program.hook(let_pass, None)
        try:
            while (when := course.next_event()) <= end:
                command = program.upcoming if program.active and program.next_event() == when else -1
                instruction = self._instruction(command)
                rig.advance(when)
                self._compare(when, command, instruction, _cause(instruction))
                for done in course.repeat():
                    self._compare(when, -1, self._sent(done), described(done))
        finally:
            program.unhook(let_pass)
        return self._found

    def _compare(self, clock: int, address: int, instruction: Instruction | None, cause: str) -> None:
        before, after = self._before, self._value()
        self._before = after
        if after != before or (instruction is not None and self._is_written_by(instruction)):
            self._found = Write(clock, address, cause, before, after)

    def _value(self) -> int:
        """The value now; 0 without power."""
        try:
            return self._view.read(self._name, self._indices)
        except ExpressionError:
            return 0

    def _instruction(self, address: int) -> Instruction | None:
        eeprom = self._here.course.rig.modules[self._here.module].eeprom
        return eeprom.read_instruction(address) if 0 <= address < PROGRAM_SIZE else None

    def _sent(self, done: Input) -> Instruction | None:
        """The command in an input for this module."""
        if done.kind == "command" and done.number == self._here.module:
            return Instruction(*done.values)
        return telegram(done)

    def _is_written_by(self, instruction: Instruction) -> bool:
        """Whether a command names this very value."""
        row = BY_NUMBER.get(instruction.number)
        motors = self._writes.get(row.mnemonic) if row is not None else None
        if motors is None or not self._indices or instruction.type != self._indices[0]:
            return False
        second = self._indices[1] if len(self._indices) > 1 else motors[0]
        return instruction.motor == second or instruction.motor in motors[1:]


WRITERS: Final[Mapping[str, Mapping[str, tuple[int, ...]]]] = {
    "ap": {"SAP": (0,), "AAP": (0,), "RSAP": (0,)},
    "gp": {"SGP": (USER_BANK,), "AGP": (USER_BANK,), "RSGP": (USER_BANK,)},
    "co": {"SCO": (0,), "CCO": (0, ALL_MOTORS), "ACO": (0,), "GCO": (0, ALL_COORDINATES)},
    "out": {"SIO": (OUTPUT_BANK,)},
}
"""Commands that write a value they name: by its name and the mnemonic, the motor or bank where the value has one index,
and further motors that stand for all.  Everything else is seen by its effect."""


def _cause(instruction: Instruction | None) -> str:
    return format_instruction(instruction) if instruction else "no command: the module itself"


def telegram(done: Input) -> Instruction | None:
    """The command in a whole telegram or frame that came over a line; None for anything else."""
    if done.kind != RECEIVED:
        return None
    if isinstance(done.values[0], int):
        data = done.values[1]
        return unpack_can_request(data) if len(data) in CAN_SIZES else None
    data = done.values[0]
    try:
        return unpack_request(data)[1]
    except ValueError:
        return None


def described(done: Input) -> str:
    """An input in words."""
    sent = Instruction(*done.values) if done.kind == "command" else telegram(done)
    if sent is not None:
        return f"command of a host: {format_instruction(sent)}"
    return _DESCRIBED.get(done.kind, _plain)(done)


def _plain(done: Input) -> str:
    return f"{done.kind}: {' '.join(map(str, done.values))}".removesuffix(": ")


_OPERANDS: Final[Mapping[str, Mapping[str, str]]] = {
    "switch": {"True": "active", "False": "inactive", "None": "given back"},
    "level": {"None": "given back"},
}
"""Operands of actions in words, by the action; what others switch is on or off."""
_ON_OFF: Final[Mapping[str, str]] = {"True": "on", "False": "off"}


def _action(done: Input) -> str:
    name, *operands = map(str, done.values)
    words = _OPERANDS.get(name, _ON_OFF)
    return " ".join(("on the bench:", name, *(words.get(operand, operand) for operand in operands)))


_DESCRIBED: Final[Mapping[str, Callable[[Input], str]]] = {
    "assignment": lambda done: f"debugger: {done.values[0]} = {done.values[1]}",
    "action": _action,
    "control": lambda done: f"debugger: {done.values[0]}",
    RECEIVED: lambda done: "bytes of a host",
    "plugged": lambda _: "a line was plugged in",
    "unplugged": lambda _: "a line was unplugged",
    "lines": lambda _: "the bench went on from a past moment",
    HELD: lambda _: "the debugger held the program",
    REFUSED: lambda _: "the debugger held the program after a refused command",
}
"""Inputs in words, by their kind; the others are named with their values."""
