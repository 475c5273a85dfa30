"""The IDE's virtual module can be shown as it was, and go on from there."""

from __future__ import annotations

import asyncio
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from debug.debuggees import Notes, assembled, breakpoints
from ide.ide_driver import running, virtual
from tmcm34x.bench import simple_rig
from tmcm34x.clock import HZ, MS
from tmcm34x.debug.sessions.search import UnfinishedError
from tmcm34x.debug.watches import WatchedValue
from tmcm34x.firmware.axis import X_ACTUAL
from tmcm34x.firmware.ports.can import CanPort
from tmcm34x.ide import wire
from tmcm34x.ide.virtual import Virtual
from tmcm34x.server import Server
from tmcm34x.tmcl.datagram import pack_request
from tmcm34x.tmcl.mnemonic import parse_instruction

PROGRAM = """\
Loop:   MVP   REL, 0, 700
        WAIT  POS, 0, 0
        GGP   3, 2
        CALC  ADD, 1
        AGP   3, 2
        CSUB  Sub
        JA    Loop
Sub:    WAIT  TICKS, 0, 3
        RSUB
"""
SEARCHES = 11
"""Parts of a program's saved state before those that only say how far a look ahead has come."""


class Bench:
    """A virtual module under a wall clock that tests advance, with a host on a line of its own."""

    def __init__(self, program=PROGRAM, speed=1.0):
        self.time_s = 100.0
        rig = simple_rig()
        rig.modules[0].eeprom.write_program(assembled(program).program)
        self.server = Server(rig, speed=speed, monotonic=lambda: self.time_s)
        self.virtual = Virtual(self.server, "bare motors", "")
        self.past = self.virtual.past
        self.replies = bytearray()
        self.host = self.server.connect("host", self.replies.extend)
        self.notes = Notes()
        self.session = self.virtual.session(self.notes)
        self.seen = {}
        """The state at each clock from which time went on."""

    @property
    def rig(self):
        return self.server.rig

    def wait(self, seconds):
        """Let time pass as the server does: in slices, each to the next look at the lines."""
        self.seen[self.rig.now] = visible(self.rig)
        end = self.time_s + seconds
        while self.time_s < end:
            self.time_s = min(end, self.time_s + 0.02)
            while not self.server.catch_up():
                pass
            self.server.settle()

    def send(self, line):
        self.host.receive(pack_request(1, parse_instruction(line)))

    def do(self, work):
        while True:
            try:
                return asyncio.run(self.virtual.debug(work))
            except UnfinishedError as unfinished:
                unfinished.search.begin()
                unfinished.search.run()
                unfinished.search.keep()

    def look(self):
        """The shown state, without what depends on whether commands were looked at one by one."""
        return visible(self.past.playback.rig)


def visible(rig):
    now, happened, modules, worlds = rig.save()
    return now, happened, [(*m[:3], m[3][:SEARCHES], *m[4:]) for m in modules], worlds


def started(**options):
    bench = Bench(**options)
    bench.send("129 0, 0, 0")
    bench.wait(0.5)
    return bench


def test_a_past_moment_is_shown_while_time_stands_and_hosts_are_served():
    bench = started()
    then, seen = bench.rig.now, visible(bench.rig)
    bench.wait(2.0)
    present = bench.rig.now
    bench.past.show(then, None)
    assert bench.look() == seen
    bench.wait(1.0)
    assert bench.rig.now == present
    bench.replies.clear()
    bench.send("GAP 1, 0")
    assert len(bench.replies) == 9
    assert bench.look() == seen
    bench.past.leave()
    bench.wait(0.5)
    assert bench.rig.now == present + HZ // 2


def test_time_that_was_held_before_stays_held_afterwards():
    bench = started()
    bench.virtual.set_time(wire.SetTime(paused=True))
    bench.past.show(0, None)
    bench.past.leave()
    now = bench.rig.now
    bench.wait(0.2)
    assert bench.rig.now == now


