import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from debug.debuggees import CRASH, CULPRIT, PLANTED
from tmcm34x.bench import simple_rig
from tmcm34x.cli.dap import SERVICES
from tmcm34x.clock import MS, run_until
from tmcm34x.debug.dap import Adapter
from tmcm34x.debug.dap.messages import Framing, FramingError, frame
from tmcm34x.debug.sessions.base import SourceMap
from tmcm34x.debug.sessions.live import LiveSession
from tmcm34x.tmcl.commands import BY_MNEMONIC
from tmcm34x.toolchain.assembler import assemble
from tmcm34x.toolchain.image import pack_binary

PROGRAM = """\
Speed = 1200
        SAP   4, 0, Speed
Loop:   CSUB  Move
        GGP   1, 2
        COMP  3
        JC    LT, Loop
        STOP
Move:   MVP   REL, 0, 2000
        WAIT  POS, 0, 0
        GGP   1, 2
        CALC  ADD, 1
        AGP   1, 2
        RSUB
"""


class Editor:
    """Talks to an adapter in this process."""

    def __init__(self, services=SERVICES):
        self.messages = []
        self.adapter = Adapter(self.messages.append, services)
        self.seq = 0

    def ask(self, command, **arguments):
        """The response to a request."""
        self.seq += 1
        self.adapter.handle({"seq": self.seq, "type": "request", "command": command, "arguments": arguments})
        return next(m for m in self.messages if m.get("request_seq") == self.seq)

    def do(self, command, **arguments):
        """The body of the response to a request that succeeds."""
        response = self.ask(command, **arguments)
        assert response["success"], response
        return response.get("body")

    def fail(self, command, **arguments):
        """The message of the response to a request that fails."""
        response = self.ask(command, **arguments)
        assert not response["success"], response
        assert "\n" not in response["message"]
        return response["message"]

    def run(self):
        while self.adapter.work() < math.inf:
            pass

    def events(self, name):
        return [m["body"] for m in self.messages if m["type"] == "event" and m["event"] == name]

    def go(self, command="continue"):
        """Go on until the program is held or over; why."""
        before = len(self.events("stopped"))
        self.do(command, threadId=1)
        self.run()
        stops = self.events("stopped")[before:]
        return stops[0]["reason"] if stops else "over"

    def line(self):
        return self.do("stackTrace", threadId=1)["stackFrames"][0]["line"]

    def value(self, expression):
        return self.do("evaluate", expression=expression, context="watch")["result"]

    def scope(self, name):
        frame = self.do("stackTrace", threadId=1)["stackFrames"][0]["id"]
        scopes = self.do("scopes", frameId=frame)["scopes"]
        return next(scope["variablesReference"] for scope in scopes if scope["name"] == name)

    def outputs(self):
        return "".join(body["output"] for body in self.events("output"))


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "program.tmc"
    path.write_text(PROGRAM)
    return path


def launched(file, *lines, **options):
    editor = Editor()
    editor.do("initialize", adapterID="tmcl")
    editor.do("launch", program=str(file), **options)
    answer = editor.do("setBreakpoints", source={"path": str(file)}, breakpoints=[{"line": n} for n in lines])
    assert all(b["verified"] for b in answer["breakpoints"])
    editor.do("setExceptionBreakpoints", filters=["refused"])
    editor.do("configurationDone")
    return editor


def test_a_session_goes_as_editors_expect(file):
    editor = launched(file, 4, stopOnEntry=True)
    assert editor.events("initialized") == [{}]
    assert editor.events("stopped")[0]["reason"] == "entry"
    assert editor.do("threads")["threads"] == [{"id": 1, "name": "TMCL program"}]
    assert (editor.line(), editor.go("next"), editor.line()) == (2, "step", 3)
    assert (editor.go("stepIn"), editor.line()) == ("step", 8)
    frames = editor.do("stackTrace", threadId=1)
    assert [f["name"] for f in frames["stackFrames"]] == ["Move", "program"]
    assert [f["line"] for f in frames["stackFrames"]] == [8, 3]
    assert frames["stackFrames"][0]["source"]["path"] == str(file)
    assert len(editor.do("stackTrace", threadId=1, startFrame=1, levels=5)["stackFrames"]) == 1
    assert (editor.go("stepOut"), editor.line(), editor.value("gp[1]")) == ("breakpoint", 4, "1")
    assert editor.events("stopped")[-1]["hitBreakpointIds"] == [1]
    assert [editor.go() for _ in range(3)] == ["breakpoint", "breakpoint", "over"]
    assert editor.events("exited") == [{"exitCode": 0}]
    assert editor.events("terminated") == [{}]
    editor.do("disconnect")
    assert editor.adapter.over


