"""The page: direct mode, telegrams, parameters."""

from __future__ import annotations

import re
from pathlib import Path

from playwright.sync_api import Page, expect

from ide.page.driver import OpenIde, box_of, figure, line, tab, until
from tmcm34x.host import Connection
from tmcm34x.tmcl.mnemonic import parse_instruction

# The name of the parameter stands between, when the language server has hinted it.
IN_THE_SOURCE = re.compile(r"SAP 4.*, 1, 777")


def test_direct_mode_by_form_by_line_and_from_history(page: Page):
    tab(page, "Direct mode")
    page.get_by_label("Instruction", exact=True).select_option("5")
    page.get_by_label("parameter of SAP").select_option("4")
    page.get_by_label("motor of SAP").fill("1")
    page.get_by_label("value of SAP").fill("777")
    page.get_by_role("button", name="Execute").click()
    expect(page.locator(".answers .command").first).to_have_text("SAP 4, 1, 777")
    expect(page.locator(".answers .bytes").first).to_contain_text("01 05 04 01 00 00 03 09 17")
    line(page, "GAP 4, 1")
    expect(page.locator(".answers .command").first).to_have_text("GAP 4, 1")
    expect(page.locator(".answers .value").first).to_have_text("777")
    field = page.get_by_role("textbox", name="Command line")
    field.press("ArrowUp")
    expect(field).to_have_value("GAP 4, 1")
    field.press("ArrowUp")
    expect(field).to_have_value("SAP 4, 1, 777")
    line(page, "NONSENSE")
    expect(page.locator(".notice.error")).to_contain_text("unknown command")
    page.get_by_role("button", name="Copy to the editor").last.click()
    expect(page.locator(".cm-content")).to_contain_text(IN_THE_SOURCE)


def test_the_log_shows_and_filters_telegrams(page: Page):
    tab(page, "Telegrams")
    expect(page.locator(".telegram").first).to_be_visible()
    page.get_by_title("Clear the log").click()
    expect(page.locator(".telegram")).to_have_count(0)
    tab(page, "Direct mode")
    line(page, "MVP ABS, 1, 9000")
    line(page, "SAP 4, 7, 1")
    expect(page.locator(".answer.bad")).to_have_count(1)
    tab(page, "Telegrams")
    expect(page.locator(".telegram")).to_have_count(4)
    page.get_by_role("textbox", name="Filter telegrams").fill("mvp")
    expect(page.locator(".telegram")).to_have_count(1)
    expect(page.locator(".telegram .text")).to_contain_text("MVP ABS, 1, 9000")
    page.get_by_role("textbox", name="Filter telegrams").fill("-mvp")
    expect(page.locator(".telegram")).to_have_count(3)


def test_parameters_are_searched_changed_marked_and_exported(page: Page):
    page.get_by_role("button", name="Parameters", exact=True).click()
    page.get_by_role("textbox", name="Search parameters").fill("positioning speed")
    expect(page.locator("table.parameters [data-parameter]")).to_have_count(2)
    field = page.get_by_role("textbox", name="maximum positioning speed of motor 1")
    field.fill("1234")
    field.press("Enter")
    expect(page.locator("td.differs")).to_have_count(1)
    field.fill("5000")
    field.press("Enter")
    expect(field).to_have_class(re.compile("wrong"))
    field.press("Escape")
    expect(field).to_have_value("1234")
    page.get_by_label("changed only").check()
    expect(page.locator("table.parameters [data-parameter]")).to_have_count(1)
    with page.expect_download() as started:
        page.get_by_role("button", name="Export .toml").click()
    text = Path(started.value.path()).read_text()
    assert "[axis.1]\nmax_speed = 1234\n" in text
    with page.expect_file_chooser() as chooser:
        page.get_by_role("button", name="Import").click()
    chooser.value.set_files(
        {"name": "s.toml", "mimeType": "text/plain", "buffer": text.replace("1234", "888").encode()}
    )
    expect(field).to_have_value("888")


def test_parameters_stand_in_groups_with_their_values_in_physical_units(page: Page):
    page.get_by_role("button", name="Parameters", exact=True).click()
    groups = page.locator("table.parameters .group")
    expect(groups).to_have_text(
        [
            "Position and speed",
            "Resolution and divisors",
            "Switches and reference search",
            "Currents and driver",
            "Encoder",
        ]
    )
    row = page.locator("[data-parameter='-1/4/0']")
    expect(row.locator(".physical")).to_have_text(["143 rpm"] * 3)
    divisor = page.get_by_role("textbox", name="pulse divisor of motor 1")
    divisor.fill("4")
    divisor.press("Enter")
    expect(row.locator(".physical")).to_have_text(["143 rpm", "71.5 rpm", "143 rpm"])
    speed = page.get_by_role("textbox", name="maximum positioning speed of motor 0")
    speed.fill("71,5 rpm")
    expect(speed).to_have_attribute("title", re.compile("it is 500$"))
    speed.press("Enter")
    expect(speed).to_have_value("500")
    expect(row.locator(".physical").first).to_have_text("71.5 rpm")


