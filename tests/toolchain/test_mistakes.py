"""Single human mistakes in the project's own programs: one message each, at its place, with the right text.

A row of `MISTAKES` is a mistake: what stands in a sound line, what is typed instead, and what the tool chain must
say.  `^` marks the column of the message and is not typed.  Each row is made on up to three lines of each program.

    MENDED   one fix, after which the program is the same as before
    a text   no fix, and the message names this
"""

import re
from pathlib import Path
from typing import NamedTuple

import pytest

from tmcm34x.toolchain.assembler import assemble
from tmcm34x.toolchain.linter import lint

EXAMPLES = Path(__file__).parents[2] / "examples"
WORDS = "words"
WORDS_PROGRAM = """
// Commands and words that the examples do without.
        GAP   1, 0
        CALCX LOAD
        GAP   1, 1
        CALCX SUB
        COMP  100
        JC    GE, Far
        COMP  -100
        JC    LE, Far
        MVP   REL, 0, 500
Far:    STOP
"""
"""The program `WORDS`."""
PROGRAMS = (
    "conveyor", "handshake", "homing", "joystick", "pick-and-place", "speed-profile", "three_axes",
    "manual/5.2-first-program", "manual/6.7.20-subroutine", "manual/9.2-stall-homing", WORDS,
)  # fmt: skip
MENDED = "MENDED"
LINES_EACH = 3

