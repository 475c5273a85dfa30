"""Loops that follow a turning motor are not executed, and nobody can tell."""

from __future__ import annotations

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from firmware.programs import CLOCKS, direct, program_of
from firmware.test_program_properties import started
from tmcm34x.bench import Rig, simple_rig
from tmcm34x.clock import HZ, MS, run_until
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.mnemonic import format_instruction

LOOP = 3
"""Address of the reading in the programs below."""
LENGTH = 7
"""Commands of the loop, with the reading and the jump back."""
MOTOR = st.integers(0, 1)
PLACE = st.one_of(st.integers(-4000, 4000), st.sampled_from([0, 1, 2**23 - 1, -(2**23), 2**31 - 1]))
ADDRESS = st.integers(LOOP, LOOP + LENGTH + 1)


def command(
    number: int, types: object = 0, motors: object = 0, values: object = 0
) -> st.SearchStrategy[Instruction]:
    return st.builds(
        Instruction,
        *(
            each if isinstance(each, st.SearchStrategy) else st.just(each)
            for each in (number, types, motors, values)
        ),
    )


MOTION = st.one_of(
    command(4, values=st.integers(-6000, 6000)),
    command(1, values=st.integers(-300, 300)),
    command(4, types=1, values=st.integers(-3000, 3000)),
)
BODY = st.one_of(
    command(20, values=PLACE),
    command(20, values=PLACE),
    command(21, types=st.integers(0, 8), values=ADDRESS),
    command(21, types=st.integers(0, 8), values=st.just(LOOP)),
    command(19, types=st.sampled_from([0, 1, 1, 0, 2, 5, 9]), values=st.integers(-3000, 3000)),
    command(33, types=st.integers(0, 10)),
    command(35, types=st.integers(0, 2), motors=2),
    command(10, types=st.integers(0, 2), motors=2),
    command(9, types=st.integers(0, 2), motors=2, values=st.integers(-3, 3)),
    command(36),
    command(23, values=ADDRESS),
    command(24),
    command(6, types=1, motors=MOTOR),
    command(6, types=3),
)
PROGRAMS = st.builds(
    lambda speed, motion, motor, body, after: [
        Instruction(5, 4, 0, speed), Instruction(1, 0, 1, 200), motion,
        Instruction(6, 1, motor, 0), *body, Instruction(22, 0, 0, LOOP), after, Instruction(22, 0, 0, LOOP),
    ],
    st.integers(20, 1500), MOTION, MOTOR, st.lists(BODY, min_size=LENGTH - 2, max_size=LENGTH - 2), MOTION,
)  # fmt: skip
"""Programs with a loop that reads a position and goes on from what it has read."""
HOSTS = st.sampled_from(
    [
        "MVP ABS, 0, 300",
        "MST 0",
        "ROL 0, 100",
        "SAP 1, 0, 77",
        "SGP 1, 2, 5",
        "GGP 1, 2",
        "GAP 1, 0",
        "SAP 5, 0, 20",
    ]
)


def let_pass(_: int) -> bool:
    return False


def run(program: list[Instruction], steps: list[tuple[int, str]], *, watched: bool) -> str:
    """The state in the end, with a host's command after each of some times."""
    rig = started(program)
    module = rig.modules[0]
    if watched:
        module.program.hook(let_pass)
    for length, line in steps:
        run_until(rig, rig.now + length)
        direct(module, line)
    run_until(rig, 150 * MS)
    module.program.unhook(let_pass)
    module.program.wake()
    return rig.digest()


TURNS_ROUND = [
    *program_of("SAP 4, 0, 20\nROR 0, -26\nLoop: GAP 1, 0\nCOMP 0\nCLE ALL\nCALCX ADD\nCOMP 0\nJA Loop\n")
]
"""Told to go to 300 with little acceleration, its speed and target speed are both 0 for milliseconds at the turn."""


