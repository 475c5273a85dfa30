"""The ramp generator in closed form against its definition, tick by tick."""

from dataclasses import replace
from itertools import accumulate, pairwise
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chips.harness import TICK, Pair, chip_with, events_until, get_field, path, set_field, signed24
from chips.oracle import RAMP, VELOCITY, Oracle
from tmcm34x.chips.ramp import brake_factor
from tmcm34x.chips.ramp.braking import Braking
from tmcm34x.chips.ramp.parts import floors
from tmcm34x.chips.registers import BY_NAME
from tmcm34x.chips.tmc429 import Tmc429
from tmcm34x.clock import HZ, NEVER, pack, run_until, unpack
from work import lines_of

VECTORS = Path(__file__).parents[1] / "vectors" / "ramps" / "positioning.tsv"


# ---- state for state

divisors = st.one_of(st.integers(0, 3), st.integers(0, 7), st.integers(0, 13))
positions = st.one_of(
    st.integers(-300, 300), st.integers(2**23 - 40, 2**23 - 1), st.integers(-(2**23), -(2**23) + 40)
)
away = st.one_of(
    st.integers(-20, 20),
    st.integers(-2500, 2500),
    st.integers(-(2**19) - 9, 2**19 + 9),
    st.sampled_from([2**23 - 2, 2**23, -(2**23) + 2]),
)
speeds = st.one_of(st.sampled_from([0, 1, 2047]), st.integers(0, 2047))
slopes = st.one_of(st.sampled_from([0, 1, 2047]), st.integers(0, 255), st.integers(256, 2047))
signed_speeds = st.integers(-2048, 2047)
bits = st.integers(0, 1)


@st.composite
def settings_of_an_axis(draw):
    ramp_div, pulse_div, a_max = draw(divisors), draw(divisors), draw(slopes)
    p_mul, p_div = brake_factor(a_max, ramp_div, pulse_div)
    if draw(bits):
        p_mul, p_div = draw(st.integers(128, 255)), draw(st.integers(0, 15))
    x = draw(positions)
    return {
        "ramp_div": ramp_div,
        "pulse_div": pulse_div,
        "usrs": draw(st.integers(0, 7)),
        "v_min": draw(st.one_of(st.integers(0, 2), st.integers(0, 400))),
        "v_max": draw(speeds),
        "a_max": a_max,
        "p_mul": p_mul,
        "p_div": p_div,
        "x": x,
        "tolerance": draw(st.one_of(st.just(0), st.integers(0, 300))),
        "soft_stop": draw(bits),
        "disable_stop_l": draw(bits),
        "disable_stop_r": draw(bits),
        "ref_rnl": draw(bits),
        "mask": draw(st.one_of(st.sampled_from([0, 255]), st.integers(0, 255))),
        "mode": draw(st.sampled_from([0, 0, 0, 1, 2, 3])),
        "v_target": draw(signed_speeds),
        "x_target": signed24(x + draw(away)),
    }


actions = st.one_of(
    st.tuples(st.just("target"), away),
    st.tuples(st.just("target"), away),
    st.tuples(st.just("x"), away),
    st.tuples(st.just("v_max"), speeds),
    st.tuples(st.just("v_min"), speeds),
    st.tuples(st.just("a_max"), slopes),
    st.tuples(st.just("brakes"), slopes),
    st.tuples(st.just("p_mul"), st.integers(128, 255)),
    st.tuples(st.just("p_div"), st.integers(0, 15)),
    st.tuples(st.just("ramp_div"), divisors),
    st.tuples(st.just("pulse_div"), divisors),
    st.tuples(st.just("usrs"), st.integers(0, 7)),
    st.tuples(st.just("v"), signed_speeds),
    st.tuples(st.just("v_target"), signed_speeds),
    st.tuples(st.just("mode"), st.integers(0, 3)),
    st.tuples(st.just("tolerance"), st.integers(0, 300)),
    st.tuples(st.just("soft_stop"), bits),
    st.tuples(st.just("disable_stop_l"), bits),
    st.tuples(st.just("disable_stop_r"), bits),
    st.tuples(st.just("ref_rnl"), bits),
    st.tuples(st.just("mask"), st.integers(0, 255)),
    st.tuples(st.just("inputs"), st.tuples(bits, bits)),
    st.tuples(st.just("inputs"), st.tuples(bits, bits)),
    st.tuples(st.just("clear"), st.integers(0, 255)),
    st.tuples(st.just("arm"), st.none()),
    st.tuples(st.just("wait"), st.none()),
)
waits = st.one_of(st.integers(1, 400), st.integers(1, 40_000), st.integers(1, 120_000))


