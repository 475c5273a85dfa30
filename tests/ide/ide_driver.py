"""Drives an IDE server in this process, as a page would."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import struct
from collections.abc import AsyncIterator, Iterator
from pathlib import Path
from typing import Any

import msgspec
from websockets.asyncio.client import ClientConnection, connect

from tmcm34x.bench import simple_rig
from tmcm34x.firmware.storage import Eeprom
from tmcm34x.host.url import parse_url
from tmcm34x.ide import wire
from tmcm34x.ide.application import LOOPBACK, Application
from tmcm34x.ide.hub import Hub
from tmcm34x.ide.modules import Modules
from tmcm34x.ide.remote import Remote
from tmcm34x.ide.target import Target
from tmcm34x.ide.telegrams import Telegrams
from tmcm34x.ide.virtual import Virtual
from tmcm34x.ide.workspace import OpenFolder
from tmcm34x.server import Server

TOKEN = "let-me-in"

_event = msgspec.json.Decoder(wire.AnyEvent)


class Ide:
    """A running IDE."""

    def __init__(self, hub: Hub, port: int) -> None:
        self.hub = hub
        self.port = port
        self.origin = f"http://127.0.0.1:{port}"

    @property
    def virtual(self) -> Virtual:
        assert isinstance(self.hub.target, Virtual)
        return self.hub.target

    def socket(
        self, path: str = "/wire", *, origin: str | None = None, token: str = TOKEN, **more: Any
    ) -> connect:
        headers = {"Cookie": f"tmcm34x-{self.port}={token}"}
        return connect(
            f"ws://127.0.0.1:{self.port}{path}", origin=origin or self.origin, additional_headers=headers,
            max_size=None, proxy=None, close_timeout=0.2, **more,
        )  # fmt: skip

    @contextlib.asynccontextmanager
    async def page(self, rate_hz: int = 60) -> AsyncIterator[Window]:
        async with self.socket() as connection:
            window = Window(connection)
            reader = asyncio.create_task(window.read())
            try:
                await window.event(wire.Welcome)
                await window.until(lambda: window.state)
                await window.call(wire.SetRate(rate_hz))
                yield window
            finally:
                reader.cancel()
                await asyncio.gather(reader, return_exceptions=True)

    @contextlib.asynccontextmanager
    async def debugger(self) -> AsyncIterator[DebugWindow]:
        """A window's line to the debugger, attached as the page does it."""
        async with self.socket("/dap") as connection:
            window = DebugWindow(connection)
            reader = asyncio.create_task(window.read())
            try:
                assert (await window.do("initialize", adapterID="tmcl"))["supportsLogPoints"]
                await window.do("attach")
                await window.event("initialized")
                await window.do("configurationDone")
                await window.event("tmcl_filters")
                yield window
            finally:
                reader.cancel()
                await asyncio.gather(reader, return_exceptions=True)


class DebugWindow:
    """A client of the Debug Adapter Protocol."""

    def __init__(self, connection: ClientConnection) -> None:
        self.connection = connection
        self.messages: list[dict[str, Any]] = []
        self._news = asyncio.Event()
        self._numbers = iter(range(1, 1 << 30))

    async def read(self) -> None:
        async for number, text in _numbered(self.connection):
            message = msgspec.json.decode(text)
            assert message["seq"] == number
            self.messages.append(message)
            self._news.set()

    async def _first(self, test: Any) -> dict[str, Any]:
        async with asyncio.timeout(60):
            while not (found := [message for message in self.messages if test(message)]):
                self._news.clear()
                await self._news.wait()
        self.messages.remove(found[0])
        return found[0]

    async def begin(self, command: str, **arguments: Any) -> asyncio.Task[dict[str, Any]]:
        """Send a request; its response to come.  Requests are answered in the order in which they were sent."""
        number = next(self._numbers)
        request = {"seq": number, "type": "request", "command": command, "arguments": arguments}
        await self.connection.send(msgspec.json.encode(request).decode())
        return asyncio.create_task(self._first(lambda message: message.get("request_seq") == number))

    async def ask(self, command: str, **arguments: Any) -> dict[str, Any]:
        """The response to a request."""
        return await (await self.begin(command, **arguments))

    async def do(self, command: str, **arguments: Any) -> Any:
        """The body of the response to a request that succeeds."""
        response = await self.ask(command, **arguments)
        assert response["success"], response
        return response.get("body")

    async def fail(self, command: str, **arguments: Any) -> str:
        """Why a request is refused."""
        response = await self.ask(command, **arguments)
        assert not response["success"], response
        return response["message"]

    async def event(self, name: str) -> dict[str, Any]:
        """The body of the first such event, taken out of the list."""
        return (await self._first(lambda message: message.get("event") == name))["body"]

    async def breakpoints(self, path: str, *points: dict[str, Any]) -> list[dict[str, Any]]:
        """Have these breakpoints in a file; where they lie."""
        answer = await self.do("setBreakpoints", source={"path": path}, breakpoints=list(points))
        return answer["breakpoints"]


