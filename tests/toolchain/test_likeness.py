"""Disassemblies with the names of an older source."""

from hypothesis import given, settings
from hypothesis import strategies as st

from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.toolchain.assembler import assemble
from tmcm34x.toolchain.likeness import disassemble_like
from toolchain.generators import SOURCES

OLD = """\
// A machine.
Speed = 500                     // fast

// Turns until the input is high.
Start:  ROR   0, Speed          // off it goes
Loop:   GIO   0, 0
        JC    ZE, Loop          // not yet
        JA    Done

Done:   MST   0
        STOP
"""


def test_the_same_code_keeps_its_names_and_remarks():
    old = assemble(OLD)
    text = disassemble_like(old.program, old)
    for part in ("Speed = 500                     // fast", "// Turns until", "Start:  ROR   0, Speed  // off it goes",
                 "JC ZE, Loop  // not yet", "Done:   MST   0"):  # fmt: skip
        assert part in text
    assert assemble(text).program == old.program


def test_two_labels_of_an_instruction_and_one_at_the_end_stay():
    old = assemble("First:\nSecond: ROR 0, 1\nJC ZE, End\nJA First\nCSUB Second\nEnd:")
    text = disassemble_like(old.program, old)
    assert text.split("\n")[:2] == ["First:", "Second: ROR 0, 1"]
    assert text.rstrip().endswith("L4:")
    assert assemble(text).program == old.program


def test_an_old_source_with_mistakes_still_gives_its_names():
    old = assemble("ROR 0, 1\nFOO 5\nTurn: ROR 0, 2\nJA Turn")
    program = assemble("ROR 0, 1\nTurn: ROR 0, 2\nJA Turn").program
    assert "Turn:   ROR 0, 2" in disassemble_like(program, old)


def test_new_code_between_old_code_moves_the_targets():
    old = assemble(OLD)
    wait = Instruction(27, 0, 0, 10)
    new = (*old.program[:2], wait, Instruction(21, 0, 0, 1), Instruction(22, 0, 0, 5), *old.program[4:])
    text = disassemble_like(new, old)
    assert "WAIT TICKS, 0, 10" in text
    assert "JC ZE, Loop  // not yet" in text
    assert "JA Done" in text
    assert assemble(text).program == new


def test_nothing_in_common_is_a_plain_disassembly():
    program = (Instruction(3, 0, 1), Instruction(22, 0, 0, 0))
    assert assemble(disassemble_like(program, assemble("L0: STOP"))).program == program


@given(SOURCES, SOURCES, st.data())
@settings(max_examples=80)
def test_the_text_assembles_to_the_image_in_any_case(first, second, data):
    def include(name, _from):
        return name, "L0: STOP"

    old, new = assemble(first, include=include), assemble(second, include=include).program
    if old.ok:
        cut = data.draw(st.integers(0, len(old.program)))
        program = (*old.program[:cut], *new, *old.program[cut:])[:2048]
        assert assemble(disassemble_like(program, old)).program == program
