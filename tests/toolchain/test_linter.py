"""Likely mistakes in programs that assemble."""

import pytest
from hypothesis import given, settings

from tmcm34x.toolchain.assembler import assemble
from tmcm34x.toolchain.linter import DEFAULT, RULES, ignored_codes, lint
from toolchain.generators import SOURCES

NEST = "\n".join(f"S{n}: CSUB S{n + 1}\nRSUB" for n in range(10)) + "\nS10: RSUB"


def findings(text, **options):
    assembly = assemble(text)
    assert assembly.ok, assembly.diagnostics
    return lint(assembly, **options)


def codes(text, **options):
    return [item.code for item in findings(text, **options)]


CLEAN = """
// Every command once, used well.
Speed = 500
        SGP 66, 0, 1
        SAP 4, 0, Speed
        RFS START, 0
        WAIT RFS, 0, 1000
        JC ETO, Failed
        SCO 1, 0, 1000
        CSUB Move
Loop:   GIO 0, 0
        JC ZE, Loop
        MVP COORD, $83, 1
        MVP COORD, 0, 1
        WAIT POS, 0, 0
        SIO 255, 2, -1
        CCO 2, 7
        GAP 1, 0, 0
        AAP 0, 1
        AGP 3, 2
        CALC DIV, 2
        WAIT TICKS, 9, 5
        JA Loop
Failed: CLE ETO
        STOP
Move:   MVP ABS, 1, -1000
        STAP 4, 0
        RSUB
"""

BROKEN = [
    ("W101", "STOP\nROR 0, 1\nMST 0\nSTOP", 2, 1),
    ("W102", "ROR 0, 1", 1, 1),
    ("W102", "L: GIO 0, 0\nJC ZE, L", 2, 1),
    ("W103", f"CSUB S0\nSTOP\n{NEST}", 17, 5),
    ("W104", "ROR 0, 1\nRSUB", 2, 1),
    ("W105", "CSUB A\nSTOP\nA: CSUB A\nRSUB", 3, 4),
    ("W106", "JA 5", 1, 4),
    ("W106", "JC ZE, End\nSTOP\nEnd:", 1, 8),
    ("W201", "WAIT REFSW, 0, 0\nSTOP", 1, 16),
    ("W201", "WAIT RFS, 0, 0\nSTOP", 1, 14),
    ("W202", "L: STAP 4, 0\nJA L", 1, 4),
    ("W202", "L: SGP 66, 0, 5\nJA L", 1, 4),
    ("W202", "L: AGP 66, 0\nJA L", 1, 4),
    ("W202", "L: CSUB S\nJA L\nS: STGP 1, 2\nRSUB", 3, 4),
    ("W202", "L: SCO 0, 255, 0\nJA L", 1, 4),
    ("W202", "SGP 84, 0, 1\nL: CCO 1, 0\nJA L", 2, 4),
    ("W203", "L: WAIT POS, 0, 9\nJC ETO, L\nSTOP", 2, 1),
    ("W301", "SAP 140, 0, 7\nSTOP", 1, 13),
    ("W301", "SGP 69, 0, 9\nSTOP", 1, 12),
    ("W303", "ROR 3, 100\nSTOP", 1, 5),
    ("W303", "MVP ABS, $83, 100\nSTOP", 1, 10),
    ("W303", "CCO 1, 5\nSTOP", 1, 8),
    ("W303", "WAIT POS, 3, 0\nSTOP", 1, 11),
    ("W304", "SAP 8, 0, 1\nSTOP", 1, 5),
    ("W304", "AAP 10, 0\nSTOP", 1, 5),
    ("W304", "AGP 133, 0\nSTOP", 1, 5),
    ("W305", "GAP 141, 0\nSTOP", 1, 5),
    ("W305", "GGP 56, 2\nSTOP", 1, 5),
    ("W305", "GGP 0, 1\nSTOP", 1, 8),
    ("W305", "GIO 8, 0\nSTOP", 1, 5),
    ("W305", "SIO 0, 0, 1\nSTOP", 1, 8),
    ("W306", "STAP 1, 0\nSTOP", 1, 6),
    ("W306", "STGP 66, 0\nSTOP", 1, 6),
    ("W307", "ROR 0, 2048\nSTOP", 1, 8),
    ("W307", "SIO 3, 2, 2\nSTOP", 1, 11),
    ("W307", "WAIT TICKS, 0, -1\nSTOP", 1, 16),
    ("W307", "GCO 21, 0\nSTOP", 1, 5),
    ("W307", "SCO 2, 0, 8388608\nSTOP", 1, 11),
    ("W307", "SCO 1,0,1\nMVP COORD, 0, 21\nGCO 0,255\nSTOP", 2, 15),
    ("W308", "MVP COORD, 0, 3\nSTOP", 1, 15),
    ("W309", "CALC MOD, 0\nSTOP", 1, 11),
    ("W307", "MVP ABS, 0, 8388608\nSTOP", 1, 13),
    ("W307", "MVP REL, 0, 16777216\nSTOP", 1, 13),
    ("W307", "SAC 1, 5, 0\nSTOP", 1, 8),
    ("W310", "WAIT POS, 0, 0.4\nSTOP", 1, 14),
    ("W310", "SAP 4.4, 0, 5\nSTOP", 1, 5),
    ("W310", "ROR 1/3, 5\nSTOP", 1, 5),
    ("W310", "GGP 1, 2.25\nSTOP", 1, 8),
    ("W310", "Third = 0.3\nROR 0, Third\nSTOP", 2, 8),
    ("W401", "Speed = 5\nSTOP", 1, 1),
    ("W401", "ROR 0, 1\nHere: STOP", 2, 1),
    ("W402", "POS = 5\nCOMP POS\nSTOP", 1, 1),
    ("W403", "AAP 4, 0, 1000\nSTOP", 1, 11),
]


