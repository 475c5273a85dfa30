"""The page: axes, bench and time."""

from __future__ import annotations

from playwright.sync_api import Page, expect

from ide.page.driver import figure, line, tab, until


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
    rotor = page.locator(".dial.motor2 .rotor")
    tab(page, "Direct mode")
    line(page, "ROR 2, 300")
    first = rotor.get_attribute("style")
    until(page, lambda: rotor.get_attribute("style") != first)


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
    page.get_by_role("button", name="Line", exact=True).click()
    line(page, "GAP 1, 0")
    expect(page.locator(".answers .result").first).to_contain_text("unplugged")
    page.get_by_role("button", name="Line", exact=True).click()
    page.get_by_role("button", name="Power", exact=True).click()
    expect(page.locator(".banner")).to_contain_text("no power")
    page.get_by_role("button", name="Power", exact=True).click()
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
    until(page, lambda: seconds(running.inner_text()) > start + 60, 400)
