"""Programs with several mistakes at once: places, fixes and names that hold whatever stands around them."""

import random
import re
from itertools import pairwise
from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st

from tmcm34x.editor.analysis import actions, appearance, completions, hovers, names, values
from tmcm34x.editor.analysis.program import Analysis, TextPosition
from tmcm34x.toolchain.assembler import assemble
from tmcm34x.toolchain.disassembler import disassemble
from tmcm34x.toolchain.formatter import format_source
from tmcm34x.toolchain.likeness import disassemble_like
from tmcm34x.toolchain.linter import RULES, lint
from tmcm34x.toolchain.map import program_map
from tmcm34x.toolchain.structure import emit_tmcl

STRUCTURED = """\
#include TMCLParam.tmc
Speed = 1200
#assert Speed <= 2047
#if MODEL == 342
        SAP   140, 0, 4
#else
        SAP   APMaxCurrent, 0, 100
#endif
Move:   ROR   Motor0, Speed
.wait:  WAIT  TICKS, 0, 10
        GIO   0, 0
        JC    ZE, .wait
        RSUB
Home:   ROL   0, 5              // tmcl: entry
.wait:  JA    .wait
        CSUB  Move              // lint: ignore W101
"""
EXAMPLES = sorted((Path(__file__).parents[2] / "examples").rglob("*.tmc"))
PROGRAMS = (STRUCTURED, *(path.read_text(encoding="utf-8") for path in EXAMPLES))
TYPED = (
    ",", ":", "=", ".", "#", ";", "'", "--", "/", "//", "/*", "*/", "(", ")", " ", "\t", "0", "O", "1Fh", "0x1F",
    "500ms", "-", "\u2013", "\uff0c", "\u201c", "\ufeff", "\u2028", "\x1a", "\xe9", "\n", ".wait: ", "#endif\n",
    "//! DATA 1, 2, 3, 4\n", "// lint: off W101\n", "include x\n",
)  # fmt: skip


def mutated(text, chance: random.Random):
    """`text` with letters, words and lines lost, doubled, exchanged and added."""
    for _ in range(chance.choice((1, 1, 2, 3, 6))):
        parts = re.findall(chance.choice((r"(?s).", r"\w+|\W", r"[^\n]*\n?")), text)
        place, other = chance.randrange(len(parts)), chance.randrange(len(parts))
        match chance.randrange(4):
            case 0:
                del parts[place]
            case 1:
                parts.insert(place, parts[other])
            case 2:
                parts[place], parts[other] = parts[other], parts[place]
            case _:
                parts.insert(place, chance.choice(TYPED))
        text = "".join(parts) or "\n"
    return text


MUTANTS = st.builds(mutated, st.sampled_from(PROGRAMS), st.randoms(use_true_random=False))


def judged(text):
    assembly = assemble(text, "main.tmc")
    return assembly, (*assembly.diagnostics, *lint(assembly, rules=frozenset(RULES)))


def edited(lines, edits):
    """The text with edits made, from the last one to the first."""
    lines = list(lines)
    for place, new in sorted(edits, reverse=True):
        line = lines[place.line - 1]
        lines[place.line - 1] = line[: place.column - 1] + new + line[place.end - 1 :]
    return "\n".join(lines)


def lies_within(place, lines):
    """Whether a location is a stretch of one of the lines, their ends included."""
    return 1 <= place.line <= len(lines) and 1 <= place.column <= place.end <= len(lines[place.line - 1]) + 2


def errors(found):
    return sum(item.severity == "error" for item in found)


@given(MUTANTS)
@settings(max_examples=150)
def test_every_diagnostic_and_every_edit_lies_within_a_line(text):
    assembly, found = judged(text)
    for item in found:
        assert lies_within(item.location, assembly.sources[item.location.file]), item
        for fix in item.fixes:
            places = sorted(edit.location for edit in fix.edits)
            assert all(lies_within(place, assembly.sources[place.file]) for place in places), item
            for one, next_one in pairwise(places):
                assert one[:2] != next_one[:2] or one.end <= next_one.column, item


@given(MUTANTS)
@settings(max_examples=150)
def test_a_fix_removes_its_diagnostic_and_leaves_other_lines_alone(text):
    assembly, found = judged(text)
    lines = assembly.sources["main.tmc"]
    for item in found:
        for fix in item.fixes:
            if any(edit.location.file != "main.tmc" for edit in fix.edits):
                continue
            fixed = edited(lines, fix.edits)
            again, left = judged(fixed)
            same = (item.code, item.text, *item.location[:3])
            assert same not in [(i.code, i.text, *i.location[:3]) for i in left], item
            touched = {edit.location.line for edit in fix.edits}
            if not any("\n" in edit.text for edit in fix.edits):
                pairs = zip(lines, again.sources["main.tmc"], strict=True)
                assert all(old == new for n, (old, new) in enumerate(pairs, 1) if n not in touched)
            if item.severity != "error":
                assert errors(left) <= errors(found), item


@given(MUTANTS)
@settings(max_examples=80)
def test_a_program_comes_back_from_each_of_its_forms(text):
    assembly, _ = judged(text)
    formatted = format_source(text)
    assert format_source(formatted) == formatted
    if assembly.ok:
        program = assembly.program
        assert assemble(disassemble(program)).program == program
        assert assemble(disassemble_like(program, assembly)).program == program
        assert assemble(emit_tmcl(assembly)).program == program
        assert program_map(assembly)


@given(MUTANTS, st.randoms(use_true_random=False))
@settings(max_examples=80)
def test_an_editor_may_ask_anything_anywhere(text, chance: random.Random):
    assembly, found = judged(text)
    program, lines = Analysis(assembly, found), assembly.sources["main.tmc"]
    for word in appearance.colours(program, "main.tmc"):
        assert 0 <= word.start < word.start + word.length <= len(lines[word.line])
    appearance.folds(program, "main.tmc")
    names.outline(program, "main.tmc")
    values.hints(program, "main.tmc", 0, 2**31)
    actions.actions(program, "main.tmc", 0, len(lines))
    actions.format_edits(program, "main.tmc")
    for _ in range(5):
        line = chance.randrange(len(lines))
        place = TextPosition("main.tmc", line, chance.randrange(len(lines[line]) + 1))
        hovers.hover(program, place)
        completions.completions(program, place)
        completions.signature(program, place)
        names.references(program, place)
        definition = names.definition(program, place)
        assert definition is None or definition.file == "main.tmc"
        renames(program, place)


def renames(program, place):
    """A rename at a place is refused, or leaves the program as it is."""
    try:
        edits = names.rename(program, place, "Quite_new")
    except ValueError:
        return
    assembly = program.assembly
    renamed = assemble(edited(assembly.sources["main.tmc"], edits), "main.tmc")
    if assembly.ok:
        assert renamed.program == assembly.program