def test_a_sound_program_has_no_findings():
    assert findings(CLEAN) == ()


@pytest.mark.parametrize(("code", "text", "line", "column"), BROKEN)
def test_a_rule_finds_its_mistake(code, text, line, column):
    (finding,) = findings(text, rules=frozenset({code}))
    assert (finding.code, *finding.location[1:3]) == (code, line, column)
    assert finding.severity == RULES[code].severity


def test_every_rule_has_a_broken_program():
    assert set(RULES) >= {code for code, *_ in BROKEN}
    for code, rule in RULES.items():
        model = 342 if code == "W302" else 343
        others = DEFAULT | {code}
        assert set(codes(rule.example, rules=others, model=model)) == {code}
        assert codes(rule.cure, rules=others, model=model) == []


def test_rules_are_switched_by_comments_and_by_callers():
    text = "ROR 3, 9999\nSTOP"
    assert codes(text, rules=DEFAULT - {"W303"}) == ["W307"]
    assert codes(f"// lint: off W303, W307\n{text}") == []
    polling = "L: GIO 0, 0\nJC ZE, L\nSTOP"
    assert codes(polling) == []
    assert codes(f"{polling} // lint: on W206") == ["W206"]
    assert codes(f"{polling} // lint: off w206", rules=frozenset(RULES)) == []


