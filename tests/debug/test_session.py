import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from debug.debuggees import PROGRAM, Notes, bench, breakpoints, go
from tmcm34x.bench import simple_rig
from tmcm34x.clock import MS, NEVER, run_until
from tmcm34x.debug.control import Breakpoint
from tmcm34x.debug.expressions import ExpressionError
from tmcm34x.debug.sessions.base import SourceMap
from tmcm34x.debug.sessions.bench import at_rest
from tmcm34x.debug.sessions.live import LiveSession
from tmcm34x.debug.watches import WatchedValue
from tmcm34x.tmcl.mnemonic import parse_instruction
from tmcm34x.toolchain.assembler import assemble


def lines(session):
    return [frame.location.line for frame in session.frames()]


def state(session):
    module = session.module
    return (
        session.rig.now, session.program.registers.contents(), session.program.executed, module.board.outputs,
        [session.view.read("ap", (n, motor)) for motor in range(3) for n in (0, 1, 2, 3, 4, 8, 135)],
        module.eeprom.to_bytes(), module.coordinates,
    )  # fmt: skip


@pytest.mark.parametrize(("address", "times"), list(enumerate([1, 1, 3, 3, 3, 3, 1] + 8 * [3])))
def test_a_breakpoint_holds_every_time_the_program_comes_by(address, times):
    session, notes = bench()
    session.set_breakpoints(breakpoints(address))
    session.start(hold=False)
    while not session.over:
        go(session)
    assert [stop.address for stop in notes.stops] == times * [address]


def test_the_program_is_held_before_its_first_command():
    session, notes = bench()
    session.start()
    assert [stop.reason for stop in notes.stops] == ["entry"]
    assert (session.program.counter, session.program.executed, session.running) == (0, 0, False)


def test_a_breakpoint_holds_before_its_command_each_time():
    session, notes = bench()
    session.set_breakpoints(breakpoints(3))
    session.start()
    for turn in (1, 2, 3):
        go(session)
        assert (notes.stops[-1].reason, notes.stops[-1].breakpoints) == ("breakpoint", (0,))
        assert (session.program.counter, session.view.read("gp", (1,))) == (3, turn)
    go(session)
    assert notes.ends == 1 and session.over
    assert session.program.hooked


def test_nobody_looks_without_breakpoints():
    session, notes = bench()
    session.start(hold=False)
    assert not session.program.hooked
    session.advance(NEVER)
    assert notes.ends == 1 and not notes.stops


def test_steps_go_into_over_and_out_of_subroutines():
    session, _ = bench()
    session.start()
    for expected in (2, 3, 8):
        session.step_in()
        session.advance(NEVER)
        assert lines(session)[0] == expected
    session.step_over()
    session.advance(NEVER)
    session.step_in()
    session.advance(NEVER)
    assert lines(session) == [11, 9, 3]
    assert [frame.name for frame in session.frames()] == ["Wait", "Move", "program"]
    session.step_out()
    session.advance(NEVER)
    assert lines(session) == [10, 3]
    session.step_out()
    session.advance(NEVER)
    assert lines(session) == [4]
    session.step_over()
    session.advance(NEVER)
    session.step_over()
    session.advance(NEVER)
    session.step_over()
    session.advance(NEVER)
    session.step_over()
    session.advance(NEVER)
    assert lines(session) == [4]


def test_stepping_out_of_the_outermost_level_goes_on():
    session, notes = bench()
    session.start()
    session.step_out()
    session.advance(NEVER)
    assert notes.ends == 1


def test_a_step_past_the_last_command_ends_the_session():
    session, notes = bench("        STOP\n")
    session.start()
    session.step_over()
    session.advance(NEVER)
    assert notes.ends == 1 and not session.running
    session.resume()
    assert not session.running


@pytest.mark.parametrize(
    ("texts", "turns"),
    [
        ({"condition": "gp[1] == 2"}, [2]),
        ({"condition": "accumulator > 1 && ap[actual_position][0] != 4000"}, [3]),
        ({"hits": "2"}, [2, 3]),
        ({"hits": "== 2"}, [2]),
        ({"hits": "% 2"}, [2]),
        ({"hits": "< 2"}, [1]),
        ({"condition": "gp[1] > 1", "hits": "> 1"}, [3]),
    ],
)
def test_conditions_and_hits_choose_when_to_hold(texts, turns):
    session, notes = bench()
    session.set_breakpoints(breakpoints(3, **texts))
    session.start()
    held = []
    while not session.over:
        go(session)
        if not session.over:
            held.append(session.view.read("gp", (1,)))
    assert held == turns
    assert not notes.messages