def act(pair, name, value):
    oracle = pair.oracle
    match name:
        case "target":
            pair.change(x_target=signed24(oracle.x + value))
        case "x":
            pair.change(x=signed24(oracle.x + value))
        case "brakes":
            p_mul, p_div = brake_factor(value, oracle.ramp_div, oracle.pulse_div)
            pair.change(a_max=value, p_mul=p_mul, p_div=p_div)
        case "inputs":
            pair.inputs(*map(bool, value))
        case "clear":
            pair.clear(value)
        case "arm":
            pair.arm_latch()
        case "wait":
            pass
        case _:
            pair.change(**{name: value})


@settings(max_examples=250)
@given(settings_of_an_axis(), st.lists(st.tuples(actions, waits), min_size=1, max_size=14), st.integers(0, 2))
def test_every_state_is_the_one_of_the_definition(values, script, motor):
    pair = Pair(motor)
    pair.change(**values)
    pair.compare()
    for (name, value), wait in script:
        act(pair, name, value)
        pair.compare()
        pair.run(wait)


@settings(max_examples=20)
@given(
    st.tuples(st.integers(2, 7), st.integers(0, 5), st.integers(1, 2047)),
    st.integers(2, 2047),
    st.integers(-3000, 3000),
    st.lists(st.integers(1, 60_000), max_size=20),
)
def test_a_whole_move_is_the_one_of_the_definition(slope, v_max, target, slices):
    ramp_div, pulse_div, a_max = slope
    p_mul, p_div = brake_factor(a_max, ramp_div, pulse_div)
    pair = Pair()
    pair.change(ramp_div=ramp_div, pulse_div=pulse_div, v_min=1, v_max=v_max, p_mul=p_mul, p_div=p_div)
    pair.change(a_max=a_max, x_target=target)
    for clocks in slices:
        pair.run(clocks)
    while pair.chip.next_event() < 150_000 * TICK:
        pair.run(pair.chip.next_event() - pair.chip.now)
    pair.run(150_000 * TICK - pair.chip.now)


@settings(max_examples=60)
@given(settings_of_an_axis(), st.integers(0, 40_000), st.integers(1, 60_000))
def test_steps_ahead_are_the_ones_that_come_and_looking_changes_nothing(values, before, window):
    pair = Pair(1)
    pair.change(**values)
    pair.run(before)
    chip, oracle = pair.chip, pair.oracle
    due = chip.next_event()
    seen = list(chip.steps(1, chip.now, chip.now + window))
    assert chip.next_event() == due
    come = []
    while oracle.n < (chip.now + window) // TICK:
        x = oracle.x
        oracle.tick()
        if oracle.x != x:
            come.append((oracle.n * TICK, signed24(oracle.x - x)))
    assert seen == come


@settings(max_examples=60)
@given(settings_of_an_axis(), st.integers(0, 500), st.integers(0, 500))
def test_the_step_that_leaves_a_watched_range_is_an_event(values, below, above):
    pair = Pair()
    pair.change(**values)
    chip, oracle = pair.chip, pair.oracle
    low, high = max(oracle.x - below, -(2**23)), min(oracle.x + above, 2**23 - 1)
    chip.watch(0, low, high)
    copy = replace(oracle)
    events = pair.run(200_000)
    while low <= copy.x <= high and copy.n < oracle.n:
        copy.tick()
    assert low <= copy.x <= high or copy.n * TICK in events


