"""The command `tmcm34x ide` under attack, round after round: it goes on answering, and its memory stays as it is.

`SOAK_ROUNDS` makes it last longer (`make soak`).
"""

from __future__ import annotations

import asyncio
import base64
import contextlib
import json
import os
import random
import re
import socket
import struct
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import UnionType
from typing import Any, Union, get_args, get_origin

import msgspec
import pytest

from conftest import COMMAND
from ide.ide_driver import TOKEN, running
from tmcm34x.ide import connections, wire

ROUNDS = int(os.environ.get("SOAK_ROUNDS", "40"))
AT_A_TIME = 3
"""Clients of each kind that hold on at a time."""
MOST_MEMORY = 40e6
"""Bytes by which a server with so many clients may grow [B]."""
GIVEN_BACK = {"MALLOC_ARENA_MAX": "1", "MALLOC_MMAP_THRESHOLD_": "32768", "MALLOC_TRIM_THRESHOLD_": "65536"}
"""The C library keeps nothing of what is freed: the memory of the process is what the server holds."""
PATIENCE_S = 20.0
FEW = 2048
"""Bytes that a client that does not read has room for."""
LONG = "x" * 90_000
ASKED = {
    "/wire": [
        [7, {"call": "list_examples"}],
        [8, {"call": "assemble", "path": "a.tmc", "texts": {"a.tmc": "SAP 4, 0, 100\n" * 3000}}],
        [9, {}],
    ],
    "/lsp": [
        {"jsonrpc": "2.0", "id": LONG, "method": "no/such", "params": {}},
        {"jsonrpc": "2.0", "id": 1, "method": "x"},
    ],
    "/dap": [
        {"seq": 1, "type": "request", "command": LONG},
        {"seq": 2, "type": "request", "command": "setBreakpoints", "arguments": {"source": {"path": LONG}}},
        {"seq": 3, "type": "request", "command": "threads"},
    ],
}
"""By web socket; the first one has a long answer."""


def framed(data: bytes, opcode: int = 1) -> bytes:
    """A web socket's frame, as a client sends it."""
    size = len(data)
    if size < 126:
        length = bytes([0x80 | size])
    else:
        length = b"\xfe" + struct.pack(">H", size) if size < 1 << 16 else b"\xff" + struct.pack(">Q", size)
    return bytes([0x80 | opcode]) + length + bytes(4) + data


class Clients:
    """What clients of a server on a port of this machine do; each waits a while at most."""

    def __init__(self, port: int, token: str) -> None:
        self.port = port
        self.token = token

    def connect(self, room: int | None = None) -> socket.socket:
        """A connection; with `room` it has place for so few bytes that it does not read."""
        client = socket.socket()
        if room is not None:
            client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, room)
        client.settimeout(PATIENCE_S)
        client.connect(("127.0.0.1", self.port))
        return client

    def head(self, path: str, **more: str) -> bytes:
        """A request."""
        host = f"127.0.0.1:{self.port}"
        fields = {
            "Host": host,
            "Cookie": f"tmcm34x-{self.port}={self.token}",
            "Origin": f"http://{host}",
            **more,
        }
        lines = [
            f"GET {path} HTTP/1.1",
            *(f"{name.replace('_', '-')}: {value}" for name, value in fields.items()),
        ]
        return ("\r\n".join(lines) + "\r\n\r\n").encode()

    def window(self, path: str, room: int | None = None) -> socket.socket:
        """A web socket."""
        client = self.connect(room)
        upgrade = {"Upgrade": "websocket", "Connection": "Upgrade", "Sec_WebSocket_Version": "13"}
        client.sendall(self.head(path, Sec_WebSocket_Key=base64.b64encode(bytes(16)).decode(), **upgrade))
        assert client.recv(12) == b"HTTP/1.1 101"
        return client

    def answers(self) -> bool:
        """Whether a page that behaves is answered, over HTTP and over its web socket."""
        with self.connect() as client:
            client.sendall(self.head("/alive", Connection="close"))
            alive = client.recv(12) == b"HTTP/1.1 204"
        with self.window("/wire") as page:
            page.sendall(framed(b'[77777, {"call": "ping"}]'))
            data = b""
            while b"77777" not in data and (more := page.recv(65536)):
                data = data[-10:] + more
        return alive and b"77777" in data


