from __future__ import annotations

import asyncio
import itertools
import socket
import threading

import pytest

from ide.ide_driver import real, running
from ide.served import Bench
from tmcm34x.host import Connection
from tmcm34x.host.exceptions import LinkError
from tmcm34x.host.url import parse_url
from tmcm34x.ide import wire
from tmcm34x.ide.remote import Remote
from tmcm34x.ide.telegrams import Telegrams
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.mnemonic import parse_instruction


def _go(folder, scenario, model: int = 343):
    bench = Bench(model)

    async def run():
        remote, telegrams = await real(f"tcp://{bench.address}")
        async with running(folder, (remote, telegrams)) as ide, ide.page() as page:
            await page.call(wire.Arm(True))
            await scenario(bench, ide, page)

    try:
        asyncio.run(run())
    finally:
        bench.stop()


def test_a_real_module_tells_what_it_is_and_moves(tmp_path):
    async def scenario(bench, ide, page):
        assert ide.hub.target.model.number == 341
        await page.execute("ROR 1, 400")
        await page.until(
            lambda: page.state["motor1"]["speed"] == 400 and page.state["motor1"]["position"] > 0
        )
        await page.call(wire.StopAll())
        await page.until(lambda: page.state["motor1"]["speed"] == 0)

    _go(tmp_path, scenario, 341)


def test_polling_stays_out_of_a_download(tmp_path):
    program = "Loop: ROR 0, 300\n" + "WAIT TICKS, 0, 1\n" * 300 + "JA Loop\n"
    (tmp_path / "a.tmc").write_text(program)

    async def scenario(bench, ide, page):
        await page.until(lambda: page.state.get("time"))
        answer = await page.call(wire.Download("a.tmc", run=True))
        await page.until(lambda: page.state["motor0"]["speed"] == 300 and page.state["program"]["state"] == 1)
        text = await page.call(wire.Upload())
        again = await page.call(wire.Assemble("b.tmc", {"b.tmc": text}))
        assert again["listing"]["identity"] == answer["listing"]["identity"]

    _go(tmp_path, scenario)


def test_what_needs_a_bench_is_refused_on_a_real_module(tmp_path):
    async def scenario(bench, ide, page):
        for call in (
            wire.SetBench("left", 0, 1),
            wire.SetTime(True),
            wire.StepTime(1),
            wire.ReadWorld(),
            wire.ReadEeprom(),
        ):
            assert await page.refusal(call) == "real"

    _go(tmp_path, scenario)


STEPS = """\
Start:  SGP 5, 2, 7
        CSUB Sub
        WAIT TICKS, 0, 30000
        STOP
Sub:    SGP 6, 2, 8
        RSUB
"""


TURNS = """\
Loop:   GGP 5, 2
        CALC ADD, 1
        AGP 5, 2
        JA Loop
"""


def test_the_debugger_does_on_a_real_module_what_its_firmware_allows(tmp_path):
    (tmp_path / "a.tmc").write_text(STEPS)

    async def scenario(bench, ide, page):
        async with ide.debugger() as editor:
            await page.call(wire.Download("a.tmc"))
            for request, counter in (("stepIn", 1), ("next", 2)):
                await editor.do(request, threadId=1)
                assert (await editor.event("stopped"))["reason"] == "step"
                (frame,) = (await editor.do("stackTrace", threadId=1))["stackFrames"]
                assert (frame["instructionPointerReference"], frame["line"]) == (hex(counter), counter + 1)
            assert (await editor.do("evaluate", expression="gp[5] * 10 + gp[6]"))["result"] == "78"
            assert await editor.fail("evaluate", expression="accumulator")
            await editor.do("continue", threadId=1)
            await page.until(lambda: page.state["program"]["state"] == 1)
            await editor.do("pause", threadId=1)
            assert (await editor.event("stopped"))["reason"] == "pause"
            await page.until(lambda: page.state["program"]["state"] == 0)
            await page.call(wire.ControlProgram("run"))
            assert await editor.fail("stepIn", threadId=1) == "the program is running"

    _go(tmp_path, scenario)


