"""What pages ask about a program and its module: flow, coverage, differences, registers, the source of a program."""

from __future__ import annotations

import asyncio

from ide.ide_driver import running, virtual
from tmcm34x.ide import wire
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.toolchain.assembler import assemble

PROGRAM = """\
        SGP 3, 2, 10
Loop:   GGP 3, 2
        CALC SUB, 1
        AGP 3, 2
        COMP 0
        JC GT, Loop
        CSUB Rest
        STOP
Rest:   WAIT TICKS, 0, 1
        RSUB
"""


def _go(folder, scenario, text=PROGRAM, **options):
    (folder / "program.tmc").write_text(text)

    async def run():
        async with running(folder, virtual(**options)) as ide, ide.page() as page:
            await scenario(ide, page)

    asyncio.run(run())


def test_the_map_of_a_program_has_routines_variables_and_labels(tmp_path):
    async def scenario(ide, page):
        found = await page.call(wire.ReadMap("program.tmc"))
        assert (found["path"], found["instructions"], found["stack"]) == ("program.tmc", 11, 1)
        rows = {row["name"]: row for row in found["routines"]}
        assert (rows["start"]["line"], rows["start"]["calls"], rows["start"]["longest"]) == (
            1,
            ["Rest"],
            None,
        )
        assert (rows["Rest"]["line"], rows["Rest"]["instructions"], rows["Rest"]["longest"]) == (9, 2, 1)
        (variable,) = found["variables"]
        assert variable["number"] == 3
        assert [site["line"] for site in variable["writers"]] == [1, 4]
        assert [site["line"] for site in variable["readers"]] == [2]
        assert [(label["name"], label["address"]) for label in found["labels"]] == [("Loop", 1), ("Rest", 8)]
        assert await page.call(wire.ReadMap("program.tmc", {"program.tmc": "SAP"})) is None

    _go(tmp_path, scenario)


def test_the_map_names_the_files_of_an_included_routine(tmp_path):
    (tmp_path / "rest.inc").write_text("Rest: GGP 3, 2\nRSUB\n")

    async def scenario(ide, page):
        found = await page.call(wire.ReadMap("program.tmc"))
        rows = {row["name"]: row for row in found["routines"]}
        assert (rows["Rest"]["path"], rows["Rest"]["line"]) == ("rest.inc", 1)
        assert found["variables"][0]["readers"] == [{"path": "rest.inc", "line": 1}]

    _go(tmp_path, scenario, 'CSUB Rest\nSTOP\n#include "rest.inc"\n')


def test_what_the_live_program_executes_is_counted_by_line(tmp_path):
    async def scenario(ide, page):
        assert await page.call(wire.ReadCoverage()) == []
        await page.call(wire.Cover(True))
        await page.call(wire.Download("program.tmc", run=True))
        program = ide.virtual.module.program
        await page.until(lambda: program.counts.executed[7] and not page.state["program"]["state"])
        rows = {row["line"]: row for row in await page.call(wire.ReadCoverage())}
        assert [rows[line]["executed"] for line in range(1, 11)] == [1, 10, 10, 10, 10, 10, 1, 1, 1, 1]
        assert (rows[6]["jumped"], rows[5]["jumped"]) == (9, None)
        await page.call(wire.Download("program.tmc", {"program.tmc": "STOP\n"}))
        assert [row["executed"] for row in await page.call(wire.ReadCoverage())] == [0]
        await page.call(wire.Cover(False))
        assert await page.call(wire.ReadCoverage()) == []

    _go(tmp_path, scenario, speed=0)


def test_a_tracefile_of_a_run_is_read(tmp_path):
    text = "TN:\nSF:program.tmc\nBRDA:6,0,0,9\nBRDA:6,0,1,1\nDA:1,1\nDA:6,10\nend_of_record\n"

    async def scenario(ide, page):
        rows = await page.call(wire.ReadTracefile(text.encode()))
        assert rows == [
            {"path": "program.tmc", "line": 1, "executed": 1, "jumped": None},
            {"path": "program.tmc", "line": 6, "executed": 10, "jumped": 9},
        ]
        assert await page.refusal(wire.ReadTracefile(b"Loop: JA Loop")) == "text"

    _go(tmp_path, scenario)


def test_the_text_on_screen_is_compared_with_its_file(tmp_path):
    async def scenario(ide, page):
        texts = {"program.tmc": "STOP\n// new\nCSUB x\n"}
        found = await page.call(wire.Compare("program.tmc", "disk", texts))
        assert not found["same"]
        rows = [(row["kind"], row["left"], row["right"]) for row in found["rows"]]
        assert rows == [("same", 1, 1), ("changed", 2, 2), ("new", -1, 3), ("same", 3, 4)]
        assert (await page.call(wire.Compare("program.tmc", "disk")))["same"]
        assert await page.refusal(wire.Compare("nothing.tmc", "disk")) == "file"

    _go(tmp_path, scenario, "STOP\nCSUB y\n")