def test_every_other_parameter_view_opens(page: Page):
    page.get_by_role("button", name="Parameters", exact=True).click()
    page.get_by_role("radio", name="Global").click()
    expect(page.locator("table.parameters")).to_contain_text("RS232/RS485 baud rate")
    page.get_by_role("radio", name="User variables").click()
    field = page.get_by_role("textbox", name="User variable 55")
    field.fill("-5")
    field.press("Enter")
    page.get_by_role("radio", name="Coordinates").click()
    place = page.get_by_role("textbox", name="Coordinate 20 of motor 2")
    place.fill("4711")
    place.press("Enter")
    page.get_by_role("radio", name="EEPROM").click()
    expect(page.locator(".eeprom")).to_contain_text("maximum positioning speed")
    page.get_by_role("radio", name="Coordinates").click()
    expect(place).to_have_value("4711")


def test_an_answer_is_whole_in_a_narrow_panel(page: Page):
    tab(page, "Direct mode")
    line(page, "SAP 4, 7, 1")
    panel = box_of(page.locator(".answers"))
    for part in (".command", ".bytes", ".value", ".result", ".acts"):
        box = box_of(page.locator(f".answer {part}").first)
        assert box["width"] > 0
        assert box["x"] + box["width"] <= panel["x"] + panel["width"]
    assert page.locator(".answers").evaluate("element => element.scrollWidth <= element.clientWidth")
    page.get_by_role("button", name="Send again").first.click()
    expect(page.locator(".answer")).to_have_count(2)


def test_all_axis_parameters_are_stored_and_restored_at_once(page: Page):
    page.get_by_role("button", name="Parameters", exact=True).click()
    page.get_by_role("textbox", name="Search parameters").fill("maximum acceleration")
    field = page.get_by_role("textbox", name="maximum acceleration of motor 0")
    field.fill("321")
    field.press("Enter")
    page.get_by_role("button", name="Store all", exact=True).click()
    expect(page.locator(".notice").last).to_contain_text("are stored in the EEPROM")
    field.fill("99")
    field.press("Enter")
    expect(page.locator("td.differs")).to_have_count(1)
    page.get_by_role("button", name="Restore all").click()
    expect(field).to_have_value("321")
    page.get_by_role("radio", name="Coordinates").click()
    place = page.get_by_role("textbox", name="Coordinate 3 of motor 1")
    place.fill("77")
    place.press("Enter")
    page.get_by_role("radio", name="EEPROM").click()
    expect(page.locator(".stored")).to_contain_text("maximum acceleration")


def test_a_coordinate_is_captured_and_gone_to(page: Page):
    tab(page, "Direct mode")
    line(page, "MVP ABS, 2, 640")
    until(page, lambda: figure(page, 2, "position") == 640)
    page.get_by_role("button", name="Parameters", exact=True).click()
    page.get_by_role("radio", name="Coordinates").click()
    page.get_by_role("row").nth(5).get_by_role("button", name="capture").click()
    expect(page.get_by_role("textbox", name="Coordinate 4 of motor 2")).to_have_value("640")
    page.get_by_role("button", name="Zero motor 2").click()
    until(page, lambda: figure(page, 2, "position") == 0)
    page.get_by_role("row").nth(5).get_by_role("button", name="go").click()
    until(page, lambda: figure(page, 2, "position") == 640)


def test_the_log_shows_what_other_hosts_say(open_ide: OpenIde):
    page, ide = open_ide("--tcp", "0")
    kind, address = ide.links[0]
    expect(page.locator(".status-bar")).to_contain_text(f"{kind} {address}")
    tab(page, "Telegrams")
    with Connection.open(f"tcp://{address}?timeout=30") as connection:
        connection.execute(parse_instruction("MVP ABS, 1, 4000"))
    expect(page.locator(".telegram", has_text="MVP ABS, 1, 4000")).to_contain_text("tcp")
    until(page, lambda: figure(page, 1, "position") == 4000)


def test_direct_commands_are_recorded_into_the_program(page: Page):
    tab(page, "Direct mode")
    page.get_by_role("button", name="Record", exact=True).click()
    line(page, "SAP 4, 1, 777")
    expect(page.locator(".cm-content")).to_contain_text(IN_THE_SOURCE)
    page.get_by_role("button", name="Recording").click()
    line(page, "SAP 4, 1, 778")
    expect(page.locator(".answer")).to_have_count(2)
    expect(page.locator(".cm-content")).not_to_contain_text("778")


def test_the_palette_finds_labels_and_tab_leaves_the_editor_after_escape(page: Page):
    page.keyboard.press("Control+p")
    page.get_by_role("textbox", name="File or command").fill("rest")
    page.get_by_role("option", name="Rest label").click()
    expect(page.locator(".cm-activeLine")).to_contain_text("Rest:")
    page.keyboard.press("Escape")
    page.keyboard.press("Tab")
    expect(page.locator(".cm-content")).not_to_be_focused()
