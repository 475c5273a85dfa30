"""Coverage and profile count exactly what was executed."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware.test_program_properties import PROGRAMS, state
from tmcm34x.bench import simple_rig
from tmcm34x.clock import MS, run_until
from tmcm34x.firmware.program import AddressCounts
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.toolchain.assembler import assemble
from tmcm34x.trace.coverage import (
    CoverageError,
    LineCounts,
    added,
    coverage,
    format_html,
    format_lcov,
    line_costs,
    parse_lcov,
    subroutine_costs,
)

SOURCE = """
        CALC LOAD, 0
Loop:   CALC ADD, 1
        COMP 50000
        JC LT, Loop
        CSUB Blink
        STOP
Blink:  SIO 0, 2, 1
        WAIT TICKS, 0, 5
        JC ETO, Never
        RSUB
Never:  SIO 1, 2, 1
        RSUB
"""


def counted(source: str):
    assembly = assemble(source)
    rig = simple_rig(343)
    counts = AddressCounts()
    program = rig.modules[0].program
    rig.modules[0].eeprom.write_program(assembly.program)
    program.count(counts)
    program.run(0)
    while program.active:
        rig.advance(rig.next_event())
    program.count(None)
    return assembly, counts


def test_a_fused_loop_is_counted_exactly() -> None:
    assembly, counts = counted(SOURCE)
    result = {line: counts for (_, line), counts in coverage(assembly, counts).items()}
    assert result[3] == LineCounts(50_000)
    assert result[5] == LineCounts(50_000, 49_999)
    assert result[10] == LineCounts(1, 0)
    assert result[12] == LineCounts(0)


class Seen:
    """Observes a module and counts each command by its address."""

    def __init__(self) -> None:
        self.counts = [0] * 2049

    def instruction(self, address: int, instruction: Instruction, now: int) -> None:
        self.counts[address] += 1

    def telegram(self, *_: object) -> None:
        pass

    def event(self, *_: object) -> None:
        pass


@settings(max_examples=60)
@given(PROGRAMS, st.lists(st.integers(1, 9 * MS), max_size=5))
def test_counting_counts_what_is_executed_and_changes_nothing(
    program: list[Instruction], slices: list[int]
) -> None:
    plain, rig = simple_rig(343), simple_rig(343)
    counts, seen = AddressCounts(), Seen()
    plain.modules[0].observers.append(seen)
    rig.modules[0].program.count(counts)
    for each in (plain, rig):
        each.modules[0].eeprom.write_program(program)
        each.modules[0].program.run(0)
    for length in slices:
        run_until(rig, rig.now + length)
    for each in (plain, rig):
        run_until(each, 60 * MS)
    assert state(plain) == state(rig)
    rig.modules[0].program.count(None)
    assert counts.executed == seen.counts[:2048]


def test_a_tracefile_comes_back_and_adds_up() -> None:
    assembly, counts = counted(SOURCE)
    once = coverage(assembly, counts)
    text = format_lcov(once)
    assert parse_lcov(text) == once
    assert "BRDA:5,0,0,49999\nBRDA:5,0,1,1\n" in text
    twice = added(once, parse_lcov(text))
    assert next(counts for (_, line), counts in twice.items() if line == 3) == LineCounts(100_000)


def test_a_foreign_tracefile_is_refused() -> None:
    with pytest.raises(CoverageError, match="line 2 is not of an lcov tracefile"):
        parse_lcov("TN:\nhello world\n")


def test_the_page_shows_what_was_missed() -> None:
    assembly, counts = counted(SOURCE)
    page = format_html(coverage(assembly, counts), assembly.sources)
    assert page.count("class='missed'") == 2
    assert "never jumped" in page
    assert "10 of 12 commands executed" in page


def test_the_profile_gives_the_time_to_lines_and_subroutines() -> None:
    assembly, counts = counted(SOURCE)
    lines = line_costs(assembly, counts, 1600)
    assert lines[0].executed == 50_000
    wait = next(cost for cost in lines if cost.name.endswith(":9"))
    assert wait.clocks == 1600 + 50 * MS
    routines = {cost.name: cost for cost in subroutine_costs(assembly, counts, 1600)}
    assert routines["Blink"].clocks == wait.clocks + 3 * 1600
    assert routines["(main program)"].executed == 150_003
