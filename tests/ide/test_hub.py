from __future__ import annotations

import asyncio
import threading
from pathlib import Path

import pytest

from ide.ide_driver import running, virtual
from tmcm34x import clock
from tmcm34x.ide import calls, hub, wire
from tmcm34x.ide.motions import BEGIN
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.toolchain.assembler import assemble

PROGRAM = """\
        ROR 0, 500
Loop:   CALC ADD, 1
        CSUB Rest
        JA Loop
Rest:   WAIT TICKS, 0, 1
        RSUB
"""


def _go(folder: Path, scenario, **more):
    async def run():
        async with running(folder, virtual(**more)) as ide, ide.page() as page:
            await scenario(ide, page)

    asyncio.run(run())


def _write(folder: Path, text: str = PROGRAM) -> str:
    (folder / "program.tmc").write_text(text)
    return "program.tmc"


def test_each_call_is_done_in_one_place():
    assert sorted([*calls.METHODS, *BEGIN], key=str) == sorted(wire.CALLS, key=str)


def test_a_command_is_shown_with_its_telegrams(tmp_path):
    async def scenario(ide, page):
        exchange = await page.execute("ROR 0, 350")
        assert exchange["sent"] == "01 01 00 00 00 00 01 5e 61"
        assert exchange["received"] == "02 01 64 01 00 00 01 5e c7"
        assert (exchange["status"], exchange["value"]) == (100, 350)

    _go(tmp_path, scenario)


def test_a_page_sees_the_motor_turn(tmp_path):
    async def scenario(ide, page):
        await page.execute("ROR 2, 500")
        await page.until(
            lambda: page.state["motor2"]["speed"] == 500 and page.state["motor2"]["position"] > 100
        )
        assert page.state["motor2"]["angle"] != 0
        await page.execute("MST 2")
        await page.until(lambda: page.state["motor2"]["speed"] == 0)

    _go(tmp_path, scenario)


def test_download_and_run_starts_the_program_and_all_windows_hear_of_it(tmp_path):
    path = _write(tmp_path)

    async def scenario(ide, page):
        async with ide.page() as other:
            answer = await page.call(wire.Download(path, run=True))
            assert len(answer["listing"]["lines"]) == 7  # with the appended STOP
            loaded = await other.event(wire.Loaded)
            assert loaded.listing is not None
            assert loaded.listing.lines[2].line == 3
            await other.until(
                lambda: other.state["program"]["state"] == 1 and other.state["motor0"]["speed"] == 500
            )

    _go(tmp_path, scenario)


def test_what_is_on_screen_is_assembled_before_what_is_on_disk(tmp_path):
    path = _write(tmp_path)
    (tmp_path / "words.inc").write_text("Speed = 1\n")

    async def scenario(ide, page):
        texts = {path: "#include words.inc\nROR 0, Speed\nSTOP\n", "words.inc": "Speed = 77\n"}
        answer = await page.call(wire.Assemble(path, texts))
        assert answer["problems"] == []
        assert answer["listing"]["lines"][0]["text"] == "ROR 0, 77"

    _go(tmp_path, scenario)


def test_an_include_outside_the_folder_is_a_diagnostic(tmp_path):
    (tmp_path / "secret.inc").write_text("Secret = 1\n")
    folder = tmp_path / "work"
    folder.mkdir()
    path = _write(folder, "#include ../secret.inc\nSTOP\n")

    async def scenario(ide, page):
        answer = await page.call(wire.Assemble(path))
        assert answer["listing"] is None
        assert answer["problems"][0]["place"]["line"] == 1

    _go(folder, scenario)


def test_an_include_file_is_found_in_any_case_and_judged_as_a_part_of_its_program(tmp_path):
    path = _write(tmp_path, '#include "Names.INC"\nCSUB Move\nSTOP\n#include "moves.inc"\n')
    (tmp_path / "names.inc").write_text("Speed = 500\n")
    (tmp_path / "moves.inc").write_text("Move: ROR 0, Speed\nRSUB\n")

    async def scenario(ide, page):
        assert (await page.call(wire.Assemble(path)))["problems"] == []
        part = await page.call(wire.Assemble("moves.inc"))
        assert part["problems"] == []
        assert part["listing"]["path"] == path
        assert part["lines"][:4] == [0, 0, 1, 2]
        texts = {"moves.inc": "Move: ROR 0, Sped\nRSUB\n"}
        wrong = await page.call(wire.Assemble("moves.inc", texts))
        assert [(p["place"]["path"], p["code"]) for p in wrong["problems"]] == [("moves.inc", "E301")]
        alone = await page.call(wire.Download("moves.inc"))
        assert [p["code"] for p in alone["problems"] if p["severity"] == "error"] == ["E301"]

    _go(tmp_path, scenario)


