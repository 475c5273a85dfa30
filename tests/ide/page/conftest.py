"""One browser and one server for the page tests of a file."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page, expect, sync_playwright
from websockets.sync.client import connect

from ide.page.driver import PROGRAM, Ide

expect.set_options(timeout=10_000)
FLAGS = (
    "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync",
)  # fmt: skip


@pytest.fixture(scope="module")
def chromium() -> Iterator[Browser]:
    executable = shutil.which("chromium")
    assert executable, "install Debian's chromium"
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=executable, args=list(FLAGS))
        yield browser
        browser.close()


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Ide]:
    folder = tmp_path_factory.mktemp("work")
    (folder / "program.tmc").write_text(PROGRAM)
    ide = Ide(folder)
    yield ide
    ide.stop()


@pytest.fixture
def ide(shared: Ide) -> Ide:
    """The shared server as on its first day: folder, module and bench."""
    for file in shared.folder.iterdir():
        file.unlink()
    (shared.folder / "program.tmc").write_text(PROGRAM)
    calls = [
        {"call": "set_breakpoints", "breakpoints": []},
        {"call": "set_time", "paused": False, "speed": 1},
        {"call": "set_bench", "what": "line", "index": 0, "value": 1},
        {"call": "stop_all"},
        {"call": "execute", "number": 137, "value": 1234},
        *(
            {"call": "set_bench", "what": side, "index": n, "value": 0}
            for side in ("left", "right")
            for n in range(3)
        ),
        *({"call": "set_bench", "what": "input", "index": n, "value": 0} for n in range(8)),
        {"call": "set_bench", "what": "power", "index": 0, "value": 0},
        {"call": "set_bench", "what": "power", "index": 0, "value": 1},
    ]
    origin, token = shared.url.split("/?token=")
    cookie = {"Cookie": f"tmcm34x-{origin.rpartition(':')[2]}={token}"}
    with connect(f"ws{origin[4:]}/wire", origin=origin, additional_headers=cookie, proxy=None) as socket:
        for number, call in enumerate(calls, 1):
            socket.send(json.dumps([number, call]))
            while not _is_answer(socket.recv(timeout=10), number):
                pass
    return shared


def _is_answer(message: str | bytes, number: int) -> bool:
    return isinstance(message, str) and json.loads(message).get("id") == number


@pytest.fixture
def page(ide: Ide, chromium: Browser) -> Iterator[Page]:
    context = chromium.new_context(viewport={"width": 1280, "height": 720}, accept_downloads=True)
    page = context.new_page()
    page.set_default_timeout(10_000)
    troubles: list[str] = []
    foreign: list[str] = []
    page.on("pageerror", lambda error: troubles.append(str(error)))
    page.on("request", lambda request: foreign.append(request.url) if not _local(request.url) else None)
    page.goto(ide.url)
    expect(page.locator(".cm-content")).to_be_visible()
    yield page
    context.close()
    assert troubles == []
    assert foreign == []


def _local(url: str) -> bool:
    return url.startswith(("http://127.0.0.1:", "data:", "blob:"))