def test_a_log_point_tells_and_does_not_hold():
    session, notes = bench()
    session.set_breakpoints(breakpoints(3, message="turn {gp[1]} at {ap[1][0]}"))
    session.start()
    go(session)
    assert session.over
    assert notes.messages == [(3, f"turn {n} at {2000 * n}") for n in (1, 2, 3)]


def test_a_condition_without_a_value_holds_and_says_why():
    session, notes = bench()
    session.set_breakpoints(breakpoints(3, condition="1 / 0"))
    session.start()
    go(session)
    assert notes.stops[-1].reason == "breakpoint"
    assert notes.stops[-1].text == "the condition has no value: division by zero"


@pytest.mark.parametrize(
    ("texts", "why"),
    [
        ({"condition": "1 +"}, "a value is missing at the end"),
        ({"hits": "often"}, "a hit condition is a number"),
        ({"message": "{)}"}, "a value is missing"),
    ],
)
def test_a_breakpoint_that_cannot_be_read_holds_and_says_why(texts, why):
    session, notes = bench()
    session.set_breakpoints(breakpoints(3, **texts))
    session.start()
    go(session)
    assert notes.stops[-1].reason == "breakpoint"
    assert notes.stops[-1].text.startswith(f"the breakpoint cannot be read: {why}")
    assert session.hits() == {0: 1}


def test_a_brace_alone_is_a_message():
    assert Breakpoint.make(1, 0, message="{").message is not None


def test_hits_are_kept_while_other_breakpoints_come_and_go_and_forgotten_with_the_program():
    session, _ = bench()
    session.set_breakpoints(breakpoints(3))
    session.start()
    go(session)
    session.set_breakpoints(breakpoints(3, 4))
    assert session.hits() == {0: 1, 1: 0}
    session.loaded(session.memory())
    assert session.hits() == {0: 0, 1: 0}


def test_a_pause_in_a_wait_goes_on_where_it_was():
    plain, _ = bench("        WAIT TICKS, 0, 100\n        STOP\n")
    plain.start(hold=False)
    plain.advance(NEVER)
    session, notes = bench("        WAIT TICKS, 0, 100\n        STOP\n")
    session.start(hold=False)
    session.advance(300 * MS)
    session.pause()
    assert notes.stops[-1].reason == "pause" and session.rig.now == 300 * MS
    with pytest.raises(ExpressionError, match="WAIT"):
        session.jump(1)
    go(session)
    assert session.rig.now == plain.rig.now


def test_a_refused_command_is_told():
    session, notes = bench("        SGP 0, 2, 1\n        SAP 4, 0, 5000\n        SGP 1, 2, 1\n        STOP\n")
    session.set_breaks({"refused": None})
    session.start(hold=False)
    session.advance(NEVER)
    stop = notes.stops[-1]
    assert (stop.reason, stop.address, lines(session)) == ("exception", 1, [2])
    assert stop.text == "SAP 4, 0, 5000: invalid value (status 4)"
    go(session)
    assert session.over and len(notes.stops) == 1


def test_an_end_without_stop_is_told():
    session, notes = bench("        SGP 0, 2, 1\n")
    session.set_breaks({"refused": None})
    session.start(hold=False)
    session.advance(NEVER)
    assert "is a STOP missing" in notes.stops[-1].text
    go(session)
    assert session.over


def test_the_session_ends_when_the_motors_are_at_rest():
    session, notes = bench("        MVP ABS, 1, 5000\n        STOP\n")
    session.start(hold=False)
    session.advance(NEVER)
    assert notes.ends == 1 and at_rest(session.module)
    assert session.view.read("ap", (1, 1)) == 5000


