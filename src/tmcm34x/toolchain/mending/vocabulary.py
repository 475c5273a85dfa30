"""Repairs of commands and words: misspelt, glued together, left out, or of another language."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

from tmcm34x.tmcl.commands import BY_MNEMONIC, SISTER_COMMANDS
from tmcm34x.tmcl.commands import Command as CommandRow
from tmcm34x.toolchain import parser
from tmcm34x.toolchain.diagnostics import article, one_of, shown
from tmcm34x.toolchain.mending import words
from tmcm34x.toolchain.mending.soundness import sound, suits
from tmcm34x.toolchain.mending.spelling import nearest
from tmcm34x.toolchain.mending.text import Repair, TakenApart, change, changed
from tmcm34x.toolchain.tokens import BLANKS, tokenize


def symbol_for_word(line: TakenApart) -> Iterator[Repair]:
    """`JC =, Label` for JC EQ."""
    row = line.row
    first, comma, _ = line.after.partition(",")
    if row is None or not comma or not row.operands or row.operands[0].kind != "word":
        return
    written = first.strip(BLANKS)
    meant = words.WORDS.get(row.mnemonic, {}).get(written) if not written.isidentifier() else None
    start = line.text.find(written, line.rest)
    if meant is not None:
        text = f"{row.mnemonic} takes a word here, not {written!r}; did you mean {meant}?"
        blank = "" if line.text[start - 1] in BLANKS else " "
        yield change("E205", text, (start, start + len(written), blank + meant))
    elif written and not written[0].isalnum() and written[0] not in "$%(_":
        text = f"{row.mnemonic} takes {one_of(word for word, _ in row.operands[0].words)} here, not {shown(written)}"
        yield Repair("E205", start, start + len(written), text)


def meaning(line: TakenApart) -> Iterator[Repair]:
    """Commands as other languages call them."""
    meant = words.COMMANDS.get(line.head.upper())
    called = line.after.strip(BLANKS)
    if meant is not None and (line.head.upper() not in SISTER_COMMANDS or called.isidentifier()):
        start, after = line.body, line.after.lstrip(BLANKS)
        if not after:
            meant = meant.partition(" ")[0]
        text = f"no command {line.head}; in TMCL it is {meant.rstrip(',')}"
        yield change("E201", text, (start, line.rest, meant))


def misspelt(line: TakenApart) -> Iterator[Repair]:
    """A command with a slip in it, where the operands fit."""
    near = _near(line)
    fitting = [n for n in near if suits(_with_head(line, n))] or [
        n for n in near if sound(_with_head(line, n))
    ]
    text = f"no command {shown(line.head)}; did you mean {one_of(fitting)}?"
    if len(fitting) == 1:
        yield change("E201", text, (line.body, line.rest, fitting[0]))
    elif fitting:
        yield Repair("E201", line.body, line.rest, text)


def _with_head(line: TakenApart, name: str) -> parser.SourceLine:
    """The line with another command."""
    return parser.parse_line(changed(line.text, ((line.body, line.rest, name),)))


def _near(line: TakenApart) -> tuple[str, ...]:
    key = line.head.upper()
    if not key or key in BY_MNEMONIC or key in SISTER_COMMANDS:
        return ()
    return nearest(key, BY_MNEMONIC, 1 if len(key) < 5 else 2)


def glued(line: TakenApart) -> Iterator[Repair]:
    """`WAITTICKS, 0, 10`, `SAP4, 0, 5`, `JALoop`, `MVP ABS0, 5`."""
    return _glued_command(line) if line.row is None else _glued_word(line, line.row)


def _glued_command(line: TakenApart) -> Iterator[Repair]:
    key = line.head.upper()
    for name in sorted(BY_MNEMONIC, key=len, reverse=True):
        left, first = key.removeprefix(name), BY_MNEMONIC[name].operands[:1]
        if left in {"", key}:
            continue
        known = first and (
            left in dict(first[0].words) or (first[0].kind == "address" and left in line.labels)
        )
        if known or left.isdecimal():
            place = line.body + len(name)
            yield change("E103", f"a space is missing after {name}", (place, place, " "))


def _glued_word(line: TakenApart, row: CommandRow) -> Iterator[Repair]:
    words_of = row.operands[0].words if row.operands else ()
    first = next(iter(tokenize(line.text, line.rest, line.end)), None)
    written = "" if first is None else first.text.upper()
    for word, _ in sorted(words_of, key=lambda item: -len(item[0])):
        left = written.removeprefix(word)
        if first is None or left in {"", written} or written in line.labels:
            continue
        if left.isdecimal() or not _jumps(row):
            place = first.start + len(word)
            yield change("E103", f"',' is missing after {word}", (place, place, ", "))


def _jumps(row: CommandRow) -> bool:
    return row.operands[-1].kind == "address"


def split(line: TakenApart) -> Iterator[Repair]:
    """A blank within a command or a number."""
    tokens = tokenize(line.text, line.body, line.end)
    for before, after in pairwise(tokens):
        if before.kind == after.kind and before.kind in ("name", "number") and before.end < after.start:
            joined = before.text + after.text
            head = before.start == line.body
            if (joined.upper() in BY_MNEMONIC) if head else before.kind == "number":
                text = f"a space within {shown(joined)}"
                yield change("E103", text, (before.end, after.start, ""))


def calcx(line: TakenApart) -> Iterator[Repair]:
    """`CALC SUB` without a number."""
    if line.head.upper() == "CALC":
        text = "CALC needs a number; with the X register it is CALCX"
        yield change("E203", text, (line.body, line.rest, "CALCX"))


def missing_word(line: TakenApart) -> Iterator[Repair]:
    """The word that comes first was left out: `JC Loop`, `WAIT 100`."""
    row, tokens = line.row, tokenize(line.text, line.rest, line.end)
    if row is None or not tokens or not row.operands or row.operands[0].kind != "word":
        return
    first = tokens[0]
    known = dict(row.operands[0].words)
    what = f"{row.mnemonic} needs {article(row.operands[0].name)} before {shown(first.text)}: {one_of(known)}"
    written = first.text.upper()
    misspelt = nearest(written, known) or any(word.startswith(written) for word in known)
    if row.mnemonic == "WAIT" and len(tokens) == 1 and first.kind in ("number", "name") and not misspelt:
        ticks = (first.start, first.start, "TICKS, 0, ")
        yield Repair("E203", first.start, first.end, what, (ticks,))
    commas = sum(token.text == "," for token in tokens)
    if written not in known and commas + 2 == len(row.operands):
        yield Repair("E203", first.start, first.end, what)


def guess(line: TakenApart) -> Iterator[Repair]:
    """A command with a slip in it, whose operands are wrong too; or one that TMCL does not have."""
    key = line.head.upper()
    if key in words.NOTES:
        yield Repair("E201", line.body, line.rest, f"no command {line.head}; {words.NOTES[key]}")
    near = _near(line)
    meant = words.COMMANDS.get(key, "").partition(" ")[0]
    if (near or meant) and key not in SISTER_COMMANDS:
        text = f"no command {shown(line.head)}; did you mean {meant or one_of(near)}?"
        yield Repair("E201", line.body, line.rest, text)
