"""Source text to instructions and diagnostics."""

import pytest

from tmcm34x.tmcl.commands import BY_MNEMONIC, PROGRAM_SIZE, SISTER_COMMANDS
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.toolchain.assembler import INCLUDE_DEPTH, assemble
from tmcm34x.toolchain.diagnostics import Location, render
from tmcm34x.toolchain.linter import lint
from tmcm34x.toolchain.listing import listing


def test_a_constant_without_a_value_is_reported_where_it_is_defined_alone():
    text = "A = 5 °\nB = A + 1\n#if A == 5\nROR 0, A\n#endif\n#assert B == 6\nWAIT RFS, A * INT(B), 0\nJA A\nSTOP"
    assembly = assemble(text)
    assert [(item.code, item.location.line) for item in assembly.diagnostics] == [("E101", 1)]
    assert [item.code for item in lint(assembly)] == []


MENDED = [
    ("SAP 4, 0, /* top */ 5\nSTOP", "E101", 11, "SAP 4, 0,  5\nSTOP"),
    ("/* one\ntwo\nthree */\nSTOP", "E101", 1, "// one\n// two\n// three \nSTOP"),
    ("STOP\n/* never closed", "E101", 1, "STOP\n// never closed"),
    ("JA Loop\nLoop\nSTOP", "E103", 1, "JA Loop\nLoop:\nSTOP"),
    ("JA Loop\nLoop;\nSTOP", "E103", 1, "JA Loop\nLoop:\nSTOP"),
    ("RSAP 4; 0\nSTOP", "E103", 7, "RSAP 4, 0\nSTOP"),
    ("STOP ;;; note", "E101", 6, "STOP // note"),
    ("// a remark\nthat goes on here\nSTOP", "E101", 1, "// a remark\n// that goes on here\nSTOP"),
    ("A-1: MST 0\nA_1: JA A-1\nJA A_1", "E103", 1, "A_1_: MST 0\nA_1: JA A_1_\nJA A_1"),
    ("A-1: //! DATA 28, 0, 0, 0\nJA A-1", "E103", 1, "A_1: //! DATA 28, 0, 0, 0\nJA A_1"),
    ("1 MST 0\n2 STOP", "E103", 1, "MST 0\nSTOP"),
]
"""Mistakes that one message and one fix are for: text, code, column, and the text as it is meant."""


@pytest.mark.parametrize(("text", "code", "column", "right"), MENDED)
def test_a_habit_is_one_mistake_with_one_fix(text, code, column, right):
    (found,) = assemble(text).diagnostics
    assert (found.code, found.location.column) == (code, column)
    (fix,) = found.fixes
    lines = text.split("\n")
    for edit in sorted(fix.edits, key=lambda edit: edit.location, reverse=True):
        _, line, start, end = edit.location
        lines[line - 1] = lines[line - 1][: start - 1] + edit.text + lines[line - 1][end - 1 :]
    assert "\n".join(lines) == right


@pytest.mark.parametrize(
    ("text", "code", "part"),
    [
        ("L: JC ?, L", "E205", "JC takes ZE, NZ"),
        ("JC , L\nL: STOP", "E103", "an operand is missing"),
        ("NOP\nSTOP", "E201", "TMCL has no command that does nothing"),
        ("ROP 0, 1\nSTOP", "E201", "ROR"),
    ],
)
def test_what_is_not_certain_is_named_without_a_fix(text, code, part):
    (found,) = assemble(text).diagnostics
    assert found.code == code
    assert part in found.text


def codes(text, **options):
    return [item.code for item in assemble(text, **options).diagnostics]


def one(line):
    (instruction,) = assemble(line).program
    return instruction


def message(text, **options):
    (diagnostic,) = assemble(text, **options).diagnostics
    return diagnostic.text


def reader(files):
    def include(name, _from):
        if name not in files:
            raise FileNotFoundError(2, "No such file or directory")
        return name, files[name]

    return include


def test_the_manual_s_example_program_assembles():
    program = assemble(
        "Loop: MVP ABS, 0, 10000\n      CSUB SubW //Save program counter\n      MVP ABS, 0, 0\n      JA Loop\n\n"
        "SubW: WAIT POS, 0, 0\n      WAIT TICKS, 0, 50\n      RSUB\n"
    ).program
    assert program == (
        Instruction(4, 0, 0, 10000), Instruction(23, 0, 0, 4), Instruction(4), Instruction(22),
        Instruction(27, 1), Instruction(27, 0, 0, 50), Instruction(24),
    )  # fmt: skip


