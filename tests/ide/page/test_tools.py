"""The page: plots and the TMCL-IDE's tools."""

from __future__ import annotations

import csv
import itertools
import re
from collections.abc import Callable
from pathlib import Path

from playwright.sync_api import Browser, Page, expect

from ide.page.driver import Ide, box_of, choose, figure, line, tab, until


def test_curves_are_drawn_chosen_and_exported(page: Page):
    page.keyboard.press("F9")
    until(page, lambda: figure(page, 0, "speed") == 500)
    canvas = page.locator(".plot .canvas canvas")
    expect(canvas).to_be_visible()
    page.get_by_role("button", name="load", exact=True).click()
    page.get_by_role("button", name="More curves").click()
    page.get_by_role("textbox", name="Search parameter").fill("general purpose variable #3")
    page.get_by_role("menuitem", name="add").first.click()
    expect(page.locator(".chip.watch")).to_contain_text("#3")
    expect(page.locator(".plot .canvas")).to_have_attribute("data-curves", "13")
    box = box_of(canvas)
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    expect(page.locator(".readout")).to_contain_text("position 0")
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] / 2 + 80, box["y"] + box["height"] / 2)
    page.mouse.up()
    expect(page.get_by_role("button", name="Show the newest")).to_be_enabled()
    for name, head in (
        ("CSV table", b"time_s,position_0"),
        ("VCD for", b"$timescale"),
        ("PNG picture", b"\x89PNG"),
    ):
        page.get_by_role("button", name="Export").click()
        with page.expect_download() as started:
            page.get_by_role("menuitem", name=name).click()
        assert Path(started.value.path()).read_bytes().startswith(head)


def test_the_unit_calculator_goes_both_ways(page: Page):
    page.get_by_role("button", name="Tools", exact=True).click()
    velocity = page.get_by_role("textbox", name="Velocity")
    velocity.fill("2047")
    velocity.press("Enter")
    expect(page.locator(".tool-body")).to_contain_text("62\u2009469")
    speed = page.get_by_role("textbox", name="Turns a minute")
    speed.fill("60")
    speed.press("Enter")
    expect(velocity).to_have_value("419")
    expect(page.locator(".commands pre")).to_contain_text("SAP 4, 0, 419")


def test_the_reference_search_assistant_starts_and_aborts(page: Page):
    page.get_by_role("button", name="Tools", exact=True).click()
    page.get_by_role("button", name="Reference search", exact=True).click()
    page.get_by_role("button", name="Start the search").click()
    expect(page.locator(".tool-body .pill").first).to_contain_text("searching")
    page.get_by_role("button", name="Abort the search").click()
    expect(page.locator(".tool-body .pill").first).to_have_text("idle")


def test_stall_tool_profile_configuration_and_firmware(page: Page):
    page.get_by_role("button", name="Tools", exact=True).click()
    page.get_by_role("button", name="Stall detection").click()
    choose(page, "Stall threshold", "3")
    expect(page.locator(".commands pre")).to_have_text("SAP 205, 0, 3")
    choose(page, "Stall threshold", "0")
    page.get_by_role("button", name="Load profile").click()
    for name, value in (("From velocity", "100"), ("To velocity", "200"), ("Step", "100")):
        page.get_by_role("textbox", name=name).fill(value)
        page.keyboard.press("Enter")
    page.get_by_role("button", name="Measure").click()
    expect(page.locator(".profile-chart circle")).to_have_count(2)
    page.get_by_role("button", name="Module configuration").click()
    page.get_by_label("telegram pause time").fill("2")
    page.keyboard.press("Enter")
    page.get_by_role("button", name="Firmware and reset").click()
    expect(page.locator(".tool-body")).to_contain_text("343 V4.36")
    page.get_by_role("button", name="Restore factory settings").click()
    expect(page.get_by_role("dialog")).to_contain_text("go back to their defaults")
    page.get_by_role("dialog").get_by_role("button", name="Apply").click()
    expect(page.locator(".notice").last).to_contain_text("factory settings")