def test_the_program_on_screen_is_compared_with_the_one_in_the_module_and_adopted_where_it_is_the_same(
    tmp_path,
):
    async def scenario(ide, page):
        ide.virtual.module.eeprom.write_program(assemble("ROR 0, 100\nSTOP\n").program)
        found = await page.call(wire.Compare("program.tmc", "module", {"program.tmc": "ROR 0, 200\nSTOP\n"}))
        assert not found["same"]
        assert [(row["kind"], row["left_text"], row["right_text"]) for row in found["rows"]] == [
            ("changed", "ROR 0, 100", "ROR 0, 200"), ("same", "STOP", "STOP"),
        ]  # fmt: skip
        other = {"mine.tmc": "ROR 0, 100 // mine"}
        assert (await page.call(wire.Compare("mine.tmc", "module", other)))["same"]
        loaded = await page.event(
            wire.Loaded, lambda event: event.listing and event.listing.path == "mine.tmc"
        )
        assert loaded.listing.lines[0].line == 1
        assert await page.refusal(wire.Compare("mine.tmc", "module", {"mine.tmc": "X"})) == "errors"

    _go(tmp_path, scenario)


def test_options_choose_the_model_and_the_stop_at_the_end(tmp_path):
    async def scenario(ide, page):
        async def lines(**options):
            answer = await page.call(wire.Assemble("program.tmc", options=wire.BuildOptions(**options)))
            return [row["text"] for row in answer["listing"]["lines"]]

        assert await lines() == ["ROR 0, 343", "STOP"]
        assert await lines(append_stop=False) == ["ROR 0, 343"]
        assert await lines(model=342, append_stop=False) == ["ROR 0, 342"]

    _go(tmp_path, scenario, "#if MODEL == 342\nROR 0, 342\n#else\nROR 0, 343\n#endif\n")


def test_another_host_s_program_is_recognised_by_the_text_in_the_folder_that_makes_it(tmp_path):
    (tmp_path / "other.tmc").write_text("// theirs\nROR 1, 77\n")

    async def scenario(ide, page):
        await page.call(wire.Download("program.tmc"))
        ide.virtual.module.eeprom.write_program([*assemble("ROR 1, 77\nSTOP\n").program, Instruction(0)])
        loaded = await page.event(wire.Loaded, lambda event: event.by_other_host)
        assert loaded.listing.path == "other.tmc"
        assert next((line.path, line.line) for line in loaded.listing.lines) == ("other.tmc", 2)
        ide.virtual.module.eeprom.write_program([*assemble("ROR 2, 5\nSTOP\n").program, Instruction(0)])
        loaded = await page.event(wire.Loaded, lambda event: event.by_other_host)
        assert (loaded.listing.path, [line.text for line in loaded.listing.lines]) == (
            "",
            ["ROR 2, 5", "STOP"],
        )
        ide.virtual.module.eeprom.write_program([Instruction(0)])
        assert (await page.event(wire.Loaded, lambda event: event.by_other_host)).listing is None

    _go(tmp_path, scenario)


def test_breakpoints_hold_in_a_program_that_another_host_has_stored(tmp_path):
    (tmp_path / "other.tmc").write_text("Loop: CALC ADD, 1\nJA Loop\n")

    async def scenario(ide, page):
        ide.virtual.module.eeprom.write_program([*assemble("Loop: CALC ADD, 1\nJA Loop\nSTOP\n").program])
        await page.event(wire.Loaded, lambda event: event.listing and event.listing.path == "other.tmc")
        async with ide.debugger() as editor:
            (placed,) = await editor.breakpoints("other.tmc", {"line": 2})
            assert placed["verified"]
            await page.call(wire.ControlProgram("run"))
            assert (await editor.event("stopped"))["reason"] == "breakpoint"

    _go(tmp_path, scenario)


def test_the_registers_of_the_chips_are_looked_at_without_acting(tmp_path):
    async def scenario(ide, page):
        await page.execute("SAP 4, 1, 1234")
        ide.virtual.server.change_pace(paused=True)
        before = ide.virtual.module.digest()
        rows = await page.call(wire.ReadRegisters())
        assert ide.virtual.module.digest() == before
        own = [row for row in rows if row["motor"] >= 0]
        assert len(own) == 3 * 16
        (row,) = [row for row in rows if (row["name"], row["motor"]) == ("V_MAX", 1)]
        assert (row["value"], row["section"]) == (1234, "8.1.4")
        (smgp,) = [row for row in rows if row["name"] == "SMGP"]
        assert smgp["motor"] == -1
        assert {field["name"]: field["value"] for field in smgp["fields"]}["LSMD"] == 2

    _go(tmp_path, scenario)
