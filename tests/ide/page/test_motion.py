"""The page: axes, bench and time."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import Browser, CDPSession, Page, expect

from ide.page.driver import Ide, OpenIde, box_of, figure, line, tab, until

BENCHES = Path(__file__).parents[3] / "examples" / "benches"


def test_a_motor_is_jogged_while_held_moved_and_zeroed(page: Page):
    right = page.get_by_role("button", name="Jog motor 1 right")
    right.hover()
    page.mouse.down()
    until(page, lambda: figure(page, 1, "speed") == 400)
    page.mouse.up()
    until(page, lambda: figure(page, 1, "speed") == 0)
    right.focus()
    page.keyboard.down("Space")
    until(page, lambda: figure(page, 1, "speed") == 400)
    page.keyboard.up("Space")
    until(page, lambda: figure(page, 1, "speed") == 0)
    page.get_by_role("textbox", name="Destination of motor 1").fill("-2500")
    page.keyboard.press("Enter")
    page.get_by_role("button", name="Move motor 1 to").click()
    until(page, lambda: figure(page, 1, "position") == -2500)
    page.get_by_role("button", name="Zero motor 1").click()
    until(page, lambda: figure(page, 1, "position") == 0)
    expect(page.locator(".axis.motor1 .state")).not_to_have_text("no power")


def test_a_dial_turns_with_the_rotor(page: Page):
    def picture() -> str:
        return page.locator(".dial.motor2 canvas").evaluate("canvas => canvas.toDataURL()")

    still = picture()
    tab(page, "Direct mode")
    line(page, "ROR 2, 300")
    until(page, lambda: picture() != still)


def test_a_closed_limit_switch_stops_the_motor(page: Page):
    tab(page, "Direct mode")
    line(page, "ROR 2, 300")
    until(page, lambda: figure(page, 2, "speed") == 300)
    tab(page, "Bench")
    page.get_by_role("button", name="right switch of motor 2").click()
    expect(page.get_by_role("button", name="right switch of motor 2")).to_have_attribute(
        "aria-pressed", "true"
    )
    tab(page, "Axes")
    until(page, lambda: figure(page, 2, "speed") == 0)
    expect(page.locator(".axis.motor2").get_by_role("img", name="right switch on")).to_be_visible()


def test_inputs_outputs_power_and_line_are_at_the_bench(page: Page):
    tab(page, "Bench")
    tab(page, "Direct mode")
    page.get_by_role("switch", name="Input 3").click()
    line(page, "GIO 3, 0")
    expect(page.locator(".answers .value").first).to_have_text("1")
    line(page, "SIO 5, 2, 1")
    expect(page.get_by_role("img", name="output 5 on")).to_be_visible()
    page.get_by_role("button", name=re.compile("^Line ")).click()
    line(page, "GAP 1, 0")
    expect(page.locator(".answers .result").first).to_contain_text("unplugged")
    page.get_by_role("button", name=re.compile("^Line ")).click()
    page.get_by_role("button", name=re.compile("^Power ")).click()
    expect(page.locator(".banner")).to_contain_text("no power")
    page.get_by_role("button", name="Switch it on").click()
    expect(page.locator(".banner")).to_have_count(0)


def seconds(clock: str) -> float:
    hours, minutes, seconds = clock.split(":")
    return 3600 * int(hours) + 60 * int(minutes) + float(seconds)


def test_time_is_held_stepped_and_hurried(page: Page):
    page.get_by_role("button", name="Hold time").click()
    clock = page.locator(".virtual-time.held")
    before = clock.inner_text()
    page.get_by_role("button", name="One millisecond").click()
    until(page, lambda: clock.inner_text() != before)
    parts = [text.replace(":", "").replace(".", "") for text in (before, clock.inner_text())]
    assert int(parts[1]) - int(parts[0]) == 1
    page.get_by_label("Speed of time").select_option("100")
    page.get_by_role("button", name="Hold time").click()
    running = page.locator(".virtual-time:not(.held)")
    start = seconds(running.inner_text())
    until(page, lambda: seconds(running.inner_text()) > start + 60)


def touch(session: CDPSession, kind: str, x: float = 0, y: float = 0) -> None:
    """A finger: `touchStart`, `touchMove`, `touchEnd`, `touchCancel`."""
    points = [] if kind in {"touchEnd", "touchCancel"} else [{"x": x, "y": y}]
    session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})


def place(page: Page, name: str, role: str = "button") -> tuple[float, float]:
    """The middle of a control."""
    box = box_of(page.get_by_role(role, name=name))  # type: ignore[arg-type]
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


@pytest.mark.parametrize(
    "end",
    [
        "window.dispatchEvent(new Event('blur'))",
        "document.dispatchEvent(new Event('visibilitychange'))",
        "document.querySelector('.jog.held').dispatchEvent(new PointerEvent('pointercancel'))",
        "[...document.querySelectorAll('[role=tab]')].find((tab) => tab.textContent === 'Bench').click()",
    ],
)
def test_a_jog_ends_with_whatever_ends_the_hold(page: Page, end: str):
    page.get_by_role("button", name="Jog motor 1 left").hover()
    page.mouse.down()
    until(page, lambda: figure(page, 1, "speed") == -400)
    page.evaluate(end)
    tab(page, "Axes")
    until(page, lambda: figure(page, 1, "speed") == 0)
    page.mouse.up()


def test_a_motor_is_not_jogged_by_the_other_button(page: Page):
    page.get_by_role("button", name="Jog motor 1 left").click(button="right")
    page.get_by_role("button", name="Jog motor 1 right").click(delay=200)
    until(page, lambda: figure(page, 1, "position") > 0)


def test_a_finger_jogs_and_drags_without_selecting_text(ide: Ide, chromium: Browser):
    context = chromium.new_context(viewport={"width": 1180, "height": 820}, has_touch=True, is_mobile=True)
    page = context.new_page()
    page.goto(ide.url)
    page.locator(".axis").first.wait_for()
    finger = context.new_cdp_session(page)
    touch(finger, "touchStart", *place(page, "Jog motor 0 right"))
    until(page, lambda: figure(page, 0, "speed") == 400)
    touch(finger, "touchCancel")
    until(page, lambda: figure(page, 0, "speed") == 0)
    tab(page, "Bench")
    x, y = place(page, "Load of motor 0", "slider")
    touch(finger, "touchStart", x, y)
    for step in range(1, 6):
        touch(finger, "touchMove", x + 8 * step, y)
    touch(finger, "touchEnd")
    load = page.get_by_role("slider", name="Load of motor 0")
    until(page, lambda: int(load.input_value()) > 10)
    page.get_by_role("button", name="release", exact=True).click()
    expect(load).to_have_value("0")
    assert page.evaluate("getSelection().toString()") == ""
    context.close()


def test_a_driver_fault_is_raised_and_shown(page: Page):
    tab(page, "Bench")
    page.get_by_role("button", name="Faults of motor 2").click()
    page.get_by_role("group", name="Driver faults of motor 2").get_by_role(
        "button", name="open load a"
    ).click()
    expect(page.get_by_role("button", name="Faults of motor 2")).to_have_text("open load a")
    tab(page, "Direct mode")
    line(page, "ROR 2, 300")
    tab(page, "Axes")
    expect(page.locator(".axis.motor2 .errors")).to_have_text("open load on bridge A")
    tab(page, "Bench")
    page.get_by_role("group", name="Driver faults of motor 2").get_by_role(
        "button", name="open load a"
    ).click()
    expect(page.get_by_role("button", name="Faults of motor 2")).to_have_text("faults")
    page.get_by_role("button", name="Faults of motor 2").click()
    expect(page.get_by_role("img", name="output 7 off")).to_be_in_viewport()


def test_the_rail_of_a_machine_shows_its_ends_and_switches(open_ide: OpenIde):
    stage, _ = open_ide("--bench", str(BENCHES / "xy-stage.toml"))
    axis = stage.locator(".axis.motor0")
    expect(axis.locator(".rail > span")).to_have_text(["\u2212158\u2009720", "363\u2009520"])
    expect(axis).to_contain_text("60.00 mm")
    expect(axis.locator(".cam")).to_have_count(2)
    expect(stage.locator(".axis.motor2 .cam")).to_have_count(0)
    stage.get_by_label("Speed of time").select_option("100")
    stage.get_by_role("textbox", name="Destination of motor 0").fill("-200000")
    stage.keyboard.press("Enter")
    stage.get_by_role("button", name="Move motor 0 to").click()
    expect(axis.locator(".cam[data-side=left]")).to_have_class("cam on")
    until(stage, lambda: figure(stage, 0, "speed") == 0)
    stage.get_by_role("button", name="Zero motor 0").click()
    expect(axis.locator(".rail > span").last).not_to_have_text("363\u2009520")


def test_an_unplugged_line_is_told_and_plugged_in_again(page: Page):
    tab(page, "Bench")
    page.get_by_role("button", name=re.compile("^Line ")).click()
    page.get_by_role("button", name="Plug it in").click()
    expect(page.locator(".banner")).to_have_count(0)


def test_a_module_without_drivers_offers_no_loads(open_ide: OpenIde):
    page, _ = open_ide("--model", "342")
    expect(page.get_by_role("button", name="speed", exact=True)).to_be_visible()
    expect(page.get_by_role("button", name="load", exact=True)).to_have_count(0)
    expect(page.get_by_role("meter")).to_have_count(0)
    expect(page.locator(".dial.dead")).to_have_count(0)
    tab(page, "Bench")
    expect(page.get_by_role("button", name="Faults of motor 0")).to_have_count(0)
    page.get_by_role("button", name="Tools", exact=True).click()
    for tool in ("Stall detection", "Load profile"):
        page.get_by_role("button", name=tool).click()
        expect(page.locator(".tools")).to_contain_text("it does not measure their load")


def test_an_input_held_by_hand_is_given_back_to_the_bench(open_ide: OpenIde):
    page, _ = open_ide("--bench", str(BENCHES / "joystick.toml"))
    tab(page, "Bench")
    level = page.get_by_role("textbox", name="Value of input 0")
    level.fill("77")
    level.press("Enter")
    page.get_by_role("button", name="Give input 0 back to the bench").click()
    expect(page.get_by_role("button", name="Give input 0 back to the bench")).to_have_count(0)
    until(page, lambda: level.input_value() != "77")


def test_a_value_that_moves_leaves_the_selection(page: Page, ide: Ide, window: Callable[[str], Page]):
    other = window(ide.url)
    levels = []
    for shown in (page, other):
        tab(shown, "Bench")
        levels.append(shown.get_by_role("textbox", name="Value of input 0"))
    mine, theirs = levels
    mine.select_text()
    theirs.fill("300")
    theirs.press("Enter")
    expect(mine).to_have_value("300")
    page.keyboard.insert_text("77")
    expect(mine).to_have_value("77")
    page.keyboard.press("Enter")
    expect(theirs).to_have_value("77")


def test_stop_all_does_not_say_what_is_not_so(page: Page):
    tab(page, "Bench")
    page.get_by_role("button", name=re.compile("^Line ")).click()
    page.keyboard.press("F10")
    strip = page.locator(".banner.stop")
    expect(strip).to_contain_text("Not confirmed: the program (no answer: the line is unplugged), motor 0")
    page.get_by_role("button", name=re.compile("^Line ")).click()
    expect(strip).to_contain_text("all motors have confirmed that they stand")
    expect(page.get_by_role("button", name="Run", exact=True)).to_be_disabled()
    strip.get_by_role("button", name="Release").click()
    expect(strip).to_have_count(0)
    expect(page.get_by_role("button", name="Run", exact=True)).to_be_enabled()


def test_an_arrow_moves_by_a_chosen_step(page: Page):
    page.get_by_label("Step of the arrows of motor 1").select_option("100")
    for _ in range(5):
        page.get_by_role("button", name="Jog motor 1 right").click()
    until(page, lambda: figure(page, 1, "position") == 500)
    page.get_by_label("Step of the arrows of motor 1").select_option("fullstep")
    page.get_by_role("button", name="Jog motor 1 left").click()
    until(page, lambda: figure(page, 1, "position") == 436)


def test_stop_all_is_in_view_on_every_screen(ide: Ide, chromium: Browser):
    for width, height in ((390, 844), (640, 360), (820, 1180), (1280, 720), (1920, 1080)):
        context = chromium.new_context(viewport={"width": width, "height": height})
        page = context.new_page()
        page.goto(ide.url)
        page.locator(".axis").last.scroll_into_view_if_needed()
        expect(page.get_by_role("button", name="STOP ALL")).to_be_in_viewport(ratio=1)
        plot = box_of(page.locator(".plot .u-over"))
        assert plot["height"] >= 60
        context.close()


def test_bench_stands_beside_the_axes_where_there_is_room(ide: Ide, chromium: Browser):
    context = chromium.new_context(viewport={"width": 1920, "height": 1080})
    page = context.new_page()
    page.goto(ide.url)
    expect(page.locator(".axis").first).to_be_visible()
    expect(page.locator(".bench")).to_be_visible()
    tab(page, "Program")
    expect(page.locator(".axis").first).to_be_visible()
    expect(page.locator(".program")).to_be_visible()
    context.close()