def test_an_include_file_that_fits_twice_in_another_case_is_not_guessed(tmp_path):
    path = _write(tmp_path, '#include "NAMES.inc"\nSTOP\n')
    (tmp_path / "names.inc").write_text("Speed = 500\n")
    (tmp_path / "Names.inc").write_text("Speed = 400\n")

    async def scenario(ide, page):
        assert [p["code"] for p in (await page.call(wire.Assemble(path)))["problems"]] == ["E501"]

    _go(tmp_path, scenario)


def test_a_program_with_mistakes_is_not_downloaded(tmp_path):
    path = _write(tmp_path, "ROR 0, 1\nNONSENSE 1\n")

    async def scenario(ide, page):
        answer = await page.call(wire.Download(path, run=True))
        assert answer["listing"] is None
        assert answer["problems"][0]["place"]["line"] == 2
        assert ide.virtual.module.eeprom.read_instruction(0) == Instruction(0)

    _go(tmp_path, scenario)


def test_upload_gives_back_source_for_what_was_downloaded(tmp_path):
    path = _write(tmp_path)

    async def scenario(ide, page):
        listing = (await page.call(wire.Download(path)))["listing"]
        text = await page.call(wire.Upload())
        again = await page.call(wire.Assemble("again.tmc", {"again.tmc": text}))
        assert again["listing"]["identity"] == listing["identity"]

    _go(tmp_path, scenario)


def test_an_uploaded_text_is_known_as_the_module_s_program(tmp_path):
    path = _write(tmp_path)

    async def scenario(ide, page):
        listing = (await page.call(wire.Download(path)))["listing"]
        await page.event(wire.Loaded)
        text = await page.call(wire.Upload())
        assert await page.call(wire.Adopt("up.tmc", {"up.tmc": text}))
        known = (await page.event(wire.Loaded)).listing
        assert (known.path, known.identity) == ("up.tmc", listing["identity"])
        assert not await page.call(wire.Adopt("up.tmc", {"up.tmc": text + "ROR 0, 1\n"}))

    _go(tmp_path, scenario)


def test_an_uploaded_program_that_ends_in_a_jump_is_known_without_the_stop_that_the_assembler_puts(tmp_path):
    async def scenario(ide, page):
        ide.virtual.module.eeprom.write_program(assemble("Loop: CALC ADD, 1\nJA Loop\n").program)
        text = await page.call(wire.Upload())
        assert await page.call(wire.Adopt("up.tmc", {"up.tmc": text}))
        known = await page.event(wire.Loaded, lambda event: event.listing and event.listing.path == "up.tmc")
        assert [line.text for line in known.listing.lines] == ["CALC ADD, 1", "JA 0"]

    _go(tmp_path, scenario)


def test_a_program_that_another_host_has_changed_is_listed_without_its_source(tmp_path):
    path = _write(tmp_path)

    async def scenario(ide, page):
        await page.call(wire.Download(path))
        await page.event(wire.Loaded)
        ide.virtual.module.eeprom.write_instruction(1, Instruction(28))
        loaded = await page.event(wire.Loaded)
        assert (loaded.by_other_host, loaded.listing.path, loaded.listing.lines[1].text) == (True, "", "STOP")

    _go(tmp_path, scenario)


def test_a_program_that_is_downloaded_while_the_one_before_is_looked_for_stays_known(tmp_path, monkeypatch):
    path = _write(tmp_path)
    looking, go_on = threading.Event(), threading.Event()

    def recognise(*_):
        looking.set()
        assert go_on.wait(60)
        return None, None

    monkeypatch.setattr(hub, "recognise", recognise)

    async def scenario(ide, page):
        ide.virtual.module.eeprom.write_instruction(0, Instruction(28))
        await asyncio.to_thread(looking.wait)
        await page.call(wire.Download(path, replace=True))
        frames = len(page.frames)
        go_on.set()
        await page.until(lambda: len(page.frames) > frames)
        assert ide.hub.loading.listing.path == path

    _go(tmp_path, scenario)


