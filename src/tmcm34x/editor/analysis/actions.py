"""The changes that an editor offers: fixes, rules ignored on a line, the layout of a file."""

from __future__ import annotations

from typing import NamedTuple

from tmcm34x.editor.analysis.program import Analysis
from tmcm34x.toolchain.diagnostics import Diagnostic, Edit, Fix, Location
from tmcm34x.toolchain.formatter import format_source
from tmcm34x.toolchain.linter import RULES, ignored_codes


class CodeAction(NamedTuple):
    """A change that the editor may offer for a diagnostic."""

    title: str
    diagnostic: Diagnostic
    edits: tuple[Edit, ...]
    preferred: bool


def actions(program: Analysis, file: str, first_line: int, last_line: int) -> list[CodeAction]:
    """The changes to offer for the findings on some lines."""
    actions: list[CodeAction] = []
    for item in program.findings:
        if item.location.file != file or not first_line <= item.location.line - 1 <= last_line:
            continue
        actions += [
            CodeAction(fix.title, item, fix.edits, preferred=n == 0) for n, fix in enumerate(item.fixes)
        ]
        if item.code in RULES:
            ignore = _ignore(program, item)
            actions.append(CodeAction(ignore.title, item, ignore.edits, preferred=False))
    return actions


def _ignore(program: Analysis, item: Diagnostic) -> Fix:
    """The comment that suppresses a rule on its line."""
    place = item.location
    text = program.text(place.file, place.line - 1)
    end = len(text) + 1
    comment = program.assembly.lines[place.file][place.line - 1].comment
    codes = ignored_codes(text[comment:]) if comment is not None else frozenset[str]()
    addition = f", {item.code}" if codes and text.rstrip().upper().endswith(tuple(codes)) else ""
    if not addition:
        addition = f" // lint: ignore {item.code}" if comment is None else f" lint: ignore {item.code}"
    return Fix(
        f"Ignore {item.code} on this line", (Edit(Location(place.file, place.line, end, end), addition),)
    )


def format_edits(program: Analysis, file: str) -> tuple[Edit, ...]:
    """The edits that put a file into columns, line by line."""
    texts = program.assembly.sources[file]
    formatted = format_source("\n".join(texts)).split("\n")
    edits = [
        Edit(Location(file, number, 1, len(old) + 1), new)
        for number, (old, new) in enumerate(zip(texts, formatted, strict=False), 1)
        if old != new
    ]
    if len(formatted) > len(texts):
        end = len(texts[-1]) + 1
        last = Location(file, len(texts), end, end)
        edits.append(Edit(last, "\n"))
    return tuple(edits)
