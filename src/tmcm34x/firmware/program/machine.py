"""The register machine of stand-alone TMCL: commands that touch nothing but registers and user variables.

CALC, CALCX, COMP, JC, JA, CSUB, RSUB, CLE, and SGP, GGP, AGP on user variables need neither the clock nor the
chips, so a program may run many of them between two events.  Every other command is a *module command* here: the
machine stops before it and leaves it to `program`.

The first time an address is met, its template becomes a small function; a loop that keeps the machine busy is fused
(`fuse`).  Both count instructions exactly, so a run may be cut anywhere.  Functions are caches: a copy of a machine
makes its own.

Source: manual 6.7.16 to 6.7.21, 6.7.29, 6.7.31, 6.7.32; fidelity PROG-1 to PROG-5.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, Final, cast

from tmcm34x.firmware.program.counts import AddressCounts
from tmcm34x.firmware.program.fuse import LONGEST_BLOCK, fuse
from tmcm34x.firmware.program.registers import Contents, Registers
from tmcm34x.firmware.program.templates import compiled, conditional, counted, statements, template_of
from tmcm34x.tmcl.commands import PROGRAM_SIZE
from tmcm34x.tmcl.datagram import Instruction

_WINDOW: Final = 1024
"""So many commands in a row without a module command are a loop worth fusing."""
_REGISTER: Final = re.compile(r"\b(accumulator|x|result|difference|errors|counter|stack|variables)\b")

Operation = Callable[[Registers, int], int]
"""Executes commands from `registers.counter`, at most so many; gives back how many are left.

