"""Drives the page in Chromium: a server process, and what tests do to its page."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TypeVar

from playwright.sync_api import FloatRect, Locator, Page, TimeoutError, expect  # noqa: A004

from ide.front_end import built

T = TypeVar("T")

COMMAND = str(Path(sys.executable).with_name("tmcm34x"))

PROGRAM = """\
// Two motors
Speed = 500
        ROR 0, Speed
Loop:   CALC ADD, 1
        CSUB Rest
        JA Loop
Rest:   WAIT TICKS, 0, 2
        RSUB
"""


class Ide:
    """`tmcm34x ide` on a folder of its own."""

    def __init__(self, folder: Path, *options: str) -> None:
        built()
        self.folder = folder
        self.process = subprocess.Popen(
            [COMMAND, "ide", str(folder / "program.tmc"), "--no-browser", *options],
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self.process.stdout is not None
        self.links: list[list[str]] = []
        """Kind and address of lines for other hosts."""
        while True:
            ready, kind, address = self.process.stdout.readline().split()
            assert ready == "ready"
            if kind == "ide":
                break
            self.links.append([kind, address])
        self.url = address

    def stop(self) -> None:
        self.process.terminate()
        assert self.process.stdout is not None
        self.process.stdout.close()
        self.process.wait(60)


OpenIde = Callable[..., tuple[Page, Ide]]


def figure(page: Page, motor: int, name: str) -> int:
    """A figure of a motor, as it is shown, once there is one."""
    shown = page.wait_for_function(
        "where => { const text = document.querySelector(where)?.innerText ?? ''; return /[0-9]/.test(text) && text; }",
        arg=f".axis.motor{motor} [data-figure={name}]",
    )
    return int(shown.json_value().replace("\u2009", "").replace("\u2212", "-"))


def until(page: Page, holds: Callable[[], T | None], tries: int = 1200) -> T:
    """Wait for something that no locator can see, and return it."""
    for _ in range(tries):
        if seen := holds():
            return seen
        page.wait_for_timeout(25)
    raise AssertionError(f"it never came; the page says {page.locator('.lane, .notice').all_inner_texts()}")


def box_of(place: Locator) -> FloatRect:
    """Where an element is on the page, once it is there: pictures are replaced by new ones as their contents change."""
    place.wait_for()
    return until(place.page, place.bounding_box)


def rest_on(place: Locator, sign: Locator) -> None:
    """Rest the pointer on a place until the sign is there: an editor that is drawn anew waits for the next move."""
    for step in range(30):
        place.hover(position={"x": 4 + step % 2, "y": 8})
        try:
            sign.wait_for(timeout=2_000)
        except TimeoutError:
            continue
        return
    raise AssertionError(f"resting on {place} shows nothing")


def tab(page: Page, name: str) -> None:
    """Open a panel."""
    page.get_by_role("tab", name=name, exact=True).click()


def line(page: Page, text: str) -> None:
    """Send a line in direct mode."""
    field = page.get_by_role("textbox", name="Command line")
    field.fill(text)
    field.press("Enter")


def paste(page: Page, text: str) -> None:
    """Paste into the editor."""
    page.locator(".cm-content").evaluate(
        """(element, text) => {
            const clipboardData = new DataTransfer();
            clipboardData.setData("text/plain", text);
            element.dispatchEvent(new ClipboardEvent("paste", { clipboardData, bubbles: true, cancelable: true }));
        }""",
        text,
    )


def shown(page: Page, path: str) -> Locator:
    """The text of a file, once it is in front."""
    return page.locator(f".code:not([hidden])[data-path='{path}'] .cm-content")


def drafted(page: Page, path: str) -> None:
    """Wait until the browser has kept the unsaved text of a file."""
    page.wait_for_function(
        "path => Object.keys(localStorage).some((key) => key.includes(`\\n${path}\\n`))", arg=path
    )


def arm(page: Page) -> None:
    """Allow motors of a real module to be moved."""
    switch = page.get_by_role("switch", name="ARMED")
    switch.click()
    expect(switch).to_have_attribute("aria-checked", "true")


def choose(page: Page, name: str, value: str) -> None:
    """Choose a value of a list that is in the module, and send it."""
    field = page.get_by_role("combobox", name=name)
    field.select_option(value)
    field.press("Enter")


def rename(page: Page, name: str) -> None:
    """Open the field with a file's name, from its menu."""
    page.get_by_role("treeitem", name=name).click(button="right")
    # By key: the pointer stays over the files, away from what hovering would show in the editor.
    page.get_by_role("menuitem", name="Rename", exact=True).press("Enter")


def screens(page: Page) -> Iterator[str]:
    """Show one screen after the other, on a page of any size; says which."""
    yield "first"
    for panel in ("Right panel", "Second right panel", "Lower panel"):
        for name in page.get_by_role("tablist", name=panel, exact=True).get_by_role("tab").all_inner_texts():
            page.get_by_role("tablist", name=panel, exact=True).get_by_role("tab", name=name).click()
            yield name
    page.keyboard.press("Control+Alt+4")
    page.keyboard.press("Control+Alt+8")
    for choice in page.locator(".parameters-page .bar [role=radio]").all():
        choice.click()
        yield choice.inner_text()
    page.keyboard.press("Control+Alt+0")
    page.locator(".listing").wait_for()
    yield "Listing"
    page.keyboard.press("Alt+m")
    page.locator(".compare").wait_for()
    yield "Compare"
    page.keyboard.press("Control+Alt+9")
    for tool in page.get_by_role("navigation", name="Tools").get_by_role("button").all():
        tool.click()
        yield tool.inner_text()
    page.keyboard.press("Control+p")
    page.keyboard.type("program.tmc")
    page.keyboard.press("Enter")
    page.locator(".cm-content").first.wait_for()
    page.keyboard.press("Control+Alt+s")
    page.get_by_role("dialog", name="Save as").wait_for()
    yield "Save as"
    page.keyboard.press("Escape")
    for wish, there in (
        ("Connect to a", ".connection form"),
        ("Start page", ".gallery .tile"),
        ("tour", ".tour"),
    ):
        page.keyboard.press("Control+p")
        page.keyboard.type(wish)
        page.keyboard.press("Enter")
        page.locator(there).first.wait_for()
        yield wish
    page.keyboard.press("Escape")
    page.keyboard.press("F10")
    page.get_by_role("button", name="Release").wait_for()
    yield "STOP ALL"
    page.keyboard.press("Control+p")
    yield "palette"
    page.keyboard.press("Escape")
    page.keyboard.press("F1")
    yield "keys"
    page.keyboard.press("Escape")
