"""The page: editor, program and debugger, on a virtual module."""

from __future__ import annotations

import re

from playwright.sync_api import Page, WebSocketRoute, expect

from ide.page.driver import Ide, drafted, figure, rename, rest_on, shown, tab, until


def test_one_click_runs_the_program_and_another_stops_it(page: Page):
    page.get_by_role("button", name="Run", exact=True).click()
    expect(page.locator(".status-bar .pill").first).to_have_text("running")
    until(page, lambda: figure(page, 0, "speed") == 500)
    page.get_by_role("button", name="Stop", exact=True).first.click()
    expect(page.locator(".status-bar .pill").first).to_have_text("stopped")
    assert figure(page, 0, "speed") == 500
    page.keyboard.press("F10")
    until(page, lambda: figure(page, 0, "speed") == 0)


def test_a_changed_speed_runs_at_the_next_click(page: Page, ide: Ide):
    page.get_by_text("Speed = ").click()
    page.keyboard.press("End")
    page.keyboard.press("Backspace")
    page.keyboard.press("F9")
    until(page, lambda: figure(page, 0, "speed") == 50)
    assert "Speed = 50\n" in (ide.folder / "program.tmc").read_text()


def test_a_breakpoint_holds_and_steps_move_the_line(page: Page):
    page.locator(".breakpoints .cm-gutterElement").nth(5).click()
    expect(page.locator(".cm-gutters .breakpoint:visible")).to_have_count(1)
    tab(page, "Program")
    page.keyboard.press("F9")
    expect(page.locator(".cm-line.execution.held")).to_contain_text("CSUB Rest")
    accumulator = page.get_by_role("textbox", name="accumulator")
    expect(accumulator).to_have_value("1")
    page.keyboard.press("F7")
    expect(page.locator(".cm-line.execution.held")).to_contain_text("WAIT TICKS")
    expect(page.locator(".stack li")).to_have_count(2)
    page.keyboard.press("Control+F7")
    expect(page.locator(".cm-line.execution.held")).to_contain_text("JA Loop")
    page.keyboard.press("F9")
    expect(accumulator).to_have_value("2")
    page.locator(".breakpoints .cm-gutterElement").nth(5).click()
    page.keyboard.press("F9")
    expect(page.locator(".status-bar .pill").first).to_have_text("running")


def test_a_mistake_is_underlined_listed_and_found_by_a_click(page: Page):
    page.get_by_text("JA Loop").click()
    page.keyboard.press("End")
    page.keyboard.type("X")
    expect(page.locator(".cm-lintRange-error").first).to_be_visible()
    page.get_by_role("tab", name=re.compile("Problems")).click()
    problem = page.locator(".problem.error").first
    expect(problem).to_contain_text("program.tmc:6")
    page.locator(".cm-content").press("Control+Home")
    problem.click()
    expect(page.locator(".cm-activeLine")).to_contain_text("JA LoopX")
    page.keyboard.press("F9")
    expect(page.locator(".notice.error")).to_be_visible()
    expect(page.locator(".status-bar .pill").first).to_have_text("stopped")


def test_the_language_server_completes_explains_and_mends(page: Page):
    expect(page.get_by_text("language server", exact=True)).to_be_visible()
    page.locator(".cm-content").press("Control+End")
    page.keyboard.type("SAP ", delay=20)
    expect(page.locator(".cm-tooltip-autocomplete")).to_contain_text("maximum positioning speed")
    page.keyboard.press("Escape")
    page.keyboard.type("4, 0, 1\nMWP ABS, 0, 5")
    expect(page.locator(".inlay", has_text="maximum positioning speed")).to_be_visible()
    change = page.get_by_role("button", name="Change to MVP")
    rest_on(page.locator(".cm-lintRange-error").last, change)
    change.click()
    expect(page.locator(".cm-content")).to_contain_text("MVP ABS, 0, 5")
    expect(page.locator(".cm-lintRange-error")).to_have_count(0)
    manual = page.locator(".cm-tooltip-hover", has_text="jump always")
    rest_on(page.locator(".cm-line", has_text="JA Loop").get_by_text("JA"), manual)


