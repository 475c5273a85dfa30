"""`tmcm34x serve --control` and `tmcm34x bench`, as scripts use them."""

import json
import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from conftest import PATIENCE_S
from tmcm34x.cli import run
from tmcm34x.cli.bench import WORDS
from tmcm34x.tmcl.datagram import Instruction, pack_request, unpack_reply

COMMAND = Path(sys.executable).with_name("tmcm34x")


class Bench:
    """A served module, its control socket, and a host."""

    def __init__(self, folder, *options):
        self.ready = folder / "ready"
        self.control = str(folder / "control")
        self.process = subprocess.Popen(
            [COMMAND, "serve", "--tcp", "0", "--control", self.control, "--ready-file", self.ready, *map(str, options)],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        lines = [self.process.stdout.readline().split() for _ in range(2)]
        assert lines[1] == ["ready", "control", self.control]
        host, port = lines[0][2].rsplit(":", 1)
        self.host = socket.create_connection((host, int(port)), timeout=PATIENCE_S)
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.settimeout(PATIENCE_S)
        self.socket.connect(self.control)
        self.stream = self.socket.makefile("rwb")

    def line(self, data):
        self.stream.write(data + b"\n")
        self.stream.flush()
        return json.loads(self.stream.readline())

    def do(self, do, **request):
        return self.line(json.dumps({"do": do, **request}).encode())

    def ask(self, *fields):
        self.host.sendall(pack_request(1, Instruction(*fields)))
        reply = b""
        while len(reply) < 9 and (chunk := self.host.recv(9 - len(reply))):
            reply += chunk
        return unpack_reply(reply)

    def command(self, *words, **options):
        return subprocess.run(
            [COMMAND, "bench", *map(str, words)],
            capture_output=True, text=True, check=False, timeout=PATIENCE_S,
            env={**os.environ, "TMCM34X_CONTROL": self.control}, **options,
        )  # fmt: skip

    def close(self):
        for each in (self.stream, self.socket, self.host):
            each.close()
        self.process.terminate()
        output, errors = self.process.communicate(timeout=PATIENCE_S)
        assert (self.process.returncode, errors) == (0, "")
        return output


@pytest.fixture
def bench(tmp_path):
    bench = Bench(tmp_path)
    yield bench
    if bench.process.poll() is None:
        bench.close()


def test_the_ready_file_says_what_the_ready_lines_say_and_goes_at_the_end(bench, wait_for):
    assert wait_for(bench.ready.exists)
    kinds = [line.split()[0] for line in bench.ready.read_text().splitlines()]
    assert kinds == ["tcp", "control"]
    assert Path(bench.control).stat().st_mode & 0o777 == 0o600
    bench.close()
    assert not bench.ready.exists()
    assert not Path(bench.control).exists()


def test_exit_after_ends_it_by_itself(tmp_path):
    result = subprocess.run(
        [COMMAND, "serve", "--tcp", "0", "--exit-after", "0.05"],
        capture_output=True, text=True, check=False, timeout=PATIENCE_S,
    )  # fmt: skip
    assert (result.returncode, result.stderr) == (0, "")


def test_a_switch_is_pressed_and_released(bench):
    assert bench.command("press", "left", 0).returncode == 0
    assert bench.ask(6, 11, 0).value == 1
    assert bench.command("release", "left", 0).returncode == 0
    assert bench.ask(6, 11, 0).value == 0


def test_power_goes_and_comes(bench):
    bench.ask(9, 3, 2, 77)
    assert bench.command("power", "off").returncode == 0
    assert not bench.do("state")["modules"][0]["powered"]
    assert bench.command("power", "on").returncode == 0
    assert bench.ask(10, 3, 2).value == 0


def test_time_is_paused_and_passes_by_request(bench):
    bench.do("pause")
    before = bench.ask(10, 132, 0).value
    assert bench.command("until", 3, "s").returncode == 0
    assert bench.ask(10, 132, 0).value == before + 3000
    assert bench.do("state")["paused"]
    assert bench.do("resume") == {"ok": True}
    assert bench.do("speed", speed=10) == {"ok": True}
    state = bench.do("state")
    assert (state["speed"], state["paused"]) == (10, False)


def test_an_hour_passes_in_a_moment_and_hosts_are_served_meanwhile(bench):
    bench.ask(1, 0, 0, 500)
    answer = bench.do("until", seconds=3600)
    assert answer["now"] >= 3600
    assert bench.ask(6, 3, 0).value == 500


def test_a_snapshot_is_gone_back_to_and_digests_tell(bench, tmp_path):
    bench.do("pause")
    bench.ask(9, 3, 2, 77)
    digest = bench.do("digest")["digest"]
    assert bench.command("snapshot", tmp_path / "snapshot").returncode == 0
    bench.ask(9, 3, 2, 78)
    bench.do("until", seconds=1)
    assert bench.do("digest")["digest"] != digest
    assert bench.command("restore", tmp_path / "snapshot").returncode == 0
    assert bench.ask(10, 3, 2).value == 77
    assert bench.do("digest")["digest"] == digest


def test_what_is_restored_is_kept(tmp_path):
    memory = tmp_path / "memory"
    bench = Bench(tmp_path, "--eeprom", memory)
    bench.ask(9, 68, 0, 77)
    snapshot = bench.do("snapshot")["snapshot"]
    bench.ask(9, 68, 0, 78)
    assert bench.do("restore", snapshot=snapshot)["ok"]
    bench.close()
    served = Bench(tmp_path, "--eeprom", memory)
    assert served.ask(10, 68, 0).value == 77
    served.close()


def test_faults_of_the_line(bench):
    assert bench.command("fault", "bad_checksum,count=1").returncode == 0
    with pytest.raises(ValueError, match="checksum"):
        bench.ask(10, 66, 0)
    assert bench.ask(10, 66, 0).status == 100
    bench.do("fault", fault="garble")
    assert bench.do("clear", fault="garbel")["error"].startswith(
        "there is no fault 'garbel'; there are silent"
    )
    bench.do("clear", fault="garble")
    assert bench.ask(10, 66, 0).status == 100
    assert bench.do("counters")["faults"] == {"bad_checksum": 1}
    bench.do("fault", fault="disconnect")
    assert bench.host.recv(1) == b""


def test_what_has_happened_is_counted(tmp_path):
    bench = Bench(tmp_path, "--counters")
    bench.ask(99)
    bench.ask(99)
    bench.ask(6, 4, 9)
    bench.ask(9, 68, 0, 1)
    bench.ask(5, 4, 1, 0)
    bench.ask(4, 0, 1, 1000)
    bench.host.sendall(bytes([1, 10, 66, 0, 0, 0, 0, 0, 0]))
    assert bench.host.recv(9)[2] == 1
    (figures,) = bench.do("counters")["modules"]
    assert figures["refused"] == {"2 invalid command": 2, "4 invalid value": 1, "1 wrong checksum": 1}
    assert figures["eeprom_writes"] == {"global_parameter 68": 1}
    assert figures["without_effect"] == {"no_speed": 1}
    assert len(figures["lost_fullsteps"]) == 3
    lines = bench.close().splitlines()
    assert "module 0: 2 commands refused with 2 invalid command" in lines
    assert "module 0: 1 EEPROM write, 1 of them to global_parameter 68" in lines


@pytest.mark.parametrize(
    ("request_", "reason"),
    [
        ({"do": "fly"}, "there is no request 'fly'"),
        ({"do": "act", "action": "kick"}, "no action 'kick'"),
        ({"do": "act", "action": "switch", "operands": [9, "left", True]}, "motor is motor 0..2, not 9"),
        ({"do": "act", "action": "switch", "operands": {}}, "operands must be a list"),
        ({"do": "act", "action": "switch", "operands": [[], {}, 1]}, "operands must be numbers"),
        ({"do": "act", "action": "power", "module": 1, "operands": [True]}, "no module 1"),
        ({"do": "speed", "speed": "fast"}, "speed must be a number"),
        ({"do": "speed", "speed": 1e308}, "speed must be a number"),
        ({"do": "until", "seconds": -1}, "seconds must be a number"),
        ({"do": "fault", "fault": "garbel"}, "there is no fault 'garbel'"),
        ({"do": "restore", "snapshot": "!"}, "base64"),
        ({"do": "restore", "snapshot": "AAAA"}, "not a snapshot"),
    ],
)
def test_what_cannot_be_done_is_refused_in_one_line_and_the_connection_stays(bench, request_, reason):
    answer = bench.do(**request_, id=7)
    assert answer["id"] == 7
    assert reason in answer["error"]
    assert "\n" not in answer["error"]
    assert bench.do("state")["ok"]


@pytest.mark.parametrize(
    "data", [b"POST / HTTP/1.1", b"{", b"[]", b"{}", b"\xff\xfe", b"[" * 100_000, b"x" * (1 << 20)]
)  # fmt: skip
def test_rubbish_ends_the_connection_and_nothing_else(bench, data):
    answer = bench.line(data)
    assert "error" in answer
    assert bench.stream.readline() == b""
    assert bench.ask(10, 66, 0).status == 100
    assert bench.command("digest").returncode == 0


def test_clients_that_vanish_leave_nothing(bench):
    for _ in range(50):
        client = socket.socket(socket.AF_UNIX)
        client.connect(bench.control)
        client.sendall(b'{"do": "until", "seconds": 1}\n{"do": "sta')
        client.close()
    assert bench.do("state")["ok"]


@pytest.mark.parametrize(
    "words",
    [("fly",), ("press",), ("press", "left"), ("press", "left", "x"), ("power", "maybe"), ("until", "3", "years"),
     ("pause", "now"), ("restore", "/no/such/file"), ("press", "left", "9")],
)  # fmt: skip
def test_wrong_words_are_refused_in_one_line(bench, words):
    result = bench.command(*words)
    assert result.returncode == 2
    assert result.stderr.count("\n") == 1
    assert result.stderr.startswith("tmcm34x bench: ")


@pytest.mark.parametrize("target", ["socket", "nowhere"])
def test_a_link_in_the_place_of_the_control_socket_is_refused_in_one_line(tmp_path, target, capfd):
    link = tmp_path / "socket"
    link.symlink_to(target)
    assert run(["serve", "--tcp", "0", "--control", str(link), "--exit-after", "1"]) == 2
    assert capfd.readouterr().err.splitlines() == [
        f"tmcm34x serve: cannot listen on {link}: there is a file of this name already"
    ]


def test_a_control_socket_that_is_not_there_is_refused_in_one_line(tmp_path):
    for address in (tmp_path / "none", "127.0.0.1:1"):
        result = subprocess.run(
            [COMMAND, "bench", "--control", str(address), "pause"],
            capture_output=True,
            text=True,
            check=False,
        )
        assert (result.returncode, result.stderr.count("\n")) == (2, 1)


def test_a_path_that_is_taken_is_refused_and_one_of_a_killed_server_is_not(tmp_path):
    taken = tmp_path / "file"
    taken.write_text("mine")
    result = subprocess.run(
        [COMMAND, "serve", "--tcp", "0", "--control", taken],
        capture_output=True,
        text=True,
        check=False,
        timeout=PATIENCE_S,
    )
    assert (result.returncode, taken.read_text()) == (2, "mine")
    bench = Bench(tmp_path)
    bench.process.kill()
    bench.process.communicate()
    for each in (bench.stream, bench.socket, bench.host):
        each.close()
    Bench(tmp_path).close()


def test_every_action_of_a_bench_has_a_word():
    from tmcm34x.bench.action import ACTIONS

    samples = {"press": ["left", "0"], "unplug": ["left", "0"], "level": ["0", "5"], "driver": ["0", "short_a"],
               "push": ["0", "1"], "move": ["0", "1"], "power": ["on"]}  # fmt: skip
    assert {WORDS[word].request(operands)["action"] for word, operands in samples.items()} == set(ACTIONS) - {
        "spi"
    }
