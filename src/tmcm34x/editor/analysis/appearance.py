"""How a file looks in an editor: the type of each word, the lines that fold."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Final, Literal, NamedTuple

from tmcm34x.editor.analysis.names import outline
from tmcm34x.editor.analysis.program import Analysis
from tmcm34x.tmcl.commands import BY_MNEMONIC
from tmcm34x.toolchain import parser
from tmcm34x.toolchain.expressions import FUNCTIONS
from tmcm34x.toolchain.tokens import BLANKS, Token, tokenize

TokenType = Literal[
    "keyword",
    "enumMember",
    "variable",
    "function",
    "number",
    "operator",
    "comment",
    "macro",
    "method",
    "string",
]
TOKEN_TYPES: Final[tuple[TokenType, ...]] = (
    "keyword", "enumMember", "variable", "function", "number", "operator", "comment", "macro", "method", "string",
)  # fmt: skip
"""How the words of a source are coloured: commands, words, constants, labels, numbers, operators, comments,
directives, functions, file names."""


class Fold(NamedTuple):
    """Lines that may be folded into the first."""

    first: int
    last: int
    kind: Literal["comment", "imports", "region"]


class Coloured(NamedTuple):
    """A word with its type."""

    line: int
    start: int
    length: int
    type: TokenType
    definition: bool


def folds(program: Analysis, file: str) -> list[Fold]:
    """Blocks of comments, includes and constants, `// #region` to `// #endregion`, the code of each label."""
    folds = list(_regions(program.assembly.sources[file]))
    lines = program.assembly.lines[file]
    start, kind = 0, ""
    for number in range(len(lines) + 1):
        here = _fold_kind(lines[number]) if number < len(lines) else ""
        if here != kind:
            if kind and number - start > 1:
                folds.append(Fold(start, number - 1, kind))  # type: ignore[arg-type]
            start, kind = number, here
    for entry in outline(program, file):
        first = entry.symbol.definition.line
        if entry.symbol.kind == "label" and entry.last_line > first:
            folds.append(Fold(first - 1, entry.last_line - 1, "region"))
    return sorted(folds)


def colours(program: Analysis, file: str, first_line: int = 0, last_line: int = 2**31) -> Iterator[Coloured]:
    """The words of some lines with their types, in order."""
    texts = program.assembly.sources[file]
    for number in range(max(0, first_line), min(last_line, len(texts) - 1) + 1):
        yield from _line_colours(program, number, texts[number], program.assembly.lines[file][number])


def _line_colours(program: Analysis, number: int, text: str, line: parser.SourceLine) -> Iterator[Coloured]:
    statement = line.statement
    included = isinstance(statement, parser.Include)
    if isinstance(statement, parser.Include):
        word = text[: statement.start].strip(BLANKS)
        yield Coloured(number, text.index(word), len(word), "macro", definition=False)
        yield Coloured(number, statement.start, statement.end - statement.start, "string", definition=False)
    defined = _defined(line)
    for token in tokenize(text):
        type_ = None if included and token.kind != "comment" else _type(program, statement, token)
        if type_ is not None:
            yield Coloured(number, token.start, len(token.text), type_, definition=token.start in defined)


def _defined(line: parser.SourceLine) -> set[int]:
    """The columns of the names that a line defines."""
    names = list(line.labels)
    if isinstance(line.statement, parser.ConstantDefinition):
        names.append(line.statement.name)
    return {name.start for name in names}


def _type(program: Analysis, statement: parser.Statement | None, token: Token) -> TokenType | None:
    match token.kind:
        case "comment":
            return "macro" if isinstance(statement, parser.Data) else "comment"
        case "name":
            return _name_type(program, statement, token)
        case "number":
            return "number"
        case "operator" if token.text not in ",:":
            return "operator"
        case _:
            return None


def _name_type(program: Analysis, statement: parser.Statement | None, token: Token) -> TokenType:
    if isinstance(statement, parser.WrittenCommand):
        if token.start == statement.start:
            return "keyword"
        if token.start in _word(statement):
            return "enumMember"
    symbol = program.assembly.symbols.get(token.text.upper())
    if symbol is None and token.text.upper() in FUNCTIONS:
        return "method"
    return "function" if symbol is not None and symbol.kind == "label" else "variable"


def _word(statement: parser.WrittenCommand) -> range:
    """The columns of the first operand where the command takes one of its words there."""
    row = BY_MNEMONIC.get(statement.mnemonic.upper())
    first = statement.operands[0] if statement.operands else None
    takes = row is not None and row.operands and row.operands[0].kind == "word"
    return range(first.start, first.end) if takes and first is not None else range(0)


_REGION: Final = re.compile(r"\s*//\s*#?(end)?region\b")
"""A comment that begins or ends a region, as in other languages."""


def _regions(texts: Sequence[str]) -> Iterator[Fold]:
    begun: list[int] = []
    for number, text in enumerate(texts):
        mark = _REGION.match(text)
        if mark is not None and mark[1] is None:
            begun.append(number)
        elif mark is not None and begun:
            yield Fold(begun.pop(), number, "region")


def _fold_kind(line: parser.SourceLine) -> str:
    if isinstance(line.statement, parser.Include):
        return "imports"
    if isinstance(line.statement, parser.ConstantDefinition):
        return "region"
    return "comment" if line.comment is not None and line.statement is None and not line.labels else ""
