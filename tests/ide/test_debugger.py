"""The debugger that all windows share, spoken to in the Debug Adapter Protocol."""

from __future__ import annotations

import asyncio
import contextlib
import threading
from concurrent.futures import ThreadPoolExecutor

from ide.ide_driver import running, virtual
from tmcm34x.clock import HZ
from tmcm34x.ide import wire
from tmcm34x.ide.debug_messages import DebugWindow, Emission, event_of
from tmcm34x.ide.debugger import MESSAGES, Debugger
from tmcm34x.tmcl.datagram import Instruction

PROGRAM = """\
Start:  ROR 0, 100
        CALC ADD, 1
        CSUB Sub
        JA Start
Sub:    WAIT TICKS, 0, 1
        RSUB
"""


def _go(folder, scenario, text=PROGRAM, **options):
    (folder / "program.tmc").write_text(text)

    async def run():
        async with running(folder, virtual(**options)) as ide, ide.page() as page, ide.debugger() as editor:
            await scenario(ide, page, editor)

    asyncio.run(run())


async def _start(page):
    await page.call(wire.Download("program.tmc", run=True))


def test_a_breakpoint_holds_the_program_and_steps_go_on_from_there(tmp_path):
    async def scenario(ide, page, editor):
        await page.call(wire.Download("program.tmc"))
        (placed,) = await editor.breakpoints("program.tmc", {"line": 3})
        assert placed["verified"] and placed["instructionReference"] == "0x2"
        await page.call(wire.ControlProgram("run"))
        stopped = await editor.event("stopped")
        assert (stopped["reason"], stopped["hitBreakpointIds"]) == ("breakpoint", [placed["id"]])
        held = await page.event(wire.Happened, lambda event: event.kind == "held")
        assert held.text == "breakpoint at 2"
        await page.until(lambda: page.state["program"]["paused"] == 1)
        assert page.state["program"]["accumulator"] == 1
        await editor.do("stepIn", threadId=1)
        assert (await editor.event("stopped"))["reason"] == "step"
        frames = (await editor.do("stackTrace", threadId=1))["stackFrames"]
        assert [(frame["name"], frame["line"]) for frame in frames] == [("Sub", 5), ("program", 3)]
        assert frames[0]["source"]["path"] == str(tmp_path / "program.tmc")
        await editor.do("stepOut", threadId=1)
        await page.until(lambda: page.state["program"]["counter"] == 3 and page.state["program"]["paused"])
        await editor.breakpoints("program.tmc")
        await editor.do("continue", threadId=1)
        await page.until(lambda: page.state["program"]["state"] == 1)
        assert not ide.virtual.module.program.hooked

    _go(tmp_path, scenario, speed=10)


def test_step_over_runs_through_a_subroutine(tmp_path):
    async def scenario(ide, page, editor):
        await page.call(wire.Download("program.tmc"))
        await editor.breakpoints("program.tmc", {"line": 3})
        await page.call(wire.ControlProgram("run"))
        await editor.event("stopped")
        await editor.do("next", threadId=1)
        assert (await editor.event("stopped"))["reason"] == "step"
        await page.until(lambda: page.state["program"]["counter"] == 3)

    _go(tmp_path, scenario)


def test_all_windows_hear_what_happens_and_what_one_of_them_sets(tmp_path):
    async def scenario(ide, page, editor):
        async with ide.debugger() as other:
            await _start(page)
            await page.until(lambda: page.state["program"]["state"] == 1)
            await editor.do("pause", threadId=1)
            assert (await other.event("stopped"))["reason"] == "pause"
            point = {"line": 2, "condition": "x == 3"}
            placed = await editor.breakpoints("program.tmc", point)
            told = await other.event("tmcl_breakpoints")
            assert told == {"source": {"path": "program.tmc"}, "breakpoints": [point], "placed": placed}
            await editor.do("setExceptionBreakpoints", filters=["refused"])
            assert await other.event("tmcl_filters") == {"filters": ["refused"]}
        async with ide.debugger() as later:
            assert (await later.event("tmcl_breakpoints"))["breakpoints"] == [point]
        own = {"tmcl_breakpoints", "tmcl_filters"}
        assert not any(message.get("event") in own for message in editor.messages)

    _go(tmp_path, scenario, "WAIT TICKS, 0, 10000\nSTOP\n")


