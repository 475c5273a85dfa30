"""One browser for all page tests, and one server for those of a file."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, BrowserContext, Page, expect, sync_playwright
from websockets.sync.client import connect

from ide.page.driver import PROGRAM, Ide, OpenIde

# Long: a slow machine is no failure; what is there is seen at once.
PATIENCE_MS = 30_000
expect.set_options(timeout=PATIENCE_MS)
FLAGS = (
    "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--process-per-site",
)  # fmt: skip
KEEPER = "http://127.0.0.1:1/"
"""A page of the site of all servers, which never asks one."""


@pytest.fixture(scope="session")
def chromium() -> Iterator[Browser]:
    executable = shutil.which("chromium")
    assert executable, "install Debian's chromium"
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=executable, args=list(FLAGS))
        yield browser
        browser.close()


@pytest.fixture(scope="session")
def profile(chromium: Browser) -> Iterator[BrowserContext]:
    """What all pages have in common; a page that stays open keeps their process, and with it the compiled script."""
    context = chromium.new_context(viewport={"width": 1280, "height": 720}, accept_downloads=True)
    keeper = context.new_page()
    keeper.route(KEEPER, lambda route: route.fulfill(body=""))
    keeper.goto(KEEPER)
    yield context
    context.close()


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
        {"call": "set_time", "paused": False, "speed": 1},
        {"call": "set_bench", "what": "line", "index": 0, "value": 1},
        {"call": "stop_all"},
        {"call": "release"},
        {"call": "execute", "number": 137, "value": 1234, "sure": True},
        *(
            {"call": "set_bench", "what": side, "index": n, "value": 0}
            for side in ("left", "right")
            for n in range(3)
        ),
        *({"call": "set_bench", "what": "input", "index": n, "value": 0} for n in range(8)),
        {"call": "set_bench", "what": "power", "index": 0, "value": 0},
        {"call": "set_bench", "what": "power", "index": 0, "value": 1},
    ]
    _have_done(shared, "/wire", [[number, call] for number, call in enumerate(calls, 1)], "id")
    sources = [{"path": f"{name}.tmc"} for name in ("program", "program2", "other")]
    requests = [("setExceptionBreakpoints", {"filters": []})]
    requests += [("setBreakpoints", {"source": source, "breakpoints": []}) for source in sources]
    messages = [
        {"seq": number, "type": "request", "command": command, "arguments": arguments}
        for number, (command, arguments) in enumerate(requests, 1)
    ]
    _have_done(shared, "/dap", messages, "request_seq")
    return shared


def _have_done(ide: Ide, path: str, messages: list[Any], key: str) -> None:
    """Send messages numbered from 1; each is answered by one with its number under `key`."""
    origin, token = ide.url.split("/?token=")
    cookie = {"Cookie": f"tmcm34x-{origin.rpartition(':')[2]}={token}"}
    with connect(f"ws{origin[4:]}{path}", origin=origin, additional_headers=cookie, proxy=None) as socket:
        for number, message in enumerate(messages, 1):
            socket.send(json.dumps(message))
            while not _is_answer(socket.recv(timeout=60), key, number):
                pass


def _is_answer(message: str | bytes, key: str, number: int) -> bool:
    return isinstance(message, str) and json.loads(message).get(key) == number


@pytest.fixture
def window(profile: BrowserContext) -> Iterator[Callable[[str], Page]]:
    """Call it with an address: the IDE's page there; none may stumble, or ask anybody but its server."""
    (keeper,) = profile.pages
    troubles: list[str] = []
    foreign: list[str] = []
    origins: set[str] = set()

    def watch(page: Page) -> None:
        page.set_default_timeout(PATIENCE_MS)
        page.on("pageerror", lambda error: troubles.append(str(error)))
        page.on("request", lambda request: foreign.append(request.url) if not _local(request.url) else None)

    def show(url: str) -> Page:
        origins.add(url.split("/?", maxsplit=1)[0])
        page = profile.new_page()
        page.goto(url)
        expect(page.locator(".work .cm-content, .work .page").first).to_be_visible()
        return page

    profile.on("page", watch)
    yield show
    profile.remove_listener("page", watch)
    for page in profile.pages:
        if page is not keeper:
            page.close()
    profile.clear_cookies()
    devtools = profile.new_cdp_session(keeper)
    for origin in origins:
        devtools.send("Storage.clearDataForOrigin", {"origin": origin, "storageTypes": "all"})
    devtools.detach()
    assert troubles == []
    assert foreign == []


@pytest.fixture
def page(ide: Ide, window: Callable[[str], Page]) -> Page:
    return window(ide.url)


@pytest.fixture
def open_ide(tmp_path: Path, window: Callable[[str], Page]) -> Iterator[OpenIde]:
    """Call it with options of `tmcm34x ide`: an IDE of its own, on PROGRAM where there is no program yet."""
    opened: list[tuple[Page, Ide]] = []

    def start(*options: str) -> tuple[Page, Ide]:
        if not (tmp_path / "program.tmc").exists():
            (tmp_path / "program.tmc").write_text(PROGRAM)
        ide = Ide(tmp_path, *options)
        opened.append((window(ide.url), ide))
        return opened[-1]

    yield start
    for page, ide in opened:
        page.close()
        ide.stop()


def _local(url: str) -> bool:
    return url.startswith(("http://127.0.0.1:", "data:", "blob:"))
