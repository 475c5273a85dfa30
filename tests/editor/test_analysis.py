"""What an editor asks about a program."""

import gc
import posixpath

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tmcm34x.editor.analysis import actions, appearance, completions, hovers, names, values
from tmcm34x.editor.analysis.appearance import TOKEN_TYPES
from tmcm34x.editor.analysis.completions import cursor_at
from tmcm34x.editor.analysis.program import Analysis, TextPosition
from tmcm34x.editor.workspace import Workspace
from tmcm34x.tmcl.commands import COMMANDS
from tmcm34x.toolchain.assembler import assemble, no_includes
from tmcm34x.toolchain.formatter import format_source
from tmcm34x.toolchain.linter import DEFAULT, lint
from tmcm34x.toolchain.tokens import split_lines
from toolchain.generators import SOURCES

PROGRAM = """\
// Demo
// program
Speed = 500 // top speed
Turn  = 12800

Start:  SAP 4, 0, Speed
        SAP 154, 0, 4
        ROR 0, Speed * 2
        WAIT TICKS, 0, 150
        JC ETO, Start
        CSUB Sub
        JA Start

Sub:    GGP 0, 2
        CALC ADD, SIN(1) + Turn
        RSUB
"""


def analysis(text=PROGRAM, include=None, model=343):
    assembly = assemble(text, "x.tmc", include or (lambda name, _from: (name, "")))
    return Analysis(assembly, lint(assembly, model=model), model)


def at(text, mark="|"):
    """The text without its mark, and the place where it was."""
    before = text[: text.index(mark)]
    return text.replace(mark, "", 1), TextPosition(
        "x.tmc", before.count("\n"), len(before) - before.rfind("\n") - 1
    )


def hover(marked, **options):
    text, place = at(marked)
    found = hovers.hover(analysis(text, **options), place)
    return found.text if found else ""


def labels(marked, **options):
    text, place = at(marked)
    return [item.label for item in completions.completions(analysis(text, **options), place)]


def test_hover_over_a_command_tells_how_it_is_written_and_what_it_becomes():
    text = hover("STOP\n  M|VP ABS, 1, 90000")
    assert text.startswith("`MVP ABS|REL|COORD, <motor>, <position>`")
    assert "manual 6.7.4" in text
    assert (
        "address 1: `04 00 01 00 00 01 5f 90 f5`".replace("00 01 5f 90 f5", "01 5f 90 f5") in text
        or "address 1" in text
    )


def test_hover_over_a_parameter_tells_meaning_range_default_and_section():
    text = hover("SAP 14|0, 0, 4")
    assert "microstep resolution" in text
    assert "0 to 6, default 6" in text
    assert "- 4: 16 microsteps" in text
    assert "Manual 7.1" in text
    assert "general purpose variable #7" in hover("GGP |7, 2")
    assert "Only on a TMCM-341 and 343" in hover("GAP |206, 0")


@pytest.mark.parametrize(
    ("marked", "part"),
    [
        ("ROR 0, 5|00", "15,259 microsteps/s, 238.4 steps/s"),
        ("SAP 154, 0, 4\nROR 0, 5|00", "7,629 microsteps/s"),
        ("SAP 140, 1, 0\nROR 0, 5|00", "238.4 steps/s"),
        ("SAP 140, 0, 0\nROR 0, 5|00", "15,258.8 steps/s"),
        ("SAP 5, 0, 1|000", "microsteps/s²"),
        ("WAIT TICKS, 0, 15|0", "1.5 s"),
        ("SAP 214, 0, 2|00", "2 s"),
        ("SAP 140, 0, |4", "(16 microsteps)"),
        ("JC E|TO, 0", "ran into its time-out"),
        ("CALC M|OD, 3", "remainder"),
        ("COMP S|IN(1)", "sine"),
        ("X = S|IN(1)\nCOMP X", "sine"),
        ("X = 1/4 // a quarter\nCOMP |X", "constant **X** = 0.25, used once\n\na quarter"),
        ("STOP\nA: // the place\nJA |A", "label **A**: address 1, used once"),
        ("A|: STOP", "never used"),
        ("VE|CT 1, 2", "other TMCL firmware"),
        ("GAP 1, 2, |7", "surplus"),
        ("MVP ABS, |2, 7", "**motor** of MVP: 2"),
        ("JA |7", "address 7"),
        ("GAP |141, 0", "not in this firmware"),
        ("#include |names.inc", "includes `names.inc`"),
    ],
)
def test_hover_tells_what_numbers_and_names_mean(marked, part):
    assert part in hover(marked)