@settings(max_examples=60)
@given(settings_of_an_axis(), st.integers(-500, 500).filter(bool))
def test_the_clock_at_which_a_position_is_reached_is_known_before(values, away):
    pair = Pair()
    pair.change(**values)
    chip, oracle = pair.chip, pair.oracle
    position = signed24(oracle.x + away)
    copy, foretold, until = replace(oracle), NEVER, 200_000
    while foretold == NEVER and chip.now < until:
        state = chip.save()
        foretold = chip.reaches(0, position)
        assert chip.save() == state
        chip.advance(min(chip.next_event(), foretold, until))
    while copy.x != position and copy.n < until // TICK:
        copy.tick()
    come = copy.n * TICK if copy.x == position else NEVER
    assert come == foretold or (come == NEVER and foretold > until)


def restored(chip):
    """Another chip with the state of this one, through the bytes that stand for it."""
    other = Tmc429()
    other.load(unpack(pack(chip.save())))
    return other


@settings(max_examples=60)
@given(settings_of_an_axis(), st.lists(st.tuples(actions, waits), min_size=1, max_size=8), st.integers(0, 2))
def test_a_chip_that_was_saved_goes_on_like_the_original(values, script, motor):
    pair = Pair(motor)
    pair.change(**values)
    for (name, value), wait in script:
        act(pair, name, value)
        twin = restored(pair.chip)
        assert twin.save() == pair.chip.save()
        events = pair.run(wait)
        assert events_until(twin, pair.chip.now) == events
        assert twin.digest() == pair.chip.digest()
        pair.chip = twin
        pair.compare()


@settings(max_examples=60)
@given(settings_of_an_axis(), st.lists(st.tuples(actions, st.integers(0, 4)), min_size=1, max_size=8))
def test_the_way_to_the_next_event_is_bounded_work_however_far_it_is(values, script):
    pair = Pair()
    pair.change(**values)
    chip, oracle = pair.chip, pair.oracle
    for (name, value), events in script:
        oracle.x = chip.position(0)
        act(pair, name, value)
        for _ in range(events):
            due = min(chip.next_event(), chip.now + 10**6 * HZ)
            assert due > chip.now
            lines_of(lambda due=due: (chip.advance(due), chip.next_event()), 500_000)