def test_stop_all_stops_the_program_first_and_then_every_motor(tmp_path):
    path = _write(tmp_path, "Loop: ROR 0, 500\nROL 1, 500\nROR 2, 100\nJA Loop\n")

    async def scenario(ide, page):
        await page.call(wire.Download(path, run=True))
        await page.until(lambda: all(page.state[f"motor{motor}"]["speed"] for motor in range(3)))
        await page.call(wire.StopAll())
        await page.until(lambda: not any(page.state[f"motor{motor}"]["speed"] for motor in range(3)))
        assert page.state["program"]["state"] == 0

    _go(tmp_path, scenario)


def test_a_closed_switch_stops_the_motor_and_is_marked_for_the_plots(tmp_path):
    async def scenario(ide, page):
        await page.execute("ROR 1, 200")
        await page.until(lambda: page.state["motor1"]["speed"] == 200)
        await page.call(wire.SetBench("right", 1, 1))
        await page.until(lambda: page.state["motor1"]["speed"] == 0)
        happened = await page.event(wire.Happened, lambda event: event.kind == "switch")
        assert (happened.motor, happened.text) == (1, "right closed")
        world = (await page.event(wire.WorldChanged)).world
        assert world.axes[1].right_held

    _go(tmp_path, scenario)


@pytest.mark.parametrize(
    ("call", "line", "value"),
    [
        (wire.SetBench("input", 3, 1), "GIO 3, 0", 1),
        (wire.SetBench("analog", 5, 700), "GIO 5, 1", 700),
        (wire.SetBench("shutdown", 0, 1), "GIO 10, 0", 1),
        (wire.SetBench("left", 0, 1), "GAP 11, 0", 1),
    ],
)
def test_a_hand_at_the_bench_is_seen_by_the_module(tmp_path, call, line, value):
    async def scenario(ide, page):
        await page.call(call)
        assert (await page.execute(line))["value"] == value

    _go(tmp_path, scenario)


def test_a_fault_at_a_driver_shows_in_the_error_flags(tmp_path):
    async def scenario(ide, page):
        await page.call(wire.SetBench("fault", 2, 1, "over_temperature"))
        await page.until(lambda: page.state["motor2"]["errors"] & 0x80)

    _go(tmp_path, scenario)


def test_a_load_beyond_the_motors_torque_makes_it_lose_steps(tmp_path):
    async def scenario(ide, page):
        await page.execute("ROR 0, 300")
        await page.until(lambda: page.state["motor0"]["speed"] == 300)
        await page.call(wire.SetBench("load", 0, 1.5))
        await page.until(lambda: page.state["motor0"]["slip"] != 0)

    _go(tmp_path, scenario)


@pytest.mark.parametrize(
    "call",
    [wire.SetBench("left", 3, 1), wire.SetBench("analog", 8, 1), wire.SetBench("fault", 0, 1, "bad mood")],
)
def test_a_bench_without_such_a_thing_says_so(tmp_path, call):
    async def scenario(ide, page):
        assert await page.refusal(call) == "range"

    _go(tmp_path, scenario)


def test_an_unplugged_line_gives_no_answer_and_a_plugged_one_again(tmp_path):
    async def scenario(ide, page):
        await page.call(wire.SetBench("line", 0, 0))
        exchange = await page.execute("GAP 1, 0")
        assert exchange["status"] == 0
        assert "unplugged" in exchange["meaning"]
        await page.call(wire.StopAll())
        told = await page.event(
            wire.Authority, lambda event: any("unplugged" in doubt.why for doubt in event.doubts)
        )
        assert [doubt.motor for doubt in told.doubts] == [-1, 0, 1, 2]
        await page.call(wire.SetBench("line", 0, 1))
        await page.event(wire.Authority, lambda event: event.latched and not event.doubts)
        assert (await page.execute("GAP 1, 0"))["status"] == 100

    _go(tmp_path, scenario)


