"""Commands that are broken off: Ctrl-C at any moment, and readers of their output that have enough."""

import os
import random
import subprocess
import sys

import pytest

from conftest import COMMAND

LOOP = "Loop: ROR 0, 500\n  WAIT TICKS, 0, 1\n  MST 0\n  JA Loop\n"
INTERRUPT = """
import os, signal, sys
from tmcm34x.__main__ import main
left = {calls}
def count(*_):
    global left
    left -= 1
    if left == 0:
        sys.setprofile(None)
        os.kill(os.getpid(), signal.SIGINT)
sys.argv[1:] = {words}
sys.setprofile(count)
main()
"""
"""Interrupts the command at one of its calls, imports included, so that the moment is the same each time."""


@pytest.fixture
def program(tmp_path):
    path = tmp_path / "loop.tmc"
    path.write_text(LOOP)
    return path


def interrupted(calls, *words):
    script = INTERRUPT.format(calls=calls, words=list(map(str, words)))
    return subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False, timeout=60
    )


@pytest.mark.parametrize(
    ("words", "calls"),
    [
        (words, calls)
        for words, most in (
            (("--version",), 60_000),
            (("lint", os.devnull), 170_000),
            (("send", "GAP 1, 0", "--port", "virtual:343"), 250_000),
        )
        for calls in random.Random(1).sample(range(1, most), 6)
    ],
)
def test_a_command_that_is_interrupted_at_its_start_ends_quietly(words, calls):
    result = interrupted(calls, *words)
    assert (result.returncode, result.stderr.strip()) == (130, "")


LOST = """
import os, signal, sys, weakref
from tmcm34x.interrupts import keep_interrupts
keep_interrupts()
class Lock: pass
def interrupt(*_): os.kill(os.getpid(), signal.SIGINT)
lock = Lock()
watching = weakref.ref(lock, interrupt)
try:
    del lock
    print("ends")
except KeyboardInterrupt:
    sys.exit("interrupted")
"""
"""An interrupt in the callback of a weak reference, as the locks of imports have them."""


def test_an_interrupt_in_a_callback_whose_exceptions_are_lost_is_raised_behind_it():
    result = subprocess.run([sys.executable, "-c", LOST], capture_output=True, text=True, check=False)
    assert (result.stdout, result.stderr) == ("", "interrupted\n")


@pytest.mark.parametrize("calls", random.Random(2).sample(range(100, 150_000), 5))
def test_a_run_that_is_interrupted_says_so_with_its_status(program, calls):
    result = interrupted(calls, "run", program)
    assert (result.returncode, "Traceback" in result.stderr) == (130, False), result.stderr


@pytest.mark.parametrize("calls", random.Random(3).sample(range(100, 40_000), 5))
def test_a_server_that_is_interrupted_ends_in_order(calls):
    result = interrupted(calls, "serve", "--tcp", 0)
    assert result.returncode in ({0} if "ready" in result.stdout else {0, 130})
    assert result.stderr.strip() == ""


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (("run", "FILE", "--append-stop", "--profile"), "L{}: SGP 1, 2, {}"),
        (("lint", "FILE", "--map"), "L{}: SGP 1, 2, {}"),
        (("fmt", "-"), "L{}: SGP 1, 2, {}"),
        (("dis", "IMAGE"), "L{}: SGP 1, 2, {}"),
        (("show", "FILE"), "> 01 06 04 00 00 00 00 00 0B"),
    ],
)
def test_a_reader_that_has_enough_ends_a_command_quietly(tmp_path, words, line):
    file, image = tmp_path / ("long.hex" if words[0] == "show" else "long.tmc"), tmp_path / "long.bin"
    file.write_text("".join(line.format(n, n) + "\n" for n in range(1, 1500)))
    image.write_bytes(bytes.fromhex("0500000000000005" * 200))
    reader, writer = os.pipe()
    os.close(reader)
    names = {"FILE": str(file), "IMAGE": str(image)}
    with file.open("rb") as source:
        result = subprocess.run(
            [COMMAND, *(names.get(word, word) for word in words)],
            stdin=source, stdout=writer, stderr=subprocess.PIPE, text=True, check=False,
        )  # fmt: skip
    os.close(writer)
    assert result.returncode == 1, result.stderr
    assert "Traceback" not in result.stderr and "Broken" not in result.stderr


@pytest.mark.parametrize(
    ("words", "broken"),
    [
        (words, broken)
        for words, writes in (
            (("run", "FILE", "--trace", "--until", "1"), {"stdout", "stderr"}),
            (("run", "FILE", "--csv", "/dev/stdout", "--until", "1"), {"stdout"}),
            (("settings", "dump", "--port", "virtual:343"), {"stdout"}),
            (("status", "--port", "virtual:343"), {"stdout", "stderr"}),
            (("why", "--json", "--port", "virtual:343"), {"stdout"}),
            (("monitor", "--csv", "--port", "virtual:343"), {"stdout"}),
            (("serve", "--tcp", "0"), {"stdout"}),
        )
        for broken in (("stdout",), ("stderr",), ("stdout", "stderr"))
        if writes & set(broken)
    ],
)
def test_an_output_without_a_reader_ends_a_command_quietly(program, words, broken):
    reader, writer = os.pipe()
    os.close(reader)
    streams = {name: writer if name in broken else subprocess.PIPE for name in ("stdout", "stderr")}
    result = subprocess.run(
        [COMMAND, *(str(program) if word == "FILE" else word for word in words)],
        stdin=subprocess.DEVNULL, check=False, timeout=60, **streams,
    )  # fmt: skip
    os.close(writer)
    assert result.returncode == 1
    assert b"Traceback" not in (result.stderr or b"") and b"Broken" not in (result.stderr or b"")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="a device of Linux")  # noqa: PTH110
@pytest.mark.parametrize(
    "words",
    [
        ("--version",),
        ("units",),
        ("run", "FILE", "--until", "1"),
        ("run", "FILE", "--until", "1", "--csv", "/dev/stdout"),
        ("settings", "dump", "--port", "virtual:343"),
        ("monitor", "--csv", "--port", "virtual:343"),
        ("serve", "--tcp", "0"),
    ],
)
def test_an_output_on_a_full_disk_is_one_line(program, words):
    with open("/dev/full", "w") as full:  # noqa: PTH123
        result = subprocess.run(
            [COMMAND, *(str(program) if word == "FILE" else word for word in words)],
            stdin=subprocess.DEVNULL, stdout=full, stderr=subprocess.PIPE, text=True, check=False, timeout=60,
        )  # fmt: skip
    *_, last = result.stderr.splitlines()
    assert (result.returncode, last.partition(": ")[2]) == (2, "standard output: No space left on device")