def test_a_breakpoint_holds_the_program_of_a_real_module_which_runs_in_single_steps(tmp_path):
    (tmp_path / "a.tmc").write_text(TURNS)

    async def scenario(bench, ide, page):
        async with ide.debugger() as editor:
            await page.call(wire.Download("a.tmc"))
            (placed,) = await editor.breakpoints("a.tmc", {"line": 3, "condition": "gp[5] == 2"})
            assert placed["verified"]
            assert "single steps" in placed["message"]
            await page.call(wire.ControlProgram("run"))
            assert (await editor.event("stopped"))["hitBreakpointIds"] == [placed["id"]]
            await page.until(
                lambda: page.state["program"]["paused"] and page.state["program"]["counter"] == 2
            )
            assert (await editor.do("evaluate", expression="gp[5]"))["result"] == "2"
            while (await editor.event("tmcl_hits"))["hits"] != {str(placed["id"]): 1}:
                pass  # those before it
            (placed,) = await editor.breakpoints("a.tmc", {"line": 3, "condition": "accumulator > 0"})
            await editor.do("continue", threadId=1)
            stopped = await editor.event("stopped")
            assert stopped["text"].startswith("the condition has no value")
            await editor.breakpoints("a.tmc")
            await editor.do("continue", threadId=1)
            await page.until(lambda: page.state["program"]["state"] == 1)
            assert not page.state["program"]["paused"]

    _go(tmp_path, scenario)


ROUTINE_BEHIND_STOP = """\
        CSUB Count
        STOP
Count:  GGP 5, 2
        CALC ADD, 1
        AGP 5, 2
        RSUB
"""


@pytest.mark.parametrize("step", ["continue", "next", "stepOut"])
def test_a_stop_ends_single_steps_before_the_routine_behind_it(tmp_path, step):
    (tmp_path / "a.tmc").write_text(ROUTINE_BEHIND_STOP)

    async def scenario(bench, ide, page):
        async with ide.debugger() as editor:
            await page.call(wire.Download("a.tmc"))
            (placed,) = await editor.breakpoints("a.tmc", {"line": 2})
            await page.call(wire.ControlProgram("run"))
            assert (await editor.event("stopped"))["hitBreakpointIds"] == [placed["id"]]
            await editor.breakpoints("a.tmc", {"line": 4, "condition": "gp[5] > 10"})
            await editor.do(step, threadId=1)
            assert (await editor.event("stopped"))["description"] == "The program has stopped"
            await page.event(wire.Happened, lambda event: event.kind == "held" and event.text == "end at 2")
            assert bench.rig.modules[0].program.counter == 2
            assert (await editor.do("evaluate", expression="gp[5]"))["result"] == "1"
            await page.until(lambda: not page.state["program"]["paused"])

    _go(tmp_path, scenario)


def test_stop_all_ends_a_program_that_goes_on_in_single_steps(tmp_path):
    (tmp_path / "a.tmc").write_text(TURNS)

    async def scenario(bench, ide, page):
        async with ide.debugger() as editor:
            await page.call(wire.Download("a.tmc"))
            await editor.breakpoints("a.tmc", {"line": 3, "condition": "gp[5] == 30000"})
            await page.call(wire.ControlProgram("run"))
            await page.until(lambda: page.state["program"]["state"] == 2)
            await page.call(wire.StopAll())
            assert (await editor.event("stopped"))["reason"] == "pause"
            await page.event(wire.Authority, lambda event: event.latched and not event.doubts)
            before = bench.rig.modules[0].program.counter
            assert await editor.fail("continue", threadId=1)
            assert bench.rig.modules[0].program.counter == before

    _go(tmp_path, scenario)


def test_the_debugger_finds_the_module_again_on_a_new_line(tmp_path):
    (tmp_path / "a.tmc").write_text(STEPS)

    async def scenario(bench, ide, page):
        async with ide.debugger() as editor:
            await page.event(wire.Link, lambda event: event.up)
            await editor.breakpoints("a.tmc", {"line": 2})
            port = int(bench.address.rpartition(":")[2])
            await asyncio.to_thread(bench.stop)
            await page.event(wire.Link, lambda event: not event.up)
            assert await editor.fail("stepIn", threadId=1)
            again = await asyncio.to_thread(Bench, 343, port)
            try:
                await page.event(wire.Link, lambda event: event.up)
                await page.call(wire.Arm(True))
                await page.call(wire.Download("a.tmc"))
                await editor.do("stepIn", threadId=1)
                assert (await editor.event("tmcl_breakpoints"))["breakpoints"] == [{"line": 2}]
                await editor.event("stopped")
                assert again.rig.modules[0].program.counter == 1
            finally:
                await asyncio.to_thread(again.stop)

    _go(tmp_path, scenario)