@pytest.mark.parametrize("marked", ["| ", "STOP // no|te", "STOP\n|", "  |  STOP"])
def test_hover_says_nothing_where_there_is_nothing(marked):
    assert hover(marked) == ""


def test_hover_over_a_diagnostic_explains_it():
    text = hover("ROR 0, 99|99\nSTOP")
    assert "**W307** operand out of range" in text
    assert "status 4" in text


def test_commands_are_completed_at_the_beginning():
    for marked in ("|", "M|", "Loop: |", "Loop: MV|", "  #in|"):
        assert {"MVP", "STOP", "UF0", "#include"} <= set(labels(marked))


def test_operands_are_completed_by_their_kind():
    assert labels("MVP |") == ["ABS", "REL", "COORD"]
    assert labels("JC E|") == [word for word, _ in COMMANDS[17].operands[0].words]
    assert labels("Here: STOP\nX = 1\nJA |") == ["Here"]
    assert {"0", "1", "2", "X", "SIN"} <= set(labels("X = 1\nROR |"))
    assert "4 maximum positioning speed" in labels("SAP ma|")
    assert "0 off" not in labels("SAP 4, 0, |")
    assert labels("SAP 193, 0, |")[:3] == [
        "1 left switch",
        "2 right, then left switch",
        "3 right, then reference switch",
    ]
    assert "64 EEPROM magic" in labels("SGP |")
    assert labels("GIO 0, |")[:3] == ["0", "1", "2"]
    assert "Y" in labels("Y = 2\nX = Y + |")
    for marked in ("STOP // |", "foo |", "MVP ABS, 0, 0, |", "#include a|", "? |"):
        assert labels(marked) == []


def test_directives_and_their_conditions_are_completed():
    directives = {"#include", "#if", "#else", "#endif", "#assert"}
    for marked in ("|STOP", "#|", "#i|", "  #as|"):
        assert directives <= set(labels(marked)), marked
    for marked in ("Speed = 5\n#if |", "Speed = 5\n#if MO| == 342\n#endif", "Speed = 5\n#assert Sp|"):
        assert {"MODEL", "Speed", "SIN"} <= set(labels(marked)), marked
        assert "MVP" not in labels(marked)
    for marked in ("#else |", "#endif |", "#if 1 // |"):
        assert labels(marked) == [], marked


def test_a_routine_offers_its_own_local_labels():
    text = "Move: ROR 0, 1\n.turn: JA {}\n.end: RSUB\nHome: MST 0\n.wait: JA {}\nSTOP"
    first, second = text.format("|", ".wait"), text.format(".turn", "|")
    assert labels(first)[:2] == [".turn", ".end"]
    assert labels(second)[0] == ".wait"
    assert ".turn" not in labels(second)
    assert "Move" in labels(second)
    line = "        JA .tu"
    assert (cursor_at(line, len(line)).word, cursor_at(line, len(line)).start) == (".tu", 11)
    assert cursor_at("X = 1.5", 7).word == "5"


def test_completion_offers_only_what_the_command_and_the_model_take():
    assert "8 target pos. reached" not in labels("SAP |")
    assert "8 target pos. reached" in labels("GAP |")
    assert "0 target (next) position" not in labels("STAP |")
    assert "6 absolute max. current" in labels("SAP |")
    assert "6 absolute max. current" not in labels("SAP |", model=342)
    assert "133 random number" not in labels("SGP |")


def test_parameters_are_found_by_their_keys_and_inserted_as_numbers():
    text, place = at("SAP |")
    (item,) = [i for i in completions.completions(analysis(text), place) if "max_speed" in i.filter]
    assert item.insert == "4"
    assert "Top speed" in item.documentation