def test_a_breakpoint_finds_its_place_with_the_download(tmp_path):
    async def scenario(ide, page, editor):
        (placed,) = await editor.breakpoints("program.tmc", {"line": 2})
        assert not placed["verified"]
        assert "download it first" in placed["message"]
        await page.call(wire.Download("program.tmc"))
        moved = (await editor.event("breakpoint"))["breakpoint"]
        assert (moved["id"], moved["verified"], moved["line"]) == (placed["id"], True, 2)

    _go(tmp_path, scenario)


def test_another_host_s_program_takes_the_places_away(tmp_path):
    async def scenario(ide, page, editor):
        await page.call(wire.Download("program.tmc"))
        (placed,) = await editor.breakpoints("program.tmc", {"line": 2})
        assert placed["verified"]
        ide.virtual.module.eeprom.write_program([Instruction(28)])
        assert not (await editor.event("breakpoint"))["breakpoint"]["verified"]

    _go(tmp_path, scenario)


def test_breakpoints_have_conditions_hits_and_messages(tmp_path):
    async def scenario(ide, page, editor):
        await page.call(wire.Download("program.tmc"))
        placed = await editor.breakpoints(
            "program.tmc",
            {"line": 2, "logMessage": "round {accumulator}"},
            {"line": 3, "condition": "accumulator == 3"},
            {"line": 99},
            {"line": 3, "hitCondition": "5"},
        )
        assert [place["verified"] for place in placed] == [True, True, False, True]
        assert placed[2]["message"]
        await page.call(wire.ControlProgram("run"))
        output = await editor.event("output")
        assert (output["output"], output["line"]) == ("round 1\n", 2)
        assert (await page.event(wire.Happened, lambda event: event.kind == "log")).text == "round 1"
        await editor.event("stopped")
        await page.until(lambda: page.state["program"]["paused"])
        assert page.state["program"]["accumulator"] == 3
        await editor.do("continue", threadId=1)
        await editor.event("stopped")
        await page.until(lambda: page.state["program"]["accumulator"] == 5)

    _go(tmp_path, scenario, "Loop: CALC ADD, 1\nWAIT TICKS, 0, 1\nJA Loop\n", speed=10)


def test_a_refused_command_holds_the_program_unless_a_window_says_otherwise(tmp_path):
    async def scenario(ide, page, editor):
        async with ide.debugger() as other:
            await other.do("setExceptionBreakpoints", filters=[])
            assert await editor.event("tmcl_filters") == {"filters": []}
            await other.do("setExceptionBreakpoints", filters=["refused"])
        await _start(page)
        stopped = await editor.event("stopped")
        assert stopped["reason"] == "exception"
        assert "invalid value" in stopped["text"]
        await page.until(lambda: page.state["program"]["paused"] == 1)
        assert page.state["program"]["counter"] == 1

    _go(tmp_path, scenario, "SAP 4, 7, 1\nSTOP\n")


def test_a_window_is_told_of_the_breaks_that_are_on_from_the_beginning(tmp_path):
    async def scenario():
        async with running(tmp_path) as ide, ide.debugger() as editor:
            await editor.do("configurationDone")
            assert await editor.event("tmcl_filters") == {"filters": ["refused"]}

    asyncio.run(scenario())


def test_data_breakpoints_of_one_window_are_those_of_all(tmp_path):
    async def scenario(ide, page, editor):
        await page.call(wire.Download("program.tmc"))
        wanted = [
            {"dataId": "accumulator", "condition": "accumulator > 1", "hitCondition": "2"},
            {"dataId": "gp["},
        ]
        async with ide.debugger() as other:
            placed = (await editor.do("setDataBreakpoints", breakpoints=wanted))["breakpoints"]
            await other.event("tmcl_data_breakpoints")  # how things were when it came
            told = await other.event("tmcl_data_breakpoints")
            assert told == {"breakpoints": wanted, "placed": placed}
            await page.call(wire.ControlProgram("run"))
            assert (await other.event("stopped"))["text"] == "accumulator: 2 → 3"
        async with ide.debugger() as later:
            assert await later.event("tmcl_data_breakpoints") == told

    _go(tmp_path, scenario)


