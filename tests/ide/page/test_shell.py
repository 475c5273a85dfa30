"""The page itself: themes, windows, lost servers, rubbish, tablets."""

from __future__ import annotations

import re
from pathlib import Path

from playwright.sync_api import Browser, Page, expect

from ide.page.driver import PROGRAM, Ide, figure, line, paste, tab, until


def test_themes_shortcuts_and_the_layout_are_remembered(page: Page):
    theme = page.locator("html").get_attribute("data-theme")
    page.keyboard.press("Alt+t")
    assert page.locator("html").get_attribute("data-theme") != theme
    page.keyboard.press("F1")
    expect(page.get_by_role("dialog", name="Keyboard shortcuts")).to_contain_text("STOP ALL")
    page.keyboard.press("Escape")
    expect(page.get_by_role("dialog")).to_have_count(0)
    page.keyboard.press("Control+b")
    expect(page.locator(".files")).to_have_count(0)
    page.reload()
    expect(page.locator(".cm-content")).to_be_visible()
    expect(page.locator(".files")).to_have_count(0)
    assert page.locator("html").get_attribute("data-theme") != theme


def test_two_windows_see_the_same_module(page: Page, ide: Ide, chromium: Browser):
    context = chromium.new_context()
    other = context.new_page()
    other.goto(ide.url)
    expect(other.locator(".status-bar")).to_contain_text("2 windows")
    tab(page, "Direct mode")
    line(page, "ROR 1, 123")
    until(other, lambda: figure(other, 1, "speed") == 123)
    context.close()
    expect(page.locator(".status-bar")).not_to_contain_text("windows")


def test_a_lost_server_is_told_and_nothing_typed_is_lost(tmp_path: Path, chromium: Browser):
    (tmp_path / "program.tmc").write_text(PROGRAM)
    ide = Ide(tmp_path)
    context = chromium.new_context()
    page = context.new_page()
    page.goto(ide.url)
    page.locator(".cm-content").press("Control+Home")
    ide.process.kill()
    expect(page.locator(".banner")).to_contain_text("does not answer")
    page.keyboard.type("// typed while away\n")
    port = re.search(r":(\d+)/", ide.url)
    assert port is not None
    again = Ide(ide.folder, "--listen", f"127.0.0.1:{port[1]}")
    try:
        expect(page.locator(".banner")).to_contain_text("started anew", timeout=20_000)
        page.goto(again.url)
        expect(page.locator(".cm-content")).to_contain_text("// typed while away")
    finally:
        context.close()
        again.stop()
        ide.stop()


def test_a_wrong_token_gets_a_clear_answer(page: Page, ide: Ide, chromium: Browser):
    context = chromium.new_context()
    stranger = context.new_page()
    stranger.goto(ide.url.split("?")[0] + "?token=wrong")
    expect(stranger.locator("h1")).to_have_text("Not this way")
    context.close()


def test_a_program_of_ten_thousand_lines_and_rubbish_are_borne(page: Page):
    page.locator(".cm-content").click()
    page.keyboard.press("Control+a")
    paste(page, "WAIT TICKS, 0, 1 // nothing\n" * 10_000)
    expect(page.get_by_role("tab", name=re.compile("Problems"))).to_contain_text(re.compile(r"\d"))
    page.keyboard.press("Control+a")
    paste(page, "\u0000\uffff\U0001f600 %%% ((( \\ MVP ,,,, ABS\n" * 50)
    expect(page.locator(".cm-lintRange-error").first).to_be_visible()
    page.keyboard.press("F9")
    expect(page.locator(".notice.error").first).to_be_visible()


def test_the_page_fits_a_tablet(page: Page):
    page.set_viewport_size({"width": 820, "height": 1180})
    expect(page.get_by_role("button", name="STOP ALL")).to_be_in_viewport()
    expect(page.locator(".axis.motor0")).to_be_in_viewport()
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