def test_a_power_cycle_stops_everything_and_the_page_goes_on(tmp_path):
    async def scenario(ide, page):
        await page.execute("ROR 0, 500")
        await page.until(lambda: page.state["motor0"]["position"] > 0)
        await page.call(wire.SetBench("power", 0, 0))
        await page.until(lambda: not int(page.state["time"]["flags"]) & 2)
        assert "no power" in (await page.execute("GAP 1, 0"))["meaning"]
        await page.call(wire.SetBench("power", 0, 1))
        await page.until(lambda: int(page.state["time"]["flags"]) & 2)
        assert (await page.execute("GAP 1, 0"))["value"] == 0

    _go(tmp_path, scenario)


def test_held_time_stands_still_and_single_milliseconds_pass(tmp_path):
    async def scenario(ide, page):
        await page.call(wire.SetTime(paused=True))
        await page.until(lambda: int(page.state["time"]["flags"]) & 1)
        before = ide.virtual.rig.now
        await page.call(wire.StepTime(3))
        assert ide.virtual.rig.now - before == 3 * clock.MS
        await page.call(wire.SetTime(paused=False, speed=100))
        await page.until(lambda: page.state["time"]["clock"] > before + 100 * clock.MS)
        assert page.state["time"]["asked"] == 100

    _go(tmp_path, scenario)


def test_direct_mode_refuses_what_is_no_command(tmp_path):
    async def scenario(ide, page):
        assert await page.refusal(wire.ExecuteText("TURN 1")) == "text"
        assert await page.refusal(wire.Execute(256)) == "range"
        assert await page.refusal(wire.Execute(1, 0, 0, 2**32)) == "range"
        assert (await page.call(wire.Execute(1, 0, 9, 1)))["status"] == 4

    _go(tmp_path, scenario)


def test_the_ascii_interface_and_switched_off_replies_do_not_strand_the_ide(tmp_path):
    async def scenario(ide, page):
        assert (await page.call(wire.Execute(139, sure=True)))["status"] == 100
        assert (await page.execute("GAP 4, 0"))["value"] == 1000
        await page.execute("SGP 255, 0, 1")
        assert "255" in (await page.execute("GAP 4, 0"))["meaning"]
        await page.execute("SGP 255, 0, 0")
        assert (await page.execute("GAP 4, 0"))["status"] == 100

    _go(tmp_path, scenario)


def test_the_version_is_told_in_both_forms(tmp_path):
    async def scenario(ide, page):
        assert (await page.call(wire.Execute(136, 0)))["meaning"] == "343V4.36"
        assert (await page.call(wire.Execute(136, 1)))["value"] == 0x01570424

    _go(tmp_path, scenario)


def test_targets_reached_after_command_138_come_as_an_event(tmp_path):
    async def scenario(ide, page):
        await page.execute("MVP ABS, 0, 500")
        assert (await page.call(wire.Execute(138, value=1)))["status"] == 100
        await page.event(wire.Happened, lambda event: event.kind == "target")

    _go(tmp_path, scenario)


def test_watched_parameters_come_with_the_state(tmp_path):
    async def scenario(ide, page):
        await page.execute("SGP 7, 2, 4711")
        await page.call(wire.Watch([wire.Watched(2, 7, 0), wire.Watched(-1, 4, 1), wire.Watched(-1, 250, 0)]))
        await page.until(lambda: page.watched == [4711, 1000, None])

    _go(tmp_path, scenario)


def test_many_values_are_read_without_a_line_in_the_log(tmp_path):
    async def scenario(ide, page):
        items = [
            wire.Watched(-1, 4, 0),
            wire.Watched(0, 66, 0),
            wire.Watched(-2, 20, 2),
            wire.Watched(-1, 99, 0),
        ]
        before = ide.hub.telegrams.count
        assert await page.call(wire.ReadMany(items)) == [1000, 1, 0, None]
        assert await page.call(wire.ReadMany([wire.Watched(-9, 4, 0), wire.Watched(-1, 999, -1)])) == [
            None,
            None,
        ]
        assert ide.hub.telegrams.count == before

    _go(tmp_path, scenario)


def test_the_log_decodes_requests_and_replies(tmp_path):
    async def scenario(ide, page):
        await page.call(wire.FollowLog(True))
        await page.execute("MVP ABS, 1, 90000")
        await page.execute("SAP 4, 7, 1")
        lines = [line for event in [await page.event(wire.Telegrams)] for line in event.lines]
        while len(lines) < 4:
            lines += (await page.event(wire.Telegrams)).lines
        assert [line.direction for line in lines] == ["in", "out", "in", "out"]
        assert lines[0].text.startswith("MVP ABS, 1, 90000")
        assert lines[0].data == "01 04 00 01 00 01 5f 90 f6"
        assert lines[3].status == 4

    _go(tmp_path, scenario)