def test_going_on_begins_a_branch_and_the_one_that_was_left_can_still_be_shown():
    bench = started()
    then = bench.rig.now
    bench.wait(1.0)
    end, seen = bench.rig.now, visible(bench.rig)
    bench.past.show(then, None)
    bench.past.go_on(hold=False)
    assert bench.rig.now == then
    bench.send("SGP 3, 2, 1000")
    bench.wait(1.0)
    assert bench.rig.modules[0].program.variables[3] > 1000
    shape = bench.past.shape
    assert [(b.number, b.parent, b.since) for b in shape.branches] == [(0, -1, 0), (1, 0, then)]
    assert (shape.present, shape.shown) == (1, -1)
    bench.past.show(end, 0)
    assert bench.look() == seen
    bench.past.leave()
    assert bench.rig.now == then + HZ


def test_going_on_drops_what_was_half_received_and_owes_no_reply():
    bench = started()
    bench.send("SGP 75, 0, 200")
    bench.send("GAP 1, 0")
    bench.host.receive(b"\x01\x06")
    then = bench.rig.now
    bench.wait(1.0)
    bench.replies.clear()
    bench.past.show(then, None)
    assert bench.past.playback.rig.modules[0].owes_reply
    bench.past.go_on(hold=True)
    assert not bench.rig.modules[0].owes_reply
    bench.virtual.set_time(wire.SetTime(paused=False))
    bench.wait(1.0)
    assert not bench.replies
    bench.send("GAP 1, 0")
    bench.wait(0.3)
    assert len(bench.replies) == 9


def test_lines_stay_as_they_are_when_the_bench_goes_on_from_the_past():
    bench = started()
    then = bench.rig.now
    bench.wait(0.1)
    late = bytearray()
    peer = bench.server.connect("late", late.extend)
    bench.past.show(then, None)
    bench.past.go_on(hold=False)
    peer.receive(pack_request(1, parse_instruction("GAP 1, 0")))
    assert len(late) == 9
    now, seen = bench.rig.now, visible(bench.rig)
    bench.wait(0.1)
    peer.disconnect()
    bench.wait(0.1)
    bench.past.show(now, None)
    assert bench.look() == seen


def test_frames_of_a_bus_are_part_of_the_history():
    async def scenario():
        bench = started()
        bus = Loopback()
        await bench.server.open_can(bus)
        bus.node.receive_frame(1, parse_frame("SGP 7, 2, 77"), None)
        now, seen = bench.rig.now, visible(bench.rig)
        assert any(isinstance(port, CanPort) for port in bench.rig.modules[0].ports)
        bench.wait(0.3)
        bench.past.show(now, None)
        assert bench.look() == seen
        await bench.server.close()

    asyncio.run(scenario())


class Loopback:
    """A CAN link whose frames the test sends."""

    async def open(self, connect):
        self.node = connect("bus", lambda identifier, data: None)
        return "loopback"

    def close(self):
        self.node.disconnect()


def parse_frame(line):
    number, type_, motor, value = parse_instruction(line)
    return bytes((number, type_, motor)) + value.to_bytes(4, "big", signed=True)


def test_a_moment_out_of_reach_is_refused_with_the_nearest_that_is_not():
    bench = started()
    with pytest.raises(wire.RefusalError, match=r"has not come yet; the branch ends at \d+ ms") as refusal:
        bench.past.show(100 * HZ, None)
    assert refusal.value.code == "history"
    assert not bench.past.shown
    with pytest.raises(wire.RefusalError, match="no longer in memory"):
        bench.past.show(0, 7)


def test_a_snapshot_that_is_restored_begins_a_branch_without_a_past():
    bench = started()
    bench.wait(0.3)
    snapshot, then, seen = bench.rig.snapshot(), bench.rig.now, visible(bench.rig)
    bench.wait(0.4)
    end, latest = bench.rig.now, visible(bench.rig)
    bench.server.restore(snapshot)
    assert (bench.rig.now, visible(bench.rig)) == (then, seen)
    bench.send("SGP 9, 2, 5")
    bench.wait(0.2)
    shape = bench.past.shape
    assert [(b.number, b.parent, b.since, b.oldest) for b in shape.branches] == [
        (0, -1, 0, 0),
        (1, -1, then, then),
    ]
    expect_the_same_past(bench, after=then, before=then + 1)
    bench.past.show(end, 0)
    assert bench.look() == latest
    with pytest.raises(wire.RefusalError, match="no longer in memory"):
        bench.past.show(then - 1, 1)


