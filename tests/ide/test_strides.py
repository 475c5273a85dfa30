"""Steps of the arrows: presses in quick succession add up, and never to what something else has asked for."""

from __future__ import annotations

import asyncio

import pytest

from ide.ide_driver import real, running, virtual
from ide.served import Bench
from tmcm34x.host import Connection
from tmcm34x.ide import wire
from tmcm34x.tmcl.mnemonic import parse_instruction

PACE_S = 0.02


def _go(folder, scenario):
    async def run():
        async with running(folder, virtual()) as ide, ide.page() as page:
            await scenario(page)

    asyncio.run(run())


async def _asked(page, line, holds):
    """Ask until the value is so; not so often that the log has room for these questions only."""
    while not holds(value := (await page.execute(line))["value"]):
        await asyncio.sleep(PACE_S)
    return value


async def _rest(page, motor=0):
    """The position of a motor, once the module says that it stands."""
    await _asked(page, f"GAP 3, {motor}", lambda speed: speed == 0)
    return (await page.execute(f"GAP 1, {motor}"))["value"]


async def _arrived(page, motor=0):
    """The same, once it is at its target."""
    await _asked(page, f"GAP 8, {motor}", bool)
    return await _rest(page, motor)


async def _passed(page, place, motor=0):
    """Wait until a motor is so far."""
    await _asked(page, f"GAP 1, {motor}", lambda position: position >= place)


async def _sent(page, mnemonic):
    """How often a command was sent, as the log has it."""
    await page.call(wire.FollowLog(True))
    lines = (await page.event(wire.Telegrams)).lines
    return sum(line.direction == "in" and line.text.startswith(mnemonic) for line in lines)


def test_steps_to_a_moving_motor_add_up(tmp_path):
    async def scenario(page):
        for distance in (1000, 1000, 1000, -500, 1000):
            await page.call(wire.Stride(0, distance))
        assert await _arrived(page) == 3500

    _go(tmp_path, scenario)


def test_steps_at_the_same_time_add_up(tmp_path):
    async def scenario(page):
        await asyncio.gather(*(page.call(wire.Stride(2, 700)) for _ in range(6)))
        assert await _arrived(page, 2) == 4200

    _go(tmp_path, scenario)


def test_a_step_after_a_stop_counts_from_where_the_motor_stands(tmp_path):
    async def scenario(page):
        await page.call(wire.Stride(1, 4_000_000))
        await _passed(page, 500, 1)
        await page.execute("MST 1")
        place = await _rest(page, 1)
        assert 500 <= place < 4_000_000
        await page.call(wire.Stride(1, 100))
        assert await _arrived(page, 1) == place + 100

    _go(tmp_path, scenario)


@pytest.mark.parametrize("other", ["MVP ABS, 0, 6000000", "SAP 0, 0, 6000000", "ROR 0, 100"])
def test_a_step_adds_to_steps_only(tmp_path, other):
    async def scenario(page):
        await page.call(wire.Stride(0, 4_000_000))
        await page.execute(other)
        await page.call(wire.Stride(0, 300))
        assert await _arrived(page) < 4_000_000
        assert await _sent(page, "MVP REL") == 2

    _go(tmp_path, scenario)


def test_steps_against_a_closed_switch_do_not_add_up(tmp_path):
    async def scenario(page):
        await page.call(wire.SetBench("right", 0, 1))
        for _ in range(5):
            await page.call(wire.Stride(0, 300))
        assert (await page.execute("GAP 0, 0"))["value"] == 300
        await page.call(wire.Stride(0, -200))
        assert await _arrived(page) == -200

    _go(tmp_path, scenario)


def test_steps_of_a_group_go_to_all_its_motors(tmp_path):
    async def scenario(page):
        await page.execute("MVP ABS, 1, 5000")
        assert await _arrived(page, 1) == 5000
        for line in ("SAP 213, 0, 1", "SAP 213, 1, 1"):
            await page.execute(line)
        for end in (200, 400):
            await page.call(wire.Stride(0, 200))
            assert (await _arrived(page), await _arrived(page, 1)) == (end, 5000 + end)
        assert await _sent(page, "MVP REL") == 2

    _go(tmp_path, scenario)


def test_steps_end_with_stop_all(tmp_path):
    async def scenario(page):
        steps = [asyncio.create_task(page.ask(wire.Stride(0, 200_000))) for _ in range(4)]
        await page.call(wire.StopAll())
        await asyncio.gather(*steps)
        await page.event(wire.Authority, lambda event: event.latched and not event.doubts)
        assert await page.refusal(wire.Stride(0, 100)) == "latched"
        await page.call(wire.Release())
        place = await _rest(page)
        await page.call(wire.Stride(0, 100))
        assert await _arrived(page) == place + 100

    _go(tmp_path, scenario)


def test_a_step_without_meaning_is_refused(tmp_path):
    async def scenario(page):
        for call in (wire.Stride(3, 1), wire.Stride(-1, 1), wire.Stride(0, 1 << 24)):
            assert await page.refusal(call) == "range"
        await page.call(wire.Stride(0, 1 << 23 >> 1))
        await page.execute("SAP 1, 0, 8388000")
        assert await page.refusal(wire.Stride(0, 1 << 22)) == "module"

    _go(tmp_path, scenario)


def test_steps_of_a_real_module_add_up_beside_another_host(tmp_path):
    bench = Bench()

    async def run():
        remote = await real(f"tcp://{bench.address}")
        async with running(tmp_path, remote) as ide, ide.page() as page:
            assert await page.refusal(wire.Stride(0, 100)) == "disarmed"
            await page.call(wire.Arm(True))
            for _ in range(4):
                await page.call(wire.Stride(0, 2000))
            assert await _arrived(page) == 8000
            with Connection.open(f"tcp://{bench.address}") as host:
                host.ask(parse_instruction("MVP ABS, 0, -90000"))
            await _asked(page, "GAP 1, 0", lambda position: position < 7000)
            await page.call(wire.Stride(0, 100))
            assert await _arrived(page) < 7100

    try:
        asyncio.run(run())
    finally:
        bench.stop()
