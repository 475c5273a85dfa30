"""`tmcm34x console` at a real terminal: completion, history, help, ASCII mode, units."""

import os
import re
import select
import subprocess
import sys
import time

import pytest

from conftest import COMMAND

pytestmark = [
    pytest.mark.skipif(sys.platform == "win32", reason="there are no pseudo terminals"),
    pytest.mark.skipif(
        subprocess.run([sys.executable, "-c", "import readline"], capture_output=True, check=False).returncode
        != 0,
        reason="this Python has no readline",
    ),
]

PATIENCE_S = 20.0
ESCAPES = re.compile(r"\x1b\[[?0-9;]*[a-zA-Z]|\x07")


class Terminal:
    """A console at a terminal."""

    def __init__(self, home, *words):
        self.master, slave = os.openpty()
        self.unread = ""
        self.process = subprocess.Popen(
            [COMMAND, "console", *words], stdin=slave, stdout=slave, stderr=slave, start_new_session=True,
            env={**os.environ, "HOME": str(home), "TERM": "xterm", "INPUTRC": os.devnull},
        )  # fmt: skip
        os.close(slave)

    def type(self, keys):
        """Press keys."""
        os.write(self.master, keys.encode())

    def until(self, text):
        """What is shown up to `text`, escape sequences left out."""
        end = time.monotonic() + PATIENCE_S
        while text not in self.unread:
            ready = select.select([self.master], [], [], max(0.0, end - time.monotonic()))[0]
            assert ready, f"{text!r} is not in {self.unread!r}"
            self.unread += ESCAPES.sub("", os.read(self.master, 4096).decode())
        shown, found, self.unread = self.unread.partition(text)
        return shown + found

    def ask(self, line, prompt="tmcl> "):
        """What a line is answered with."""
        self.type(f"{line}\r")
        self.until("\n")
        return self.until(prompt).removesuffix(prompt).replace("\r", "").strip()

    def end(self):
        """Leave by Ctrl+D; the exit status."""
        self.type("\x04")
        status = self.process.wait(PATIENCE_S)
        os.close(self.master)
        return status


@pytest.fixture
def terminal(tmp_path):
    opened = []

    def start(*words):
        opened.append(Terminal(tmp_path, *words))
        opened[-1].until("tmcl> ")
        return opened[-1]

    yield start
    for each in opened:
        if each.process.poll() is None:
            each.process.kill()
            each.process.wait()
            os.close(each.master)


def test_names_are_completed(terminal):
    console = terminal("--port", "virtual:343")
    assert console.ask("GAP max_sp\t, 1") == "1000 velocity units"
    assert console.ask("get_firm\t") == "343V4.36"
    console.type("GAP actual_\t\t")
    shown = console.until("tmcl> GAP actual_")
    assert shown.split()[-6:-3] == ["actual_acceleration", "actual_position", "actual_speed"]
    console.type("\x15")
    assert console.end() == 0


def test_lines_of_earlier_consoles_come_back(terminal, tmp_path):
    console = terminal("--port", "virtual:343")
    console.ask("GAP 4, 2")
    assert console.end() == 0
    assert "GAP 4, 2" in (tmp_path / ".tmcm34x_history").read_text()
    console = terminal("--port", "virtual:343")
    console.type("\x1b[A")
    console.until("GAP 4, 2")
    assert console.ask("") == "1000 velocity units"
    assert console.end() == 0


def test_help_bytes_and_units(terminal):
    console = terminal("--port", "virtual:343")
    assert "MVP" in console.ask("help MVP")
    assert "0..2047 velocity units" in console.ask("help max_speed")
    console.ask("hex on")
    assert "> 01 06 04 00 00 00 00 00 0b" in console.ask("GAP 4, 0")
    assert "max_speed: 1000 = 476.837 full steps/s" in console.ask("units 0")
    assert "there is no axis parameter max_sped; did you mean max_speed?" in console.ask("GAP max_sped, 0")
    assert console.end() == 0


def test_lines_go_as_they_are_in_ascii_mode(terminal):
    console = terminal("--port", "virtual:343")
    assert "ABIN leaves it" in console.ask("ascii", "ascii> ")
    assert "100 1000" in console.ask("AGAP 4, 0", "ascii> ")
    console.ask("ABIN")
    assert console.ask("GAP 4, 0") == "1000 velocity units"
    assert console.end() == 0


def test_what_moves_a_motor_of_a_real_line_is_asked_for_once(terminal, serve):
    console = terminal("--port", serve("--pty").pty)
    console.type("ROR 0, 100\r")
    console.until("Go on? [y/N]: ")
    console.type("n\r")
    console.until("tmcl> ")
    assert console.ask("GAP target_speed, 0").startswith("0 ")
    console.type("ROR 0, 100\r")
    console.until("Go on? [y/N]: ")
    console.type("y\r")
    console.until("tmcl> ")
    assert console.ask("MST 0") == "0"
    assert console.end() == 0