def test_the_signature_shows_the_operand_at_the_cursor():
    text, place = at("Go: SAP 4, |")
    signature = completions.signature(analysis(text), place)
    assert signature.label == "SAP <parameter>, <motor>, <value>"
    assert [label for label, _ in signature.parameters] == ["<parameter>", "<motor>", "<value>"]
    assert signature.active == 1
    for marked in ("|", "SAP|", "X = |", "SAP 1, 2, 3, |", "foo |"):
        assert completions.signature(analysis(at(marked)[0]), at(marked)[1]) is None


def test_names_lead_to_their_definition_and_references():
    program = analysis()
    use = TextPosition("x.tmc", 9, 16)
    assert names.definition(program, use)[1:] == (6, 1, 6)
    assert [r.line for r in names.references(program, use)] == [6, 10, 12]
    assert [r.line for r in names.references(program, use, definition=False)] == [10, 12]
    assert names.definition(program, TextPosition("x.tmc", 0, 5)) is None
    assert names.references(program, TextPosition("x.tmc", 0, 5)) == []


def test_a_label_called_like_a_command_is_no_command():
    program = analysis("Stop: STOP\nJA Stop")
    assert len(names.references(program, TextPosition("x.tmc", 0, 2))) == 2
    assert names.references(program, TextPosition("x.tmc", 0, 8)) == []


def test_renaming_changes_every_use_and_nothing_else():
    edits = names.rename(analysis(), TextPosition("x.tmc", 2, 2), "Top")
    assert [(e.location.line, e.location.column, e.text) for e in edits] == [
        (3, 1, "Top"),
        (6, 19, "Top"),
        (8, 16, "Top"),
    ]
    for name in ("1st", "", "a b", "Start", "Größe"):
        with pytest.raises(ValueError, match=r"."):
            names.rename(analysis(), TextPosition("x.tmc", 2, 2), name)
    with pytest.raises(ValueError, match="no label or constant"):
        names.rename(analysis(), TextPosition("x.tmc", 0, 3), "Top")
    assert names.rename(analysis(), TextPosition("x.tmc", 2, 2), "SPEED")


def test_the_outline_tells_labels_from_subroutines_and_where_they_end():
    outline = names.outline(analysis(), "x.tmc")
    assert [(e.symbol.name, e.is_subroutine, e.last_line) for e in outline] == [
        ("Speed", False, 3), ("Turn", False, 4), ("Start", False, 12), ("Sub", True, 16),
    ]  # fmt: skip


def test_comments_constants_and_labels_fold():
    folds = [(f.first, f.last, f.kind) for f in appearance.folds(analysis(), "x.tmc")]
    assert folds == [(0, 1, "comment"), (2, 3, "region"), (5, 11, "region"), (13, 15, "region")]
    assert [f.kind for f in appearance.folds(analysis("#include a\n#include b\n"), "x.tmc")] == ["imports"]


def test_marked_regions_fold_within_each_other():
    text = "//endregion\nSTOP\n// #region a\nSTOP\n  //region b\nSTOP\n//endregion\nSTOP\n// #endregion\n// #region\n"
    folds = [fold for fold in appearance.folds(analysis(text), "x.tmc") if fold.kind == "region"]
    assert folds == [(2, 8, "region"), (4, 6, "region")]
    assert appearance.folds(analysis("// #regional\nSTOP\n// #endregion\n"), "x.tmc") == []


def test_words_are_coloured_by_their_meaning():
    text = "#include a.inc // x\nX=SIN(1)\nGo: MVP ABS, 0, X\nJA Go\n//! DATA 1,2,3,4\n"
    program = analysis(text)
    lines = text.split("\n")
    words = [
        (lines[c.line][c.start : c.start + c.length], c.type) for c in appearance.colours(program, "x.tmc")
    ]
    assert words == [
        ("#include", "macro"), ("a.inc", "string"), ("// x", "comment"), ("X", "variable"), ("=", "operator"),
        ("SIN", "method"), ("(", "operator"), ("1", "number"), (")", "operator"), ("Go", "function"),
        ("MVP", "keyword"), ("ABS", "enumMember"), ("0", "number"), ("X", "variable"), ("JA", "keyword"),
        ("Go", "function"), ("//! DATA 1,2,3,4", "macro"),
    ]  # fmt: skip
    assert {c.line for c in appearance.colours(program, "x.tmc", 2, 2)} == {2}
    assert [c.start for c in appearance.colours(program, "x.tmc", 2, 2) if c.definition] == [0]


