"""Mistakes that go through a file: names that cannot be names, comments over several lines, habits.

`mend` takes the lines of a file that are no sound ones and gives them back as they were meant, with one mistake
each to report.  What follows a comment without slashes, or stands behind a number on each line, is one mistake.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from typing import Final, NamedTuple

from tmcm34x.tmcl.commands import BY_MNEMONIC, FOREIGN_COMMANDS
from tmcm34x.toolchain import parser
from tmcm34x.toolchain.diagnostics import shown
from tmcm34x.toolchain.expressions import Expression, Operand
from tmcm34x.toolchain.mending import words
from tmcm34x.toolchain.mending.lines import LONGEST, Change, Repair, changed, guess, repair, sound, suits
from tmcm34x.toolchain.tokens import BLANKS, Token, tokenize

_MOST: Final = 300
"""Lines of one file that are looked at; a file with more wrong ones is no TMCL."""
_NAME: Final = re.compile(r"[A-Za-z_]\w*\Z", re.ASCII)
_DEFINED: Final = re.compile(r"\s*([^\s:=,()/\"#$%][^:=,()\"/]*?)\s*(:(?!=)|=(?!=))")
_JUMPED: Final = re.compile(r"(?:\bJC\b[^,]*,|\bJA\b|\bCSUB\b)\s*(.*?)\s*(?://.*)?\Z", re.IGNORECASE)
_ALONE: Final = re.compile(r"\s*([A-Za-z_]\w*)\s*([;.,]?)\s*(?://.*)?\Z", re.ASCII)
_LETTER: Final = re.compile(r"[^\W\d_]")


class Mistake(NamedTuple):
    """One mistake: its place on line `number`, counted from 1, and the changes that mend it, by line."""

    number: int
    code: str
    start: int
    end: int
    text: str
    changes: tuple[tuple[int, Change], ...] = ()


def mend(texts: Sequence[str], lines: list[parser.Line]) -> list[Mistake]:
    """Puts into `lines` what the wrong ones were meant to be; returns the mistakes."""
    wrong = [index for index, line in enumerate(lines) if not _plausible(line)]
    return _File(texts, lines).mend(wrong[:_MOST]) if wrong else []


def _plausible(line: parser.Line) -> bool:
    """Whether a line has a known command and no mistakes that show in itself."""
    statement = line.statement
    return not line.problems and (
        type(statement) is not parser.Command or statement.mnemonic.upper() in BY_MNEMONIC
    )


class _File:
    def __init__(self, texts: Sequence[str], lines: list[parser.Line]) -> None:
        self.texts = texts
        self.lines = lines
        self.mistakes: list[Mistake] = []
        self.habits: dict[str, list[tuple[int, Repair]]] = {}
        self.labels = frozenset(label.text.upper() for line in lines for label in line.labels)
        self.targets = {
            match[1].upper() for text in texts if (match := _JUMPED.search(text[:LONGEST])) is not None
        }

    def mend(self, wrong: Iterable[int]) -> list[Mistake]:
        left = set(wrong)
        left -= self.block_comments(left)
        left -= self.broken_names(left)
        for index in sorted(left):
            if not (self.line(index) or self.label_alone(index) or self.rest_of_comment(index)):
                self.guessed(index)
        for kind, found in self.habits.items():
            self.habit(kind, found)
        return self.mistakes

    def line(self, index: int) -> bool:
        found = repair(self.texts[index], self.labels)
        if found is None or not found.changes:
            return found is not None and self.take(index, found)
        return self.take(index, found)

    def take(self, index: int, found: Repair) -> bool:
        """Believes a repair of one line."""
        line = parser.parse_line(changed(self.texts[index], found.changes))
        if found.changes:
            self.lines[index] = moved(line, found.changes)
        else:
            self.lines[index] = self.lines[index]._replace(statement=None, problems=())
        if found.kind:
            self.habits.setdefault(found.kind, []).append((index, found))
        else:
            changes = tuple((index + 1, change) for change in found.changes)
            self.mistakes.append(Mistake(index + 1, found.code, found.start, found.end, found.text, changes))
        return True

    def habit(self, _kind: str, found: list[tuple[int, Repair]]) -> None:
        """Tells once what was found on several lines."""
        first, what = found[0]
        more = f" ({len(found)} lines)" if len(found) > 1 else ""
        changes = tuple((index + 1, change) for index, one in found for change in one.changes)
        self.mistakes.append(Mistake(first + 1, what.code, what.start, what.end, what.text + more, changes))

    def block_comments(self, wrong: set[int]) -> set[int]:
        """`/* ... */` over one line or several: what it holds is nothing."""
        taken: set[int] = set()
        for first in sorted(wrong):
            start = self.texts[first].find("/*")
            slashes = self.texts[first].find("//")
            if first in taken or start < 0 or 0 <= slashes < start:
                continue
            last = self.end_of_block(first, start)
            changes = tuple(self.uncommented(first, last, start))
            text = "a comment begins with // and ends with its line; there is no /* */"
            self.mistakes.append(Mistake(first + 1, "E101", start, start + 2, text, changes))
            for number in range(first, last + 1):
                done = tuple(change for line, change in changes if line == number + 1)
                self.lines[number] = moved(parser.parse_line(changed(self.texts[number], done)), done)
            taken |= set(range(first, last + 1))
        return taken

    def end_of_block(self, first: int, start: int) -> int:
        """The line where a block comment ends; its first one where it never does."""
        for number in range(first, len(self.texts)):
            if "*/" in self.texts[number][start * (number == first) :]:
                return number
        return first

    def uncommented(self, first: int, last: int, start: int) -> Iterator[tuple[int, Change]]:
        """The changes that turn a block comment into comments of lines."""
        end = self.texts[last].find("*/", start + 2 if first == last else 0)
        behind = self.texts[last][end + 2 :].strip(BLANKS) if end >= 0 else ""
        if first == last and behind and not behind.startswith("//"):
            yield first + 1, (start, end + 2, "")
            return
        yield first + 1, (start, start + 2, "//")
        for number in range(first + 1, last + 1):
            yield number + 1, (0, 0, "// ")
        if end >= 0:
            yield last + 1, (end, end + 2, "")

    def broken_names(self, wrong: set[int]) -> set[int]:
        """Labels and constants whose names hold something that no name may: the name is mended wherever it stands."""
        taken: set[int] = set()
        for index in sorted(wrong):
            match = _DEFINED.match(self.texts[index][:LONGEST])
            if match is None or index in taken or not self.breaks(index, match):
                continue
            raw, name = match[1], self.mended_name(match[1])
            changes = tuple(self.replaced(raw, name, label=match[2] == ":"))
            what = "label" if match[2] == ":" else "constant"
            text = f"{shown(raw)} is no name for a {what}: letters, digits and _; did you mean {name}?"
            self.mistakes.append(Mistake(index + 1, "E103", *match.span(1), text, changes))
            for number in sorted({number for number, _ in changes}):
                done = tuple(change for line, change in changes if line == number)
                line = moved(parser.parse_line(changed(self.texts[number - 1], done)), done)
                if sound(line) or number == index + 1:
                    self.lines[number - 1] = line
                    taken.add(number - 1)
        return taken

    def breaks(self, index: int, match: re.Match[str]) -> bool:
        """Whether a definition has a name that is none, and nothing else is wrong with its line."""
        raw, text = match[1], self.texts[index]
        if _NAME.match(raw) or not _LETTER.search(raw):
            return False
        found = repair(text, self.labels)
        if found is not None and found.changes and raw.upper() not in self.targets:
            return False
        line = parser.parse_line(changed(text, ((*match.span(1), "_"),)))
        return sound(line) or (match[2] == ":" and line.statement is not None)

    def mended_name(self, raw: str) -> str:
        letters = "".join(
            words.LETTERS.get(c, c if c.isascii() and (c.isalnum() or c == "_") else "_") for c in raw
        )
        name = letters if _NAME.match(letters) else f"_{letters}"
        while name.upper() in self.labels:
            name += "_"
        return name

    def replaced(self, raw: str, name: str, *, label: bool) -> Iterator[tuple[int, Change]]:
        """The changes that put `name` for `raw`: a label's at its definition and in jumps, a constant's everywhere."""
        pattern = re.compile(rf"(?<!\w){re.escape(raw)}(?!\w)", re.IGNORECASE)
        for number, text in enumerate(self.texts, 1):
            if len(text) > LONGEST or raw[0].upper() not in text.upper():
                continue
            code = text.partition("//")[0]
            for match in pattern.finditer(code):
                defined = re.match(r"\s*:", code[match.end() :]) is not None
                if not label or defined or _JUMPED.search(code[: match.end()]) is not None:
                    yield number, (*match.span(), name)

    def label_alone(self, index: int) -> bool:
        """A name alone on its line, where jumps lead to."""
        match = _ALONE.match(self.texts[index][:LONGEST])
        if match is None or match[1].upper() not in self.targets or match[1].upper() in self.labels:
            return False
        changes = ((*match.span(2), ":"),)
        text = f"a label ends with ':': {shown(match[1])}:"
        return self.take(index, Repair("E103", *match.span(1), text, changes))

    def rest_of_comment(self, index: int) -> bool:
        """Prose below a comment: its slashes were lost where a line was broken."""
        text = self.texts[index]
        above = self.lines[index - 1] if index else None
        if above is None or above.comment is None or len(text) > LONGEST:
            return False
        tokens = tokenize(text)
        names = [token for token in tokens if token.kind == "name"]
        if (
            len(names) < 2
            or tokens[0].kind != "name"
            or tokens[0].text.upper() in (*BY_MNEMONIC, *FOREIGN_COMMANDS)
        ):
            return False
        if any(token.text in "=:" for token in tokens) or self.lacks_colon(index):
            return False
        start = tokens[0].start
        what = "this reads like the rest of the comment above: // is missing"
        changes = ((start, start, "// "),)
        return self.take(index, Repair("E101", start, tokens[-1].end, what, changes, "rest of comment"))

    def lacks_colon(self, index: int) -> bool:
        """Whether a line is a command behind a label without its colon."""
        found = next((problem for problem in self.lines[index].problems if problem.replacement), None)
        if found is None or found.code != "E103" or found.replacement is None:
            return False
        return suits(
            parser.parse_line(changed(self.texts[index], ((found.start, found.end, found.replacement),)))
        )

    def guessed(self, index: int) -> None:
        """Says what a line may have meant where that is not certain."""
        statement = self.lines[index].statement
        unknown = isinstance(statement, parser.Command) and statement.mnemonic.upper() not in BY_MNEMONIC
        found = guess(self.texts[index]) if unknown else None
        if found is not None:
            self.take(index, found)


def moved(line: parser.Line, changes: Sequence[Change]) -> parser.Line:
    """A line parsed from a changed text, with the columns of the text before the changes."""
    ordered = sorted(changes)

    def back(column: int) -> int:
        """Where what begins at a column began."""
        shift = 0
        for start, end, new in ordered:
            if column < start + shift:
                break
            if column < start + shift + len(new):
                return start
            shift += len(new) - (end - start)
        return column - shift

    def last(column: int) -> int:
        """Where what ends at a column ended."""
        shift = 0
        for start, end, new in ordered:
            if column <= start + shift:
                break
            if column <= start + shift + len(new):
                return end
            shift += len(new) - (end - start)
        return column - shift

    def token(old: Token) -> Token:
        start = back(old.start)
        return Token(old.kind, old.text, start, max(start, last(old.end)))

    def operand(old: Operand | None) -> Operand | None:
        if old is None or isinstance(old, Token):
            return old if old is None else token(old)
        steps = tuple((kind, token(where), what) for kind, where, what in old.steps)
        return Expression(back(old.start), last(old.end), steps)

    statement = line.statement
    match statement:
        case parser.Command() | parser.Data():
            operands = tuple(map(operand, statement.operands))
            start = back(statement.start)
            statement = statement._replace(
                start=start, operands=operands, end=max(start, last(statement.end))
            )
        case parser.Constant():
            statement = parser.Constant(token(statement.name), operand(statement.value))
        case parser.Include():
            statement = statement._replace(start=back(statement.start), end=last(statement.end))
        case parser.Directive() | None:
            pass
    comment = line.comment if line.comment is None else back(line.comment)
    return parser.Line(tuple(map(token, line.labels)), statement, comment, line.problems)
