"""What ends a command that serves: Ctrl-C, and the signals of the system."""

from __future__ import annotations

import asyncio
import signal
import sys
from collections.abc import Callable


def stop_on_signals(loop: asyncio.AbstractEventLoop, stop: Callable[[], None]) -> None:
    """Call `stop` on the event loop when the command is to end."""
    if sys.platform == "win32":  # whose event loop takes no signals

        def interrupted(_: int, __: object) -> None:
            loop.call_soon_threadsafe(stop)

        signal.signal(signal.SIGINT, interrupted)
    else:
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            loop.add_signal_handler(number, stop)