@settings(max_examples=150)
@given(PROGRAMS, st.lists(st.tuples(st.integers(1, 20 * MS), HOSTS), max_size=5))
@example(TURNS_ROUND, [(32768, "MVP ABS, 0, 300"), (1, "SAP 5, 0, 20")])
def test_it_makes_no_difference_whether_each_command_is_looked_at(
    program: list[Instruction], steps: list[tuple[int, str]]
) -> None:
    assert run(program, steps, watched=False) == run(program, steps, watched=True)


@settings(max_examples=80)
@given(PROGRAMS, st.lists(st.integers(1, 15 * MS), max_size=12))
def test_slices_make_no_difference(program: list[Instruction], slices: list[int]) -> None:
    whole, sliced = started(program), started(program)
    for length in slices:
        run_until(sliced, min(sliced.now + length, 150 * MS))
        sliced.digest()
    for rig in (whole, sliced):
        run_until(rig, 150 * MS)
    assert whole.digest() == sliced.digest()


def events(rig: Rig, until: int) -> int:
    """How many times something happens by a clock."""
    count = 0
    while (when := rig.next_event()) <= until:
        rig.advance(when)
        count += 1
    rig.advance(until)
    return count


def following(body: str) -> Rig:
    rig = simple_rig(343)
    rig.modules[0].eeprom.write_program(
        program_of(f"SAP 4, 0, 100\nMVP ABS, 0, 8000000\nLoop: GAP 1, 0\n{body}")
    )
    rig.modules[0].program.run(0)
    return rig


@pytest.mark.parametrize(
    "body",
    [
        "COMP 7000000\nJC LT, Loop\nSTOP",
        "COMP 500\nJC LT, Loop\nCOMP 7000000\nJC NE, Loop\nSTOP",
        "AGP 4, 2\nCALC SUB, 7000000\nAGP 5, 2\nJC NZ, Loop\nSTOP",
        "CSUB Test\nJC LT, Loop\nSTOP\nTest: COMP 7000000\nRSUB",
        "SGP 3, 2, 17\nGGP 3, 2\nJA Loop",
    ],
)
def test_a_loop_that_waits_for_a_position_is_not_executed(body: str) -> None:
    rig = following(body)
    assert events(rig, 2 * HZ) < 60
    assert rig.modules[0].program.executed == 2 * HZ // CLOCKS


@pytest.mark.parametrize(
    "body",
    [
        "GGP 3, 2\nCALC ADD, 1\nAGP 3, 2\nJA Loop",
        "CALC MUL, 2\nAGP 3, 2\nCOMP 7000000\nJC LT, Loop\nSTOP",
        "JC GE, Loop\nCOMP 7000000\nJA Loop",
        "CALCX SUB\nCOMP 7000000\nJC LT, Loop\nSTOP",
        "CALC ADD, 2000000000\nJA Loop",
    ],
)
def test_a_loop_whose_rounds_differ_otherwise_is_executed(body: str) -> None:
    assert events(following(body), HZ // 10) > 100


def test_a_loop_that_is_too_long_is_executed() -> None:
    rounds = [events(following("CALC ADD, 0\n" * length + "JA Loop"), HZ // 10) for length in (60, 70)]
    assert rounds[0] < rounds[1] // 2


@pytest.mark.parametrize("low", range(990, 1010, 5))
def test_the_reading_that_ends_the_loop_is_the_first_that_can(low: int) -> None:
    rig = following(f"COMP {low}\nJC LT, Loop\nAGP 0, 2\nSTOP")
    watched = following(f"COMP {low}\nJC LT, Loop\nAGP 0, 2\nSTOP")
    watched.modules[0].program.hook(let_pass)
    for each in (rig, watched):
        while each.modules[0].program.active:
            each.advance(each.next_event())
    module = rig.modules[0]
    assert low <= module.program.variables[0] <= low + 2
    assert (rig.now, module.program.variables[0]) == (watched.now, watched.modules[0].program.variables[0])


def test_what_comes_next_is_the_reading_that_is_executed() -> None:
    rig = following("COMP 7000000\nJC LT, Loop\nSTOP")
    run_until(rig, HZ)
    assert format_instruction(rig.modules[0].program.memory[rig.modules[0].program.upcoming]) == "GAP 1, 0"
