"""Going back in time as Visual Studio Code asks for it, in its order of messages, over the pipes of `tmcm34x dap`."""

import json
import re
import subprocess
from pathlib import Path

import pytest

from debug.vscode import COMMAND, VSCODE, Client, held

PLANTED = """\
        SAP   4, 0, 1500
        SCO   1, 0, 9000
        SGP   0, 2, 0
Loop:   CSUB  Work
        GGP   0, 2
        CALC  ADD, 1
        AGP   0, 2
        COMP  2000
        JC    LT, Loop
        MVP   COORD, 0, 1
        WAIT  POS, 0, 0
        STOP
Work:   GGP   0, 2
        COMP  37
        JC    NE, Done
        SCO   1, 0, 30000
Done:   RSUB
"""
"""A coordinate is overwritten by a subroutine; the carriage runs into its hard stop ten thousand commands later."""
PLANTED_LINE = 16
BENCH = """\
[[module]]
[[module.axis]]
load = { kind = "carriage", lead_mm = 5.0, low = -2.0, high = 7.0 }
"""
REPL = {"frameId": 0, "context": "repl"}


@pytest.fixture
def client():
    process = subprocess.Popen([COMMAND, "dap"], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    yield Client(process.stdout, process.stdin)
    process.stdin.close()
    process.wait(10)
    process.stdout.close()


@pytest.fixture
def planted(tmp_path):
    (tmp_path / "bench.toml").write_text(BENCH)
    path = tmp_path / "planted.tmc"
    path.write_text(PLANTED)
    return path


def launch(client, file, filters, lines=(), **settings):
    """What comes before the first stop; `filters` are the boxes that are checked, with their conditions."""
    capabilities = client.do("initialize", **VSCODE)
    client.send("launch", type="tmcl", request="launch", name="Here", program=str(file), **settings)
    client.event("initialized")
    source = {"name": file.name, "path": str(file)}
    if lines:
        wanted = [{"line": line} for line in lines]
        client.do(
            "setBreakpoints", source=source, lines=list(lines), breakpoints=wanted, sourceModified=False
        )
    client.do("setFunctionBreakpoints", breakpoints=[])
    client.do("setInstructionBreakpoints", breakpoints=[])
    assert capabilities["supportsExceptionFilterOptions"]
    options = [
        {"filterId": key, "condition": condition} if condition else {"filterId": key}
        for key, condition in filters.items()
    ]
    answer = client.do("setExceptionBreakpoints", filters=[], filterOptions=options)
    assert all(row["verified"] for row in answer["breakpoints"])
    client.do("configurationDone")
    return capabilities


def value(client, expression):
    return client.do("evaluate", expression=expression, frameId=0, context="watch")["result"]


def test_a_planted_bug_is_found_by_asking_who_wrote_the_coordinate(client, planted):
    bench = str(planted.with_name("bench.toml"))
    launch(client, planted, {"refused": "", "lost_steps": ""}, bench=bench)
    lines, *_ = held(client, "exception")
    assert lines == [11]
    crash = client.do("exceptionInfo", threadId=1)
    assert (crash["exceptionId"], crash["description"]) == ("lost_steps", "motor 0 loses steps")
    assert value(client, "co[1][0]") == "30000"
    after = int(value(client, "time_ms"))
    answer = client.do("evaluate", expression="who wrote co[1][0]?", **REPL)["result"]
    assert f"line {PLANTED_LINE}: SCO 1, 0, 30000 (9000 → 30000)" in answer
    lines, *_ = held(client, "goto")
    assert lines == [PLANTED_LINE, 4]
    assert (value(client, "gp[0]"), value(client, "co[1][0]")) == ("37", "9000")
    assert (after - int(value(client, "time_ms"))) * 10 > 10_000, "commands of 0.1 ms lie between"
    client.do("setVariable", **_variable(client, "Coordinates", "co[1][0]"), value="8000")
    client.do("goto", threadId=1, targetId=_label(client, planted, "Done"))
    held(client, "goto")
    client.do("continue", threadId=1)
    assert client.event("exited")["exitCode"] == 0
    client.do("disconnect", restart=False, terminateDebuggee=False)


def _variable(client, scope, name):
    """A variable as the editor names it."""
    frame = client.do("stackTrace", threadId=1, startFrame=0, levels=1)["stackFrames"][0]
    scopes = client.do("scopes", frameId=frame["id"])["scopes"]
    reference = next(row["variablesReference"] for row in scopes if row["name"] == scope)
    names = [row["name"] for row in client.do("variables", variablesReference=reference)["variables"]]
    assert name in names
    return {"variablesReference": reference, "name": name}


def _label(client, file, label):
    """The target of a jump, from what the editor offers at the first line."""
    source = {"name": file.name, "path": str(file)}
    targets = client.do("gotoTargets", source=source, line=1, column=1)["targets"]
    return next(row["id"] for row in targets if row["label"] == f"{label}:")


def test_steps_and_data_breakpoints_go_both_ways(client, planted):
    capabilities = launch(client, planted, {}, stopOnEntry=True)
    for name in (
        "supportsStepBack",
        "supportsDataBreakpoints",
        "supportsGotoTargetsRequest",
        "supportsRestartFrame",
    ):
        assert capabilities[name]
    held(client, "entry")
    info = client.do("dataBreakpointInfo", **_variable(client, "User variables", "gp[0]"))
    assert "write" in info["accessTypes"]
    wanted = [{"dataId": info["dataId"], "accessType": "write", "condition": "gp[0] > 0", "hitCondition": ""}]
    assert client.do("setDataBreakpoints", breakpoints=wanted)["breakpoints"][0]["verified"]
    for turn in ("1", "2"):
        client.do("continue", threadId=1)
        held(client, "data breakpoint")
        assert value(client, "gp[0]") == turn
    client.do("reverseContinue", threadId=1)
    held(client, "data breakpoint")
    assert value(client, "gp[0]") == "1"
    client.do("setDataBreakpoints", breakpoints=[])
    client.do("stepBack", threadId=1)
    assert held(client, "step")[0] == [7]
    assert value(client, "gp[0]") == "0"
    for line in (6, 5, 4):
        client.do("stepBack", threadId=1, granularity="line")
        assert held(client, "step")[0] == [line], "a subroutine counts as one"
    client.do("stepIn", threadId=1)
    assert held(client, "step")[0] == [13, 4]
    client.do("next", threadId=1)
    lines, *_ = held(client, "step")
    frames = client.do("stackTrace", threadId=1, startFrame=0, levels=2)["stackFrames"]
    client.do("restartFrame", frameId=frames[0]["id"])
    assert lines == [14, 4] and held(client, "restart")[0] == [13, 4]
    client.do("reverseContinue", threadId=1)
    assert held(client, "entry")[0] == [1]


def test_a_position_window_and_a_switch_hold_with_their_conditions(client, planted):
    bench = planted.with_name("bench.toml")
    bench.write_text(BENCH + "switch.right = { position = 3.0 }\n")
    launch(client, planted, {"switch": "gp[0] == 2000"}, bench=str(bench), stopOnEntry=True)
    held(client, "entry")
    info = client.do("dataBreakpointInfo", name="ap[actual_position][0] passes 5000", asAddress=False)
    wanted = [{"dataId": info["dataId"], "accessType": "write"}]
    assert client.do("setDataBreakpoints", breakpoints=wanted)["breakpoints"][0]["verified"]
    client.do("continue", threadId=1)
    held(client, "data breakpoint")
    assert value(client, "ap[1][0]") == "5000"
    client.do("continue", threadId=1)
    held(client, "exception")
    assert "right switch of motor 0" in client.do("exceptionInfo", threadId=1)["description"]
    assert int(value(client, "ap[1][0]")) > 5000
    client.do("reverseContinue", threadId=1)
    held(client, "data breakpoint")
    assert value(client, "ap[1][0]") == "5000"
    client.do("reverseContinue", threadId=1)
    assert held(client, "entry")[0] == [1]


def test_the_editor_is_told_every_label_to_go_to(client, planted):
    launch(client, planted, {}, stopOnEntry=True)
    held(client, "entry")
    source = {"name": planted.name, "path": str(planted)}
    targets = client.do("gotoTargets", source=source, line=10, column=3)["targets"]
    assert [(row["label"], row["line"]) for row in targets] == [
        ("9: MVP COORD, 0, 1", 10), ("Loop:", 4), ("Work:", 13), ("Done:", 17),
    ]  # fmt: skip


def test_the_extension_offers_what_the_adapter_can():
    folder = Path(__file__).parents[2] / "editors" / "vscode"
    contributes = json.loads((folder / "package.json").read_text())["contributes"]
    assert {"language": "tmcl"} in contributes["breakpoints"]
    commands = {row["command"] for row in contributes["commands"]}
    used = {row["command"] for rows in contributes["menus"].values() for row in rows}
    assert used <= commands
    script = (folder / "extension.js").read_text()
    assert all(re.search(rf'registerCommand\(\s*"{command}"', script) for command in commands)
