"""Loops in which a program asks again and again for the position of a turning motor, until it has come somewhere.

    Loop: GAP 1, 0
          COMP 7000
          JC LT, Loop

Between two readings only register commands are executed.  What they do is followed once on a copy, with an eye on what
comes from the reading: a register holds the position plus an offset, or something that is the same in each round.  A
comparison limits the positions for which the program goes the same way.  As long as the position stays within those
limits every round is like the one before, so that none of them need be executed: what they would have read can be
asked for when somebody looks.

All this saves work and changes no result: where something else than the position differs from round to round, where it
is multiplied or compared with another register, or where the round has another module command, nothing is found.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Final, NamedTuple

from tmcm34x.chips.ramp import HALF_TURN
from tmcm34x.clock import HZ
from tmcm34x.firmware.program.registers import Registers
from tmcm34x.tmcl.commands import BY_MNEMONIC, CALC_TYPES, CONDITIONS, USER_VARIABLES
from tmcm34x.tmcl.numbers import AP

if TYPE_CHECKING:
    from tmcm34x.board.circuit import Circuit
    from tmcm34x.firmware.program.machine import Machine
    from tmcm34x.firmware.program.registers import Contents
    from tmcm34x.firmware.state import ModuleState
    from tmcm34x.tmcl.datagram import Instruction

LONGEST_ROUND: Final = 64
"""Commands of a round that is looked for."""
LONGEST_S: Final = 1
"""For so long at most a program is not run."""
_MOST_VAIN: Final = 1023
"""Readings between two tries to find a loop, at most."""
_LARGEST: Final = 1 << 30
"""Up to here positions and offsets add up without an overflow."""

_GAP, _GGP, _SGP, _AGP, _CALC, _COMP, _JC, _JA, _CSUB, _RSUB, _CLE = (
    BY_MNEMONIC[name].number
    for name in ("GAP", "GGP", "SGP", "AGP", "CALC", "COMP", "JC", "JA", "CSUB", "RSUB", "CLE")
)
_ADD, _SUB, _LOAD = (dict(CALC_TYPES)[word] for word in ("ADD", "SUB", "LOAD"))
_OF_RESULT: Final = frozenset(dict(CONDITIONS)[word] for word in ("ZE", "NZ"))
_OF_DIFFERENCE: Final = frozenset(dict(CONDITIONS)[word] for word in ("EQ", "NE", "GT", "GE", "LT", "LE"))

_ACCUMULATOR: Final = -1
_RESULT: Final = -2
_DIFFERENCE: Final = -3
"""Registers by number; user variables have their own."""


class Round(NamedTuple):
    """What a program does from one reading of a position to the next."""

    contents: Contents
    """The registers before the reading, but for what comes from the one before."""
    commands: int
    low: int
    high: int
    """Positions for which each round is like this one."""


class _Walk:
    """One round on a copy of the registers, just after a reading of `value`."""

    def __init__(self, value: int) -> None:
        self.value = value
        self.low, self.high = -HALF_TURN, HALF_TURN - 1
        self.offsets = {_ACCUMULATOR: 0, _RESULT: 0}
        """Registers that hold the position plus a number."""
        self._written = {_ACCUMULATOR, _RESULT}
        self._older: set[int] = set()
        """Registers that were read before they were written in this round."""

    def _read(self, register: int) -> int | None:
        """The offset of what a register holds, None where that is not the position."""
        if register not in self._written:
            self._older.add(register)
        return self.offsets.get(register)

    def _write(self, offset: int | None, *registers: int) -> None:
        for register in registers:
            self._written.add(register)
            if offset is None:
                self.offsets.pop(register, None)
            else:
                self.offsets[register] = offset

    def follow(self, instruction: Instruction) -> bool:
        """Take notice of a register command; whether it is understood."""
        number, type_, _, value = instruction
        step = _STEPS.get(number)
        return step is not None and step(self, type_, value)

    def compare(self, _type: int, value: int) -> bool:
        """COMP."""
        offset = self._read(_ACCUMULATOR)
        self._write(None if offset is None else offset - value, _RESULT, _DIFFERENCE)
        return True

    def jump(self, type_: int, _value: int) -> bool:
        """JC: the program goes the same way for positions for which what is tested has the same sign."""
        if type_ in _OF_RESULT:
            self._limit(self._read(_RESULT))
        elif type_ in _OF_DIFFERENCE:
            self._limit(self._read(_DIFFERENCE))
        return True

    def _limit(self, offset: int | None) -> None:
        if offset is None:
            return
        if self.value + offset >= 0:
            self.low = max(self.low, -offset + (self.value + offset > 0))
        if self.value + offset <= 0:
            self.high = min(self.high, -offset - (self.value + offset < 0))

    def calculate(self, type_: int, value: int) -> bool:
        """CALC."""
        offset = None if type_ == _LOAD else self._read(_ACCUMULATOR)
        if offset is not None:
            if type_ not in {_ADD, _SUB}:
                return False
            offset += value if type_ == _ADD else -value
            if abs(offset) > _LARGEST:
                return False
        self._write(offset, _ACCUMULATOR, _RESULT)
        return True

    def load(self, variable: int, _value: int) -> bool:
        """GGP of a user variable."""
        self._write(self._read(variable), _ACCUMULATOR, _RESULT)
        return True

    def store(self, variable: int, _value: int) -> bool:
        """AGP into a user variable."""
        self._write(self._read(_ACCUMULATOR), variable)
        return True

    def set_variable(self, variable: int, _value: int) -> bool:
        """SGP of a user variable."""
        self._write(None, variable)
        return True

    def go_on(self, _type: int, _value: int) -> bool:
        """JA, CSUB, RSUB, CLE: nothing in them comes from a position."""
        return True

    def comes_round(self, before: Contents, after: Contents) -> bool:
        """Whether the next round is like this one, from the registers before and after it."""
        _, _, *x, _, difference, errors, stack, variables = before
        _, _, *x_after, _, difference_after, errors_after, stack_after, variables_after = after
        moving = self.offsets.keys()
        return (
            (x, errors, stack) == (x_after, errors_after, stack_after)
            and (_DIFFERENCE in moving or difference == difference_after)
            and all(n in moving or variables[n] == variables_after[n] for n in range(USER_VARIABLES))
            and self._older.isdisjoint(moving)
        )


_STEPS: Final[dict[int, Callable[[_Walk, int, int], bool]]] = {
    _COMP: _Walk.compare, _JC: _Walk.jump, _CALC: _Walk.calculate, _GGP: _Walk.load, _AGP: _Walk.store,
    _SGP: _Walk.set_variable, **dict.fromkeys((_JA, _CSUB, _RSUB, _CLE), _Walk.go_on),
}  # fmt: skip


def round_from(machine: Machine, registers: Registers, value: int) -> Round | None:
    """The round that a program makes after a reading of `value`, back to that reading; None where none is found."""
    copy, reading = Registers([0] * USER_VARIABLES), registers.counter - 1
    copy.assign(registers)
    walk = _Walk(value)
    for commands in range(1, LONGEST_ROUND):
        if copy.counter == reading:
            if not walk.comes_round(registers.contents(), copy.contents()):
                return None
            return Round(copy.contents(), commands, walk.low, walk.high)
        instruction = machine.read(copy.counter)
        if not walk.follow(instruction) or not machine.run(copy, 1):
            return None
    return None


class Reading(NamedTuple):
    """A reading of the position that was not executed."""

    when: int
    executed: int
    """Commands executed by the program before it."""
    value: int
    first: bool
    """Whether it stands for those before it too: the registers are those of `Round.contents`."""


class Pursuit:
    """A program that goes round in a `Round`, from a reading that it has executed.

    motor: whose position is read
    now: the clock of that reading
    executed: commands executed by the program before it
    clocks: time of one command
    """

    def __init__(  # noqa: PLR0917
        self, circuit: Circuit, motor: int, found: Round, now: int, executed: int, clocks: int
    ) -> None:
        self._circuit = circuit
        self._motor = motor
        self.contents = found.contents
        self._now = now
        self._executed = executed
        self._commands = found.commands
        self._period = found.commands * clocks
        self._done = 0
        """Readings after the first that are over."""
        self._readings: list[Reading] = []
        stays = min(circuit.stays_within(motor, found.low, found.high), now + LONGEST_S * HZ)
        self.due = now - (now - stays) // self._period * self._period
        """The clock of the next reading that has to be executed."""

    @property
    def saves(self) -> bool:
        """Whether there is anything that need not be executed."""
        return self.due > self._now + self._period

    def foresee(self, now: int) -> None:
        """Read what is to be read before `now`, while the motion chips are not there yet."""
        circuit, last = self._circuit, (now - 1 - self._now) // self._period
        first = max(self._done + 1, last - 1)
        for n in range(first, last + 1):
            when = self._now + n * self._period
            self._readings.append(
                Reading(
                    when,
                    self._executed + n * self._commands,
                    circuit.position_at(self._motor, when),
                    first=n == first > self._done + 1,
                )
            )
        self._done = max(self._done, last)

    def take(self) -> list[Reading]:
        """The last readings before the clock that was foreseen; the second of two makes all registers right."""
        taken, self._readings = self._readings, []
        return taken


class Following:
    """Looks for the loop in which a program follows a motor.

    The program calls `meet` before each module command, and `passed` after each that has read something which may be
    another value next time.
    """

    __slots__ = ("_machine", "_module", "_patience", "_read_at", "_reading", "_vain", "pursuit")

    def __init__(self, module: ModuleState, machine: Machine) -> None:
        self._module = module
        self._machine = machine
        self.pursuit: Pursuit | None = None
        """The loop, if the program is in one."""
        self._read_at = self._reading = -1
        """Addresses of the module command before, if it read a position, and of the present one; -1 for none."""
        self._vain = self._patience = 0
        """Readings after which the next try is made, and how many those were the last time."""

    def meet(self) -> None:
        """A module command is about to be executed."""
        self.pursuit = None
        self._read_at, self._reading = self._reading, -1

    def passed(
        self, instruction: Instruction, registers: Registers, executed: int, value: int, now: int
    ) -> None:
        """The command has been executed and has read `value`; if it is the one before again, look for the loop."""
        motor = _position_read(instruction)
        if motor < 0:
            return
        self._reading = registers.counter - 1
        if self._reading != self._read_at:
            return
        if self._vain:
            self._vain -= 1
            return
        found = round_from(self._machine, registers, value)
        if found is None:
            self._vain = self._patience = min(2 * self._patience + 1, _MOST_VAIN)
            return
        self._patience = 0
        core = self._module
        pursuit = Pursuit(core.circuit, motor, found, now, executed - 1, core.instruction_clocks)
        self.pursuit = pursuit if pursuit.saves else None


def _position_read(instruction: Instruction) -> int:
    """The motor whose actual position a command reads, -1 if it does not."""
    number, type_, motor, _ = instruction
    return motor if number == _GAP and type_ == AP.ACTUAL_POSITION else -1