@pytest.mark.parametrize("row", BY_MNEMONIC.values(), ids=lambda row: row.mnemonic)
def test_every_command_assembles_with_its_words_and_numbers(row):
    for words in {tuple(o.words) for o in row.operands if o.words} or {(("0", 0),)}:
        for word, number in words:
            text = ", ".join(word if o.kind == "word" else "1" for o in row.operands)
            instruction = one(f"{row.mnemonic.lower()} {text.lower()}")
            assert instruction.number == row.number
            for operand in row.operands:
                assert getattr(instruction, operand.field) == (number if operand.kind == "word" else 1)


@pytest.mark.parametrize("name", SISTER_COMMANDS)
def test_commands_of_other_firmware_are_refused_by_name(name):
    (diagnostic,) = assemble(f"{name} 1").diagnostics
    assert diagnostic.code == "E202"
    assert "of other TMCL firmware" in diagnostic.text
    assert "a TMCM-34x has " in diagnostic.text


@pytest.mark.parametrize(
    ("line", "instruction"),
    [
        ("GAP 1, 2, 0", Instruction(6, 1, 2, 0)),
        ("AAP 108, 0, 300000", Instruction(34, 108, 0, 300000)),
        ("GIO 0, 2, 7", Instruction(15, 0, 2, 7)),
        ("CALC ADD, 5, 3", Instruction(19, 0, 3, 5)),
        ("CALCX ADD, 1, 2", Instruction(33, 0, 1, 2)),
        ("CALC NOT", Instruction(19, 8)),
        ("CALC NOT, 4", Instruction(19, 8, 0, 4)),
        ("UF3", Instruction(67)),
        ("UF3 1, 2, 3", Instruction(67, 1, 2, 3)),
        ("COMP $ffffffff", Instruction(20, 0, 0, -1)),
        ("COMP %1011", Instruction(20, 0, 0, 11)),
        ("COMP -2147483648", Instruction(20, 0, 0, -(2**31))),
        ("JA 20", Instruction(22, 0, 0, 20)),
        ("SIO 255,2,-1", Instruction(14, 255, 2, -1)),
        ("//! DATA 37, 1, 2, 300", Instruction(37, 1, 2, 300)),
    ],
)
def test_operands_find_their_fields(line, instruction):
    assert one(line) == instruction


def test_halves_are_rounded_to_the_even_neighbour():
    assert [one(f"COMP {n}/2").value for n in (1, 3, 5, -1, -3)] == [0, 2, 2, 0, -2]


def test_names_do_not_tell_upper_from_lower_case():
    program = assemble("Max_velocity = 500\nstart: ROR 0, Max_Velocity\n JA START").program
    assert program == (Instruction(1, 0, 0, 500), Instruction(22, 0, 0, 0))


def test_constants_keep_their_fraction_until_a_command_takes_them():
    assert assemble("Half = 1/2\nCOMP Half * 8").program == (Instruction(20, 0, 0, 4),)


def test_constants_may_follow_the_commands_that_use_them():
    assert assemble("COMP Later\nLater = 3").program == (Instruction(20, 0, 0, 3),)


def test_several_labels_may_stand_for_one_address():
    assembly = assemble("A: B:\nC: STOP\nEnd:")
    assert assembly.labels == {"A": 0, "B": 0, "C": 0, "End": 1}


def test_a_label_may_be_called_like_a_command():
    assert assemble("Stop: STOP\nJA Stop").program == (Instruction(28), Instruction(22))


@pytest.mark.parametrize(
    ("text", "code", "column"),
    [
        ("ROR 0, 100 ; fast", "E101", 12),
        ("ROR 0, 0x10", "E102", 8),
        ("ROR 0, $", "E102", 8),
        ("ROR 0, %12", "E102", 8),
        ("ROR 0, 5e", "E102", 8),
        ("ROR 0,, 100", "E103", 7),
        ("ROR 0,", "E103", 6),
        ("ROR , 5", "E103", 4),
        ("ROR 0, (1", "E103", 8),
        ("ROR 0, 1)", "E103", 9),
        ("ROR 0, 1 2", "E103", 10),
        ("ROR 0, 1 +", "E103", 10),
        ("ROR 0, *", "E103", 8),
        ("X =", "E103", 3),
        (", 5", "E103", 1),
        ("#define X", "E103", 1),
        ("#include", "E103", 1),
        ("ROOR 0, 1", "E201", 1),
        ("ROR 0", "E203", 1),
        ("CALC SUB", "E203", 1),
        ("STOP 1, 2, 3, 4", "E204", 15),
        ("MVP 0, 0, 100", "E205", 5),
        ("MVP REL + 1, 0, 100", "E205", 5),
        ("ROR 256, 100", "E206", 5),
        ("ROR -1, 100", "E206", 5),
        ("COMP 4294967296", "E206", 6),
        ("COMP EXP(1000)", "E401", 6),
        ("COMP 1e999", "E206", 6),
        ("JA Nowhere", "E301", 4),
        ("COMP Nothing", "E301", 6),
        ("COMP SIN", "E301", 6),
        ("COMP SINE(1)", "E301", 6),
        ("A: STOP\na: STOP", "E302", 1),
        ("A = 1\nA = 2", "E302", 1),
        ("A: STOP\nA = 2", "E302", 1),
        ("A = B\nB = 1", "E303", 5),
        ("A: COMP A", "E304", 9),
        ("COMP 1/0", "E401", 7),
        ("COMP SQRT(-1)", "E401", 6),
        ("COMP (0-8)^0.5", "E401", 11),
        ("COMP 1e999 - 1e999", "E206", 6),
        ("#include other.tmc", "E501", 10),
        ("//! DATA 1, 2", "E103", 5),
        ("//! DATA 256, 0, 0, 0", "E206", 10),
        ("//! DATA x, 0, 0, 0", "E301", 10),
    ],
)
def test_a_mistake_is_told_with_its_place(text, code, column):
    (diagnostic,) = assemble(text).diagnostics
    assert diagnostic.code == code
    assert diagnostic.location.column == column
    assert assemble(text).program == ()