def test_events_come_after_the_response_that_brings_them_about(file):
    editor = launched(file, stopOnEntry=True)
    kinds = [m.get("command") or m.get("event") for m in editor.messages]
    assert kinds.index("launch") < kinds.index("initialized")
    assert kinds.index("configurationDone") < kinds.index("stopped")
    assert [m["seq"] for m in editor.messages] == list(range(1, len(editor.messages) + 1))


def test_breakpoints_move_to_the_next_command_or_are_refused(file):
    editor = Editor()
    editor.do("launch", program=str(file))
    wanted = [
        {"line": 1},
        {"line": 99},
        {"line": 4, "condition": "1 +"},
        {"line": 4, "hitCondition": "now and then"},
    ]
    answers = editor.do("setBreakpoints", source={"path": str(file)}, breakpoints=wanted)["breakpoints"]
    assert [(b["verified"], b["line"]) for b in answers] == [(True, 2), (False, 99), (True, 4), (True, 4)]
    assert "no command" in answers[1]["message"]
    other = editor.do("setBreakpoints", source={"path": "/nowhere.tmc"}, breakpoints=[{"line": 1}])
    assert not other["breakpoints"][0]["verified"]
    lines = editor.do("breakpointLocations", source={"path": str(file)}, line=1, endLine=4)["breakpoints"]
    assert [b["line"] for b in lines] == [2, 3, 4]


def test_conditions_log_points_labels_and_addresses(file):
    editor = launched(file)
    editor.adapter.handle({})  # whatever comes between
    editor = Editor()
    editor.do("launch", program=str(file))
    editor.do(
        "setBreakpoints",
        source={"path": str(file)},
        breakpoints=[{"line": 4, "condition": "gp[1] == 2"}, {"line": 5, "logMessage": "turn {gp[1]}"}],
    )
    labels = editor.do(
        "setFunctionBreakpoints", breakpoints=[{"name": "move", "hitCondition": "== 3"}, {"name": "No"}]
    )
    assert [b["verified"] for b in labels["breakpoints"]] == [True, False]
    editor.do("setInstructionBreakpoints", breakpoints=[{"instructionReference": "0x5"}])
    editor.do("configurationDone")
    editor.run()
    assert (editor.line(), editor.value("gp[1]")) == (4, "2")
    assert (editor.go(), editor.line()) == ("breakpoint", 8)
    assert (editor.go(), editor.line()) == ("breakpoint", 7)
    assert [o["output"] for o in editor.events("output")] == ["turn 1\n", "turn 2\n", "turn 3\n"]
    assert editor.events("output")[0]["line"] == 5


def test_values_are_shown_and_set(file):
    editor = launched(file, 4)
    editor.run()
    registers = editor.scope("Registers")
    shown = {v["name"]: v["value"] for v in editor.do("variables", variablesReference=registers)["variables"]}
    assert (shown["accumulator"], shown["counter"], shown["depth"]) == ("1", "2", "0")
    assert editor.do("setVariable", variablesReference=registers, name="x", value="$10")["value"] == "16"
    assert "no value named y" in editor.fail("setVariable", variablesReference=registers, name="y", value="1")
    variables = editor.scope("User variables")
    assert (
        editor.do("setVariable", variablesReference=variables, name="gp[1]", value="x - 13")["value"] == "3"
    )
    assert editor.do("setExpression", expression="ap[4][2]", value="speed / 2")["value"] == "600"
    assert "invalid value" in editor.fail("setExpression", expression="ap[4][2]", value="5000")
    motor = editor.do("variables", variablesReference=editor.scope("Motor 0"))["variables"]
    rows = {row["name"]: row for row in motor}
    assert rows["actual_position"]["value"] == "2000"
    assert rows["ramp_mode"]["value"] == "0 (position)"
    assert rows["position_reached"]["presentationHint"] == {"attributes": ["readOnly"]}
    assert rows["load_value"]["value"] in "01234567"
    hexadecimal = editor.do("variables", variablesReference=motor and registers, format={"hex": True})[
        "variables"
    ]
    assert {v["name"]: v["value"] for v in hexadecimal}["x"] == "$10"
    lines = editor.scope("Inputs and outputs")
    assert editor.do("setVariable", variablesReference=lines, name="in[2]", value="1")["value"] in "01"
    assert editor.go() == "over"