def test_watches_and_registers_are_seen_and_changed(page: Page):
    tab(page, "Program")
    field = page.get_by_role("textbox", name="New watch")
    field.fill("gp[7] * 2")
    field.press("Enter")
    expect(page.get_by_role("textbox", name="Value of gp[7] * 2")).to_have_value("0")
    variable = page.get_by_role("textbox", name="User variable 7")
    variable.fill("21")
    variable.press("Enter")
    expect(page.get_by_role("textbox", name="Value of gp[7] * 2")).to_have_value("42")
    register = page.get_by_role("textbox", name="accumulator")
    register.fill("-9")
    register.press("Enter")
    expect(page.locator(".status-bar")).to_contain_text("accumulator -9")
    page.get_by_role("button", name="ETO").click()
    expect(page.get_by_role("button", name="ETO")).to_have_attribute("aria-pressed", "true")


def test_unsaved_text_is_marked_saved_by_key_and_kept_over_a_reload(page: Page, ide: Ide):
    page.locator(".cm-content").press("Control+Home")
    page.keyboard.type("// hello\n")
    expect(page.locator(".tab .dot")).to_be_visible()
    drafted(page, "program.tmc")
    page.reload()
    expect(page.locator(".cm-content")).to_contain_text("// hello")
    expect(page.locator(".tab .dot")).to_be_visible()
    assert "hello" not in (ide.folder / "program.tmc").read_text()
    page.keyboard.press("Control+s")
    expect(page.locator(".tab .dot")).to_have_count(0)
    assert (ide.folder / "program.tmc").read_text().startswith("// hello\n")


def _text(ide: Ide, name: str) -> str:
    """What is in a file, or nothing."""
    path = ide.folder / name
    return path.read_text() if path.exists() else ""


def test_a_change_from_outside_is_taken_or_asked_about(page: Page, ide: Ide):
    (ide.folder / "program.tmc").write_text("STOP // from outside\n")
    expect(page.locator(".cm-content")).to_contain_text("from outside")
    page.locator(".cm-content").press("Control+Home")
    page.keyboard.type("// mine\n")
    (ide.folder / "program.tmc").write_text("STOP // again\n")
    expect(page.locator(".outside")).to_contain_text("changed outside")
    expect(page.locator(".cm-content")).to_contain_text("// mine")
    page.get_by_role("button", name="Take the file").click()
    expect(page.locator(".cm-content")).to_contain_text("again")
    (ide.folder / "program.tmc").unlink()
    expect(page.locator(".outside")).to_contain_text("deleted")
    page.get_by_role("button", name="Save it again").click()
    expect(page.locator(".outside")).to_have_count(0)
    until(page, lambda: _text(ide, "program.tmc") == "STOP // again\n")


def test_a_new_program_is_written_saved_and_renamed(page: Page, ide: Ide):
    page.keyboard.press("Alt+n")
    expect(shown(page, "program2.tmc")).to_be_focused()
    page.keyboard.type("STOP\n")
    page.keyboard.press("Control+s")
    expect(page.locator(".tab .dot")).to_have_count(0)
    until(page, lambda: _text(ide, "program2.tmc").startswith("STOP"))
    rename(page, "program2.tmc")
    page.locator(".rename").fill("other.tmc")
    page.locator(".rename").press("Enter")
    expect(page.get_by_role("tab", name="other.tmc")).to_be_visible()
    until(page, (ide.folder / "other.tmc").exists)


def test_a_field_keeps_what_is_typed_while_the_page_moves_on(page: Page, ide: Ide):
    rename(page, "program.tmc")
    page.locator(".rename").fill("half a na")
    (ide.folder / "other.tmc").write_text("STOP\n")
    expect(page.get_by_role("treeitem", name="other.tmc")).to_be_visible()
    expect(page.locator(".rename")).to_have_value("half a na")
    page.keyboard.press("Escape")
    tab(page, "Program")
    field = page.get_by_role("textbox", name="New watch")
    field.fill("time_ms")
    field.press("Enter")
    watch = page.get_by_role("textbox", name="Watch 0")
    watch.fill("half an expr")
    value = page.get_by_role("textbox", name="Value of time_ms")
    before = value.input_value()
    until(page, lambda: value.input_value() != before)
    expect(watch).to_have_value("half an expr")