def test_the_past_leaves_no_marks_and_the_present_says_again_why_it_is_held(tmp_path):
    async def scenario(ide, page, editor):
        await page.call(wire.Download("program.tmc"))
        await editor.breakpoints("program.tmc", {"line": 3})
        await page.call(wire.ControlProgram("run"))
        assert (await editor.event("stopped"))["reason"] == "breakpoint"
        for command, reason in (("stepBack", "step"), ("reverseContinue", "entry")):
            await editor.do(command, threadId=1)
            assert (await editor.event("stopped"))["reason"] == reason
        await page.call(wire.LeavePast())
        assert (await editor.event("stopped"))["reason"] == "breakpoint"
        marks = (await page.call(wire.ReadMarks(0)))["marks"]
        assert [mark["text"] for mark in marks if mark["kind"] == "held"] == ["breakpoint at 2"]

    _go(tmp_path, scenario)


def test_lines_are_not_shown_where_the_module_held_another_program(tmp_path):
    async def scenario(ide, page, editor):
        foreign = 1 << wire.TIME_FLAGS.index("foreign")
        await page.call(wire.Download("program.tmc"))
        await editor.breakpoints("program.tmc", {"line": 3})
        await page.call(wire.ControlProgram("run"))
        await editor.event("stopped")
        (tmp_path / "program.tmc").write_text("SGP 1, 2, 3\n" + PROGRAM)
        await page.call(wire.Download("program.tmc"))
        await editor.do("stepBack", threadId=1)
        await page.until(lambda: page.state["time"]["flags"] & foreign)
        frames = (await editor.do("stackTrace", threadId=1))["stackFrames"]
        assert [(frame["name"], frame["line"]) for frame in frames] == [("program", 0)]
        answer = await editor.do("evaluate", expression="who wrote ap[2][0]?", context="repl")
        assert "ms, ROR 0, 100 (0 " in answer["result"]
        await page.call(wire.LeavePast())
        await page.until(lambda: not page.state["time"]["flags"] & foreign)

    _go(tmp_path, scenario)


def test_expressions_are_evaluated_and_assigned(tmp_path):
    async def scenario(ide, page, editor):
        await page.call(wire.Download("program.tmc"))

        async def value(expression):
            return (await editor.do("evaluate", expression=expression, context="watch"))["result"]

        assert (await editor.do("setExpression", expression="gp[3]", value="Speed * 2"))["value"] == "600"
        await editor.do("setExpression", expression="accumulator", value="-5")
        assert await value("gp[3] + accumulator") == "595"
        assert await value("ap[max_speed][0]") == "1000"
        assert await editor.fail("evaluate", expression="nonsense")
        assert await editor.fail("evaluate", expression="1 +")
        assert await editor.fail("setExpression", expression="time_ms", value="1")
        await page.until(lambda: page.state["program"]["accumulator"] == -5)

    _go(tmp_path, scenario, "Speed = 300\nROR 0, Speed\nSTOP\n")


def test_what_cannot_be_is_refused_in_a_line(tmp_path):
    async def scenario(ide, page, editor):
        await _start(page)
        assert await editor.fail("stepIn", threadId=1) == "the program is running"
        assert "program already" in await editor.fail("launch", program="program.tmc")
        assert "not supported" in await editor.fail("dance")
        await page.call(wire.SetBench("power", 0, 0))
        assert await editor.fail("continue", threadId=1) == "the module has no power"

    _go(tmp_path, scenario)


def test_a_message_that_is_none_closes_the_line_and_hurts_nobody(tmp_path):
    async def scenario(ide, page, editor):
        async with ide.socket("/dap") as stranger:
            await stranger.send("[1, 2")
            await stranger.wait_closed()
            assert stranger.close_code == wire.MALFORMED
        assert await editor.fail("evaluate", expression="")
        async with ide.socket("/dap") as stranger:
            await stranger.send("[]")
            assert '"success":false' in str(await stranger.recv())

    _go(tmp_path, scenario)


def test_a_window_may_leave_and_the_others_go_on(tmp_path):
    async def scenario(ide, page, editor):
        async with ide.debugger() as other:
            await other.do("disconnect")
        await _start(page)
        await page.until(lambda: page.state["program"]["state"] == 1)
        await editor.do("pause", threadId=1)
        assert (await editor.event("stopped"))["reason"] == "pause"

    _go(tmp_path, scenario)


def test_an_empty_program_is_not_downloaded(tmp_path):
    async def scenario(ide, page, editor):
        assert await page.refusal(wire.Download("program.tmc")) == "empty"

    _go(tmp_path, scenario, "// nothing yet\n")


