"""Export, import, store, download and upload of the IDE on bad lines: complete, or they say that they are not."""

from __future__ import annotations

import asyncio
import re

import pytest

from ide.ide_driver import real, running
from ide.served import Bench
from tmcm34x.ide import remote, wire
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.numbers import CONTROL

PROGRAM = "Loop: ROR 0, 300\n" + "WAIT TICKS, 0, 1\n" * 60 + "JA Loop\n"
DAMAGED = "bad_checksum,probability=0.077"
"""One reply in thirteen."""
STORED = [wire.Watched(-1, 4, motor) for motor in range(3)]


@pytest.fixture(autouse=True)
def nothing_is_polled(monkeypatch):
    """What strikes one telegram in so many strikes those of the test."""
    monkeypatch.setattr(remote, "LOOKED_AT_S", -1.0)


def _go(folder, scenario, model=343):
    (folder / "a.tmc").write_text(PROGRAM)
    bench = Bench(model, seed=5)

    async def run():
        remote, telegrams = await real(f"tcp:{bench.address}")
        async with running(folder, (remote, telegrams)) as ide, ide.page(rate_hz=0) as page:
            await scenario(bench, page)

    try:
        asyncio.run(run())
    finally:
        bench.stop()


def _errors(page):
    return [
        event.text for event in page.events if isinstance(event, wire.Output) and event.severity == "error"
    ]


async def _kept(page, items):
    await page.call(wire.Keep("store", items, sure=True))
    return await page.event(wire.MotionEnded)


def test_one_damaged_reply_in_thirteen_leaves_everything_complete(tmp_path):
    async def scenario(bench, page):
        await page.execute("SAP 4, 1, 777")
        bench.arm(DAMAGED)
        text = await page.call(wire.ExportSettings("toml"))
        assert (_errors(page), text.startswith("# Settings of"), "max_speed = 777" in text) == (
            [],
            True,
            True,
        )
        bench.do(lambda: bench.module.axes[1].values.update({4: 1}))
        imported = await page.call(wire.ImportSettings(text.encode()))
        assert (imported["count"] > 60, imported["refused"]) == (True, [])
        assert (await _kept(page, STORED)).complete
        assert bench.module.eeprom.axis_values[1][4] == 777
        listing = (await page.call(wire.Download("a.tmc")))["listing"]
        bench.do(bench.faults.clear)
        again = await page.call(wire.Assemble("b.tmc", {"b.tmc": await page.call(wire.Upload())}))
        assert again["listing"]["identity"] == listing["identity"]
        assert bench.faults.struck["bad_checksum"] > 20

    _go(tmp_path, scenario)


def test_a_silent_module_is_no_empty_one(tmp_path):
    async def scenario(bench, page):
        text = await page.call(wire.ExportSettings("tmcl"))
        await page.execute("SAP 4, 0, 1")
        bench.arm("silent")
        assert "INCOMPLETE" in (await page.call(wire.ExportSettings("toml"))).splitlines()[0]
        assert "not complete" in _errors(page)[0]
        for call in (wire.ImportSettings(text.encode()), wire.Download("a.tmc"), wire.Upload()):
            assert await page.refusal(call) == "module"
        ended = await _kept(page, STORED)
        assert (ended.complete, bool(ended.text)) == (False, True)
        assert bench.module.eeprom.axis_values[0].get(4) != 1

    _go(tmp_path, scenario)


@pytest.mark.parametrize(
    "call", [wire.ExportSettings("toml"), wire.Download("a.tmc")], ids=["export", "download"]
)
def test_a_line_that_is_lost_in_the_middle_ends_in_no_success(tmp_path, call):
    async def scenario(bench, page):
        await page.execute("GAP 4, 0")
        bench.arm("unplug,after=30")
        answer = await page.ask(call)
        if isinstance(answer, wire.Refusal):
            assert (answer.code, "the line was lost" in answer.text) == ("module", True)
        else:
            assert "INCOMPLETE" in answer.result.splitlines()[0]

    _go(tmp_path, scenario)


def test_an_import_on_a_line_that_is_lost_says_how_much_is_set(tmp_path):
    async def scenario(bench, page):
        text = await page.call(wire.ExportSettings("toml"))
        bench.arm("unplug,after=30")
        answer = await page.ask(wire.ImportSettings(text.encode()))
        assert answer.code == "module"
        assert answer.text.startswith("The import is not complete: ")
        assert re.search(r"\d+ of \d+ values are set, the others are not\.$", answer.text)

    _go(tmp_path, scenario)


def test_an_upload_on_a_line_that_is_lost_gives_no_program(tmp_path):
    async def scenario(bench, page):
        await page.call(wire.Download("a.tmc"))
        bench.arm("unplug,after=20")
        answer = await page.ask(wire.Upload())
        assert (answer.code, "the line was lost" in answer.text) == ("module", True)

    _go(tmp_path, scenario)


def test_storing_on_a_line_that_is_lost_is_no_success(tmp_path):
    async def scenario(bench, page):
        await page.execute("SAP 4, 1, 777")
        bench.arm("unplug,after=1")
        ended = await _kept(page, STORED)
        assert (ended.complete, bool(ended.text)) == (False, True)
        assert bench.module.eeprom.axis_values[2].get(4) != 777

    _go(tmp_path, scenario)


def test_settings_of_another_model_are_taken_over_only_on_request(tmp_path):
    async def scenario(bench, page):
        text = (await page.call(wire.ExportSettings("toml"))).replace("TMCM-343", "TMCM-341")
        text = text.replace("model = 343", "model = 341").replace("max_speed = 1000", "max_speed = 555")
        answer = await page.ask(wire.ImportSettings(text.encode()))
        assert (answer.code, "TMCM-341" in answer.text) == ("confirm", True)
        assert bench.module.axes[0].values[4] == 1000
        assert (await page.call(wire.ImportSettings(text.encode(), sure=True)))["refused"] == []
        assert bench.module.axes[0].values[4] == 555

    _go(tmp_path, scenario)


def test_a_module_in_download_mode_is_named_and_freed_by_a_download(tmp_path):
    async def scenario(bench, page):
        await page.execute("GAP 4, 0")
        bench.do(lambda: bench.module.execute(Instruction(CONTROL.START_DOWNLOAD, value=100)))
        answer = await page.ask(wire.Upload())
        assert isinstance(answer, wire.Refusal)
        answer = await page.ask(wire.ExportSettings("toml"))
        assert isinstance(answer, wire.Refusal) and "tmcm34x stop" in answer.text
        assert bench.module.program.memory.read(100).number == 0, "no question was stored"
        assert (await page.call(wire.Download("a.tmc", replace=True)))["listing"]
        assert "download mode" in (await page.event(wire.Output, lambda event: "133" in event.text)).text
        assert not bench.module.program.downloading

    _go(tmp_path, scenario)
