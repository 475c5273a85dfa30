"""The past of a bench in tests: run on to a condition, go back, ask what wrote a value."""

import pytest
import serial
from hypothesis import example, given, settings
from hypothesis import strategies as st

from tmcm34x import HZ, BenchError, History, HistoryError, run_until, simple_rig
from tmcm34x.bench.action import Action
from tmcm34x.bench.rig import Rig
from tmcm34x.debug.expressions import ExpressionError
from tmcm34x.testing import TooLateError, VirtualModule

PROGRAM = """\
        SAP   4, 0, 1200
Loop:   MVP   REL, 0, 2000
        WAIT  POS, 0, 0
        GGP   1, 2
        CALC  ADD, 1
        AGP   1, 2
        COMP  5
        JC    LT, Loop
        STOP
"""


@pytest.fixture
def history():
    made = History(simple_rig())
    made.load(PROGRAM, run=True)
    return made


def position(rig, motor=0):
    return rig.worlds[0].mounts[motor].chip.position(0)


def test_time_passes_until_a_condition_holds_and_not_longer(history):
    clock = history.until("gp[1] == 2")
    assert history.rig.modules[0].program.variables[1] == 2 and history.now == clock
    assert history.look_at(clock - 1).modules[0].program.variables[1] == 1
    history.until(lambda rig: rig.modules[0].program.variables[1] == 3)
    with pytest.raises(TooLateError, match=r"gp\[1\] == 9 did not come true within 2 s"):
        history.until("gp[1] == 9", timeout=2)


@pytest.mark.parametrize(
    "condition", ["ap[1][0] > 3210", "3210 < ap[1][0]", "ap[1][0] >= 3211 && gp[1] == 1"]
)
def test_a_condition_on_a_position_holds_at_the_microstep(history, condition):
    clock = history.until(condition)
    assert position(history.rig) == 3211
    assert position(history.look_at(clock - 1)) == 3210


