"""A program is held when something happens to the module, on the way forward and on the way back."""

import pytest

from debug import debuggees
from debug.debuggees import Notes, go
from tmcm34x.bench.action import Action
from tmcm34x.bench.builder import build
from tmcm34x.bench.description import parse
from tmcm34x.clock import MS, NEVER, run_until
from tmcm34x.debug.breaks import BREAKS
from tmcm34x.debug.control import Breakpoint
from tmcm34x.debug.expressions import ExpressionError, compile_expression
from tmcm34x.debug.sessions.live import LiveSession
from tmcm34x.debug.watches import WatchedValue
from tmcm34x.toolchain.assembler import assemble

STAGE = """\
[[module]]
model = 343
[[module.axis]]
load = { kind = "carriage", lead_mm = 5.0, low = -2.0, high = 102.0, start = 50.0 }
switch.left = { position = 0.0 }
switch.right = { position = 100.0 }
"""
BARE_STOPS = STAGE.replace("switch.", "# switch.")


def session(source, *keys, bench=STAGE, **conditions):
    opened, _ = debuggees.bench(source, build(parse(bench)), keeps_history=True)
    opened.set_breaks(dict.fromkeys(keys) | {k: compile_expression(v) for k, v in conditions.items()})
    opened.start(hold=False)
    opened.advance(NEVER)
    return opened


def digest(opened):
    run_until(opened.rig, opened.rig.now)  # a pin that has just changed is taken notice of
    return opened.rig.digest()


TO_THE_SWITCH = """\
        SAP 4, 0, 1000
        SGP 1, 2, 7
        ROR 0, 1000
        WAIT TICKS, 0, 3000
        STOP
"""


def test_a_closed_switch_holds_at_the_clock_at_which_it_closes():
    opened = session(TO_THE_SWITCH, "switch")
    stop = opened.listener.stops[-1]
    assert (stop.reason, stop.exception) == ("exception", "switch")
    assert stop.text == "the right switch of motor 0 closed"
    assert opened.module.board.switch(0, "right")
    before = opened.history.look_at(opened.rig.now - 1)
    assert not before.modules[0].board.switch(0, "right")
    go(opened)
    assert opened.over and len(opened.listener.stops) == 1


def test_a_rotor_that_is_blocked_loses_steps():
    opened = session(TO_THE_SWITCH, "lost_steps", bench=BARE_STOPS)
    stop = opened.listener.stops[-1]
    assert (stop.exception, stop.text) == ("lost_steps", "motor 0 loses steps")
    assert abs(opened.rig.worlds[0].mounts[0].view().position - 102.0) < 0.1


def test_stall_detection_holds_when_it_stops_a_motor():
    source = "        SAP 205, 0, 6\n        ROR 0, 900\n        WAIT TICKS, 0, 3000\n        STOP\n"
    opened = session(source, "stall", bench=BARE_STOPS)
    stop = opened.listener.stops[-1]
    assert (stop.exception, stop.text) == ("stall", "stall detection stopped motor 0")
    go(opened)
    assert opened.over


def test_an_error_flag_holds_each_time_it_is_set():
    source = """\
Loop:   WAIT REFSW, 0, 5
        CLE ETO
        GGP 1, 2
        CALC ADD, 1
        AGP 1, 2
        COMP 3
        JC LT, Loop
        STOP
"""
    opened = session(source, "flag")
    for expected in range(3):
        assert opened.listener.stops[-1].text == "the flag ETO is set"
        assert opened.view.read("gp", (1,)) == expected
        go(opened)
    assert opened.over and len(opened.listener.stops) == 3


def test_a_fault_of_a_driver_holds():
    fault = '\n[[event]]\nat_ms = 40.0\ndo = "fault"\nmotor = 1\nfault = "short_to_ground"\n'
    opened = session("        WAIT TICKS, 0, 50\n        STOP\n", "driver_flag", bench=STAGE + fault)
    stop = opened.listener.stops[-1]
    assert "driver of motor 1: overcurrent on the high side" in stop.text
    assert opened.rig.now == 40 * MS


def test_a_refused_command_holds_with_its_own_address():
    opened = session("        SAP 4, 0, 9999\n        STOP\n", "refused")
    stop = opened.listener.stops[-1]
    assert (stop.address, stop.exception, stop.text) == (
        0,
        "refused",
        "SAP 4, 0, 9999: invalid value (status 4)",
    )


