"""The tables of the language as Markdown, for the reference pages.

`TABLES` names each one; `fill` puts them between the marks of a page, which otherwise is written by hand:

    <!-- table: commands -->
    <!-- end -->
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Final

from tmcm34x.tmcl import commands
from tmcm34x.tmcl.axis_parameters import ALL, AXIS_PARAMETERS, AxisParameter
from tmcm34x.tmcl.commands import COMMANDS, SISTER_COMMANDS, Command
from tmcm34x.tmcl.global_parameters import GLOBAL_PARAMETERS, GlobalParameter
from tmcm34x.toolchain.diagnostics import ERRORS
from tmcm34x.toolchain.explanations import page, title
from tmcm34x.toolchain.expressions import FUNCTIONS
from tmcm34x.toolchain.linter import RULES

_MARKS: Final = re.compile(r"(<!-- table: (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)

_CONDITION_MEANINGS: Final = MappingProxyType({
    "ZE": "the last result was zero", "NZ": "the last result was not zero",
    "EQ": "the accumulator was equal to the value of COMP", "NE": "it was not equal",
    "GT": "it was greater", "GE": "it was greater or equal", "LT": "it was less", "LE": "it was less or equal",
    "ETO": "a WAIT ran into its time-out", "EAL": "external alarm", "EDV": "position deviation (encoder)",
    "EPO": "position error (encoder)", "ESD": "the SHUTDOWN pin stopped the motors",
})  # fmt: skip
_WAIT_MEANINGS: Final = MappingProxyType({
    "TICKS": "the time in ticks of 10 ms is over; the motor does not matter",
    "POS": "the motor is at its target position", "REFSW": "the reference switch of the motor is active",
    "LIMSW": "a limit switch of the motor is active", "RFS": "the reference search of the motor is over",
})  # fmt: skip
_CALC_MEANINGS: Final = MappingProxyType({
    "ADD": "A + n", "SUB": "A - n", "MUL": "A * n", "DIV": "A / n, without the fraction",
    "MOD": "remainder of A / n, with the sign of A", "AND": "bits set in both", "OR": "bits set in one of them",
    "XOR": "bits set in exactly one of them", "NOT": "every bit of A turned over", "LOAD": "n",
})  # fmt: skip


_WORD_MEANINGS: Final[Mapping[str, Mapping[str, str]]] = MappingProxyType({
    "JC": _CONDITION_MEANINGS, "WAIT": _WAIT_MEANINGS, "CALC": _CALC_MEANINGS, "CLE": _CONDITION_MEANINGS,
})  # fmt: skip


def word_meaning(mnemonic: str, word: str) -> str:
    """What a word means as an operand of a command; empty where its name says it all."""
    meanings = _WORD_MEANINGS.get(mnemonic)
    return meanings.get(word, "") if meanings is not None else ""


def fill(page: str) -> str:
    """`page` with its tables made anew."""
    return _MARKS.sub(lambda match: match[1] + "\n" + TABLES[match[2]]() + "\n" + match[3], page)


def textmate_grammar() -> dict[str, object]:
    """A TextMate grammar of the language, for editors that colour before the language server does."""
    words = sorted({word for row in COMMANDS for operand in row.operands for word, _ in operand.words})
    patterns = (
        ("keyword.other.directive.tmcl", r"//!\s*DATA\b.*$"),
        ("comment.line.double-slash.tmcl", "//.*$"),
        ("keyword.control.directive.tmcl", r"#\s*(include|if|else|endif|assert)\b"),
        ("entity.name.function.label.tmcl", r"\b[A-Za-z_]\w*(?=\s*:)"),
        ("variable.other.constant.tmcl", r"\b[A-Za-z_]\w*(?=\s*=)"),
        ("support.function.tmcl", _any_of(FUNCTIONS) + r"(?=\s*\()"),
        ("keyword.control.tmcl", _any_of(row.mnemonic for row in COMMANDS)),
        ("constant.language.tmcl", _any_of(words)),
        ("constant.numeric.tmcl", r"\$[0-9A-Fa-f]+\b|%[01]+\b|\b\d+(\.\d+)?([eE][+-]?\d+)?\b"),
        ("keyword.operator.tmcl", r"[-+*/^=]"),
    )
    return {
        "name": "TMCL",
        "scopeName": "source.tmcl",
        "patterns": [{"name": name, "match": pattern} for name, pattern in patterns],
    }


def _any_of(words: Iterable[str]) -> str:
    return rf"(?i)\b({'|'.join(words)})\b"


def _table(head: str, rows: Iterable[Iterable[object]]) -> str:
    titles = head.split("|")
    lines = [titles, ["---"] * len(titles), *rows]
    return "".join(
        f"| {' | '.join(str(cell).replace('|', chr(92) + '|') for cell in line)} |\n" for line in lines
    )


def _commands() -> str:
    return _table("Command|No.|Meaning|Manual", (_command(row) for row in COMMANDS if row.number < 64))


def _command(row: Command) -> tuple[object, ...]:
    suffix = (
        " The value goes to the accumulator."
        if "reads" in row.where and "accumulator" not in row.meaning
        else ""
    )
    return f"`{row.syntax}`", row.number, f"**{row.title}**. {row.meaning}{suffix}", row.section


def _conditions() -> str:
    return _table(
        "Word|No.|JC jumps when", ((f"`{w}`", n, _CONDITION_MEANINGS[w]) for w, n in commands.CONDITIONS)
    )


def _waits() -> str:
    return _table(
        "Word|No.|WAIT ends when", ((f"`{w}`", n, _WAIT_MEANINGS[w]) for w, n in commands.WAIT_TYPES)
    )


def _calculations() -> str:
    return _table("Word|No.|A becomes", ((f"`{w}`", n, _CALC_MEANINGS[w]) for w, n in commands.CALC_TYPES))


def _functions() -> str:
    return _table(
        "Function|Value", ((f"`{name}(x)`", function.meaning) for name, function in FUNCTIONS.items())
    )


def _axis_parameters() -> str:
    return _table("No.|Name|Access|Range|Default|Unit|Meaning", (_parameter(row) for row in AXIS_PARAMETERS))


def _global_parameters() -> str:
    rows = [row for row in GLOBAL_PARAMETERS if row.bank == 0]
    return _table("No.|Name|Access|Range|Default|Unit|Meaning", (_parameter(row) for row in rows))


def _parameter(row: AxisParameter | GlobalParameter) -> tuple[object, ...]:
    choices = "; ".join(f"{number} {text}" for number, text in row.choices)
    meaning = row.meaning + (f" {choices}." if choices else "")
    if isinstance(row, AxisParameter) and row.models != ALL:
        meaning += f" Only on {' and '.join(str(model) for model in sorted(row.models))}."
    limits = f"{row.low}..{row.high}" if row.writable else "read only"
    return row.number, row.name, row.access, limits, row.default, row.unit, meaning


def _sisters() -> str:
    return ", ".join(f"{name}" for name in SISTER_COMMANDS) + ".\n"


def _errors() -> str:
    return _pages(ERRORS)


def _rules() -> str:
    return _pages(RULES)


def _pages(codes: Iterable[str]) -> str:
    return "\n".join(f"### {code} {title(code)}\n\n{page(code)}" for code in codes)


TABLES: Final[Mapping[str, Callable[[], str]]] = MappingProxyType({
    "commands": _commands, "conditions": _conditions, "waits": _waits, "calculations": _calculations,
    "functions": _functions, "axis_parameters": _axis_parameters, "global_parameters": _global_parameters,
    "sisters": _sisters, "errors": _errors, "rules": _rules,
})  # fmt: skip
"""The tables that a page may ask for."""
