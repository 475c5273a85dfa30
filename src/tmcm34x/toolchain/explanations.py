"""A page for each diagnostic: what it means, a program that gets it, and the cure.

The same text is printed by `tmcm34x lint --explain CODE`, shown by editors over a diagnostic, and put into
docs/lint.md.  The pages of the rules are made from `linter.rules.RULES`.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final, NamedTuple

from tmcm34x.toolchain.diagnostics import ERRORS
from tmcm34x.toolchain.linter.rules import RULES


class Explanation(NamedTuple):
    """What an error of the assembler means, a program that has it, and one that does not."""

    reason: str
    example: str
    cure: str


MISTAKES: Final[Mapping[str, Explanation]] = MappingProxyType({
    "E101": Explanation(
        "Comments of other languages, and characters of word processors: curly quotes, long dashes, full-width commas. "
        "TMCL has letters, digits, _ and + - * / ^ ( ) , : = #, and comments that begin with //.",
        "        STOP                    ; the end", "        STOP                    // the end",
    ),
    "E102": Explanation(
        "Numbers are decimal, hexadecimal after $ or binary after %, and have no unit: WAIT counts in ticks of 10 ms.",
        "        WAIT  TICKS, 0, 500ms\n        STOP", "        WAIT  TICKS, 0, 50\n        STOP",
    ),
    "E103": Explanation(
        "A comma, a colon, a parenthesis or a name is missing or misplaced.",
        "        SAP   4, 0 500\n        STOP", "        SAP   4, 0, 500\n        STOP",
    ),
    "E201": Explanation(
        "The word is not a command; docs/language.md lists all commands. A word alone may be a label without its ':'.",
        "Loop:   JMP   Loop", "Loop:   WAIT  TICKS, 0, 1\n        JA    Loop",
    ),
    "E202": Explanation(
        "Modules with other chips have more commands: interrupts (VECT, EI, DI, RETI), indirect addressing, a stack. "
        "The firmware of the TMCM-34x lacks them; a loop that polls for the event comes closest.",
        "        VECT  39, Alarm\n        STOP\nAlarm:  STOP",
        "Loop:   WAIT  TICKS, 0, 1\n        GIO   0, 0\n        JC    ZE, Loop\n        STOP",
    ),
    "E203": Explanation(
        "Each command takes a fixed number of operands, in a fixed order; often it is the first word that is missing.",
        "        MVP   0, 1000\n        STOP", "        MVP   ABS, 0, 1000\n        STOP",
    ),
    "E204": Explanation(
        "Each command takes a fixed number of operands; numbers beyond them fill the fields that it does not use, and "
        "there are more than that.",
        "        SAP   4, 0, 500, 1\n        STOP", "        SAP   4, 0, 500\n        STOP",
    ),
    "E205": Explanation(
        "MVP, RFS, CALC, CALCX, JC, WAIT and CLE start with one of their words; a number cannot replace it.",
        "        WAIT  TIME, 0, 10\n        STOP", "        WAIT  TICKS, 0, 10\n        STOP",
    ),
    "E206": Explanation(
        "Type and motor have eight bits, the value 32.",
        "        SAP   300, 0, 5\n        STOP", "        SAP   5, 0, 300\n        STOP",
    ),
    "E301": Explanation(
        "No file of the program defines this label or constant; case does not matter.",
        "        ROR   0, Speed\n        STOP", "Speed = 500\n        ROR   0, Speed\n        STOP",
    ),
    "E302": Explanation(
        "A name has one meaning in the whole program, including its include files.",
        "Loop:   STOP\nLOOP:   STOP", "Loop:   WAIT  TICKS, 0, 1\n        JA    Loop",
    ),
    "E303": Explanation(
        "Constants are computed from top to bottom; commands may use constants that are defined below them.",
        "Fast = Slow * 2\nSlow = 100\n        ROR   0, Fast\n        STOP",
        "Slow = 100\nFast = Slow * 2\n        ROR   0, Fast\n        STOP",
    ),
    "E304": Explanation(
        "Only JA, JC and CSUB take the address of a label.",
        "Loop:   ROR   0, Loop\n        JA    Loop", "Speed = 500\nLoop:   ROR   0, Speed\n        JA    Loop",
    ),
    "E401": Explanation(
        "Expressions are computed when the program is assembled, in floating point.",
        "        ROR   0, 500 / 0\n        STOP", "        ROR   0, 500 / 2\n        STOP",
    ),
    "E402": Explanation(
        "The constants do not meet a condition that the program states.",
        "Speed = 3000\n#assert Speed <= 2047\n        ROR   0, Speed\n        STOP",
        "Speed = 2000\n#assert Speed <= 2047\n        ROR   0, Speed\n        STOP",
    ),
    "E501": Explanation(
        "The file is neither in the folder of the including file nor on the include path. While it is missing, unknown "
        "names are not reported.",
        "#include missing.inc\n        STOP",
        "#include TMCLParam.tmc\n        SAP   APMaxAcceleration, 0, 200\n        STOP",
    ),
    "E502": Explanation(
        "A file is included once, at its first #include; a file that includes itself has no end.",
        "#include program.tmc\n        STOP", "        STOP",
    ),
    "E503": Explanation(
        "32 files may include each other. A chain of that length is a file that includes itself by another name.",
        "#include another.inc\n        STOP", "        STOP",
    ),
    "E601": Explanation(
        "The memory of the module holds 2,048 instructions. Subroutines and loops make programs shorter.",
        "        ROR   0, 500            // and 2,048 lines more\n" + "        MST   0\n" * 2048 + "        STOP",
        "        ROR   0, 500\n        MST   0\n        STOP",
    ),
})  # fmt: skip
"""The errors of the assembler, by code."""

CODES: Final = (*MISTAKES, *RULES)
"""All codes that have a page."""
_SHOWN_LINES: Final = 12


def title(code: str) -> str:
    """What a diagnostic is about, in a few words."""
    return ERRORS[code] if code in ERRORS else RULES[code].title


def page(code: str) -> str:
    """The page of a diagnostic in Markdown, without its heading."""
    row = MISTAKES.get(code) or RULES[code]
    example = "\n".join(row.example.rstrip().split("\n")[:_SHOWN_LINES])
    return f"{row.reason} {_nature(code)}\n\n```tmcl wrong\n{example}\n```\n\n```tmcl\n{row.cure.rstrip()}\n```\n"


def _nature(code: str) -> str:
    """How severe a diagnostic is; of a rule also whether it is on, and its fix."""
    if code not in RULES:
        return "*Error.*"
    rule = RULES[code]
    switched = "" if rule.on else ", off by default"
    return f"*{rule.severity.capitalize()}{switched}.* {f'Fix: {rule.fix}' if rule.fix else 'No fix'}."
