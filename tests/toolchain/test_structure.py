"""Conditions, assertions and local labels, and the plain TMCL that they become."""

import pytest
from hypothesis import given, settings

from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.toolchain.assembler import assemble
from tmcm34x.toolchain.formatter import format_source, lexical_mistake
from tmcm34x.toolchain.linter import lint
from tmcm34x.toolchain.structure import emit_tmcl
from toolchain.generators import SOURCES

PROGRAM = """\
#include names.inc
Speed = 500 * Factor            // of all motors
#if MODEL == 342
        SAP   140, 0, 3
#else
        SAP   6, 0, 100
#if Speed > 1000
        oops; this never counts
#endif
#endif
#assert Speed <= 2047
Move:   ROR   0, Speed
.loop:  GIO   0, 0
        JC    ZE, .loop
        RSUB
Home:   ROL   0, Speed
.loop:  GIO   1, 0
        JC    ZE, .loop         // Move.loop is another one
        JA    Move_loop
        STOP
"""


def include(name, _from):
    return name, "Factor = 2\n"


def build(text, **options):
    return assemble(text, "x.tmc", include, **options)


def values(text, **options):
    assembly = build(text, **options)
    assert assembly.ok, assembly.diagnostics
    return [instruction.value for instruction in assembly.program]


def test_conditions_choose_lines_by_the_model():
    assert build(PROGRAM, model=342).program[0] == Instruction(5, 140, 0, 3)
    assert build(PROGRAM, model=343).program[0] == Instruction(5, 6, 0, 100)


def test_local_labels_belong_to_the_label_above():
    program = build(PROGRAM)
    assert program.labels == {"Move": 1, "Move_loop": 2, "Home": 5, "Home_loop": 6}
    assert [program.program[n].value for n in (3, 7, 8)] == [2, 6, 2]
    use = program.symbols["HOME_LOOP"].references[0]
    assert (use.line, use.column, use.end) == (18, 19, 24)


@pytest.mark.parametrize(
    ("condition", "holds"),
    [("1", True), ("0", False), ("2 + 2 == 4", True), ("K != 5", False), ("K <= 5", True), ("K < 5", False),
     ("K >= 5", True), ("K > 4.5", True), ("MODEL == 343", True), ("model != 343", False)],
)  # fmt: skip
def test_conditions_compare_expressions(condition, holds):
    assert values(f"K = 5\n#if {condition} // why\nCOMP 1\n#else\nCOMP 0\n#endif") == [int(holds)]
    assert [d.code for d in build(f"K = 5\n#assert {condition}").diagnostics] == ([] if holds else ["E402"])


@pytest.mark.parametrize(
    ("text", "code", "line"),
    [
        ("#if 1\nSTOP", "E103", 1),
        ("STOP\n#endif", "E103", 2),
        ("#else\nSTOP", "E103", 1),
        ("#if\n#endif", "E103", 1),
        ("#if 1 ==\n#endif", "E103", 1),
        ("#if Nothing == 1\n#endif", "E303", 1),
        ("#if 1/0\n#endif", "E401", 1),
        ("#if 1 = 1\n#endif", "E103", 1),
        ("K = 3000\n#assert K <= 2047", "E402", 2),
        ("#elif 1", "E103", 1),
    ],
)
def test_mistakes_in_directives_are_told_with_their_line(text, code, line):
    (found,) = build(text).diagnostics
    assert (found.code, found.location.line) == (code, line)


def test_what_is_left_out_is_not_judged():
    assert (
        build("#if 0\nfoo 1\nL: JA Nowhere\n#include missing.inc\n#assert 0\n#endif\nL: STOP").diagnostics
        == ()
    )
    assert lint(build("#if MODEL == 342\nROR 9, 1\n#endif\nSTOP")) == ()


def test_the_plain_program_is_the_same_and_needs_nothing_of_it():
    for model in (342, 343):
        assembly = build(PROGRAM, model=model)
        plain = emit_tmcl(assembly)
        assert "#" not in plain
        assert " ." not in plain
        again = assemble(plain)
        assert again.program == assembly.program
        assert again.left_out == set()


def test_mistakes_beside_local_labels_have_their_own_places():
    (found,) = build("Move:   ROR 0, 5\n.wait:  JC ZE, .wait 5\n        JA .wait").diagnostics
    assert (found.code, *found.location[1:]) == ("E103", 2, 22, 23)


def test_a_label_with_local_labels_is_used():
    found = lint(build("JA Move\nHome: ROL 0, 5\n.wait: JA .wait\nMove: ROR 0, 5\n.wait: JA .wait"))
    assert [item.code for item in found if item.code == "W401"] == []
    found = lint(build("Home: ROL 0, 5\nHome_wait: JA Home_wait"))
    assert [item.text for item in found if item.code == "W401"] == ["label Home is never used"]


def test_structured_sources_are_formatted():
    assert lexical_mistake(PROGRAM) == 8
    text = "Go: stop\n.again: wait ticks,0,1\n  #if  MODEL == 342 // one\nja .again\n#endif\n"
    assert lexical_mistake(text) is None
    assert format_source(text) == (
        "Go:     STOP\n.again: WAIT  TICKS, 0, 1\n#if  MODEL == 342               // one\n"
        "        JA    .again\n#endif\n"
    )


@given(SOURCES)
@settings(max_examples=80)
def test_a_plain_program_stays_what_it_is(text):
    assembly = assemble(text, include=lambda name, _from: (name, "L0: STOP"))
    assert not assembly.left_out
    if assembly.ok:
        assert assemble(emit_tmcl(assembly)).program == assembly.program
