"""The page: what a debugger shows beside the source, the outline, comparison, Save as, and real breakpoints."""

from __future__ import annotations

import re
from typing import Any

from playwright.sync_api import Page, expect

from ide.page.driver import Ide, OpenIde, arm, line, shown, tab, until
from tmcm34x.host import Connection, Program
from tmcm34x.toolchain.assembler import assemble

HELD = ".cm-line.execution.held"
LOOP = """\
        SGP 1, 2, 30000
Loop:   GGP 1, 2
        CALC SUB, 1
        AGP 1, 2
        COMP 0
        JC LT, Never
        CSUB Rest
        JA Loop
Never:  STOP
Rest:   WAIT TICKS, 0, 1
        RSUB
"""


def put(page: Page, ide: Ide, text: str) -> None:
    """Have another program in the file in front."""
    (ide.folder / "program.tmc").write_text(text)
    expect(shown(page, "program.tmc")).to_contain_text(text.split(maxsplit=1)[0])


def condition(page: Page, row: int, text: str) -> None:
    """Set a condition on the breakpoint of a line."""
    page.locator(".breakpoints .cm-gutterElement").nth(row).click(button="right")
    page.get_by_role("textbox", name="Hold when").fill(text)
    page.get_by_role("button", name="Set", exact=True).click()


def test_a_condition_that_cannot_be_read_holds_and_says_why(page: Page):
    condition(page, 4, "accumulator >")
    page.keyboard.press("F9")
    expect(page.locator(HELD)).to_contain_text("CALC ADD, 1")
    expect(page.locator(".notice.error")).to_contain_text("cannot be read: a value is missing")
    condition(page, 4, "ap[4][0] / 0 > 1")
    page.keyboard.press("F9")
    expect(
        page.locator(".notice.error", has_text="the condition has no value: division by zero")
    ).to_be_visible()
    expect(page.locator(HELD)).to_contain_text("CALC ADD, 1")


def test_hits_are_counted_beside_the_line_and_in_the_list(page: Page):
    tab(page, "Program")
    condition(page, 5, "accumulator % 3 == 0")
    for hits in (1, 2):
        page.keyboard.press("F9")
        expect(page.locator(".breakpoint-list .pill")).to_have_text(f"met {hits}×")
        expect(page.locator(HELD)).to_contain_text("CSUB Rest")
    expect(page.locator(".cm-gutters .met")).to_have_text("2")
    expect(page.get_by_role("textbox", name="accumulator")).to_have_value("6")


def test_values_stand_beside_the_lines_while_the_program_is_held(page: Page, ide: Ide):
    put(page, ide, LOOP)
    condition(page, 8, "gp[1] == 29997")
    page.keyboard.press("F9")
    expect(page.locator(HELD)).to_contain_text("JA Loop")
    row = page.locator(".cm-line", has_text="GGP 1")
    expect(row.locator(".live-value")).to_have_text("= 29\u2009997")
    expect(page.locator(".cm-line", has_text="JC LT").locator(".live-value")).to_have_text("flags greater")
    page.keyboard.press("Alt+v")
    expect(page.locator(".live-value")).to_have_count(0)
    page.keyboard.press("Alt+v")
    expect(row.locator(".live-value")).to_be_visible()
    page.locator(".breakpoints .cm-gutterElement").nth(8).click()
    page.keyboard.press("F9")
    expect(page.locator(".live-value")).to_have_count(0)


def test_values_are_shown_while_virtual_time_runs_slowly(page: Page, ide: Ide):
    put(page, ide, LOOP)
    page.keyboard.press("F9")
    expect(page.locator(".status-bar .pill").first).to_have_text("running")
    expect(page.locator(".live-value")).to_have_count(0)
    page.get_by_role("combobox", name="Speed of time").select_option("0.1")
    expect(page.locator(".cm-line", has_text="GGP 1").locator(".live-value")).to_have_text(
        re.compile(r"= .?\d")
    )


def test_the_editor_follows_the_running_line_when_asked(page: Page, ide: Ide):
    waits = "WAIT TICKS, 0, 20\n" * 2
    put(page, ide, "Near: JA Far\n" + "// between\n" * 300 + f"Far: {waits}JA Far\n")
    page.keyboard.press("F9")
    expect(page.locator(".status-bar .pill").first).to_have_text("running")
    expect(page.locator(".cm-line.execution")).to_have_count(0)
    tab(page, "Program")
    button = page.get_by_role("button", name="Follow the running line")
    expect(button).to_have_attribute("aria-pressed", "false")
    button.click()
    expect(button).to_have_attribute("aria-pressed", "true")
    expect(page.locator(".cm-line.execution")).to_be_visible()


