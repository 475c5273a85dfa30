"""Bench files in the editor, and the example gallery, through the server."""

from __future__ import annotations

import asyncio

from ide.ide_driver import running
from tmcm34x.ide import wire


def _go(folder, scenario):
    async def run():
        async with running(folder) as ide, ide.page() as page:
            await scenario(ide, page)

    asyncio.run(run())


def test_every_example_can_be_opened_with_its_bench_and_has_no_errors(tmp_path):
    async def scenario(ide, page):
        examples = await page.call(wire.ListExamples())
        programs = {each["path"]: each for each in examples["programs"]}
        assert {"three_axes.tmc", "homing.tmc", "manual/5.2-first-program.tmc"} <= programs.keys()
        assert programs["homing.tmc"]["bench"] == "benches/xy-stage.toml"
        assert all(each["title"] and each["text"] for each in examples["programs"])
        for path, each in programs.items():
            texts = {path: await page.call(wire.ReadExample(path))}
            for name in each["includes"]:
                texts[name] = await page.call(wire.ReadExample(name))
            found = await page.call(wire.Assemble(path, texts))
            assert [p for p in found["problems"] if p["severity"] == "error"] == [], path
        for bench in examples["benches"]:
            text = await page.call(wire.ReadExample(bench["path"]))
            assert await page.call(wire.CheckBench(bench["path"], text)) == {"bench": True, "problems": []}
        for path in ("../pyproject.toml", "nowhere.tmc", "/etc/passwd", "hosts/driver.py"):
            assert await page.refusal(wire.ReadExample(path)) == "path"

    _go(tmp_path, scenario)


def test_a_bench_is_checked_and_completed_as_it_is_written(tmp_path):
    async def scenario(ide, page):
        text = "[[module]]\nmodel = 340\n"
        found = await page.call(wire.CheckBench("b.toml", text))
        (mistake,) = found["problems"]
        assert (mistake["place"]["line"], mistake["place"]["column"]) == (2, 9)
        assert not (await page.call(wire.CheckBench("settings.toml", "model = 343\n")))["bench"]
        proposed = await page.call(wire.CompleteBench(text, 2, 9))
        assert [each["text"] for each in proposed] == ["341", "342", "343"]

    _go(tmp_path, scenario)
