"""Time travel in the page, by clicks and keys alone."""

from __future__ import annotations

import re

from playwright.sync_api import Page, expect

from debug.debuggees import CRASH, CULPRIT, PLANTED
from ide.page.driver import OpenIde, box_of, rest_on, until

MOVE = 9
"""The line of the program that moves to the coordinate."""


def strip(page: Page):
    """What says that a past moment is shown."""
    return page.locator(".past-strip")


def executed(page: Page):
    return page.locator(".cm-line.execution")


def crashed(open_ide: OpenIde, tmp_path, source: str = PLANTED) -> Page:
    """The program with the planted bug, held where it has crashed."""
    (tmp_path / "program.tmc").write_text(source)
    page, _ = open_ide()
    page.get_by_role("combobox", name="Speed of time").select_option("10")
    page.locator(".breakpoints .cm-gutterElement").nth(CRASH).click()
    expect(page.locator(".cm-gutters .breakpoint:visible")).to_have_count(1)
    page.get_by_role("button", name="Run", exact=True).first.click()
    expect(executed(page)).to_contain_text("Crash:")
    expect(page.locator(".status-bar")).to_contain_text("held")
    return page


def test_a_planted_bug_is_found_by_asking_who_wrote_this(open_ide: OpenIde, tmp_path) -> None:
    page = crashed(open_ide, tmp_path)
    question = page.get_by_role("button", name="Who wrote co[5][0]?")
    rest_on(page.locator(".cm-line", has_text="MVP   COORD").get_by_text("MVP"), question)
    question.click()
    expect(strip(page)).to_contain_text("PAST")
    expect(executed(page)).to_contain_text("SCO   5, 0, 900")
    expect(page.locator(".notices")).to_contain_text(f"line {CULPRIT}: SCO 5, 0, 900 (200 → 900)")
    page.get_by_role("button", name="Step back", exact=True).first.click()
    expect(executed(page)).to_contain_text("Clean:")
    page.get_by_role("button", name="Back to the present").click()
    expect(strip(page)).to_have_count(0)
    expect(executed(page)).to_contain_text("Crash:")


def test_variables_and_watches_have_a_button_that_asks_who_wrote_them(open_ide: OpenIde, tmp_path) -> None:
    page = crashed(open_ide, tmp_path)
    page.get_by_role("tab", name=re.compile("^Program")).click()
    page.get_by_role("button", name="Who wrote gp[3]?", exact=True).click()
    expect(strip(page)).to_contain_text("PAST")
    expect(page.locator(".notices")).to_contain_text("gp[3]:")
    page.get_by_role("button", name="Back to the present").click()
    expect(strip(page)).to_have_count(0)
    page.get_by_role("textbox", name="New watch").fill("co[5][0]")
    page.get_by_role("textbox", name="New watch").press("Enter")
    page.get_by_role("button", name="Who wrote co[5][0]?", exact=True).click()
    expect(executed(page)).to_contain_text("SCO   5, 0, 900")
    expect(page.locator(".notices")).to_contain_text(f"line {CULPRIT}: SCO 5, 0, 900 (200 → 900)")


def _seconds(page: Page) -> float:
    """The moment beside the scrubber; time may have gone on for more than ten seconds meanwhile."""
    return float(page.locator(".scrubber output").inner_text().removesuffix(" s").replace("\u2009", ""))


def ask(page: Page, of: str, value: str) -> None:
    """Ask by the menu of a row, and see that the past is shown and what was found said."""
    page.get_by_role("button", name=f"Who wrote {of}?", exact=True).click()
    page.get_by_role("menuitem", name=value, exact=True).click()
    expect(strip(page)).to_contain_text("PAST")
    expect(page.locator(".notices")).to_contain_text(f"{value}:")


def back(page: Page) -> None:
    """Back to the present, and the program's place in it is shown."""
    page.get_by_role("button", name="Back to the present").click()
    expect(strip(page)).to_have_count(0)
    expect(executed(page)).to_contain_text("Crash:")