def test_a_break_holds_only_where_its_condition_does():
    assert session(TO_THE_SWITCH, switch="gp[1] == 8").over
    assert not session(TO_THE_SWITCH, switch="gp[1] == 7").over
    with pytest.raises(ExpressionError):
        compile_expression("gp[1] ==")


THREE_TIMES = """\
        SAP 12, 0, 1
        SAP 4, 0, 1500
        SAP 5, 0, 500
Loop:   MVP ABS, 0, 9000
        WAIT POS, 0, 0
        SAP 4, 0, 9999
        MVP ABS, 0, 0
        WAIT POS, 0, 0
        GGP 1, 2
        CALC ADD, 1
        AGP 1, 2
        COMP 3
        JC LT, Loop
        STOP
"""


@pytest.mark.parametrize("key", ["refused", "switch", "lost_steps"])
def test_the_way_back_finds_the_same_clocks(key):
    bench = STAGE.replace("low = -2.0, high = 102.0", "low = 49.5, high = 52.5").replace("100.0 }", "52.0 }")
    if key == "lost_steps":
        bench = bench.replace("switch.", "# switch.")
    opened = session(THREE_TIMES, key, bench=bench)
    clocks, digests = [], []
    while not opened.over:
        clocks.append(opened.rig.now)
        digests.append(digest(opened))
        go(opened)
    assert len(clocks) >= 2, "the bench must make it happen more than once"
    back = []
    for _ in clocks:
        opened.reverse_continue()
        back.append((opened.rig.now, digest(opened)))
    assert back == list(zip(clocks, digests, strict=True))[::-1]
    opened.reverse_continue()
    assert opened.listener.stops[-1].text == "the beginning of the history: nothing held before"


# Positions that a motor passes


def passing(opened, limit, motor=0):
    opened.set_watches([WatchedValue.make(1, f"ap[actual_position][{motor}] passes {limit}")])


@pytest.mark.parametrize("limit", [1, 777, 4000, 8999])
def test_a_data_breakpoint_holds_at_the_clock_at_which_a_position_is_passed(limit):
    opened = session(THREE_TIMES)
    opened.go_to(0)
    passing(opened, limit)
    clocks = []
    go(opened)
    while not opened.over:
        assert opened.view.read("ap", (1, 0)) == limit
        before = opened.history.look_at(opened.rig.now - 1).modules[0]
        assert before.board.chips[0].position(before.board.wiring(0)[1]) in {limit - 1, limit + 1}
        clocks.append(opened.rig.now)
        go(opened)
    assert len(clocks) == 6
    back = []
    for _ in clocks:
        opened.reverse_continue()
        back.append(opened.rig.now)
    assert back == clocks[::-1]


def test_a_breakpoint_behind_a_data_breakpoint_holds_too_after_the_way_back():
    opened = session(THREE_TIMES)
    opened.go_to(0)
    opened.set_watches([WatchedValue.make(1, "gp[1]")])
    go(opened)
    held = opened.rig.now, opened.program.counter
    go(opened)
    opened.reverse_continue()
    assert (opened.rig.now, opened.program.counter) == held
    opened.set_breakpoints([Breakpoint.make(1, opened.program.counter)])
    go(opened)
    assert opened.listener.stops[-1].reason == "breakpoint" and opened.program.counter == held[1]


# A module whose time others move


def test_a_live_program_is_held_by_a_break_at_its_next_command():
    rig = build(parse(STAGE))
    module = rig.modules[0]
    module.eeprom.write_program(assemble("Loop: WAIT TICKS, 0, 1\n      JA Loop\n").program)
    notes = Notes()
    live = LiveSession(module, notes, world=rig.worlds[0])
    live.set_breaks({"switch": None})
    live.resume()
    run_until(rig, 25 * MS)
    rig.act(Action("switch", 0, (1, "left", True)))
    run_until(rig, 60 * MS)
    assert [stop.text for stop in notes.stops] == ["the left switch of motor 1 closed"]
    live.close()
    assert not module.program.hooked


def test_every_break_says_what_it_is():
    assert all(row.label and row.meaning for row in BREAKS.values())
    assert [row.key for row in BREAKS.values() if row.default] == ["refused"]