def test_references_of_an_earlier_stop_are_refused(file):
    editor = launched(file, 4)
    editor.run()
    registers = editor.scope("Registers")
    editor.go()
    assert "earlier stop" in editor.fail("variables", variablesReference=registers)


def test_the_console_takes_commands_assignments_and_expressions(file):
    editor = launched(file, 4)
    editor.run()

    def console(text):
        return editor.do("evaluate", expression=text, context="repl")["result"]

    assert console("GAP 1, 0") == "2000"
    assert console("mvp abs, 1, 1000") == "status 100: successfully executed"
    assert console("gp[7] = gp[1] + 41") == "42"
    assert console("gp[7] == 42") == "1"
    assert editor.value("Loop") == "1"
    assert "status 4" in editor.fail("evaluate", expression="SAP 4, 0, 9999", context="repl")
    assert "needs 3 operands" in editor.fail("evaluate", expression="MVP ABS", context="repl")
    assert "not expected" in editor.fail("evaluate", expression="MVP ABS, 1, 0", context="hover")
    labels = [t["label"] for t in editor.do("completions", text="1 + L", column=6)["targets"]]
    assert labels == ["Loop"]
    assert editor.do("completions", text="", column=1)["targets"] == []


def test_a_refused_command_stops_the_program(tmp_path):
    file = tmp_path / "bad.tmc"
    file.write_text("        SAP 4, 0, 5000\n        STOP\n")
    editor = launched(file)
    editor.run()
    assert (editor.events("stopped")[-1]["reason"], editor.line()) == ("exception", 1)
    assert editor.do("exceptionInfo", threadId=1)["description"] == "SAP 4, 0, 5000: invalid value (status 4)"
    assert editor.go() == "over"
    assert editor.events("exited") == [{"exitCode": 3}]


def test_mistakes_in_the_source_fail_the_launch(tmp_path):
    file = tmp_path / "bad.tmc"
    file.write_text("        SAP 4, 0\n        JUMP 3\n")
    editor = Editor()
    assert "2 errors" in editor.fail("launch", program=str(file))
    assert [(o["category"], o["line"]) for o in editor.events("output")] == [("stderr", 1), ("stderr", 2)]
    assert editor.events("output")[0]["source"]["path"] == str(file)
    assert not editor.events("initialized")
    assert "launch or attach first" in editor.fail("stackTrace", threadId=1)
    file.write_text("")
    assert "holds no program" in editor.fail("launch", program=str(file))
    file.write_text("STOP\n")
    editor.do("launch", program=str(file))


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"program": "/nowhere.tmc"}, "No such file"),
        ({"model": 340}, "341, 342, 343"),
        ({"bench": "/nowhere.toml"}, "nowhere.toml"),
        ({"speed": -1}, "speed"),
        ({"program": 3}, "program"),
    ],
)
def test_a_launch_that_cannot_be_says_why(file, options, text):
    assert text in Editor().fail("launch", **{"program": str(file), **options})


def test_restart_takes_the_source_as_it_is_now(file):
    editor = launched(file, 4)
    editor.run()
    file.write_text("// one more line\n" + PROGRAM.replace("ADD, 1", "ADD, 2"))
    editor.do("restart")
    editor.run()
    assert (editor.line(), editor.value("gp[1]"), editor.value("time_ms")) == (4, "0", "0")
    moved = editor.events("breakpoint")[-1]
    assert (moved["reason"], moved["breakpoint"]["id"], moved["breakpoint"]["line"]) == ("changed", 1, 4)
    file.write_text("nonsense\n")
    assert "error" in editor.fail("restart")
    assert editor.line() == 4


