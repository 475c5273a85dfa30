"""Source text in columns: labels, mnemonics, operands, comments.

What it changes: blanks, and mnemonics, words and functions to upper case.  What it keeps: every comment, blank
line, number and name as written, the order of lines, and lines that it does not understand.  Formatting twice
is formatting once, and the program stays the same.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Final

from tmcm34x.tmcl.commands import BY_MNEMONIC
from tmcm34x.toolchain.expressions import Operand
from tmcm34x.toolchain.mending.columns import moved
from tmcm34x.toolchain.mending.text import changed
from tmcm34x.toolchain.parser import (
    ConstantDefinition,
    Data,
    Directive,
    Include,
    SourceLine,
    WrittenCommand,
    parse_line,
)
from tmcm34x.toolchain.structure import local_labels
from tmcm34x.toolchain.tokens import BLANKS, Token, split_lines, tokenize

_MNEMONIC_COLUMN: Final = (8, 24)
"""Least and greatest width of the label column."""
_MNEMONIC_WIDTH: Final = 6
_COMMENT_COLUMN: Final = (32, 64)
"""Least and greatest column of comments after a command; longer lines have theirs after two spaces."""
_SPACED: Final = frozenset("+-*/")
_LINE_END: Final = re.compile("\r\n|\r|\n")
_LEXICAL: Final = frozenset({"E101", "E102"})


def format_source(text: str) -> str:
    """`text` in columns; each line keeps its end, and the last one gets one like the first.

    A CR before an empty line that ends with LF becomes LF: side by side both would end the same line.
    """
    if not text:
        return text
    ends = _LINE_END.findall(text)
    lines = _Formatter(split_lines(text)).run()
    ends += [ends[0] if ends else "\n"] * (len(lines) - len(ends))
    for n, line in enumerate(lines):
        if n and not line and (ends[n - 1], ends[n]) == ("\r", "\n"):
            ends[n - 1] = "\n"
    return "".join(line + end for line, end in zip(lines, ends, strict=False))


def lexical_mistake(text: str) -> int | None:
    """The first line, counted from 1, with a character or word that the language does not have."""
    for number, line in enumerate(_parsed(split_lines(text)), 1):
        if any(problem.code in _LEXICAL for problem in line.problems):
            return number
    return None


def _parsed(texts: Sequence[str]) -> list[SourceLine]:
    lines = [parse_line(text) for text in texts]
    for index, changes in local_labels(texts).items():
        lines[index] = moved(parse_line(changed(texts[index], changes)), changes)
    return lines


def format_expression(text: str) -> str:
    """The expression or word `text` with its blanks in the usual places and its functions in upper case."""
    tokens = tokenize(text)
    parts: list[str] = []
    previous: Token | None = None
    for index, token in enumerate(tokens):
        is_function = token.kind == "name" and index + 1 < len(tokens) and tokens[index + 1].text == "("
        operand_before = previous is not None and (previous.kind != "operator" or previous.text == ")")
        if token.text in _SPACED and operand_before:
            parts.append(f" {token.text} ")
        else:
            parts.append(token.text.upper() if is_function else token.text)
        previous = token
    return "".join(parts)


class _Formatter:
    def __init__(self, texts: list[str]) -> None:
        if len(texts) > 1 and not texts[-1]:
            texts = texts[:-1]
        self.texts = texts
        self.lines = _parsed(texts)
        self.mnemonic_column = self.label_width()
        self.equals = self.constant_columns()

    def run(self) -> list[str]:
        codes = [self.code(index) for index in range(len(self.lines))]
        column = self.comment_column(codes)
        out: list[str] = []
        beside = False
        for code, line, text in zip(codes, self.lines, self.texts, strict=True):
            comment = "" if line.comment is None else text[line.comment :].rstrip(BLANKS)
            if code is None:
                out.append(text.rstrip(BLANKS))
            elif code or not comment:
                out.append(f"{code}{' ' * max(2, column - len(code))}{comment}" if comment else code)
            else:
                # A comment that goes on below another one stays below it.
                indent = line.comment or 0
                beside = beside and indent > self.mnemonic_column
                out.append(" " * (indent and (column if beside else self.mnemonic_column)) + comment)
                continue
            beside = bool(code and comment)
        return out

    def comment_column(self, codes: Sequence[str | None]) -> int:
        """Where comments after commands begin."""
        low, high = _COMMENT_COLUMN
        commented = (
            code for code, line in zip(codes, self.lines, strict=True) if code and line.comment is not None
        )
        return max([low, *(len(code) + 2 for code in commented if len(code) + 2 <= high)])

    def label_width(self) -> int:
        low, high = _MNEMONIC_COLUMN
        widths = [
            len(_labels(text, line)) + 1
            for text, line in zip(self.texts, self.lines, strict=True)
            if line.labels and isinstance(line.statement, WrittenCommand | Data)
        ]
        return max(low, *(width for width in widths if width <= high), low)

    def constant_columns(self) -> dict[int, int]:
        """The column of the equals sign, by line: the same for constants on lines that follow each other."""
        columns: dict[int, int] = {}
        block: list[int] = []
        for index, line in enumerate([*self.lines, None]):
            statement = line.statement if line is not None else None
            if isinstance(statement, ConstantDefinition):
                block.append(index)
                continue
            width = max((len(self.lines[n].statement.name.text) for n in block), default=0)  # type: ignore[union-attr]
            columns.update(dict.fromkeys(block, width))
            block.clear()
        return columns

    def code(self, index: int) -> str | None:
        """The line without its comment; None where it must stay as it is."""
        line, text = self.lines[index], self.texts[index]
        statement = line.statement
        if line.problems or (
            isinstance(statement, WrittenCommand) and statement.mnemonic.upper() not in BY_MNEMONIC
        ):
            return None
        labels = _labels(text, line)
        match statement:
            case None:
                return labels
            case Directive():
                return text[: len(text) if line.comment is None else line.comment].strip(BLANKS)
            case Include():
                return f"#include {text[statement.start : statement.end]}"
            case ConstantDefinition():
                name = f"{statement.name.text:<{self.equals[index]}} = {_text(text, statement.value)}"
                return f"{labels} {name}" if labels else name
            case WrittenCommand():
                body = _command(text, statement)
            case Data():
                body = f"//! DATA {', '.join(_text(text, operand) for operand in statement.operands)}"
        return f"{labels:<{self.mnemonic_column - 1}} {body}"


def _labels(text: str, line: SourceLine) -> str:
    return " ".join(f"{text[label.start : label.end]}:" for label in line.labels)


def _command(text: str, command: WrittenCommand) -> str:
    row = BY_MNEMONIC[command.mnemonic.upper()]
    words = [dict(operand.words) for operand in row.operands]
    texts = [
        _word(_text(text, operand), words[index] if index < len(words) else {})
        for index, operand in enumerate(command.operands)
    ]
    return f"{row.mnemonic:<{_MNEMONIC_WIDTH}}{', '.join(texts)}".rstrip()


def _word(text: str, words: Mapping[str, int]) -> str:
    """A word in upper case; a name that is none of the words stays as written."""
    upper = text.upper()
    return upper if upper in words else text


def _text(text: str, operand: Operand | None) -> str:
    return "" if operand is None else format_expression(text[operand.start : operand.end])
