"""The authority over motion: what starts a motion, what ends it, and how its motors come to rest."""

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
        assert sent[0] == "ROL 1, 300"
        assert set(sent[1:]) == {"MST 1"}

    _go(tmp_path, scenario)


def test_a_motor_stops_when_its_page_is_closed(tmp_path):
    async def scenario(ide, page):
        async with ide.page() as other:
            await other.call(wire.Jog(2, 400))
            await _turns(page, 2, 400)
        await _turns(page, 2, 0)

    _go(tmp_path, scenario)


def test_a_motor_stops_when_its_page_says_nothing_more(tmp_path, monkeypatch):
    monkeypatch.setattr("tmcm34x.ide.under_way.JOG_PATIENCE_S", 0.3)

    async def scenario(ide, page):
        await page.call(wire.Jog(0, 400))
        await page.until(lambda: page.state["motor0"]["position"] > 0 and page.state["motor0"]["speed"] == 0)
        assert ide.hub.authority.shape.motions == []

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
        await page.event(
            wire.Authority, lambda event: any("unplugged" in doubt.why for doubt in event.doubts)
        )
        await page.call(wire.SetBench("line", 0, 1))
        await _turns(page, 0, 0)
        await page.event(wire.Authority, lambda event: not event.doubts)

    _go(tmp_path, scenario)


def test_a_motor_that_does_not_hear_is_told_of(tmp_path):
    async def scenario(ide, page):
        await page.call(wire.SetBench("line", 0, 0))
        assert await page.refusal(wire.Jog(0, 400)) == "module"

    _go(tmp_path, scenario)


async def _ended(page, kind):
    return await page.event(wire.MotionEnded, lambda event: event.kind == kind)


def test_a_motor_is_zeroed_where_it_comes_to_rest(tmp_path):
    async def scenario(ide, page):
        await page.execute("ROR 0, 500")
        await _turns(page, 0, 500)
        await page.call(wire.Zero(0))
        ended = await _ended(page, "zero")
        assert ended.complete, ended.text
        axis = ide.virtual.module.axes[0]
        assert ide.virtual.world.mounts[0].view().position > 0
        assert [(await page.execute(f"GAP {n}, 0"))["value"] for n in (0, 1, 3)] == [0, 0, 0]
        assert axis.at_target

    _go(tmp_path, scenario)


def test_a_load_profile_measures_each_velocity_and_ends_at_rest(tmp_path):
    async def scenario(ide, page):
        await page.call(wire.SetTime(speed=20.0))
        await page.call(wire.Profile(1, 200, 400, 100))
        points = [await page.event(wire.ProfilePoint) for _ in range(3)]
        assert [(point.motor, point.velocity) for point in points] == [(1, 200), (1, 300), (1, 400)]
        assert (await _ended(page, "profile")).complete
        await _turns(page, 1, 0)

    _go(tmp_path, scenario)


def test_stop_all_ends_a_profile_and_holds_until_it_is_released(tmp_path):
    async def scenario(ide, page):
        await page.call(wire.Profile(0, 100, 2000, 50))
        await page.event(wire.ProfilePoint)
        await page.call(wire.StopAll())
        first = await page.event(wire.Authority, lambda event: event.latched)
        assert [doubt.motor for doubt in first.doubts] == [-1, 0, 1, 2]
        assert not (await _ended(page, "profile")).complete
        latched = await page.event(wire.Authority, lambda event: event.latched and not event.doubts)
        assert latched.motions == []
        await _turns(page, 0, 0)
        for call in (
            wire.Jog(0, 100),
            wire.Zero(0),
            wire.ExecuteText("ROR 0, 100"),
            wire.ExecuteText("SAP 0, 0, 9"),
        ):
            assert await page.refusal(call) == "latched"
        await page.call(wire.Release())
        await page.call(wire.Jog(0, 100))
        await _turns(page, 0, 100)

    _go(tmp_path, scenario)


