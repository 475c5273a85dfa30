"""The register machine of stand-alone TMCL: commands that touch nothing but registers and user variables.

CALC, CALCX, COMP, JC, JA, CSUB, RSUB, CLE, and SGP, GGP, AGP on user variables need neither the clock nor the
chips, so a program may run many of them between two events.  Every other command is *foreign* here: the
machine stops before it and leaves it to `program`.

What a command does is written once, as a line of Python over the register names (`_template`).  The first
time an address is met, its line becomes a small function; a loop that keeps the machine busy is fused: all its
commands become one function with the registers in local variables.  Both count instructions exactly, so a run
may be cut anywhere.

Source: manual 6.7.16 to 6.7.21, 6.7.29, 6.7.31, 6.7.32; fidelity PROG-1 to PROG-5.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from typing import Any, Final, cast

from tmcm34x.tmcl.commands import (
    BY_MNEMONIC,
    CALC_TYPES,
    CALCX_TYPES,
    CONDITIONS,
    FLAGS,
    INT32_MAX,
    INT32_MIN,
    PROGRAM_SIZE,
    STACK_DEPTH,
    USER_VARIABLES,
)
from tmcm34x.tmcl.datagram import Instruction, signed32

ERROR_FLAGS: Final = {word: 1 << (number - 1) for word, number in FLAGS if number}
"""Bits of `Registers.errors` by the word that CLE and JC use."""

NOT_COMPARED: Final = float("nan")
"""A difference that is neither equal, greater nor lower: no COMP has been executed yet."""

_NUMBERS: Final = {mnemonic: row.number for mnemonic, row in BY_MNEMONIC.items()}
_USER_BANK: Final = 2
_LONGEST_BLOCK: Final = 32
"""Instructions of a fused block; a run with fewer left goes command by command."""
_WINDOW: Final = 1024
"""So many commands in a row without a foreign one are a loop worth fusing."""
_LARGEST_REGION: Final = 512

Operation = Callable[["Registers", int], int]
"""Executes commands from `registers.counter`, at most so many; gives back how many are left.

Minus that number: the next command is a foreign one.
"""


class Registers:
    """Everything that a register command can read or change."""

    __slots__ = ("accumulator", "counter", "difference", "errors", "result", "stack", "variables", "x")

    def __init__(self, variables: list[int]) -> None:
        self.accumulator = 0
        self.x = 0
        self.result = 0
        """What ZE and NZ look at: the last value loaded or calculated, or COMP's difference."""
        self.difference: float = NOT_COMPARED
        """What EQ to LE look at: accumulator minus COMP's operand, at the last COMP."""
        self.errors = 0
        self.counter = 0
        self.stack: list[int] = []
        self.variables = variables
        self.reset()

    def reset(self) -> None:
        """Control function 131: everything but the user variables as after power-on."""
        self.accumulator = self.x = self.errors = self.counter = 0
        self.result = 1
        self.difference = NOT_COMPARED
        self.stack.clear()

    def load(self, value: int) -> None:
        """Put what a command has read into the accumulator, and set the zero flag by it."""
        self.accumulator = self.result = value

    def assign(self, other: Registers) -> None:
        """Take over the contents of `other`."""
        self.accumulator, self.x = other.accumulator, other.x
        self.result, self.difference = other.result, other.difference
        self.errors, self.counter = other.errors, other.counter
        self.stack[:] = other.stack
        self.variables[:] = other.variables

    def contents(self) -> tuple[object, ...]:
        """A value that is equal for two equal states."""
        return (
            self.counter, self.accumulator, self.x, self.result, self.difference, self.errors,
            tuple(self.stack), tuple(self.variables),
        )  # fmt: skip

    def restore(self, contents: tuple[object, ...]) -> None:
        """Go back to a state that `contents` gave."""
        values = cast(tuple[Any, ...], contents)
        self.counter, self.accumulator, self.x, self.result, self.difference, self.errors = values[:6]
        self.stack[:], self.variables[:] = values[6:]


def quotient(dividend: int, divisor: int) -> int:
    """`dividend / divisor` rounded toward zero; the dividend itself when dividing by zero (fidelity PROG-3)."""
    if divisor == 0:
        return dividend
    magnitude = abs(dividend) // abs(divisor)
    return magnitude if (dividend < 0) == (divisor < 0) else -magnitude


def remainder(dividend: int, divisor: int) -> int:
    """What `quotient` leaves, with the sign of the dividend; the dividend itself when dividing by zero."""
    return dividend - divisor * quotient(dividend, divisor) if divisor else dividend