def test_hints_show_addresses_parameter_names_and_physical_values():
    hints = [(h.line, h.kind, h.text) for h in values.hints(analysis(), "x.tmc", 5, 9)]
    assert hints == [
        (5, "address", "0000"), (5, "parameter", "maximum positioning speed"), (5, "value", "119.2 steps/s"),
        (6, "address", "0001"), (6, "parameter", "pulse divisor"),
        (7, "address", "0002"), (7, "value", "238.4 steps/s"),
        (8, "address", "0003"), (8, "value", "1.5 s"),
        (9, "address", "0004"),
    ]  # fmt: skip


def test_hints_do_not_say_again_what_the_comment_says():
    text = "SAP 4, 0, 500 // maximum positioning speed\nWAIT TICKS, 0, 25 // 0.25 s\n"
    shown = [(h.kind, h.text) for h in values.hints(analysis(text), "x.tmc", 0, 1) if h.kind != "address"]
    assert shown == [("value", "238.4 steps/s")]


def apply(text, edits):
    lines = text.split("\n")
    for edit in sorted(edits, key=lambda e: e.location, reverse=True):
        _, line, column, end = edit.location
        lines[line - 1] = lines[line - 1][: column - 1] + edit.text + lines[line - 1][end - 1 :]
    return "\n".join(lines)


def test_fixes_come_as_actions_and_rules_can_be_ignored():
    text = "MPV ABS, 0, 1\nROR 5, 9999 // fast\nSTOP"
    program = analysis(text)
    assert [a.title for a in actions.actions(program, "x.tmc", 0, 0)] == ["Change to MVP ABS, 0, 1"]
    titles = [a.title for a in actions.actions(program, "x.tmc", 1, 1)]
    assert titles == ["Ignore W303 on this line", "Change 9999 to 2047", "Ignore W307 on this line"]
    for action in actions.actions(program, "x.tmc", 0, 2):
        before = [d.code for d in program.findings]
        after = [d.code for d in analysis(apply(text, action.edits)).findings]
        assert before.count(action.diagnostic.code) > after.count(action.diagnostic.code)


def test_ignoring_twice_makes_one_comment():
    text = "ROR 5, 9999\nSTOP"
    for _ in range(2):
        program = analysis(text)
        action = next(a for a in actions.actions(program, "x.tmc", 0, 0) if a.title.startswith("Ignore"))
        text = apply(text, action.edits)
    assert text == "ROR 5, 9999 // lint: ignore W303, W307\nSTOP"
    assert not analysis(text).findings


def test_formatting_touches_only_the_lines_that_change():
    text = "        STOP\nja 0"
    edits = actions.format_edits(analysis(text), "x.tmc")
    assert len(edits) == 2
    assert apply(text, edits) == "        STOP\n        JA    0\n"


@given(SOURCES)
@settings(max_examples=60)
def test_format_edits_do_what_the_formatter_does(text):
    text = "\n".join(split_lines(text))
    edits = actions.format_edits(analysis(text), "x.tmc")
    assert split_lines(apply(text, edits)) == split_lines(format_source(text))


@given(SOURCES | st.text(max_size=200), st.data())
@settings(max_examples=100)
def test_every_question_has_an_answer_everywhere(text, data):
    program = analysis(text)
    lines = program.assembly.sources["x.tmc"]
    line = data.draw(st.integers(0, len(lines)))
    place = TextPosition(
        "x.tmc", line, data.draw(st.integers(0, len(lines[line]) + 1 if line < len(lines) else 3))
    )
    hovers.hover(program, place)
    completions.completions(program, place)
    completions.signature(program, place)
    names.definition(program, place)
    if program.symbol_at(place) is not None:
        assert names.rename(program, place, "Quite_new_name")
    values.hints(program, "x.tmc", 0, len(lines))
    for action in actions.actions(program, "x.tmc", 0, len(lines)):
        assert action.edits
    end = (0, 0)
    for word in appearance.colours(program, "x.tmc"):
        assert (word.line, word.start) >= end
        assert word.type in TOKEN_TYPES
        assert word.length > 0
        end = (word.line, word.start + word.length)
    for fold in appearance.folds(program, "x.tmc"):
        assert 0 <= fold.first < fold.last <= len(lines)
    for entry in names.outline(program, "x.tmc"):
        assert entry.last_line >= entry.symbol.definition.line
    cursor_at(lines[line] if line < len(lines) else "", place.column)


