"""Fixes that put commands into a program or take them out; none where an address is written as a number."""

from __future__ import annotations

from collections.abc import Iterable

from tmcm34x.toolchain.assembler import Code, Symbol
from tmcm34x.toolchain.diagnostics import Edit, Fix, shown
from tmcm34x.toolchain.linter.findings import Findings, name_of
from tmcm34x.toolchain.parser import ConstantDefinition
from tmcm34x.toolchain.tokens import BLANKS


def insertion(found: Findings, codes: Iterable[Code], command: str) -> tuple[Fix, ...]:
    """The fix that puts a command before others, after the labels of their lines."""
    if not found.addresses_are_labels:
        return ()
    edits = (Edit(c.location._replace(end=c.location.column), f"{command}\n        ") for c in codes)
    return (Fix(f"Insert {command}", tuple(edits)),)


def removal(found: Findings, code: Code) -> tuple[Fix, ...]:
    """The fix that takes a command away and leaves the labels and the comment of its line."""
    if not found.addresses_are_labels:
        return ()
    return (Fix(f"Remove {name_of(code)}", (Edit(code.location, ""),)),)


def forgetting(found: Findings, symbol: Symbol) -> tuple[Fix, ...]:
    """The fix that takes the definition of a name away; none while an error may hide where the name is used."""
    if not found.assembly.ok:
        return ()
    place = symbol.definition
    text = found.assembly.sources[place.file][place.line - 1]
    line = found.assembly.lines[place.file][place.line - 1]
    end = len(text) if line.comment is None else line.comment
    if not isinstance(line.statement, ConstantDefinition):
        end = text.index(":", place.end - 1) + 1
    while text[end : end + 1] and text[end] in BLANKS:
        end += 1
    return (Fix(f"Remove {shown(symbol.name)}", (Edit(place._replace(end=end + 1), ""),)),)