def test_going_back_and_on_repeats_what_was_done(history):
    history.run(0.5)
    history.command("SGP 40, 2, 77")
    history.run(0.3)
    history.rig.act(Action("switch", 0, (1, "left", True)))
    history.run(2.0)
    clock, digest = history.now, history.rig.digest()
    history.back_to(HZ // 10)
    assert history.now == HZ // 10 and history.rig.modules[0].program.variables[40] == 0
    run_until(history, clock)
    assert history.rig.digest() == digest
    assert len(history.branches) == 1


def test_doing_something_else_begins_a_branch(history):
    history.until("gp[1] == 4")
    history.back_to(HZ // 5)
    history.command("SGP 1, 2, 40")
    history.run(3)
    old, new = history.branches
    assert history.rig.modules[0].program.variables[1] == 41
    history.back_to(old.end, old)
    assert history.rig.modules[0].program.variables[1] == 4
    assert new.since == HZ // 5


def test_a_condition_is_found_on_the_way_back(history):
    clocks = [history.until(f"gp[1] == {n}") for n in (1, 2, 3)]
    history.run(5)
    assert history.back_until("gp[1] == 2") == clocks[1] == history.now
    assert history.back_until(lambda rig: rig.modules[0].program.variables[1] == 1) == clocks[0]
    with pytest.raises(HistoryError, match="has not come true since 0 s"):
        history.back_until("gp[1] == 99")
    assert history.now == history.oldest == 0


def test_the_last_write_is_told_and_where_there_was_none(history):
    assert history.last_write("gp[1]") is None
    history.until("gp[1] == 3")
    write = history.last_write("gp[1]")
    assert (write.cause, write.before, write.after, write.address) == ("AGP 1, 2", 2, 3, 5)
    history.command("SGP 1, 2, 30")
    assert "command of a host" in history.last_write("gp[1]").cause
    with pytest.raises(ExpressionError):
        history.last_write("gp[")


@pytest.mark.parametrize("text", ["gp[1] ==", "gp[99] == 1", "nothing > 1", "ap[1][0] passes"])
def test_what_is_no_condition_is_refused_in_one_line(history, text):
    for search in (history.until, history.back_until):
        with pytest.raises(ExpressionError) as caught:
            search(text)
        assert "\n" not in str(caught.value)


def test_moments_out_of_reach_are_refused(history):
    history.run(1)
    for clock in (2 * HZ, -1):
        with pytest.raises(HistoryError):
            history.back_to(clock)
    assert history.now == HZ
    with pytest.raises(BenchError, match="by hand"):
        History(Rig(simple_rig().worlds))


# Modules under test


def test_a_module_under_test_goes_back(tmcm343):
    history = tmcm343.history
    assert tmcm343.history is history
    tmcm343.load(PROGRAM, run=True)
    clock = history.until("ap[1][0] passes 1500")
    tmcm343.press("left", 0)
    tmcm343.command("SGP 9, 2, 8")
    tmcm343.run(1)
    assert not tmcm343.motor(0).moving
    digest = tmcm343.rig.digest()
    history.back_to(clock)
    assert tmcm343.motor(0).position == 1500 and tmcm343.motor(0).moving
    tmcm343.run(1)
    assert tmcm343.rig.digest() == digest
    assert history.last_write("gp[9]").after == 8


def test_what_comes_over_a_line_is_part_of_the_past_and_is_not_sent_again(tmcm343):
    history = tmcm343.history
    with serial.serial_for_url(tmcm343.serial_url, timeout=1) as port:
        before = history.now
        port.write(bytes.fromhex("01 09 03 02 00 00 00 2a 39"))  # SGP 3, 2, 42
        assert port.read(9)[2] == 100
        tmcm343.run(0.1)
        write = history.last_write("gp[3]")
        assert (write.after, write.address) == (42, -1) and "SGP 3, 2, 42" in write.cause
        history.back_to(before)
        tmcm343.run(1)
        assert tmcm343.command("GGP 3, 2") == (100, 0)
        port.timeout = 0.05
        assert port.read(1) == b""
        port.write(bytes.fromhex("01 0a 03 02 00 00 00 00 10"))  # GGP 3, 2
        assert port.read(9)[2] == 100


def test_a_history_is_asked_for_before_the_lines_and_in_virtual_time(tmcm34x_factory):
    module = tmcm34x_factory(343)
    assert module.serial_url
    with module.connect():
        pass
    with pytest.raises(ValueError, match="before"):
        _ = module.history
    with VirtualModule(343, pace=100) as paced, pytest.raises(ValueError, match="virtual"):
        _ = paced.history


# Forward, back, and forward again

LINES = st.sampled_from([
    "MVP REL, 0, 700", "MVP ABS, 1, 3000", "ROR 2, 300", "MST 2", "WAIT TICKS, 0, 3", "WAIT POS, 0, 20", "CALC ADD, 7",
    "AGP 2, 2", "GGP 2, 2", "SAP 5, 0, 300", "SIO 1, 2, 1", "SCO 3, 0, 99", "CCO 4, 1", "GAP 1, 0", "RFS START, 1",
])  # fmt: skip
DEEDS = st.sampled_from([
    ("command", "SGP 2, 2, 5"), ("command", "MVP ABS, 0, -900"), ("command", "MST 0"), ("switch", (0, "left", True)),
    ("switch", (0, "left", None)), ("level", (3, 900)), ("power", (False,)), ("power", (True,)),
])  # fmt: skip
SPANS = st.integers(1, 4 * HZ // 10)


@settings(max_examples=40)
@given(
    st.lists(LINES, min_size=1, max_size=8),
    st.lists(st.tuples(SPANS, DEEDS), max_size=8),
    st.lists(st.floats(0, 1), min_size=1, max_size=3),
)
@example(
    ["CALC ADD, 7", "CALC ADD, 7"],
    [
        (258121, ("switch", (0, "left", True))),
        (1, ("command", "SGP 2, 2, 5")),
        (258121, ("switch", (0, "left", True))),
    ],
    [0.0, 0.7427405285434844],
)  # how far was looked ahead
def test_forward_then_back_then_forward_is_the_same_as_forward(lines, deeds, places):
    history = History(simple_rig())
    history.load("Loop: " + "\n".join(lines) + "\nJA Loop\n", run=True)
    for span, (what, operands) in deeds:
        run_until(history, history.now + span)
        if what == "command":
            history.command(operands)
        else:
            history.rig.act(Action(what, 0, operands))
    run_until(history, history.now + HZ // 10)
    end, digest = history.now, history.rig.digest()
    for place in places:
        history.back_to(round(end * place))
        run_until(history, history.now + (end - history.now) // 2)
        history.back_to(round(history.now * place))
        run_until(history, end)
        assert history.rig.digest() == digest
    assert len(history.branches) == 1
