"""Makes the pictures of the README and of docs/ide.md: drives the real IDE in Chromium, and keeps what it shows.

    .venv/bin/python docs/pictures.py [machine]

Writes `docs/images/ide.png` and the recording `docs/images/ide.gif`; then `machine.png`, the drawing of a machine, and
`history.png`, a past moment of it; with the word `machine` these two only.  Needs Chromium and the test requirements.
"""

from __future__ import annotations

import io
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from PIL import Image
from playwright.sync_api import Page, sync_playwright

ROOT = Path(__file__).parent.parent
IMAGES = ROOT / "docs" / "images"
COMMAND = [str(Path(sys.executable).with_name("tmcm34x")), "ide", "--no-browser"]
FIRST = ("examples/manual/5.2-first-program.tmc",)
MACHINE = ("examples/pick-and-place.tmc", "--bench", "examples/benches/pick-and-place.toml")
FLAGS = ["--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-component-update"]
SIZE = {"width": 1280, "height": 720}
FRAME_MS = 200
GIF_WIDTH = 960
COLORS = 256


@contextmanager
def ide(*options: str) -> Iterator[str]:
    """The address of a running IDE."""
    process = subprocess.Popen([*COMMAND, *options], cwd=ROOT, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    try:
        yield process.stdout.readline().split()[2]
    finally:
        process.terminate()
        process.wait(10)


class Recorder:
    """Frames of a page, one every `FRAME_MS`."""

    def __init__(self, page: Page) -> None:
        self._page = page
        self._frames: list[Image.Image] = []

    def watch(self, seconds: float) -> None:
        """Keep what the page shows for a while."""
        for _ in range(round(seconds * 1000 / FRAME_MS)):
            shot = Image.open(io.BytesIO(self._page.screenshot())).convert("RGB")
            height = round(shot.height * GIF_WIDTH / shot.width)
            self._frames.append(shot.resize((GIF_WIDTH, height), Image.Resampling.LANCZOS))
            self._page.wait_for_timeout(FRAME_MS / 2)

    def save(self, path: Path) -> None:
        """Write the recording, all frames in the colours of the middle one."""
        palette = self._frames[len(self._frames) // 2].quantize(COLORS, Image.Quantize.MAXCOVERAGE)
        first, *rest = (frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in self._frames)
        first.save(path, save_all=True, append_images=rest, duration=FRAME_MS, loop=0, optimize=True)


def play(page: Page, recorder: Recorder) -> None:
    """Run, change a speed, close a switch, hold at a breakpoint, step, go on."""
    page.get_by_role("button", name="Run", exact=True).click()
    recorder.watch(4)
    page.get_by_role("tab", name="Bench", exact=True).click()
    page.get_by_role("button", name="left switch of motor 0").click()
    recorder.watch(1)
    page.get_by_role("tab", name="Axes", exact=True).click()
    recorder.watch(8)
    page.screenshot(path=IMAGES / "ide.png")
    line = page.locator(".cm-line", has_text="MVP").last
    number = line.evaluate("line => [...line.parentElement.children].indexOf(line)")
    page.locator(".breakpoints .cm-gutterElement").nth(number + 1).click()
    recorder.watch(2.5)
    for _ in range(2):
        page.get_by_role("button", name="Step", exact=True).click()
        recorder.watch(1)
    page.get_by_role("button", name="Run", exact=True).click()
    recorder.watch(1.5)


def record(page: Page) -> None:
    """The first program: the recording and the picture of the page."""
    recorder = Recorder(page)
    play(page, recorder)
    recorder.save(IMAGES / "ide.gif")


def show_machine(page: Page) -> None:
    """A machine at work, and then a past moment of it."""
    page.get_by_role("tab", name="Machine", exact=True).click()
    page.get_by_role("button", name="Run", exact=True).click()
    page.wait_for_timeout(3000)
    page.get_by_role("combobox", name="Speed of time").select_option("10")
    page.wait_for_timeout(4000)
    page.get_by_role("button", name="Hold time").click()
    page.wait_for_timeout(500)
    page.locator(".right").screenshot(path=IMAGES / "machine.png")
    box = page.get_by_role("slider", name="Moment").bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + box["width"] * 0.9, box["y"] + box["height"] / 2)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] * 0.7, box["y"] + box["height"] / 2, steps=20)
    page.mouse.up()
    page.locator(".past-strip").wait_for()
    page.wait_for_timeout(1500)
    page.screenshot(path=IMAGES / "history.png")


def picture(options: tuple[str, ...], make: Callable[[Page], None]) -> None:
    """Have `make` keep what a page of an IDE shows."""
    with ide(*options) as address, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
        page = browser.new_page(viewport=SIZE)
        page.goto(address)
        page.locator(".cm-content").wait_for()
        make(page)
        browser.close()


def main() -> None:
    """Make the pictures."""
    IMAGES.mkdir(exist_ok=True)
    if "machine" not in sys.argv:
        picture(FIRST, record)
    picture(MACHINE, show_machine)


if __name__ == "__main__":
    main()
