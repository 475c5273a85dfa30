"""Browsers and pages as they should not be: without the token, from elsewhere, malformed, flooding, never reading.

Each is answered or refused, files outside the opened folder stay unseen, and whoever behaves notices nothing.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import random
from pathlib import Path

import pytest
from websockets.exceptions import ConnectionClosed, InvalidHandshake

from ide.ide_driver import TOKEN, Ide, running
from tmcm34x.ide import wire
from tmcm34x.ide.workspace import OpenFolder

SOCKETS = ("/wire", "/lsp", "/dap")
SECRET = "Secret-of-another-folder"
OUTSIDE = (
    "../secret.tmc", "..\\secret.tmc", "..%2fsecret.tmc", "%2e%2e/secret.tmc", "..%252fsecret.tmc",
    "..\u2215secret.tmc", "\uff0e\uff0e/secret.tmc", "..%c0%afsecret.tmc", "./../secret.tmc", "a//../../secret.tmc",
    "file:///etc/passwd", "/etc/passwd", "//etc/passwd", "\\\\host\\share", "C:\\secret.tmc", "link.tmc",
    "up/secret.tmc", "up/../secret.tmc", "circle.tmc", "a\0.tmc", "x" * 5000 + ".tmc",
    "~/secret.tmc", "",
    ".", "..", "pipe.tmc", "folder.tmc", "/proc/self/environ",
)  # fmt: skip


@pytest.fixture
def folder(tmp_path):
    """An opened folder beside a secret, with links that lead to it."""
    folder = tmp_path / "work"
    folder.mkdir()
    (tmp_path / "secret.tmc").write_text(f"// {SECRET}\n")
    (folder / "link.tmc").symlink_to(tmp_path / "secret.tmc")
    (folder / "up").symlink_to(tmp_path)
    (folder / "circle.tmc").symlink_to("circle.tmc")
    (folder / "folder.tmc").mkdir()
    os.mkfifo(folder / "pipe.tmc")
    return folder


def files_open():
    return len(list(Path("/proc/self/fd").iterdir()))


async def raw(ide: Ide, data: bytes) -> bytes:
    """What the server says to these bytes until it hangs up or waits for more."""
    reader, writer = await asyncio.open_connection("127.0.0.1", ide.port)
    answer = b""
    with contextlib.suppress(ConnectionError, TimeoutError):
        writer.write(data)
        writer.write_eof()
        async with asyncio.timeout(5):
            answer = await reader.read()
    writer.close()
    return answer


def head(ide: Ide, path: str = "/", **more: str) -> bytes:
    fields = {"Host": f"127.0.0.1:{ide.port}", "Cookie": f"tmcm34x-{ide.port}={TOKEN}", "Connection": "close"}
    fields |= {name.replace("_", "-"): value for name, value in more.items()}
    lines = [f"GET {path} HTTP/1.1", *(f"{name}: {value}" for name, value in fields.items())]
    return ("\r\n".join(lines) + "\r\n\r\n").encode("latin-1")


def test_requests_that_are_none_are_refused_and_end_nothing(folder, capfd, caplog):
    async def scenario():
        async with running(folder) as ide:
            for data in (
                b"\0" * 10_000,
                b"GET " + b"/" * 200_000 + b" HTTP/1.1\r\n\r\n",
                b"GET / HTTP/9.9\r\n\r\n",
                b"POST / HTTP/1.1\r\nContent-Length: -1\r\n\r\n",
                b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\nFFFFFFFFFFFFFFFF\r\n",
                b"GET / HTTP/1.1\r\n" + b"X: y\r\n" * 20_000,
                random.Random(3).randbytes(3000),
                head(ide, Host="evil.example"),
                head(ide, Host=""),
                head(ide, Host=f"127.0.0.1:{ide.port}.evil.example"),
                head(ide, Host=f"127.0.0.1:{ide.port}@evil.example"),
                head(ide, Cookie=f"tmcm34x-{ide.port}=\xff\xfe"),
                head(ide, "/?token=%ff%00", Cookie="x"),
                head(ide, "/?token=" + "x" * 30_000, Cookie="x"),
                head(ide, "/alive", Cookie=f"tmcm34x-{ide.port + 1}={TOKEN}"),
            ):
                answer = await raw(ide, data)
                assert answer == b"" or answer.split()[1][:1] == b"4", (data[:80], answer[:200])
            assert (await raw(ide, head(ide, "/alive"))).split()[1] == b"204"

    asyncio.run(scenario())
    assert "Traceback" not in capfd.readouterr().err + caplog.text


@pytest.mark.parametrize("path", SOCKETS)
def test_sockets_of_others_are_refused(folder, path):
    async def scenario():
        async with running(folder) as ide:
            for origin in (
                "http://evil.example", "null", f"https://127.0.0.1:{ide.port}", f"http://127.0.0.1:{ide.port}.evil.example",
                f"http://localhost:{ide.port}", f"{ide.origin}/", f"{ide.origin}@evil.example",
            ):  # fmt: skip
                with pytest.raises(InvalidHandshake):
                    await ide.socket(path, origin=origin)
            for token in ("", "wrong", TOKEN[:-1], TOKEN + "x", TOKEN.upper()):
                with pytest.raises(InvalidHandshake):
                    await ide.socket(path, token=token)

    asyncio.run(scenario())


@pytest.mark.parametrize("path", SOCKETS)
def test_any_message_is_answered_or_ends_its_socket_only(folder, path, capfd, caplog):
    messages: list[str | bytes] = [
        "", "[" * 100_000, '{"a":' * 50_000, "1" * 100_000, "NaN", b"\xff\xfe", b"", '"\\ud800"', "[1, {}]",
        "[1e999, 1]",
        '[-1, {"call": "ping"}]', '{"seq": 1e99, "type": "request", "command": "evaluate"}', "\0",
        "null", "[null, null]", '{"seq": 1, "command": []}', '{"seq": {}, "command": {"a": []}}',
        '{"seq": 1, "type": "request", "command": "launch", "arguments": {"program": "/etc/passwd"}}',
        '{"seq": 1, "type": "request", "command": "attach", "arguments": {"port": "/dev/zero"}}',
    ]  # fmt: skip

    async def scenario():
        async with running(folder) as ide, ide.page() as other:
            before = files_open()
            for message in messages:
                async with ide.socket(path) as bad:
                    with contextlib.suppress(ConnectionClosed, TimeoutError):
                        await bad.send(message)
                        async with asyncio.timeout(0.05):
                            while True:
                                await bad.recv()
                assert await other.call(wire.Ping()) is None
            await other.until(lambda: len(ide.hub.pages) == 1)
            await other.until(lambda: files_open() <= before + 4)

    asyncio.run(scenario())
    assert "Traceback" not in capfd.readouterr().err + caplog.text


@pytest.mark.parametrize("path", SOCKETS)
def test_windows_that_flood_vanish_and_never_read_are_forgotten(folder, path, capfd, caplog):
    texts = {
        "/wire": '[7, {"call": "ping"}]',
        "/lsp": json.dumps({"jsonrpc": "2.0", "id": 1, "method": "no/such"}),
        "/dap": json.dumps({"seq": 1, "type": "request", "command": "threads"}),
    }

    async def scenario():
        async with running(folder) as ide, ide.page() as other:
            before = files_open()
            for _ in range(4):
                bad = await ide.socket(path, max_queue=1)
                for _ in range(300):
                    with contextlib.suppress(ConnectionClosed, TimeoutError):
                        await asyncio.wait_for(bad.send(texts[path]), 0.5)
                bad.transport.abort()
            assert await other.call(wire.Ping()) is None
            await other.until(lambda: len(ide.hub.pages) == 1)
            await other.until(lambda: files_open() <= before + 4)

    asyncio.run(scenario())
    assert "Traceback" not in capfd.readouterr().err + caplog.text


def test_no_name_of_a_file_leads_out_of_the_folder(folder):
    workspace = OpenFolder(folder)
    for path in OUTSIDE:
        for act in (workspace.read, lambda name: workspace.rename(name, name + "/new.tmc")):
            with pytest.raises(wire.RefusalError) as refused:
                act(path)
            assert SECRET not in str(refused.value) and "\n" not in str(refused.value)
    assert {path.name for path in folder.parent.iterdir()} == {"work", "secret.tmc"}
    assert (folder.parent / "secret.tmc").read_text() == f"// {SECRET}\n"