MISTAKES = (
    # letters of commands
    (r"\bSAP\b", "^SPA", "E201", MENDED),
    (r"\bSAP\b", "^SAPP", "E201", MENDED),
    (r"\bSAP\b", "^ASP", "E201", MENDED),
    (r"\bMVP\b", "^MPV", "E201", MENDED),
    (r"\bMVP\b", "^MVVP", "E201", MENDED),
    (r"\bMVP\b", "^MOVE", "E201", MENDED),
    (r"\bWAIT\b", "^WIAT", "E201", MENDED),
    (r"\bWAIT\b", "^WAI", "E201", MENDED),
    (r"\bWAIT\b", "^WAITT", "E201", MENDED),
    (r"\bSTOP\b(?!,)", "^STPO", "E201", MENDED),
    (r"\bSTOP\b(?!,)", "^SOTP", "E201", MENDED),
    (r"\bSTOP\b(?!,)", "^STOPP", "E201", MENDED),
    (r"\bRSUB\b", "^RSBU", "E201", MENDED),
    (r"\bCSUB\b", "^CUSB", "E201", MENDED),
    (r"\bCSUB\b", "^CSBU", "E201", MENDED),
    (r"\bCALC\b", "^CACL", "E201", MENDED),
    (r"\bCOMP\b", "^CMOP", "E201", MENDED),
    (r"\bCOMP\b", "^COM", "E201", MENDED),
    (r"\bROR\b", "^RORR", "E201", MENDED),
    (r"\bRFS\b(?=\s+S)", "^RSF", "E201", MENDED),
    (r"\bGIO\b", "^GOI", "E201", MENDED),
    (r"\bSIO\b", "^SOI", "E201", MENDED),
    (r"\bGGP\b", "^GPG", "E201", MENDED),
    (r"\bSGP\b", "^SPG", "E201", MENDED),
    (r"\bAGP\b", "^APG", "E201", MENDED),
    (r"\bGGP\b(?=\s+\d, 2)", "^GPP", "E201", "GAP or GGP"),
    (r"\bJC\b", "^CJ", "E201", MENDED),
    (r"\bJC\b", "^JCC", "E201", MENDED),
    (r"\bMST\b", "^MTS", "E201", MENDED),
    (r"\bCLE\b", "^CEL", "E201", MENDED),
    (r"\bWAIT(\s+RFS)", r"^WIAT\1", "E201", MENDED),
    (r"\bAAP\b", "^APA", "E201", MENDED),
    (r"\bCALCX\b", "^CLACX", "E201", MENDED),
    (r"\bSCO\b", "^SOC", "E201", MENDED),
    # commands of other languages
    (r"\bJA\b", "^JMP", "E201", MENDED),
    (r"\bJA\b", "^GOTO", "E201", MENDED),
    (r"\bCSUB\b", "^CALL", "E201", MENDED),
    (r"\bCSUB\b", "^GOSUB", "E201", MENDED),
    (r"\bRSUB\b", "^RET", "E201", MENDED),
    (r"\bRSUB\b", "^RETURN", "E201", MENDED),
    (r"\bSTOP\b(?!,)", "^END", "E201", MENDED),
    (r"\bSTOP\b(?!,)", "^HALT", "E201", MENDED),
    (r"\bMST\b", "^MSTOP", "E201", MENDED),
    (r"\bCOMP\b", "^CMP", "E201", MENDED),
    (r"\bWAIT\s+TICKS, 0,", "^DELAY", "E201", MENDED),
    (r"\bWAIT\s+TICKS, 0, (?=\d)", "WAIT ^", "E203", MENDED),
    (r"\bRSUB\b", "^RTS", "E201", MENDED),
    (r"\bCALCX\b(?=\s+(ADD|SUB|MUL))", "^CALC", "E203", MENDED),
    (r"\bJC\s+ZE,", "^JZ", "E201", MENDED),
    (r"\bJC\s+NZ,", "^JNZ", "E201", MENDED),
    # words
    (r"\bGE,", "^GTE,", "E205", MENDED),
    (r"\bLE,", "^LTE,", "E205", MENDED),
    (r"\bLT,", "^<,", "E205", MENDED),
    (r"\bREL,", "^RELATIVE,", "E205", MENDED),
    (r"\bLT,", "^LESS,", "E205", MENDED),
    (r"\bGT,", "^GREATER,", "E205", MENDED),
    (r"\bZE,", "^ZERO,", "E205", MENDED),
    (r"\bNZ,", "^NOTZERO,", "E205", MENDED),
    (r"\bNE,", "^NEQ,", "E205", MENDED),
    (r"\bNE,", "^!=,", "E205", MENDED),
    (r"\bEQ,", "^EQUAL,", "E205", MENDED),
    (r"\bETO,", "^EOT,", "E205", MENDED),
    (r"\bABS,", "^ASB,", "E205", MENDED),
    (r"\bABS,", "^ABSOLUTE,", "E205", MENDED),
    (r"\bTICKS,", "^TICK,", "E205", MENDED),
    (r"\bTICKS,", "^TIKCS,", "E205", MENDED),
    (r"\bPOS,", "^PSO,", "E205", MENDED),
    (r"\bSTART,", "^STRAT,", "E205", MENDED),
    (r"\bCOORD,", "^CORD,", "E205", MENDED),
    (r"\bADD,", "^ADDD,", "E205", MENDED),
    (r"\bSUB,", "^MINUS,", "E205", MENDED),
    (r"\b(JC\s+)\w+, ", r"\1^", "E203", "needs a condition"),
    (r"\b(MVP\s+)\w+, ", r"\1^", "E203", "needs a mode"),
    (r"\b(RFS\s+)\w+, ", r"\1^", "E203", "needs an action"),
    (r"\b(CALC\s+)\w+, ", r"\1^", "E203", "needs an operation"),
    (r"\b(WAIT\s+POS)[^/\n]*", r"^\1 ", "E203", "WAIT needs a motor"),
    # commas, parentheses, blanks
    (r"\b(SAP\s+\w+), ", r"\1 ^", "E103", MENDED),
    (r"\b(SAP\s+\w+, \w+), (?=\w)", r"\1 ^", "E103", MENDED),
    (r"\b(MVP\s+\w+), (?=\w)", r"\1 ^", "E103", MENDED),
    (r"\b(MVP\s+\w+), (?=\d)", r"\1^", "E103", MENDED),
    (r"\b(WAIT\s+\w+, \w+), (?=\w)", r"\1 ^", "E103", MENDED),
    (r"\b(JC\s+\w+), ", r"\1 ^", "E103", MENDED),
    (r"\b(SAP|WAIT|MVP|SIO|JC)\b(?= )", r"\1^,", "E103", MENDED),
    (r"\b(SAP|WAIT|MVP|SIO|JC)\b(.*\S)", r"\1\2^,", "E103", MENDED),
    (r"\b(SAP|WAIT|MVP|SIO)\b([^,]*),", r"\1\2,^,", "E103", MENDED),
    (r"\b(SAP|WAIT|MVP|SIO|CALC)\s+(.*\S)", r"\1^(\2)", "E103", MENDED),
    (r"\b(JA|CSUB)\s+(\w+)", r"\1^(\2)", "E103", MENDED),
    (r"\b(JA|CSUB)(\s+)(\w+)", r"\1\2\3^:", "E103", MENDED),
    (r"\b(SAP|SIO)(\s+)(\w+), (\w+), ", r"\1\2\3^; \4; ", "E103", MENDED),
    (r"\b(WAIT)\s+(\w+,)", r"\1^\2", "E103", MENDED),
    (r"\b(SAP|SIO|SGP|GGP)\s+(?=\d)", r"\1^", "E103", MENDED),
    (r"\bW(AIT\b)", r"W^ \1", "E103", MENDED),
    (r"\b(WAIT.*, \d)(\d+)", r"\1^ \2", "E103", MENDED),
    (r"\b(SAP|WAIT|MVP|SIO|JC)\b([^,]*),", r"\1\2^，", "E101", MENDED),
    (r"(,\s*)-(\w)", r"\1^−\2", "E101", MENDED),
    (r"(,\s*)-(\w)", r"\1^–\2", "E101", MENDED),
    # numbers
    (r"(, )(\d)$", r"\1^0x\2", "E102", MENDED),
    (r"(, )(\d+)0$", r"\1^\2O", "E102", MENDED),
    (r"(, )0(?=,)", r"\1^O", "E301", MENDED),
    (r"\b(WAIT\s+TICKS, 0, )(\d+)$", r"\1^\g<2>0ms", "E102", MENDED),
    (r"\b(SAP.*, )(\d+)$", r"\1^#\2", "E101", MENDED),
    (r"\b(S[AG]P.*, )(\d)$", r"\1^0\2h", "E102", MENDED),
    (r"(?m)^(\s+(?:STOP|RSUB|JA\s+\w+))$", "\\1^\x1a", "E101", MENDED),
    (r"^(\w+\s+= \d+)$", r"\1 ^°", "E101", "is not part of the language"),
    # comments
    (r"$", "  ^; a note", "E101", MENDED),
    (r"$", "  ^# a note", "E101", MENDED),
    (r"(STOP|RSUB)$", r"\1 ^-- a note", "E101", MENDED),
    (r"(STOP|RSUB)$", r"\1 ^/ a note", "E101", MENDED),
    (r"$", "  ^' a note", "E101", MENDED),
    (r"$", "  ^/* a note */", "E101", MENDED),
    (r"(?m)^//(.*)$", r"^#\1", "E101", MENDED),
    (r"(?m)^//(.*)$", r"^/*\1 */", "E101", MENDED),
    (r"(?m)^//(.*)$", r"^'\1", "E101", MENDED),
    # names, labels and constants
    (r"\b(JA\s+\w)(\w)(?!\2)(\w)(?=\w*$)", r"^\1\3\2", "E301", MENDED),
    (r"\b(CSUB\s+\w)(\w)(?!\2)(\w)(?=\w*$)", r"^\1\3\2", "E301", MENDED),
    (r"\bMax(Speed|Acceleration)\b", r"^Max\1s", "E301", MENDED),
    (r"\bMaxSpeed\b", "^MxaSpeed", "E301", MENDED),
    (r"^(\w\w\w+):(\s+\w)", r"^\1\2", "E103", MENDED),
    (r"^(\w\w\w+):(\s+\w)", r"\1^;\2", "E103", MENDED),
    (r"^(\w\w\w+):(\s+\w)", r"^:\1\2", "E103", MENDED),
    (r"^(\w+)\s+=", r"\1 ^:=", "E103", MENDED),
    (r"^(\w+)\s+=", r"\1 ^EQU", "E103", MENDED),
    (r"^(\w+)\s+=", r"^CONST \1 =", "E103", MENDED),
    (r"^(\w+)\s+=", r"^#define \1", "E103", MENDED),
    (r"^#include", "^include", "E103", MENDED),
    (r"^#include", "^#inculde", "E103", MENDED),
    (r"^(#include\s+)\"?([\w./-]+)\"?", r"\1^“\2”", "E101", MENDED),
    (r"^(\s+)(?=[A-Z])", r"^120\1", "E103", MENDED),
)