def test_stop_at_end_lets_one_look(file):
    editor = launched(file, stopAtEnd=True)
    editor.run()
    assert editor.events("stopped")[-1]["description"] == "The program has stopped"
    assert editor.value("ap[1][0]") == "6000"
    assert editor.go() == "over"
    assert editor.events("terminated")


def test_no_debug_just_runs(file):
    editor = launched(file, 4, stopOnEntry=True, noDebug=True)
    editor.run()
    assert not editor.events("stopped") and editor.events("terminated")


def test_going_on_elsewhere(file):
    editor = launched(file, stopOnEntry=True)
    target = editor.do("gotoTargets", source={"path": str(file)}, line=7)["targets"][0]
    assert target["line"] == 7
    editor.do("goto", threadId=1, targetId=target["id"])
    assert (editor.events("stopped")[-1]["reason"], editor.line(), editor.go()) == ("goto", 7, "over")
    assert editor.value("gp[1]") == "0"


def test_labels_are_places_to_go_on_at(file):
    editor = launched(file, stopOnEntry=True)
    targets = editor.do("gotoTargets", source={"path": str(file)}, line=7)["targets"]
    assert [target["label"] for target in targets[1:]] == ["Loop:", "Move:"]
    editor.do("goto", threadId=1, targetId=targets[2]["id"])
    assert editor.line() == 8


def test_a_frame_begins_anew(file):
    editor = launched(file, 10, stopOnEntry=True)
    assert (editor.go(), editor.line()) == ("breakpoint", 10)
    frame = editor.do("stackTrace", threadId=1)["stackFrames"][0]["id"]
    editor.do("restartFrame", frameId=frame)
    assert (editor.events("stopped")[-1]["reason"], editor.line()) == ("restart", 8)


def test_data_breakpoints_hold_after_a_change(file):
    editor = launched(file, stopOnEntry=True)
    info = editor.do("dataBreakpointInfo", name="gp[1]", variablesReference=editor.scope("User variables"))
    assert (info["dataId"], info["accessTypes"]) == ("gp[1]", ["write"])
    wanted = [{"dataId": "gp[1]", "hitCondition": "2"}, {"dataId": "gp[1"}]
    first, second = editor.do("setDataBreakpoints", breakpoints=wanted)["breakpoints"]
    assert first["verified"] and not second["verified"] and second["message"]
    assert (editor.go(), editor.value("gp[1]")) == ("data breakpoint", "2")
    assert editor.events("stopped")[-1]["text"] == "gp[1]: 1 → 2"
    editor.do("setDataBreakpoints", breakpoints=[])
    assert editor.go() == "over"


def test_a_position_that_is_passed_is_a_data_breakpoint(file):
    editor = launched(file, stopOnEntry=True)
    name = "ap[target_position][0] passes 3000"
    assert editor.do("dataBreakpointInfo", name=name)["dataId"] == name
    assert editor.do("dataBreakpointInfo", name="ap[999][0]") == {
        "dataId": None, "description": "ap: 999 is not 0 to 255",
    }  # fmt: skip
    editor.do("setDataBreakpoints", breakpoints=[{"dataId": name}])
    assert (editor.go(), editor.line()) == ("data breakpoint", 9)


def test_steps_go_back_and_a_run_goes_back_to_a_breakpoint(file):
    editor = launched(file, 10, stopOnEntry=True)
    assert [editor.go(), editor.go(), editor.value("gp[1]")] == ["breakpoint", "breakpoint", "1"]
    assert (editor.go("stepBack"), editor.line()) == ("step", 9)
    assert (editor.go("reverseContinue"), editor.line(), editor.value("gp[1]")) == ("breakpoint", 10, "0")
    assert editor.go("reverseContinue") == "entry"
    assert editor.events("stopped")[-1]["text"] == "the beginning of the history: nothing held before"
    assert [editor.go(), editor.go(), editor.go(), editor.go()] == [*["breakpoint"] * 3, "over"]


def test_a_step_back_over_a_call_and_into_it(file):
    editor = launched(file, 4, stopOnEntry=True)
    assert (editor.go(), editor.line()) == ("breakpoint", 4)
    assert (editor.go("stepBack"), editor.line()) == ("step", 3)
    assert (editor.go(), editor.line()) == ("breakpoint", 4)
    editor.do("stepBack", threadId=1, granularity="instruction")
    assert editor.line() == 13


