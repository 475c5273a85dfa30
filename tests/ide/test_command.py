from __future__ import annotations

import asyncio
import json
import signal
import socket
import subprocess
import sys
import urllib.request
from collections.abc import Awaitable, Callable
from pathlib import Path

import pytest
from websockets.asyncio.client import connect

from ide.ide_driver import Window
from tmcm34x.cli import ide
from tmcm34x.firmware.storage import Eeprom
from tmcm34x.ide import wire

COMMAND = (str(Path(sys.executable).with_name("tmcm34x")), "ide", "--no-browser")


def _refused(*options: str) -> str:
    result = subprocess.run([*COMMAND, *options], capture_output=True, text=True, timeout=60, check=False)
    assert result.returncode == 2
    assert result.stdout == ""
    return result.stderr


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_address_with_its_token_is_on_a_line_of_its_own_and_a_signal_ends_it_all(tmp_path, number):
    with subprocess.Popen([*COMMAND, str(tmp_path)], stdout=subprocess.PIPE, text=True) as process:
        ready, kind, url = process.stdout.readline().split()
        assert (ready, kind) == ("ready", "ide")
        assert url.startswith("http://127.0.0.1:")
        opener = urllib.request.build_opener(
            urllib.request.ProxyHandler({}), urllib.request.HTTPCookieProcessor()
        )
        with opener.open(url) as answer:
            assert answer.status == 200
            assert "?" not in answer.url
        process.send_signal(number)
        assert process.wait(20) == 0
        assert process.stdout.read() == ""