def test_a_jump_moves_the_counter():
    session, notes = bench("        SGP 0, 2, 1\n        SGP 1, 2, 1\n        STOP\n")
    session.start()
    session.jump(1)
    go(session)
    assert (session.view.read("gp", (0,)), session.view.read("gp", (1,))) == (0, 1)
    assert notes.ends == 1


def test_lines_have_addresses_and_addresses_have_labels():
    text = SourceMap(assemble(PROGRAM, "p.tmc"))
    assert [text.address("p.tmc", line) for line in (1, 3, 15, 16)] == [0, 2, 14, None]
    assert text.address("other.tmc", 1) is None
    assert (text.label(7), text.label(8)) == ("Move", "address 8")
    assert (text.routine(9), text.routine(0)) == ("Move", "")
    assert text.location(99) is None


ENDLESS = """\
        SAP   4, 0, 900
        SAP   13, 1, 1
Again:  GAP   1, 0
        CALC  ADD, 700
        AAP   0, 0
        GIO   0, 1
        AGP   5, 2
        GGP   132, 0
        AGP   6, 2
        WAIT  TICKS, 0, 3
        GGP   4, 2
        CALC  ADD, 1
        AGP   4, 2
        COMP  20
        JC    GT, Out
Poll:   GAP   8, 0
        JC    ZE, Poll
        GGP   133, 0
        CALC  AND, 255
        AGP   7, 2
        JA    Again
Out:    ROR   1, 300
Rest:   JA    Rest
"""


def look_at_everything(session):
    for items in session.view.scopes().values():
        for item in items():
            session.view.evaluate(item.expression)
    session.frames()


@settings(max_examples=20)
@given(
    st.sampled_from([PROGRAM, ENDLESS]),
    st.sets(st.integers(0, 22), max_size=5),
    st.lists(st.sampled_from(["resume", "step_in", "step_over", "step_out", "pause"]), max_size=25),
    st.integers(1, 600),
)
def test_a_run_that_was_held_ends_like_one_that_was_not(source, addresses, actions, slice_ms):
    end = 1500 * MS
    plain, _ = bench(source)
    plain.program.run(0)
    run_until(plain.rig, end)

    session, _ = bench(source)
    session.start(hold=bool(addresses))
    session.set_breakpoints(breakpoints(*addresses))
    for action in actions:
        look_at_everything(session)
        if action == "pause":
            session.resume()
            session.advance(min(end, session.rig.now + slice_ms * MS))
            session.pause()
        else:
            getattr(session, action)()
            session.advance(end)
    session.set_breakpoints([])
    while session.rig.now < end:
        session.resume()
        session.advance(end)
        if session.over:
            run_until(session.rig, end)
    assert state(session) == state(plain)


def test_a_live_session_stops_the_program_and_lets_the_motors_run():
    rig = simple_rig()
    module = rig.modules[0]
    assembly = assemble("        ROR 0, 500\n        SGP 1, 2, 5\n        SGP 1, 2, 6\n        STOP\n")
    module.eeprom.write_program(assembly.program)
    notes = Notes()
    session = LiveSession(module, notes, SourceMap(assembly), rig.worlds[0])
    session.set_breakpoints(breakpoints(2))
    module.program.run(0)
    run_until(rig, 100 * MS)
    assert notes.stops[-1].reason == "breakpoint"
    assert (module.program.active, session.frames()[0].location.line) == (False, 3)
    position = session.view.read("ap", (1, 0))
    run_until(rig, 200 * MS)
    assert session.view.read("ap", (1, 0)) > position
    session.step_in()
    run_until(rig, 300 * MS)
    assert (notes.stops[-1].reason, session.view.read("gp", (1,))) == ("step", 6)
    session.step_in()
    run_until(rig, 400 * MS)
    session.look()
    assert notes.ends == 1
    session.set_breakpoints([])
    assert not module.program.hooked


def test_a_live_session_pauses_and_tells_of_refusals():
    rig = simple_rig()
    module = rig.modules[0]
    module.eeprom.write_program(
        assemble("Loop: SAP 4, 0, 9999\n      WAIT TICKS, 0, 10\n      JA Loop\n").program
    )
    notes = Notes()
    session = LiveSession(module, notes)
    session.set_breaks({"refused": None})
    session.resume()
    run_until(rig, 5 * MS)
    session.look()
    assert (notes.stops[-1].reason, notes.stops[-1].address, session.running) == ("exception", 0, False)
    session.resume()
    run_until(rig, 50 * MS)
    session.pause()
    assert (notes.stops[-1].reason, session.running) == ("pause", False)
    assert session.stop is not None
    module.program.reset()
    assert session.stop is None