def test_a_planted_bug_is_found_by_asking_who_wrote_a_value(tmp_path):
    file = tmp_path / "planted.tmc"
    file.write_text(PLANTED)
    editor = launched(file, CRASH)
    editor.run()
    assert (editor.events("stopped")[-1]["reason"], editor.line()) == ("breakpoint", CRASH)
    asked = {"expression": "who wrote co[5][0]?", "context": "repl"}
    assert f"line {CULPRIT}: SCO 5, 0, 900 (200 → 900)" in editor.do("evaluate", **asked)["result"]
    assert (editor.events("stopped")[-1]["reason"], editor.line()) == ("goto", CULPRIT)
    assert editor.value("co[5][0]") == "200"
    assert (editor.go("stepBack"), editor.line()) == ("step", CULPRIT - 1)
    assert (editor.go("reverseContinue"), editor.value("gp[3]")) == ("entry", "0")
    assert (editor.go(), editor.line()) == ("breakpoint", CRASH)


def test_who_wrote_a_value_is_answered_in_the_console(file):
    editor = launched(file, 7, stopOnEntry=True)
    editor.go()
    answer = editor.do("evaluate", expression="who wrote gp[1]?", context="repl")["result"]
    assert "line 12: AGP" in answer and answer.endswith("(2 → 3)")
    nothing = editor.do("evaluate", expression="who wrote gp[9]", context="repl")["result"]
    assert nothing == "nothing has written gp[9] since the history began"
    editor.do("evaluate", expression="gp[1] = 8", context="repl")
    answer = editor.do("evaluate", expression="WHO WROTE gp[1]?", context="repl")["result"]
    assert "debugger: gp[1] = 8" in answer
    assert "no value named" in editor.fail("evaluate", expression="who wrote nonsense?", context="repl")
    assert "Name a value" in editor.fail("evaluate", expression="who wrote?", context="repl")


def test_a_module_with_hosts_cannot_go_back_and_says_why():
    rig = simple_rig()
    rig.modules[0].eeprom.write_program(assemble("Loop: JA Loop\n").program)
    editor = Editor(SERVICES._replace(live=lambda listener: LiveSession(rig.modules[0], listener)))
    editor.do("initialize", adapterID="tmcl")
    editor.do("attach")
    editor.do("configurationDone")
    assert editor.events("capabilities") == [{"capabilities": {"supportsStepBack": False}}]
    assert "its hosts would not go back" in editor.fail("stepBack", threadId=1)
    assert "its hosts would not go back" in editor.fail(
        "evaluate", expression="who wrote gp[1]", context="repl"
    )


def test_pausing_an_endless_program(tmp_path):
    file = tmp_path / "endless.tmc"
    file.write_text("Loop: JA Loop\n")
    editor = launched(file)
    editor.run()
    assert "running" in editor.fail("next", threadId=1)
    editor.do("pause", threadId=1)
    assert (editor.events("stopped")[-1]["reason"], editor.line()) == ("pause", 1)
    editor.do("terminate")
    assert editor.events("terminated") == [{}]


def test_disassembly_has_all_addresses(file):
    editor = launched(file, stopOnEntry=True)
    rows = editor.do("disassemble", memoryReference="0x1", instructionOffset=-3, instructionCount=6)[
        "instructions"
    ]
    assert [row["instruction"] for row in rows] == [
        "??",
        "??",
        "SAP 4, 0, 1200",
        "CSUB Move",
        "GGP 1, 2",
        "COMP 3",
    ]
    assert (rows[3]["symbol"], rows[3]["line"], rows[3]["location"]["path"]) == ("Loop", 3, str(file))
    assert "no address" in editor.fail("disassemble", memoryReference="here", instructionCount=1)


def test_an_image_is_shown_disassembled(tmp_path):
    file = tmp_path / "program.bin"
    file.write_bytes(pack_binary(assemble(PROGRAM).program))
    editor = Editor()
    editor.do("launch", program=str(file), stopOnEntry=True)
    editor.do("configurationDone")
    frame_ = editor.do("stackTrace", threadId=1)["stackFrames"][0]
    assert frame_["source"]["sourceReference"] == 1
    content = editor.do("source", sourceReference=1)["content"]
    assert "SAP" in content.splitlines()[0]
    answer = editor.do("setBreakpoints", source={"sourceReference": 1}, breakpoints=[{"line": 3}])
    assert answer["breakpoints"][0]["verified"]
    assert editor.go() == "breakpoint"
    assert editor.do("loadedSources")["sources"][0]["sourceReference"] == 1