Minus that number: the next command is a module command.
"""


@cache
def _maker(template: str) -> Callable[[int, int, int, int], Operation]:
    """Makes functions of one kind of command from OPERAND, TYPE, TARGET and NEXT."""
    make: Callable[[int, int, int, int], Operation] = compiled(
        _made(template, statements(template), "OPERAND, TYPE, TARGET, NEXT"), "make"
    )
    return make


@cache
def _counting_maker(template: str) -> Callable[..., Operation]:
    """The same for functions that count in marks[EXECUTED], and jumps in marks[JUMPED]."""
    lines = ["marks[EXECUTED] += 1", *counted(template, "JUMPED")]
    make: Callable[..., Operation] = compiled(
        _made(template, lines, "OPERAND, TYPE, TARGET, NEXT, marks, EXECUTED, JUMPED"), "make"
    )
    return make


def _made(template: str, statements: Sequence[str], arguments: str) -> str:
    """The source of a function `make` that returns an operation."""
    lines = [_REGISTER.sub(r"registers.\1", line) for line in statements]
    if not template.startswith("counter"):
        lines.append("registers.counter = NEXT")
    body = "\n".join(f"        {line}" for line in lines)
    return (
        f"def make({arguments}):\n    def operation(registers, left):\n"
        f"{body}\n        return left - 1\n    return operation\n"
    )


class Machine:
    """Runs register commands out of a program memory.

    read: gives the instruction at an address, 0..2047; whoever changes one calls `invalidate`.
    """

    def __init__(self, read: Callable[[int], Instruction]) -> None:
        self.guarded: frozenset[int] = frozenset()
        """Addresses whose commands count as module commands, because a hook is asked before them."""
        self.counts: AddressCounts | None = None
        """Where executed commands are counted, if they are."""
        self.read = read
        self._single: list[Operation] = []
        self._fast: list[Operation] = []

    def __reduce__(self) -> tuple[Any, ...]:
        """A copy makes its own functions; it has no guarded addresses and counts nothing."""
        return Machine, (self.read,)

    def invalidate(self) -> None:
        """Forget everything known about the program memory, because it changed."""
        self._single.clear()
        self._fast.clear()
        if self.counts is not None:
            self.counts.forget()

    def count(self, counts: AddressCounts | None) -> None:
        """Count executed commands in `counts` from now on, or no longer."""
        self.invalidate()
        self.counts = counts

    def uncounted(self) -> Machine:
        """A machine for the same memory that counts nothing."""
        machine = Machine(self.read)
        machine.guarded = self.guarded
        return machine

    def guard(self, addresses: frozenset[int]) -> None:
        """Stop before these commands too, and before no others than them and module commands."""
        if addresses != self.guarded:
            self.guarded = addresses
            self.invalidate()

    def is_module_command(self, address: int) -> bool:
        """Whether a module command is known to stand at `address`."""
        return bool(self._single) and self._single[address] is _module_command

    def run(self, registers: Registers, count: int) -> int:
        """Execute register commands, at most `count`; give back how many there were.

        Fewer than `count`: the command at `registers.counter` is a module command.
        """
        if not self._single:
            self._forget()
        left, fast, single = count, self._fast, self._single
        while left >= LONGEST_BLOCK:
            pause = max(left - _WINDOW, LONGEST_BLOCK - 1)
            while left > pause:
                left = fast[registers.counter](registers, left)
            if left >= LONGEST_BLOCK and fast[registers.counter] is single[registers.counter]:
                self._fuse(registers.counter)
        while left > 0:
            left = single[registers.counter](registers, left)
        return count - abs(left)

    def execute(self, registers: Registers, instruction: Instruction) -> None:
        """Execute one register command that is not in the program: CALC or CALCX of a type that there is."""
        counter = registers.counter
        _operation(cast("str", template_of(instruction)), instruction, counter)(registers, 1)
        registers.counter = counter

    def pass_guard(self, registers: Registers) -> bool:
        """Execute the register command at a guarded address; whether it is one."""
        address = registers.counter
        instruction = self.read(address) if address < PROGRAM_SIZE else None
        template = None if instruction is None else template_of(instruction)
        if instruction is None or template is None:
            return False
        _operation(template, instruction, address)(registers, 1)
        return True

    def find_cycle(self, registers: Registers, limit: int) -> tuple[int, Contents, int]:
        """Run up to `limit` commands and look whether the registers come back to a state they had.

        Gives back the number of commands executed, a state, and after how many commands it returns: 0 when
        none was found.  The state is the one that `registers` is left with.
        """
        anchor, anchor_at, power = registers.contents(), 0, 1
        for at in range(1, limit + 1):
            if not self.run(registers, 1):
                return at - 1, anchor, 0
            if registers.counter == anchor[0] and registers.contents() == anchor:
                return at, anchor, at - anchor_at
            if at - anchor_at == power:
                anchor, anchor_at, power = registers.contents(), at, power * 2
        return limit, anchor, 0

    def _code(self, address: int) -> str | None:
        if address >= PROGRAM_SIZE or address in self.guarded:
            return None
        return template_of(self.read(address))

    def _forget(self) -> None:
        self._single[:] = [self._decode] * (PROGRAM_SIZE + 1)
        self._fast[:] = self._single

    def _decode(self, registers: Registers, left: int) -> int:
        """Stands at every address that was not executed yet, and replaces itself."""
        address = registers.counter
        template = self._code(address)
        operation = _module_command if template is None else self._operation(template, address)
        self._single[address] = self._fast[address] = operation
        return left

    def _operation(self, template: str, address: int) -> Operation:
        instruction, counts = self.read(address), self.counts
        if counts is None:
            return _operation(template, instruction, address)
        executed = counts.mark(address, address + 1)
        jumped = counts.jump(address) if conditional(template) else executed
        return _counting_maker(template)(
            instruction.value,
            instruction.type,
            instruction.value,
            address + 1,
            counts.marks,
            executed,
            jumped,
        )

    def _fuse(self, start: int) -> None:
        """Make one function of the register commands around `start`."""
        if self._code(start) is not None:
            leaders, function = fuse(self.read, self._code, start, self.counts)
            for leader in leaders:
                self._fast[leader] = function


def _operation(template: str, instruction: Instruction, address: int) -> Operation:
    return _maker(template)(instruction.value, instruction.type, instruction.value, address + 1)


def _module_command(registers: Registers, left: int) -> int:
    """Stands at the address of a module command."""
    return -left
