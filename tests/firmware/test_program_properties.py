"""Whatever is in the program memory: no exception, and no difference by slicing or by looking on."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

from firmware.programs import direct
from firmware.test_machine import register_commands
from tmcm34x.bench import Rig, build, simple_rig
from tmcm34x.bench.description import parse
from tmcm34x.clock import MS, pack, run_until, unpack
from tmcm34x.tmcl.datagram import Instruction

SIZE = 12
BENCH = parse("""
[[module]]
[[module.axis]]
load = {kind = "carriage", lead_mm = 8.0, start = 1.0}
switch = {left = {position = 0.0}, right = {position = 2.0}}
[module.input]
IN_0 = {kind = "square", period_ms = 7.0}
IN_1 = {kind = "ramp", period_ms = 20.0}
IN_2 = {kind = "output", output = 0}
""")

ADDRESS = st.integers(0, SIZE - 1)
MOTOR = st.integers(0, 2)
VALUE = st.one_of(
    st.integers(-5, 5), st.sampled_from([100, 2047, -2047, 700, 10_000]), st.integers(-(2**31), 2**31 - 1)
)
ZERO = st.just(0)


def of(
    *numbers: int, types: object = ZERO, motors: object = ZERO, values: object = ZERO
) -> st.SearchStrategy[Instruction]:
    return st.builds(Instruction, st.sampled_from(numbers), types, motors, values)


PARAMETERS = st.sampled_from(
    [0, 1, 2, 3, 4, 5, 8, 9, 10, 11, 12, 13, 135, 138, 149, 153, 154, 193, 196, 206, 208]
)
GLOBALS = st.sampled_from([0, 1, 5, 6, 77, 128, 129, 130, 132, 133])
COMMANDS = st.one_of(
    of(1, 2, motors=MOTOR, values=st.integers(-2047, 2047)),
    of(3, motors=MOTOR),
    of(4, types=st.integers(0, 2), motors=MOTOR, values=st.integers(-3000, 3000)),
    of(5, 6, types=PARAMETERS, motors=MOTOR, values=VALUE),
    of(6, types=PARAMETERS, motors=MOTOR),
    of(9, 10, 35, types=st.integers(0, 5), motors=st.just(2), values=VALUE),
    of(10, types=GLOBALS),
    of(13, types=st.integers(0, 2), motors=MOTOR),
    of(14, types=st.sampled_from([0, 1, 255]), motors=st.just(2), values=st.integers(-1, 3)),
    of(15, types=st.sampled_from([0, 1, 2, 3, 10, 255]), motors=st.integers(0, 2)),
    of(15, types=st.integers(0, 3)),
    of(19, types=st.integers(0, 9), values=VALUE),
    of(20, values=VALUE),
    of(21, types=st.integers(0, 12), values=ADDRESS),
    of(21, types=st.integers(0, 3), values=ADDRESS),
    of(22, 23, values=ADDRESS),
    of(24, 28),
    of(27, types=st.integers(0, 4), motors=MOTOR, values=st.integers(0, 3)),
    of(30, 31, 32, types=st.integers(0, 3), motors=MOTOR, values=st.integers(-500, 500)),
    of(33, types=st.integers(0, 10)),
    of(34, types=PARAMETERS, motors=MOTOR),
    of(36, types=st.integers(0, 5)),
    st.builds(Instruction, st.integers(0, 255), st.integers(0, 255), st.integers(0, 255), VALUE),
)
PROGRAMS = st.lists(COMMANDS, min_size=SIZE, max_size=SIZE).map(lambda commands: [*commands, Instruction(22)])


def started(program: list[Instruction]) -> Rig:
    rig = build(BENCH)
    module = rig.modules[0]
    module.eeprom.write_program(program)
    module.program.run(0)
    return rig


def state(rig: Rig) -> tuple[object, ...]:
    module = rig.modules[0]
    program = module.program
    axes = [
        direct(module, f"GAP {number}, {motor}") for number in (0, 1, 2, 3, 138, 196) for motor in range(3)
    ]
    return (
        program.registers.contents(), program.executed, program.state, program.last_error, program.waiting,
        module.board.outputs, module.eeprom.global_values, axes,
    )  # fmt: skip


def same_in_slices(program: list[Instruction], slices: list[int]) -> bool:
    def outcome(slices: list[int]) -> tuple[object, ...]:
        rig = started(program)
        for length in slices:
            run_until(rig, rig.now + length)
        run_until(rig, 120 * MS)
        return state(rig)

    return outcome(slices) == outcome([])


@settings(max_examples=120)
@given(PROGRAMS, st.lists(st.integers(1, 12 * MS), max_size=10))
def test_slicing_does_not_change_what_a_program_does(program: list[Instruction], slices: list[int]) -> None:
    assert same_in_slices(program, slices)


RESTING = st.lists(
    st.one_of(
        register_commands(SIZE),
        of(27, values=st.integers(0, 3)),
        of(14, types=st.integers(0, 7), motors=st.just(2), values=st.integers(-1, 1)),
        of(15, types=st.sampled_from([0, 1, 255])),
        of(28, 0),
    ),
    min_size=SIZE, max_size=SIZE,
).map(lambda commands: [*commands, Instruction(22)])  # fmt: skip
"""Programs that leave the motors alone."""


@settings(max_examples=60)
@given(RESTING, st.integers(1, 60 * MS), st.integers(1, 60 * MS))
def test_a_program_goes_on_from_what_it_saved(program: list[Instruction], when: int, more: int) -> None:
    first, second = (simple_rig(343) for _ in range(2))
    for rig in (first, second):
        rig.modules[0].eeprom.write_program(program)
    first.modules[0].program.run(0)
    run_until(first, when)
    run_until(second, when)
    saved = first.modules[0].program.save()
    second.modules[0].board.set_outputs(first.modules[0].board.outputs)
    second.modules[0].program.load(unpack(pack(saved)))
    assert second.modules[0].program.digest() == first.modules[0].program.digest()
    for rig in (first, second):
        run_until(rig, when + more)
    assert second.modules[0].program.save() == first.modules[0].program.save()


def test_refused_commands_in_a_loop_are_told_in_turn() -> None:
    refused = Instruction(14, 0, 2, -1)
    assert same_in_slices([refused, refused, Instruction(22)], [8000])


@settings(max_examples=60)
@given(PROGRAMS)
def test_looking_on_does_not_change_what_a_program_does(program: list[Instruction]) -> None:
    plain, watched = started(program), started(program)
    watched.modules[0].program.hook(lambda _: False)
    for rig in (plain, watched):
        run_until(rig, 60 * MS)
    assert state(plain) == state(watched)


@settings(max_examples=100)
@given(PROGRAMS, st.frozensets(st.integers(0, 8), max_size=4))
def test_asking_at_some_addresses_hears_of_the_same_commands_as_asking_everywhere(
    program: list[Instruction], addresses: frozenset[int]
) -> None:
    everywhere, some = started(program), started(program)
    heard: tuple[list[tuple[int, int]], list[tuple[int, int]]] = ([], [])
    for rig, asked, where in ((everywhere, heard[0], None), (some, heard[1], addresses)):
        module = rig.modules[0]

        def ask(address: int, module=module, asked=asked) -> bool:
            if address in addresses:
                asked.append((module.now, address))
            return False

        module.program.hook(ask, where)
        run_until(rig, 60 * MS)
    assert heard[0] == heard[1]
    assert state(everywhere) == state(some)