REGISTERS = [
    ("W501", "COMP 5\nJC EQ, 0\nSTOP", [1]),
    ("W501", "CALCX ADD\nSTOP", [1]),
    ("W501", "GAP 1, 0\nCALCX ADD\nAGP 0, 2\nSTOP", [2]),
    ("W501", "GAP 1, 0\nCALCX SWAP\nSTOP", [2]),
    ("W501", "SIO 255, 2, -1\nSTOP", [1]),
    ("W501", "JC NZ, 0\nSTOP", [1]),
    ("W501", "CSUB S\nAGP 0, 2\nSTOP\nS: AGP 1, 2\nRSUB", [4]),
    ("W501", "GAP 1, 0\nCSUB S\nSTOP\nS: AGP 1, 2\nRSUB", []),
    ("W501", "JA M\nL: AGP 1, 2\nSTOP\nM: GAP 1, 0\nJA L", []),
    ("W501", "RFS STATUS, 0\nAGP 0, 2\nSTOP", []),
    ("W502", "GAP 1, 0\nGAP 209, 0\nCALC SUB, 1\nAGP 0, 2\nSTOP", [1]),
    ("W502", "GAP 1, 0\nSTOP", [1]),
    ("W502", "GAP 1, 0\nCSUB S\nSTOP\nS: GAP 2, 0\nAGP 0, 2\nRSUB", [1]),
    ("W502", "CSUB S\nAGP 0, 2\nSTOP\nS: GAP 2, 0\nRSUB", []),
    ("W502", "GAP 1, 0\nJC ZE, L\nGAP 2, 0\nL: AGP 0, 2\nSTOP", []),
    ("W502", "L: GAP 1, 0\nCALCX SWAP\nCALCX ADD\nAGP 0, 2\nJA L", []),
    ("W503", "GAP 1, 0\nJC GT, L\nL: STOP", [2]),
    ("W503", "GAP 1, 0\nCOMP 1\nL: JC GT, M\nJA L\nM: STOP", []),
    ("W504", "SAP 4, 0, 1\nSAP 4, 0, 2\nSTOP", [1]),
    ("W504", "SAP 4, 0, 1\nSAP 4, 1, 2\nSGP 4, 2, 2\nSGP 4, 2, 3\nSTOP", [3]),
    ("W504", "SAP 4, 0, 1\nMVP ABS, 0, 5\nSAP 4, 0, 2\nSTOP", []),
    ("W504", "SAP 4, 0, 1\nL: SAP 4, 0, 2\nJA L", []),
]


@pytest.mark.parametrize(("code", "text", "lines"), REGISTERS)
def test_values_are_followed_through_the_program(code, text, lines):
    assert [item.location.line for item in findings(text, rules=frozenset({code}))] == lines


SETTINGS = [
    ("W311", "SAP 5, 1, 0\nMVP COORD, $82, 3\nSTOP", [1]),
    ("W311", "SAP 4, 0, 0\nSAP 4, 0, 9\nMVP ABS, 0, 5\nSTOP", []),
    ("W311", "SAP 4, 0, 0\nMVP ABS, 1, 5\nSTOP", []),
    ("W312", "SAP 5, 0, 9\nSAP 153, 0, 8\nSAP 5, 0, 9\nSTOP", []),
    ("W312", "SAP 5, 0, 9\nSAP 153, 1, 8\nSTOP", []),
    ("W312", "SAP 4, 0, 9\nSAP 153, 0, 8\nSAP 154, 1, 3\nSTOP", []),
    ("W312", "SAP 4, 0, 9\nSAP 154, 0, 3\nSAP 4, 1, 9\nSAP 154, 1, 3\nSAP 4, 1, 9\nSTOP", [2]),
    ("W313", "ROL 0, 500\nSAP 1, 0, 0\nSAP 0, 0, 0\nSTOP", []),
    ("W313", "MST 1\nSAP 0, 1, 7\nSTOP", [2]),
    ("W313", "MST 1\nSAP 0, 1, 0\nSAP 1, 1, 0\nSTOP", []),
    ("W313", "MST 1\nSAP 0, 1, 7\nSAP 138, 1, 0\nSTOP", []),
    ("W313", "MST 1\nSAP 0, 1, 7\nSAP 138, 2, 0\nSTOP", [2]),
    ("W314", "SAP 0, 1, 7\nWAIT POS, 1, 0\nSTOP", []),
    ("W314", "MVP COORD, $43, 1\nWAIT POS, 1, 0\nWAIT POS, 2, 0\nSTOP", [3]),
    ("W504", "SAP 250, 0, 7\nSAP 250, 0, 8\nSAP 4, 0, 8\nSAP 4, 0, 9\nSTOP", [3]),
    ("W205", "L: JC EDV, L\nSTOP", [1]),
    ("W205", "SAP 212, 0, 9\nL: JC EDV, L\nJC ESD, L\nSTOP", []),
    ("W204", "SGP 77, 0, 1\nL: JA L", [1]),
    ("W204", "STGP 1, 2\nSTOP", []),
    ("W206", "L: GIO 0, 0\nWAIT TICKS, 0, 1\nJC ZE, L\nSTOP", []),
    ("W206", "L: CSUB S\nJC ZE, L\nSTOP\nS: GIO 0, 0\nRSUB", []),
    ("W315", "GAP 209, 0\nGAP 209, 1\nSAP 212, 0, 5\nSTOP", [1, 3]),
    ("W316", "GGP 1, 2\nGGP 1, 2\nGGP 2, 2\nAGP 2, 2\nSTOP", [1]),
]


