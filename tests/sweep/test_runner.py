"""The processes of a sweep, when one is lost."""

import os
import signal
import subprocess
import sys
import threading

import pytest

from tmcm34x.sweep import runner
from tmcm34x.sweep.description import parse
from tmcm34x.sweep.plan import Job, rows
from tmcm34x.sweep.single import result_of
from tmcm34x.sweep.sources import gather
from tmcm34x.toolchain.assembler import no_includes

SWEEP = """
program = "p.tmc"
until_s = 100
[[vary]]
what = "Way"
values = { low = 100, high = 800, count = 8 }
[figures]
distance = "distance[0]"
"""
PROGRAM = "Way = 1\n MVP ABS, 0, Way\n WAIT POS, 0, 0\n STOP\n"


def job():
    return Job(parse(SWEEP), gather(PROGRAM, "p.tmc", no_includes, 343), None)


def test_results_are_those_of_the_runs_alone():
    work = job()
    planned = rows(work.sweep)
    assert [row[0] for row in planned] == [100, 200, 300, 400, 500, 600, 700, 800]
    alone = {number: result_of(work, row) for number, row in enumerate(planned)}
    assert dict(runner.results(work, planned, range(8), 2)) == alone
    assert [result.figures for result in alone.values()] == planned


@pytest.mark.parametrize("count", [1, 8])
def test_behind_the_results_no_thread_is_left(count):
    work = job()
    came = runner.results(work, rows(work.sweep), range(8), 2)
    for _ in range(count):
        next(came)
    came.close()
    assert [
        thread.name for thread in threading.enumerate() if "ExecutorManager" in type(thread).__name__
    ] == []


class DeadlyRow(tuple):
    """A row whose arrival ends the process."""

    __slots__ = ()

    def __reduce__(self):
        return os.kill, (_PidOfReader(), signal.SIGKILL)


class _PidOfReader:
    def __reduce__(self):
        return os.getpid, ()


def test_a_lost_process_fails_its_row_alone():
    work = job()
    planned = rows(work.sweep)
    deadly = [DeadlyRow(row) if number == 3 else row for number, row in enumerate(planned)]
    found = dict(runner.results(work, deadly, range(8), 2))
    assert sorted(found) == list(range(8))
    assert "process" in found[3].error
    assert [found[number].figures for number in range(8) if number != 3] == [
        row for number, row in enumerate(planned) if number != 3
    ]


KILLED = f"""
import os, signal
from tmcm34x.sweep import runner
from tmcm34x.sweep.description import parse
from tmcm34x.sweep.plan import Job, rows
from tmcm34x.sweep.sources import gather
from tmcm34x.toolchain.assembler import no_includes
job = Job(parse({SWEEP!r}), gather({PROGRAM!r}, "p.tmc", no_includes, 343), None)
for _ in runner.results(job, rows(job.sweep), range(8), 2):
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_the_processes_end_with_the_one_that_started_them_however_it_ends():
    started = subprocess.run([sys.executable, "-c", KILLED], stdout=subprocess.PIPE, check=False, timeout=60)
    assert started.returncode == -signal.SIGKILL, "its output ends when no process has it any more"


@pytest.mark.skipif(sys.platform == "win32", reason="signals are masked on POSIX systems")
def test_an_interrupt_from_the_keyboard_does_not_reach_a_process_that_starts() -> None:
    """A terminal sends it to all processes, and one that is starting would end with a traceback."""
    asks = "import signal; print(signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, []))"
    with runner.held_back():
        held = subprocess.run([sys.executable, "-c", asks], capture_output=True, text=True, check=True)
    free = subprocess.run([sys.executable, "-c", asks], capture_output=True, text=True, check=True)
    assert (held.stdout, free.stdout) == ("True\n", "False\n")