def test_the_outline_shows_labels_routines_and_variables_with_their_lines(page: Page, ide: Ide):
    put(page, ide, LOOP)
    page.keyboard.press("Control+Shift+o")
    outline = page.locator(".outline")
    expect(outline.locator(".labels li")).to_have_count(3)
    expect(outline.locator(".summary")).to_contain_text("1 of 8")
    routine = outline.get_by_role("row", name="start")
    expect(routine).to_contain_text("Rest")
    expect(outline.get_by_role("row", name="Rest", exact=False).last).to_contain_text(
        "1 instruction, 0.100 ms"
    )
    variable = outline.locator(".variable-uses tbody tr")
    expect(variable).to_have_text(re.compile("1.*1, 4.*2"))
    outline.locator(".labels").get_by_role("button", name="Rest").click()
    expect(page.locator(".cm-activeLine")).to_contain_text("WAIT TICKS")
    variable.get_by_role("button", name="4", exact=True).click()
    expect(page.locator(".cm-activeLine")).to_contain_text("AGP 1")


def test_the_palette_finds_labels_and_commands(page: Page):
    for wish, title in (("rest", "Rest"), ("find and", "Find and replace"), ("firmware", "Firmware and reset"),
                        ("export", "Export settings as TOML"), ("import", "Import settings…"),
                        ("wave", "Microstep wave"), ("compare", "Compare with the program in the module")):  # fmt: skip
        page.keyboard.press("Control+p")
        page.get_by_role("textbox", name="File or command").fill(wish)
        expect(page.get_by_role("option").filter(has_text=title).first).to_be_visible()
        page.keyboard.press("Escape")
        expect(page.get_by_role("dialog")).to_have_count(0)
    page.keyboard.press("Control+p")
    page.get_by_role("textbox", name="File or command").fill("rest")
    page.get_by_role("option").filter(has_text="label, line 7").click()
    expect(page.locator(".cm-activeLine")).to_contain_text("WAIT TICKS")


def test_coverage_of_the_live_program_marks_its_lines(page: Page, ide: Ide):
    put(page, ide, LOOP)
    page.keyboard.press("Alt+c")
    page.keyboard.press("F9")
    expect(page.locator(".coverage-mark.covered").first).to_be_visible()
    missed = page.locator(".coverage-mark.missed")
    expect(missed).to_have_count(1)
    expect(missed).to_have_attribute("title", "never executed")
    expect(page.locator(".coverage-mark.half")).to_have_attribute(
        "title", re.compile("executed .*, never jumped")
    )
    tab(page, "Outline")
    expect(page.locator(".outline .summary")).to_contain_text("10 of 11")
    page.keyboard.press("Alt+c")
    expect(page.locator(".coverage-mark")).to_have_count(0)


def test_coverage_of_a_run_is_shown_from_its_tracefile(page: Page, ide: Ide):
    trace = ide.folder / "run.info"
    trace.write_text("TN:\nSF:somewhere/program.tmc\nDA:3,1\nDA:4,0\nend_of_record\n")
    page.keyboard.press("Control+p")
    page.get_by_role("textbox", name="File or command").fill("tracefile")
    with page.expect_file_chooser() as chooser:
        page.get_by_role("option").filter(has_text="coverage of a tracefile").click()
    chooser.value.set_files(trace)
    expect(page.locator(".coverage-mark.covered")).to_have_count(1)
    expect(page.locator(".coverage-mark.missed")).to_have_count(1)
    expect(page.locator(".notice")).to_contain_text("1 of 2 commands")


def test_the_text_is_compared_with_its_file_and_with_the_module(page: Page):
    page.keyboard.press("F6")
    expect(page.locator(".notice", has_text="are in the module")).to_have_count(1)
    page.get_by_text("Speed = ").click()
    page.keyboard.press("End")
    page.keyboard.type("0")
    page.keyboard.press("Alt+d")
    rows = page.locator(".compare tr.changed")
    expect(rows).to_have_count(1)
    expect(rows).to_have_text("2Speed = 5002Speed = 5000")
    expect(page.locator(".compare .pill")).to_have_text("1 line differs")
    page.locator(".compare .folded button").last.click()
    expect(page.locator(".compare td", has_text="JA Loop").first).to_be_visible()
    rows.get_by_role("button", name="Line 2").click()
    expect(page.locator(".cm-activeLine")).to_contain_text("Speed = 5000")
    expect(shown(page, "program.tmc")).to_be_focused()
    page.keyboard.press("End")
    page.keyboard.press("Backspace")
    page.keyboard.press("Alt+m")
    expect(page.locator(".compare .pill")).to_have_text("no difference")