def test_a_log_point_in_a_fast_loop_floods_nobody(tmp_path):
    async def scenario(ide, page, editor):
        await page.call(wire.Download("program.tmc"))
        await editor.breakpoints("program.tmc", {"line": 1, "logMessage": "again"})
        await page.call(wire.ControlProgram("run"))
        for _ in range(4):
            while "more messages" not in (await editor.event("output"))["output"]:
                pass

    _go(tmp_path, scenario, "Loop: CALC ADD, 1\nJA Loop\n")


def test_between_two_looks_a_window_is_sent_a_few_messages_and_how_many_more_there_were():
    debugger, sent = Debugger(None, None, None, None, None), []
    debugger._windows.add(DebugWindow(sent.append))
    message = event_of("output", category="console", output="again\n", line=1)
    for _ in range(2):
        sent.clear()
        for _ in range(MESSAGES + 5):
            debugger._deliver(Emission(message, None, {}, 0.0, None, False))
        debugger._tell_of_more()
        assert [event["body"]["output"] for event in sent] == [
            *["again\n"] * MESSAGES,
            "... and 5 more messages\n",
        ]


# Searches along the past

ROUNDS = """\
        SGP 1, 2, 7
Loop:   MVP ABS, 0, 20000
        WAIT POS, 0, 0
        MVP ABS, 0, 0
        WAIT POS, 0, 0
        CALC ADD, 1
        JA Loop
"""


@contextlib.contextmanager
def _threads_taken():
    """No search begins before the end of this."""
    asyncio.get_running_loop().set_default_executor(executor := ThreadPoolExecutor(1))
    released = threading.Event()
    executor.submit(released.wait)
    try:
        yield
    finally:
        released.set()


async def _after_a_minute(ide, page, editor):
    """The program is held, and its only write of variable 1 is long ago."""
    await _start(page)
    await page.until(lambda: page.state["program"]["state"] == 1)
    await ide.virtual.server.run_until(ide.virtual.rig.now + 60 * HZ)
    await editor.do("pause", threadId=1)
    await editor.event("stopped")


async def _who_wrote(editor):
    """The answer to come; the search has begun when a later request is answered."""
    return await editor.begin("evaluate", expression="who wrote gp[1]?", context="repl")


def test_hosts_and_pages_are_served_while_the_past_is_searched(tmp_path):
    async def scenario(ide, page, editor):
        await _after_a_minute(ide, page, editor)
        with _threads_taken():
            asked = await _who_wrote(editor)
            frames = (await editor.do("stackTrace", threadId=1))["stackFrames"]
            assert frames[0]["line"] > 1
            assert (await page.execute("GAP 4, 0"))["status"] == 100
            assert not asked.done()
        assert "SGP 1, 2, 7 (0 → 7)" in (await asked)["body"]["result"]
        assert (await editor.event("stopped"))["reason"] == "goto"
        await page.until(lambda: page.state["program"]["counter"] == 0)

    _go(tmp_path, scenario, ROUNDS)


def test_a_search_is_given_up_when_something_else_is_asked_for(tmp_path):
    async def scenario(ide, page, editor):
        await _after_a_minute(ide, page, editor)
        with _threads_taken():
            first = await _who_wrote(editor)
            await editor.do("threads")
            second = await editor.begin("stepBack", threadId=1)
            await editor.do("threads")
        answer = await first
        assert not answer["success"] and answer["message"].startswith("given up")
        assert (await second)["success"]
        assert (await editor.event("stopped"))["reason"] == "step"
        with _threads_taken():
            third = await _who_wrote(editor)
            await editor.do("threads")
            await page.call(wire.LeavePast())
        assert not (await third)["success"]
        assert not ide.virtual.past.shown

    _go(tmp_path, scenario, ROUNDS)


def test_breakpoints_are_not_kept_without_end(tmp_path):
    async def scenario():
        async with running(tmp_path) as ide, ide.debugger() as window:
            point = {"line": 1, "condition": "x" * 100_000}
            for number in range(10):
                assert await window.breakpoints(f"{number}.tmc", point)
            arguments = {"source": {"path": "last.tmc"}, "breakpoints": [point]}
            assert "remove others first" in await window.fail("setBreakpoints", **arguments)
            await window.breakpoints("0.tmc")
            assert await window.do("setBreakpoints", **arguments)

    asyncio.run(scenario())