def test_a_turning_motor_passes_its_target_once_each_turn_of_the_counter():
    chip = chip_with(mode=VELOCITY, v_max=1024, v_target=1024, a_max=2047, x_target=1000)
    events_until(chip, HZ // 100)
    chip.transfer(BY_NAME["X_ACTUAL"].write(0))
    turn = 2**24 * 2 * TICK
    arrivals = [clock for clock, position, _ in path(chip, limit=5 * turn + HZ) if position == 1000]
    assert len(arrivals) == 5
    assert {after - before for before, after in pairwise(arrivals)} == {turn}


@settings(max_examples=200)
@given(st.integers(0, 10**6), st.integers(-(10**4), 10**4), st.integers(0, 60))
def test_floors_is_the_sum_of_floors(start, step, count):
    assert floors(start, step, count) == sum((start + i * step) // 256 for i in range(count))


# ---- figures


@pytest.mark.parametrize(
    ("a_max", "ramp_div", "pulse_div", "pair"),
    [
        (50, 3, 3, (197, 6)),
        (100, 7, 3, (197, 9)),
        (500, 7, 3, (247, 7)),
        (1000, 7, 3, (247, 6)),
        (2047, 7, 7, (252, 1)),
        (1, 0, 0, (252, 12)),
        (2047, 0, 3, (255, 0)),
        (1, 13, 0, (128, 13)),
        (0, 7, 3, (128, 13)),
    ],
)
def test_brake_factor_is_1_2_percent_below_the_ideal_or_the_nearest_there_is(
    a_max, ramp_div, pulse_div, pair
):
    assert brake_factor(a_max, ramp_div, pulse_div) == pair


def vectors():
    rows = [line.split("\t") for line in VECTORS.read_text().splitlines()[1:]]
    return [dict(zip(rows[0], row, strict=True)) for row in rows[1:]]


@pytest.mark.parametrize(
    "row", vectors(), ids=lambda row: f"{row['distance']}-{row['a_max']}-{row['ramp_div']}"
)
def test_positioning_keeps_its_recorded_course(row):
    axis = {name: int(row[name]) for name in ("v_max", "a_max", "ramp_div", "pulse_div", "p_mul", "p_div")}
    distance, peak = int(row["distance"]), int(row["peak"])
    chip = chip_with(v_min=1, x_target=distance, **axis)
    first, _ = next(chip.steps(0, 0, HZ))
    assert first == int(row["first_step"]) * TICK
    places = path(chip)
    assert places[-1] == (int(row["done"]) * TICK, distance, 0)
    assert chip.next_event() == NEVER

    chip = chip_with(v_min=1, x_target=distance, **axis)
    brake_start = int(row["brake_start"]) * TICK
    events_until(chip, brake_start - 1)
    assert abs(chip.velocity(0)) == peak
    before = chip.state(0).v
    events_until(chip, brake_start)
    assert abs(chip.state(0).v) < abs(before)
    if row["v_max_reached"] != "-":
        assert int(row["v_max_reached"]) * TICK in [clock for clock, _, _ in places]
    if abs(distance) >= 100:  # the last microstep, at V_MIN, outweighs the rest of shorter ones
        assert places[-1][0] / HZ == pytest.approx(float(row["trapezoid_s"]), rel=0.08)


@pytest.mark.parametrize("pulse_div", range(14))
def test_the_step_rate_follows_the_datasheet(pulse_div):
    chip = chip_with(mode=VELOCITY, pulse_div=pulse_div, v_max=2047, a_max=2047, v_target=1500)
    run_until(chip, HZ)
    start = chip.position(0)
    run_until(chip, 11 * HZ)
    assert chip.position(0) - start == pytest.approx(10 * HZ * 1500 / (2**pulse_div * 2048 * 32), abs=2)


@pytest.mark.parametrize(
    ("ramp_div", "pulse_div", "a_max"), [(7, 3, 1000), (3, 3, 50), (10, 2, 700), (0, 9, 3)]
)
def test_the_acceleration_follows_the_datasheet(ramp_div, pulse_div, a_max):
    chip = chip_with(
        ramp_div=ramp_div, pulse_div=pulse_div, v_max=2047, a_max=a_max, v_target=0, mode=VELOCITY
    )
    set_field(chip, 0, "V_TARGET", 1000)
    (reached, position, velocity), *_ = path(chip, limit=30 * HZ)
    assert velocity == 1000
    rate = HZ * velocity / (2**pulse_div * 2048 * 32)
    assert rate / (reached / HZ) == pytest.approx(HZ**2 * a_max / 2 ** (pulse_div + ramp_div + 29), rel=0.01)
    steps = velocity**2 / a_max * 2.0 ** (ramp_div - pulse_div) / 16
    assert position == pytest.approx(steps, rel=0.01, abs=1)


@pytest.mark.parametrize("target", [1, 2, 17, 300, 5000, 99_999, -4, -123_456])
def test_a_move_ends_at_its_target_with_speed_zero(target):
    p_mul, p_div = brake_factor(500, 7, 3)
    chip = chip_with(ramp_div=7, pulse_div=3, v_min=1, v_max=1000, a_max=500, p_mul=p_mul, p_div=p_div)
    set_field(chip, 0, "X_TARGET", target)
    places = path(chip)
    assert places[-1][1:] == (target, 0)
    assert max(abs(velocity) for _, _, velocity in places) <= 1000


def test_v_target_reads_v_max_while_accelerating_and_cruising_and_zero_while_braking():
    p_mul, p_div = brake_factor(500, 7, 3)
    chip = chip_with(ramp_div=7, pulse_div=3, v_min=1, v_max=800, a_max=500, p_mul=p_mul, p_div=p_div)
    assert get_field(chip, 0, "V_TARGET") == 0
    set_field(chip, 0, "X_TARGET", -20_000)
    run_until(chip, HZ // 20)
    assert get_field(chip, 0, "V_TARGET") == -800
    places = path(chip)
    assert get_field(chip, 0, "V_TARGET") == 0
    braking = next(clock for clock, _, velocity in places if -800 < velocity < 0 and clock > HZ // 10)
    chip = chip_with(ramp_div=7, pulse_div=3, v_min=1, v_max=800, a_max=500, p_mul=p_mul, p_div=p_div)
    set_field(chip, 0, "X_TARGET", -20_000)
    run_until(chip, braking - 256 * TICK)
    assert get_field(chip, 0, "V_TARGET") == -800
    run_until(chip, braking + HZ // 100)
    assert get_field(chip, 0, "V_TARGET") == 0


def test_velocity_mode_leaves_its_target_behind_when_the_mode_is_left():
    chip = chip_with(
        ramp_div=4, pulse_div=4, v_min=1, v_max=500, a_max=900, x_target=10**5, p_mul=200, p_div=4
    )
    run_until(chip, HZ // 10)
    set_field(chip, 0, "RAMP_MODE", VELOCITY)
    assert get_field(chip, 0, "V_TARGET") == 500
    set_field(chip, 0, "V_TARGET", -200)
    run_until(chip, HZ)
    assert chip.velocity(0) == -200
    set_field(chip, 0, "RAMP_MODE", RAMP)
    places = path(chip)
    assert places[-1][1:] == (10**5, 0)


def test_braking_of_many_velocity_units_is_a_handful_of_events():
    p_mul, p_div = brake_factor(20, 7, 3)
    chip = chip_with(ramp_div=7, pulse_div=3, v_min=1, v_max=2047, a_max=20, p_mul=p_mul, p_div=p_div)
    set_field(chip, 0, "X_TARGET", 2_000_000)
    assert len(path(chip, limit=1000 * HZ)) < 10


def test_a_target_half_a_turn_of_the_counter_away_is_never_reached():
    chip = chip_with(v_min=1, v_max=500, a_max=500, x=-(2**22), x_target=2**22)
    assert chip.next_event() == NEVER
    assert chip.read_status() & 1 == 0


FACTORY = {"ramp_div": 7, "pulse_div": 3, "v_min": 1, "v_max": 1000, "a_max": 1000}


def overshoot(p_mul, p_div, target, **axis):
    """How many microsteps a move passes its target by before it ends there."""
    chip = chip_with(**FACTORY | axis, p_mul=p_mul, p_div=p_div, x_target=target)
    positions = accumulate(direction for _, direction in chip.steps(0, 0, 20 * HZ))
    passed = max(positions) - target
    assert path(chip)[-1][1:] == (target, 0)
    return passed


@pytest.mark.parametrize(("ramp_div", "pulse_div", "a_max"), [(7, 3, 1000), (7, 3, 100), (5, 3, 2047)])
def test_no_move_with_the_factors_of_the_firmware_passes_its_target(ramp_div, pulse_div, a_max):
    p_mul, p_div = brake_factor(a_max, ramp_div, pulse_div)
    axis = {"ramp_div": ramp_div, "pulse_div": pulse_div, "a_max": a_max}
    assert {overshoot(p_mul, p_div, target, **axis) for target in range(5000, 5200)} == {0}


def test_factors_without_a_reduction_pass_the_target():
    # The ideal factor for A_MAX 1000, 7 and 3 is 1000 / (128 * 16) = 250 / 2^9; one less is 0.4 % below it.
    assert {overshoot(250, 6, target) for target in range(5000, 5200)} <= {1, 2}
    assert {overshoot(249, 6, target) for target in range(5000, 5200)} == {0}


def test_v_min_is_reached_before_the_target():
    p_mul, p_div = brake_factor(1000, 7, 3)
    chip = chip_with(**FACTORY | {"v_min": 40}, p_mul=p_mul, p_div=p_div, x_target=51_200)
    places = path(chip)
    *_, (arrival, position, _) = (place for place in places if place[2])
    assert position == 51_200
    chip = chip_with(**FACTORY | {"v_min": 40}, p_mul=p_mul, p_div=p_div, x_target=51_200)
    run_until(chip, arrival - 1)
    assert (chip.position(0), chip.velocity(0)) == (51_199, 40)


def test_without_v_min_the_motor_rests_one_step_before_its_target():
    p_mul, p_div = brake_factor(100, 7, 3)
    for target in (51_200, -777, 1):
        chip = chip_with(**FACTORY | {"v_min": 0, "a_max": 100}, p_mul=p_mul, p_div=p_div, x_target=target)
        run_until(chip, 10 * HZ)
        assert chip.position(0) == (target - 1 if target > 0 else target + 1)
        assert chip.velocity(0) == 0
        assert chip.next_event() == NEVER
        assert chip.read_status() & 1 == 0


def test_without_v_min_a_rare_ramp_tick_carries_most_moves_to_their_target():
    p_mul, p_div = brake_factor(1000, 7, 3)
    missing = []
    for target in range(5000, 5040):
        chip = chip_with(**FACTORY | {"v_min": 0}, p_mul=p_mul, p_div=p_div, x_target=target)
        run_until(chip, 10 * HZ)
        assert chip.velocity(0) == 0
        missing.append(target - chip.position(0))
    assert set(missing) <= {0, 1}
    assert missing.count(0) > 20


def test_the_oracle_is_plain():
    # One check by hand that the definition itself counts as the datasheet says: 2048 pulses of velocity 1.
    oracle = Oracle(mode=VELOCITY, v_max=1, v_target=1, a_max=256)
    for _ in range(2047):
        oracle.tick()
    assert (oracle.x, oracle.acc) == (0, 2047)
    oracle.tick()
    assert (oracle.x, oracle.acc) == (1, 0)


def test_a_turn_that_a_switch_forbids_ends_with_an_event_at_speed_zero():
    pair = Pair()
    pair.change(mode=VELOCITY, v_max=1, a_max=1, v_target=1)
    pair.run(31)
    pair.inputs(True, False)
    pair.run(1)
    pair.change(v_target=-1)
    assert pair.run(64) == [2 * TICK]


def test_a_soft_stop_without_acceleration_keeps_its_speed():
    pair = Pair()
    pair.change(mode=VELOCITY, soft_stop=1, v_max=500, a_max=2000, pulse_div=5, v_target=500)
    pair.run(HZ // 10)
    pair.change(a_max=0)
    pair.inputs(False, True)
    pair.run(HZ // 10)
    assert pair.oracle.stopping
    assert pair.oracle.v == 500 << 8


def test_a_way_is_not_known_past_its_end():
    pair = Pair()
    p_mul, p_div = brake_factor(1000, 7, 3)
    pair.change(
        ramp_div=7, pulse_div=3, v_min=1, v_max=500, p_mul=p_mul, p_div=p_div, a_max=1000, x_target=2000
    )
    while not (braking := [part for part in pair.chip.axes[0].parts if isinstance(part, Braking)]):
        pair.run(pair.chip.next_event() - pair.chip.now)
    part = braking[0]
    assert part.velocity(part.start.n) == part.start.v
    with pytest.raises(ValueError, match="past the end"):
        part.at(part.end + 1)