def test_a_step_is_over_when_a_host_takes_the_program():
    rig = simple_rig()
    module = rig.modules[0]
    module.eeprom.write_program(assemble("Loop: WAIT TICKS, 0, 10\nJA Loop\n").program)
    session = LiveSession(module, Notes())
    session.step_in()
    module.program.stop()
    session.look()
    module.program.run(0)
    run_until(rig, 500 * MS)
    assert session.running
    assert not module.program.hooked


@pytest.mark.parametrize("refused", ["SAP 4, 0, 9999", "CALC 99, 1", "GAP 250, 0"])
def test_a_live_session_holds_right_after_the_refused_command(refused):
    rig = simple_rig()
    module = rig.modules[0]
    program = [
        parse_instruction("CALC ADD, 1"),
        parse_instruction(refused),
        *2 * [parse_instruction("CALC ADD, 1")],
    ]
    module.eeprom.write_program(program)
    notes = Notes()
    session = LiveSession(module, notes)
    session.set_breaks({"refused": None})
    session.resume()
    run_until(rig, 50 * MS)
    assert [(stop.reason, stop.address) for stop in notes.stops] == [("exception", 1)]
    assert (module.program.counter, module.program.accumulator) == (2, 1)
    session.resume()
    run_until(rig, 100 * MS)
    session.look()
    assert (notes.stops[-1].reason, module.program.accumulator) == ("exception", 3)


def watch(session, *texts, **conditions):
    session.set_watches([WatchedValue.make(n, text, **conditions) for n, text in enumerate(texts)])


def test_a_data_breakpoint_holds_after_the_command_that_changed_the_value():
    session, notes = bench()
    session.start()
    watch(session, "gp[1]")
    go(session)
    assert notes.stops[-1].reason == "data breakpoint"
    assert notes.stops[-1].text == "gp[1]: 0 → 1"
    assert session.view.read("gp", (1,)) == 1
    assert lines(session)[0] == PROGRAM.splitlines().index("        RSUB", 11) + 1


def test_data_breakpoints_have_conditions_and_hit_counts():
    session, notes = bench()
    session.start()
    watch(session, "gp[1]", condition="gp[1] > 1")
    go(session)
    assert session.view.read("gp", (1,)) == 2
    watch(session, "gp[1]", hits="2")
    go(session)
    assert session.over and session.view.read("gp", (1,)) == 3
    assert len(notes.stops) == 2


def test_a_value_that_passes_a_limit_holds_in_either_direction():
    session, notes = bench("MVP ABS, 0, 3000\nWAIT POS, 0, 0\nMVP ABS, 0, 0\nWAIT POS, 0, 0\nSTOP\n")
    session.start()
    watch(session, "ap[target_position][0] passes 2000")
    go(session)
    go(session)
    go(session)
    texts = [stop.text for stop in notes.stops if stop.reason == "data breakpoint"]
    assert texts == [
        "ap[target_position][0] passes 2000: 0 → 3000",
        "ap[target_position][0] passes 2000: 3000 → 0",
    ]


def test_a_run_with_data_breakpoints_ends_like_one_without():
    plain, _ = bench()
    plain.start(hold=False)
    go(plain)
    watched, notes = bench()
    watched.start()
    watch(watched, "gp[1]", "accumulator", "out[0]")
    while not watched.over:
        go(watched)
    assert len(notes.stops) > 3
    assert state(watched) == state(plain)


def test_a_routine_begins_anew():
    session, _ = bench()
    session.start()
    session.set_breakpoints(breakpoints(11))
    go(session)
    assert lines(session) == [12, 9, 3]
    session.restart_frame(1)
    assert lines(session) == [8, 3]
    session.restart_frame(1)
    assert lines(session) == [1]
    with pytest.raises(ExpressionError, match="no open routine 1: there are 1"):
        session.restart_frame(1)