def test_included_files_are_sources_too(tmp_path):
    (tmp_path / "sub.tmc").write_text("Sub:    SGP 1, 2, 7\n        RSUB\n")
    file = tmp_path / "main.tmc"
    file.write_text("        CSUB Sub\n        STOP\n#include sub.tmc\n")
    editor = Editor()
    editor.do("launch", program=str(file))
    included = str(tmp_path / "sub.tmc")
    editor.do("setBreakpoints", source={"path": included}, breakpoints=[{"line": 1}])
    editor.do("configurationDone")
    editor.run()
    frames = editor.do("stackTrace", threadId=1)["stackFrames"]
    assert [f["source"]["path"] for f in frames] == [included, str(file)]
    assert len(editor.do("loadedSources")["sources"]) == 2


def test_a_path_that_leads_nowhere_is_refused_or_unknown(tmp_path, file):
    (tmp_path / "circle.tmc").symlink_to("circle.tmc")
    (tmp_path / "broken.tmc").symlink_to("nowhere.tmc")
    (tmp_path / "disassembly.tmc").symlink_to("circle.tmc")
    missing = [str(tmp_path / name) for name in ("circle.tmc", "broken.tmc", "circle.tmc/x.tmc", "x" * 300)]
    for path in (*missing, str(tmp_path), "a\0b", ""):
        Editor().fail("launch", program=path)
    editor = Editor()
    for folder in (*missing, "a\0b"):
        editor.fail("launch", program=str(file), include=[folder], bench=folder)
    editor.do("launch", program=str(file), include=missing)
    for path in missing:
        answer = editor.do("setBreakpoints", source={"path": path}, breakpoints=[{"line": 1}])
        assert not answer["breakpoints"][0]["verified"]
    assert "no path" in editor.fail("setBreakpoints", source={"path": "a\0b"}, breakpoints=[{"line": 1}])


def test_real_time_is_kept(file):
    class Clock:
        now_s = 0.0

    def pace(speed):
        from tmcm34x.server.pace import Pace

        return Pace(speed, lambda: Clock.now_s)

    editor = Editor(SERVICES._replace(pace=pace))
    file.write_text("        WAIT TICKS, 0, 100\n        STOP\n")
    editor.do("launch", program=str(file), speed=1.0)
    editor.do("configurationDone")
    wait_s = editor.adapter.work()
    assert 0 < wait_s < 0.01
    Clock.now_s = 0.5
    assert editor.adapter.work() == pytest.approx(0.5, abs=0.01)
    editor.do("pause")
    assert editor.value("time_ms") == "500"
    Clock.now_s = 100.0
    editor.do("continue", threadId=1)
    assert editor.adapter.work() == pytest.approx(0.5, abs=0.01)
    assert editor.value("time_ms") == "500"
    Clock.now_s = 101.0
    editor.run()
    assert editor.events("terminated")


def test_lines_are_counted_as_the_editor_wants(file):
    editor = Editor()
    editor.do("initialize", adapterID="tmcl", linesStartAt1=False)
    editor.do("launch", program=str(file), stopOnEntry=True)
    answer = editor.do("setBreakpoints", source={"path": str(file)}, breakpoints=[{"line": 3}])
    assert answer["breakpoints"][0]["line"] == 3
    editor.do("configurationDone")
    assert (editor.line(), editor.go(), editor.line()) == (1, "breakpoint", 3)


