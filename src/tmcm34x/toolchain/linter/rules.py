"""The rules: code, severity, what each one means and why it matters; and the comments that keep them quiet."""

from __future__ import annotations

import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Final, NamedTuple

from tmcm34x.toolchain.diagnostics import Severity


class Rule(NamedTuple):
    """One row of `RULES`."""

    severity: Severity
    title: str
    reason: str


RULES: Final[Mapping[str, Rule]] = MappingProxyType({
    "W101": Rule("warning", "code that is never reached",
        "No way through the program leads there. Often a label is missing, or a jump goes elsewhere than meant."),
    "W102": Rule("warning", "the program runs past its end",
        "The last instruction is no STOP, JA or RSUB: the module goes on with whatever an earlier, longer program "
        "left in its memory."),
    "W103": Rule("warning", "more than eight calls open",
        "The stack holds eight return addresses. A ninth CSUB is ignored: the program goes on behind it as if the "
        "subroutine had run."),
    "W104": Rule("warning", "RSUB with no call open",
        "RSUB is ignored when no CSUB is open: the program falls into the code behind it."),
    "W105": Rule("warning", "recursion",
        "A subroutine that calls itself fills the stack of eight return addresses, and further calls are ignored."),
    "W106": Rule("warning", "a jump out of the program",
        "Behind the last instruction the memory holds what an earlier program left there, or nothing."),
    "W201": Rule("warning", "waiting for a switch or reference search without a time-out",
        "A broken switch or a blocked axis holds the program for ever. Give the time-out in ticks of 10 ms and ask "
        "for it with JC ETO."),
    "W202": Rule("warning", "EEPROM written in a loop",
        "An EEPROM cell takes a limited number of writes, and each one takes time: a loop uses them up in hours. Keep "
        "such values in user variables and store them when they are final."),
    "W203": Rule("information", "the time-out flag is asked for but never cleared",
        "ETO stays set until CLE ETO or CLE ALL: the next JC ETO jumps even if its own wait was in time."),
    "W301": Rule("warning", "value out of the parameter's range",
        "The module answers with status 4 and keeps the old value; the program goes on."),
    "W302": Rule("warning", "a parameter that this model does not have",
        "A TMCM-342 has no motor drivers: parameters of currents, loads and decay belong to the 341 and 343."),
    "W303": Rule("warning", "a motor that is not there",
        "The modules have three motors, 0 to 2. MVP COORD also takes $80 + mask and $40 + mask, CCO 7, SCO and GCO "
        "255."),
    "W304": Rule("warning", "a read-only parameter written",
        "The module answers with status 3 and nothing happens."),
    "W305": Rule("warning", "an unknown parameter, bank or port",
        "Firmware V4.36 has no such parameter, bank or port: nothing is set, and reading gives 0."),
    "W306": Rule("warning", "a parameter that is not stored",
        "STAP and RSAP know the parameters marked E; STGP and RSGP the user variables in bank 2, and with numbers 7 "
        "and 23 of bank 0 the two tables of the motion chip. All else in bank 0 is stored by SGP itself."),
    "W307": Rule("warning", "operand out of range",
        "The module refuses the command with status 4 and goes on with the next one."),
    "W308": Rule("warning", "a coordinate that is never set",
        "At power-on coordinates are 0 unless they live in the EEPROM: MVP COORD would go to position 0."),
    "W309": Rule("warning", "division by zero",
        "CALC DIV and CALC MOD with 0 leave the accumulator as it was."),
    "W310": Rule("warning", "a fraction that is rounded away",
        "The fields of a command hold whole numbers: the assembler rounds to the nearest, halves to the even one. "
        "WAIT POS, 0, 0.4 waits without a time-out, and SAP 0.4, 0, 5000 moves motor 0."),
    "W401": Rule("information", "a name that is never used",
        "A left-over, or a sign that another name was meant."),
    "W402": Rule("information", "a constant called like a word of the language",
        "Where a command takes that word, the word wins."),
    "W403": Rule("warning", "a surplus number that has no effect",
        "The command does not look at this field; a common cause is AAP or AGP written like SAP or SGP, although "
        "they take their value from the accumulator."),
})  # fmt: skip
"""All rules, by code."""

_IGNORE: Final = re.compile(r"lint:\s*ignore\b((?:[\s,]*\bW\d+)*)", re.IGNORECASE)


def ignored_codes(comment: str) -> frozenset[str] | None:
    """The codes that a comment keeps quiet on its line: none, some, or None for all."""
    match = _IGNORE.search(comment)
    if match is None:
        return frozenset()
    codes = re.findall(r"W\d+", match.group(1).upper())
    return frozenset(codes) if codes else None