def test_all_mistakes_are_told_in_one_pass_in_the_order_of_the_text():
    text = "ROR 0\nX = 1/0\nMVP ABX, 300, oops\nX = 2\nfoo\nJA Nowhere"
    places = [(d.code, d.location.line) for d in assemble(text).diagnostics]
    assert places == [
        ("E203", 1), ("E401", 2), ("E205", 3), ("E206", 3), ("E301", 3), ("E302", 4), ("E201", 5), ("E301", 6),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ("MPV ABS, 0, 1", "MVP"),
        ("MVP ASB, 0, 1", "ABS"),
        ("Start: JA Strat", "Start"),
        ("MaxSpeed = 1\nROR 0, MaxSped", "MaxSpeed"),
    ],
)
def test_a_name_that_is_nearly_right_gets_a_suggestion(text, hint):
    assert message(text).endswith(f"did you mean {hint}?")


@pytest.mark.parametrize(
    ("text", "fixed"),
    [
        ("MPV ABS, 0, 1", "MVP ABS, 0, 1"),
        ("COMP 0xff", "COMP $ff"),
        ("COMP 0B11 + 1", "COMP %11 + 1"),
        ("STOP ; note", "STOP // note"),
        ("Go STOP", "Go: STOP"),
        ("CLE ETA", "CLE ETO"),
        ("COMP sine(1)", "COMP SIN(1)"),
    ],
)
def test_a_mistake_with_an_obvious_cure_offers_it(text, fixed):
    (diagnostic,) = assemble(text).diagnostics
    (edit,) = diagnostic.fixes[0].edits
    assert text[: edit.location.column - 1] + edit.text + text[edit.location.end - 1 :] == fixed
    assert assemble(fixed).ok


def test_a_forgotten_colon_is_recognised():
    assert "':'" in message("Loop JA Loop")
    assert "':'" in message("Beginning")


def test_addresses_stay_where_they_are_when_lines_have_mistakes():
    assembly = assemble("ROR 0\nfoo\nEnd: STOP")
    assert assembly.labels == {"End": 2}
    assert [code.instruction for code in assembly.code] == [None, None, Instruction(28)]


def test_included_files_stand_where_they_are_included():
    files = {"names.inc": "Speed = 700 // top\n", "sub.inc": "#include names.inc\nSub: RSUB\n"}
    assembly = assemble(
        "#include names.inc\nROR 0, Speed\n#include sub.inc\nJA Sub", "main.tmc", reader(files)
    )
    assert assembly.program == (Instruction(1, 0, 0, 700), Instruction(24), Instruction(22, 0, 0, 1))
    assert assembly.source_map[1] == Location("sub.inc", 2, 6, 10)
    assert list(assembly.sources) == ["main.tmc", "names.inc", "sub.inc"]


@pytest.mark.parametrize(
    "line", ['#include "names.inc"', "  # INCLUDE names.inc // the names", "#include\tnames.inc"]
)
def test_include_lines_may_have_blanks_quotes_and_comments(line):
    assert assemble(f"{line}\nCOMP A", include=reader({"names.inc": "A = 1"})).ok


def test_a_file_that_includes_itself_is_refused_once():
    files = {"a.inc": "#include b.inc", "b.inc": "STOP\n#include a.inc"}
    assert codes("#include a.inc", include=reader(files)) == ["E502"]
    assert codes("#include main.tmc", file_name="main.tmc", include=reader({"main.tmc": ""})) == ["E502"]


def test_includes_without_end_are_refused():
    def endless(name, _from):
        return f"{name}x", f"STOP\n#include {name}x"

    assembly = assemble("#include a", include=endless)
    assert [item.code for item in assembly.diagnostics] == ["E503"]
    assert len(assembly.code) == INCLUDE_DEPTH