def test_what_was_done_to_the_bench_is_marked_in_words():
    bench = started()
    for what, index, value in (("left", 1, True), ("left", 1, None), ("analog", 2, 512), ("power", 0, False)):
        bench.virtual.set_bench(wire.SetBench(what, index, value))
        bench.wait(0.01)
    marks = bench.past.marks(0).marks
    assert [mark.text for mark in marks if mark.text.startswith("on the bench")] == [
        "on the bench: switch 1 left active",
        "on the bench: switch 1 left given back",
        "on the bench: level 2 512",
        "on the bench: power off",
    ]


def test_the_control_socket_moves_no_time_while_a_past_moment_is_shown():
    bench = started()
    assert bench.virtual.not_now("until") == ""
    bench.past.show(0, None)
    assert "return to the present" in bench.virtual.not_now("until")
    assert bench.virtual.not_now("act") == ""


# The debugger


def test_what_the_debugger_held_and_started_is_repeated_in_the_past():
    bench = Bench()
    bench.do(lambda: bench.session.set_breakpoints(breakpoints(4)))
    bench.send("129 0, 0, 0")
    for _ in range(3):
        while not bench.session.stop:
            bench.wait(0.05)
        bench.do(bench.session.step_in)
        bench.wait(0.01)
        bench.do(bench.session.resume)
    expect_the_same_past(bench)


def expect_the_same_past(bench, after=0, before=math.inf):
    for clock, state in sorted(bench.seen.items(), key=lambda item: item[0] * 7919 % 104729):
        if not after <= clock < before:
            continue
        bench.past.show(clock, None)
        assert bench.look() == state


def held_after_turns(turns):
    """A bench whose program is held before its AGP after so many turns."""
    bench = Bench()
    bench.do(lambda: bench.session.set_breakpoints(breakpoints(4, condition=f"gp[3] == {turns}")))
    bench.send("129 0, 0, 0")
    while not bench.session.stop:
        bench.wait(0.05)
    return bench


def counted(bench):
    return bench.session.view.read("gp", (3,))


def test_steps_back_and_on_again_end_in_the_present():
    bench = held_after_turns(2)
    session = bench.session
    bench.do(lambda: session.step_back(over=False))
    assert (session.program.counter, session.running, bench.past.shown) == (3, False, True)
    bench.do(lambda: session.set_breakpoints(breakpoints(4)))
    bench.do(session.reverse_continue)
    assert (session.program.counter, counted(bench)) == (4, 1)
    bench.do(session.step_in)
    assert (session.program.counter, counted(bench)) == (5, 2)
    bench.do(session.step_over)
    assert session.program.counter == 6
    bench.do(session.resume)
    assert not bench.past.shown
    assert (session.program.counter, counted(bench)) == (4, 2)
    assert [stop.reason for stop in bench.notes.stops] == [
        "breakpoint", "step", "breakpoint", "step", "step", "breakpoint",
    ]  # fmt: skip


WAITING = "Loop: ROR 0, 300\n WAIT TICKS, 0, 400\n MST 0\n WAIT TICKS, 0, 100\n JA Loop\n"


class Held(Notes):
    """Writes down the clock of each stop, and where motor 0 is."""

    def __init__(self):
        super().__init__()
        self.places = []

    def held(self, stop):
        super().held(stop)
        module = self.bench.rig.modules[0]
        self.places.append((self.bench.rig.now, module.axes[0].read(X_ACTUAL), module.program.counter))


def held_by(work, **options):
    """A bench whose program waits in its second command while motor 0 turns, held by what `work` asks for."""
    bench = Bench(WAITING, **options)
    notes = bench.notes = Held()
    notes.bench = bench
    bench.session = bench.virtual.session(notes)
    bench.send("129 0, 0, 0")
    bench.wait(0.1)
    bench.do(lambda: work(bench))
    bench.wait(3.0)
    return bench