def test_find_and_replace_undo_and_the_palette(page: Page):
    page.locator(".cm-content").click()
    page.keyboard.press("Control+f")
    page.get_by_role("textbox", name="Find").fill("loop")
    expect(page.locator(".find .found")).to_have_text("2")
    page.get_by_role("button", name="Match case").click()
    expect(page.locator(".find .found")).to_have_text("nothing found")
    page.get_by_role("textbox", name="Find").fill("Loop")
    page.get_by_role("textbox", name="Find").press("Enter")
    expect(page.locator(".find .found")).to_have_text("1 of 2")
    page.get_by_role("textbox", name="Replace").fill("Round")
    page.get_by_role("button", name="Replace all matches").click()
    expect(page.locator(".cm-content")).to_contain_text("Round:")
    page.keyboard.press("Escape")
    page.locator(".cm-content").press("Control+z")
    expect(page.locator(".cm-content")).to_contain_text("Loop:")
    page.keyboard.press("Control+p")
    page.keyboard.type("listing")
    page.keyboard.press("Enter")
    expect(page.locator(".listing h2")).to_have_text("program.tmc")
    expect(page.locator(".listing-line").nth(0)).to_contain_text("01 00 00 00 00 01 f4 f6")


def test_upload_gives_source_in_a_new_page(page: Page):
    page.keyboard.press("F6")
    expect(page.locator(".notice").first).to_contain_text("instructions are in the module")
    page.get_by_role("button", name="Upload and disassemble").click()
    expect(page.get_by_role("tab", name="uploaded.tmc")).to_be_visible()
    expect(page.locator(".code:not([hidden]) .cm-content")).to_contain_text("ROR 0, 500")


def test_a_symbol_is_followed_renamed_and_the_source_formatted(page: Page):
    expect(page.get_by_text("language server", exact=True)).to_be_visible()
    page.locator(".cm-line", has_text="JA Loop").get_by_text("Loop").click()
    page.keyboard.press("F12")
    expect(page.locator(".cm-activeLine")).to_contain_text("Loop:   CALC")
    page.locator(".cm-line", has_text="JA Loop").get_by_text("Loop").click()
    page.keyboard.press("Shift+F6")
    page.locator(".cm-dialog input, .cm-panel input").fill("Round")
    page.keyboard.press("Enter")
    expect(page.locator(".cm-content")).to_contain_text("Round:")
    expect(page.locator(".cm-content")).to_contain_text("JA Round")
    expect(page.locator(".cm-lintRange-error")).to_have_count(0)
    page.mouse.move(5, 5)
    expect(page.locator(".cm-tooltip-hover")).to_have_count(0)
    page.locator(".cm-line", has_text="ROR 0").click()
    page.keyboard.press("Home")
    page.keyboard.press("Home")
    page.keyboard.type("   ")
    page.keyboard.press("Shift+Alt+f")
    expect(page.locator(".cm-line", has_text="ROR")).to_have_text(re.compile(r"^ {8}ROR +0, Speed"))
    page.keyboard.type("\nSAP ")
    page.keyboard.press("Control+Shift+Space")
    expect(page.locator(".cm-lsp-signature-tooltip")).to_contain_text("SAP")


def test_a_hover_answered_when_the_pointer_has_left_does_not_stay(page: Page):
    late: list[tuple[WebSocketRoute, str | bytes]] = []

    def carry(socket: WebSocketRoute) -> None:
        server = socket.connect_to_server()
        server.on_message(
            lambda message: (
                late.append((socket, message)) if "contents" in str(message) else socket.send(message)
            )
        )

    page.route_web_socket(re.compile("/lsp$"), carry)
    page.reload()
    expect(page.get_by_text("language server", exact=True)).to_be_visible()
    page.locator(".cm-line", has_text="ROR 0").get_by_text("ROR").hover()
    until(page, lambda: bool(late))
    page.mouse.move(5, 5)
    for socket, message in late:
        socket.send(message)
    page.wait_for_timeout(500)
    expect(page.locator(".cm-tooltip-hover")).to_have_count(0)


