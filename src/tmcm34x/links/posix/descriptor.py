"""The file descriptor of a pseudo terminal on the event loop."""

from __future__ import annotations

import asyncio
import os
import sys
import time
from collections.abc import Callable
from typing import Final

assert sys.platform != "win32"

READ_SIZE: Final = 4096
PATIENCE_S: Final = 50e-6
"""How long to stay for the next bytes after some have come [s].

Hosts send their next telegram as soon as they have the reply.  Being there already saves the way through the event
loop and the kernel's wake-up, a third of a round trip; the processor is left to others meanwhile.
"""
_STAY: Final = 64
"""Looks, with or without bytes, after which the event loop has its turn whatever comes."""


class Descriptor:
    """Reads when there is something, writes at once, and keeps what does not fit.

    While the other side does not fetch its bytes, nothing is read from it either: memory stays bounded and
    nothing is lost.

    fd: a file descriptor, made non-blocking here; stays its owner's to close
    receive: called with each chunk read
    lost: called once when the other side has hung up; the descriptor is then off the event loop
    """

    def __init__(self, fd: int, receive: Callable[[bytes], None], lost: Callable[[], None]) -> None:
        self._fd = fd
        self.receive = receive
        self._lost = lost
        self._backlog = bytearray()
        self._listening = True
        self._loop = asyncio.get_running_loop()
        os.set_blocking(fd, False)
        self._loop.add_reader(fd, self._read)

    def send(self, data: bytes) -> None:
        """Write `data`, now or when there is room."""
        if not self._backlog:
            try:
                written = os.write(self._fd, data)
            except BlockingIOError:
                written = 0
            except OSError:
                return  # hung up: the next read finds out
            if written == len(data):
                return
            data = data[written:]
            self._listening = False
            self._loop.remove_reader(self._fd)
            self._loop.add_writer(self._fd, self._flush)
        self._backlog += data

    def stop(self) -> None:
        """Take the descriptor off the event loop."""
        self._listening = False
        self._loop.remove_reader(self._fd)
        self._loop.remove_writer(self._fd)
        self._backlog.clear()

    def _read(self) -> None:
        end_s = 0.0
        for _ in range(_STAY):
            try:
                data = os.read(self._fd, READ_SIZE)
            except BlockingIOError:
                if time.monotonic() >= end_s:
                    return
                os.sched_yield()
                continue
            except OSError:
                data = b""
            if not data:
                # Only what the event loop called readable has hung up; some ports are empty in this way.
                if not end_s:
                    self._hang_up()
                return
            self.receive(data)
            if not self._listening:
                return
            end_s = time.monotonic() + PATIENCE_S

    def _flush(self) -> None:
        try:
            del self._backlog[: os.write(self._fd, self._backlog)]
        except BlockingIOError:
            return
        except OSError:
            self._hang_up()
            return
        if not self._backlog:
            self._listening = True
            self._loop.remove_writer(self._fd)
            self._loop.add_reader(self._fd, self._read)

    def _hang_up(self) -> None:
        self.stop()
        self._lost()