NO_NAMES = ("-", ".", " ", "ö")
"""What is typed into the names of labels and constants, wherever they stand."""


class Case(NamedTuple):
    program: str
    sound: str
    wrong: str
    line: int
    column: int


def source(program):
    return WORDS_PROGRAM if program == WORDS else (EXAMPLES / f"{program}.tmc").read_text()


def include(name, _from):
    return name, (EXAMPLES / name).read_text()


def cases(row):
    """The programs with this mistake in them."""
    pattern, typed, *_ = row
    for program in PROGRAMS:
        sound = source(program)
        lines = sound.split("\n")
        made = 0
        for number, text in enumerate(lines, 1):
            code, slashes, comment = text.partition("//")
            whole = "(?m)" in pattern
            if not (text if whole else code.strip()) or made == LINES_EACH:
                continue
            code, rest = (text, "") if whole else (code.rstrip(), f"  {slashes}{comment}" if slashes else "")
            changed = re.sub(pattern, typed, code, count=1)
            if changed == code or (rest and pattern == "$"):
                continue
            column = moved(changed.index("^"), changed)
            wrong = [*lines[: number - 1], changed.replace("^", "") + rest, *lines[number:]]
            made += 1
            yield Case(program, sound, "\n".join(wrong), number, column)


def renamed(typed):
    """The programs with a name that cannot be one, after its second letter."""
    for program in PROGRAMS:
        sound = source(program)
        defined = re.compile(r"^(\w\w\w+)(?::|\s+=)", re.MULTILINE)
        names = [match[1] for match in defined.finditer(sound)]
        for name in names[:LINES_EACH]:
            wrong = name[:2] + typed + name[2:]
            lines = [
                re.sub(rf"\b{name}\b", wrong, code) + slashes + comment
                for code, slashes, comment in (line.partition("//") for line in sound.split("\n"))
            ]
            number = next(
                n for n, line in enumerate(lines, 1) if re.match(rf"{re.escape(wrong)}(:|\s+=)", line)
            )
            yield Case(program, sound, "\n".join(lines), number, 1)