def test_after_the_line_was_lost_the_program_is_looked_at_again(tmp_path):
    (tmp_path / "a.tmc").write_text(STEPS)

    async def scenario(bench, ide, page):
        await page.call(wire.Download("a.tmc"))
        assert (await page.event(wire.Loaded)).listing.path == "a.tmc"
        port = int(bench.address.rpartition(":")[2])
        await asyncio.to_thread(bench.stop)
        await page.event(wire.Link, lambda event: not event.up)
        another = await asyncio.to_thread(Bench, 343, port)
        try:
            loaded = await page.event(wire.Loaded)
            assert (loaded.by_other_host, loaded.listing) == (True, None)
        finally:
            await asyncio.to_thread(another.stop)

    _go(tmp_path, scenario)


def test_a_download_has_the_line_to_itself(tmp_path):
    (tmp_path / "a.tmc").write_text("WAIT TICKS, 0, 1\n" * 1500 + "STOP\n")

    async def scenario(bench, ide, page):
        async with ide.debugger() as editor:
            await page.until(lambda: page.state.get("time"))
            download = asyncio.create_task(page.call(wire.Download("a.tmc")))
            await page.event(wire.Progress, lambda event: event.done > 0)
            assert await page.refusal(wire.Download("a.tmc")) == "busy"
            assert await page.refusal(wire.ExecuteText("ROR 0, 100")) == "busy"
            assert await page.refusal(wire.Jog(0, 100)) == "busy"
            assert await page.refusal(wire.ControlProgram("run")) == "busy"
            assert "download" in await editor.fail("stepIn", threadId=1)
            listing = (await download)["listing"]
            await editor.do("stepIn", threadId=1)
            await editor.event("stopped")
        text = await page.call(wire.Upload())
        again = await page.call(wire.Assemble("b.tmc", {"b.tmc": text}))
        assert again["listing"]["identity"] == listing["identity"]

    _go(tmp_path, scenario)


def test_what_the_debugger_had_in_the_queue_is_not_stored_by_a_download(tmp_path):
    (tmp_path / "a.tmc").write_text(STEPS)

    async def scenario(bench, ide, page):
        await page.call(wire.Download("a.tmc"))
        async with ide.debugger() as editor:
            ide.hub.target.hush(True)  # as a download does; the debugger itself does not know of it here
            assert "download" in await editor.fail("stepIn", threadId=1)
            assert bench.do(lambda: bench.module.program.counter) == 0
            ide.hub.target.hush(False)
            await editor.do("stepIn", threadId=1)
            assert (await editor.event("stopped"))["reason"] == "step"

    _go(tmp_path, scenario)


def test_a_module_that_was_not_there_at_first_is_debugged_when_it_comes(tmp_path):
    (tmp_path / "a.tmc").write_text(STEPS)

    async def scenario(bench, ide, page):
        async with ide.debugger() as editor:
            await page.execute("SGP 255, 0, 1")
            assert await editor.fail("stepIn", threadId=1)
            await page.until(lambda: not ide.hub.target.link.up)
            await page.execute("SGP 255, 0, 0")
            await page.until(lambda: ide.hub.target.link.up)
            await page.call(wire.Arm(True))
            await page.call(wire.Download("a.tmc"))
            await editor.do("stepIn", threadId=1)
            assert (await editor.event("stopped"))["reason"] == "step"

    _go(tmp_path, scenario)


