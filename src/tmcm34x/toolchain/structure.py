"""What programs of more than a page may use beyond the vendor's language, all of it turned into plain TMCL.

    #if MODEL == 342        lines that count for one module only, or while a constant has a value
    #else
    #endif
    #assert Speed <= 2047   an error unless it holds
    .loop:                  a label of the routine above it: Move.loop and Home.loop are two

A condition compares two expressions by == != < <= > >=, or is one expression that must not be 0; MODEL is the module
that the program is for.  A program without these lines means what it always meant, and `emit_tmcl` writes one with
them as the vendor's assembler takes it (fidelity TOOL-17).
"""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from tmcm34x.toolchain.expressions import SourceExpressionError, compile_expression, evaluate
from tmcm34x.toolchain.mending.text import Change, changed
from tmcm34x.toolchain.parser import Include, SourceLine
from tmcm34x.toolchain.tokens import Token, tokenize

if TYPE_CHECKING:
    from tmcm34x.toolchain.assembly import Assembly

MODEL: Final = "MODEL"
_COMPARISON: Final = re.compile(r"==|!=|<=|>=|<|>")
_OPERATORS: Final[Mapping[str, Callable[[float, float], bool]]] = MappingProxyType({
    "==": operator.eq, "!=": operator.ne, "<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge,
})  # fmt: skip
_LOCAL: Final = re.compile(r"(?<![\w.])\.([A-Za-z_]\w*)", re.ASCII)
_LABEL: Final = re.compile(r"\s*([A-Za-z_]\w*)\s*:(?!=)", re.ASCII)


def holds(text: str, start: int, end: int, value_of: Callable[[Token], float]) -> bool:
    """Whether the condition between two columns holds; raises `SourceExpressionError` where it is none."""
    comparison = _COMPARISON.search(text, start, end)
    if comparison is None:
        return _value(text, start, end, value_of) != 0
    left = _value(text, start, comparison.start(), value_of)
    right = _value(text, comparison.end(), end, value_of)
    return _OPERATORS[comparison.group()](left, right)


def _value(text: str, start: int, end: int, value_of: Callable[[Token], float]) -> float:
    tokens = tokenize(text, start, end)
    if not tokens:
        raise SourceExpressionError(
            "E103", max(0, start - 1), max(start, 1), "a number or name is missing in the condition"
        )
    return evaluate(compile_expression(tokens), value_of)


def local_labels(texts: Sequence[str]) -> dict[int, tuple[Change, ...]]:
    """The changes that make plain names of local labels, by line counted from 0."""
    found = {index: match for index, text in enumerate(texts) if "." in text and (match := _locals(text))}
    routine, start = "", 0
    changes: dict[int, tuple[Change, ...]] = {}
    for index, matches in found.items():
        routine = _routine(texts[start : index + 1]) or routine
        start = index + 1
        changes[index] = tuple((*match.span(), f"{routine}_{match[1]}") for match in matches)
    return changes


def _locals(text: str) -> list[re.Match[str]]:
    """The local labels that a line defines or names."""
    code = text.partition("//")[0]
    return [] if code.lstrip().startswith("#") else list(_LOCAL.finditer(code))


def _routine(texts: Sequence[str]) -> str:
    """The last label that some lines define; empty where they define none."""
    labels = (_LABEL.match(text.partition("//")[0]) for text in reversed(texts))
    return next((label[1] for label in labels if label is not None), "")


def emit_tmcl(assembly: Assembly) -> str:
    """The program as plain TMCL: one text, with the files that it includes in their places."""
    return "".join(f"{line}\n" for line in _emitted(assembly, assembly.file, {assembly.file}))


def _emitted(assembly: Assembly, file: str, seen: set[str]) -> Iterator[str]:
    texts = assembly.sources[file]
    for index, (text, line) in enumerate(zip(texts, assembly.lines[file], strict=True)):
        if index == len(texts) - 1 and not text:
            return
        if (file, index + 1) in assembly.left_out:
            continue
        included = assembly.includes.get((file, index + 1))
        if isinstance(line.statement, Include) and included is not None:
            if included not in seen:
                seen.add(included)
                yield f"// from {included}"
                yield from _emitted(assembly, included, seen)
        else:
            yield changed(text, local_changes(line, text))


def local_changes(line: SourceLine, text: str) -> tuple[Change, ...]:
    """The changes that a line's local labels need: where a name differs from what stands in its place."""
    statement = line.statement
    names = [*line.labels, *(o for o in getattr(statement, "operands", ()) if isinstance(o, Token))]
    return tuple(
        (name.start, name.end, name.text)
        for name in names
        if name.kind == "name" and text[name.start : name.end].startswith(".")
    )
