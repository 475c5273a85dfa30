"""No critical or serious violation that axe-core finds, on every screen, in both themes."""

from __future__ import annotations

from typing import Any

import pytest
from playwright.sync_api import Browser

from ide.front_end import WEB
from ide.page.driver import Ide, screens

AXE = WEB / "node_modules" / "axe-core" / "axe.min.js"
RUN = """async () => {
    const { violations } = await axe.run(document, { resultTypes: ["violations"] });
    const grave = violations.filter(({ impact }) => impact === "critical" || impact === "serious");
    const told = (id) => ({ target, any }) => `${id} ${target}: ${any[0]?.message ?? ""}`;
    return grave.flatMap(({ id, nodes }) => nodes.map(told(id)));
}"""


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_no_screen_has_a_critical_or_serious_violation(ide: Ide, chromium: Browser, theme: Any):
    # The page's own policy forbids foreign scripts; the test is one.
    context = chromium.new_context(
        viewport={"width": 1280, "height": 720}, color_scheme=theme, bypass_csp=True
    )
    page = context.new_page()
    page.goto(ide.url)
    page.locator(".axis").first.wait_for()
    page.get_by_role("treeitem").first.wait_for()  # a tree of files without files is a violation
    page.evaluate(AXE.read_text(encoding="utf-8"))
    found = {screen: page.evaluate(RUN) for screen in screens(page)}
    context.close()
    assert {screen: violations for screen, violations in found.items() if violations} == {}