@pytest.mark.parametrize(("code", "text", "lines"), SETTINGS)
def test_settings_are_judged_where_they_act(code, text, lines):
    assert [item.location.line for item in findings(text, rules=frozenset({code}))] == lines


@pytest.mark.parametrize(("code", "text", "line", "_column"), BROKEN)
def test_a_comment_keeps_a_rule_quiet(code, text, line, _column):
    lines = text.split("\n")
    lines[line - 1] += f" // lint: ignore {code.lower()} because it is meant"
    assert codes("\n".join(lines), rules=frozenset({code})) == []


def test_parameters_are_checked_against_the_model():
    text = "SAP 6, 0, 100\nSTOP"
    assert codes(text, model=343) == codes(text, model=341) == []
    assert codes(text, model=342) == ["W302"]


def test_ignore_alone_keeps_all_rules_quiet_and_others_not():
    assert ignored_codes("// lint: ignore") is None
    assert ignored_codes("// lint: ignore W101, w202 W303") == {"W101", "W202", "W303"}
    assert ignored_codes("// nothing") == frozenset()
    assert codes("ROR 3, 9999 // lint: ignore W303\nSTOP") == ["W307"]


def test_eeprom_writes_outside_of_loops_are_fine():
    assert codes("STAP 4, 0\nSGP 66, 0, 1\nL: SGP 1, 2, 5\nGAP 1, 0\nAGP 2, 2\nJA L") == []


def test_coordinates_that_live_in_the_eeprom_count_as_set():
    assert codes("GCO 0, 255\nMVP COORD, 0, 3\nSTOP") == []
    assert codes("GCO 3, 255\nMVP COORD, 0, 3\nSTOP") == []
    assert codes("SGP 84, 0, 1\nMVP COORD, 0, 3\nSTOP") == []


def test_expressions_may_lose_a_fraction_in_a_value():
    assert codes("Turn = 200 / 3\nMVP ABS, 0, Turn\nMVP ABS, 0, 1000 * SIN(1)\nMVP ABS, 0, 5.0\nSTOP") == []


def test_a_parameter_that_the_model_lacks_is_told_once_with_a_count():
    text = "SAP 6, 0, 100\nMST 0\n" * 66 + "SAP 7, 0, 10\nSTOP"
    found = findings(text, model=342)
    assert [(item.code, item.location.line) for item in found] == [("W302", 1), ("W302", 133)]
    assert found[0].text.endswith("; 65 more lines")
    more = findings(text.replace("STOP", "SAP 203, 0, 1\nSTOP"), model=342)
    question = "was the program written for another module?"
    assert [item.text.endswith(question) for item in more] == [True, False, False]
    quiet = findings("SAP 6, 0, 1 // lint: ignore\nSAP 6, 0, 1\nSTOP", model=342)
    assert [item.location.line for item in quiet] == [2]


@pytest.mark.parametrize(
    "text",
    [
        "Home: JA Search\nMove: JA Go\nHalt: STOP\nSearch: RFS START, 0\nSTOP\nGo: ROR 0, 1\nSTOP",
        "JA Search\nJA Go\nSearch: RFS START, 0\nSTOP\nGo: ROR 0, 1\nSTOP",
        "Home: CSUB A\nSTOP\nMove: CSUB B\nSTOP\nA: MST 0\nRSUB\nB: ROR 0, 1\nRSUB",
        "STOP\nMST 0 // tmcl: entry\nSTOP",
        "STOP\nGo: ROR 0, 1 // tmcl: entry\nSTOP",
        "STOP\nGo: // tmcl: entry\nROR 0, 1\nSTOP",
    ],
)
def test_entry_points_are_neither_unused_nor_unreached(text):
    assert codes(text) == []


