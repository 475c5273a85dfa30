"""The page itself: themes, windows, lost servers, rubbish, tablets."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from ide.page.driver import PROGRAM, Ide, box_of, figure, line, paste, tab, until


def test_themes_shortcuts_and_the_layout_are_remembered(page: Page):
    theme = page.locator("html").get_attribute("data-theme") or ""
    page.keyboard.press("Alt+t")
    expect(page.locator("html")).not_to_have_attribute("data-theme", theme)
    page.keyboard.press("F1")
    expect(page.get_by_role("dialog", name="Keyboard shortcuts")).to_contain_text("STOP ALL")
    page.keyboard.press("Escape")
    expect(page.get_by_role("dialog")).to_have_count(0)
    page.keyboard.press("Control+b")
    expect(page.locator(".files")).to_have_count(0)
    page.reload()
    expect(page.locator(".cm-content")).to_be_visible()
    expect(page.locator(".files")).to_have_count(0)
    expect(page.locator("html")).not_to_have_attribute("data-theme", theme)


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
    ide = Ide(tmp_path, "--listen", "127.0.0.1:0")
    context = chromium.new_context()
    page = context.new_page()
    page.goto(ide.url)
    page.locator(".cm-content").press("Control+Home")
    ide.process.kill()
    expect(page.locator(".banner")).to_contain_text("does not answer")
    expect(page.get_by_role("button", name="STOP ALL")).to_be_disabled()
    assert page.locator(".right .panel-body").evaluate("element => element.inert")
    page.keyboard.type("// typed while away\n")
    port = re.search(r":(\d+)/", ide.url)
    assert port is not None
    again = Ide(ide.folder, "--listen", f"127.0.0.1:{port[1]}")
    try:
        expect(page.locator(".banner")).to_contain_text("was restarted")
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


PANELS = ("Axes", "Bench", "Program", "Plot", "Direct mode", "Telegrams", "Problems")

NAMELESS = """() => [...document.querySelectorAll("button, input, select, [role=slider], [role=tab]")]
    .filter((element) => element.checkVisibility() && !element.closest(".cm-editor"))
    .filter((element) => !(element.ariaLabel || element.title || element.textContent.trim()
        || element.labels?.[0]?.textContent.trim()))
    .map((element) => element.outerHTML.slice(0, 120))"""

SMALL = """() => {
    const half = 19;
    const fingers = (element) => {
        element.scrollIntoView({ block: "center", inline: "center" });
        const { left, top, width, height } = element.getBoundingClientRect();
        const x = left + width / 2, y = top + height / 2;
        const label = element.labels?.[0];
        const mine = (at) => at && (element.contains(at) || at.contains(element) && at === label);
        const seen = (dx, dy) => mine(document.elementFromPoint(x + dx, y + dy));
        if (x < half || y < half || x > innerWidth - half || y > innerHeight - half || !seen(0, 0)) return true;
        return seen(0, -half) && seen(0, half) && (width >= 38 || (seen(-half, 0) && seen(half, 0)));
    };
    return [...document.querySelectorAll("button:not(.link), select, input:not([type=checkbox])")]
        .filter((element) => element.checkVisibility() && !element.closest(".cm-editor, .listing, .status-bar"))
        .filter((element) => !fingers(element)).map((element) => element.outerHTML.slice(0, 160));
}"""

FAINT = """() => {
    const parse = (text) => {
        const canvas = (window.probe ??= new OffscreenCanvas(1, 1).getContext("2d"));
        canvas.clearRect(0, 0, 1, 1);
        canvas.fillStyle = text;
        canvas.fillRect(0, 0, 1, 1);
        const [r, g, b, a] = canvas.getImageData(0, 0, 1, 1).data;
        return [r, g, b, a / 255];
    };
    const over = (top, under) => top.slice(0, 3).map((value, n) => value * top[3] + under[n] * (1 - top[3]));
    const ground = (element) => {
        const layers = [];
        for (let at = element; at; at = at.parentElement) layers.push(parse(getComputedStyle(at).backgroundColor));
        return layers.reverse().reduce((under, top) => over(top, under), [0, 0, 0]);
    };
    const light = (rgb) => rgb.map((value) => value / 255)
        .map((value) => (value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4))
        .reduce((sum, value, n) => sum + value * [0.2126, 0.7152, 0.0722][n], 0);
    const found = [];
    for (const element of document.querySelectorAll("body *")) {
        if (!element.checkVisibility() || element.closest(".cm-editor, :disabled, svg, .touched")) continue;
        if (![...element.childNodes].some((node) => node.nodeType === 3 && node.data.trim())) continue;
        const under = ground(element);
        const text = over(parse(getComputedStyle(element).color), under);
        const [high, low] = [light(text), light(under)].sort((a, b) => b - a);
        const contrast = (high + 0.05) / (low + 0.05);
        if (contrast < 4.5) found.push(`${contrast.toFixed(1)} ${element.outerHTML.slice(0, 100)}`);
    }
    return found;
}"""


def every_screen(page: Page) -> Iterator[str]:
    """Opens one panel and page after the other."""
    page.locator(".axis").first.wait_for()
    for panel in PANELS:
        page.get_by_role("tab", name=re.compile(panel)).last.click()
        if panel == "Direct mode":
            line(page, "GAP 4, 0")
            page.locator(".answer").first.wait_for()
        yield panel
    for key in "890":
        page.keyboard.press(f"Control+Alt+{key}")
        page.locator(".page, .listing").first.wait_for()
        for choice in page.locator(".parameters-page [role=radio], .tools nav button").all():
            choice.click()
            yield f"{key} {choice.inner_text()}"


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_every_control_has_a_name_and_every_text_its_contrast(ide: Ide, chromium: Browser, theme: str):
    context = chromium.new_context(
        viewport={"width": 1280, "height": 720}, color_scheme=theme, reduced_motion="reduce"
    )
    page = context.new_page()
    page.goto(ide.url)
    for screen in every_screen(page):
        assert (screen, page.evaluate(NAMELESS)) == (screen, [])
        assert (screen, page.evaluate(FAINT)) == (screen, [])
    context.close()


@pytest.mark.parametrize(("width", "height"), [(820, 1180), (1180, 820)])
def test_nothing_to_press_is_too_small_for_a_finger(ide: Ide, chromium: Browser, width: int, height: int):
    context = chromium.new_context(
        viewport={"width": width, "height": height}, has_touch=True, is_mobile=True
    )
    page = context.new_page()
    page.goto(ide.url)
    for screen in every_screen(page):
        assert (screen, page.evaluate(SMALL)) == (screen, [])
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    context.close()


def test_files_and_pages_lie_in_a_drawer_on_a_narrow_page(ide: Ide, chromium: Browser):
    context = chromium.new_context(viewport={"width": 820, "height": 1180}, has_touch=True, is_mobile=True)
    page = context.new_page()
    page.goto(ide.url)
    page.locator(".cm-content").wait_for()
    expect(page.get_by_role("navigation", name="Files")).to_be_hidden()
    page.get_by_role("button", name="Files and pages").tap()
    page.get_by_role("button", name="Parameters", exact=True).tap()
    expect(page.locator("table.parameters")).to_be_visible()
    expect(page.get_by_role("navigation", name="Files")).to_be_hidden()
    page.get_by_role("button", name="Files and pages").tap()
    page.locator(".scrim").tap(position={"x": 700, "y": 500})
    expect(page.get_by_role("navigation", name="Files")).to_be_hidden()
    context.close()


def test_panels_are_resized_by_mouse_finger_and_keys(ide: Ide, chromium: Browser):
    context = chromium.new_context(viewport={"width": 1180, "height": 820}, has_touch=True, is_mobile=True)
    page = context.new_page()
    page.goto(ide.url)
    page.locator(".axis").first.wait_for()
    finger = context.new_cdp_session(page)

    def width() -> float:
        box = box_of(page.locator(".right"))
        return box["width"]

    before = width()
    handle = page.get_by_role("separator", name="Width of the right panel")
    box = box_of(handle)
    x, y = box["x"] + 3, box["y"] + 300
    for kind, points in (
        ("touchStart", [{"x": x, "y": y}]),
        ("touchMove", [{"x": x - 20, "y": y}]),
        ("touchMove", [{"x": x - 40, "y": y}]),
        ("touchEnd", []),
    ):
        finger.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
    until(page, lambda: width() == before + 40)
    handle.focus()
    page.keyboard.press("ArrowRight")
    until(page, lambda: width() == before + 24)
    assert page.evaluate("getSelection().toString()") == ""
    context.close()


def test_windows_over_the_page_keep_the_keyboard_and_escape_closes_them(page: Page):
    button = page.get_by_role("button", name="Keyboard shortcuts")
    button.click()
    for _ in range(4):
        page.keyboard.press("Tab")
        assert page.evaluate(
            "!!document.activeElement.closest('dialog') || document.activeElement === document.body"
        )
    page.keyboard.press("Escape")
    expect(page.get_by_role("dialog")).to_have_count(0)
    expect(button).to_be_focused()
    page.keyboard.press("Control+p")
    page.keyboard.type("light")
    expect(page.get_by_role("dialog").get_by_role("option").first).to_contain_text("dark and light")
    page.mouse.click(20, 600)
    expect(page.get_by_role("dialog")).to_have_count(0)


def test_arrow_keys_walk_along_tabs_and_menus(page: Page):
    page.get_by_role("tab", name="Axes").focus()
    page.keyboard.press("ArrowRight")
    expect(page.get_by_role("tab", name="Machine")).to_be_focused()
    page.keyboard.press("ArrowRight")
    expect(page.get_by_role("tab", name="Bench")).to_be_focused()
    expect(page.get_by_role("button", name=re.compile("^Power "))).to_be_visible()
    page.get_by_role("button", name="Export").click()
    page.get_by_role("menuitem", name="CSV table").focus()
    page.keyboard.press("ArrowDown")
    expect(page.get_by_role("menuitem", name="PNG picture")).to_be_focused()
    page.keyboard.press("Escape")
    expect(page.get_by_role("menuitem")).to_have_count(0)
    expect(page.get_by_role("button", name="Export")).to_be_focused()


def test_a_file_is_renamed_and_deleted_from_its_menu(page: Page, ide: Ide):
    (ide.folder / "a-file-with-a-name-that-is-much-too-long.tmc").write_text("STOP\n")
    entry = page.get_by_role("treeitem", name="a-file-with")
    expect(entry).to_have_attribute("title", "a-file-with-a-name-that-is-much-too-long.tmc")
    entry.click(button="right")
    page.get_by_role("menuitem", name="Rename").click()
    name = page.get_by_role("textbox", name="New name of")
    name.fill("short.tmc")
    name.press("Enter")
    entry = page.get_by_role("treeitem", name="short.tmc")
    entry.click(button="right")
    page.get_by_role("menuitem", name="Make it the main file").click()
    expect(entry.locator("svg")).to_have_count(2)
    page.on("dialog", lambda dialog: dialog.accept())
    entry.click(button="right")
    page.get_by_role("menuitem", name="Delete").click()
    expect(entry).to_have_count(0)
    assert not (ide.folder / "short.tmc").exists()