def test_a_text_is_saved_under_another_name(page: Page, ide: Ide):
    (ide.folder / "other.tmc").write_text("STOP\n")
    page.keyboard.press("Control+Alt+s")
    field = page.get_by_role("textbox", name="Path in the opened folder")
    field.fill("copy.tmc")
    field.press("Enter")
    expect(page.get_by_role("tab", name="copy.tmc")).to_have_attribute("aria-selected", "true")
    assert (ide.folder / "copy.tmc").read_text() == (ide.folder / "program.tmc").read_text()
    page.keyboard.press("Control+Alt+s")
    field.fill("other.tmc")
    field.press("Enter")
    page.get_by_role("button", name="Write over it").click()
    expect(page.get_by_role("tab", name="other.tmc")).to_have_attribute("aria-selected", "true")
    assert (ide.folder / "other.tmc").read_text() == (ide.folder / "program.tmc").read_text()


def test_the_assembler_s_options_count_for_what_is_downloaded(page: Page, ide: Ide):
    put(page, ide, "#if MODEL == 342\nROR 0, 342\n#else\nROR 0, 343\n#endif\n")
    page.get_by_role("button", name="Tools", exact=True).click()
    page.get_by_role("button", name="Assembler options").click()
    page.get_by_role("combobox", name="Assembled for").select_option("342")
    page.get_by_role("switch", name="Append STOP").click()
    page.get_by_role("button", name="Listing", exact=True).click()
    expect(page.locator(".listing-line")).to_have_count(1)
    expect(page.locator(".listing-line")).to_contain_text("ROR 0, 342")
    page.get_by_role("button", name="Tools", exact=True).click()
    page.get_by_role("switch", name="Append STOP").click()
    page.get_by_role("button", name="Listing", exact=True).click()
    expect(page.locator(".listing-line")).to_have_count(2)


def test_replies_stand_with_their_requests_and_the_time_between(page: Page):
    tab(page, "Direct mode")
    line(page, "GAP 4, 0")
    expect(page.locator(".answers .value").first).to_have_text("1000")
    tab(page, "Telegrams")
    reply = page.locator(".telegram.out", has_text="value 1000")
    expect(reply.locator(".latency")).to_have_text(re.compile(r"\d+\.\d\d ms"))
    reply.click()
    expect(page.locator(".telegram.pair")).to_have_count(2)
    expect(page.locator(".telegram.pair").first).to_contain_text("GAP 4, 0")
    page.get_by_role("log", name="Telegrams").press("ArrowUp")
    expect(page.locator(".telegram.chosen")).to_contain_text("GAP 4, 0")


def test_another_host_s_program_is_known_marked_and_takes_breakpoints(open_ide: OpenIde):
    page, ide = open_ide("--tcp", "127.0.0.1:0")
    (ide.folder / "theirs.tmc").write_text("// theirs\nLoop: CALC ADD, 1\nWAIT TICKS, 0, 1\nJA Loop\n")
    ((_, address),) = ide.links
    program = assemble("Loop: CALC ADD, 1\nWAIT TICKS, 0, 1\nJA Loop\nSTOP\n").program
    with Connection.open(f"tcp://{address}?timeout=30") as other:
        Program(other).download(program)
        notice = page.locator(".notice", has_text="Another host")
        expect(notice).to_contain_text("theirs.tmc")
        notice.get_by_role("button", name="Open it").click()
        Program(other).restart()
        expect(page.locator(".cm-line.execution")).to_be_visible()
        page.locator(".code:not([hidden]) .breakpoints .cm-gutterElement").nth(4).click()
        expect(page.locator(HELD)).to_contain_text("JA Loop")
        Program(other).stop()
        Program(other).download(assemble("ROR 1, 7\nLoop: JA Loop\n").program)
        page.get_by_role("button", name="Upload it").click()
        expect(shown(page, "uploaded.tmc")).to_contain_text("ROR 1, 7")
        Program(other).restart()
        expect(shown(page, "uploaded.tmc").locator(".cm-line.execution")).to_contain_text("JA")


def test_a_breakpoint_holds_the_program_of_a_real_module(serve: Any, open_ide: OpenIde):
    served = serve("--tcp", "127.0.0.1:0")
    page, _ = open_ide("--port", f"tcp://{served.tcp}")
    arm(page)
    tab(page, "Program")
    page.locator(".breakpoints .cm-gutterElement").nth(5).click()
    page.keyboard.press("F9")
    expect(page.locator(HELD)).to_contain_text("CSUB Rest")
    expect(page.locator(".status-bar .pill").first).to_have_text("held")
    expect(page.locator(".breakpoint-list .pill")).to_have_text("met 1×")
    page.keyboard.press("F9")
    expect(page.locator(".breakpoint-list .pill")).to_have_text("met 2×")
    page.locator(".breakpoints .cm-gutterElement").nth(5).click()
    page.keyboard.press("F9")
    expect(page.locator(".status-bar .pill").first).to_have_text("running")
    with Connection.open(f"tcp://{served.tcp}?timeout=30") as observer:
        until(page, lambda: Program(observer).state.status == 1)