def test_a_refused_rename_changes_nothing(page: Page, ide: Ide):
    (ide.folder / "other.tmc").write_text("STOP\n")
    page.get_by_role("treeitem", name="other.tmc").click()
    shown(page, "other.tmc").click()
    page.keyboard.type("// not saved\n")
    for _ in range(2):
        rename(page, "program.tmc")
        page.locator(".rename").fill("other.tmc")
        page.locator(".rename").press("Enter")
        expect(page.locator(".notice.error").last).to_contain_text("other.tmc is")
    expect(page.get_by_role("tab", name="program.tmc")).to_have_count(1)
    page.get_by_role("tab", name="other.tmc").click()
    expect(page.locator(".code:not([hidden]) .cm-content")).to_contain_text("// not saved")


def test_a_renamed_file_keeps_its_breakpoint_and_is_not_called_deleted(page: Page):
    page.locator(".breakpoints .cm-gutterElement").nth(5).click()
    rename(page, "program.tmc")
    page.locator(".rename").fill("other.tmc")
    page.locator(".rename").press("Enter")
    expect(page.get_by_role("tab", name="other.tmc")).to_be_visible()
    page.wait_for_timeout(1500)
    expect(page.locator(".outside")).to_have_count(0)
    expect(page.locator(".cm-gutters .breakpoint:visible")).to_have_count(1)


def test_what_is_typed_while_a_save_is_under_way_stays(page: Page, ide: Ide):
    content = page.locator(".code:not([hidden]) .cm-content")
    content.press("Control+Home")
    for n in range(6):
        page.keyboard.type(f"// {n}\n")
        page.keyboard.press("Control+s")
        page.keyboard.press("Control+s")
    page.keyboard.type("// last\n")
    page.wait_for_timeout(1500)
    expect(page.locator(".outside")).to_have_count(0)
    page.keyboard.press("Control+s")
    expect(page.locator(".tab .dot")).to_have_count(0)
    lines = [*(f"// {n}" for n in range(6)), "// last", "// Two motors"]
    assert (ide.folder / "program.tmc").read_text().splitlines()[:8] == lines


def test_a_breakpoint_goes_with_its_line(page: Page):
    page.locator(".breakpoints .cm-gutterElement").nth(5).click()
    answered = page.locator(".cm-gutters .breakpoint:visible:is(:not(.unverified), [title*=download])")
    expect(answered).to_have_count(1)
    page.locator(".cm-line", has_text="CSUB Rest").click()
    expect(page.locator(".cm-activeLine", has_text="CSUB Rest")).to_be_visible()
    page.keyboard.press("Home")
    page.keyboard.press("Shift+ArrowUp")
    page.keyboard.press("Shift+ArrowDown")
    page.keyboard.press("Control+Shift+k")
    expect(page.locator(".cm-line", has_text="CSUB Rest")).to_have_count(0)
    expect(page.locator(".cm-gutters .breakpoint:visible")).to_have_count(0)
    page.wait_for_timeout(600)
    page.keyboard.press("F9")
    expect(page.locator(".status-bar .pill").first).to_have_text("running")
    page.wait_for_timeout(500)
    expect(page.locator(".status-bar .pill").first).to_have_text("running")


def test_each_window_keeps_its_own_unsaved_text(page: Page, ide: Ide):
    other = page.context.new_page()
    other.goto(ide.url)
    expect(other.locator(".cm-content")).to_be_visible()
    page.locator(".cm-content").press("Control+Home")
    page.keyboard.type("// of the first\n")
    drafted(page, "program.tmc")
    page.close()
    other.close()
    again = other.context.new_page()
    again.goto(ide.url)
    expect(again.locator(".cm-content")).to_contain_text("// of the first")
    again.keyboard.press("Alt+n")
    expect(shown(again, "program2.tmc")).to_be_focused()
    again.keyboard.type("// new")
    expect(shown(again, "program2.tmc")).to_contain_text("// new")
    drafted(again, "program2.tmc")
    again.keyboard.press("Alt+w")
    expect(again.locator(".notice").last).to_contain_text("is kept")
    again.keyboard.press("Alt+n")
    expect(again.get_by_role("tab", name="program3.tmc")).to_be_visible()
    again.reload()
    expect(again.get_by_role("tab", name="program2.tmc")).to_be_visible()
