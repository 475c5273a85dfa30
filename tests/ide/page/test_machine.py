"""The page: the drawing of the machine moves with its loads, and its switches can be clicked."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Locator, Page, expect

from ide.page.driver import OpenIde, tab, until

BENCHES = Path(__file__).parents[3] / "examples" / "benches"
SQUARE = """\
        SAP 4, 0, 1500
        SAP 4, 1, 1500
        SCO 3, 0, 9000
        SCO 3, 1, 6000
        MVP ABS, 0, 12000
        WAIT POS, 0, 0
        MVP ABS, 1, 6000
        WAIT POS, 1, 0
        STOP
"""


def shift(element: Locator) -> tuple[float, ...]:
    """Where an element of the drawing is moved to."""
    return tuple(map(float, re.findall(r"-?[\d.]+", element.get_attribute("transform") or "")))


def place(page: Page, motor: int) -> float:
    text = page.locator(f"[data-place='{motor}']").inner_text()
    return float(text.split()[0].replace("\u2212", "-"))


@pytest.fixture
def stage(tmp_path: Path, open_ide: OpenIde) -> Page:
    (tmp_path / "program.tmc").write_text(SQUARE)
    page, _ = open_ide("--bench", str(BENCHES / "belt-stage.toml"))
    tab(page, "Machine")
    return page


def test_a_plan_view_moves_with_the_loads_and_keeps_the_path(stage: Page):
    carriage = stage.locator(".plan-view .carriage")
    before = shift(carriage)
    stage.keyboard.press("F9")
    until(stage, lambda: place(stage, 1) > 78)
    expect(stage.locator("[data-place='0']")).to_have_text("97.50 mm")
    expect(stage.locator("[data-place='1']")).to_have_text("78.75 mm")
    after = shift(carriage)
    assert after[0] > before[0] and after[1] < before[1]
    path = stage.locator(".plan-view .trail").get_attribute("d") or ""
    points = [tuple(map(float, point.split())) for point in re.findall(r"[\d.]+ [\d.]+", path)]
    assert len(points) > 20
    corner = (after[0], before[1])
    assert min(abs(x - corner[0]) + abs(y - corner[1]) for x, y in points) < 3, "the path goes by the corner"
    assert all(abs(y - before[1]) < 1 or abs(x - after[0]) < 1 for x, y in points), "and not across"
    expect(stage.locator(".plan-view .mark text")).to_have_text("3")


def test_the_drawing_follows_scrubbed_time(stage: Page):
    carriage, trail = stage.locator(".plan-view .carriage"), stage.locator(".plan-view .trail")
    before = shift(carriage)
    stage.keyboard.press("F9")
    until(stage, lambda: place(stage, 1) > 78)
    expect(stage.locator("[data-place='1']")).to_have_text("78.75 mm")
    after, path = shift(carriage), trail.get_attribute("d") or ""
    stage.get_by_role("slider", name="Moment").press("Home")
    expect(stage.locator(".past-strip")).to_be_visible()
    until(stage, lambda: shift(carriage) == before)
    until(stage, lambda: len(trail.get_attribute("d") or "") < len(path) / 2)
    stage.keyboard.press("Alt+F2")
    until(stage, lambda: shift(carriage) == after)
    until(stage, lambda: (trail.get_attribute("d") or "").startswith(path))  # it is known as before


def test_a_switch_in_the_drawing_is_closed_by_a_click_and_by_a_key(stage: Page):
    switch = stage.get_by_role("button", name="left switch of motor 1")
    expect(switch).to_have_attribute("aria-pressed", "false")
    switch.click()
    expect(switch).to_have_attribute("aria-pressed", "true")
    switch.focus()
    stage.keyboard.press("Space")
    expect(switch).to_have_attribute("aria-pressed", "false")
    stage.keyboard.press("Enter")
    expect(switch).to_have_attribute("aria-pressed", "true")
    tab(stage, "Bench")
    expect(stage.get_by_role("button", name="left switch of motor 1")).to_have_attribute(
        "aria-pressed", "true"
    )


def test_a_turntable_turns_until_its_reference_switch_closes(tmp_path: Path, open_ide: OpenIde):
    (tmp_path / "program.tmc").write_text("        MVP ABS, 0, -11700\n        STOP\n")
    page, _ = open_ide("--bench", str(BENCHES / "turntable.toml"))
    tab(page, "Machine")
    pointer = page.locator(".of-turntable .carriage")
    until(page, lambda: shift(pointer) == (200.0,))
    page.keyboard.press("F9")
    switch = page.get_by_role("button", name="left switch of motor 0")
    expect(switch).to_have_attribute("aria-pressed", "true")
    until(page, lambda: 87 < shift(pointer)[0] <= 93)


def test_bare_motors_are_shafts_that_turn(page: Page):
    tab(page, "Machine")
    shafts = page.locator(".of-shaft")
    expect(shafts).to_have_count(3)
    before = shift(shafts.first.locator(".carriage"))
    page.keyboard.press("F9")
    until(page, lambda: shift(shafts.first.locator(".carriage")) != before)


def test_a_real_module_has_no_drawing(serve: Any, open_ide: OpenIde):
    page, _ = open_ide("--port", f"tcp://{serve('--tcp', '127.0.0.1:0').tcp}")
    expect(page.get_by_role("tab", name="Axes", exact=True)).to_be_visible()
    expect(page.get_by_role("tab", name="Machine", exact=True)).to_have_count(0)


def test_a_closed_switch_holds_the_program_where_the_box_is_checked(tmp_path: Path, open_ide: OpenIde):
    (tmp_path / "program.tmc").write_text("Loop: WAIT TICKS, 0, 1\n JA Loop\n")
    page, _ = open_ide("--bench", str(BENCHES / "belt-stage.toml"))
    tab(page, "Program")
    expect(page.locator(".breaks input")).to_have_count(6)
    page.get_by_role("checkbox", name="Closed switch").check()
    page.keyboard.press("F9")
    expect(page.locator(".status-bar .pill").first).to_have_text("running")
    tab(page, "Machine")
    page.get_by_role("button", name="right switch of motor 0").click()
    expect(page.locator(".status-bar .pill").first).to_have_text("held")
    expect(page.locator(".notice")).to_contain_text("the right switch of motor 0 closed")
