"""What tests of several packages share."""

import itertools
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import hypothesis
import pytest

pytest_plugins = ["pytester"]

# The same commit gives the same result on a machine of any speed; `make explore` looks for new examples.
TIMELESS = {"deadline": None, "suppress_health_check": [hypothesis.HealthCheck.too_slow]}
hypothesis.settings.register_profile("repeatable", derandomize=True, **TIMELESS)
hypothesis.settings.register_profile("explore", print_blob=True, **TIMELESS)
hypothesis.settings.load_profile("repeatable")

# A shell that starts the tests in the background ignores SIGINT for them, and processes inherit that.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

COMMAND = str(Path(sys.executable).with_name("tmcm34x"))


PATIENCE_S = 60.0
"""How long a busy machine may take for what is there at once."""


def _named(options):
    """The options with a name for each pseudo terminal: its number is the next one's as soon as it is closed."""
    for option, following in itertools.zip_longest(options, options[1:], fillvalue="--"):
        yield option
        if option == "--pty" and str(following).startswith("--"):
            yield Path(tempfile.mkdtemp(prefix="pty-")) / "line"


class Served:
    """A running `tmcm34x serve`; `links` are kind and address of its ready lines."""

    def __init__(self, options):
        self.process = subprocess.Popen(
            [COMMAND, "serve", *map(str, options)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        expected = max(
            1, sum(option in {"--pty", "--tcp", "--serial", "--slcan", "--can"} for option in options)
        )
        lines = [self.process.stdout.readline().split() for _ in range(expected)]
        if [] in lines:
            raise AssertionError(self.process.communicate()[1])
        assert all(word == "ready" for word, *_ in lines), lines
        self.links = [(kind, address) for _, kind, address in lines]

    @property
    def pty(self):
        """Path of the pseudo terminal."""
        return dict(self.links)["pty"]

    @property
    def tcp(self):
        """`host:port` of the socket."""
        return dict(self.links)["tcp"]

    def stop(self, number=signal.SIGTERM):
        """End the process; returns what it still had to say on standard output."""
        self.process.send_signal(number)
        output, errors = self.process.communicate(timeout=PATIENCE_S)
        assert (self.process.returncode, errors) == (0, "")
        return output


def _serving():
    running = []

    def start(*options, named=True):
        running.append(Served(list(_named(options)) if named else options))
        return running[-1]

    yield start
    for served in running:
        if served.process.poll() is None:
            served.stop()
        served.process.stdout.close()
        served.process.stderr.close()


@pytest.fixture
def serve():
    """Call it with options of `tmcm34x serve`: starts the command and waits until its links are ready.

    named: pseudo terminals without a name are given one
    """
    yield from _serving()


@pytest.fixture(scope="module")
def serve_once():
    """`serve` for all tests of a module: starting takes longer than most of them."""
    yield from _serving()


@pytest.fixture
def wait_for():
    """Call it with a condition and, perhaps, a time in seconds: waits until it holds, and says whether it does."""

    def wait(condition, timeout_s=PATIENCE_S):
        end = time.monotonic() + timeout_s
        while time.monotonic() < end:
            if condition():
                return True
            time.sleep(0.002)
        return condition()

    return wait
