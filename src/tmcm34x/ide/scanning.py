"""Looking for modules on ports, for one window at a time, in a thread of its own; what is asked for changes nothing."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Final

from tmcm34x.host.scan import (
    ADDRESSES,
    LATENCY_S,
    LIKELY_ADDRESSES,
    Found,
    Try,
    can_interfaces,
    described_ports,
    plan,
    scan,
)
from tmcm34x.host.url import Url, parse_url
from tmcm34x.ide import wire

if TYPE_CHECKING:
    from tmcm34x.ide.modules import Modules
    from tmcm34x.ide.window import Window

TELL_S: Final = 0.1
"""Between two messages of progress."""
WAIT_S: Final = LATENCY_S
"""How long to wait for each reply, beside its time on the wire."""


class _Cancelled(Exception):  # noqa: N818
    """The window does not want to know any more."""


class Scanning:
    """Scans of ports that `modules` allows; `in_use` is the line of the IDE's own module."""

    def __init__(self, modules: Modules, in_use: Callable[[], Url | None]) -> None:
        self._modules = modules
        self._in_use = in_use
        self._end = threading.Event()
        self._task: asyncio.Task[None] | None = None
        self._owner: Window | None = None

    def ports(self) -> wire.Ports:
        """The ports of this computer; blocks for a moment."""
        ports = [] if self._modules.closed else described_ports()
        shapes = [wire.PortShape(port.device, port.description) for port in ports]
        return wire.Ports(shapes, can_interfaces(), self._modules.closed)

    def begin(self, page: Window, urls: Sequence[Url], *, far: bool) -> None:
        """Look at ports for a window.  Raises `wire.RefusalError`."""
        for url in urls:
            self._modules.expect_open(url)
        if self._task is not None and not self._task.done():
            raise wire.RefusalError("busy", "A scan is under way already.")
        here = self._in_use()
        free = [url for url in urls if here is None or url.target != here.target]
        addresses = ADDRESSES if far else ADDRESSES[:LIKELY_ADDRESSES]
        attempts = plan([url.name for url in free], addresses=addresses)
        self._end = threading.Event()
        self._owner = page
        self._task = asyncio.ensure_future(self._run(page, attempts, self._end))

    def cancel(self) -> None:
        """End the scan that is under way."""
        self._end.set()

    def leave(self, page: Window) -> None:
        """A window is gone, and with it its scan."""
        if page is self._owner:
            self.cancel()

    async def _run(self, page: Window, attempts: Sequence[Try], end: threading.Event) -> None:
        loop = asyncio.get_running_loop()

        def send(event: wire.Event) -> None:
            loop.call_soon_threadsafe(page.send, event)

        complete = await asyncio.to_thread(_look, attempts, send, end)
        send(wire.ScanEnded(complete))


def _look(attempts: Sequence[Try], send: Callable[[wire.Event], None], end: threading.Event) -> bool:
    """Scan to the end, or until `end` is set; whether it came to the end."""
    told_s = 0.0

    def progress(done: int, total: int, place: str) -> None:
        nonlocal told_s
        if end.is_set():
            raise _Cancelled
        now_s = time.monotonic()
        if now_s - told_s >= TELL_S or done == total:
            told_s = now_s
            send(wire.ScanProgress(done, total, place))

    def failed(text: str) -> None:
        send(wire.ScanFailed(text))

    try:
        for found in scan(attempts, progress, failed, WAIT_S):
            send(_shape(found))
    except _Cancelled:
        return False
    return True


def _shape(found: Found) -> wire.ScanFound:
    return wire.ScanFound(found.url, parse_url(found.url).place, found.model, found.version)