def test_what_belongs_to_a_closed_window_comes_to_rest(tmp_path):
    async def scenario(ide, page):
        async with ide.page() as other:
            await other.call(wire.Turn(1, -700))
            await _turns(page, 1, -700)
        assert "closed" in (await _ended(page, "turn")).text
        await _turns(page, 1, 0)

    _go(tmp_path, scenario)


def test_what_belongs_to_a_silent_window_comes_to_rest(tmp_path, monkeypatch):
    monkeypatch.setattr("tmcm34x.ide.under_way.PATIENCE_S", 0.3)

    async def scenario(ide, page):
        async with ide.page() as other:
            await other.call(wire.Turn(1, 700))
            assert "silent" in (await _ended(page, "turn")).text
            await _turns(page, 1, 0)

    _go(tmp_path, scenario)


def test_the_next_command_of_a_person_takes_the_motor_away(tmp_path):
    async def scenario(ide, page):
        await page.call(wire.Turn(2, 700))
        await _turns(page, 2, 700)
        async with ide.page() as other:
            await other.execute("ROL 2, 300")
            await _ended(page, "turn")
            await _turns(page, 2, -300)
            assert ide.hub.authority.shape.motions == []

    _go(tmp_path, scenario)


def test_a_motion_is_aborted_by_its_number_from_any_window(tmp_path):
    async def scenario(ide, page):
        number = await page.call(wire.Turn(2, 700))
        await _turns(page, 2, 700)
        async with ide.page() as other:
            (motion,) = ide.hub.authority.shape.motions
            assert motion.number == number
            await other.call(wire.Abort(number))
        await _turns(page, 2, 0)
        await page.call(wire.Abort(number))

    _go(tmp_path, scenario)


def test_a_reference_search_that_is_ended_is_stopped_in_the_module_too(tmp_path):
    async def scenario(ide, page):
        number = await page.call(wire.Search(0))
        await page.until(lambda: page.state["motor0"]["search"] > 0)
        await page.call(wire.Abort(number))
        await page.until(lambda: page.state["motor0"]["search"] == 0 and page.state["motor0"]["speed"] == 0)

    _go(tmp_path, scenario)


def test_motors_go_to_a_stored_coordinate(tmp_path):
    async def scenario(ide, page):
        for motor, position in enumerate((1500, -700)):
            await page.execute(f"SCO 3, {motor}, {position}")
        await page.call(wire.Go(3, [0, 1]))
        assert (await _ended(page, "go")).complete
        await page.until(lambda: [page.state[f"motor{n}"]["position"] for n in (0, 1)] == [1500, -700])
        assert await page.refusal(wire.Go(3, [])) == "range"

    _go(tmp_path, scenario)


def test_storing_tells_how_far_it_came(tmp_path):
    async def scenario(ide, page):
        items = [wire.Watched(-1, 4, 0), wire.Watched(-1, 4, 1), wire.Watched(2, 7, 0)]
        await page.call(wire.Keep("store", items))
        ended = await _ended(page, "store")
        assert (ended.complete, ended.text) == (True, "3 values are stored in the EEPROM.")
        await page.call(wire.Keep("store", [*items, wire.Watched(-1, 1, 0), *items]))
        ended = await _ended(page, "store")
        assert not ended.complete
        assert ended.text.startswith("STAP 1, 0: status 3, ")
        assert ended.text.endswith("; 3 of 7 values are stored in the EEPROM, the others are not.")

    _go(tmp_path, scenario)


def test_what_cannot_be_undone_is_sent_only_when_it_is_confirmed(tmp_path):
    async def scenario(ide, page):
        for line in ("SGP 81, 0, 3", "SGP 66, 0, 9", "SGP 64, 0, 1", "SGP 6, 0, 0"):
            assert await page.refusal(wire.ExecuteText(line)) == "confirm"
        assert await page.refusal(wire.Execute(137, value=1234)) == "confirm"
        assert (await page.execute("GGP 66, 0"))["value"] == 1
        await page.call(wire.ExecuteText("SGP 81, 0, 3", sure=True))
        assert (await page.execute("GGP 81, 0"))["value"] == 3

    _go(tmp_path, scenario)