def test_nothing_moves_before_it_is_armed_and_everything_can_be_stopped(tmp_path):
    (tmp_path / "a.tmc").write_text(STEPS)

    async def scenario(bench, ide, page):
        await page.call(wire.Arm(False))
        moving = [
            "ROR 0, 100",
            "ROL 0, 100",
            "MVP ABS, 0, 100",
            "RFS START, 0",
            "SAP 0, 0, 90000",
            "SAP 2, 0, 5",
        ]
        for line in moving:
            assert await page.refusal(wire.ExecuteText(line)) == "disarmed"
        for call in (wire.Jog(0, 5), wire.Zero(0), wire.Search(0), wire.Turn(0, 5), wire.Go(1, [0])):
            assert await page.refusal(call) == "disarmed"
        assert await page.refusal(wire.Download("a.tmc", run=True)) == "disarmed"
        assert await page.refusal(wire.ControlProgram("run")) == "disarmed"
        for line in ("MST 0", "SAP 4, 0, 700", "GAP 4, 0"):
            assert (await page.execute(line))["status"] == 100
        assert bench.speed(0) == 0
        await page.call(wire.Arm(True))
        await page.call(wire.Turn(0, 300))
        await page.until(lambda: page.state["motor0"]["speed"] == 300)
        await page.call(wire.Arm(False))
        await page.until(lambda: page.state["motor0"]["speed"] == 0)

    _go(tmp_path, scenario)


def test_the_debugger_s_console_moves_nothing_before_it_is_armed(tmp_path):
    (tmp_path / "a.tmc").write_text(STEPS)

    async def scenario(bench, ide, page):
        await page.call(wire.Download("a.tmc"))
        await page.call(wire.Arm(False))
        async with ide.debugger() as editor:
            for text in ("ROR 0, 100", "ap[target_position][0] = 9000"):
                assert "Not armed" in await editor.fail("evaluate", expression=text, context="repl")
            assert "Not armed" in await editor.fail("setExpression", expression="ap[0][0]", value="9")
            for request in ("continue", "stepIn", "restartFrame"):
                assert "Not armed" in await editor.fail(request, threadId=1)
            assert (await editor.do("evaluate", expression="ap[3][0]", context="repl"))["result"] == "0"
        assert [bench.speed(motor) for motor in range(3)] == [0, 0, 0]

    _go(tmp_path, scenario)


def test_the_ascii_interface_has_a_way_back_and_stop_all_takes_it(tmp_path):
    async def scenario(bench, ide, page):
        await page.until(lambda: page.state.get("motor0"))
        for leave in (wire.SendAscii("BIN"), wire.StopAll()):
            await page.call(wire.Execute(139, sure=True))
            await page.event(wire.Link, lambda event: event.ascii)
            assert (await page.execute("GAP 4, 0"))["status"] == 0
            assert "BA 100 1000" in await page.call(wire.SendAscii("GAP 4, 0"))
            assert await page.refusal(wire.SendAscii("ROR 0, 100")) == "disarmed"
            await page.call(leave)
            await page.until(lambda: ide.hub.target.link.up)
            assert (await page.execute("GAP 4, 0"))["value"] == 1000

    _go(tmp_path, scenario)


def test_a_line_that_is_lost_under_the_ascii_interface_is_told(tmp_path):
    async def scenario(bench, ide, page):
        await page.call(wire.Execute(139, sure=True))
        await page.event(wire.Link, lambda event: event.ascii)
        await asyncio.to_thread(bench.stop)
        assert await page.refusal(wire.SendAscii("GAP 4, 0")) == "line"
        assert "lost" in (await page.event(wire.Link, lambda event: not event.up and not event.ascii)).text

    _go(tmp_path, scenario)


def test_the_module_is_asked_why_a_motor_does_not_turn(tmp_path):
    async def scenario(bench, ide, page):
        await page.execute("SAP 4, 1, 0")
        await page.execute("MVP ABS, 1, 5000")
        found = await page.call(wire.Why(1))
        assert any("SAP 4, 1" in line for line in found["reasons"])
        assert await page.refusal(wire.Why(3)) == "range"

    _go(tmp_path, scenario)


def test_a_lost_line_disarms(tmp_path):
    async def scenario(bench, ide, page):
        await page.call(wire.Turn(0, 300))
        await page.execute("SGP 255, 0, 1")
        await page.until(lambda: not ide.hub.authority.armed and not ide.hub.authority.shape.motions)
        assert await page.refusal(wire.Arm(True)) == "silent"
        await page.execute("SGP 255, 0, 0")
        await page.event(wire.Link, lambda event: event.up)
        await page.until(lambda: page.state["motor0"]["speed"] == 0)

    _go(tmp_path, scenario)


