"""Expectations of bench files."""

import pytest

from tmcm34x.bench import BenchError, build
from tmcm34x.bench.description import parse
from tmcm34x.bench.session.watch import ExpectationWatch
from tmcm34x.clock import HZ, run_until
from tmcm34x.tmcl.mnemonic import parse_instruction
from tmcm34x.trace.recorder import Trace


def watched(*events, command="MVP ABS, 0, 10000", seconds=5):
    tables = "".join(f"[[event]]\nat_ms = {at}\n{keys}\n" for at, keys in events)
    rig = build(parse(f"[[module]]\n{tables}"))
    watch = ExpectationWatch(rig)
    rig.modules[0].execute(parse_instruction(command))
    run_until(Trace(rig, [watch]), seconds * HZ)
    watch.finish()
    return [str(failure) for failure in watch.failures]


def expect(text):
    return f'do = "expect"\nexpect = "{text}"'


@pytest.mark.parametrize(
    "text",
    [
        "within 2 s: motor 0 at 10000",
        "within 2 s: GAP 8, 0 is 100 1",
        "always: outputs 00000000",
        "never: motor 0 lost steps",
        "never: motor 1 turning",
    ],
)
def test_what_comes_true_is_no_failure(text):
    assert watched((0, expect(text))) == []


@pytest.mark.parametrize(
    ("at", "text", "failure"),
    [
        (0, "within 100 ms: motor 0 at 10000", "of event[0] failed at 0.100000 s: "),
        (0, "always: motor 0 at 0..5000", "of event[0] failed at 0."),
        (0, "never: motor 0 turning", "turning"),
        (2000, "within 1 s: motor 0 at 5", "failed at 3.000000 s: 10000"),
        (4500, "within 1 s: motor 0 at 5", "failed at 5.000000 s: 10000, when the run ended"),
        (6000, "always: motor 0 at 5", "failed at 5.000000 s: 10000, when the run ended"),
        (6000, "never: motor 0 at 10000", "failed at 5.000000 s: 10000, when the run ended"),
    ],
)
def test_what_does_not_come_true_is_one_failure(at, text, failure):
    (found,) = watched((at, expect(text)))
    assert text in found
    assert failure in found


def test_what_the_run_did_not_come_to_is_looked_at_when_it_ends():
    assert watched((6000, expect("within 1 s: motor 0 at 10000"))) == []


def test_expectations_stand_beside_other_events():
    found = watched(
        (0, 'do = "switch"\nside = "right"'),
        (100, expect("always: motor 0 right switch active")),
        (200, 'do = "switch"\nside = "right"\non = false'),
        (300, expect("within 0 s: motor 0 right switch inactive")),
    )
    assert found == ["'always: motor 0 right switch active' of event[1] failed at 0.200000 s: inactive"]


def test_an_expectation_that_cannot_be_read_is_told_with_its_path():
    with pytest.raises(
        BenchError, match=r"event\[0\]\.expect: column 9: expected outputs.*did you mean motor"
    ):
        watched((0, expect("always: moter 0 at 5")))
    with pytest.raises(BenchError, match=r"event\[0\]\.expect: column 1: expected within, always, never"):
        watched((0, 'do = "expect"'))
