"""Executed commands, jumps and waits are counted alike, however the commands are executed."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware.programs import CLOCKS, module_with, run_instructions, started
from firmware.test_program_properties import PROGRAMS
from firmware.test_program_properties import started as on_a_bench
from tmcm34x.clock import MS, pack, run_until, unpack
from tmcm34x.firmware.module import FirmwareModule
from tmcm34x.firmware.program import AddressCounts
from tmcm34x.tmcl.commands import PROGRAM_SIZE
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.numbers import AP, COMMAND
from tmcm34x.tmcl.status import Status

NESTED = """
        CALC  LOAD, 0
Outer:  CSUB  Inner
        SIO   0, 2, 1
        WAIT  TICKS, 0, 3
        GGP   5, 2
        CALC  ADD, 1
        AGP   5, 2
        COMP  4
        JC    LT, Outer
        STOP
Inner:  GGP   6, 2
        CALC  ADD, 1
        AGP   6, 2
        CALC  MOD, 400
        JC    NZ, Inner
        RSUB
"""
ROUNDS = 4


class Looking:
    """Tallies each command that is executed."""

    def __init__(self) -> None:
        self.executed = [0] * PROGRAM_SIZE

    def instruction(self, address: int, instruction: Instruction, now: int) -> None:
        self.executed[address] += 1

    def telegram(self, *_: object) -> None:
        pass

    def event(self, *_: object) -> None:
        pass


def counted(module: FirmwareModule, clocks: list[int]) -> AddressCounts:
    """The counts after these times, one after the other."""
    counts = AddressCounts()
    module.program.count(counts)
    for length in clocks:
        run_until(module, module.now + length)
    module.program.count(None)
    assert module.program.counts is None
    return counts


def test_a_nested_loop_is_counted_line_by_line() -> None:
    counts = counted(started(NESTED), [3000 * CLOCKS] * 4)
    inner = ROUNDS * 400
    assert counts.executed[:16] == [1, *[ROUNDS] * 8, 1, *[inner] * 5, ROUNDS]
    assert {address: count for address, count in enumerate(counts.jumped) if count} == {
        8: ROUNDS - 1, 14: inner - ROUNDS,
    }  # fmt: skip
    assert [count for count in counts.waited if count] == [ROUNDS * 30 * MS]


@settings(max_examples=40)
@given(PROGRAMS, st.lists(st.integers(1, 40 * MS), min_size=1, max_size=4))
def test_counts_are_what_an_observer_sees(program: list[Instruction], slices: list[int]) -> None:
    module, other = (on_a_bench(program).modules[0] for _ in range(2))
    counts = counted(module, slices)
    looking = Looking()
    other.observers.append(looking)
    run_until(other, sum(slices))
    assert counts.executed == looking.executed


def test_a_round_of_a_cycle_is_known_with_counts_and_without() -> None:
    module = started("CALC LOAD, 1 \n Loop: GGP 3, 2 \n COMP 5 \n JC NE, Loop \n STOP")
    assert module.program.round() == []
    run_until(module, 1000 * CLOCKS)
    assert set(module.program.round()) == {1, 2, 3}
    assert len(module.program.round()) == 3
    module.program.count(AddressCounts())
    run_until(module, 2000 * CLOCKS)
    assert module.program.counts is not None
    assert module.program.registers.counter in {1, 2, 3}


def test_a_polling_loop_has_what_it_reads_in_its_round() -> None:
    module = started("Loop: GIO 0, 0 \n JC ZE, Next \n Next: JA Loop")
    run_until(module, 1000 * CLOCKS)
    assert sorted(module.program.round()) == [0, 1, 2]


@pytest.mark.parametrize("loop", ["Loop: GAP 4, 7 \n JA Loop", "Loop: MVP ABS, 0, 0 \n JA Loop"])
def test_a_loop_with_refusals_or_moves_of_a_group_is_executed_each_time(loop: str) -> None:
    module = started(loop)
    module.execute(Instruction(COMMAND.SAP, AP.GROUP_INDEX, 0, 1))
    run_until(module, 1000 * CLOCKS)
    assert module.program.cycle is None
    assert module.program.executed == 1000


def test_the_upcoming_command_is_the_one_that_acts_next() -> None:
    module = started("CALC LOAD, 1 \n CALC ADD, 1 \n SIO 0, 2, 1 \n STOP")
    assert module.program.upcoming == 0
    assert module.program.next_event() == 3 * CLOCKS
    assert module.program.upcoming == 2


def test_the_accumulator_is_set_from_outside() -> None:
    module = started("Loop: COMP 7 \n JC NE, Loop \n SIO 0, 2, 1 \n STOP")
    run_instructions(module, 500)
    assert module.program.cycle is not None
    module.program.accumulator = 7
    run_instructions(module, 5)
    assert (module.program.accumulator, module.board.outputs) == (7, 1)
    assert not module.program.active


def test_a_hook_stops_before_its_command_until_it_is_taken_away() -> None:
    def ask(address: int) -> bool:
        return address == 2

    module = module_with("CALC LOAD, 1 \n CALC ADD, 1 \n SIO 0, 2, 1 \n STOP")
    module.program.hook(ask, frozenset({2}))
    assert module.program.hooked
    module.program.run()
    run_instructions(module, 10)
    assert (module.program.active, module.program.counter, module.board.outputs) == (False, 2, 0)
    module.program.unhook(ask)
    module.program.unhook(ask)
    assert not module.program.hooked
    module.program.run()
    run_instructions(module, 10)
    assert module.board.outputs == 1


def test_a_refused_command_stops_where_a_listener_says_so() -> None:
    module = started("SIO 99, 2, 1 \n SIO 0, 2, 1 \n STOP")
    module.program.on_refusal.append(lambda: True)
    run_instructions(module, 10)
    error = module.program.last_error
    assert error is not None
    assert (error.address, module.program.active, module.board.outputs) == (0, False, 0)


def test_a_long_way_without_jumps_is_executed_as_it_is_written() -> None:
    additions = "CALC ADD, 1 \n" * 100
    module = started(f"CALC LOAD, 0 \n Loop: {additions} COMP 20000 \n JC LT, Loop \n SIO 0, 2, 1 \n STOP")
    run_until(module, 25_000 * CLOCKS)
    assert (module.program.accumulator, module.board.outputs) == (20_000, 1)
    assert module.program.executed == 1 + 200 * 102 + 2


def test_a_calculation_with_an_operation_that_does_not_exist_is_refused() -> None:
    module = module_with("STOP")
    assert module.execute(Instruction(COMMAND.CALC, 99, 0, 1)) == (Status.WRONG_TYPE, 1)


def test_the_acceleration_of_an_even_motion_is_polled_without_being_executed() -> None:
    module = started("ROR 0, 500 \n WAIT TICKS, 0, 100 \n Loop: GAP 135, 0 \n JA Loop")
    run_until(module, 20_000 * CLOCKS)
    assert module.program.cycle is not None
    assert module.program.registers.accumulator == 0


def test_a_search_for_a_cycle_is_saved() -> None:
    source = "Loop: GIO 0, 0 \n CALC ADD, 1 \n AGP 3, 2 \n GGP 3, 2 \n CALC MOD, 50 \n JA Loop"
    module, twin = started(source), started(source)
    run_until(module, 100 * CLOCKS)
    twin.load(unpack(pack(module.save())))
    for each in (module, twin):
        run_until(each, 5000 * CLOCKS)
    assert twin.save() == module.save()
