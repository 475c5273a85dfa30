"""A real module that is not armed: no window, debugger or terminal moves a motor or writes a value by the way."""

from __future__ import annotations

import asyncio

from ide.ide_driver import real, running
from ide.served import Bench
from tmcm34x.debug.dap import breakpoints, data_breakpoints, inspection, run_control
from tmcm34x.host import Connection
from tmcm34x.ide import wire
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.mnemonic import parse_instruction
from tmcm34x.tmcl.numbers import AP
from tmcm34x.tmcl.status import Status

PROGRAM = (
    "132",
    "ROR 0, 500",
    "SGP 5, 2, 77",
    "WAIT TICKS, 0, 100",
    "JA 0",
    "133",
    "SAP 1, 0, 7000",
    "SAP 0, 0, 7000",
)
GAP, GGP = 6, 10
CHANGING = {129, 130, 132, 133}
"""Global parameters that change by themselves or at each reading; 130 is the program counter."""


def known(module):
    """All that hosts can read of a module, beside what changes by itself."""
    asked = [Instruction(GAP, number, motor) for number in range(256) for motor in range(3)]
    asked += [
        Instruction(GGP, number, bank)
        for bank in (0, 2)
        for number in range(256)
        if bank or number not in CHANGING
    ]
    values = {each[:3]: module.peek(each)[1] for each in asked if module.peek(each)[0] == Status.OK}
    return values | {"state": module.program.state, "memory": module.eeprom.to_bytes()}


def _go(folder, scenario, *, armed=False):
    bench = Bench()

    async def run():
        remote, telegrams = await real(f"tcp://{bench.address}")
        async with running(folder, (remote, telegrams)) as ide, ide.page() as page:
            await page.call(wire.Arm(armed))
            await scenario(bench, ide, page)

    try:
        with Connection.open(f"tcp://{bench.address}") as host:
            for line in PROGRAM:
                host.ask(parse_instruction(line))
            while host.command(GAP, AP.ACTUAL_SPEED) or not host.command(GAP, AP.POSITION_REACHED):
                pass  # 7000 is where it was sent, and where it comes back to
        asyncio.run(run())
    finally:
        bench.stop()


ARGUMENTS = {
    "threadId": 1, "frameId": 0, "targetId": 1, "restart": True, "terminateDebuggee": False, "noDebug": False,
    "program": "a.tmc", "stopOnEntry": False, "variablesReference": 1, "name": "accumulator", "value": "500",
    "expression": "ap[target_speed][0]", "context": "repl", "source": {"path": "a.tmc"}, "line": 1, "column": 1,
    "breakpoints": [{"line": 1, "condition": "ap[target_speed][0] = 500", "logMessage": "{gp[5] = 9}"}],
    "filters": ["refused"], "memoryReference": "0", "offset": 0, "count": 4, "instructionCount": 4, "data": "AAAA",
    "text": "gp", "dataId": "gp[5][2]", "accessType": "write", "startFrame": 0, "levels": 20,
    "instructionReference": "0",
}  # fmt: skip


OF_THE_SESSION = {"initialize", "launch", "attach", "configurationDone", "restart", "terminate", "disconnect"}
TABLES = (breakpoints.REQUESTS, data_breakpoints.REQUESTS, inspection.REQUESTS, run_control.REQUESTS)


def test_no_request_of_a_debugger_moves_or_writes(tmp_path):
    async def scenario(bench, ide, page):
        before = known(bench.module)
        for command in sorted(OF_THE_SESSION.union(*TABLES)):
            async with ide.debugger() as window:
                await window.ask(command, **ARGUMENTS)
                await window.do("threads")
                await window.ask("evaluate", expression="gp[5]")
            assert known(bench.module) == before, command

    _go(tmp_path, scenario)


