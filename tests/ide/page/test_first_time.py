"""What somebody does who has never seen the page: run, stop, change a speed, hold, step, close a limit switch."""

from __future__ import annotations

import shutil
from pathlib import Path

from playwright.sync_api import expect

from ide.page.driver import OpenIde, box_of, figure, tab, until

PROGRAM = Path(__file__).parents[3] / "examples" / "manual" / "5.2-first-program.tmc"


def test_a_first_session_with_the_manual_s_program(tmp_path: Path, open_ide: OpenIde):
    shutil.copy(PROGRAM, tmp_path / "program.tmc")
    page, _ = open_ide()
    page.get_by_role("button", name="Run", exact=True).click()
    until(page, lambda: figure(page, 0, "speed") == -500)

    page.get_by_role("button", name="STOP ALL").click()
    until(page, lambda: figure(page, 0, "speed") == 0)
    expect(page.locator(".status-bar .pill").first).to_have_text("stopped")
    page.get_by_role("button", name="Release").click()

    page.locator(".cm-line", has_text="ROL").get_by_text("500", exact=True).dblclick()
    page.keyboard.type("300")
    page.get_by_role("button", name="Run", exact=True).click()
    until(page, lambda: figure(page, 0, "speed") == -300)

    page.get_by_label("Speed of time").select_option("10")
    row = box_of(page.locator(".cm-line", has_text="MST   0"))
    gutter = box_of(page.locator(".breakpoints"))
    page.mouse.click(gutter["x"] + gutter["width"] / 2, row["y"] + row["height"] / 2)
    expect(page.locator(".cm-line.execution.held")).to_contain_text("MST")
    assert figure(page, 0, "speed") == -300
    page.get_by_role("button", name="Step", exact=True).first.click()
    expect(page.locator(".cm-line.execution.held")).to_contain_text("ROR")
    until(page, lambda: figure(page, 0, "speed") == 0)
    page.get_by_role("button", name="Step", exact=True).first.click()
    until(page, lambda: figure(page, 1, "speed") == 250)

    tab(page, "Bench")
    page.get_by_role("button", name="right switch of motor 1").click()
    tab(page, "Axes")
    until(page, lambda: figure(page, 1, "speed") == 0)
