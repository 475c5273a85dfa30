"""Motors turned by hand: none goes on turning when the hand is gone."""

from __future__ import annotations

import asyncio

from ide.ide_driver import running, virtual
from tmcm34x.ide import wire


def _go(folder, scenario, **options):
    async def run():
        async with running(folder, virtual(**options)) as ide, ide.page() as page:
            await scenario(ide, page)

    asyncio.run(run())


def _turns(page, motor, speed):
    return page.until(lambda: page.state[f"motor{motor}"]["speed"] == speed)


def test_a_held_button_turns_the_motor_and_is_sent_once(tmp_path):
    async def scenario(ide, page):
        for _ in range(3):
            await page.call(wire.Jog(1, -300))
        await _turns(page, 1, -300)
        await page.call(wire.Jog(1, 0))
        await _turns(page, 1, 0)
        await page.call(wire.Jog(1, 0))
        await page.call(wire.FollowLog(True))
        lines = (await page.event(wire.Telegrams)).lines
        sent = [line.text.partition("  ")[0] for line in lines if line.direction == "in"]
        assert sent == ["ROL 1, 300", "MST 1"]

    _go(tmp_path, scenario)


def test_a_motor_stops_when_its_page_is_closed(tmp_path):
    async def scenario(ide, page):
        async with ide.page() as other:
            await other.call(wire.Jog(2, 400))
            await _turns(page, 2, 400)
        await _turns(page, 2, 0)

    _go(tmp_path, scenario)


def test_a_motor_stops_when_its_page_says_nothing_more(tmp_path):
    async def scenario(ide, page):
        await page.call(wire.Jog(0, 400))
        await _turns(page, 0, 400)
        await _turns(page, 0, 0)

    _go(tmp_path, scenario)


def test_what_no_motor_can_do_is_refused(tmp_path):
    async def scenario(ide, page):
        assert await page.refusal(wire.Jog(3, 100)) == "range"
        assert await page.refusal(wire.Jog(0, 2048)) == "range"

    _go(tmp_path, scenario)


def test_a_motor_that_cannot_be_told_to_stop_is_told_again_until_it_answers(tmp_path):
    async def scenario(ide, page):
        await page.call(wire.Jog(0, 400))
        await _turns(page, 0, 400)
        await page.call(wire.SetBench("line", 0, 0))
        await page.call(wire.Jog(0, 0))
        told = await page.event(wire.Output)
        assert told.severity == "error"
        assert "unplugged" in told.text
        await page.call(wire.SetBench("line", 0, 1))
        await _turns(page, 0, 0)
        assert "is stopped" in (await page.event(wire.Output)).text

    _go(tmp_path, scenario)


def test_a_motor_that_does_not_hear_is_told_of(tmp_path):
    async def scenario(ide, page):
        await page.call(wire.SetBench("line", 0, 0))
        assert await page.refusal(wire.Jog(0, 400)) == "module"

    _go(tmp_path, scenario)
