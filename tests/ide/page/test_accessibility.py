"""No critical or serious violation that axe-core finds, on every screen, in both themes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from playwright.sync_api import Browser, Page

from ide.front_end import WEB
from ide.page.driver import Ide

AXE = WEB / "node_modules" / "axe-core" / "axe.min.js"
RUN = """async () => {
    const { violations } = await axe.run(document, { resultTypes: ["violations"] });
    const grave = violations.filter(({ impact }) => impact === "critical" || impact === "serious");
    const told = (id) => ({ target, any }) => `${id} ${target}: ${any[0]?.message ?? ""}`;
    return grave.flatMap(({ id, nodes }) => nodes.map(told(id)));
}"""


def screens(page: Page) -> Iterator[str]:
    """Shows one screen after the other; says which."""
    yield "first"
    for name in ("Machine", "Bench", "Program"):
        page.get_by_role("tab", name=name, exact=True).click()
        yield name
    for name in ("Direct mode", "Telegrams", "Problems"):
        page.get_by_role("tab", name=name, exact=True).click()
        yield name
    page.get_by_role("button", name="Parameters", exact=True).click()
    for name in ("Axis", "Global", "User variables", "Coordinates", "EEPROM"):
        page.get_by_role("radio", name=name, exact=True).click()
        yield name
    page.get_by_role("button", name="Listing", exact=True).click()
    yield "Listing"
    page.keyboard.press("Alt+m")
    page.locator(".compare").wait_for()
    yield "Compare"
    page.get_by_role("button", name="Tools", exact=True).click()
    tools = page.get_by_role("navigation", name="Tools").get_by_role("button")
    for tool in tools.all():
        tool.click()
        yield tool.inner_text()
    page.keyboard.press("Control+Alt+s")
    yield "Save as"
    page.keyboard.press("Escape")
    page.keyboard.press("F10")
    yield "STOP ALL"
    page.keyboard.press("Control+p")
    yield "palette"
    page.keyboard.press("Escape")
    page.keyboard.press("F1")
    yield "keys"


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_no_screen_has_a_critical_or_serious_violation(ide: Ide, chromium: Browser, theme: Any):
    # The page's own policy forbids foreign scripts; the test is one.
    context = chromium.new_context(
        viewport={"width": 1280, "height": 720}, color_scheme=theme, bypass_csp=True
    )
    page = context.new_page()
    page.goto(ide.url)
    page.locator(".axis").first.wait_for()
    page.evaluate(AXE.read_text(encoding="utf-8"))
    found = {screen: page.evaluate(RUN) for screen in screens(page)}
    context.close()
    assert {screen: violations for screen, violations in found.items() if violations} == {}