@pytest.mark.parametrize(
    ("number", "owner"), [(15, "several phases"), (124, "closed-loop"), (174, "stallGuard2")]
)
def test_parameters_of_sister_modules_are_explained(number, owner):
    (found,) = findings(f"SAP {number}, 0, 1\nSTOP")
    assert found.code == "W305"
    assert owner in found.text
    assert "a TMCM-34x has" in found.text


def test_one_entry_is_no_jump_table():
    assert codes("ROR 0, 1\nSTOP\nSpare: MST 0\nSTOP") == ["W401", "W101"]
    assert codes("JA Go\nMST 0\nGo: STOP") == ["W101"]


def test_operands_of_a_refused_command_count_as_used():
    for text in (
        "Speed = 5\nGo: ROR 0, Speed, 1, 2, 3\nFOO Speed\nJC Go\nSTOP",
        "Speed = 5\nSAPP 4, 0, Speed, 3, 4, 5\nSTOP",
        "L: JA(L)",
        "Speed = 5\nSAP 4, 0, Speed Speed\nSTOP",
    ):
        assert [item.code for item in lint(assemble(text))] == [], text


def test_names_may_be_used_in_a_file_that_is_missing():
    assert lint(assemble("#include gone.inc\nSpeed = 5\nSTOP")) == ()


def test_instructions_given_by_numbers_are_judged_too():
    (found,) = findings("//! DATA 21, 8, 0, 0\nSTOP", rules=frozenset({"W205"}))
    assert found.location[1:] == (1, 5, 21)


def test_no_definition_is_removed_while_an_error_may_hide_its_use():
    (found,) = lint(assemble("Speed = 5\nROR 0, Sped\nSTOP"))
    assert (found.code, found.fixes) == ("W401", ())


def test_nothing_is_said_of_an_appended_stop():
    assert lint(assemble("L: ROR 0, 1\nJA L", append_stop=True)) == ()
    assert lint(assemble("ROR 0, 1", append_stop=True)) == ()
    assert lint(assemble("L: ROR 0, 1\nJA L\nSTOP")) == ()


def test_flow_is_left_alone_while_there_are_errors():
    assembly = assemble("JA Nowhere\nROR 5, 1")
    assert [item.code for item in lint(assembly)] == ["W303"]


def test_names_of_included_files_need_not_be_used():
    assembly = assemble("#include names.inc\nSTOP", include=lambda name, _from: (name, "A = 1\n"))
    assert lint(assembly) == ()


def apply(text, edits):
    lines = text.split("\n")
    for edit in sorted(edits, key=lambda item: item.location, reverse=True):
        _, line, column, end = edit.location
        lines[line - 1] = lines[line - 1][: column - 1] + edit.text + lines[line - 1][end - 1 :]
    return "\n".join(lines)


@pytest.mark.parametrize(("code", "text", "_line", "_column"), BROKEN)
def test_a_fix_removes_its_finding(code, text, _line, _column):
    (finding,) = findings(text, rules=frozenset({code}))
    for fix in finding.fixes:
        assert code not in codes(apply(text, fix.edits))
    assert finding.fixes or code not in {"W102", "W201", "W301", "W307"}


