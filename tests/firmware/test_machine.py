from __future__ import annotations

import copy
import pickle

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware.plain_tmcl import Plain
from tmcm34x.firmware.program.machine import Machine
from tmcm34x.firmware.program.registers import ERROR_FLAGS, Registers
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.mnemonic import parse_instruction

SIZE = 24
VALUES = st.one_of(
    st.integers(-4, 4), st.sampled_from([-(2**31), 2**31 - 1, 1000]), st.integers(-(2**31), 2**31 - 1)
)


NONE = st.just(0)


def register_commands(size: int) -> st.SearchStrategy[Instruction]:
    def of(
        number: int,
        types: st.SearchStrategy[int] = NONE,
        values: st.SearchStrategy[int] = NONE,
        motor: int = 0,
    ) -> st.SearchStrategy[Instruction]:
        return st.builds(Instruction, st.just(number), types, st.just(motor), values)

    address = st.integers(0, size - 1)
    return st.one_of(
        of(19, st.integers(0, 9), VALUES),
        of(33, st.integers(0, 10)),
        of(20, NONE, VALUES),
        of(21, st.integers(0, 12), address),
        of(22, NONE, address),
        of(23, NONE, address),
        of(24),
        of(36, st.integers(0, 5)),
        *(of(number, st.integers(0, 3), VALUES, 2) for number in (9, 10, 35)),
    )


def module_commands() -> st.SearchStrategy[Instruction]:
    return st.sampled_from(
        [
            Instruction(0),
            Instruction(3),
            Instruction(19, 10),
            Instruction(22, 0, 0, 2048),
            Instruction(9, 56, 2),
            Instruction(9, 0, 0),
        ]
    )


PROGRAMS = st.lists(
    st.one_of(*[register_commands(SIZE)] * 12, module_commands()), min_size=SIZE, max_size=SIZE
).map(lambda program: [*program, *[Instruction(0)] * (2049 - SIZE)])


def machine_of(*lines: str) -> tuple[Machine, Registers]:
    program = [parse_instruction(line) for line in lines]
    memory = [*program, *[Instruction(0)] * (2048 - len(program))]
    return Machine(memory.__getitem__), Registers([0] * 56)


def view(registers: Registers) -> tuple[object, ...]:
    flags = {word for word, bit in ERROR_FLAGS.items() if registers.errors & bit}
    if registers.result == 0:
        flags.add("zero")
    for word, holds in (
        ("equal", registers.difference == 0),
        ("lower", registers.difference < 0),
        ("greater", registers.difference > 0),
    ):
        if holds:
            flags.add(word)
    return registers.counter, registers.accumulator, registers.x, registers.stack, flags, registers.variables


@settings(max_examples=150)
@given(PROGRAMS, st.lists(st.integers(1, 5000), min_size=1, max_size=6))
def test_any_program_in_any_slices_does_what_single_commands_do(
    program: list[Instruction], slices: list[int]
) -> None:
    machine, registers, plain = Machine(program.__getitem__), Registers([0] * 56), Plain(program)
    for count in slices:
        done = machine.run(registers, count)
        steps = 0
        while steps < count and plain.step():
            steps += 1
        assert done == steps
        assert view(registers) == (
            plain.counter, plain.accumulator, plain.x, plain.stack, plain.flags, plain.variables,
        )  # fmt: skip


@settings(max_examples=60)
@given(PROGRAMS)
def test_a_cycle_found_comes_back(program: list[Instruction]) -> None:
    machine, registers = Machine(program.__getitem__), Registers([0] * 56)
    done, contents, period = machine.find_cycle(registers, 100)
    assert 0 <= period <= done <= 100
    if period:
        for _ in range(3):
            assert machine.run(registers, period) == period
            assert registers.contents() == contents


def test_a_long_loop_is_fused_and_counts_exactly() -> None:
    machine, registers = machine_of("CALC ADD, 1", "COMP 1000000", "JC LT, 0", "STOP")
    assert machine.run(registers, 10**9) == 3_000_000
    assert (registers.counter, registers.accumulator) == (3, 1_000_000)


def test_a_handshake_loop_is_found_to_be_a_cycle() -> None:
    machine, registers = machine_of("CALC LOAD, 7", "GGP 0, 2", "COMP 1", "JC NE, 1", "STOP")
    _, _, period = machine.find_cycle(registers, 100)
    assert period == 3


def test_a_changed_program_is_read_again_after_invalidate() -> None:
    memory = [parse_instruction("JA 0")] * 2048
    machine, registers = Machine(memory.__getitem__), Registers([0] * 56)
    machine.run(registers, 5000)
    memory[0] = parse_instruction("CALC LOAD, 5")
    machine.invalidate()
    machine.run(registers, 1)
    assert registers.accumulator == 5


@pytest.mark.parametrize(
    ("lines", "accumulator"),
    [
        (["CALC LOAD, -7", "CALC DIV, 2"], -3),
        (["CALC LOAD, -7", "CALC MOD, 2"], -1),
        (["CALC LOAD, 7", "CALC DIV, -2"], -3),
        (["CALC LOAD, 7", "CALC DIV, 0"], 7),
        (["CALC LOAD, 7", "CALC MOD, 0"], 7),
        (["CALC LOAD, $80000000", "CALC DIV, -1"], -(2**31)),
        (["CALC LOAD, $7fffffff", "CALC ADD, 1"], -(2**31)),
        (["CALC LOAD, 65536", "CALC MUL, 65536"], 0),
        (["CALC LOAD, 5", "CALC NOT, 0"], -6),
        (["CALC LOAD, 5", "CALCX LOAD", "CALC LOAD, 3", "CALCX NOT"], 3),
        (["CALC LOAD, 5", "CALCX LOAD", "CALC LOAD, 3", "CALCX SWAP"], 5),
    ],
)
def test_calculation(lines: list[str], accumulator: int) -> None:
    machine, registers = machine_of(*lines)
    assert machine.run(registers, 100) == len(lines)
    assert registers.accumulator == accumulator


def test_before_any_comparison_only_not_equal_holds() -> None:
    machine, registers = machine_of(
        "JC EQ, 9", "JC GE, 9", "JC LE, 9", "JC GT, 9", "JC LT, 9", "JC ZE, 9", "JC NE, 8"
    )
    machine.run(registers, 7)
    assert registers.counter == 8


def test_a_copy_of_a_machine_makes_its_own_functions() -> None:
    machine, registers = machine_of("CALC ADD, 1", "COMP 1000000", "JC LT, 0", "STOP")
    machine.run(registers, 5000)
    for make in (copy.deepcopy, lambda value: pickle.loads(pickle.dumps(value))):
        other, its = make((machine, registers))
        assert its.contents() == registers.contents()
        assert other.run(its, 3000) == 3000
        assert its.contents() != registers.contents()


def test_a_state_before_any_comparison_equals_its_copy() -> None:
    registers = Registers([0] * 56)
    assert pickle.loads(pickle.dumps(registers.contents())) == registers.contents()
    other = Registers([1] * 56)
    other.restore(registers.contents())
    assert other.flags == registers.flags


def test_a_difference_is_saved_as_a_whole_number_on_either_core() -> None:
    """A compiled attribute that may hold no number is a floating point one, and would have another digest."""
    registers = Registers([0] * 56)
    machine = Machine([parse_instruction("COMP 7"), Instruction(28)].__getitem__)
    assert machine.run(registers, 2) == 1
    before, after = Registers([0] * 56).contents()[4], registers.contents()[4]
    assert (before, after, type(after)) == (None, -7, int)
