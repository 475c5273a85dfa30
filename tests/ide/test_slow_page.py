from __future__ import annotations

import asyncio

from ide.ide_driver import running
from tmcm34x.ide import wire


def test_a_page_that_does_not_read_is_cut_off_and_slows_nobody(tmp_path):
    async def scenario():
        async with running(tmp_path) as ide, ide.page() as page:
            await page.execute("ROR 0, 2000")
            async with ide.socket(max_queue=1) as sleeper:
                await sleeper.recv()
                await page.until(lambda: len(ide.hub.pages) == 2)
                text = "x" * 100_000
                sent = 0
                while len(ide.hub.pages) == 2:
                    ide.hub.tell(wire.Output("information", text))
                    sent += 1
                    await page.event(wire.Output)
                    assert sent < 1000
                position = page.state["motor0"]["position"]
                await page.until(lambda: page.state["motor0"]["position"] > position)

    asyncio.run(scenario())


def test_an_idle_page_is_sent_little(tmp_path):
    async def scenario():
        async with running(tmp_path) as ide, ide.page(rate_hz=20) as page:
            await page.until(lambda: len(page.frames) >= 2)
            await page.call(wire.SetTime(paused=True))
            await page.until(lambda: int(page.state["time"]["flags"]) & 1)
            count = len(page.frames)
            await asyncio.sleep(0.3)  # six frames, if they were sent
            assert len(page.frames) <= count + 1

    asyncio.run(scenario())
