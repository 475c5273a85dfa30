"""Whatever a bench does, one step to its next event is little work, however far ahead that event lies."""

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from bench.rigs import rig_of, say
from tmcm34x.clock import HZ, NEVER, run_until
from tmcm34x.tmcl.mnemonic import parse_instruction
from tmcm34x.toolchain.assembler import assemble
from work import TooMuchError, lines_of

BENCH = """
[[module]]
model = {model}

[module.input]
IN_0 = {{ kind = "sine", period_ms = 700 }}
IN_1 = {{ kind = "square", period_ms = 130 }}

[[module.axis]]
load = {{ kind = "carriage", low = -2, high = 102, start = 40, friction_n = 4 }}
switch.left = {{ position = 0, hysteresis = 0.1 }}
switch.right = {{ position = 100, hysteresis = 0.1 }}
switch.bounce_ms = 2

[[module.axis]]
load = {{ kind = "turntable", ratio = 5 }}
switch.left = {{ position = 0, width = 10, hysteresis = 0.5 }}
"""

LIMIT = 150_000
"""Lines of the product from one event to the next; planning to brake from the highest velocity takes half of it."""

speeds = st.one_of(st.integers(-20, 20), st.integers(-2047, 2047))
settings_of_an_axis = st.one_of(
    st.tuples(st.just(4), st.integers(0, 2047)),
    st.tuples(st.just(5), st.one_of(st.sampled_from([0, 1, 2047]), st.integers(0, 2047))),
    st.tuples(st.sampled_from([153, 154]), st.integers(0, 13)),
    st.tuples(st.just(130), st.integers(0, 2047)),
    st.tuples(st.sampled_from([12, 13, 149]), st.integers(0, 1)),
    st.tuples(st.just(141), st.integers(0, 4095)),
    st.tuples(st.just(1), st.integers(-(2**23), 2**23 - 1)),
    st.tuples(st.just(140), st.integers(0, 6)),
    st.tuples(st.sampled_from([205, 212]), st.integers(0, 7)),
)
commands = st.one_of(
    st.builds("SAP {0[0]}, {1}, {0[1]}".format, settings_of_an_axis, st.integers(0, 2)),
    st.builds("ROR {1}, {0}".format, speeds, st.integers(0, 2)),
    st.builds("MVP ABS, {1}, {0}".format, st.integers(-(2**23), 2**23 - 1), st.integers(0, 2)),
    st.builds("MVP REL, {1}, {0}".format, st.integers(-300, 300), st.integers(0, 2)),
    st.builds("MST {}".format, st.integers(0, 2)),
    st.builds("RFS START, {}".format, st.integers(0, 2)),
    st.builds("SGP {0}, 0, {1}".format, st.sampled_from([6, 8, 11, 12]), st.integers(0, 2**23)),
)


def step(rig):
    """Go to the next event, or pass an hour where there is none."""
    due = rig.next_event()
    rig.advance(due if due < NEVER else rig.now + 3600 * HZ)


@settings(max_examples=40)
@example(343, [("ROR 0, 7", 100)])
@example(343, [("SAP 4, 0, 7", 1), ("MVP ABS, 0, 8000000", 100)])
@given(
    st.sampled_from([341, 342, 343]),
    st.lists(st.tuples(commands, st.integers(0, 12)), min_size=1, max_size=10),
)
def test_a_step_to_the_next_event_is_bounded_work(model, script):
    rig = rig_of(BENCH.format(model=model))
    module = rig.modules[0]
    for line, steps in script:
        module.execute(parse_instruction(line))
        for _ in range(steps):
            now = rig.now
            lines_of(lambda: step(rig), LIMIT)
            assert rig.now > now


def test_a_motor_that_turns_passes_its_target_again_and_again():
    rig = rig_of("[[module]]\n")
    say(rig, "ROR 0, 2047")
    run_until(rig, 3600 * HZ)
    assert say(rig, "GAP 3, 0") == 2047


def test_the_count_ends_what_does_not_end():
    def judge():
        return assemble("MVP ABS, 0, 1000")

    assert lines_of(judge, LIMIT) > 3
    with pytest.raises(TooMuchError, match="more than 3 lines"):
        lines_of(judge, 3)
