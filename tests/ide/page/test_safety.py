"""The page on a module at the end of a line, with an observer on a second line who reads the true state."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from playwright.sync_api import Browser, Locator, Page, expect

from ide.page.driver import Ide, OpenIde, arm, figure, line, tab, until
from tmcm34x.host import Connection
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.mnemonic import parse_instruction


class Stage(NamedTuple):
    page: Page
    ide: Ide
    ask: Callable[[str], int]
    """Has the observer send a command; the value of its reply."""
    observer: Connection


@pytest.fixture
def earlier() -> tuple[str, ...]:
    """The program that another host has stored before the IDE comes."""
    return ()


@pytest.fixture
def stage(serve: Any, open_ide: OpenIde, earlier: tuple[str, ...]) -> Iterator[Stage]:
    served = serve("--pty", "--tcp", "127.0.0.1:0")
    with Connection.open(f"tcp://{served.tcp}?timeout=30") as observer:
        if earlier:
            load(observer, *earlier)

        def ask(text: str) -> int:
            return observer.execute(parse_instruction(text)).value

        page, ide = open_ide("--port", served.pty)
        expect(page.get_by_role("switch", name="ARMED")).to_be_enabled()
        yield Stage(page, ide, ask, observer)


def open_parameters(page: Page, words: str) -> None:
    page.get_by_role("button", name="Parameters", exact=True).click()
    page.get_by_role("textbox", name="Search parameters").fill(words)


def ask_for_factory_settings(page: Page) -> Locator:
    """Execute control function 137 in direct mode; the question that comes first."""
    tab(page, "Direct mode")
    page.get_by_role("combobox", name="Instruction").select_option("137")
    page.get_by_role("textbox", name="key of restore factory settings").fill("1234")
    page.get_by_role("button", name="Execute").click()
    dialog = page.get_by_role("dialog")
    expect(dialog).to_contain_text("All stored parameters")
    return dialog


def measure(page: Page, low: str, high: str) -> None:
    page.get_by_role("button", name="Tools", exact=True).click()
    page.get_by_role("button", name="Load profile").click()
    for name, value in (("From velocity", low), ("To velocity", high), ("Step", "50")):
        page.get_by_role("textbox", name=name).fill(value)
    page.get_by_role("button", name="Measure").click()


def test_nothing_moves_before_the_module_is_armed(stage: Stage):
    page, _, ask, _ = stage
    for name in ("Jog motor 0 right", "Move motor 0 to", "Zero motor 0", "Reference search of motor 0"):
        expect(page.get_by_role("button", name=name)).to_be_disabled()
    expect(page.get_by_role("button", name="Run", exact=True)).to_be_disabled()
    tab(page, "Direct mode")
    line(page, "ROR 0, 500")
    expect(page.locator(".notice.error")).to_contain_text("Not armed")
    assert ask("GAP 3, 0") == 0
    arm(page)
    line(page, "ROR 0, 500")
    until(page, lambda: ask("GAP 3, 0") == 500)
    page.get_by_role("switch", name="ARMED").click()
    expect(page.get_by_role("button", name="Jog motor 0 right")).to_be_disabled()


def test_empty_direct_mode_proposes_nothing_that_moves(stage: Stage):
    page, _, ask, _ = stage
    tab(page, "Direct mode")
    page.get_by_role("button", name="Execute").click()
    expect(page.locator(".answer")).to_have_count(1)
    page.get_by_role("button", name="Send again").click()
    expect(page.locator(".answer")).to_have_count(2)
    assert [ask(f"GAP 2, {motor}") for motor in range(3)] == [0, 0, 0]


def test_stop_all_ends_a_load_profile_wherever_one_looks(stage: Stage):
    page, _, ask, _ = stage
    arm(page)
    measure(page, "300", "2000")
    until(page, lambda: ask("GAP 3, 0") >= 300)
    page.get_by_role("button", name="Unit calculator").click()
    expect(page.locator(".banner.motion").get_by_role("button", name="Abort")).to_be_visible()
    page.keyboard.press("F10")
    expect(page.locator(".banner.stop")).to_contain_text("all motors have confirmed")
    assert ask("GAP 3, 0") == 0
    assert ask("GAP 2, 0") == 0
    expect(page.locator(".banner.motion")).to_have_count(0)
    page.get_by_role("button", name="Load profile").click()
    expect(page.get_by_role("button", name="Measure")).to_be_disabled()
    points = page.locator(".profile-chart circle").count()
    page.locator(".banner.stop").get_by_role("button", name="Release").click()
    assert page.locator(".profile-chart circle").count() == points
    assert ask("GAP 2, 0") == 0


def test_a_profile_is_aborted_from_any_page(stage: Stage):
    page, _, ask, _ = stage
    arm(page)
    measure(page, "1000", "2000")
    until(page, lambda: ask("GAP 3, 0") == 1000)
    page.get_by_role("button", name="Listing", exact=True).click()
    page.locator(".banner.motion").get_by_role("button", name="Abort").click()
    until(page, lambda: ask("GAP 3, 0") == 0)


def test_a_closed_page_leaves_no_motor_turning(stage: Stage, wait_for: Any):
    page, _, ask, _ = stage
    arm(page)
    measure(page, "1000", "2000")
    until(page, lambda: ask("GAP 3, 0") == 1000)
    page.close()
    assert wait_for(lambda: ask("GAP 3, 0") == 0)


def test_the_end_of_the_server_leaves_no_motor_turning(stage: Stage):
    page, ide, ask, _ = stage
    arm(page)
    tab(page, "Direct mode")
    line(page, "ROR 1, 700")
    until(page, lambda: ask("GAP 3, 1") == 700)
    page.keyboard.press("F9")
    running(page)
    until(page, lambda: ask("GAP 3, 0") == 500)
    ide.process.terminate()
    ide.process.wait(60)
    assert [ask("GAP 3, 0"), ask("GAP 3, 1"), ask("GGP 128, 0")] == [0, 0, 0]


def test_after_a_killed_server_the_next_one_tells_of_a_motor_that_turns(stage: Stage, open_ide: OpenIde):
    page, ide, ask, _ = stage
    arm(page)
    page.get_by_role("button", name="Jog motor 2 right").hover()
    page.mouse.down()
    until(page, lambda: ask("GAP 3, 2") == 400)
    ide.process.kill()
    ide.process.wait(60)
    again, _ = open_ide("--port", page_port(page))
    strip = again.locator(".banner", has_text="motor 2 (speed 400)")
    strip.get_by_role("button", name="STOP ALL").click()
    until(again, lambda: ask("GAP 3, 2") == 0)
    expect(strip).to_have_count(0)


def page_port(page: Page) -> str:
    """The port that the page shows."""
    return page.locator(".lane .place").inner_text().split(",")[0]


def test_leaving_a_field_writes_nothing(stage: Stage):
    page, _, ask, _ = stage
    arm(page)
    open_parameters(page, "target position")
    field = page.get_by_role("textbox", name="target (next) position of motor 0")
    expect(field).to_have_value("0")
    field.fill("90000")
    page.get_by_role("textbox", name="Search parameters").focus()
    expect(field).to_have_class("number unsent")
    expect(field).to_have_value("90000")
    assert (ask("GAP 0, 0"), ask("GAP 3, 0")) == (0, 0)
    field.press("Escape")
    expect(field).to_have_value("0")
    field.fill("700")
    page.get_by_role("button", name="Send target (next) position of motor 0").click()
    until(page, lambda: ask("GAP 1, 0") == 700)


def test_a_refused_value_is_not_shown_as_the_module_s(stage: Stage):
    page, _, ask, _ = stage
    open_parameters(page, "target position")
    field = page.get_by_role("textbox", name="target (next) position of motor 0")
    expect(field).to_have_value("0")
    field.fill("700")
    field.press("Enter")
    expect(page.locator(".notice.error")).to_contain_text("Not armed")
    expect(field).to_have_value("0")
    assert ask("GAP 0, 0") == 0


def test_paste_undo_and_a_line_that_comes_back_send_nothing(serve: Any, open_ide: OpenIde):
    served = serve("--tcp", "127.0.0.1:0")
    page, _ = open_ide("--port", f"tcp://{served.tcp}")
    arm(page)
    open_parameters(page, "maximum positioning speed")
    field = page.get_by_role("textbox", name="maximum positioning speed of motor 0")
    expect(field).to_have_value("1000")
    field.fill("900")
    field.press("Control+z")
    field.press("Control+Shift+z")
    expect(field).to_have_value("900")
    tab(page, "Direct mode")
    command = page.get_by_role("textbox", name="Command line")
    command.focus()
    page.keyboard.insert_text("ROR 0, 500\n")
    expect(command).to_have_value(re.compile("ROR 0, 500"))
    served.stop()
    expect(page.locator(".banner")).to_contain_text("was lost")
    again = serve("--tcp", served.tcp)
    expect(page.locator(".banner")).to_have_count(0)
    expect(page.get_by_role("switch", name="ARMED")).to_have_attribute("aria-checked", "false")
    expect(field).to_have_value("900")
    expect(field).to_have_class("number unsent")
    expect(command).to_have_value(re.compile("ROR 0, 500"))
    expect(page.locator(".answer")).to_have_count(0)
    with Connection.open(f"tcp://{again.tcp}?timeout=30") as observer:
        values = [
            observer.execute(parse_instruction(text)).value for text in ("GAP 4, 0", "GAP 3, 0", "GAP 2, 0")
        ]
    assert values == [1000, 0, 0]


def test_a_question_is_answered_before_a_key_does_anything_else(stage: Stage):
    page, _, ask, observer = stage
    arm(page)
    dialog = ask_for_factory_settings(page)
    for key in ("F9", "F6", "Shift+F9", "Control+Shift+F2"):
        page.keyboard.press(key)
    expect(dialog).to_contain_text("All stored parameters")
    dialog.get_by_role("button", name="Cancel").click()
    line(page, "GAP 4, 0")
    expect(page.locator(".answers .value").first).to_have_text("1000")
    assert ask("GGP 128, 0") == 0
    assert observer.read_instruction(0) != parse_instruction("ROR 0, 500")


def test_a_value_whose_reading_does_something_is_read_when_asked_for(stage: Stage):
    page = stage.page
    page.get_by_role("button", name="Parameters", exact=True).click()
    page.get_by_role("radio", name="Global").click()
    page.get_by_role("textbox", name="Search parameters").fill("tick timer")
    expect(page.locator("table.parameters td.cell .draft input")).not_to_have_value("0")
    page.get_by_role("textbox", name="Search parameters").fill("random")
    button = page.get_by_role("button", name="Read random number")
    expect(button).to_have_text("read")
    button.click()
    expect(button).to_have_text("again")
    expect(page.locator("table.parameters td.cell .value")).to_have_text(re.compile(r"\d+"))


def test_arrow_keys_on_the_code_protection_write_nothing(stage: Stage):
    page, _, ask, _ = stage
    arm(page)
    page.keyboard.press("F6")
    expect(page.locator(".notice").first).to_contain_text("instructions are in the module")
    page.get_by_role("button", name="Tools", exact=True).click()
    page.get_by_role("button", name="Module configuration").click()
    protection = page.get_by_role("combobox", name="TMCL code protection")
    for key in ("ArrowDown", "ArrowUp", "ArrowDown"):
        protection.press(key)
    assert ask("GGP 81, 0") == 0
    protection.press("Enter")
    dialog = page.get_by_role("dialog")
    expect(dialog).to_contain_text("TMCL code protection becomes 1")
    dialog.get_by_role("button", name="Cancel").click()
    assert ask("GGP 81, 0") == 0
    page.get_by_role("button", name="Upload and disassemble").click()
    expect(page.locator(".code:not([hidden]) .cm-content")).to_contain_text("ROR 0, 500")


def test_what_is_shown_is_what_is_sent_or_nothing_is(stage: Stage):
    page, _, ask, _ = stage
    arm(page)
    goal = page.get_by_role("textbox", name="Destination of motor 0")
    to = page.get_by_role("button", name="Move motor 0 to")
    goal.fill("500")
    goal.fill("-8388609")
    expect(goal).to_have_class("number wrong to")
    expect(to).to_be_disabled()
    goal.fill("10,000")
    expect(to).to_be_disabled()
    goal.fill("1\u2009200")
    to.click()
    until(page, lambda: ask("GAP 1, 0") == 1200)


def running(page: Page) -> None:
    """Wait until the program runs: what another host sends before that is stored, not executed."""
    expect(page.locator(".status-bar .pill").first).to_have_text("running")


def load(observer: Connection, *lines: str) -> None:
    """Store a program as another host does."""
    for instruction in (Instruction(132), *map(parse_instruction, lines), Instruction(0), Instruction(133)):
        observer.ask(instruction)


@pytest.mark.parametrize("earlier", [("SGP 5, 2, 77", "STOP")])
def test_run_over_a_program_of_somebody_else_asks_first(stage: Stage):
    page, _, ask, observer = stage
    arm(page)
    page.keyboard.press("F9")
    dialog = page.get_by_role("dialog")
    expect(dialog).to_contain_text("has not loaded the program")
    dialog.get_by_role("button", name="Upload it first").click()
    expect(page.locator(".code:not([hidden]) .cm-content")).to_contain_text("SGP 5, 2, 77")
    assert observer.read_instruction(0) == parse_instruction("SGP 5, 2, 77")
    assert ask("GAP 3, 0") == 0
    tab(page, "Program")
    expect(page.locator(".program .next")).to_contain_text("SGP 5, 2, 77")  # known from here on
    page.get_by_role("tab", name="program.tmc").click()
    page.keyboard.press("F9")
    running(page)
    until(page, lambda: ask("GAP 3, 0") == 500)
    page.keyboard.press("F9")
    expect(dialog).to_have_count(0)


@pytest.mark.parametrize("earlier", [("SGP 5, 2, 77", "STOP")])
def test_a_program_of_somebody_else_is_replaced_when_a_person_says_so(stage: Stage):
    page, _, ask, observer = stage
    arm(page)
    page.keyboard.press("F9")
    page.get_by_role("dialog").get_by_role("button", name="Replace it").click()
    running(page)
    until(page, lambda: ask("GAP 3, 0") == 500)
    assert observer.read_instruction(0) == parse_instruction("ROR 0, 500")


def test_137_in_direct_mode_is_confirmed_first(stage: Stage):
    page, _, ask, _ = stage
    ask("SGP 75, 0, 7")
    dialog = ask_for_factory_settings(page)
    dialog.get_by_role("button", name="Cancel").click()
    assert ask("GGP 75, 0") == 7


def test_store_beside_a_value_stores_that_of_one_motor(stage: Stage):
    page, _, ask, _ = stage
    for motor in range(3):
        ask(f"SAP 4, {motor}, {700 + motor}")
    open_parameters(page, "maximum positioning speed")
    expect(page.get_by_role("textbox", name="maximum positioning speed of motor 1")).to_have_value("701")
    page.get_by_role("button", name="Store or restore maximum positioning speed").click()
    page.get_by_role("menuitem", name="Store motor 1", exact=True).click()
    dialog = page.get_by_role("dialog")
    expect(dialog).to_contain_text("maximum positioning speed of motor 1: what the EEPROM holds")
    dialog.get_by_role("button", name="Apply").click()
    expect(page.locator(".notice").first).to_contain_text("1 value is stored")
    for motor in range(3):
        ask(f"RSAP 4, {motor}")
    assert [ask(f"GAP 4, {motor}") for motor in range(3)] == [1000, 701, 1000]


def test_two_windows_give_orders_and_the_later_one_has_the_motor(stage: Stage, window: Callable[[str], Page]):
    page, _, ask, _ = stage
    arm(page)
    measure(page, "400", "2000")
    until(page, lambda: ask("GAP 3, 0") == 400)
    other = window(stage.ide.url)
    other.get_by_role("textbox", name="Destination of motor 0").fill("0")
    other.get_by_role("button", name="Move motor 0 to").click()
    until(other, lambda: ask("GAP 1, 0") == 0 and ask("GAP 3, 0") == 0)
    expect(page.locator(".notice", has_text="Another command has the motor now")).to_have_count(1)
    until(other, lambda: figure(other, 0, "position") == 0)


def test_a_hidden_page_that_holds_a_jog_lets_it_go(stage: Stage, chromium: Browser):
    page, _, ask, _ = stage
    arm(page)
    page.get_by_role("button", name="Jog motor 1 left").hover()
    page.mouse.down()
    until(page, lambda: ask("GAP 3, 1") == -400)
    page.evaluate("() => { clearInterval(0); for (let n = 1; n < 1e4; n++) clearInterval(n); }")
    until(page, lambda: ask("GAP 3, 1") == 0)


def test_with_a_wrong_address_no_module_is_named(serve: Any, open_ide: OpenIde):
    page, _ = open_ide("--port", serve("--pty").pty, "--address", "7")
    expect(page.locator(".brand")).to_have_text("no module")
    expect(page.locator(".lane .place")).to_contain_text("9600 baud, address 7")
    expect(page.locator(".banner")).to_contain_text("No answer")
    expect(page.locator(".axis.motor0 .state")).to_have_text("unknown")
    expect(page.locator(".axis.motor0 [data-figure=position]")).to_have_text("\u2013")
    expect(page.get_by_role("img", name="left switch unknown").first).to_be_visible()
    expect(page.locator(".status-bar .pill").first).to_have_text("unknown")
    page.get_by_role("button", name="Tools", exact=True).click()
    page.get_by_role("button", name="Firmware and reset").click()
    expect(page.locator(".tool-body dd").first).to_have_text("unknown")
    page.get_by_role("button", name="Module configuration").click()
    expect(page.locator(".tool-body")).to_contain_text("unknown")
    expect(page.locator(".tool-body")).not_to_contain_text("unlocked")


def test_values_of_a_lost_line_are_grey_and_say_how_old_they_are(serve: Any, open_ide: OpenIde):
    served = serve("--tcp", "127.0.0.1:0")
    page, _ = open_ide("--port", f"tcp://{served.tcp}")
    expect(page.locator(".axis.motor1 .state")).to_have_text("at target")
    expect(page.get_by_role("img", name="The module answers")).to_be_visible()
    served.stop()
    expect(page.locator(".axis.motor1")).to_have_class("axis motor1 stale")
    expect(page.locator(".axis.motor1 .state")).to_contain_text("as of")
    expect(page.get_by_role("img", name="The module does not answer")).to_be_visible()
    expect(page.get_by_role("switch", name="ARMED")).to_be_disabled()
    expect(page.locator(".status-bar .pill").first).to_have_text("unknown")
    expect(page.locator(".status-bar b").first).to_have_text("\u2013")


def test_139_leads_to_a_terminal_with_a_way_back(stage: Stage):
    page = stage.page
    tab(page, "Direct mode")
    page.get_by_role("combobox", name="Instruction").select_option("139")
    page.get_by_role("button", name="Execute").click()
    page.get_by_role("dialog").get_by_role("button", name="Apply").click()
    expect(page.locator(".banner")).to_contain_text("is in ASCII mode")
    expect(page.locator(".prompt")).to_have_text("\u203a")
    field = page.get_by_role("textbox", name="ASCII line")
    field.fill("GAP 4, 0")
    field.press("Enter")
    expect(page.get_by_role("log")).to_contain_text("BA 100 1000")
    page.get_by_role("button", name="Back to binary (BIN)").click()
    line(page, "GAP 4, 0")
    expect(page.locator(".answers .value").first).to_have_text("1000")
    expect(page.locator(".banner")).to_have_count(0)


def test_the_second_reply_of_138_is_listed_with_its_command(stage: Stage):
    page, _, ask, _ = stage
    arm(page)
    tab(page, "Direct mode")
    line(page, "MVP ABS, 1, 900")
    page.get_by_role("combobox", name="Instruction").select_option("138")
    page.get_by_role("textbox", name="motors of").fill("2")
    page.get_by_role("button", name="Execute").click()
    expect(page.locator(".answer", has_text="138, second reply")).to_contain_text("targets reached")
    assert ask("GAP 1, 1") == 900


def test_what_another_host_changes_shows_by_itself(stage: Stage):
    page, observer = stage.page, stage.observer
    page.get_by_role("button", name="Parameters", exact=True).click()
    field = page.get_by_role("textbox", name="maximum positioning speed of motor 1")
    expect(field).to_have_value("1000")
    observer.execute(parse_instruction("SAP 4, 1, 777"))
    expect(field).to_have_value("777")


def test_a_changed_divisor_changes_the_speed_in_turns_at_once(stage: Stage):
    page, _, ask, _ = stage
    arm(page)
    tab(page, "Direct mode")
    line(page, "ROR 0, 400")
    unit = page.locator(".axis.motor0 [data-figure=turning]")
    expect(unit).to_contain_text("57.2 rpm")
    ask("SAP 154, 0, 4")
    expect(unit).to_contain_text("28.6 rpm")
    line(page, "MST 0")


def test_the_palette_finds_tools_and_settings(stage: Stage):
    page = stage.page
    for words, title in (
        ("firmw", "Firmware and reset"),
        ("search", "Reference search"),
        ("export", "Export settings as TOML"),
        ("import", "Import settings\u2026"),
    ):
        page.keyboard.press("Control+p")
        field = page.get_by_role("textbox", name="File or command")
        field.fill(words)
        expect(page.get_by_role("option", name=title)).to_be_visible()
        field.press("Escape")
        expect(field).to_have_count(0)


def test_a_double_click_opens_a_file_and_renames_nothing(stage: Stage):
    page = stage.page
    page.get_by_role("treeitem", name="program.tmc").dblclick()
    expect(page.locator(".rename")).to_have_count(0)


def test_chip_registers_carry_the_manual_s_warning(stage: Stage):
    page, _, ask, _ = stage
    before = ask("GGP 6, 0")
    page.get_by_role("button", name="Parameters", exact=True).click()
    page.get_by_role("radio", name="Global").click()
    expect(page.locator("tr.group").first).to_contain_text("wrong values damage the motor drivers")
    page.get_by_label("changed only").check()
    expect(page.locator("table.parameters tbody tr:not(.group)")).to_have_count(0)
    page.get_by_label("changed only").uncheck()
    field = page.get_by_role("textbox", name="TMC428/TMC429 SMGP register")
    field.fill("1")
    field.press("Enter")
    dialog = page.get_by_role("dialog")
    expect(dialog).to_contain_text("the manual warns")
    dialog.get_by_role("button", name="Cancel").click()
    assert ask("GGP 6, 0") == before


def test_the_module_in_the_head_follows_a_change_of_its_address(stage: Stage):
    page = stage.page
    page.get_by_role("button", name="Tools", exact=True).click()
    page.get_by_role("button", name="Module configuration").click()
    field = page.get_by_role("textbox", name="serial address", exact=True)
    field.fill("5")
    field.press("Enter")
    dialog = page.get_by_role("dialog")
    expect(dialog).to_contain_text("serial address becomes 5")
    dialog.get_by_role("button", name="Apply").click()
    expect(page.locator(".lane .place")).to_contain_text("address 5")
    expect(page.get_by_role("img", name="The module answers")).to_be_visible()


def test_a_keeper_reads_an_old_module_out_and_restores_it_to_a_spare(
    serve: Any, open_ide: OpenIde, tmp_path: Path
):
    old, spare = (serve("--pty", "--tcp", "127.0.0.1:0") for _ in range(2))
    with (
        Connection.open(f"tcp://{old.tcp}?timeout=30") as old_module,
        Connection.open(f"tcp://{spare.tcp}?timeout=30") as spare_module,
    ):
        for text in ("SAP 4, 0, 611", "SAP 193, 2, 3", "SGP 12, 2, 77", "STGP 12, 2", "SCO 5, 1, -4321"):
            old_module.execute(parse_instruction(text))
        page, _ = open_ide("--port", old.pty)
        page.get_by_role("button", name="Upload and disassemble").click()
        expect(page.locator(".notice")).to_contain_text("memory is empty")
        page.get_by_role("button", name="Parameters", exact=True).click()
        with page.expect_download() as started:
            page.get_by_role("button", name="Export .toml").click()
        text = Path(started.value.path()).read_text()
        assert "max_speed = 611" in text
        field = page.get_by_role("textbox", name="maximum positioning speed of motor 0")
        expect(field).to_have_value("611")
        field.fill("612")
        field.press("Enter")
        other, _ = open_ide("--port", spare.pty)
        if other.get_by_role("button", name="Import").count() == 0:
            other.get_by_role("button", name="Parameters", exact=True).click()
        with other.expect_file_chooser() as chooser:
            other.get_by_role("button", name="Import").click()
        chooser.value.set_files({"name": "old.toml", "mimeType": "text/plain", "buffer": text.encode()})
        expect(other.get_by_role("textbox", name="maximum positioning speed of motor 0")).to_have_value("611")
        asked = [
            parse_instruction(text)
            for text in ("GAP 4, 0", "GAP 193, 2", "GGP 12, 2", "GCO 5, 1", "GAP 3, 0")
        ]
        until(
            other,
            lambda: [spare_module.execute(each).value for each in asked] == [611, 3, 77, -4321, 0],
        )
        assert old_module.execute(parse_instruction("GAP 4, 0")).value == 612
        old_module.execute(parse_instruction("MST 1"))
        expect(page.locator(".axis.motor1 .state")).to_have_text("stopped")


def test_the_card_of_a_motor_that_stands_says_why(stage: Stage):
    page, _, ask, _ = stage
    ask("SAP 4, 2, 0")
    ask("MVP ABS, 2, 5000")
    expect(page.locator(".axis.motor2 .state")).to_have_text("stands, target 5\u2009000")
    page.locator(".axis.motor2").get_by_role("button", name="why?").click()
    expect(page.get_by_role("dialog")).to_contain_text("SAP 4, 2")
    page.get_by_role("dialog").get_by_role("button", name="Close").click()
    expect(page.get_by_role("dialog")).to_have_count(0)
