"""The rules: code, severity, what each one means and why it matters; and the comments that suppress them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Final, NamedTuple

from tmcm34x.toolchain.diagnostics import Severity


class Rule(NamedTuple):
    """One row of `RULES`.

    example: a program that the rule finds fault with, and `cure` one that does the same without
    on: whether the rule is on by default
    fix: what the fix does that editors offer; empty where none is certain to be right
    """

    severity: Severity
    title: str
    reason: str
    example: str
    cure: str
    on: bool = True
    fix: str = ""


RULES: Final[Mapping[str, Rule]] = MappingProxyType({
    "W101": Rule(
        "warning", "unreachable code",
        "No path of the program leads there. Often a label is missing, or a jump has the wrong target.",
        "        STOP\n"
        "        ROR   0, 500            // nothing leads here\n"
        "        STOP\n",
        "        STOP\n"
        "Turn:   ROR   0, 500            // tmcl: entry\n"
        "        STOP\n",
    ),
    "W102": Rule(
        "warning", "the program runs past its end",
        "The last instruction is no STOP, JA or RSUB: the module continues with whatever an earlier, longer program "
        "left in its memory.",
        "        ROR   0, 500\n",
        "        ROR   0, 500\n"
        "        STOP\n",
        fix="adds STOP",
    ),
    "W103": Rule(
        "warning", "more than eight calls open",
        "The stack holds eight return addresses. A ninth CSUB is ignored: the program continues after it as if the "
        "subroutine had run.",
        "        CSUB  S1\n"
        "        STOP\n"
        "S1:     CSUB  S2\n"
        "        RSUB\n"
        "S2:     CSUB  S3\n"
        "        RSUB\n"
        "S3:     CSUB  S4\n"
        "        RSUB\n"
        "S4:     CSUB  S5\n"
        "        RSUB\n"
        "S5:     CSUB  S6\n"
        "        RSUB\n"
        "S6:     CSUB  S7\n"
        "        RSUB\n"
        "S7:     CSUB  S8\n"
        "        RSUB\n"
        "S8:     CSUB  S9\n"
        "        RSUB\n"
        "S9:     RSUB\n",
        "        CSUB  S1\n"
        "        CSUB  S2\n"
        "        STOP\n"
        "S1:     RSUB\n"
        "S2:     RSUB\n",
    ),
    "W104": Rule(
        "warning", "RSUB with no call open",
        "RSUB is ignored when no CSUB is open: the program runs on into the code after it.",
        "        ROR   0, 500\n"
        "        RSUB\n",
        "        CSUB  Turn\n"
        "        STOP\n"
        "Turn:   ROR   0, 500\n"
        "        RSUB\n",
    ),
    "W105": Rule(
        "warning", "recursion",
        "A subroutine that calls itself fills the stack of eight return addresses, and further calls are ignored.",
        "        CSUB  Again\n"
        "        STOP\n"
        "Again:  CSUB  Again\n"
        "        RSUB\n",
        "        CSUB  Again\n"
        "        STOP\n"
        "Again:  GIO   0, 0\n"
        "        JC    ZE, Again\n"
        "        RSUB\n",
    ),
    "W106": Rule(
        "warning", "a jump out of the program",
        "After the last instruction the memory holds what an earlier program left there, or nothing.",
        "        JA    7\n",
        "Loop:   WAIT  TICKS, 0, 10\n"
        "        JA    Loop\n",
    ),
    "W201": Rule(
        "warning", "waiting for a switch or reference search without a time-out",
        "A broken switch or a blocked axis holds the program for ever. Give the time-out in ticks of 10 ms and "
        "test it with JC ETO.",
        "        WAIT  REFSW, 0, 0\n"
        "        STOP\n",
        "        WAIT  REFSW, 0, 1000\n"
        "        JC    ETO, Failed\n"
        "        STOP\n"
        "Failed: CLE   ETO\n"
        "        STOP\n",
        fix="sets a time-out of 30 s",
    ),
    "W202": Rule(
        "warning", "EEPROM written in a loop",
        "An EEPROM cell takes a limited number of writes, and each one takes time: a loop uses them up in hours. "
        "Keep such values in user variables and store the final ones.",
        "Loop:   STAP  4, 0\n"
        "        JA    Loop\n",
        "        STAP  4, 0\n"
        "        STOP\n",
    ),
    "W203": Rule(
        "information", "the time-out flag is tested but never cleared",
        "ETO stays set until CLE ETO or CLE ALL: the next JC ETO jumps even if its own WAIT ended in time.",
        "        WAIT  REFSW, 0, 1000\n"
        "        JC    ETO, Failed\n"
        "        STOP\n"
        "Failed: MST   0\n"
        "        STOP\n",
        "        WAIT  REFSW, 0, 1000\n"
        "        JC    ETO, Failed\n"
        "        STOP\n"
        "Failed: CLE   ETO\n"
        "        STOP\n",
        fix="inserts CLE ETO where the time-out leads, unless other paths lead there too",
    ),
    "W204": Rule(
        "information", "EEPROM written at each automatic start",
        "With automatic start (global parameter 77) the program runs whenever the module is switched on, and each "
        "time it stores the value again. Store it once from the host, or only where it has changed.",
        "        SGP   77, 0, 1\n"
        "        STGP  5, 2\n"
        "        STOP\n",
        "        STGP  5, 2\n"
        "        STOP\n",
    ),
    "W205": Rule(
        "warning", "an error flag that nothing sets",
        "ETO is set by a WAIT that ran into its time-out, EDV by a deviation beyond axis parameter 212. Without "
        "either in the program the JC never jumps.",
        "        WAIT  POS, 0, 0\n"
        "        JC    ETO, Failed\n"
        "        MVP   ABS, 0, 0\n"
        "        STOP\n"
        "Failed: CLE   ETO\n"
        "        STOP\n",
        "        MVP   ABS, 0, 0\n"
        "        WAIT  POS, 0, 500\n"
        "        JC    ETO, Failed\n"
        "        STOP\n"
        "Failed: CLE   ETO\n"
        "        STOP\n",
    ),
    "W206": Rule(
        "information", "a loop that polls without a WAIT",
        "The loop reads as often as the module can. A WAIT TICKS in it leaves processor time to the motors and "
        "to the host. Off by default.",
        "Loop:   GIO   0, 0\n"
        "        JC    ZE, Loop\n"
        "        STOP\n",
        "Loop:   WAIT  TICKS, 0, 1\n"
        "        GIO   0, 0\n"
        "        JC    ZE, Loop\n"
        "        STOP\n", on=False,
        fix="inserts WAIT TICKS, 0, 1 into the loop",
    ),
    "W301": Rule(
        "warning", "value out of the parameter's range",
        "The module answers with status 4 and keeps the old value; the program continues.",
        "        SAP   140, 0, 7\n"
        "        STOP\n",
        "        SAP   140, 0, 6\n"
        "        STOP\n",
        fix="changes the value to the nearest one in range",
    ),
    "W302": Rule(
        "warning", "a parameter that this model does not have",
        "A TMCM-342 has no motor drivers: parameters of currents, loads and decay belong to the 341 and 343.",
        "        SAP   6, 0, 100         // of a TMCM-342\n"
        "        STOP\n",
        "        SAP   5, 0, 100\n"
        "        STOP\n",
    ),
    "W303": Rule(
        "warning", "a motor that does not exist",
        "The modules have three motors, 0 to 2. MVP COORD also takes $80 + mask and $40 + mask, CCO 7, SCO and "
        "GCO 255.",
        "        ROR   3, 500\n"
        "        STOP\n",
        "        ROR   2, 500\n"
        "        STOP\n",
    ),
    "W304": Rule(
        "warning", "a read-only parameter written",
        "The module answers with status 3 and nothing happens.",
        "        SAP   8, 0, 1\n"
        "        STOP\n",
        "        SAP   0, 0, 1\n"
        "        STOP\n",
    ),
    "W305": Rule(
        "warning", "an unknown parameter, bank or port",
        "Firmware V4.36 has no such parameter, bank or port: nothing is set, and reading gives 0.",
        "        GGP   0, 1\n"
        "        AGP   1, 2\n"
        "        STOP\n",
        "        GGP   0, 2\n"
        "        AGP   1, 2\n"
        "        STOP\n",
    ),
    "W306": Rule(
        "warning", "a parameter that is not stored",
        "STAP and RSAP take the parameters marked E; STGP and RSGP take the user variables in bank 2, and with numbers "
        "7 and 23 of bank 0 the two tables of the motion chip. All else in bank 0 is stored by SGP itself.",
        "        STAP  1, 0\n"
        "        STOP\n",
        "        STAP  4, 0\n"
        "        STOP\n",
    ),
    "W307": Rule(
        "warning", "operand out of range",
        "The module refuses the command with status 4 and continues with the next one.",
        "        MVP   ABS, 0, 16777216\n"
        "        STOP\n",
        "        MVP   ABS, 0, 8388607\n"
        "        STOP\n",
        fix="changes the value to the nearest one in range",
    ),
    "W308": Rule(
        "warning", "a coordinate that is never set",
        "At power-on coordinates are 0 unless they are stored in the EEPROM: MVP COORD would go to position 0.",
        "        MVP   COORD, 0, 3\n"
        "        STOP\n",
        "        SCO   3, 0, 1000\n"
        "        MVP   COORD, 0, 3\n"
        "        STOP\n",
    ),
    "W309": Rule(
        "warning", "division by zero",
        "CALC DIV and CALC MOD with 0 leave the accumulator as it was.",
        "        GGP   0, 2\n"
        "        CALC  DIV, 0\n"
        "        AGP   0, 2\n"
        "        STOP\n",
        "        GGP   0, 2\n"
        "        CALC  DIV, 2\n"
        "        AGP   0, 2\n"
        "        STOP\n",
    ),
    "W310": Rule(
        "warning", "a fraction that is lost by rounding",
        "The fields of a command hold whole numbers: the assembler rounds to the nearest, halves to the even one. "
        "WAIT POS, 0, 0.4 waits without a time-out, and SAP 0.4, 0, 5000 moves motor 0.",
        "        WAIT  TICKS, 0, 0.4\n"
        "        STOP\n",
        "        WAIT  TICKS, 0, 4\n"
        "        STOP\n",
        fix="writes the rounded number, unless it is an expression",
    ),
    "W311": Rule(
        "warning", "a move with speed or acceleration 0",
        "A motor whose positioning speed (4) or acceleration (5) is 0 never arrives; a WAIT POS after it waits "
        "for ever.",
        "        SAP   4, 0, 0\n"
        "        MVP   ABS, 0, 1000\n"
        "        STOP\n",
        "        SAP   4, 0, 500\n"
        "        MVP   ABS, 0, 1000\n"
        "        STOP\n",
    ),
    "W312": Rule(
        "warning", "a divisor set after the speed or the acceleration",
        "The unit of the speed (4) depends on the pulse divisor (154), that of the acceleration (5) on both divisors "
        "(153, 154), and older firmware computes the ramp when 5 is set. Set the divisors first.",
        "        SAP   5, 0, 200\n"
        "        SAP   154, 0, 5\n"
        "        STOP\n",
        "        SAP   154, 0, 5\n"
        "        SAP   5, 0, 200\n"
        "        STOP\n",
    ),
    "W313": Rule(
        "warning", "a target position set in velocity mode",
        "After ROR, ROL or MST the motor is in velocity mode: parameter 0 changes the target and moves nothing. "
        "MVP ABS switches to position mode.",
        "        ROR   0, 500\n"
        "        SAP   0, 0, 1000\n"
        "        STOP\n",
        "        ROR   0, 500\n"
        "        MVP   ABS, 0, 1000\n"
        "        STOP\n",
    ),
    "W314": Rule(
        "warning", "waiting for the position of a motor without a target",
        "WAIT POS ends when the motor is at its target. No command of the program gives this motor one; often "
        "the motor number is wrong.",
        "        MVP   ABS, 0, 1000\n"
        "        WAIT  POS, 1, 0\n"
        "        STOP\n",
        "        MVP   ABS, 0, 1000\n"
        "        WAIT  POS, 0, 0\n"
        "        STOP\n",
    ),
    "W315": Rule(
        "information", "hardware that may be absent",
        "Axis parameters 209, 210 and 212 are those of the encoders on a TMCM-323. Without one, 209 reads 0.",
        "        GAP   209, 0\n"
        "        AGP   0, 2\n"
        "        STOP\n",
        "        GAP   1, 0\n"
        "        AGP   0, 2\n"
        "        STOP\n",
    ),
    "W316": Rule(
        "information", "a user variable that is read and never written",
        "It is 0 unless a host or an earlier program writes it. Off by default, because hosts may.",
        "        GGP   5, 2\n"
        "        AAP   0, 0\n"
        "        STOP\n",
        "        SGP   5, 2, 100\n"
        "        GGP   5, 2\n"
        "        AAP   0, 0\n"
        "        STOP\n", on=False,
    ),
    "W401": Rule(
        "information", "a name that is never used",
        "A leftover, or a sign that another name was meant.",
        "Speed = 500\n"
        "        STOP\n",
        "Speed = 500\n"
        "        ROR   0, Speed\n"
        "        STOP\n",
        fix="removes the definition",
    ),
    "W402": Rule(
        "information", "a constant with the name of a TMCL word",
        "Where a command takes the word, the word counts and not the constant.",
        "POS = 5\n"
        "        ROR   0, POS\n"
        "        STOP\n",
        "Place = 5\n"
        "        ROR   0, Place\n"
        "        STOP\n",
    ),
    "W403": Rule(
        "warning", "a surplus number that has no effect",
        "The command ignores this field; a common cause is AAP or AGP written like SAP or SGP, although "
        "they take their value from the accumulator.",
        "        GAP   1, 0\n"
        "        AAP   0, 1, 1000\n"
        "        STOP\n",
        "        GAP   1, 0\n"
        "        AAP   0, 1\n"
        "        STOP\n",
        fix="removes the number",
    ),
    "W501": Rule(
        "warning", "a register used before it is loaded",
        "No path to this command loads the accumulator, or X: it holds what an earlier program left there.",
        "        CALC  ADD, 1\n"
        "        AGP   0, 2\n"
        "        STOP\n",
        "        GGP   0, 2\n"
        "        CALC  ADD, 1\n"
        "        AGP   0, 2\n"
        "        STOP\n",
    ),
    "W502": Rule(
        "warning", "a value that is read and lost",
        "The accumulator holds one value: reading another one drops the first. CALCX LOAD keeps a value in X, AGP "
        "in a user variable.",
        "        GAP   1, 0\n"
        "        GAP   8, 0\n"
        "        AGP   0, 2\n"
        "        STOP\n",
        "        GAP   1, 0\n"
        "        CALCX LOAD\n"
        "        GAP   8, 0\n"
        "        CALCX SUB\n"
        "        AGP   0, 2\n"
        "        STOP\n",
        fix="removes the command, unless reading has an effect in the module",
    ),
    "W503": Rule(
        "warning", "a condition without a comparison",
        "EQ, NE, GT, GE, LT and LE test the result of the last COMP; no path to this JC has one. "
        "After reading a value, ZE and NZ need no COMP.",
        "Loop:   GIO   0, 0\n"
        "        JC    EQ, Loop\n"
        "        STOP\n",
        "Loop:   GIO   0, 0\n"
        "        COMP  0\n"
        "        JC    EQ, Loop\n"
        "        STOP\n",
        fix="inserts COMP 0 before the jump",
    ),
    "W504": Rule(
        "warning", "a value that is written over",
        "Two commands write the same parameter or variable, and nothing between them can use the first value; "
        "often one of the numbers is wrong.",
        "        SAP   4, 0, 500\n"
        "        SAP   4, 0, 800\n"
        "        STOP\n",
        "        SAP   4, 0, 500\n"
        "        SAP   5, 0, 800\n"
        "        STOP\n",
        fix="removes the first command, unless it moves the motor",
    ),
})  # fmt: skip
"""All rules, by code."""

DEFAULT: Final = frozenset(code for code, rule in RULES.items() if rule.on)
"""The rules that are on by default."""

_IGNORE: Final = re.compile(r"lint:\s*ignore\b((?:[\s,]*\bW\d+)*)", re.IGNORECASE)
_SWITCH: Final = re.compile(r"//.*?\blint:\s*(on|off)\b((?:[\s,]*\bW\d+)+)", re.IGNORECASE)


def ignored_codes(comment: str) -> frozenset[str] | None:
    """The codes that a comment suppresses on its line: none, some, or None for all."""
    match = _IGNORE.search(comment)
    if match is None:
        return frozenset()
    codes = re.findall(r"W\d+", match.group(1).upper())
    return frozenset(codes) if codes else None


def switched(lines: Iterable[str], rules: frozenset[str]) -> frozenset[str]:
    """`rules` after the comments `// lint: off W203` and `// lint: on W206` of a file."""
    for line in lines:
        match = _SWITCH.search(line) if "lint:" in line else None
        if match is not None:
            codes = frozenset(re.findall(r"W\d+", match[2].upper()))
            rules = rules | codes if match[1].lower() == "on" else rules - codes
    return rules
