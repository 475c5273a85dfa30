"""Mistakes that go through a file: names that cannot be names, comments over several lines, habits.

`mend` takes the lines of a file that are no sound ones and gives them back as they were meant, with one mistake
each to report.  What follows a comment without slashes, or a number at the start of each line, is one mistake.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from typing import Final, NamedTuple

from tmcm34x.tmcl.commands import BY_MNEMONIC, SISTER_COMMANDS
from tmcm34x.toolchain import parser
from tmcm34x.toolchain.diagnostics import shown
from tmcm34x.toolchain.mending import words
from tmcm34x.toolchain.mending.columns import moved
from tmcm34x.toolchain.mending.lines import guess, repair
from tmcm34x.toolchain.mending.soundness import sound, suits
from tmcm34x.toolchain.mending.text import LONGEST, Change, Repair, changed
from tmcm34x.toolchain.tokens import BLANKS, Token, tokenize

_MOST: Final = 300
"""Lines of one file that are looked at; a file with more wrong ones is no TMCL."""
_NAME: Final = re.compile(r"[A-Za-z_]\w*\Z", re.ASCII)
_DEFINED: Final = re.compile(r"[\s\ufeff]*([^\s\ufeff:=,()/\"#$%][^:=,()\"/]*?)\s*(:(?!=)|=(?!=))")
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


def mend(texts: Sequence[str], lines: list[parser.SourceLine]) -> list[Mistake]:
    """Puts into `lines` what the wrong ones were meant to be; returns the mistakes."""
    wrong = [
        index
        for index, (_, statement, _, problems) in enumerate(lines)
        if problems or (statement is not None and _is_unknown(statement))
    ]
    return _File(texts, lines).mend(wrong[:_MOST]) if wrong else []


def _is_unknown(statement: parser.Statement | None) -> bool:
    """Whether a statement is a command that does not exist."""
    return type(statement) is parser.WrittenCommand and statement.mnemonic.upper() not in BY_MNEMONIC


class _File:
    def __init__(self, texts: Sequence[str], lines: list[parser.SourceLine]) -> None:
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
                self.doubted(index)
        for kind, found in self.habits.items():
            self.habit(kind, found)
        return self.mistakes

    def line(self, index: int) -> bool:
        found = repair(self.texts[index], self.labels)
        return found is not None and self.take(index, found)

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
        """Reports once what was found on several lines."""
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
            text = "a comment begins with // and ends with its line; TMCL has no /* */"
            self.mistakes.append(Mistake(first + 1, "E101", start, start + 2, text, changes))
            taken |= {number for number in range(first, last + 1) if self.believe(number, changes)}
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
            if match is not None and index not in taken and self.breaks(index, match):
                taken |= self.renamed(index, match)
        return taken

    def renamed(self, index: int, match: re.Match[str]) -> set[int]:
        """Mends the name that is defined on a line; returns the lines that are sound now."""
        raw, label = match[1], match[2] == ":"
        name = self.mended_name(raw)
        changes = tuple(self.replaced(raw, name, label=label))
        what = "label" if label else "constant"
        text = f"{shown(raw)} is no name for a {what}: letters, digits and _; did you mean {name}?"
        self.mistakes.append(Mistake(index + 1, "E103", *match.span(1), text, changes))
        return {
            n for n in {number - 1 for number, _ in changes} if self.believe(n, changes, always=n == index)
        }

    def believe(self, index: int, changes: Sequence[tuple[int, Change]], *, always: bool = True) -> bool:
        """Takes a line with those of the changes that are its own, if it is sound with them."""
        done = tuple(change for number, change in changes if number == index + 1)
        line = moved(parser.parse_line(changed(self.texts[index], done)), done)
        if always or sound(line):
            self.lines[index] = line
        return always or sound(line)

    def breaks(self, index: int, match: re.Match[str]) -> bool:
        """Whether a definition has a name that is none, and nothing else is wrong with its line."""
        raw, text = match[1], self.texts[index]
        if _NAME.match(raw.removeprefix(".")) or not _LETTER.search(raw):
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
        if not _is_prose(tokens) or self.lacks_colon(index):
            return False
        start = tokens[0].start
        what = "this reads like the rest of the comment above: // is missing"
        changes = ((start, start, "// "),)
        return self.take(index, Repair("E101", start, tokens[-1].end, what, changes, "rest of comment"))

    def lacks_colon(self, index: int) -> bool:
        """Whether a line is a command after a label without its colon."""
        line = self.with_colon(index)
        return line is not None and suits(line)

    def with_colon(self, index: int) -> parser.SourceLine | None:
        """A line with the colon that it may lack after its label; None where it is complete."""
        found = next((problem for problem in self.lines[index].problems if problem.replacement), None)
        if found is None or found.code != "E103" or found.replacement is None:
            return None
        return parser.parse_line(changed(self.texts[index], ((found.start, found.end, found.replacement),)))

    def doubted(self, index: int) -> None:
        """Offers no colon where the line is not sound with it."""
        line, mended = self.lines[index], self.with_colon(index)
        if mended is not None and not sound(mended):
            problems = tuple(problem._replace(replacement=None) for problem in line.problems)
            self.lines[index] = line._replace(problems=problems)

    def guessed(self, index: int) -> None:
        """Reports what a line may have meant where that is not certain."""
        found = guess(self.texts[index]) if _is_unknown(self.lines[index].statement) else None
        if found is not None:
            self.take(index, found)


def _is_prose(tokens: Sequence[Token]) -> bool:
    """Whether a line reads like words of a sentence: several names, the first of which is no command."""
    if sum(token.kind == "name" for token in tokens) < 2 or any(token.text in "=:" for token in tokens):
        return False
    return tokens[0].kind == "name" and tokens[0].text.upper() not in (*BY_MNEMONIC, *SISTER_COMMANDS)
