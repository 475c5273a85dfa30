"""Makes the README's pictures: drives the real IDE in Chromium, and keeps what it shows.

    .venv/bin/python docs/pictures.py

Writes `docs/images/ide.png` and the recording `docs/images/ide.gif`.  Needs Chromium and the test requirements.
"""

from __future__ import annotations

import io
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from PIL import Image
from playwright.sync_api import Page, sync_playwright

ROOT = Path(__file__).parent.parent
IMAGES = ROOT / "docs" / "images"
COMMAND = [
    str(Path(sys.executable).with_name("tmcm34x")),
    "ide",
    "examples/manual/5.2-first-program.tmc",
    "--no-browser",
]
FLAGS = ["--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-component-update"]
SIZE = {"width": 1280, "height": 720}
FRAME_MS = 200
GIF_WIDTH = 960
COLORS = 256


@contextmanager
def ide() -> Iterator[str]:
    """The address of a running IDE."""
    process = subprocess.Popen(COMMAND, cwd=ROOT, stdout=subprocess.PIPE, text=True)
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


def main() -> None:
    """Make both pictures."""
    IMAGES.mkdir(exist_ok=True)
    with ide() as address, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
        page = browser.new_page(viewport=SIZE)
        page.goto(address)
        page.locator(".cm-content").wait_for()
        recorder = Recorder(page)
        play(page, recorder)
        recorder.save(IMAGES / "ide.gif")
        browser.close()


if __name__ == "__main__":
    main()
