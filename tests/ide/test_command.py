from __future__ import annotations

import contextlib
import signal
import socket
import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest

from tmcm34x.cli.ide import PORT
from tmcm34x.firmware.storage import Eeprom

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


def test_the_usual_port_is_taken_once_and_a_free_one_the_second_time(tmp_path):
    ports = []
    with contextlib.ExitStack() as stack:
        for _ in range(2):
            process = subprocess.Popen([*COMMAND, str(tmp_path)], stdout=subprocess.PIPE, text=True)
            stack.enter_context(process)
            stack.callback(process.terminate)
            ports.append(int(process.stdout.readline().split(":")[2].partition("/")[0]))
    assert ports[0] != ports[1]
    assert ports[1] != PORT


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
