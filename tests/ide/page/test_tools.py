"""The page: plots and the TMCL-IDE's tools."""

from __future__ import annotations

from pathlib import Path

from playwright.sync_api import Browser, Page, expect

from ide.page.driver import Ide, choose, figure, until


def test_curves_are_drawn_chosen_and_exported(page: Page):
    page.keyboard.press("F9")
    until(page, lambda: figure(page, 0, "speed") == 500)
    canvas = page.locator(".plot canvas")
    expect(canvas).to_be_visible()
    page.get_by_role("button", name="load", exact=True).click()
    page.get_by_role("button", name="More curves").click()
    page.get_by_role("textbox", name="Search parameter").fill("general purpose variable #3")
    page.get_by_role("menuitem", name="add").first.click()
    expect(page.locator(".chip.watch")).to_contain_text("#3")
    page.wait_for_function(
        "() => document.querySelector('.plot canvas')?.getBoundingClientRect().width > 100"
    )
    box = canvas.bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    expect(page.locator(".readout")).to_contain_text("position 0")
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] / 2 + 80, box["y"] + box["height"] / 2)
    page.mouse.up()
    expect(page.locator(".plot .tool[title^='Show the newest']")).to_be_visible()
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


def test_a_pinned_cursor_shows_differences(page: Page):
    page.keyboard.press("F9")
    until(page, lambda: figure(page, 0, "speed") == 500)
    page.get_by_role("button", name="Hold the plot").click()
    box = page.locator(".plot .u-over").bounding_box()
    assert box is not None
    x, y = box["x"] + 20, box["y"] + 40
    page.mouse.click(x, y)
    page.mouse.move(x + 40, y)
    expect(page.locator(".readout tr").first).to_contain_text("Δ")
    page.mouse.click(x + 40, y)
    expect(page.locator(".readout tr").first).not_to_contain_text("Δ")


def test_a_plot_is_zoomed_with_a_finger(ide: Ide, chromium: Browser):
    context = chromium.new_context(viewport={"width": 820, "height": 1180}, has_touch=True, is_mobile=True)
    page = context.new_page()
    page.goto(ide.url)
    over = page.locator(".plot .u-over")
    over.wait_for()
    box = over.bounding_box()
    assert box is not None
    finger = context.new_cdp_session(page)
    x, y = box["x"] + 60, box["y"] + 40
    for kind, points in (
        ("touchStart", [{"x": x, "y": y}]),
        *(("touchMove", [{"x": x + 20 * step, "y": y}]) for step in range(1, 8)),
        ("touchEnd", []),
    ):
        finger.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
    page.get_by_role("button", name="Show the newest").click()
    expect(page.get_by_role("button", name="Show the newest")).to_have_count(0)
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
    box = page.locator(".plot .u-over").bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + 100, box["y"] + box["height"] * 0.75)
    page.mouse.wheel(0, -100)
    newest = page.get_by_role("button", name="Show the newest")
    expect(newest).to_be_visible()
    newest.click()
    expect(newest).to_have_count(0)


def test_a_trigger_holds_the_picture_around_its_moment(page: Page):
    page.get_by_role("button", name="Trigger", exact=True).click()
    page.get_by_label("Trigger curve").select_option(label="speed 0")
    page.get_by_role("textbox", name="Trigger level").fill("250")
    page.get_by_role("menuitem", name="Arm the trigger").click()
    page.keyboard.press("F9")
    expect(page.locator(".notice", has_text="speed 0 rising through 250")).to_be_visible()
    expect(page.get_by_role("button", name="Show the newest")).to_be_visible()