_RESULTS: Final = {
    "ADD": "signed(accumulator + OPERAND)",
    "SUB": "signed(accumulator - OPERAND)",
    "MUL": "signed(accumulator * OPERAND)",
    "DIV": "signed(quotient(accumulator, OPERAND))",
    "MOD": "remainder(accumulator, OPERAND)",
    "AND": "accumulator & OPERAND",
    "OR": "accumulator | OPERAND",
    "XOR": "accumulator ^ OPERAND",
    "NOT": "~accumulator",
    "LOAD": "OPERAND",
}
"""New accumulator by the word of CALC; with X as operand also CALCX, but for these three."""
_X_COMMANDS: Final = {
    "NOT": "x = result = ~x",
    "LOAD": "x = result = accumulator",
    "SWAP": "accumulator, x = x, accumulator; result = accumulator",
}
_TESTS: Final = {
    "ZE": "result == 0",
    "NZ": "result != 0",
    "EQ": "difference == 0",
    "NE": "difference != 0",
    "GT": "difference > 0",
    "GE": "difference >= 0",
    "LT": "difference < 0",
    "LE": "difference <= 0",
    **{word: f"errors & {bit}" for word, bit in ERROR_FLAGS.items()},
}
_JUMPS: Final = {
    _NUMBERS["JA"]: "counter = TARGET",
    _NUMBERS["CSUB"]: f"counter = call(stack, TARGET, NEXT) if len(stack) < {STACK_DEPTH} else NEXT",
    _NUMBERS["RSUB"]: "counter = stack.pop() if stack else NEXT",
}
_VARIABLES: Final = {
    _NUMBERS["SGP"]: "variables[TYPE] = OPERAND",
    _NUMBERS["GGP"]: "accumulator = result = variables[TYPE]",
    _NUMBERS["AGP"]: "variables[TYPE] = accumulator",
}
_WITH_TARGET: Final = frozenset({_NUMBERS["JC"], _NUMBERS["JA"], _NUMBERS["CSUB"]})
_ENDS_BLOCK: Final = _WITH_TARGET | {_NUMBERS["RSUB"]}


def _call(stack: list[int], target: int, following: int) -> int:
    stack.append(following)
    return target


def _word_table(words: Sequence[tuple[str, int]], texts: dict[str, str]) -> dict[int, str]:
    return {number: texts[word] for word, number in words}


def _calc_texts(operand: str) -> dict[str, str]:
    return {
        word: f"accumulator = result = {text}".replace("OPERAND", operand) for word, text in _RESULTS.items()
    }


_TYPED: Final[dict[int, dict[int, str]]] = {
    _NUMBERS["CALC"]: _word_table(CALC_TYPES, _calc_texts("OPERAND")),
    _NUMBERS["CALCX"]: _word_table(CALCX_TYPES, _calc_texts("x") | _X_COMMANDS),
    _NUMBERS["JC"]: _word_table(
        CONDITIONS, {word: f"counter = TARGET if {test} else NEXT" for word, test in _TESTS.items()}
    ),
    _NUMBERS["CLE"]: _word_table(
        FLAGS, {"ALL": "errors = 0"} | {word: f"errors &= {~bit}" for word, bit in ERROR_FLAGS.items()}
    ),
}  # fmt: skip


def _template(instruction: Instruction) -> str | None:
    """What a register command does, or None for a foreign one (also one with operands out of range)."""
    number, type_, motor, value = instruction
    if number in _WITH_TARGET and not 0 <= value < PROGRAM_SIZE:
        return None
    if number in _TYPED:
        return _TYPED[number].get(type_)
    if number in _VARIABLES:
        return _VARIABLES[number] if motor == _USER_BANK and type_ < USER_VARIABLES else None
    if number == _NUMBERS["COMP"]:
        return "difference = result = accumulator - OPERAND"
    return _JUMPS.get(number)


_NAMES: Final[dict[str, Any]] = {
    "signed": signed32, "quotient": quotient, "remainder": remainder, "call": _call,
}  # fmt: skip
_REGISTER: Final = re.compile(r"\b(accumulator|x|result|difference|errors|counter|stack|variables)\b")
_PLACEHOLDER: Final = re.compile(r"\b(OPERAND|TYPE|TARGET|NEXT)\b")
_WRAPPED: Final = re.compile(r"(\S.*) = signed\((.*)\)\Z")


