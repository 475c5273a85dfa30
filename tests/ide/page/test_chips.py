"""The page: chip registers, driver chain and microstep wave."""

from __future__ import annotations

import re
from typing import Any

from playwright.sync_api import Page, expect

from ide.page.driver import OpenIde, box_of, line, tab


def tool(page: Page, name: str) -> None:
    page.get_by_role("button", name="Tools", exact=True).click()
    page.get_by_role("navigation", name="Tools").get_by_role("button", name=name).click()


def apply(page: Page) -> None:
    """Send a table, once its warning has been read."""
    page.get_by_role("button", name="Apply…").click()
    dialog = page.get_by_role("dialog")
    expect(dialog).to_contain_text("wrong values damage the drivers")
    dialog.get_by_role("button", name="Apply", exact=True).click()


def test_the_registers_of_the_chips_are_shown_with_their_fields(page: Page):
    tab(page, "Direct mode")
    line(page, "SAP 4, 1, 1234")
    expect(page.locator(".answers .result").first).to_have_text("100")
    tool(page, "Chip registers")
    page.get_by_role("radio", name="Motor 1").click()
    page.get_by_role("textbox", name="Filter registers").fill("v_max")
    row = page.locator(".register-table tbody tr")
    expect(row).to_have_count(1)
    expect(row).to_contain_text("$0004D2")
    page.get_by_role("radio", name="Common").click()
    page.get_by_role("textbox", name="Filter registers").fill("lsmd")
    expect(row).to_contain_text(re.compile("SMGP.*LSMD 2"))


def test_registers_of_bank_0_are_read_when_asked_and_written_after_the_warning(page: Page):
    tool(page, "Chip registers")
    expect(page.locator(".bank-zero")).to_contain_text("not read")
    page.get_by_role("button", name="Read them").click()
    field = page.get_by_role("textbox", name="cover datagram length")
    expect(field).to_have_value("0")
    field.fill("5")
    field.press("Enter")
    dialog = page.get_by_role("dialog")
    expect(dialog).to_contain_text("damage the drivers")
    dialog.get_by_role("button", name="Apply").click()
    expect(page.locator(".bank-zero")).to_be_visible()
    page.get_by_role("button", name="Read them").click()
    expect(field).to_have_value("5")


def test_the_wave_is_drawn_changed_by_formula_and_sent_after_the_warning(page: Page):
    tool(page, "Microstep wave")
    expect(page.get_by_role("img", name="Currents of coil A")).to_be_visible()
    first = page.get_by_role("textbox", name="Wave value 0", exact=True)
    expect(first).to_have_value("0")
    page.get_by_role("textbox", name="Offset of the sine").fill("4")
    page.get_by_role("button", name="Take this sine").click()
    expect(first).to_have_value("4")
    expect(page.locator(".wave-drawing .before")).to_have_count(1)
    apply(page)
    expect(page.locator(".chip-table .pill")).to_have_text("as in the module")
    tab_values = page.get_by_role("textbox", name=re.compile("Wave value"))
    expect(tab_values).to_have_count(64)
    page.get_by_role("button", name="Restore", exact=True).click()
    expect(first).to_have_value("0")


def test_a_value_of_the_wave_is_drawn_by_hand_and_dropped(page: Page):
    tool(page, "Microstep wave")
    drawing = page.get_by_role("img", name="Currents of coil A")
    box = box_of(drawing)
    page.mouse.move(box["x"] + box["width"] / 8, box["y"] + box["height"] * 0.45)
    page.mouse.down()
    page.mouse.up()
    expect(page.locator(".chip-table .pill")).to_have_text("1 cell is not sent")
    page.get_by_role("button", name="Drop the draft").click()
    expect(page.locator(".chip-table .pill")).to_have_text("as in the module")


def test_the_driver_chain_is_edited_with_its_drivers_named(page: Page):
    tool(page, "Driver chain")
    cell = page.get_by_role("combobox", name="Signal of cell 0", exact=True)
    expect(cell).to_have_value("16")
    expect(page.locator(".chain-cell").nth(12)).to_contain_text("driver 2")
    page.get_by_role("combobox", name="Chain of three").select_option("falling")
    expect(cell).to_have_value("7")
    expect(page.locator(".chip-table .pill").last).to_have_text("6 cells are not sent")
    page.get_by_role("checkbox", name="Cell 11 ends its driver").uncheck()
    expect(page.locator(".pill.bad")).to_contain_text("2 end marks")
    page.get_by_role("checkbox", name="Cell 11 ends its driver").check()
    apply(page)
    expect(page.locator(".chip-table .pill").last).to_have_text("as in the module")
    tool(page, "Chip registers")
    tool(page, "Driver chain")
    expect(cell).to_have_value("7")


def test_the_tables_of_a_real_module_are_read_over_the_line(serve: Any, open_ide: OpenIde):
    served = serve("--tcp", "127.0.0.1:0")
    page, _ = open_ide("--port", f"tcp://{served.tcp}")
    tool(page, "Microstep wave")
    expect(page.get_by_role("textbox", name="Wave value 63")).to_have_value("63")
    tool(page, "Chip registers")
    expect(page.locator(".register-table")).to_have_count(0)
    page.get_by_role("button", name="Read them").click()
    expect(page.get_by_role("textbox", name="TMC428/TMC429 SMGP register")).to_be_visible()