def test_programs_over_the_memory_are_refused():
    assert assemble("STOP\n" * PROGRAM_SIZE).ok
    (diagnostic,) = assemble("STOP\n" * (PROGRAM_SIZE + 1)).diagnostics
    assert diagnostic.code == "E601"
    assert diagnostic.location.line == PROGRAM_SIZE + 1


def test_stop_is_appended_only_where_none_is():
    assert assemble("ROR 0, 1", append_stop=True).program[-1] == Instruction(28)
    assert len(assemble("STOP", append_stop=True).program) == 1
    assert assemble("", append_stop=True).program == ()
    assert len(assemble("RSUB\n" * 2047, append_stop=True).program) == 2048
    assert len(assemble("RSUB\n" * 2048, append_stop=True).program) == 2048


def test_symbols_know_their_definition_and_their_references():
    assembly = assemble("Speed = 5 // fast\nGo: ROR 0, Speed\nROL 0, speed*2\nJA Go", "x.tmc")
    speed, go = assembly.symbols["SPEED"], assembly.symbols["GO"]
    assert (speed.kind, speed.value, speed.comment) == ("constant", 5.0, "fast")
    assert speed.references == [Location("x.tmc", 2, 12, 17), Location("x.tmc", 3, 8, 13)]
    assert go.definition == Location("x.tmc", 2, 1, 3)
    assert go.references == [Location("x.tmc", 4, 4, 6)]


def test_the_source_map_shows_the_commands():
    assembly = assemble("\n  Go: ROR 0, 5 // comment\r\nSTOP", "x.tmc")
    assert assembly.source_map == (Location("x.tmc", 2, 7, 15), Location("x.tmc", 3, 1, 5))


def test_an_appended_stop_stands_on_the_last_line_and_at_the_end_of_the_listing():
    assembly = assemble("ROR 0, 1", "x.tmc", append_stop=True)
    assert assembly.source_map[-1] == Location("x.tmc", 1, 1, 1)
    assert listing(assembly).splitlines()[1:] == [
        "0000     01 00 00 00 00 00 01 02     1  ROR 0, 1",
        "0001     1c 00 00 00 00 00 00 1c        STOP // appended: the program did not end with one",
    ]
    assert listing(assemble("STOP", append_stop=True)).count("STOP") == 1
    assert listing(assemble("")) == "address  image                    line  source\n"


def test_a_diagnostic_without_its_source_is_one_line():
    (diagnostic,) = assemble("foo 1").diagnostics
    assert render(diagnostic) == "program.tmc:1:1: error[E201]: no command foo"


def test_a_missing_include_file_is_told_and_its_consequences_are_not():
    text = "ROR 0, Speed\n#include names.inc\nX = Speed * 2\nFOO 1\nJA Nowhere\n"
    assert [d.code for d in assemble(text).diagnostics] == ["E501", "E201"]


def test_the_names_of_the_parameters_come_with_the_tool_chain():
    for name in ("TMCLParam.tmc", "tmclparam.TMC", '"TMCLParam.tmc"', "<TMCLParam.tmc>"):
        text = f"#include {name}\nSAP APMaxPositioningSpeed, Motor0, 500\nSAP APMaxAcceleration, Motor2, 100\nSTOP"
        assert assemble(text).program[:2] == (Instruction(5, 4, 0, 500), Instruction(5, 5, 2, 100))
    own = assemble("#include TMCLParam.tmc\nROR Mine, 5", include=lambda name, _from: (name, "Mine = 1"))
    assert own.program == (Instruction(1, 0, 1, 5),)


@pytest.mark.parametrize("name", ["a.inc", '"a.inc"', "<a.inc>", "'a.inc'"])
def test_the_name_of_an_include_file_may_stand_in_quotes(name):
    seen = []
    assemble(f"#include {name} // more", include=lambda file, _from: (seen.append(file), "")[1:] * 2)
    assert seen == ["a.inc"]


def test_settings_exported_by_the_tmcl_ide_are_a_program():
    text = (
        "//=== module settings for axis 0 ===\r\n"
        "SAP 4, 0, 1000\t// max. positioning speed [int]\r\nSAP 5, 0, 500\t// max. acceleration [int]\r\n"
        "\r\n//=== module settings for axis 1 ===\r\nSAP 140, 1, 6\t// microstep resolution\r\n"
    )
    assembly = assemble(text, append_stop=True)
    assert assembly.diagnostics == ()
    assert [tuple(i) for i in assembly.program] == [
        (5, 4, 0, 1000),
        (5, 5, 0, 500),
        (5, 140, 1, 6),
        (28, 0, 0, 0),
    ]
