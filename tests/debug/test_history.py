"""Every past moment can be reached again, and what was done differently is another branch."""

import inspect
import sys
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from debug.debuggees import PROGRAM, bench, breakpoints, go
from debug.hosts import Hosts
from tmcm34x.bench import simple_rig
from tmcm34x.bench.action import Action
from tmcm34x.clock import HZ, MS, NEVER, run_until
from tmcm34x.debug.branches import HistoryError
from tmcm34x.debug.history import DENSE_CLOCKS, DENSE_INPUTS, History
from tmcm34x.debug.watches import WatchedValue
from tmcm34x.tmcl.datagram import pack_request
from tmcm34x.tmcl.mnemonic import parse_instruction


def started(source=PROGRAM):
    opened, _ = bench(source, keeps_history=True)
    opened.start()
    return opened


def stops_at(opened, *addresses, **texts):
    opened.set_breakpoints(breakpoints(*addresses, **texts))


def counted(opened):
    return opened.view.read("gp", (1,))


# History


def recorded(seconds=3.0, **options):
    """A bench with moves, commands and switches of `seconds`, and the digests that it had on its way."""
    rig = simple_rig()
    history = History(rig, **options)
    digests = {}
    for n in range(int(seconds * 10)):
        run_until(history, rig.now + 7)
        instruction = parse_instruction(f"MVP ABS, {n % 3}, {n * 977 % 20000}")
        rig.modules[0].execute(instruction)
        history.record("command", 0, tuple(instruction))
        if n % 4 == 0:
            rig.act(Action("switch", 0, (n % 3, "left", n % 8 == 0)))
        run_until(history, rig.now + HZ // 10 - 7)
        digests[rig.now] = rig.digest()
    return history, digests


def test_every_past_moment_can_be_looked_at_again():
    history, digests = recorded()
    now = history.rig.digest()
    for clock in sorted(digests, key=lambda clock: clock * 7919 % 104729):
        assert history.look_at(clock).digest() == digests[clock]
    assert history.rig.digest() == now


def test_going_back_and_on_again_repeats_what_happened():
    history, digests = recorded()
    clocks = sorted(digests)
    history.return_to(clocks[4])
    assert history.rig.digest() == digests[clocks[4]]
    for clock in clocks[5:]:
        run_until(history, clock)
        assert history.rig.digest() == digests[clock]
    assert len(history.branches) == 1


def test_doing_something_else_begins_a_branch_and_the_old_one_stays_reachable():
    history, digests = recorded()
    clocks = sorted(digests)
    history.return_to(clocks[4])
    history.rig.act(Action("power", 0, (False,)))
    run_until(history, clocks[8])
    old, new = history.branches
    assert (new.number, new.since, new.end) == (1, clocks[4], clocks[8])
    assert history.branch is new and not history.rig.modules[0].powered
    assert history.look_at(clocks[-1], old).digest() == digests[clocks[-1]]
    history.return_to(clocks[6], old)
    assert history.branch is old and history.rig.digest() == digests[clocks[6]]


def test_what_has_not_come_yet_cannot_be_reached():
    history, _ = recorded(0.5)
    with pytest.raises(HistoryError, match="has not come yet; the branch ends at 500 ms"):
        history.look_at(HZ)


def test_memory_stays_within_its_limit_and_recent_snapshots_are_denser():
    rig = simple_rig()
    history = History(rig, limit=20 * History(rig).memory)
    move_for(history, 200)
    assert history.memory <= history.limit
    clocks = [snapshot.clock for snapshot in history.branch.snapshots]
    assert clocks[0] == 0 and len(clocks) > 30
    assert clocks[-1] - clocks[-2] < clocks[2] - clocks[1]
    plain = History(simple_rig())
    move_for(plain, 33)
    assert history.look_at(plain.rig.now).digest() == plain.rig.digest()


def move_for(history, stretches):
    """A move in every stretch that is long enough for a snapshot."""
    for n in range(stretches):
        run_until(history, history.rig.now + 7)
        instruction = parse_instruction(f"MVP ABS, {n % 3}, {n * 977 % 20000}")
        history.rig.modules[0].execute(instruction)
        history.record("command", 0, tuple(instruction))
        run_until(history, history.rig.now + DENSE_CLOCKS)


def test_a_history_without_room_keeps_its_newest_snapshot_and_names_the_oldest_moment():
    history = History(simple_rig(), limit=1)
    move_for(history, 5)
    assert history.oldest > 0
    with pytest.raises(HistoryError, match="the oldest moment is"):
        history.look_at(history.oldest - 1)
    history.look_at(history.oldest)


COMMANDS = [
    "MVP ABS, 0, 40000",
    "MVP REL, 1, -300",
    "ROR 2, 700",
    "MST 2",
    "GAP 1, 0",
    "SAP 4, 0, 900",
    "SGP 3, 2, 5",
]
PIECES = [pack_request(1, parse_instruction(command)) for command in COMMANDS]
SENT = st.tuples(
    st.integers(0, 1),
    st.sampled_from([*PIECES, *(piece[:4] for piece in PIECES[:2]), *(piece[4:] for piece in PIECES[:2])]),
    st.sampled_from([0, 1, 50, MS, 4 * MS, 6 * MS, HZ // 3, 2 * HZ]),
)


@settings(max_examples=25)
@given(st.lists(SENT, min_size=1, max_size=60), st.randoms(use_true_random=False))
def test_what_came_over_lines_is_done_again_at_any_moment(sent, chance):
    hosts = Hosts(2)
    seen = {}
    for n, piece in enumerate(sent):
        hosts.send(*piece)
        if n % 7 == 0:
            hosts.server.rig.act(Action("switch", 0, (0, "left", n % 2 == 0)))
            hosts.server.settle()
        seen[hosts.history.now] = hosts.server.rig.digest()
        hosts.wait(chance.choice([0, 3, MS, HZ]))
        seen[hosts.history.now] = hosts.server.rig.digest()
    clocks = list(seen)
    chance.shuffle(clocks)
    for clock in clocks:
        assert hosts.history.look_at(clock).digest() == seen[clock]


def test_telegrams_at_one_clock_have_snapshots_among_them_too():
    hosts = Hosts(1)
    for _ in range(2 * DENSE_INPUTS + 10):
        hosts.send(0, PIECES[4], 0)
    history = hosts.history
    places = [snapshot.inputs for snapshot in history.branch.snapshots]
    assert len(places) == 3 and all(after - before <= DENSE_INPUTS + 1 for before, after in pairwise(places))
    assert history.look_at(history.now).digest() == history.rig.digest()


def test_a_telegram_between_events_has_one_call_of_the_history():
    hosts = Hosts(1)
    for piece in PIECES:
        hosts.send(0, piece, HZ // 100)
    calls = []
    sys.setprofile(lambda frame, event, _: calls.append((event, frame.f_code.co_filename)))
    try:
        hosts.wall_s += 1e-4
        hosts.lines[0].receive(PIECES[4])
    finally:
        sys.setprofile(None)
    package = Path(inspect.getfile(History)).parent
    assert [event for event, place in calls if Path(place).parent == package].count("call") == 1
    assert hosts.history.branch.end == hosts.history.now == hosts.history.branch.inputs[-1].clock


def test_a_telegram_after_going_on_from_a_past_moment_belongs_to_the_new_branch():
    hosts = Hosts(1)
    for n in range(10):
        hosts.send(0, PIECES[n % 3], HZ // 10)
    history = hosts.history
    hosts.server.put_back(lambda: history.go_on_from(HZ // 2))
    hosts.send(0, PIECES[2], HZ // 10)
    old, new = history.branches
    assert [item.kind for item in new.inputs][-2:] == ["lines", "received"]
    assert len(old.inputs) == 11 and new.inputs[-1].clock == history.now
    assert history.look_at(history.now).digest() == history.rig.digest()


# Steps back


SEARCHES = 11
"""Parts of a program's saved state before those that only say how far a look ahead has come."""


def visible(rig):
    """The state of a rig, without what depends on whether commands were looked at one by one."""
    now, happened, modules, worlds = rig.save()
    return now, happened, [(*m[:3], m[3][:SEARCHES], *m[4:]) for m in modules], worlds


def positions(opened):
    return opened.program.counter, len(opened.program.stack), visible(opened.rig)


def test_every_step_forward_can_be_taken_back():
    opened = started()
    seen = []
    while not opened.over:
        seen.append(positions(opened))
        opened.step_in()
        opened.advance(NEVER)
    seen_back = []
    for _ in seen:
        opened.step_back(over=False)
        seen_back.append(positions(opened))
    assert seen_back == seen[::-1]


def test_a_step_back_over_a_call_lands_before_the_call():
    opened = started()
    stops_at(opened, 3)
    go(opened)
    opened.step_back(over=True)
    assert (opened.program.counter, len(opened.program.stack)) == (2, 0)
    assert counted(opened) == 0


def test_stepping_back_at_the_beginning_stays_there_and_says_so():
    opened = started()
    opened.step_back(over=False)
    assert opened.listener.stops[-1].text == "the beginning of the history"
    go(opened)
    assert opened.over and counted(opened) == 3


def test_a_run_that_went_back_ends_like_one_that_did_not():
    plain = started()
    go(plain)
    opened = started()
    stops_at(opened, 11)
    go(opened)
    go(opened)
    opened.step_back(over=False)
    opened.reverse_continue()
    opened.step_back(over=True)
    stops_at(opened)
    go(opened)
    assert opened.over and opened.rig.digest() == plain.rig.digest()


def test_breakpoints_and_their_conditions_hold_in_reverse():
    opened = started()
    go(opened)
    assert counted(opened) == 3
    stops_at(opened, 11, condition="gp[1] < 2")
    opened.reverse_continue()
    assert (opened.program.counter, counted(opened)) == (11, 1)
    assert opened.listener.stops[-1].breakpoints == (0,)
    opened.reverse_continue()
    assert (opened.program.counter, counted(opened)) == (11, 0)
    opened.reverse_continue()
    assert opened.listener.stops[-1].text == "the beginning of the history: nothing held before"
    go(opened)
    assert (opened.program.counter, counted(opened)) == (11, 0)


def test_hit_counts_in_reverse_are_those_of_the_way_forward():
    opened = started()
    go(opened)
    stops_at(opened, 11, hits="== 2")
    opened.reverse_continue()
    assert (opened.program.counter, counted(opened)) == (11, 1)


def test_data_breakpoints_hold_in_reverse():
    opened = started()
    go(opened)
    opened.set_watches([WatchedValue.make(1, "gp[1]")])
    counts = []
    for _ in range(3):
        opened.reverse_continue()
        counts.append(counted(opened))
    assert counts == [3, 2, 1]
    assert opened.listener.stops[-1].text == "gp[1]: 0 → 1"


def test_who_wrote_goes_to_just_before_the_write_and_names_the_command():
    opened = started()
    go(opened)
    write = opened.who_wrote("gp[1]")
    assert (write.address, write.before, write.after) == (13, 2, 3)
    assert write.cause.split() == ["AGP", "1,", "2"]
    assert (opened.rig.now, opened.program.counter, counted(opened)) == (write.clock - 1, 13, 2)
    assert opened.listener.stops[-1].reason == "goto"
    earlier = opened.who_wrote("gp[1]")
    assert (earlier.address, earlier.after, counted(opened)) == (13, 2, 1)


def last_writes(opened, *texts):
    """What wrote each value last, asked from the present moment, which is left as it is."""
    now, writes = opened.rig.now, []
    for text in texts:
        writes.append(opened.who_wrote(text))
        opened.go_to(now)
    return writes


def test_who_wrote_finds_a_write_of_the_same_value_an_input_and_the_module_itself():
    opened = started("SGP 5, 2, 7\nSGP 5, 2, 7\nMVP ABS, 0, 1000\nWAIT POS, 0, 0\nSTOP\n")
    stops_at(opened, 4)
    go(opened)
    variable, target, position = last_writes(
        opened, "gp[5]", "ap[target_position][0]", "ap[actual_position][0]"
    )
    assert (variable.address, target.address) == (1, 2)
    assert position.cause == "no command: the module itself"
    opened.execute(parse_instruction("SGP 5, 2, 8"))
    opened.view.assign("gp[6]", "9")
    commanded, assigned, never = last_writes(opened, "gp[5]", "gp[6]", "gp[9]")
    assert commanded.cause.startswith("command of a host: SGP")
    assert assigned.cause == "debugger: gp[6] = 9"
    assert never is None


def test_a_session_without_a_history_says_why():
    opened, _ = bench()
    opened.start()
    with pytest.raises(HistoryError, match="keeps no history"):
        opened.step_back(over=True)


@settings(max_examples=15)
@given(st.lists(st.tuples(st.integers(0, 60), st.booleans()), min_size=1, max_size=5))
def test_forward_back_forward_is_forward(turns):
    plain = started()
    go(plain)
    opened = started()
    for steps, over in turns:
        for _ in range(steps):
            opened.step_in()
            opened.advance(NEVER)
            if opened.over:
                break
        for _ in range(steps // 2):
            opened.step_back(over=over)
    go(opened)
    while not opened.over:
        go(opened)
    assert opened.rig.digest() == plain.rig.digest()
    assert opened.rig.now < 10_000 * MS
