"""Every screen at five sizes: nothing overflows, overlaps, is cut off, hides STOP ALL or is disabled for no reason."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import Browser, Page, expect

from ide.page.driver import Ide, OpenIde, box_of, paste, screens, tab, until

FINDINGS = """() => {
    const found = [];
    const dialog = document.querySelector("dialog[open]");
    const root = dialog ?? document.body;
    const seen = (element) =>
        element.checkVisibility({ opacityProperty: true, visibilityProperty: true }) &&
        !element.closest(".cm-editor, [inert]");
    const name = (element) => {
        const text = (element.ariaLabel || element.title || element.textContent || "").trim().slice(0, 40);
        return `${element.tagName.toLowerCase()}.${[...element.classList].join(".")} "${text}"`;
    };
    const hides = (style) => style === "hidden" || style === "clip";
    const scrolls = (style) => style === "auto" || style === "scroll";
    const controls = [...root.querySelectorAll("button, select, input, [role=switch], a[href]")].filter(seen);

    if (document.documentElement.scrollWidth > innerWidth)
        found.push(`the page is ${document.documentElement.scrollWidth} wide`);

    const stop = document.querySelector(".stop-all").getBoundingClientRect();
    const inView = stop.left >= 0 && stop.right <= innerWidth && stop.top >= 0 && stop.bottom <= innerHeight;
    if (!dialog && !inView) found.push("STOP ALL is out of view");

    // What is seen of an element, and whether an ancestor that cannot be scrolled cuts it off.
    const boxes = controls.map((element) => {
        const box = element.getBoundingClientRect();
        const part = { left: box.left, top: box.top, right: box.right, bottom: box.bottom };
        let scrollable = false;
        for (let at = element.parentElement; at && at !== document.body; at = at.parentElement) {
            const style = getComputedStyle(at);
            const edge = at.getBoundingClientRect();
            scrollable ||= scrolls(style.overflowX) || scrolls(style.overflowY);
            const across = hides(style.overflowX) && (box.left < edge.left - 1 || box.right > edge.right + 1);
            const down = hides(style.overflowY) && (box.top < edge.top - 1 || box.bottom > edge.bottom + 1);
            if (!scrollable && (across || down)) found.push(`cut off: ${name(element)} by ${at.className}`);
            if (style.overflowX !== "visible") {
                part.left = Math.max(part.left, edge.left);
                part.right = Math.min(part.right, edge.right);
            }
            if (style.overflowY !== "visible") {
                part.top = Math.max(part.top, edge.top);
                part.bottom = Math.min(part.bottom, edge.bottom);
            }
            if (style.position === "fixed") break;
        }
        return { element, part };
    });

    // Two controls at one place; what stays in view while the page scrolls under it is above the rest by design.
    const above = (element) => !!element.closest(".top, .lane, .menu, .popover, dialog");
    boxes.forEach((one, at) => boxes.slice(at + 1).forEach((other) => {
        const [a, b] = [one.element, other.element];
        if (a.contains(b) || b.contains(a) || above(a) !== above(b) || a.matches(".send") || b.matches(".send")) return;
        const left = Math.max(one.part.left, other.part.left), right = Math.min(one.part.right, other.part.right);
        const top = Math.max(one.part.top, other.part.top), bottom = Math.min(one.part.bottom, other.part.bottom);
        if (right - left > 1 && bottom - top > 1) found.push(`overlap: ${name(a)} and ${name(b)}`);
    }));

    for (const element of controls)
        if (element.disabled && !element.title) found.push(`disabled without a reason: ${name(element)}`);

    // Text that does not fit, where no ellipsis says so.
    const texts = ".axis .label, .axis .figure, .parameters th, .legend b, h3, h4, dt, dd, .pill, .choice button";
    for (const element of root.querySelectorAll(texts)) {
        const style = getComputedStyle(element);
        if (!seen(element) || style.display === "inline" || style.textOverflow === "ellipsis") continue;
        if (element.scrollWidth > element.clientWidth + 1) found.push(`text does not fit: ${name(element)}`);
    }
    return [...new Set(found)];
}"""

SIZES = {
    "laptop": {"width": 1280, "height": 720},
    "desktop": {"width": 1920, "height": 1080},
    "tablet": {"width": 820, "height": 1180},
    "phone": {"width": 390, "height": 844},
    "zoomed to 200 %": {"width": 640, "height": 360},
}
FINGERS = ("tablet", "phone")


@pytest.mark.parametrize("name", SIZES)
def test_every_screen_fits(ide: Ide, chromium: Browser, name: str):
    fingers = name in FINGERS
    context = chromium.new_context(
        viewport=SIZES[name],  # type: ignore[arg-type]
        has_touch=fingers,
        is_mobile=fingers,
        device_scale_factor=1 if name in {"laptop", "desktop", "tablet"} else 2,
    )
    page = context.new_page()
    page.goto(ide.url)
    page.locator(".axis").first.wait_for()
    expect(page.locator("[data-curve]").first).to_have_text("0")
    found = {screen: page.evaluate(FINDINGS) for screen in screens(page)}
    context.close()
    assert len(found) > 20
    assert {screen: findings for screen, findings in found.items() if findings} == {}


@pytest.mark.parametrize("name", ["phone", "zoomed to 200 %"])
def test_a_small_page_does_not_grow_with_its_lower_panel(ide: Ide, chromium: Browser, name: str):
    context = chromium.new_context(viewport=SIZES[name])  # type: ignore[arg-type]
    page = context.new_page()
    page.goto(ide.url)
    page.locator(".axis").first.wait_for()
    tab(page, "Telegrams")
    tall = box_of(page.locator(".middle"))["height"]
    release = page.get_by_role("button", name="Release")
    for _ in range(4):  # at least four telegrams and their replies each
        page.keyboard.press("F10")
        release.click()
        expect(release).to_have_count(0)
    count = page.locator(".log .bar", has_text="telegrams")
    until(page, lambda: int(re.findall(r"(\d+) telegrams", count.inner_text())[0]) >= 32)
    assert box_of(page.locator(".middle"))["height"] == tall
    context.close()


@pytest.mark.parametrize("name", ["phone", "zoomed to 200 %"])
def test_stop_all_can_be_released_beside_a_notice(open_ide: OpenIde, name: str):
    page, _ = open_ide()
    page.set_viewport_size(SIZES[name])  # type: ignore[arg-type]
    paste(page, "XYZ 1\n")
    page.keyboard.press("F9")
    expect(page.locator(".notice")).to_be_visible()
    page.keyboard.press("F10")
    expect(page.get_by_role("button", name="Release")).to_be_visible()
    assert page.evaluate(FINDINGS) == []


def test_what_does_not_fit_is_found(page: Page):
    page.locator(".axis").first.wait_for()
    assert page.evaluate(FINDINGS) == []
    page.evaluate("""() => {
        document.querySelector(".stop-all").style.cssText = "position: fixed; left: -200px";
        document.querySelector(".axis footer .stop").style.marginLeft = "-20px";
        document.querySelector(".axis .figure.big").textContent = "\u2212123\u2009456\u2009789\u2009012";
        document.querySelector(".axis footer").style.cssText = "overflow: hidden; width: 100px";
    }""")
    found = "\n".join(page.evaluate(FINDINGS))
    for words in ("STOP ALL is out of view", "overlap: ", "text does not fit: ", "cut off: "):
        assert words in found
