"""Instructions to source text and back."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tmcm34x.tmcl.commands import COMMANDS, PROGRAM_SIZE
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.toolchain.assembler import assemble
from tmcm34x.toolchain.disassembler import disassemble, up_to_end_mark

BYTE = st.integers(0, 255)
NUMBER = st.sampled_from([row.number for row in COMMANDS]) | BYTE
SMALL = st.integers(0, 30) | BYTE
VALUE = st.integers(0, 40) | st.integers(-(2**31), 2**31 - 1)
INSTRUCTIONS = st.builds(Instruction, NUMBER, SMALL, SMALL, VALUE)


@given(st.lists(INSTRUCTIONS, max_size=40), st.booleans())
@settings(max_examples=150)
def test_what_was_disassembled_assembles_to_the_same_image(program, explain):
    assembly = assemble(disassemble(program, explain=explain))
    assert assembly.diagnostics == ()
    assert assembly.program == tuple(program)


def test_a_full_memory_of_rubbish_comes_back():
    program = tuple(Instruction(n % 256, n // 8, n * 7 % 256, n * 7919) for n in range(PROGRAM_SIZE))
    assert assemble(disassemble(program)).program == program


def test_jump_targets_get_labels_and_parameters_their_names():
    program = assemble(
        "Go: SAP 4, 0, 100\nMVP COORD, $81, 3\nCSUB Sub\nJC ETO, Go\nJA End\nSub: RSUB\nEnd:"
    ).program
    assert disassemble(program).splitlines() == [
        "L0:     SAP 4, 0, 100               // maximum positioning speed",
        "        MVP COORD, $81, 3",
        "        CSUB Sub5",
        "        JC ETO, L0",
        "        JA L6",
        "Sub5:   RSUB",
        "L6:",
    ]


@pytest.mark.parametrize(
    ("instruction", "line"),
    [
        (Instruction(37, 1, 2, 300), "//! DATA 37, 1, 2, 300"),
        (Instruction(0), "//! DATA 0, 0, 0, 0"),
        (Instruction(21, 99, 0, 5), "//! DATA 21, 99, 0, 5"),
        (Instruction(138, 0, 0, 7), "//! DATA 138, 0, 0, 7"),
        (Instruction(22, 0, 0, 5000), "JA 5000"),
        (Instruction(22, 0, 3, 5000), "JA 5000, 0, 3"),
        (Instruction(6, 1, 2, 9), "GAP 1, 2, 9"),
    ],
)
def test_what_has_no_source_form_becomes_a_data_line(instruction, line):
    assert disassemble([instruction], explain=False).strip() == line


def test_an_upload_ends_at_the_first_opcode_0():
    program = (Instruction(28), Instruction(0), Instruction(28))
    assert up_to_end_mark(program) == program[:1]
    assert up_to_end_mark(program[:1]) == program[:1]