def test_two_pinned_cursors_show_differences(page: Page):
    page.keyboard.press("F9")
    until(page, lambda: figure(page, 0, "speed") == 500)
    page.get_by_role("button", name="Hold the plot").click()
    box = box_of(page.locator(".plot .u-over"))
    x, y = box["x"] + 20, box["y"] + 40
    time = page.locator(".readout tr").first
    page.mouse.click(x, y)
    page.mouse.move(x + 40, y)
    expect(time).to_contain_text("Δ")
    page.mouse.click(x + 40, y)
    shown = time.inner_text()
    page.mouse.move(x, y - 300)
    expect(time).to_have_text(shown.replace("\t", ""))
    page.mouse.click(x + 60, y)
    expect(time).not_to_contain_text("Δ")


def test_the_legend_has_a_line_and_the_newest_value_of_each_of_nine_curves(page: Page):
    page.keyboard.press("F9")
    until(page, lambda: figure(page, 0, "speed") == 500)
    legend = page.get_by_role("group", name="Newest values")
    for name in ("position", "target", "speed"):
        for motor in range(3):
            expect(legend.locator(f"[data-curve='{name} {motor}']")).to_have_text(
                re.compile(r"^\u2212?[\d\u2009]+$")
            )
    lines = legend.locator("path").evaluate_all(
        "paths => paths.map((path) => `${path.getAttribute('stroke')} ${path.getAttribute('stroke-dasharray')}`)"
    )
    assert len(lines) == 9
    assert len(set(lines[:6])) == 6, "curves of one lane differ in colour or dash"


def test_derived_curves_are_drawn_and_exported(page: Page):
    for name in ("following error", "measured acceleration"):
        page.get_by_role("button", name="More curves").click()
        page.locator(".menu-row", has_text=name).get_by_role("menuitem").click()
        page.keyboard.press("Escape")
    page.keyboard.press("F9")
    until(page, lambda: figure(page, 0, "speed") == 500)
    expect(page.locator("[data-curve='following error 0']")).to_have_text(re.compile(r"\d"))
    page.get_by_role("button", name="Export").click()
    with page.expect_download() as started:
        page.get_by_role("menuitem", name="CSV table").click()
    rows = list(csv.DictReader(Path(started.value.path()).read_text(encoding="utf-8").splitlines()))
    assert max(float(row["measured_acceleration_0"] or 0) for row in rows) > 100
    last = rows[-1]
    assert last["following_error_0"] != ""


def test_a_plot_is_zoomed_with_a_finger(ide: Ide, chromium: Browser):
    context = chromium.new_context(viewport={"width": 820, "height": 1180}, has_touch=True, is_mobile=True)
    page = context.new_page()
    page.goto(ide.url)
    over = page.locator(".plot .u-over")
    over.wait_for()
    box = box_of(over)
    finger = context.new_cdp_session(page)
    x, y = box["x"] + 60, box["y"] + 40
    for kind, points in (
        ("touchStart", [{"x": x, "y": y}]),
        *(("touchMove", [{"x": x + 20 * step, "y": y}]) for step in range(1, 8)),
        ("touchEnd", []),
    ):
        finger.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
    page.get_by_role("button", name="Show the newest").click()
    expect(page.get_by_role("button", name="Show the newest")).to_be_disabled()
    context.close()


def test_the_reference_search_ends_at_a_switch_closed_by_hand(page: Page):
    page.get_by_role("button", name="Tools", exact=True).click()
    page.get_by_role("button", name="Reference search", exact=True).click()
    page.get_by_role("button", name="Start the search").click()
    pill = page.locator(".tool-body .pill").first
    expect(pill).to_contain_text("searching")
    left = page.get_by_role("button", name="left switch of motor 0")
    for closed in ("true", "false", "true"):
        before = pill.inner_text()
        left.click()
        expect(left).to_have_attribute("aria-pressed", closed)
        until(page, lambda before=before: pill.inner_text() != before)  # type: ignore[misc]
    expect(pill).to_have_text("idle")