def _compiled(source: str, name: str) -> Any:
    namespace = dict(_NAMES)
    exec(compile(source, f"<TMCL {name}>", "exec"), namespace)
    return namespace[name]


@cache
def _maker(template: str) -> Callable[[int, int, int, int], Operation]:
    """Makes functions of one kind of command from OPERAND, TYPE, TARGET and NEXT."""
    lines = [_REGISTER.sub(r"registers.\1", line) for line in _statements(template)]
    if not template.startswith("counter"):
        lines.append("registers.counter = NEXT")
    body = "\n".join(f"        {line}" for line in lines)
    return _compiled(
        "def make(OPERAND, TYPE, TARGET, NEXT):\n    def operation(registers, left):\n"
        f"{body}\n        return left - 1\n    return operation\n",
        "make",
    )


def _statements(template: str) -> list[str]:
    """The lines of a template; a result is brought into 32 bits only when it left them."""
    match = _WRAPPED.match(template)
    if match is None:
        return template.split("; ")
    targets, value = match.groups()
    name = targets.split(" = ")[0]
    return [
        f"{name} = {value}",
        f"if not {INT32_MIN} <= {name} <= {INT32_MAX}: {name} = signed({name})",
        f"result = {name}",
    ]


class Machine:
    """Runs register commands out of a program memory.

    read: gives the instruction at an address, 0..2047; whoever changes one calls `invalidate`.
    """

    def __init__(self, read: Callable[[int], Instruction]) -> None:
        self.guarded: frozenset[int] = frozenset()
        """Addresses whose commands count as foreign, because somebody wants to be asked before them."""
        self._read = read
        self._single: list[Operation] = []
        self._fast: list[Operation] = []
        self._reach: dict[int, bool] = {}

    def invalidate(self) -> None:
        """Forget everything known about the program memory, because it changed."""
        self._single.clear()
        self._fast.clear()
        self._reach.clear()

    def guard(self, addresses: frozenset[int]) -> None:
        """Stop before these commands too, and before no others than them and foreign ones."""
        if addresses != self.guarded:
            self.guarded = addresses
            self.invalidate()

    def is_foreign(self, address: int) -> bool:
        """Whether a foreign command is known to stand at `address`."""
        return bool(self._single) and self._single[address] is _foreign

    def run(self, registers: Registers, count: int) -> int:
        """Execute register commands, at most `count`; give back how many there were.

        Fewer than `count`: the command at `registers.counter` is foreign.
        """
        if not self._single:
            self._forget()
        left, fast, single = count, self._fast, self._single
        while left >= _LONGEST_BLOCK:
            pause = max(left - _WINDOW, _LONGEST_BLOCK - 1)
            while left > pause:
                left = fast[registers.counter](registers, left)
            if left >= _LONGEST_BLOCK and fast[registers.counter] is single[registers.counter]:
                self._fuse(registers.counter)
        while left > 0:
            left = single[registers.counter](registers, left)
        return count - abs(left)

    def execute(self, registers: Registers, instruction: Instruction) -> bool:
        """Execute one register command that is not in the program; whether it was one."""
        template = _template(instruction)
        if template is None:
            return False
        counter = registers.counter
        self._operation(template, instruction, counter)(registers, 1)
        registers.counter = counter
        return True

    def pass_guard(self, registers: Registers) -> bool:
        """Execute the register command at a guarded address; whether it is one."""
        address = registers.counter
        instruction = self._read(address) if address < PROGRAM_SIZE else None
        template = None if instruction is None else _template(instruction)
        if instruction is None or template is None:
            return False
        self._operation(template, instruction, address)(registers, 1)
        return True

    def find_cycle(self, registers: Registers, limit: int) -> tuple[int, tuple[object, ...], int]:
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

    def reaches_foreign(self, counter: int, stack: Sequence[int]) -> bool:
        """Whether any foreign command can come after `counter`, whatever the registers hold."""
        return any(self._reaches(start) for start in (counter, *stack))

    def _reaches(self, start: int) -> bool:
        if start not in self._reach:
            self._reach[start] = any(self._code(address) is None for address in self._walk(start))
        return self._reach[start]

    def _walk(self, start: int) -> Iterator[int]:
        """Every address that execution can come to from `start` through register commands."""
        seen, open_ = {start}, [start]
        while open_:
            address = open_.pop()
            yield address
            if self._code(address) is None:
                continue
            for following in self._successors(address):
                if following not in seen:
                    seen.add(following)
                    open_.append(following)

    def _successors(self, address: int) -> tuple[int, ...]:
        number, _, _, target = self._read(address)
        if number == _NUMBERS["JA"]:
            return (target,)
        return (address + 1, target) if number in _WITH_TARGET else (address + 1,)

    def _code(self, address: int) -> str | None:
        if address >= PROGRAM_SIZE or address in self.guarded:
            return None
        return _template(self._read(address))

    def _forget(self) -> None:
        self._single[:] = [self._decode] * (PROGRAM_SIZE + 1)
        self._fast[:] = self._single

    def _decode(self, registers: Registers, left: int) -> int:
        """Stands at every address that was not executed yet, and replaces itself."""
        address = registers.counter
        template = self._code(address)
        operation = _foreign if template is None else self._operation(template, self._read(address), address)
        self._single[address] = self._fast[address] = operation
        return left

    @staticmethod
    def _operation(template: str, instruction: Instruction, address: int) -> Operation:
        return _maker(template)(instruction.value, instruction.type, instruction.value, address + 1)

    def _fuse(self, start: int) -> None:
        """Make one function of the register commands around `start`."""
        region = self._region(start)
        if region:
            blocks = self._blocks(sorted(region), start)
            fused = _compiled("\n".join(_fused_source(blocks)), "fused")
            for leader in blocks:
                self._fast[leader] = fused

    def _region(self, start: int) -> list[int]:
        region: list[int] = []
        for address in self._walk(start):
            if self._code(address) is not None:
                region.append(address)
            if len(region) == _LARGEST_REGION:
                break
        return region

    def _leaders(self, region: Sequence[int], start: int) -> list[int]:
        """Addresses of `region` at which a block starts."""
        inside = set(region)
        leaders = {start}
        for address in region:
            number, _, _, target = self._read(address)
            if number in _WITH_TARGET:
                leaders.add(target)
            if number in _ENDS_BLOCK or address + 1 not in inside:
                leaders.add(address + 1)
            if address - 1 not in inside:
                leaders.add(address)
        run = 0
        for address in region:
            run = 1 if address in leaders else run + 1
            if run > _LONGEST_BLOCK:
                leaders.add(address)
                run = 1
        return sorted(leaders & inside)

    def _blocks(self, region: Sequence[int], start: int) -> dict[int, list[str]]:
        """The source of every block of `region`, by its first address."""
        inside, leaders = set(region), self._leaders(region, start)
        starts = set(leaders)
        blocks: dict[int, list[str]] = {}
        for leader in leaders:
            lines: list[str] = []
            address = leader
            while True:
                template = cast(str, self._code(address))
                lines += _filled(template, self._read(address), address)
                address += 1
                if template.startswith("counter") or address in starts or address not in inside:
                    break
            if not lines[-1].startswith("counter"):
                lines.append(f"counter = {address}")
            blocks[leader] = [f"left -= {address - leader}", *lines]
        return blocks