def test_the_eeprom_is_kept_in_its_file(tmp_path):
    image = tmp_path / "spare.eeprom"
    with subprocess.Popen(
        [*COMMAND, str(tmp_path), "--model", "341", "--eeprom", str(image)], stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout.readline()
        process.terminate()
        assert process.wait(20) == 0
    assert Eeprom.from_bytes(image.read_bytes()).model == 341
    assert "341" in _refused("--model", "343", "--eeprom", str(image))
    error = _refused("--eeprom", str(tmp_path / "nowhere" / "x.eeprom"))
    assert "x.eeprom" in error


def test_the_usual_port_is_taken_once_and_a_free_one_the_second_time(monkeypatch):
    """By the function that chooses it: the usual port of this machine may be another IDE's."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        usual = free.getsockname()[1]
    monkeypatch.setattr(ide, "PORT", usual)
    with ide.bind_usual() as first, ide.bind_usual() as second:
        assert first.getsockname() == ("127.0.0.1", usual)
        assert second.getsockname()[0] == "127.0.0.1"
        assert second.getsockname()[1] != usual


def test_a_taken_address_is_told_in_one_line():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        error = _refused("--listen", f"127.0.0.1:{taken.getsockname()[1]}")
    assert error.count("\n") == 1
    assert "in use" in error


@pytest.mark.parametrize(
    ("options", "word"),
    [
        (("--port", "/dev/null-and-void"), "/dev/null-and-void"),
        (("--port", "x", "--model", "341"), "--port"),
        (("--listen", "here"), "HOST:]PORT"),
        (("no-such-folder",), "no-such-folder"),
    ],
)
def test_wrong_usage_is_told_in_one_line(options, word):
    error = _refused(*options)
    assert error.count("\n") == 1
    assert word in error


def test_a_bench_file_with_a_mistake_is_told_with_the_path_into_it(tmp_path):
    bench = tmp_path / "bench.toml"
    bench.write_text("[[module]]\nmodel = 999\n")
    assert "bench.toml" in _refused("--bench", str(bench))
    bench.write_text("[[module]]\nmodel = 342\n")
    assert "--model" in _refused("--bench", str(bench), "--model", "341")


class Controlled:
    """An IDE with a control socket, and a page of it."""

    def __init__(self, folder: Path, *options: str) -> None:
        self.control = folder / "control"
        self.process = subprocess.Popen(
            [*COMMAND, str(folder), "--listen", "0", "--control", str(self.control), *options],
            stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
        assert self.process.stdout.readline() == f"ready control {self.control}\n"
        url = self.process.stdout.readline().split()[2]
        self.port, self.token = int(url.split(":")[2].partition("/")[0]), url.partition("token=")[2]

    def bench(self, *words: str) -> str:
        """What `tmcm34x bench` prints; it succeeds."""
        return subprocess.run(
            [COMMAND[0], "bench", "--control", str(self.control), *words],
            capture_output=True, text=True, check=True, timeout=60,
        ).stdout  # fmt: skip

    async def seen_by(self, scenario: Callable[[Window], Awaitable[None]]) -> None:
        """Run a scenario with a window of the IDE."""
        origin = f"http://127.0.0.1:{self.port}"
        headers = {"Cookie": f"tmcm34x-{self.port}={self.token}"}
        async with connect(
            origin.replace("http", "ws") + "/wire", origin=origin, additional_headers=headers, proxy=None
        ) as connection:
            window = Window(connection)
            reader = asyncio.create_task(window.read())
            await scenario(window)
            reader.cancel()
            await asyncio.gather(reader, return_exceptions=True)

    def close(self) -> None:
        self.process.terminate()
        self.process.communicate(timeout=60)


@pytest.fixture
def controlled(tmp_path):
    ide = Controlled(tmp_path)
    yield ide
    ide.close()


def test_windows_see_what_is_done_through_the_control_socket(controlled):
    async def scenario(window):
        welcome = await window.event(wire.Welcome)
        assert welcome.links == [f"control {controlled.control}"]
        await asyncio.to_thread(controlled.bench, "press", "left", "1")
        await window.event(wire.WorldChanged, lambda event: event.world.axes[1].left_held)
        await asyncio.to_thread(controlled.bench, "fault", "silent,count=1")
        assert [(await window.execute("GAP 1, 0"))["status"] for _ in range(2)] == [0, 100]

    asyncio.run(controlled.seen_by(scenario))


def test_a_restored_snapshot_is_seen_and_the_past_holds_back_time(controlled, tmp_path):
    snapshot = str(tmp_path / "state")

    async def scenario(window):
        await asyncio.to_thread(controlled.bench, "snapshot", snapshot)
        await window.execute("SGP 5, 2, 7")
        await asyncio.to_thread(controlled.bench, "until", "1", "s")
        await asyncio.to_thread(controlled.bench, "restore", snapshot)
        assert (await window.execute("GGP 5, 2"))["value"] == 0
        history = await window.event(wire.History, lambda event: len(event.branches) > 1)
        assert history.branches[-1].parent == -1
        await window.call(wire.ShowPast(history.branches[-1].oldest, history.present))
        request = b'{"do": "pause"}\n'
        answer = await asyncio.to_thread(_asked, controlled.control, request)
        assert "A past moment is shown" in answer["error"]
        await window.call(wire.LeavePast())
        assert await asyncio.to_thread(_asked, controlled.control, request) == {"ok": True}

    asyncio.run(controlled.seen_by(scenario))
    controlled.close()
    assert not controlled.control.exists()


def _asked(address: Path, line: bytes) -> dict[str, object]:
    """The answer of a control socket to a line."""
    with socket.socket(socket.AF_UNIX) as client:
        client.settimeout(20)
        client.connect(str(address))
        client.sendall(line)
        return json.loads(client.makefile("rb").readline())


def test_the_control_socket_is_there_again_with_another_virtual_module(controlled):
    async def scenario(window):
        await window.event(wire.Welcome)
        await window.call(wire.UseVirtual(model=341))
        await window.event(wire.Welcome, lambda event: event.model.number == 341 and event.links)
        assert '"powered": true' in await asyncio.to_thread(controlled.bench, "state")

    asyncio.run(controlled.seen_by(scenario))


def test_a_control_socket_that_cannot_be_opened_is_told_in_one_line(tmp_path):
    taken = tmp_path / "taken"
    taken.write_text("mine")
    assert "there is a file of this name" in _refused(str(tmp_path), "--listen", "0", "--control", str(taken))
    assert taken.read_text() == "mine"
    assert "--control" in _refused("--port", "x", "--control", "0")
