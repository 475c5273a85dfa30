"""Routines, stack, times and variables of a program."""

import math

from hypothesis import given, settings

from tmcm34x.toolchain.assembler import assemble
from tmcm34x.toolchain.map import Map, Variable, program_map
from toolchain.generators import SOURCES

PROGRAM = """\
        SGP   0, 2, 5
Loop:   CSUB  Move
        WAIT  TICKS, 0, 10
        GGP   0, 2
        JC    ZE, Poll
        JA    Loop
Poll:   GIO   0, 0
        JC    ZE, Poll
        STOP
Move:   MVP   ABS, 0, 5
        CSUB  Deep
        RSUB
Deep:   GGP   1, 2
        AGP   0, 2
        RSUB
"""


def routines(text):
    return {r.name: r for r in Map(assemble(text)).routines}


def test_routines_have_their_size_their_calls_and_their_longest_way():
    found = routines(PROGRAM)
    assert {name: (r.line, r.instructions, r.calls) for name, r in found.items()} == {
        "start": (1, 9, ("Move",)), "Move": (10, 3, ("Deep",)), "Deep": (13, 3, ()),
    }  # fmt: skip
    assert (found["Deep"].longest, found["Move"].longest) == (3, 6)
    assert math.isinf(found["start"].longest)


def test_a_wait_ends_a_way():
    assert routines("L: ROR 0, 1\nROR 1, 1\nWAIT TICKS, 0, 1\nROR 2, 1\nJA L")["L"].longest == 5
    assert routines("STOP")["start"].longest == 1


def test_a_wait_in_a_routine_ends_the_way_of_its_caller():
    found = routines("ROR 0, 1\nLoop: CALC ADD, 1\nCSUB Rest\nJA Loop\nRest: WAIT TICKS, 0, 2\nRSUB")
    assert (found["start"].longest, found["Rest"].longest) == (5, 1)
    sometimes = "Loop: CSUB Rest\nJA Loop\nRest: JC ZE, Out\nWAIT TICKS, 0, 2\nOut: RSUB"
    assert math.isinf(routines(sometimes)["Loop"].longest)


def test_recursion_has_no_longest_way():
    assert math.isinf(routines("CSUB S\nSTOP\nS: CSUB S\nRSUB")["S"].longest)


def test_many_routines_that_call_each_other_take_no_great_time():
    count = 500
    text = "CSUB S0\nSTOP\n" + "".join(f"S{n}: CSUB S{n + 1}\nCSUB S{n + 1}\nRSUB\n" for n in range(count))
    found = routines(f"{text}S{count}: RSUB\n")
    assert found["S499"].longest == 5
    assert found["S496"].longest == 61
    turning = "L: " + "ROR 0, 1\n" * 2040 + "JA L"
    assert math.isinf(routines(turning)["L"].longest)


def test_the_stack_is_as_deep_as_calls_are_nested():
    assert Map(assemble(PROGRAM)).stack == 2
    assert Map(assemble("STOP")).stack == 0


def test_variables_know_who_writes_and_who_reads_them():
    assert Map(assemble(PROGRAM)).variables == [Variable(0, (1, 14), (4,)), Variable(1, (), (13,))]


def test_the_map_as_text():
    assert program_map(assemble(PROGRAM, "x.tmc")) == (
        "x.tmc: 15 of 2048 instructions, 2 of 8 calls open at most\n"
        "\n"
        "routine                   line  instructions  between WAITs            calls\n"
        "start                        1             9  a loop without a WAIT    Move\n"
        "Move                        10             3  6, 0.6 ms                Deep\n"
        "Deep                        13             3  3, 0.3 ms\n"
        "\n"
        "variable  written in lines        read in lines\n"
        "       0  1, 14                   4\n"
        "       1  -                       13\n"
    )


@given(SOURCES)
@settings(max_examples=60)
def test_every_program_has_a_map(text):
    assembly = assemble(text, include=lambda name, _from: (name, "L0: STOP"))
    if assembly.ok:
        assert program_map(assembly)