class Attacked(Clients):
    """A running `tmcm34x ide` whose error output is a pipe that is not read."""

    def __init__(self, folder: Path) -> None:
        self.process = subprocess.Popen(
            [COMMAND, "ide", str(folder), "--no-browser", "--listen", "127.0.0.1:0"],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env={**os.environ, **GIVEN_BACK},
        )  # fmt: skip
        assert self.process.stdout is not None
        port, token = re.findall(r":(\d+)/\?token=(\S+)", self.process.stdout.readline())[0]
        super().__init__(int(port), token)
        self.kept: list[socket.socket] = []
        """Connections that stay open and on which nothing moves any more."""

    @property
    def memory(self) -> int:
        found = re.search(r"VmRSS:\s+(\d+)", Path(f"/proc/{self.process.pid}/status").read_text())
        assert found is not None
        return 1024 * int(found[1])

    @property
    def files(self) -> int:
        return len(list(Path(f"/proc/{self.process.pid}/fd").iterdir()))

    def leave(self, client: socket.socket, draw: random.Random) -> None:
        """Go in one of the ways in which clients go, or stay and do nothing."""
        way = draw.randrange(3)
        if way == 2:
            self.kept.append(client)
            return
        if way == 0:
            client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        client.close()

    def drop(self, most: int) -> None:
        """Close the oldest connections that were kept, until so many are left."""
        while len(self.kept) > most:
            self.kept.pop(0).close()

    def flood(self, path: str, draw: random.Random, times: int) -> socket.socket:
        """A window that asks on and on and takes no answer."""
        client = self.window(path, FEW)
        client.settimeout(0.3)
        with contextlib.suppress(OSError):
            for _ in range(times):
                client.sendall(framed(json.dumps(draw.choice(ASKED[path])).encode()) * draw.randrange(1, 30))
        return client


def half_open(ide: Attacked, draw: random.Random) -> None:
    """Connections that say nothing, or the beginning of something."""
    for _ in range(draw.randrange(1, 40)):
        client = ide.connect()
        client.sendall(ide.head("/")[: draw.randrange(60)])
        ide.kept.append(client)


def no_request(ide: Attacked, draw: random.Random) -> None:
    for _ in range(50):
        with ide.connect() as client, contextlib.suppress(ConnectionError):
            client.sendall(draw.randbytes(draw.randrange(1, 40)) + b"\r\n\r\n")
            client.recv(1)


def never_reads(ide: Attacked, draw: random.Random) -> None:
    ide.leave(ide.flood(draw.choice(list(ASKED)), draw, 30), draw)


def pings(ide: Attacked, draw: random.Random) -> None:
    client = ide.window(draw.choice(list(ASKED)), FEW)
    client.settimeout(0.3)
    with contextlib.suppress(OSError):
        for _ in range(20):
            client.sendall(framed(b"x" * 125, 9) * 500)
    ide.leave(client, draw)


def no_message(ide: Attacked, draw: random.Random) -> None:
    client = ide.window(draw.choice(list(ASKED)))
    with contextlib.suppress(ConnectionError):
        client.sendall(draw.choice([
            framed(draw.randbytes(300)), framed(b"[" * 100_000), framed(b"x", 2), framed(b"\xff", 8),
            draw.randbytes(500), framed(b"x")[:3], b"\x81\xff" + struct.pack(">Q", 1 << 60) + bytes(4),
        ]))  # fmt: skip
    ide.leave(client, draw)


def never_takes_the_page(ide: Attacked, draw: random.Random) -> None:
    client = ide.connect(FEW)
    client.sendall(ide.head("/static/page.js") * 3)
    ide.leave(client, draw)


ATTACKS = (half_open, no_request, never_reads, pings, no_message, never_takes_the_page)


@pytest.fixture
def attacked(tmp_path):
    ide = Attacked(tmp_path)
    yield ide
    ide.drop(0)
    ide.process.terminate()
    output, errors = ide.process.communicate(timeout=PATIENCE_S)
    sys.stderr.write(errors)  # whole, where the assertion shows the first lines
    assert (ide.process.returncode, output, errors) == (0, "", "")


def test_the_ide_survives_browsers_as_they_should_not_be(attacked, wait_for):
    draw = random.Random(34)
    for attack in ATTACKS * AT_A_TIME:
        attack(attacked, draw)
    assert attacked.answers()
    memory = attacked.memory
    for number in range(ROUNDS):
        draw.choice(ATTACKS)(attacked, draw)
        attacked.drop(len(ATTACKS) * AT_A_TIME)
        if number % 10 == 0:
            assert attacked.answers()
    assert attacked.answers()
    assert attacked.memory - memory < MOST_MEMORY
    attacked.drop(0)
    assert wait_for(lambda: attacked.files <= 12, PATIENCE_S)


def test_its_end_does_not_wait_for_clients_that_stay(attacked):
    draw = random.Random(35)
    attacked.kept += [attacked.flood(path, draw, 60) for path in ASKED]
    half_open(attacked, draw)
    attacked.process.terminate()
    assert attacked.process.wait(PATIENCE_S) == 0