@pytest.mark.parametrize(
    "message",
    [
        None,
        3,
        "hello",
        [],
        {},
        {"seq": "x"},
        {"seq": 1, "type": "request"},
        {"seq": 1, "type": "request", "command": 7},
        {"seq": 1, "type": "request", "command": "fly"},
        {"seq": 1, "type": "request", "command": "launch"},
        {"seq": 1, "type": "request", "command": "launch", "arguments": []},
        {"seq": 1, "type": "request", "command": "launch", "arguments": {"program": None}},
        {"seq": 1, "type": "request", "command": "launch", "arguments": {"program": "a\0b"}},
        {"seq": 1, "type": "request", "command": "attach", "arguments": {}},
        {"seq": 1, "type": "request", "command": "attach", "arguments": {"port": "/nowhere"}},
        {"seq": 1, "type": "request", "command": "attach", "arguments": {"port": "a\0b"}},
        {"seq": 1, "type": "request", "command": "variables", "arguments": {"variablesReference": 1}},
    ],
)
def test_what_is_no_request_gets_an_error_response(message):
    editor = Editor()
    editor.adapter.handle(message)
    (response,) = editor.messages
    assert (response["type"], response["success"]) == ("response", False)
    assert response["message"] and "\n" not in response["message"]


JSON = st.recursive(
    st.none() | st.booleans() | st.integers(-5, 3000) | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3),
)
FIELDS = (
    "source", "breakpoints", "lines", "line", "variablesReference", "name", "value", "expression", "context", "text",
    "column", "targetId", "memoryReference", "instructionCount", "startFrame", "levels", "filters", "frameId",
)  # fmt: skip
COMMANDS = (
    "setBreakpoints", "setFunctionBreakpoints", "setInstructionBreakpoints", "stackTrace", "scopes", "variables",
    "setVariable", "setExpression", "evaluate", "completions", "goto", "gotoTargets", "disassemble", "source",
    "breakpointLocations", "continue", "next", "stepIn", "stepOut", "pause", "exceptionInfo", "loadedSources",
    "configurationDone", "setExceptionBreakpoints", "dataBreakpointInfo", "setDataBreakpoints", "restartFrame",
    "stepBack", "reverseContinue",
)  # fmt: skip


@settings(max_examples=60)
@given(
    st.lists(
        st.tuples(
            st.sampled_from(COMMANDS),
            st.dictionaries(
                st.sampled_from(FIELDS),
                JSON
                | st.just({"path": "program.tmc"})
                | st.lists(st.just({"line": 3}), max_size=2)
                | st.sampled_from(["gp[1]", "x", "0x3", "GAP 1, 0", "x = 3", "repl"]),
            ),
        ),
        max_size=20,
    )
)
def test_any_requests_in_any_order_get_one_response_each(requests):
    def read_program(path, _include, _model):
        return assemble(PROGRAM, path)

    editor = Editor(SERVICES._replace(read_program=read_program))
    editor.do("launch", program="program.tmc")
    for command, arguments in requests:
        editor.ask(command, **arguments)
        editor.adapter.work()
    responses = [m["request_seq"] for m in editor.messages if m["type"] == "response"]
    assert responses == list(range(1, len(requests) + 2))


def test_messages_come_whole_out_of_pieces():
    data = frame({"a": "ü"}) + frame({"b": 1}) + b"Content-Length: 3\r\n\r\n{x}"
    framing = Framing()
    found = [message for byte in data for message in framing.feed(bytes([byte]))]
    assert found == [{"a": "ü"}, {"b": 1}, None]
    assert list(Framing().feed(data)) == found


@pytest.mark.parametrize(
    "data",
    [
        b"GET / HTTP/1.1\r\n\r\n",
        b"Content-Length: 99999999\r\n\r\n",
        b"x" * 5000,
        b"Content-Length: -1\r\n\r\n",
    ],
)
def test_bytes_that_are_no_messages_end_the_line(data):
    with pytest.raises(FramingError):
        list(Framing().feed(data))


def live(source):
    rig = simple_rig()
    module = rig.modules[0]
    assembly = assemble(source, "live.tmc")
    module.eeprom.write_program(assembly.program)
    services = SERVICES._replace(
        live=lambda listener: LiveSession(module, listener, SourceMap(assembly), rig.worlds[0])
    )
    return rig, Editor(services)