def test_a_program_that_was_not_loaded_from_here_is_not_overwritten_unasked(tmp_path):
    (tmp_path / "a.tmc").write_text(STEPS)

    async def scenario(bench, ide, page):
        eeprom = bench.rig.modules[0].eeprom
        await page.call(wire.Download("a.tmc"))
        await page.call(wire.Download("a.tmc"))
        (tmp_path / "a.tmc").write_text(STEPS.replace("7", "8"))
        await page.call(wire.Download("a.tmc"))
        bench.do(lambda: eeprom.write_instruction(1, Instruction(28)))
        assert await page.refusal(wire.Download("a.tmc", run=True)) == "unknown"
        assert eeprom.read_instruction(1).number == 28
        await page.call(wire.Download("a.tmc", replace=True))
        assert eeprom.read_instruction(1).number != 28

    _go(tmp_path, scenario)


def test_the_end_of_the_server_stops_what_it_has_started(tmp_path):
    bench = Bench()

    async def run():
        remote, telegrams = await real(f"tcp://{bench.address}")
        async with running(tmp_path, (remote, telegrams)) as ide, ide.page() as page:
            await page.call(wire.Arm(True))
            await page.execute("ROR 0, 500")
            await page.execute("MVP ABS, 2, 5000000")
            await page.until(
                lambda: page.state["motor0"]["speed"] == 500 and page.state["motor2"]["speed"] > 0
            )
        assert [bench.speed(motor) for motor in range(3)] == [0, 0, 0]

    try:
        asyncio.run(run())
    finally:
        bench.stop()


def test_motors_that_turn_already_are_told_of(tmp_path):
    bench = Bench()
    bench.do(lambda: bench.module.execute(Instruction(1, 0, 1, 300)))

    async def run():
        remote, telegrams = await real(f"tcp://{bench.address}")
        async with running(tmp_path, (remote, telegrams)) as ide, ide.page() as page:
            found = await page.event(wire.Authority, lambda event: event.found)
            assert "motor 1 (speed" in found.found
            await page.call(wire.StopAll())
            authority = ide.hub.authority
            await page.until(lambda: not authority.shape.found and not authority.shape.doubts)
            assert bench.speed(1) == 0

    try:
        asyncio.run(run())
    finally:
        bench.stop()


def test_the_ide_follows_its_own_change_of_the_address(tmp_path):
    async def scenario(bench, ide, page):
        await page.call(wire.ExecuteText("SGP 66, 0, 9", sure=True))
        assert (await page.execute("GGP 66, 0"))["value"] == 9
        assert "address 9" in (await page.event(wire.Link, lambda event: "address 9" in event.place)).place

    _go(tmp_path, scenario)


def test_a_model_is_known_when_the_module_has_said_it(tmp_path):
    async def scenario(bench, ide, page):
        await page.call(wire.ExecuteText("SGP 66, 0, 9", sure=True))
        url = f"tcp://{bench.address}"
        remote, telegrams = await real(url, address=3)
        async with running(tmp_path, (remote, telegrams)) as other:
            assert not other.hub.welcome(1).model.known
            async with other.page() as wrong:
                assert await wrong.refusal(wire.Arm(True)) == "silent"
                await page.call(wire.ExecuteText("SGP 66, 0, 3", sure=True))
                begun = await wrong.event(wire.Welcome)
                assert (begun.model.known, begun.model.number) == (True, 341)

    _go(tmp_path, scenario, 341)


def test_what_a_module_has_not_said_is_unknown_and_not_zero(tmp_path):
    peer = Peer()

    async def run():
        remote, telegrams = await real(peer.url)
        peer.refused = bytes((6, 3))
        async with running(tmp_path, (remote, telegrams)) as ide, ide.page() as page:
            await page.until(lambda: page.state and page.state["quality"]["seen"] > 0)
            rows = [row.name for row in wire.GROUPS[2].rows]
            unknown = int(page.state["quality"]["motor0"])
            assert unknown & 1 << rows.index("speed")
            assert unknown & 1 << rows.index("place")
            assert not unknown & 1 << rows.index("position")

    asyncio.run(run())


@pytest.mark.parametrize("action", ["store", "restore"])
def test_one_damaged_reply_in_thirteen_ends_no_sequence(tmp_path, action):
    peer = Peer()

    async def run():
        remote, telegrams = await real(peer.url)
        peer.damage_each = 13
        async with running(tmp_path, (remote, telegrams)) as ide, ide.page(rate_hz=0) as page:
            await page.call(
                wire.Keep(action, [wire.Watched(-1, 4, motor % 3) for motor in range(30)], sure=True)
            )
            ended = await page.event(wire.MotionEnded)
            assert (ended.complete, ended.text[:9]) == (True, "30 values")

    asyncio.run(run())


