"""Samples for plots: in the module's time, whatever the pace; nothing invented."""

from __future__ import annotations

import asyncio
import itertools

import pytest

from ide.ide_driver import running, virtual
from tmcm34x import clock
from tmcm34x.bench import simple_rig
from tmcm34x.ide import wire
from tmcm34x.ide.sampling import MOST, PERIOD, TOGETHER, Sampled
from tmcm34x.tmcl.mnemonic import parse_instruction

POSITION, SPEED = 0, 2


def _go(folder, scenario, **options):
    async def run():
        async with running(folder, virtual(**options)) as ide, ide.page() as page:
            await scenario(ide, page)

    asyncio.run(run())


@pytest.mark.parametrize("speed", [1.0, 50.0])
def test_a_trapezoid_is_sampled_at_one_rate_at_any_pace(tmp_path, speed):
    async def scenario(ide, page):
        await page.execute("SAP 5, 0, 100")
        await page.call(wire.SetTime(speed=speed))
        await page.execute("MVP ABS, 0, 20000")
        await page.until(lambda: page.rows and page.rows[-1][1][POSITION] == 20000)
        # Rows of the move: before and behind it, time without events may leap while the machine is busy.
        rows = [(when, values) for when, values in page.rows if 0 < values[POSITION] < 20000]
        times = [when for when, _ in rows]
        assert {later - sooner for sooner, later in itertools.pairwise(times)} == {PERIOD}
        speeds = [values[SPEED] for _, values in rows]
        top = speeds.index(max(speeds))
        assert sorted(speeds[: top + 1]) == speeds[: top + 1]
        assert len({value for value in speeds if value}) > 10

    _go(tmp_path, scenario)


class Rows:
    """Where samples of a bench are taken, after a command, and how many at a time."""

    def __init__(self, *, paced, line="MVP ABS, 0, 8000000"):
        self.rig = simple_rig(343)
        self.rig.modules[0].execute(parse_instruction(line))
        self.taken: list[int] = []
        self.part = Sampled(self.rig, lambda: self.taken.append(self.rig.now), lambda: True, lambda: paced)

    def advance(self, now):
        before = len(self.taken)
        self.part.advance(now)
        return len(self.taken) - before


def test_a_long_way_is_taken_in_parts_of_few_rows_that_get_farther_apart():
    rows, hour = Rows(paced=False), 3600 * clock.HZ
    most = 0
    while (when := rows.part.next_event()) < hour and rows.rig.now < hour:
        most = max(most, rows.advance(when))
    assert rows.rig.now > 60 * clock.HZ
    assert 0 < most <= TOGETHER
    assert len(rows.taken) < rows.rig.now / PERIOD / 4
    assert {when % PERIOD for when in rows.taken} == {0}


@pytest.mark.parametrize("stride", [3, 900])
def test_rows_of_a_paced_way_are_one_period_apart(stride):
    rows, most = Rows(paced=True), 0
    for now in range(0, 9_001 * PERIOD, stride * PERIOD):
        while (when := rows.part.next_event()) <= now:
            most = max(most, rows.advance(when))
        rows.advance(now)
    assert {later - sooner for sooner, later in itertools.pairwise(rows.taken)} == {PERIOD}
    assert most <= TOGETHER


def test_what_was_not_wanted_is_taken_in_one_leap():
    rows, end = Rows(paced=True, line="MST 0"), 100 * MOST * PERIOD
    assert rows.part.next_event() == clock.NEVER
    assert 0 < rows.advance(end) <= MOST + 1
    assert rows.part.next_event() < clock.NEVER
    rows.part.resume()
    assert rows.part.next_event() == clock.NEVER
    assert 0 < rows.advance(2 * end) <= MOST + 1


def test_held_time_makes_no_samples_and_a_step_of_time_does(tmp_path):
    async def scenario(ide, page):
        await page.call(wire.SetTime(paused=True))
        await page.until(lambda: int(page.state["time"]["flags"]) & 1)
        await page.call(wire.Ping())
        before = len(page.rows)
        await page.call(wire.StepTime(100))
        await page.until(lambda: len(page.rows) == before + 5)

    _go(tmp_path, scenario)


def test_without_power_all_is_unknown_and_not_zero(tmp_path):
    async def scenario(ide, page):
        await page.until(lambda: page.rows and page.rows[-1][1][POSITION] == 0)
        await page.call(wire.SetBench("power", 0, 0))
        await page.until(lambda: page.rows[-1][1][POSITION] is None)

    _go(tmp_path, scenario)


def test_watched_parameters_are_sampled_too(tmp_path):
    async def scenario(ide, page):
        await page.execute("SGP 7, 2, 4711")
        await page.call(wire.Watch([wire.Watched(2, 7, 0), wire.Watched(-1, 250, 0)]))
        await page.until(lambda: page.rows and list(page.rows[-1][1].values())[-2:] == [4711, None])

    _go(tmp_path, scenario)