def test_a_position_that_is_passed_holds_at_the_microstep_while_the_program_waits():
    bench = held_by(lambda bench: bench.session.set_watches([WatchedValue.make(1, "ap[1][0] passes 5000")]))
    ((clock, position, counter),) = bench.notes.places
    assert (bench.session.stop.reason, position, counter) == ("data breakpoint", 5000, 1)
    bench.past.show(clock - 1, None)
    module = bench.past.playback.rig.modules[0]
    assert (module.axes[0].read(X_ACTUAL), module.program.state) == (4999, 1)
    bench.past.leave()
    expect_the_same_past(bench)


def test_a_switch_that_closes_holds_at_its_clock_while_the_program_waits():
    def press(bench):
        bench.session.set_breaks({"switch": None})
        bench.virtual.set_bench(wire.SetBench("left", 1, True))
        bench.closed = bench.rig.now

    bench = held_by(press)
    ((clock, _, counter),) = bench.notes.places
    assert (bench.session.stop.text, counter) == ("the left switch of motor 1 closed", 1)
    assert clock - bench.closed <= MS
    bench.do(bench.session.resume)
    bench.wait(0.2)
    assert bench.session.running and len(bench.notes.places) == 1


def test_who_wrote_shows_the_moment_before_the_write_of_a_host():
    bench = started()
    bench.send("SGP 9, 2, 5")
    bench.wait(0.4)
    bench.do(bench.session.pause)
    write = bench.do(lambda: bench.session.who_wrote("gp[9]"))
    assert write.cause == "command of a host: SGP 9, 2, 5"
    assert bench.past.shown and bench.past.playback.rig.now == write.clock - 1
    assert bench.session.view.read("gp", (9,)) == 0


def test_a_step_back_leads_to_the_last_command_before_the_supply_was_switched():
    bench = started()
    cut = bench.rig.now
    for on in (False, True):
        bench.virtual.set_bench(wire.SetBench("power", 0, on))
        bench.wait(0.2)
    bench.do(lambda: bench.session.step_back(over=False))
    assert cut - HZ // 10 < bench.past.playback.rig.now < cut
    shown = bench.session.program.executed
    assert shown > 0
    bench.do(lambda: bench.session.step_back(over=False))
    assert bench.session.program.executed == shown - 1


def test_a_search_that_is_given_up_ends_at_once_and_another_one_finds():
    bench = held_after_turns(2)
    with pytest.raises(UnfinishedError) as unfinished:
        asyncio.run(bench.virtual.debug(lambda: bench.session.step_back(over=False)))
    search = unfinished.value.search
    search.begin()
    search.cancel()
    search.run()
    assert search.cancelled and not bench.past.shown
    bench.do(lambda: bench.session.step_back(over=False))
    assert (bench.session.program.counter, bench.past.shown) == (3, True)


def test_nothing_can_be_changed_in_the_past():
    bench = held_after_turns(1)
    bench.do(lambda: bench.session.step_back(over=False))
    for change in (
        lambda: bench.session.view.assign("gp[3]", "7"),
        lambda: bench.session.execute(parse_instruction("SGP 3, 2, 7")),
        lambda: bench.session.jump(0),
        lambda: bench.session.restart_frame(0),
        bench.session.restart,
    ):
        with pytest.raises(ValueError, match="a past moment is shown: continue from here, or return"):
            bench.do(change)


def test_going_on_from_a_step_back_executes_the_command_again():
    bench = held_after_turns(2)
    bench.do(lambda: bench.session.step_back(over=False))
    bench.past.go_on(hold=True)
    assert bench.session.running and bench.session.program.counter == 3
    bench.do(lambda: bench.session.view.assign("accumulator", "40"))
    bench.do(lambda: bench.session.set_breakpoints([]))
    bench.virtual.set_time(wire.SetTime(paused=False))
    bench.wait(0.02)
    assert counted(bench) == 41


# Properties

STEPS = st.lists(
    st.one_of(
        st.tuples(st.just("wait"), st.floats(0.001, 0.3)),
        st.tuples(
            st.just("send"),
            st.sampled_from(
                [
                    "MVP ABS, 1, 4000",
                    "ROR 2, 300",
                    "MST 2",
                    "SGP 3, 2, 50",
                    "128 0, 0, 0",
                    "129 0, 0, 0",
                    "RFS START, 1",
                ]
            ),
        ),
        st.tuples(st.just("switch"), st.booleans()),
        st.tuples(st.just("power"), st.booleans()),
        st.tuples(st.just("pace"), st.sampled_from([0.5, 1.0, 4.0])),
        st.tuples(st.just("part"), st.integers(1, 8)),
    ),
    min_size=2,
    max_size=8,
)


