"""A sweep of 10,000 short runs beside the runs alone.

- Two processes against one: how much of twice the speed they reach.
- One process against the same runs in a loop of this process: what sharing out, results and the table cost.

The starts of the processes are left out: both sides are timed from their first result on.  All three are done twice, in
turns, and the shorter time of each counts: what else the machine does lengthens some of them.

Must reach, with two processors that do nothing else: 0.9 of linear; 1.05 of the runs alone.
"""

import tempfile
import time
from collections.abc import Iterable
from contextlib import closing
from pathlib import Path

from tmcm34x import sweep
from tmcm34x.sweep import plan, runner
from tmcm34x.sweep.single import RowResult, result_of
from tmcm34x.sweep.table import ResultTable

ROWS = 10_000
TURNS = 2
PROGRAM = "Way = 1\nSpeed = 1\n SAP 4, 0, Speed\n MVP ABS, 0, Way\n WAIT POS, 0, 0\n STOP\n"
SWEEP = """
program = "p.tmc"
until_s = 100
[[vary]]
what = "Way"
values = { low = 100, high = 1099, count = 1000 }
[[vary]]
what = "Speed"
values = { low = 500, high = 950, count = 10 }
[figures]
time_us = "time_us"
lost = "lost[0]"
"""


def seconds(results: Iterable[tuple[int, RowResult]], table: ResultTable | None = None) -> float:
    """From the first result to the last."""
    start = None
    for number, result in results:
        start = start or time.perf_counter()
        assert not result.error
        if table is not None:
            table.write(number, result)
    assert start is not None
    return time.perf_counter() - start


def main() -> int:
    with tempfile.TemporaryDirectory() as folder:
        here = Path(folder)
        (here / "p.tmc").write_text(PROGRAM)
        (here / "sweep.toml").write_text(SWEEP)
        job = sweep.load(here / "sweep.toml")
        rows = plan.rows(job.sweep)
        assert len(rows) == ROWS

        def shared(processes: int) -> float:
            table = ResultTable(here / "out.csv", job.sweep, rows, {})
            with closing(runner.results(job, rows, range(ROWS), processes)) as results:
                taken = seconds(results, table)
            table.close()
            return taken

        def bare() -> float:
            return seconds((number, result_of(job, row)) for number, row in enumerate(rows))

        turns = [(bare(), shared(1), shared(2)) for _ in range(TURNS)]
    alone, one, two = (min(times) for times in zip(*turns, strict=True))
    linear, overhead = one / two / 2, one / alone
    print(f"{ROWS:,} short runs alone {alone:.1f} s: {alone / ROWS * 1e3:.2f} ms each")
    print(f"one process {one:.1f} s, {overhead:.3f} of the runs alone (must 1.05 or less)")
    print(f"two processes {two:.1f} s, {linear:.2f} of linear (must 0.9)")
    return 0 if linear >= 0.9 and overhead <= 1.05 else 1


if __name__ == "__main__":
    raise SystemExit(main())