def test_a_stall_is_set_up_by_hand(page: Page):
    page.get_by_role("button", name="Tools", exact=True).click()
    page.get_by_role("button", name="Stall detection").click()
    page.get_by_role("button", name="Rotate right").click()
    until(page, lambda: figure(page, 0, "speed") == 500)
    load = page.get_by_role("meter", name="Load", exact=True)
    free = int(load.get_attribute("aria-valuenow") or 0)
    page.get_by_role("slider", name="Load of motor 0").fill("40")
    until(page, lambda: int(load.get_attribute("aria-valuenow") or 0) > free)
    choose(page, "Stall threshold", str(free + 1))
    until(page, lambda: figure(page, 0, "speed") == 0)
    choose(page, "Stall threshold", "0")
    page.get_by_role("button", name="release", exact=True).click()


def test_ways_are_converted(page: Page):
    page.get_by_role("button", name="Tools", exact=True).click()
    turns = page.get_by_role("textbox", name="Turns", exact=True)
    turns.fill("2.5")
    turns.press("Enter")
    expect(page.get_by_role("textbox", name="Microsteps", exact=True)).to_have_value("32000")
    expect(page.locator(".tool-body")).to_contain_text("900")


def test_a_wheel_zooms_one_lane_and_a_double_click_brings_all_back(page: Page):
    page.keyboard.press("F9")
    until(page, lambda: figure(page, 0, "speed") == 500)
    box = box_of(page.locator(".plot .u-over"))
    page.mouse.move(box["x"] + 100, box["y"] + box["height"] * 0.75)
    page.mouse.wheel(0, -100)
    newest = page.get_by_role("button", name="Show the newest")
    expect(newest).to_be_enabled()
    newest.click()
    expect(newest).to_be_disabled()


def test_a_trigger_holds_the_picture_around_its_moment(page: Page):
    page.get_by_role("button", name="Trigger", exact=True).click()
    page.get_by_label("Trigger curve").select_option(label="speed 0")
    page.get_by_role("textbox", name="Trigger level").fill("250")
    page.get_by_role("menuitem", name="Arm the trigger").click()
    page.keyboard.press("F9")
    expect(page.locator(".notice", has_text="speed 0 rising through 250")).to_be_visible()
    expect(page.get_by_role("button", name="Show the newest")).to_be_enabled()


def test_a_trigger_on_a_level_fires_at_once_where_it_holds(page: Page):
    page.keyboard.press("F9")
    until(page, lambda: figure(page, 0, "speed") == 500)
    page.get_by_role("button", name="Trigger", exact=True).click()
    page.get_by_label("Trigger on").select_option("above")
    page.get_by_label("Trigger curve").select_option(label="speed 0")
    page.get_by_role("textbox", name="Trigger level").fill("499")
    page.get_by_role("menuitem", name="Arm the trigger").click()
    expect(page.locator(".notice", has_text="speed 0 above 499")).to_be_visible()


def _exported(page: Page) -> dict[str, dict[str, str]]:
    """The rows of the CSV table, by their time."""
    page.get_by_role("button", name="Export").click()
    with page.expect_download() as started:
        page.get_by_role("menuitem", name="CSV table").click()
    lines = Path(started.value.path()).read_text(encoding="utf-8").splitlines()
    return {row["time_s"]: row for row in csv.DictReader(lines)}


HIDE = """(hidden) => {
    Object.defineProperty(document, "hidden", { configurable: true, get: () => hidden });
    document.dispatchEvent(new Event("visibilitychange"));
}"""


def test_two_windows_show_the_same_curve_without_stairs(page: Page, ide: Ide, window: Callable[[str], Page]):
    other, background = window(ide.url), window(ide.url)
    background.evaluate(HIDE, True)
    tab(page, "Direct mode")
    for text in ("SAP 5, 0, 100", "MVP ABS, 0, 20000"):
        line(page, text)
    tab(page, "Plot")
    for each in (page, other, background):
        until(each, lambda each=each: figure(each, 0, "position") == 20000)
    background.evaluate(HIDE, False)
    first, *others = [_exported(each) for each in (page, other, background)]
    for rows in others:
        common = [at for at in first if at in rows]
        assert [first[at] for at in common] == [rows[at] for at in common]
        assert {round(50 * (float(b) - float(a))) for a, b in itertools.pairwise(common)} == {1}
        speeds = [int(rows[at]["speed_0"]) for at in common]
        rise = speeds[: speeds.index(max(speeds))]
        moving = [speed for speed in rise if speed]
        assert len(moving) > 10
        assert all(a < b for a, b in itertools.pairwise(moving))
