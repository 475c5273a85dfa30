"""A served module in a thread of its own, as behind a real line, with faults where a test wants them."""

from __future__ import annotations

import asyncio
import os
import socket
import threading
import weakref
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

from tmcm34x.bench import simple_rig
from tmcm34x.firmware.axis import V_ACTUAL
from tmcm34x.links.faulty import Faults
from tmcm34x.links.tcp import TcpLink
from tmcm34x.server import Server

T = TypeVar("T")
Open = Callable[[Server], Any]


async def tcp(server: Server, port: int = 0) -> str:
    return await server.open(TcpLink("127.0.0.1", port))


class Bench:
    """Serves a module until `stop`; `address` is what the opened link says."""

    def __init__(
        self,
        model: int = 343,
        port: int = 0,
        *,
        faults: Sequence[str] = (),
        link: Open | None = None,
        seed: int = 0,
    ) -> None:
        self._ready = threading.Event()
        self._model = model
        if not port and link is None:
            port = self._keep_port()
        self._open = link or (lambda server: tcp(server, port))
        self.faults = Faults(seed=seed)
        self._wanted = faults
        self._thread = threading.Thread(target=lambda: asyncio.run(self._serve()))
        self._thread.start()
        self._ready.wait()

    def _keep_port(self) -> int:
        """A port that is given to nobody else while this bench is remembered, also while it is not served."""
        keeper = socket.socket()
        keeper.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        keeper.bind(("127.0.0.1", 0))
        port = keeper.getsockname()[1]
        weakref.finalize(self, os.close, keeper.detach())
        return port

    async def _serve(self) -> None:
        self._loop, self._end = asyncio.get_running_loop(), asyncio.Event()
        self.rig = simple_rig(self._model)
        self.module = self.rig.modules[0]
        server = Server(self.rig, faults=self.faults)
        try:
            self.address = await self._open(server)
            for fault in self._wanted:
                self.faults.add(fault)
        finally:
            self._ready.set()
        await self._end.wait()
        await server.close()

    def do(self, work: Callable[[], T]) -> T:
        """Do something with the module beside the line, between two telegrams: its thread waits for none."""

        async def done() -> T:
            return work()

        return asyncio.run_coroutine_threadsafe(done(), self._loop).result()

    def arm(self, *faults: str) -> None:
        """Have faults strike from now on."""
        for fault in faults:
            self.do(lambda fault=fault: self.faults.add(fault))

    def speed(self, motor: int) -> int:
        """The true speed, seen beside the line."""
        return self.do(lambda: self.module.axes[motor].read(V_ACTUAL))

    def stop(self) -> None:
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._end.set)
            self._thread.join()