async def _numbered(connection: ClientConnection) -> AsyncIterator[tuple[int, str]]:
    number = 0
    async for text in connection:
        number += 1
        yield number, str(text)


class Window:
    """A page without a browser: calls, events, and the state put together from frames."""

    def __init__(self, connection: ClientConnection) -> None:
        self.connection = connection
        self.events: list[wire.Event] = []
        self.frames: list[bytes] = []
        self.state: dict[str, dict[str, float]] = {}
        self.watched: list[int | None] = []
        self.rows: list[tuple[float, dict[int, int | None]]] = []
        """Samples: time and, by column, values; None is unknown."""
        self._news = asyncio.Event()
        self._numbers = iter(range(1, 1 << 30))

    async def read(self) -> None:
        async for message in self.connection:
            if isinstance(message, str):
                self.events.append(_event.decode(message))
            else:
                self.frames.append(message)
                self._take(message)
            self._news.set()

    def _take(self, frame: bytes) -> None:
        if frame[0] == 0:
            self.rows += list(_rows(frame[1:]))
            return
        at = 1
        for index, group in enumerate(wire.GROUPS):
            if frame[0] & 1 << index:
                values = group.layout.unpack_from(frame, at)
                self.state[group.name] = dict(zip([row.name for row in group.rows], values, strict=True))
                at += group.layout.size
        if frame[0] & 1 << wire.WATCH_BIT:
            values = [
                int.from_bytes(frame[n : n + 4], "little", signed=True) for n in range(at + 1, len(frame), 4)
            ]
            self.watched = [value if frame[at] & 1 << n else None for n, value in enumerate(values)]
            at = len(frame)
        assert at == len(frame)

    async def until(self, holds: Any, timeout_s: float = 60.0) -> None:
        """Wait until `holds()` is true."""
        async with asyncio.timeout(timeout_s):
            while not holds():
                self._news.clear()
                await self._news.wait()

    async def event(self, kind: type[Any], test: Any = lambda event: True) -> Any:
        """The first event of a kind, taken out of the list."""

        def find() -> wire.Event | None:
            return next((event for event in self.events if isinstance(event, kind) and test(event)), None)

        await self.until(lambda: find() is not None)
        found = find()
        assert found is not None
        self.events.remove(found)
        return found

    async def ask(self, call: wire.Call) -> wire.CallResult | wire.Refusal | wire.Fault:
        number = next(self._numbers)
        await self.connection.send(msgspec.json.encode((number, call)).decode())
        return await self.event(wire.CallResult | wire.Refusal | wire.Fault, lambda event: event.id == number)

    async def call(self, call: wire.Call) -> Any:
        """The result of a call that must succeed."""
        answer = await self.ask(call)
        assert isinstance(answer, wire.CallResult), answer
        return answer.result

    async def refusal(self, call: wire.Call) -> str:
        """The code of a call that must be refused."""
        answer = await self.ask(call)
        assert isinstance(answer, wire.Refusal), answer
        assert answer.text
        return answer.code

    async def execute(self, line: str) -> dict[str, Any]:
        return await self.call(wire.ExecuteText(line))


def _rows(data: bytes) -> Iterator[tuple[float, dict[int, int | None]]]:
    while data:
        when, looked, known = struct.unpack_from("<dQQ", data)
        columns = [at for at in range(64) if looked & 1 << at]
        values = struct.unpack_from(f"<{len(columns)}i", data, 24)
        pairs = zip(columns, values, strict=True)
        yield when, {at: value if known & 1 << at else None for at, value in pairs}
        data = data[24 + 4 * len(columns) :]


def virtual(
    model: int = 343, *, speed: float = 1.0, eeprom: Eeprom | None = None
) -> tuple[Target, Telegrams]:
    telegrams = Telegrams()
    server = Server(simple_rig(model, eeprom), speed=speed, log=telegrams)
    return Virtual(server, "bare motors", ""), telegrams


async def real(url: str, address: int = 1) -> tuple[Remote, Telegrams]:
    """The module at the other end of a line, for `running`."""
    telegrams = Telegrams()
    return await asyncio.to_thread(Remote, parse_url(url, address=address), telegrams), telegrams


@contextlib.asynccontextmanager
async def running(
    folder: Path,
    target: tuple[Target, Telegrams] | None = None,
    show: list[str] | None = None,
    modules: Modules | None = None,
) -> AsyncIterator[Ide]:
    """A server on a free port of loopback."""
    module, telegrams = target or virtual()
    hub = Hub(OpenFolder(folder), module, telegrams, show or [], modules)
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    listener.bind(("127.0.0.1", 0))
    listener.listen()
    port = listener.getsockname()[1]
    application = Application(hub, TOKEN, [f"{name}:{port}" for name in LOOPBACK])
    application.name_cookie(port)
    server = application.server()
    await hub.open()
    task = asyncio.create_task(server.serve([listener]))
    try:
        yield Ide(hub, port)
    finally:
        server.should_exit = True
        await task
        await hub.close()
