"""`tmcm34x play` as a process: on virtual modules, and on served ones as if they were real."""

import os
import subprocess
from pathlib import Path
from xml.etree import ElementTree as ET

import can
import pytest

from conftest import COMMAND

SESSIONS = Path(__file__).parent.parent / "sessions"
GOOD = "== reads\n> GAP 4, 0\n< 100 1000\n"
BAD = "== title of it\n> GAP 4, 0\n< 100 7\n"
MOVING = "== moves\n> MVP ABS, 0, 5000\n< 100 5000\nwithin 5 s: GAP 8, 0 is 100 1\n> GAP 1, 0\n< 100 5000\n"


def play(*arguments):
    return subprocess.run(
        [COMMAND, "play", *map(str, arguments)], capture_output=True, text=True, check=False, input=""
    )


@pytest.fixture
def session(tmp_path):
    def write(text, name="a.session"):
        path = tmp_path / name
        path.write_text(text)
        return path

    return write


def test_all_sessions_of_this_repository_are_played():
    result = play("--quiet", "--model", "343", *sorted(SESSIONS.glob("*.txt")))
    assert (result.returncode, result.stderr) == (0, "")
    assert " passed, 0 failed, " in result.stdout


def test_each_file_has_a_line_and_the_end_a_sum(session):
    result = play(session(GOOD))
    assert result.returncode == 0
    first, last = result.stdout.splitlines()
    assert first.endswith("a.session: 6 played, 12 lines, ok")
    assert last.startswith("6 passed, 0 failed, 12 lines in ")


def test_models_and_links_can_be_chosen(session):
    result = play(session(GOOD), "--model", "341", "--link", "can")
    assert "1 passed, 0 failed" in result.stdout


def test_a_failure_is_shown_once_with_all_that_it_happens_on(session):
    path = session(BAD)
    result = play(path)
    assert result.returncode == 1
    assert result.stdout.count(f"{path}:3: < 100 7") == 1
    assert "also on   343 can" in result.stdout
    for part in ("in        title of it", "sent      > GAP 4, 0  [01 06 04", "value 7", "value 1000"):
        assert part in result.stdout


def test_it_can_end_at_the_first_failure(session):
    result = play("--first", session(BAD))
    assert "0 passed, 1 failed" in result.stdout


def test_a_folder_stands_for_its_session_files(session, tmp_path):
    session(GOOD)
    session(BAD, "other.txt")
    result = play(tmp_path)
    assert result.returncode == 0
    (tmp_path / "empty").mkdir()
    result = play(tmp_path / "empty")
    assert (result.returncode, result.stdout) == (2, "")
    assert "no *.session files in this folder" in result.stderr


def test_files_that_cannot_be_read_do_not_keep_others_from_being_played(session):
    result = play(session(GOOD), session("== a\n> FOO\n", "b.session"), "gone.session")
    assert result.returncode == 1
    assert "b.session:2:3: unknown command FOO" in result.stderr
    assert "gone.session: No such file" in result.stderr
    assert "6 passed, 0 failed" in result.stdout
    assert "2 files cannot be read" in result.stdout


def test_a_bench_hangs_on_the_modules(session, tmp_path):
    bench = tmp_path / "bench.toml"
    bench.write_text('[[module]]\ninput.IN_3 = {kind = "constant", value = 1023}\n')
    path = session("== input\n> GIO 3, 0\n< 100 1\n")
    assert play(path, "--bench", bench).returncode == 0
    assert play(path).returncode == 1
    bench.write_text("[[modul]]\n")
    result = play(path, "--bench", bench)
    assert result.returncode == 2
    assert "bench.toml" in result.stderr


def test_results_go_into_a_junit_file(session, tmp_path):
    out = tmp_path / "out.xml"
    play(session(BAD), session(GOOD, "good.session"), "--junit", out, "--model", "343", "--link", "serial")
    bad, good = ET.parse(out).getroot()
    assert (bad.get("tests"), bad.get("failures"), good.get("failures")) == ("1", "1", "0")
    (case,) = bad
    assert (case.get("name"), case.get("line")) == ("title of it [343 serial]", "1")
    assert "value 1000" in case[0].text