def test_an_export_is_complete_or_says_so(tmp_path):
    peer = Peer()

    async def run():
        remote, telegrams = await real(peer.url)
        async with running(tmp_path, (remote, telegrams)) as ide, ide.page(rate_hz=0) as page:
            text = await page.call(wire.ExportSettings("toml"))
            assert text.count("max_speed = 0") == 3
            peer.refused = bytes((6, 4))
            await page.call(wire.ExportSettings("toml"))
            assert "not complete: 3 settings" in (await page.event(wire.Output)).text

    asyncio.run(run())


def test_a_line_lost_in_the_middle_ends_a_sequence_and_says_how_far_it_came(tmp_path):
    async def scenario(bench, ide, page):
        await page.call(
            wire.Keep("store", [wire.Watched(-1, 4, motor % 3) for motor in range(3000)], sure=True)
        )
        await page.event(wire.Progress, lambda event: event.done > 0)
        await asyncio.to_thread(bench.stop)
        ended = await page.event(wire.MotionEnded)
        assert not ended.complete
        assert ended.text

    _go(tmp_path, scenario)


def test_each_reading_is_a_sample_and_a_lost_line_is_a_gap(tmp_path):
    async def scenario(bench, ide, page):
        await page.until(lambda: {next(iter(values)) for _, values in page.rows} >= {0, 2, 8, 10})
        assert all(sooner <= later for (sooner, _), (later, _) in itertools.pairwise(page.rows))
        await page.execute("SGP 255, 0, 1")
        await page.until(lambda: len(page.rows[-1][1]) > 8 and set(page.rows[-1][1].values()) == {None})
        await page.execute("SGP 255, 0, 0")
        await page.until(lambda: None not in page.rows[-1][1].values())

    _go(tmp_path, scenario)


class Peer:
    """The other end of a line that a test holds in its hand."""

    def __init__(self) -> None:
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.url = f"tcp://127.0.0.1:{self._listener.getsockname()[1]}"
        self.received: list[bytes] = []
        self._answering = True
        self.damage_each = 0
        """Each so many replies one has a wrong sum; 0 is none."""
        self.refused = b""
        """Command and type of a request that is refused."""
        self._connection: socket.socket | None = None
        self._news = threading.Condition()
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self) -> None:
        self._connection, _ = self._listener.accept()
        with self._connection as connection:
            while len(telegram := connection.recv(9, socket.MSG_WAITALL)) == 9:
                with self._news:
                    self.received.append(telegram)
                    self._news.notify_all()
                    if self._answering:
                        reply = _answer(telegram, self.refused)
                        damaged = self.damage_each and len(self.received) % self.damage_each == 0
                        connection.sendall(reply[:-1] + bytes((reply[-1] ^ 255,)) if damaged else reply)
        self._listener.close()

    def hold_replies(self) -> None:
        """Send no reply until `release_replies`."""
        with self._news:
            self._answering, self._held = False, len(self.received)

    def release_replies(self) -> None:
        """Send all replies that were held."""
        assert self._connection is not None
        with self._news:
            self._answering = True
            for telegram in self.received[self._held :]:
                self._connection.sendall(_answer(telegram))

    def wait(self, test) -> None:
        with self._news:
            assert self._news.wait_for(test, 60)


def _answer(telegram: bytes, refused: bytes = b"") -> bytes:
    if telegram[1] == 136:
        return b"\x02343V4.36"
    status = 3 if telegram[1:3] == refused else 100
    reply = bytes((2, telegram[0], status, telegram[1], 0, 0, 0, 0))
    return reply + bytes((sum(reply) & 255,))