def perform(bench, step):
    kind, value = step
    if kind == "wait":
        bench.wait(value)
    elif kind == "send":
        bench.send(value)
    elif kind == "switch":
        bench.virtual.set_bench(wire.SetBench("left", 1, int(value)))
    elif kind == "power":
        bench.virtual.set_bench(wire.SetBench("power", 0, int(value)))
    elif kind == "pace":
        bench.virtual.set_time(wire.SetTime(speed=value))
    else:
        bench.host.receive(pack_request(1, parse_instruction("GAP 1, 0"))[:value])
        bench.wait(0.02)


@settings(max_examples=10)
@given(STEPS)
def test_every_moment_of_any_course_is_shown_as_it_was(steps):
    bench = started()
    for step in steps:
        perform(bench, step)
    expect_the_same_past(bench)


def moved(rig):
    """What is visible, without what is under way on lines: a bench that goes on from the past drops that."""
    now, happened, modules, worlds = visible(rig)
    return now, happened, [(m[0][:4], *m[1:]) for m in modules], worlds


@settings(max_examples=8)
@given(STEPS, STEPS)
def test_forward_back_and_forward_ends_like_forward(steps, others):
    plain, other = started(), started()
    for step in steps:
        perform(plain, step)
        perform(other, step)
    for bench in (plain, other):
        bench.virtual.set_time(wire.SetTime(speed=1.0, paused=True))
    then = other.rig.now
    assert visible(other.rig) == visible(plain.rig)
    other.virtual.set_time(wire.SetTime(paused=False))
    for step in [("wait", 0.01), *others]:
        perform(other, step)
    other.past.show(then, None)
    other.past.go_on(hold=True)
    for bench in (plain, other):
        bench.virtual.set_time(wire.SetTime(speed=1.0, paused=False))
        bench.wait(1.0)
    assert moved(other.rig) == moved(plain.rig)


# Over the web socket


def test_windows_scrub_and_acting_calls_are_refused(tmp_path):
    (tmp_path / "program.tmc").write_text(PROGRAM)

    async def scenario():
        async with running(tmp_path, virtual()) as ide, ide.page() as page, ide.debugger() as editor:
            await page.call(wire.Download("program.tmc", run=True))
            await page.until(lambda: page.state["time"]["clock"] > HZ)
            shape = await page.event(wire.History, lambda event: event.branches[0].end > HZ // 2)
            assert shape.shown == -1 and shape.limit == 64 << 20 and 0 < shape.memory < shape.limit
            await page.call(wire.ShowPast(HZ // 2))
            await page.until(lambda: page.state["time"]["clock"] == HZ // 2)
            assert page.state["time"]["flags"] & 8 and page.state["program"]["paused"] == 1
            assert await page.refusal(wire.ExecuteText("MST 0")) == "past"
            assert await page.refusal(wire.SetBench("left", 0, 1)) == "past"
            assert await page.refusal(wire.SetTime(paused=False)) == "past"
            assert await page.refusal(wire.ShowPast(1e15)) == "history"
            assert "past moment" in await editor.fail("evaluate", expression="gp[3] = 1", context="repl")
            marks = await page.call(wire.ReadMarks(0))
            assert any(mark["text"] == "run" for mark in marks["marks"])
            assert sum(marks["telegrams"]) > 0
            await page.call(wire.GoOn(hold=True))
            await page.until(lambda: not page.state["time"]["flags"] & 8)
            assert page.state["time"]["flags"] & 1
            assert ide.virtual.rig.now == HZ // 2
            shape = await page.event(wire.History, lambda event: len(event.branches) == 2)
            assert shape.present == 1
            await page.call(wire.ShowPast(0))
            await page.call(wire.StopAll())
            await page.until(lambda: not page.state["time"]["flags"] & 8)

    asyncio.run(scenario())