# On a module that might be real


@pytest.mark.parametrize("link", ["--pty", "--tcp=0"])
def test_a_session_is_played_at_a_port(serve, session, link):
    served = serve(link, "--model", "341", "--speed", "10")
    port = f"tcp://{served.tcp}" if "tcp" in link else served.pty
    path = session(GOOD + MOVING + "== bench\n> GAP 1, 0\n< 100\n! power cycle\n> GAP 1, 0\n")
    result = play(path, "--port", port, "--yes")
    assert (result.returncode, result.stderr) == (0, "")
    assert "3 passed, 0 failed" in result.stdout
    assert "2 lines left out: they need a bench" in result.stdout


ON_CAN = (
    "== frames\n# links: can\n> id 1: 06 04 00 00 00 00 00\n< id 2: 01 64 06 00 00 03 e8\n"
    "== bytes\n# links: serial\n> 01 06 04 00 00 00 00 00 0b\n< 100 1000\n"
)


def test_a_session_is_played_on_a_can_bus(serve, session):
    port = f"slcan:{serve('--slcan', '--speed', '10').links[0][1]}"
    result = play(session(GOOD + MOVING + ON_CAN), "--port", port, "--yes")
    assert (result.returncode, result.stderr) == (0, "")
    assert "4 passed, 0 failed" in result.stdout
    assert "2 lines left out: they need a bench or another kind of line" in result.stdout
    failed = play(session(BAD + "== silent\n> GAP 4, 0\n< -\n"), "--port", port)
    assert "2 failed" in failed.stdout
    assert "got       id 2: 01 64 06 00 00 03 e8" in failed.stdout


def test_a_bus_that_brings_frames_back_to_their_sender_is_no_second_host(serve, session):
    if not multicast_works():
        pytest.skip("no IP multicast on this system, which the CAN bus udp_multicast is made of")
    served = serve("--can", GROUP, "--slcan")
    for port in (f"can:{GROUP}?reply=any", f"slcan:{dict(served.links)['slcan']}"):
        result = play(session(GOOD + ON_CAN), "--port", port)
        assert (result.returncode, result.stderr) == (0, ""), result.stdout


GROUP = f"udp_multicast:239.74.{os.getpid() >> 8 & 255}.{os.getpid() & 255}"
"""Of this process alone: all that runs on this machine hears a group."""


def multicast_works():
    """Whether what one socket sends to a group of this machine comes to another."""
    channel = GROUP.partition(":")[2]
    try:
        with (
            can.Bus(interface="udp_multicast", channel=channel) as one,
            can.Bus(interface="udp_multicast", channel=channel) as other,
        ):
            one.send(can.Message(arbitration_id=0x7FF, is_extended_id=False))
            return other.recv(2) is not None
    except (can.CanError, OSError):
        return False


def test_a_motion_is_asked_for(serve, session):
    served = serve("--tcp=0")
    path = session(MOVING)
    result = play(path, "--port", f"tcp://{served.tcp}")
    assert (result.returncode, result.stderr) == (
        2,
        "tmcm34x play: sessions that may move motors need --yes where there is no terminal to ask on\n",
    )
    assert f"{path}:2: > MVP ABS, 0, 5000: may move a motor" in result.stdout


def test_a_real_module_that_does_otherwise_is_found_out(serve, session):
    served = serve("--tcp=0")
    result = play(session(BAD + "== silent\n> GAP 4, 0\n< -\n"), "--port", f"tcp://{served.tcp}")
    assert result.returncode == 1
    assert "0 passed, 2 failed" in result.stdout


def test_a_port_that_cannot_be_opened_is_told_in_a_line(session):
    result = play(session(GOOD), "--port", "/dev/nothing")
    assert (result.returncode, result.stdout) == (2, "")
    assert result.stderr.startswith("tmcm34x play: cannot open /dev/nothing")
    result = play(session(GOOD), "--port", "/dev/nothing", "--bench", "b.toml")
    assert "--bench is for virtual modules" in result.stderr