def test_stop_all_goes_out_before_what_is_waited_for_and_what_is_queued(tmp_path, monkeypatch):
    monkeypatch.setattr("tmcm34x.ide.remote_line.TIMEOUT_S", 60.0)
    # Nothing else is on its way when replies are held: neither polls nor the look at motors that turn.
    monkeypatch.setattr("tmcm34x.ide.remote.LOOKED_AT_S", -1.0)
    monkeypatch.setattr("tmcm34x.ide.authority.WATCH_S", 60.0)
    peer = Peer()

    async def run():
        remote, telegrams = await real(peer.url)
        async with running(tmp_path, (remote, telegrams)) as ide, ide.page(rate_hz=0) as page:
            await page.call(wire.Arm(True))
            peer.hold_replies()
            waiting = asyncio.create_task(page.execute("GGP 66, 0"))
            await asyncio.to_thread(peer.wait, lambda: any(t[1:3] == bytes((10, 66)) for t in peer.received))
            queued = asyncio.ensure_future(ide.hub.target.exchange(Instruction(1, 0, 0, 100)))
            at = len(peer.received)
            await page.call(wire.StopAll())
            await asyncio.to_thread(peer.wait, lambda: len(peer.received) >= at + 4)
            assert [(t[1], t[3]) for t in peer.received[at : at + 4]] == [(128, 0), (3, 0), (3, 1), (3, 2)]
            assert not waiting.done()
            peer.release_replies()
            assert (await waiting)["status"] == 100
            assert "not sent" in (await queued).meaning
            assert all(t[1] != 1 for t in peer.received)

    asyncio.run(run())


def test_settings_parameters_and_watches_go_over_the_line(tmp_path):
    async def scenario(bench, ide, page):
        await page.execute("SAP 4, 2, 1234")
        assert await page.call(wire.ReadMany([wire.Watched(-1, 4, 2), wire.Watched(-1, 250, 0)])) == [
            1234,
            None,
        ]
        await page.call(wire.Watch([wire.Watched(-1, 4, 2)]))
        await page.until(lambda: page.watched == [1234])
        assert "max_speed = 1234" in await page.call(wire.ExportSettings("toml"))

    _go(tmp_path, scenario)


def test_a_lost_line_is_told_and_found_again(tmp_path):
    async def scenario(bench, ide, page):
        await page.event(wire.Link, lambda event: event.up)
        port = int(bench.address.rpartition(":")[2])
        await asyncio.to_thread(bench.stop)
        lost = await page.event(wire.Link, lambda event: not event.up)
        assert lost.text
        assert (await page.execute("GAP 1, 0"))["status"] == 0
        again = await asyncio.to_thread(Bench, 343, port)
        try:
            await page.event(wire.Link, lambda event: event.up)
            assert (await page.execute("GAP 4, 0"))["value"] == 1000
        finally:
            await asyncio.to_thread(again.stop)

    _go(tmp_path, scenario)


def test_a_silent_module_is_told_and_heard_again(tmp_path):
    async def scenario(bench, ide, page):
        await page.event(wire.Link, lambda event: event.up)
        await page.execute("SGP 255, 0, 1")
        assert "No answer" in (await page.event(wire.Link, lambda event: not event.up)).text
        await page.execute("SGP 255, 0, 0")
        await page.event(wire.Link, lambda event: event.up)

    _go(tmp_path, scenario)


def test_polling_that_a_bug_ends_is_told_to_pages(tmp_path, monkeypatch):
    async def scenario(bench, ide, page):
        await page.until(lambda: page.state.get("time"))
        monkeypatch.setattr(ide.hub.target._polling, "due", lambda: 1 / 0)
        assert "polling" in (await page.event(wire.Fault)).text

    _go(tmp_path, scenario)


def test_a_line_that_cannot_be_opened_says_so_at_once():
    with pytest.raises(LinkError):
        Remote(parse_url("/dev/does-not-exist"), Telegrams())


def test_a_download_of_another_host_is_not_filled_with_what_is_polled(tmp_path):
    """At most the one question that was on its way is stored; after the download all is polled again."""

    async def scenario(bench, ide, page):
        await page.until(lambda: page.state.get("time"))
        with Connection.open(f"tcp://{bench.address}") as host:
            host.ask(Instruction(132))
            await page.until(lambda: ide.hub.target._polling.loading)
            stored = bench.module.program.memory.address
            assert stored <= 1
            for _ in range(200):
                await asyncio.to_thread(host.ask, Instruction(136))
            assert bench.module.program.memory.address == stored
            host.ask(Instruction(133))
            await page.until(lambda: not ide.hub.target._polling.loading)
            await asyncio.to_thread(host.execute, parse_instruction("MVP ABS, 1, 500"))
            await page.until(lambda: page.state["motor1"]["position"] == 500)

    _go(tmp_path, scenario)