def test_the_eeprom_shows_what_was_stored(tmp_path):
    async def scenario(ide, page):
        await page.execute("SAP 4, 1, 321")
        await page.execute("STAP 4, 1")
        eeprom = await page.call(wire.ReadEeprom())
        assert {"bank": -1, "number": 4, "motor": 1, "value": 321} in eeprom["values"]
        assert bytes.fromhex(eeprom["image"]) == ide.virtual.module.eeprom.to_bytes()

    _go(tmp_path, scenario)


@pytest.mark.parametrize("form", ["tmcl", "toml"])
def test_settings_travel_from_one_module_to_another(tmp_path, form):
    async def scenario(ide, page):
        for line in ("SAP 4, 0, 777", "SAP 140, 2, 4", "SGP 77, 0, 1", "SGP 11, 2, -5", "SCO 3, 1, -12345"):
            assert (await page.execute(line))["status"] == 100
        text = await page.call(wire.ExportSettings(form))
        await page.call(wire.Execute(137, value=1234, sure=True))
        imported = await page.call(wire.ImportSettings(text.encode()))
        assert (imported["count"] > 60, imported["refused"]) == (True, [])
        for line, value in (
            ("GAP 4, 0", 777),
            ("GAP 140, 2", 4),
            ("GGP 77, 0", 1),
            ("GGP 11, 2", -5),
            ("GCO 3, 1", -12345),
        ):
            assert (await page.execute(line))["value"] == value

    _go(tmp_path, scenario)


def test_a_second_window_is_counted_and_its_end_too(tmp_path):
    async def scenario(ide, page):
        assert (await page.event(wire.Windows)).count == 1
        async with ide.page():
            assert (await page.event(wire.Windows)).count == 2
        assert (await page.event(wire.Windows)).count == 1

    _go(tmp_path, scenario)


def test_a_change_of_the_folder_from_outside_is_told(tmp_path):
    _write(tmp_path)

    async def scenario(ide, page):
        await page.call(wire.ListFiles())
        (tmp_path / "other.tmc").write_text("STOP\n")
        changed = await page.event(wire.FilesChanged)
        assert {entry.path for entry in changed.files} == {"program.tmc", "other.tmc"}

    _go(tmp_path, scenario)


def test_a_download_that_is_stopped_leaves_download_mode(tmp_path):
    path = _write(tmp_path, "WAIT TICKS, 0, 1\n" * 2000 + "STOP\n")

    async def scenario(ide, page):
        async with ide.page() as other:
            download = asyncio.create_task(page.ask(wire.Download(path)))
            await other.event(wire.Progress)
            await other.call(wire.StopAll())
            answer = await download
            assert isinstance(answer, wire.Refusal)
            assert answer.code == "aborted"
            assert (await other.execute("GGP 129, 0"))["value"] == 0

    _go(tmp_path, scenario)


def test_other_commands_are_refused_while_a_program_is_downloaded(tmp_path):
    path = _write(tmp_path, "WAIT TICKS, 0, 1\n" * 2000 + "STOP\n")

    async def scenario(ide, page):
        async with ide.page() as other:
            download = asyncio.create_task(page.ask(wire.Download(path)))
            await other.event(wire.Progress)
            assert await other.refusal(wire.ExecuteText("ROR 0, 1")) == "busy"
            assert await other.refusal(wire.ControlProgram("run")) == "busy"
            assert isinstance(await download, wire.CallResult)
            assert ide.virtual.module.eeprom.read_instruction(2000).number == 28

    _go(tmp_path, scenario)


def test_a_bug_in_the_server_is_no_refusal_and_reaches_the_page_and_the_log(tmp_path, caplog):
    async def run():
        async with running(tmp_path) as ide, ide.page() as page:
            workspace = ide.hub.folder._workspace
            ide.hub.folder._workspace = None
            try:
                answer = await page.ask(wire.ReadFile("program.tmc"))
                assert isinstance(answer, wire.Fault)
                assert answer.text.startswith("An error in the IDE itself (ReadFile): AttributeError(")
            finally:
                ide.hub.folder._workspace = workspace

    asyncio.run(run())
    assert "Traceback" in caplog.text