def test_names_of_the_tool_chains_own_file_have_no_place_and_cannot_be_renamed():
    program = analysis(
        "#include TMCLParam.tmc\nSAP APMaxCurrent, 0, 5\nGAP APMaxCurrent, 0", include=no_includes
    )
    place = TextPosition("x.tmc", 1, 6)
    assert names.definition(program, place) is None
    assert [location.line for location in names.references(program, place)] == [2, 3]
    with pytest.raises(ValueError, match=r"APMaxCurrent is a name of TMCLParam\.tmc"):
        names.rename(program, place, "Current")


def test_an_include_without_its_sign_has_colours():
    program = analysis("include names.inc\nSTOP", include=no_includes)
    words = [(w.start, w.length, w.type) for w in appearance.colours(program, "x.tmc", 0, 0)]
    assert words == [(0, 7, "macro"), (8, 9, "string")]


def test_hints_of_a_range_beyond_the_end_are_those_of_the_file():
    programs, _ = workspace()
    programs.put("/p/main.tmc", "ROR 0, 5\nSTOP")
    program = programs.analysis("/p/main.tmc")
    assert values.hints(program, "/p/main.tmc", 0, 2**31) == values.hints(program, "/p/main.tmc", 0, 1)


# Files that belong together


class MemoryFiles:
    """Files by name."""

    def __init__(self, files):
        self.files = files

    def read(self, name):
        if name not in self.files:
            raise FileNotFoundError(2, "No such file or directory")
        return self.files[name]

    def names(self, folder):
        return [posixpath.basename(name) for name in self.files if posixpath.dirname(name) == folder]


def workspace(files=()):
    files = dict(files)

    return Workspace(MemoryFiles(files), ["/lib"]), files


def test_open_files_stand_before_those_on_disk():
    programs, _ = workspace({"/p/names.inc": "X = 1", "/lib/more.inc": "Y = 2"})
    programs.put("/p/main.tmc", "#include names.inc\n#include more.inc\nCOMP X\nCOMP Y")
    assert [i.value for i in programs.analysis("/p/main.tmc").assembly.program] == [1, 2, 0]
    programs.put("/p/names.inc", "X = 5")
    assert [i.value for i in programs.analysis("/p/main.tmc").assembly.program] == [5, 2, 0]
    programs.close("/p/names.inc")
    assert [i.value for i in programs.analysis("/p/main.tmc").assembly.program] == [1, 2, 0]


def test_an_included_file_is_judged_as_a_part_of_its_program():
    programs, _ = workspace()
    programs.put("/p/sub.inc", "Sub: ROR 0, X\nRSUB")
    assert programs.analysis("/p/sub.inc").diagnostics("/p/sub.inc")
    programs.put("/p/main.tmc", "X = 1\nCSUB Sub\nSTOP\n#include sub.inc")
    assert programs.analysis("/p/sub.inc").diagnostics("/p/sub.inc") == []
    assert set(programs.together("/p/sub.inc")) == {"/p/sub.inc", "/p/main.tmc"}
    assert set(programs.together("/p/main.tmc")) == {"/p/sub.inc", "/p/main.tmc"}
    programs.close("/p/main.tmc")
    assert programs.analysis("/p/sub.inc").diagnostics("/p/sub.inc")