def moved(mark, changed):
    """The column, from 1, of what begins at the mark; a mark before a command with a name stands for the name."""
    head = re.match(r"(?:JA|CSUB)\s+", changed[mark + 1 :])
    return mark + 1 + (head.end() if head else 0)


def judged(text):
    assembly = assemble(text, "x.tmc", include)
    return [*assembly.diagnostics, *(item for item in lint(assembly) if item.severity != "information")]


def apply(text, edits):
    lines = text.split("\n")
    for edit in sorted(edits, key=lambda item: item.location, reverse=True):
        _, line, column, end = edit.location
        lines[line - 1] = lines[line - 1][: column - 1] + edit.text + lines[line - 1][end - 1 :]
    return "\n".join(lines)


def program(text):
    assembly = assemble(text, "x.tmc", include)
    return assembly.program if assembly.ok else None


def name_of(row):
    return f"{row[0]} -> {row[1]}"


ALL = [(row, case) for row in MISTAKES for case in cases(row)]
RENAMED = [(("", "", "E103", MENDED), case) for typed in NO_NAMES for case in renamed(typed)]


def test_there_are_enough_mistakes():
    assert len(ALL) >= 400
    made = {row for row, _ in ALL}
    assert [name_of(row) for row in MISTAKES if row not in made] == []
    assert {case.program for _, case in ALL} == set(PROGRAMS)


@pytest.mark.parametrize("row", MISTAKES, ids=name_of)
def test_a_mistake_gets_one_message_at_its_place(row):
    for case in cases(row):
        before = [item.code for item in judged(case.sound)]
        found = [item for item in judged(case.wrong) if item.code not in before]
        places = [(item.code, item.location.line, item.location.column) for item in found]
        assert places == [(row[2], case.line, case.column)], case.wrong.split("\n")[case.line - 1]


@pytest.mark.parametrize("typed", NO_NAMES)
def test_a_name_that_cannot_be_one_gets_one_message_where_it_is_defined(typed):
    for case in renamed(typed):
        found = [item for item in judged(case.wrong) if item.severity == "error"]
        assert [(i.code, i.location.line, i.location.column) for i in found] == [("E103", case.line, 1)], (
            case.wrong
        )
        assert program(apply(case.wrong, found[0].fixes[0].edits)) == program(case.sound)


@pytest.mark.parametrize("row", MISTAKES, ids=name_of)
def test_no_wrong_fix_is_ever_offered(row):
    for case in cases(row):
        for item in judged(case.wrong):
            for fix in item.fixes if item.severity == "error" else ():
                mended = apply(case.wrong, fix.edits)
                assert row[3] == MENDED, (case.program, fix)
                assert program(mended) == program(case.sound), (
                    case.program,
                    mended.split("\n")[case.line - 1],
                )


def test_the_right_suggestion_comes_nearly_always():
    right = 0
    missed = []
    for row, case in ALL + RENAMED:
        message = next(item for item in judged(case.wrong) if item.severity == "error")
        if row[3] != MENDED:
            good = row[3] in message.text and not message.fixes
        else:
            good = len(message.fixes) == 1 and program(apply(case.wrong, message.fixes[0].edits)) == program(
                case.sound
            )
        right += good
        if not good:
            missed.append((case.program, case.wrong.split("\n")[case.line - 1], message.text))
    assert right >= 0.95 * len(ALL + RENAMED), missed
