"""What register commands do, as lines of Python over the names of the registers.

A template speaks of OPERAND, TYPE, TARGET and NEXT (the value, the type, the address that is jumped to and the
address behind the command) and of the registers by name.  `machine` makes a small function of one template, `fuse`
one function of a whole loop.

Source: manual 6.7.16 to 6.7.21, 6.7.29, 6.7.31, 6.7.32; fidelity PROG-1 to PROG-5.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import lru_cache
from typing import Any, Final

from tmcm34x.firmware.program.registers import ERROR_FLAGS, quotient, remainder
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

_NUMBERS: Final = {mnemonic: row.number for mnemonic, row in BY_MNEMONIC.items()}
_USER_BANK: Final = 2

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
JA: Final = _NUMBERS["JA"]
WITH_TARGET: Final = frozenset({_NUMBERS["JC"], _NUMBERS["JA"], _NUMBERS["CSUB"]})
ENDS_BLOCK: Final = WITH_TARGET | {_NUMBERS["RSUB"]}


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


def template_of(instruction: Instruction) -> str | None:
    """What a register command does, or None for a module command (also one with operands out of range)."""
    number, type_, motor, value = instruction
    if number in WITH_TARGET and not 0 <= value < PROGRAM_SIZE:
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
_PLACEHOLDER: Final = re.compile(r"\b(OPERAND|TYPE|TARGET|NEXT)\b")
_CONDITION: Final = re.compile(r"counter = TARGET if (.*) else NEXT\Z")
_WRAPPED: Final = re.compile(r"(\S.*) = signed\((.*)\)\Z")


@lru_cache(256)
def compiled(source: str, name: str) -> Any:
    """The function `name` of a Python source made of templates; the same one for the same source."""
    namespace = dict(_NAMES)
    exec(compile(source, f"<TMCL {name}>", "exec"), namespace)
    return namespace[name]


def statements(template: str) -> list[str]:
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


def counted(template: str, jumps: int | str) -> list[str]:
    """The lines of a template; the jumps of a JC are counted in marks[jumps]."""
    match = _CONDITION.match(template)
    if match is None:
        return statements(template)
    return ["counter = NEXT", f"if {match[1]}: counter = TARGET; marks[{jumps}] += 1"]


def conditional(template: str) -> bool:
    """Whether a template is that of a JC."""
    return _CONDITION.match(template) is not None


def filled(lines: Sequence[str], instruction: Instruction, address: int) -> list[str]:
    """The lines of a template with the operands of the command at `address` in them."""
    numbers = {
        "OPERAND": str(instruction.value), "TYPE": str(instruction.type), "TARGET": str(instruction.value),
        "NEXT": str(address + 1),
    }  # fmt: skip
    return [_PLACEHOLDER.sub(lambda match: numbers[match[0]], line) for line in lines]