def test_rows_of_parameters_coordinates_inputs_and_outputs_ask_who_wrote_them(
    open_ide: OpenIde, tmp_path
) -> None:
    page = crashed(open_ide, tmp_path, PLANTED.replace("SGP   3, 2, 0", "SIO   2, 2, 1"))
    page.get_by_role("tab", name=re.compile("^Bench")).click()
    ask(page, "an output", "out[2]")
    expect(executed(page)).to_contain_text("SIO   2, 2, 1")
    back(page)
    page.get_by_role("button", name="Parameters", exact=True).click()
    ask(page, "target (next) position", "ap[0][0]")
    expect(page.locator(".notices")).to_contain_text(f"line {MOVE}: MVP COORD, 0, 5")
    expect(executed(page)).to_contain_text("MVP   COORD, 0, 5")
    back(page)
    page.get_by_role("button", name="Parameters", exact=True).click()
    page.get_by_role("radio", name="Coordinates").click()
    ask(page, "coordinate 5", "co[5][0]")
    expect(page.locator(".notices")).to_contain_text(f"line {CULPRIT}: SCO 5, 0, 900 (200 → 900)")


def test_the_scrubber_shows_past_moments_and_a_branch_begins_there(open_ide: OpenIde, tmp_path) -> None:
    page = crashed(open_ide, tmp_path)
    moment = page.get_by_role("slider", name="Moment")
    box = box_of(moment)
    page.mouse.move(box["x"] + box["width"] * 0.9, box["y"] + box["height"] / 2)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] * 0.3, box["y"] + box["height"] / 2, steps=10)
    expect(strip(page)).to_contain_text("nothing here acts")
    first = _seconds(page)
    page.mouse.move(box["x"] + box["width"] * 0.1, box["y"] + box["height"] / 2, steps=5)
    page.mouse.up()
    until(page, lambda: _seconds(page) < first)
    expect(page.locator(".shell")).to_have_class(re.compile(r"\bpast\b"))
    expect(page.get_by_role("button", name="Stop", exact=True).first).to_be_disabled()
    page.get_by_role("button", name="Hold time").click()
    question = page.get_by_role("dialog", name="A past moment is shown")
    question.get_by_role("button", name="Continue from here").click()
    expect(strip(page)).to_have_count(0)
    expect(page.get_by_role("combobox", name="Branch")).to_contain_text("branch 1")
    expect(page.locator(".status-bar")).to_contain_text(re.compile(r"history \d+\.\d of 64 MiB"))
    page.get_by_role("combobox", name="Branch").select_option("0")
    expect(strip(page)).to_contain_text("branch 0")
    page.keyboard.press("Alt+F2")
    expect(strip(page)).to_have_count(0)


def span(page: Page) -> list[float]:
    """The first and last time that the plot shows."""
    return [float(end) for end in (page.locator(".plot .canvas").get_attribute("data-span") or "").split()]


def test_the_plot_shows_the_moment_that_the_scrubber_shows(open_ide: OpenIde, tmp_path) -> None:
    page = crashed(open_ide, tmp_path)
    canvas = page.locator(".plot .canvas")
    page.get_by_role("radio", name="2 s", exact=True).click()
    until(page, lambda: round(span(page)[1] - span(page)[0], 6) == 2 and span(page)[0] > 0.5)
    live = span(page)
    expect(canvas).to_have_attribute("data-moment", "")
    moment = page.get_by_role("slider", name="Moment")
    moment.focus()
    page.keyboard.press("Home")
    expect(strip(page)).to_contain_text("PAST")
    expect(canvas).to_have_attribute("data-moment", "0")
    until(page, lambda: span(page) == [0, 2])
    moment.press("End")
    until(page, lambda: float(canvas.get_attribute("data-moment") or 0) > live[0])
    first, last = span(page)
    assert first <= float(canvas.get_attribute("data-moment") or -1) <= last
    page.keyboard.press("Alt+F2")
    expect(canvas).to_have_attribute("data-moment", "")
    until(page, lambda: span(page)[1] > live[1])


def test_going_back_without_a_place_to_hold_ends_at_the_beginning_and_says_so(
    open_ide: OpenIde, tmp_path
) -> None:
    page = crashed(open_ide, tmp_path)
    page.locator(".breakpoints .cm-gutterElement").nth(CRASH).click()
    expect(page.locator(".cm-gutters .breakpoint:visible")).to_have_count(0)
    page.keyboard.press("Alt+F9")
    expect(page.locator(".notices")).to_contain_text("The beginning of the history")
    expect(page.locator(".scrubber output")).to_have_text("0.000 s")