ASSIGNMENTS = (
    "ap[target_speed][0] = 500", "ap[4][0] = 77", "gp[5] = 9", "co[3][0] = 9", "out[0] = 1", "ROR 0, 500",
    "SAP 2, 0, 500", "MVP ABS, 0, 5000", "129", "130 0", "SGP 66, 0, 9", "gp[66][0] = 9", "137 0, 0, 1234",
)  # fmt: skip


CONTEXTS = ("repl", "watch", "hover", "clipboard", "variables", "")


def test_console_and_watches_of_a_module_that_is_not_armed_change_nothing(tmp_path):
    async def scenario(bench, ide, page):
        before = known(bench.module)
        async with ide.debugger() as window:
            for text in ASSIGNMENTS:
                target, _, value = text.partition(" = ")
                for context in CONTEXTS:
                    await window.ask("evaluate", expression=text, context=context)
                await window.ask("setExpression", expression=target, value=value or "500")
                await window.ask("setVariable", variablesReference=1, name=target, value=value or "500")
                assert known(bench.module) == before, text

    _go(tmp_path, scenario)


def test_what_cannot_be_undone_is_not_done_by_an_assignment(tmp_path):
    async def scenario(bench, ide, page):
        before = known(bench.module)
        async with ide.debugger() as window:
            for target in ("gp[81][0]", "gp[66][0]", "gp[65][0]", "gp[6][0]"):
                console = {"expression": f"{target} = 1", "context": "repl"}
                assert "ask first" in await window.fail("evaluate", **console)
                assert "ask first" in await window.fail("setExpression", expression=target, value="1")
        assert known(bench.module) == before

    _go(tmp_path, scenario, armed=True)


def test_a_motor_that_an_assignment_starts_is_stopped_with_the_server(tmp_path):
    async def scenario(bench, ide, page):
        async with ide.debugger() as window:
            await window.do("evaluate", expression="ap[target_position][1] = 4000000", context="repl")
        await page.until(lambda: page.state["motor1"]["speed"] == 1000)
        assert await ide.hub.authority.close() == ""
        assert bench.speed(1) == 0

    _go(tmp_path, scenario, armed=True)


LINES = (
    "MVP ABS, 0", "MVP ABS 0 5000", "ROR 0", "ROR 0, x500", "RUN", "run", "RUN 0", "SAP 2", "SAP, 2, 0, 500",
    "RFS START, 0", "RFS START", "nonsense", "5 2, 0, 500", "GAP 1, 0\rAROR 0, 500",
)  # fmt: skip


def test_no_line_of_the_terminal_moves_a_module_that_is_not_armed(tmp_path):
    """The module takes missing operands as 0: `MVP ABS, 0` without a position goes to 0."""

    async def scenario(bench, ide, page):
        await page.call(wire.Execute(139, sure=True))
        await page.until(lambda: not ide.hub.authority.armed)
        before = known(bench.module)
        for line in LINES:
            await page.refusal(wire.SendAscii(line))
        assert "BA 100 1000" in await page.call(wire.SendAscii("GAP 4, 0"))
        assert known(bench.module) == before
        await page.call(wire.SendAscii("BIN"))

    _go(tmp_path, scenario, armed=True)


MOTIONS = (
    wire.Turn(0, 300), wire.Jog(0, 300), wire.Profile(0, 100, 300, 100), wire.Zero(0), wire.Search(0), wire.Go(1, [0]),
    wire.Stride(0, 300), wire.ControlProgram("run"), wire.ExecuteText("ROR 0, 500"), wire.Execute(2, 0, 0, 500),
    wire.ExecuteText("SAP 0, 0, 500"), wire.ExecuteText("129"), wire.ExecuteText("RFS START, 0"),
)  # fmt: skip


def test_no_call_moves_a_module_that_is_not_armed(tmp_path):
    async def scenario(bench, ide, page):
        before = known(bench.module)
        for call in MOTIONS:
            assert await page.refusal(call) == "disarmed", call
            assert known(bench.module) == before, call

    _go(tmp_path, scenario)