@pytest.mark.parametrize(
    ("code", "text", "fixed"),
    [
        ("W310", "WAIT TICKS, 0, 2.6\nSTOP", "WAIT TICKS, 0, 3\nSTOP"),
        ("W310", "ROR 0, -2.5\nSTOP", "ROR 0, -2\nSTOP"),
        ("W403", "GAP 1, 0\nAAP 4, 0 , 1000 // x\nSTOP", "GAP 1, 0\nAAP 4, 0 // x\nSTOP"),
        ("W403", "STOP 1, 2", "STOP"),
        ("W502", "L: GAP 1, 0 // x\nGAP 8, 0\nJC ZE, L\nSTOP", "L:  // x\nGAP 8, 0\nJC ZE, L\nSTOP"),
        ("W503", "L: GAP 1, 0\nM: JC GT, L\nSTOP", "L: GAP 1, 0\nM: COMP  0\n        JC GT, L\nSTOP"),
        ("W206", "L: GIO 0, 0\nJC ZE, L\nSTOP", "L: WAIT  TICKS, 0, 1\n        GIO 0, 0\nJC ZE, L\nSTOP"),
        ("W401", "Speed = 5 // top\nSTOP", "// top\nSTOP"),
        ("W401", "Lost : ROR 0, 1\nSTOP", "ROR 0, 1\nSTOP"),
        ("W401", "ROR 0, 1\nLost:\nSTOP", "ROR 0, 1\n\nSTOP"),
        ("W504", "SAP 4, 0, 1\nSAP 4, 0, 2\nSTOP", "\nSAP 4, 0, 2\nSTOP"),
        (
            "W203",
            "WAIT POS, 0, 9\nJC ETO, Late\nSTOP\nLate: MST 0\nSTOP",
            "WAIT POS, 0, 9\nJC ETO, Late\nSTOP\nLate: CLE   ETO\n        MST 0\nSTOP",
        ),
    ],
)
def test_a_fix_changes_what_it_must_and_removes_its_finding(code, text, fixed):
    (finding,) = findings(text, rules=frozenset({code}))
    (fix,) = finding.fixes
    assert apply(text, fix.edits) == fixed
    assert codes(fixed, rules=frozenset({code})) == []


@pytest.mark.parametrize("code", RULES)
def test_a_rule_has_the_fix_that_its_page_promises(code):
    example, rules = RULES[code].example, frozenset({code})
    first = findings(example, rules=rules, model=342 if code == "W302" else 343)[0]
    assert bool(first.fixes) == bool(RULES[code].fix)
    for fix in first.fixes:
        assert codes(apply(example, fix.edits), rules=rules) == []


@pytest.mark.parametrize(
    ("code", "text"),
    [
        ("W310", "Third = 0.3\nROR 0, Third\nSTOP"),
        ("W310", "ROR 1/3, 5\nSTOP"),
        ("W502", "L: GAP 206, 0\nGAP 8, 0\nJC ZE, L\nSTOP"),
        ("W502", "L: GAP 1, 0\nGAP 8, 0\nJC ZE, 0\nJA L"),
        ("W503", "GAP 1, 0\nJC GT, 2\nSTOP"),
        ("W203", "L: WAIT POS, 0, 9\nJC ETO, L\nSTOP"),
        ("W203", "WAIT POS, 0, 9\nJC ETO, L\nMST 0\nL: STOP"),
        ("W203", "WAIT POS, 0, 9\nJC ETO, 3\nSTOP\nSTOP"),
        ("W203", "WAIT POS, 0, 9\nJC ETO, -1\nSTOP"),
        ("W504", "SAP 0, 0, 1\nSAP 0, 0, 2\nSTOP"),
        ("W504", "SAP 4, 0, 1\nSAP 4, 0, 2\nJA 1"),
        ("W503", "GAP 1, 0\nJC GT, L\n//! DATA 22, 0, 0, 2\nL: STOP"),
    ],
)
def test_no_fix_is_offered_where_it_might_change_something_else(code, text):
    (finding,) = findings(text, rules=frozenset({code}))
    assert finding.fixes == ()


@given(SOURCES)
@settings(max_examples=80)
def test_any_source_can_be_linted(text):
    assembly = assemble(text, include=lambda name, _from: (name, "L0: STOP"))
    for item in lint(assembly, model=342):
        assert item.code in RULES
        assert 1 <= item.location.line <= len(assembly.sources[item.location.file])


def test_whole_tables_may_be_stored():
    assert codes("STGP 7, 0\nRSGP 23, 0\nSTOP") == []