def test_mistakes_in_an_included_file_show_at_the_include_line():
    programs, files = workspace({"/p/a.inc": "#include b.inc", "/p/b.inc": "STOP // lint: ignore\nfoo 1"})
    programs.put("/p/main.tmc", "STOP\n#include a.inc // more")
    (found,) = programs.analysis("/p/main.tmc").diagnostics("/p/main.tmc")
    assert found.location[1:] == (2, 1, 23)
    assert found.text.startswith("/p/b.inc:2: no command foo")
    files["/p/b.inc"] = "// nothing"
    programs.refresh()
    assert [d.code for d in programs.analysis("/p/main.tmc").diagnostics("/p/main.tmc")] == []


def test_a_text_that_is_replaced_leaves_nothing_for_the_garbage_collector():
    programs, _ = workspace({"/lib/names.inc": "X = 1"})
    texts = (
        "#include names.inc\n#include TMCLParam.tmc\nROR 0, X + APMaxSpeed\nSTOP",
        "#include missing.inc\nROR 0, Y +\nL: JA L + 1",
    )
    gc.collect()
    gc.disable()
    try:
        for text in texts:
            programs.put("/p/main.tmc", text)
            programs.analysis("/p/main.tmc").diagnostics("/p/main.tmc")
        programs.close("/p/main.tmc")
        assert gc.collect() == 0
    finally:
        gc.enable()


def test_a_missing_include_is_found_once_it_is_opened():
    programs, _ = workspace()
    programs.put("/p/main.tmc", "#include new.inc\nSTOP")
    assert [d.code for d in programs.analysis("/p/main.tmc").diagnostics("/p/main.tmc")] == ["E501"]
    programs.put("/p/new.inc", "")
    assert programs.analysis("/p/main.tmc").diagnostics("/p/main.tmc") == []


def test_the_model_changes_the_findings():
    programs, _ = workspace()
    programs.put("a", "SAP 6, 0, 1\nSTOP")
    assert programs.analysis("a").diagnostics("a") == []
    programs.set_model(342)
    assert [d.code for d in programs.analysis("a").diagnostics("a")] == ["W302"]


def test_files_that_include_each_other_are_both_judged():
    programs, _ = workspace()
    programs.put("/a.inc", "#include b.inc\nSTOP")
    programs.put("/b.inc", "#include a.inc\nSTOP")
    assert programs.analysis("/a.inc").diagnostics("/a.inc")
    assert programs.analysis("/b.inc").diagnostics("/b.inc")
    assert set(programs.together("/a.inc")) == {"/a.inc", "/b.inc"}


def test_an_include_file_opened_alone_is_judged_from_the_program_in_its_folder():
    programs, files = workspace(
        {"/p/main.tmc": "X = 1\nCSUB Sub\nSTOP\n#include Sub.INC", "/p/notes.txt": "// nothing"}
    )
    files["/p/sub.inc"] = ""
    programs.put("/p/sub.inc", "Sub: ROR 0, X\nRSUB")
    assert programs.analysis("/p/sub.inc").diagnostics("/p/sub.inc") == []
    programs.put("/p/sub.inc", "Sub: ROR 0, Y\nRSUB")
    assert [d.code for d in programs.analysis("/p/sub.inc").diagnostics("/p/sub.inc")] == ["E301"]


def test_names_of_files_match_without_regard_to_case():
    programs, _ = workspace({"/p/Names.inc": "X = 1"})
    programs.put("/p/main.tmc", "#include names.INC\nCOMP X")
    assert "/p/Names.inc" in programs.analysis("/p/main.tmc").assembly.sources


def test_the_file_of_the_tool_chain_has_no_place_to_go_to():
    program = analysis("#include TMCLParam.tmc\nSAP APMaxCurrent, 0, 5\nSTOP", include=no_includes)
    assert names.definition(program, TextPosition("x.tmc", 0, 12)) is None
    assert "absolute max. current" in hovers.hover(program, TextPosition("x.tmc", 1, 6)).text


def test_rules_are_switched_for_all_programs():
    programs, _ = workspace()
    programs.put("a", "ROR 9, 1\nL: GIO 0, 0\nJC ZE, L\nSTOP")
    assert [d.code for d in programs.analysis("a").diagnostics("a")] == ["W303"]
    programs.set_rules((DEFAULT | {"W206"}) - {"W303"})
    assert [d.code for d in programs.analysis("a").diagnostics("a")] == ["W206"]