def test_a_module_of_somebody_elses_bench_is_debugged_in_passing():
    rig, editor = live("Loop: SGP 1, 2, 1\n      ROR 0, 100\n      WAIT TICKS, 0, 10\n      JA Loop\n")
    editor.do("attach")
    assert editor.do("setBreakpoints", source={"path": "live.tmc"}, breakpoints=[{"line": 3}])["breakpoints"][
        0
    ]["verified"]
    editor.do("configurationDone")
    editor.do("continue", threadId=1)
    run_until(rig, 100 * MS)
    assert (editor.events("stopped")[-1]["reason"], editor.line()) == ("breakpoint", 3)
    editor.do("next", threadId=1)
    run_until(rig, 300 * MS)
    assert (editor.events("stopped")[-1]["reason"], editor.line()) == ("step", 4)
    editor.do("restart")
    run_until(rig, 400 * MS)
    assert editor.line() == 3
    editor.do("disconnect", terminateDebuggee=True)
    assert not rig.modules[0].program.hooked


def test_the_console_knows_every_mnemonic(file):
    editor = launched(file, stopOnEntry=True)
    for mnemonic in BY_MNEMONIC:
        response = editor.ask("evaluate", expression=f"{mnemonic} 0, 0, 0", context="repl")
        assert response["success"] or response["message"]


def test_the_last_line_says_how_it_ended(file):
    file.write_text("WAIT TICKS, 0, 3\nSTOP\n")
    editor = launched(file)
    editor.run()
    assert editor.outputs().splitlines()[-1] == "The program has ended after 30 ms of the module's time."
    file.write_text("SAP 4, 0, 5000\nJA 7\n")
    editor = launched(file)
    editor.do("setExceptionBreakpoints", filters=[])
    editor.run()
    last = editor.outputs().splitlines()[-1]
    assert last.endswith(": the program ran past its end; is a STOP missing?")
    file.write_text("Loop: JA Loop\n")
    editor = launched(file)
    editor.do("terminate")
    assert editor.outputs().splitlines()[-1].startswith("The program was stopped after")


def test_errors_of_values_are_shown_in_their_place_and_others_in_a_dialog(file):
    editor = launched(file)
    shown = {
        command: editor.ask(command, **arguments)["body"]["error"]["showUser"]
        for command, arguments in (
            ("evaluate", {"expression": "nonsense"}),
            ("setExpression", {"expression": "nonsense", "value": "1"}),
            ("dance", {}),
        )
    }
    assert shown == {"evaluate": False, "setExpression": False, "dance": True}


@pytest.mark.parametrize(("model", "value"), [(341, 43), (342, 42), (343, 43)])
def test_conditions_ask_for_the_model_that_is_launched(tmp_path, model, value):
    file = tmp_path / "program.tmc"
    file.write_text("#if MODEL == 342\nSGP 10, 2, 42\n#else\nSGP 10, 2, 43\n#endif\nSTOP\n")
    editor = launched(file, 6, model=model, stopOnEntry=True)
    assert editor.go() == "breakpoint"
    assert editor.value("gp[10]") == str(value)


def test_breaks_are_filters_of_exceptions_with_conditions(tmp_path):
    path = tmp_path / "errors.tmc"
    path.write_text(
        "        SAP 4, 0, 9999\n        WAIT REFSW, 0, 1\n        WAIT REFSW, 0, 1\n        STOP\n"
    )
    editor = Editor()
    filters = editor.do("initialize", adapterID="tmcl")["exceptionBreakpointFilters"]
    assert [row["filter"] for row in filters if row["default"]] == ["refused"]
    assert all(row["label"] and row["description"] and row["supportsCondition"] for row in filters)
    editor.do("launch", program=str(path))
    answers = editor.do(
        "setExceptionBreakpoints",
        filters=["stall"],
        filterOptions=[
            {"filterId": "flag", "condition": "counter == 2"},
            {"filterId": "switch", "condition": "gp["},
            {"filterId": "thunder"},
        ],
    )["breakpoints"]
    assert [answer["verified"] for answer in answers] == [True, True, False, False]
    assert "thunder" in answers[3]["message"] and "\n" not in answers[2]["message"]
    editor.do("configurationDone")
    editor.run()
    stopped = editor.events("stopped")[-1]
    assert (stopped["reason"], stopped["description"]) == ("exception", "Error flags")
    assert editor.do("exceptionInfo", threadId=1) == {
        "exceptionId": "flag", "description": "the flag ETO is set", "breakMode": "always"
    }  # fmt: skip
    assert editor.go() == "over"