def _foreign(registers: Registers, left: int) -> int:
    """Stands at the address of a foreign command."""
    return -left


def _filled(template: str, instruction: Instruction, address: int) -> list[str]:
    numbers = {
        "OPERAND": str(instruction.value), "TYPE": str(instruction.type), "TARGET": str(instruction.value),
        "NEXT": str(address + 1),
    }  # fmt: skip
    return [
        _PLACEHOLDER.sub(lambda match: numbers[match[0]], statement) for statement in _statements(template)
    ]


def _fused_source(blocks: dict[int, list[str]]) -> Iterator[str]:
    """A function that runs `blocks` with the registers in local variables."""
    registers = [name for name in Registers.__slots__ if name not in {"stack", "variables"}]
    yield "def fused(registers, left):"
    for name in Registers.__slots__:
        yield f"    {name} = registers.{name}"
    yield f"    while left >= {_LONGEST_BLOCK}:"
    yield from _choice(blocks, sorted(blocks), "        ")
    for name in registers:
        yield f"    registers.{name} = {name}"
    yield "    return left"


def _choice(blocks: dict[int, list[str]], leaders: Sequence[int], indent: str) -> Iterator[str]:
    """A binary decision for the block that starts at the counter."""
    if len(leaders) == 1:
        yield f"{indent}if counter != {leaders[0]}: break"
        yield from (indent + line for line in blocks[leaders[0]])
        return
    middle = len(leaders) // 2
    yield f"{indent}if counter < {leaders[middle]}:"
    yield from _choice(blocks, leaders[:middle], indent + "    ")
    yield f"{indent}else:"
    yield from _choice(blocks, leaders[middle:], indent + "    ")
