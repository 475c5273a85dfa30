"""What ends a command that serves: Ctrl-C, and the signals of the system."""

from __future__ import annotations

import contextlib
import signal
import sys
import threading
from collections.abc import Callable, Generator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import asyncio


def stop_on_signals(loop: asyncio.AbstractEventLoop, stop: Callable[[], None]) -> None:
    """Call `stop` on the event loop when the command is to end."""
    if sys.platform == "win32":  # whose event loop takes no signals

        def interrupted(_: int, __: object) -> None:
            loop.call_soon_threadsafe(stop)

        signal.signal(signal.SIGINT, interrupted)
    else:
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            loop.add_signal_handler(number, stop)


@contextlib.contextmanager
def interruptible() -> Generator[None]:
    """Take SIGTERM as an interrupt, so that what is done is kept."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