NUMBERS = (0, 1, -1, 3, 255, 256, -(2**31), 2**31, 2**53, -(2**63), 2**63 - 1, 1e308, -1e308, 5e-324, 0.5)
TEXTS = (
    "", "a.tmc", "../x", "x" * 1000, "\0", "b.toml", LONG, "SAP 4, 0, 100\n" * 9, "<b>", "tcp:127.0.0.1:1", "virtual:",
    "serial:/dev/null", "can:virtual:attacked", "[module]\nmodel=343\n", "MVP ABS, 0, 99999999999", "DA:1,9999999999",
)  # fmt: skip


FILES = ("", "AA==", "//4=", "77u/QQ==", *(base64.b64encode(text.encode()).decode() for text in TEXTS))
_LEAVES: dict[Any, tuple[Any, ...]] = {str: TEXTS, bytes: FILES, bool: (False, True), type(None): (None,)}


def value(kind: Any, draw: random.Random) -> Any:
    """Any JSON value of a type, with a liking for those at the edges."""
    arguments, origin = get_args(kind), get_origin(kind)
    if kind in {int, float}:
        return draw.choice([number for number in NUMBERS if kind is float or isinstance(number, int)])
    if origin is list:
        return [value(arguments[0], draw) for _ in range(draw.choice((0, 1, 2, 300)))]
    if origin is dict:
        return {value(arguments[0], draw): value(arguments[1], draw) for _ in range(draw.randrange(3))}
    if origin in {Union, UnionType}:
        return value(draw.choice(arguments), draw)
    if isinstance(kind, type) and issubclass(kind, msgspec.Struct):
        return fields(kind, draw)
    return draw.choice(_LEAVES.get(kind, arguments))


def fields(kind: type[msgspec.Struct], draw: random.Random) -> dict[str, Any]:
    return {
        field.encode_name: value(field.type, draw)
        for field in msgspec.structs.fields(kind)
        if field.required or draw.random() < 0.7
    }


def test_any_call_with_any_values_is_answered_or_refused_in_one_line(tmp_path):
    """The order is one of many in which a page may ask; time goes on and may be held, hurried and taken back."""
    draw = random.Random(36)

    async def scenario() -> None:
        async with running(tmp_path) as ide, ide.page() as page, ide.page() as other:
            for number in range(10**6, 10**6 + 10 * ROUNDS):
                call = draw.choice(wire.CALLS)
                asked = {"call": call.__struct_config__.tag, **fields(call, draw)}
                await page.connection.send(json.dumps([number, asked]))
                answer = await page.event(
                    wire.CallResult | wire.Refusal | wire.Fault,
                    lambda event, number=number: event.id == number,
                )
                assert not isinstance(answer, wire.Fault), (answer.text, str(asked)[:300])
                if isinstance(answer, wire.Refusal):
                    assert answer.text.isprintable(), asked
                    assert 0 < len(answer.text) < 600, asked
                for window in (page, other):
                    assert not any(isinstance(event, wire.Fault) for event in window.events), asked
                    for kept in (window.events, window.rows, window.frames):
                        kept.clear()
            assert await other.call(wire.Ping()) is None

    asyncio.run(scenario())


def served(folder: Path, act: Callable[[Clients], None]) -> None:
    """Do something in a thread with a server of this process."""

    async def scenario() -> None:
        async with running(folder) as ide:
            await asyncio.to_thread(act, Clients(ide.port, TOKEN))

    asyncio.run(scenario())


@pytest.mark.parametrize("path", ASKED)
def test_a_window_that_takes_nothing_is_reset(tmp_path, monkeypatch, path):
    monkeypatch.setattr(connections, "STALL_S", 0.2)

    def act(clients: Clients) -> None:
        with clients.window(path, FEW) as client, pytest.raises(ConnectionError):
            while True:
                client.sendall(framed(json.dumps(ASKED[path][0]).encode()))

    served(tmp_path, act)


@pytest.mark.parametrize("beginning", [b"", b"GET / HT", b"POST / HTTP/1.1\r\nContent-Length: 9\r\n\r\nhalf"])
def test_a_connection_without_a_whole_request_is_reset(tmp_path, monkeypatch, beginning):
    monkeypatch.setattr(connections, "REQUEST_S", 0.2)

    def act(clients: Clients) -> None:
        with clients.connect() as client, contextlib.suppress(ConnectionError):
            client.sendall(beginning)
            while client.recv(1000):
                pass

    served(tmp_path, act)


def is_reset(client: socket.socket) -> bool:
    try:
        return client.recv(1) == b""
    except ConnectionError:
        return True


def test_connections_without_a_window_make_room(tmp_path, monkeypatch):
    monkeypatch.setattr(connections, "most_connections", lambda: 8)

    def act(clients: Clients) -> None:
        idle = [clients.connect() for _ in range(30)]
        windows = [clients.window("/dap") for _ in range(6)]
        assert clients.answers()
        assert is_reset(idle[0])
        for client in (*idle, *windows):
            client.close()

    served(tmp_path, act)
