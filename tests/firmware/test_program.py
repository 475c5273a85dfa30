from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware.plain_tmcl import Plain
from firmware.programs import (
    CLOCKS,
    Wire,
    direct,
    module_with,
    program_of,
    run_instructions,
    run_ms,
    run_to_stop,
    started,
)
from firmware.test_machine import SIZE, register_commands
from tmcm34x.board.board import Board
from tmcm34x.board.models import MODELS
from tmcm34x.clock import MS, NEVER, run_until
from tmcm34x.firmware.module import FirmwareModule
from tmcm34x.firmware.program import RunState
from tmcm34x.firmware.storage import Eeprom
from tmcm34x.tmcl.datagram import Instruction, pack_request
from tmcm34x.tmcl.status import Status

# Run, step, stop, reset


def test_a_program_starts_only_when_told() -> None:
    module = module_with("SIO 0, 2, 1 \n STOP")
    run_ms(module, 100)
    assert module.board.outputs == 0
    assert module.execute(Instruction(129)) == (Status.OK, 0)
    assert direct(module, "GGP 128, 0") == (Status.OK, RunState.RUN)
    run_to_stop(module)
    assert module.board.outputs == 1
    assert direct(module, "GGP 130, 0") == (Status.OK, 2)
    assert module.program.last_error is None


def test_auto_start_runs_the_program_at_power_on() -> None:
    module = module_with("SIO 1, 2, 1 \n STOP", auto_start=True)
    run_to_stop(module)
    assert module.board.outputs == 2


def test_an_instruction_takes_its_time() -> None:
    module = started("SIO 0, 2, 1 \n SIO 1, 2, 1 \n STOP")
    run_until(module, CLOCKS - 1)
    assert module.board.outputs == 0
    run_until(module, CLOCKS)
    assert module.board.outputs == 1
    run_until(module, 2 * CLOCKS)
    assert module.board.outputs == 3
    run_until(module, 3 * CLOCKS)
    assert module.program.state is RunState.STOP
    assert module.program.executed == 3


def test_stop_and_run_go_on_where_the_program_was() -> None:
    module = started("Loop: CALC ADD, 1 \n SIO 255, 2, -1 \n JA Loop")
    run_instructions(module, 4)
    module.execute(Instruction(128))
    assert (module.program.state, module.program.counter) == (RunState.STOP, 1)
    run_ms(module, 50)
    assert module.program.accumulator == 2
    module.execute(Instruction(129))
    run_instructions(module, 1)
    assert module.board.outputs == 2


def test_reset_begins_anew() -> None:
    module = started("CALC LOAD, 5 \n CALCX LOAD \n CSUB Sub \n STOP \nSub: WAIT TICKS, 0, 100 \n RSUB")
    run_ms(module, 5)
    assert module.program.stack == (3,)
    assert module.execute(Instruction(131))[0] == Status.OK
    program = module.program
    assert (program.state, program.counter, program.accumulator, program.x, program.stack) == (0, 0, 0, 0, ())
    assert module.next_event() == NEVER


def test_run_from_an_address() -> None:
    module = module_with("STOP \n CALC LOAD, 7 \n STOP")
    assert module.execute(Instruction(129, 1, 0, 1))[0] == Status.OK
    run_to_stop(module)
    assert module.program.accumulator == 7
    assert module.execute(Instruction(129, 1, 0, 2048))[0] == Status.INVALID_VALUE


def test_run_from_an_address_begins_with_an_empty_stack() -> None:
    module = started("CSUB Sub \n STOP \nSub: WAIT TICKS, 0, 100 \n STOP \nThere: WAIT TICKS, 0, 100 \n STOP")
    run_ms(module, 5)
    assert module.program.stack == (1,)
    module.execute(Instruction(128))
    module.execute(Instruction(129))
    run_ms(module, 5)
    assert module.program.stack == (1,)
    module.execute(Instruction(129, 1, 0, 4))
    run_ms(module, 5)
    assert (module.program.counter, module.program.stack) == (4, ())


def test_step_executes_one_command() -> None:
    module = module_with("CALC LOAD, 1 \n CALC ADD, 1 \n WAIT TICKS, 0, 2 \n STOP")
    for counter, accumulator in ((1, 1), (2, 2)):
        module.execute(Instruction(130))
        assert module.execute(Instruction(135)) == (Status.OK, RunState.STEP)
        run_instructions(module, 1)
        assert (module.program.state, module.program.counter) == (RunState.STOP, counter)
        assert module.program.accumulator == accumulator
    module.execute(Instruction(130))
    run_ms(module, 15)
    assert (module.program.state, module.program.counter) == (RunState.STEP, 2)
    run_ms(module, 10)
    assert (module.program.state, module.program.counter) == (RunState.STOP, 3)


def test_erased_memory_ends_the_program() -> None:
    module = started("CALC LOAD, 1")
    run_to_stop(module)
    assert module.program.counter == 1
    assert module.program.last_error == (1, Status.INVALID_COMMAND)


def test_running_past_the_last_address_ends_the_program() -> None:
    module = module_with("CALC ADD, 1 \n" * 2048)
    module.program.run(2040)
    run_to_stop(module)
    assert (module.program.counter, module.program.accumulator) == (2048, 8)
    assert module.program.last_error == (2048, Status.INVALID_COMMAND)


@pytest.mark.parametrize(
    ("instruction", "status"),
    [
        (Instruction(200, 1, 2, 3), Status.INVALID_COMMAND),
        (Instruction(129), Status.NOT_AVAILABLE),
        (Instruction(5, 99, 0, 1), Status.WRONG_TYPE),
        (Instruction(5, 4, 0, 2048), Status.INVALID_VALUE),
        (Instruction(22, 0, 0, 2048), Status.INVALID_VALUE),
        (Instruction(21, 13, 0, 0), Status.WRONG_TYPE),
        (Instruction(19, 10), Status.WRONG_TYPE),
        (Instruction(36, 6), Status.WRONG_TYPE),
        (Instruction(27, 5, 0, 1), Status.WRONG_TYPE),
        (Instruction(27, 1, 3, 1), Status.INVALID_VALUE),
        (Instruction(27, 0, 0, -1), Status.INVALID_VALUE),
    ],
)
def test_a_refused_command_has_no_effect_and_the_program_goes_on(
    instruction: Instruction, status: Status
) -> None:
    module = module_with("CALC LOAD, 3 \n STOP \n SIO 255, 2, -1 \n STOP")
    module.eeprom.write_instruction(1, instruction)
    module.program.run()
    run_to_stop(module)
    assert module.board.outputs == 3
    assert module.program.last_error == (1, status)


# Registers


def test_commands_that_read_load_the_accumulator_and_the_zero_flag() -> None:
    module = started(
        "GAP 4, 0 \n AGP 0, 2 \n SCO 3, 1, -77 \n GCO 3, 1 \n AGP 1, 2 \n"
        "GIO 0, 0 \n JC NZ, Out \n CALC ADD, 1 \n AGP 2, 2 \n Out: STOP"
    )
    run_to_stop(module)
    assert module.program.variables[:3] == [1000, -77, 1]


def test_commands_that_start_and_stop_or_copy_leave_the_accumulator() -> None:
    lines = ("RFS START, 0", "RFS STOP, 0", "GCO 1, 255", "RFS STATUS, 0")
    module = started("CALC LOAD, 77 \n" + "".join(f"{line} \n AGP {n}, 2 \n" for n, line in enumerate(lines)))
    run_ms(module, 10)
    assert module.program.variables[:4] == [77, 77, 77, 0]


def test_sio_takes_the_accumulator() -> None:
    module = started("CALC LOAD, $1a5 \n SIO 255, 2, -1 \n STOP")
    run_to_stop(module)
    assert module.board.outputs == 0xA5


def test_accumulator_goes_to_parameters_and_coordinates() -> None:
    module = started("CALC LOAD, 321 \n AAP 4, 2 \n ACO 5, 1 \n AGP 7, 2 \n STOP")
    run_to_stop(module)
    assert direct(module, "GAP 4, 2") == (100, 321)
    assert direct(module, "GCO 5, 1") == (100, 321)
    assert direct(module, "GGP 7, 2") == (100, 321)


class Echo:
    def __init__(self) -> None:
        self.sent: list[tuple[int, int]] = []

    def exchange(self, data: int, nbytes: int) -> int:
        self.sent.append((data, nbytes))
        return data + 1


def test_sac_sends_a_value_or_the_accumulator() -> None:
    module = started("SAC 2, 2, $1234 \n SAC 130, 1, 0 \n AGP 0, 2 \n STOP")
    device = Echo()
    module.board.attach_spi(1, device)
    run_to_stop(module)
    assert device.sent == [(0x1234, 2), (0x35, 1)]
    assert module.program.variables[0] == 0x36


def test_direct_commands_leave_the_accumulator_alone() -> None:
    module = started("CALC LOAD, 42 \n Loop: CALC ADD, 0 \n JA Loop")
    run_instructions(module, 10)
    assert direct(module, "GAP 4, 0") == (100, 1000)
    assert direct(module, "GGP 0, 2") == (100, 0)
    run_instructions(module, 10)
    assert module.program.accumulator == 42


def test_calculation_in_direct_mode_uses_the_programs_registers() -> None:
    module = module_with("")
    assert direct(module, "CALC LOAD, 11") == (100, 11)
    assert direct(module, "CALCX LOAD")[0] == 100
    assert direct(module, "CALCX MUL")[0] == 100
    assert module.program.accumulator == 121
    assert direct(module, "AGP 9, 2")[0] == 100
    assert direct(module, "GGP 9, 2") == (100, 121)


@pytest.mark.parametrize(
    "line", ["COMP 1", "JC ZE, 0", "JA 0", "CSUB 0", "RSUB", "WAIT TICKS, 0, 1", "STOP", "CLE ALL"]
)
def test_program_commands_are_not_available_in_direct_mode(line: str) -> None:
    module = started("Loop: JA Loop")
    run_instructions(module, 3)
    assert direct(module, line)[0] == Status.NOT_AVAILABLE
    assert module.program.active


def test_the_ninth_nested_call_is_ignored() -> None:
    module = started("Sub: CALC ADD, 1 \n CSUB Sub \n STOP")
    run_to_stop(module)
    assert module.program.accumulator == 9
    assert module.program.stack == (2,) * 8


# WAIT


def test_wait_ticks_counts_tens_of_milliseconds() -> None:
    module = started("SIO 0, 2, 1 \n WAIT TICKS, 0, 500 \n SIO 1, 2, 1 \n STOP")
    changes: list[int] = []
    module.board.on_output.append(lambda _: changes.append(module.now))
    run_to_stop(module)
    assert changes == [CLOCKS, 3 * CLOCKS + 5000 * MS]
    assert not module.program.flags["ETO"]


def test_a_long_wait_costs_one_event() -> None:
    module = started("WAIT TICKS, 0, 360000 \n STOP")
    run_ms(module, 10)
    assert events(module, 3_599_000) == 0


def test_wait_pos_ends_when_the_motor_arrives() -> None:
    module = started("MVP ABS, 1, 5000 \n WAIT POS, 1, 0 \n GAP 1, 1 \n AGP 0, 2 \n STOP")
    run_to_stop(module)
    assert module.program.variables[0] == 5000
    assert module.program.executed == 5


def test_wait_pos_goes_on_while_a_motor_rests_elsewhere() -> None:
    module = started(
        "WAIT POS, 0, 0 \n ROR 0, 500 \n WAIT TICKS, 0, 50 \n MST 0 \n WAIT POS, 0, 300 \n JC ETO, Late \n STOP \n"
        "Late: SIO 0, 2, 1 \n STOP"
    )
    run_ms(module, 3400)
    assert (direct(module, "GAP 3, 0"), direct(module, "GAP 8, 0")) == ((100, 0), (100, 0))
    assert (module.program.counter, module.board.outputs) == (4, 0)
    run_to_stop(module)
    assert module.board.outputs == 1


def test_a_time_out_sets_the_flag_until_it_is_cleared() -> None:
    module = started(
        "MVP ABS, 0, 500000 \n WAIT POS, 0, 3 \n JC ETO, Late \n STOP \n"
        "Late: SIO 0, 2, 1 \n CLE ETO \n JC ETO, End \n SIO 1, 2, 1 \n End: STOP"
    )
    run_ms(module, 29)
    assert module.board.outputs == 0
    run_to_stop(module)
    assert module.board.outputs == 3


@pytest.mark.parametrize(("earlier", "late"), [(1, 0), (-1, 1)])
def test_a_condition_that_holds_at_the_clock_of_the_time_out_wins(earlier: int, late: int) -> None:
    """A pin that changes is noticed one clock later."""
    module = started("WAIT REFSW, 0, 3 \n JC ETO, Late \n STOP \n Late: SIO 0, 2, 1 \n STOP")
    time_out = CLOCKS + 30 * MS
    run_until(module, time_out - earlier)
    module.board.set_switch(0, "left", True)
    run_to_stop(module)
    assert module.board.outputs == late


def test_wait_for_switches() -> None:
    module = started(
        "WAIT REFSW, 0, 0 \n SIO 0, 2, 1 \n WAIT LIMSW, 1, 0 \n SIO 1, 2, 1 \n WAIT LIMSW, 2, 0 \n STOP"
    )
    run_ms(module, 10)
    module.board.set_switch(0, "right", True)
    run_ms(module, 10)
    assert module.board.outputs == 0
    module.board.set_switch(0, "left", True)
    run_ms(module, 10)
    assert module.board.outputs == 1
    module.board.set_switch(1, "right", True)
    run_ms(module, 10)
    assert module.board.outputs == 3
    module.board.set_switch(2, "left", True)
    run_to_stop(module)


def test_wait_rfs_does_not_wait_without_a_search() -> None:
    module = started("WAIT RFS, 0, 0 \n STOP")
    run_instructions(module, 2)
    assert not module.program.active


def test_stopping_a_wait_and_going_on_begins_it_again() -> None:
    module = started("WAIT TICKS, 0, 10 \n STOP")
    run_ms(module, 50)
    module.execute(Instruction(128))
    run_ms(module, 200)
    assert module.program.counter == 0
    module.execute(Instruction(129))
    run_ms(module, 90)
    assert module.program.active
    run_ms(module, 20)
    assert not module.program.active


# Polling is not run, and yet exact


def polled(source: str, pokes: list[tuple[int, str]], until: int, step: int) -> tuple[object, ...]:
    """State of a polling program at `until` clocks, advanced in steps of at most `step`."""
    module = started(source)
    for when, line in [*pokes, (until, "")]:
        while module.now < when:
            run_until(module, min(when, module.now + step))
        if line:
            assert direct(module, line)[0] == Status.OK
    program = module.program
    return program.registers.contents(), program.executed, program.state, module.board.outputs


HANDSHAKE = "Loop: GGP 3, 2 \n COMP 5 \n JC NE, Loop \n SIO 0, 2, 1 \n STOP"
INPUTS = "Loop: GIO 0, 0 \n CALC ADD, 2 \n GAP 4, 1 \n COMP 1234 \n JC NE, Loop \n CALC ADD, 1 \n STOP"
MIRROR = "Loop: GIO 255, 0 \n SIO 255, 2, -1 \n JA Loop"


@pytest.mark.parametrize(
    ("source", "poke"), [(HANDSHAKE, "SGP 3, 2, 5"), (INPUTS, "SAP 4, 1, 1234"), (MIRROR, "SGP 0, 2, 1")]
)
@settings(max_examples=25)
@given(data=st.data())
def test_a_polling_program_is_where_it_would_be(source: str, poke: str, data: st.DataObject) -> None:
    when = data.draw(st.integers(1, 60 * CLOCKS))
    until = data.draw(st.integers(when, 200 * CLOCKS))
    plain = polled(source, [(when, poke)], until, CLOCKS // 3)
    assert polled(source, [(when, poke)], until, data.draw(st.integers(CLOCKS, 300 * CLOCKS))) == plain


def events(module: FirmwareModule, milliseconds: int) -> int:
    """How many events there are in the next time."""
    until, count = module.now + milliseconds * MS, 0
    while (when := module.next_event()) <= until:
        module.advance(when)
        count += 1
    module.advance(until)
    return count


@pytest.mark.parametrize(
    "source", [HANDSHAKE, INPUTS, MIRROR, "Loop: JA Loop", "Loop: CALC ADD, 1 \n JA Loop"]
)
def test_a_program_that_only_polls_has_hardly_any_events(source: str) -> None:
    module = started(source)
    assert events(module, 1000) < 20
    assert module.program.executed == 10_000
    assert events(module, 1000) < 20
    assert module.program.executed == 20_000


JOYSTICK = "Start: GIO 0, 1 \n CALC MUL, 4 \n AAP 0, 0 \n JA Start"
STICK = "SAP 153, 0, 4 \n ROR 0, 0 \n Start: GIO 0, 1 \n CALC MUL, 2 \n AAP 2, 0 \n JA Start"


@pytest.mark.parametrize("source", [JOYSTICK, STICK, "L: MVP ABS, 1, 500 \n MST 0 \n ROL 2, 0 \n JA L"])
def test_a_program_that_writes_the_same_target_again_and_again_has_hardly_any_events(source: str) -> None:
    module = started(source)
    module.board.set_analog(0, 700)
    run_ms(module, 30_000)
    executed = module.program.executed
    assert events(module, 1000) < 10
    assert module.program.executed == executed + 10_000
    module.board.set_analog(0, 20)
    run_ms(module, 30_000)
    position, speed = (direct(module, f"GAP {number}, 0")[1] for number in (1, 3))
    assert (position, speed) == {JOYSTICK: (80, 0), STICK: (position, 40)}.get(source, (0, 0))


@settings(max_examples=25)
@given(
    source=st.sampled_from([JOYSTICK, STICK]),
    levels=st.lists(st.tuples(st.integers(1, 300 * CLOCKS), st.integers(0, 1023)), max_size=5),
    step=st.integers(CLOCKS, 200 * CLOCKS),
)
def test_a_joystick_program_is_where_it_would_be_command_by_command(
    source: str, levels: list[tuple[int, int]], step: int
) -> None:
    plain, sliced = started(source), started(source)
    plain.program.hook(lambda _: False)
    for module in (plain, sliced):
        for pause, level in [*levels, (400 * MS, 0)]:
            until = module.now + pause
            while module is sliced and module.now + step < until:
                run_until(module, module.now + step)
            run_until(module, until)
            module.board.set_analog(0, level)
    assert sliced.program.registers.contents() == plain.program.registers.contents()
    assert sliced.board.currents == plain.board.currents
    assert sliced.board.chips[0].position(0) == plain.board.chips[0].position(0)


def test_a_target_written_again_and_again_lets_the_current_go_down() -> None:
    module = started(JOYSTICK)
    direct(module, "SAP 214, 0, 10")
    run_ms(module, 1000)
    before = module.board.currents[0]
    module.board.set_analog(0, 100)
    run_ms(module, 10)
    assert module.board.currents[0] > before
    run_ms(module, 3000)
    assert module.board.currents[0] == before


def test_a_polling_program_notices_an_input_at_once() -> None:
    module = started("Loop: GIO 2, 0 \n JC ZE, Loop \n SIO 7, 2, 1 \n STOP")
    run_ms(module, 1000)
    module.board.set_input(2, 1)
    run_ms(module, 0.4)
    assert module.board.outputs == 0x80


def test_polling_the_speed_sees_the_motor_stop() -> None:
    module = started(
        "ROR 0, 200 \n WAIT TICKS, 0, 100 \n MST 0 \n Loop: GAP 3, 0 \n COMP 0 \n JC NE, Loop \n GAP 1, 0 \n STOP"
    )
    run_to_stop(module)
    assert direct(module, "GAP 3, 0") == (100, 0)
    assert direct(module, "GAP 1, 0") == (100, module.program.accumulator)


# Slices


@settings(max_examples=60)
@given(
    st.lists(register_commands(SIZE), min_size=SIZE, max_size=SIZE),
    st.lists(st.integers(1, 200_000), max_size=8),
)
def test_register_programs_run_exactly_in_any_slices(commands: list[Instruction], slices: list[int]) -> None:
    eeprom = Eeprom()
    eeprom.write_program([*commands, Instruction(28)])
    module, plain = FirmwareModule(Board(MODELS[343]), eeprom), Plain([*commands, *[Instruction(28)] * 2048])
    module.power_on()
    module.program.run()
    steps = 0
    for length in slices:
        run_until(module, module.now + length)
        while steps < module.now // CLOCKS and plain.step():
            steps += 1
        program = module.program
        assert (program.accumulator, program.x, program.variables) == (
            plain.accumulator,
            plain.x,
            plain.variables,
        )
        assert {name for name, on in program.flags.items() if on} == plain.flags
        if program.active:
            assert (program.counter, program.executed) == (plain.counter, steps)


MIXED = """
        SAP 4, 0, 1500
Loop:   GIO 0, 1
        CALC MUL, 5
        CALC ADD, 1000
        AAP 0, 0
        GGP 0, 2
        CALC ADD, 1
        AGP 0, 2
        COMP 20
        JC LT, Loop
        WAIT POS, 0, 50
        JC ETO, End
        MVP REL, 1, -3000
        WAIT POS, 1, 5
        CLE ALL
        ROR 2, 300
        WAIT TICKS, 0, 7
        MST 2
Wait:   GAP 3, 2
        COMP 0
        JC NE, Wait
End:    SIO 4, 2, 1
        STOP
"""


@settings(max_examples=15)
@given(st.lists(st.integers(1, 3_000_000), max_size=12))
def test_slicing_does_not_matter(slices: list[int]) -> None:
    def outcome(slices: list[int]) -> tuple[object, ...]:
        module = started(MIXED)
        module.board.set_analog(0, 700)
        for length in slices:
            run_until(module, module.now + length)
        run_until(module, 60_000_000)
        program = module.program
        positions = [module.execute(Instruction(6, 1, motor)) for motor in range(3)]
        return program.registers.contents(), program.executed, program.state, module.board.outputs, positions

    assert outcome(slices) == outcome([])


# Those who watch


def test_a_breakpoint_pauses_before_its_command() -> None:
    module = module_with("CALC LOAD, 1 \n Loop: CALC ADD, 1 \n JA Loop")
    asked: list[int] = []
    module.program.hook(lambda address: asked.append(address) or address == 2)
    module.program.run()
    run_ms(module, 5)
    assert (module.program.state, module.program.counter, module.program.accumulator) == (RunState.STOP, 2, 2)
    assert asked == [1, 2]
    module.program.run()
    run_ms(module, 5)
    assert (module.program.counter, module.program.accumulator) == (2, 3)


def test_registers_are_the_same_with_a_breakpoint_hook() -> None:
    plain, watched = started(MIXED), started(MIXED)
    watched.program.hook(lambda _: False)
    for module in (plain, watched):
        run_ms(module, 2000)
    assert plain.program.registers.contents() == watched.program.registers.contents()
    assert plain.program.executed == watched.program.executed


# Download


def download(wire: Wire, address: int, program: tuple[Instruction, ...]) -> list[int]:
    statuses = [wire.ask(132, value=address).status]
    statuses += [wire.ask(*instruction).status for instruction in program]
    return [*statuses, wire.ask(133).status]


def test_download_stores_and_does_not_execute() -> None:
    module = module_with("")
    wire = Wire(module)
    program = program_of("SIO 0, 2, 1 \n STOP")
    assert download(wire, 0, (*program, Instruction(0))) == [100, 101, 101, 101, 100]
    assert module.board.outputs == 0
    assert [module.eeprom.read_instruction(n) for n in range(3)] == [*program, Instruction(0)]
    wire.ask(131)
    wire.ask(129)
    run_to_stop(module)
    assert module.board.outputs == 1


def test_a_stored_command_is_read_back_as_host_address_record_and_checksum() -> None:
    module = module_with("MVP ABS, 1, -2")
    assert Wire(module).send(pack_request(1, Instruction(134))) == bytes.fromhex("02 04 00 01 ff ff ff fe 02")


def test_a_download_replaces_what_was_run_before() -> None:
    module = started("CALC LOAD, 1 \n STOP")
    run_to_stop(module)
    download(Wire(module), 0, program_of("CALC LOAD, 2 \n STOP"))
    module.program.run()
    run_to_stop(module)
    assert module.program.accumulator == 2


def test_a_download_stops_the_program() -> None:
    module = started("Loop: JA Loop")
    wire = Wire(module)
    run_ms(module, 1)
    assert wire.ask(132, value=10).status == Status.OK
    assert not module.program.active
    assert module.program.downloading
    assert wire.ask(133).status == Status.OK
    assert wire.ask(10, 129).value == 0


def test_control_functions_are_refused_during_a_download() -> None:
    module = module_with("")
    wire = Wire(module)
    wire.ask(132)
    assert wire.ask(129).status == Status.NOT_AVAILABLE
    assert wire.ask(132).status == Status.NOT_AVAILABLE
    assert wire.ask(37, 1, 2, 3).status == Status.LOADED
    wire.ask(133)
    assert module.eeprom.read_instruction(0) == Instruction(37, 1, 2, 3)


def test_the_version_is_told_during_a_download() -> None:
    """A host that finds a module in the middle of somebody else's download still learns what it is."""
    module = module_with("")
    wire = Wire(module)
    wire.ask(132, value=7)
    assert wire.ask(136, 1).value == 343 << 16 | 0x0424
    assert wire.ask(37, 1, 2, 3).status == Status.LOADED
    wire.ask(133)
    assert module.eeprom.read_instruction(7) == Instruction(37, 1, 2, 3)


def test_a_step_stops_a_running_program_after_its_next_command() -> None:
    module = started("Loop: CALC ADD, 1 \n JA Loop")
    run_ms(module, 1)
    executed = module.program.executed
    assert Wire(module).ask(130).status == Status.OK
    run_ms(module, 5)
    assert not module.program.active
    assert module.program.executed == executed + 1


def test_the_status_of_the_application_is_in_the_low_byte() -> None:
    module = module_with("Loop: JA Loop")
    wire = Wire(module)
    assert wire.ask(135).value == 0
    wire.ask(129)
    assert wire.ask(135).value == 1


def test_a_program_of_more_than_2048_commands_is_refused() -> None:
    module = module_with("")
    wire = Wire(module)
    assert download(wire, 2047, (Instruction(28), Instruction(28))) == [100, 101, Status.INVALID_VALUE, 100]
    assert wire.ask(132, value=2048).status == Status.INVALID_VALUE
    assert not module.program.downloading


def test_code_protection() -> None:
    module = module_with("STOP")
    assert module.program.memory.read(0) == Instruction(28)
    direct(module, "SGP 81, 0, 1")
    assert module.program.memory.read(0) is Status.NOT_AVAILABLE
    direct(module, "SGP 81, 0, 3")
    assert module.execute(Instruction(132))[0] == Status.NOT_AVAILABLE
    direct(module, "SGP 81, 0, 2")
    assert module.program.memory.read(0) == Instruction(0)
    assert module.execute(Instruction(132))[0] == Status.NOT_AVAILABLE
    direct(module, "SGP 81, 0, 0")
    assert module.execute(Instruction(132))[0] == Status.OK


def test_power_off_ends_everything() -> None:
    module = started("Loop: JA Loop")
    run_ms(module, 1)
    module.power_off()
    assert module.program.state is RunState.STOP
    module.power_on()
    assert module.program.state is RunState.STOP
    assert module.program.counter == 0


def test_user_variables_come_back_unless_parameter_85_forbids_it() -> None:
    module = started("SGP 1, 2, 77 \n SGP 2, 2, 88 \n STGP 1, 2 \n STOP")
    run_to_stop(module)
    module.reset()
    assert module.program.variables[1:3] == [77, 0]
    direct(module, "SGP 85, 0, 1")
    module.reset()
    assert module.program.variables[1:3] == [0, 0]


class Recorder:
    """Sees the commands of a program."""

    def __init__(self) -> None:
        self.seen: list[tuple[int, int, int]] = []

    def telegram(self, port: object, direction: str, data: bytes, now: int) -> None:
        del port, direction, data, now

    def instruction(self, address: int, instruction: Instruction, now: int) -> None:
        self.seen.append((address, instruction.number, now))

    def event(self, kind: str, motor: int, now: int) -> None:
        del kind, motor, now


class DeafRecorder(Recorder):
    instruction = None


def test_an_observer_sees_each_command_at_its_clock() -> None:
    module = module_with("CALC LOAD, 1 \n WAIT TICKS, 0, 1 \n STOP")
    recorder = Recorder()
    module.observers.append(recorder)
    module.program.run()
    run_to_stop(module)
    later = 3 * CLOCKS + 10 * MS
    assert recorder.seen == [(0, 19, CLOCKS), (1, 27, 2 * CLOCKS), (2, 28, later)]


def test_an_observer_that_wants_no_commands_does_not_slow_the_program() -> None:
    module = started(HANDSHAKE)
    module.observers.append(DeafRecorder())
    assert events(module, 1000) < 20


def test_a_wait_goes_on_whatever_is_said_about_stepping() -> None:
    module = started("WAIT TICKS, 0, 10 \n CALC ADD, 1 \n STOP")
    run_ms(module, 50)
    module.execute(Instruction(130))
    assert (module.program.state, module.program.waiting) == (RunState.STEP, True)
    module.execute(Instruction(129))
    assert module.program.state is RunState.RUN
    module.execute(Instruction(130))
    run_ms(module, 60)
    assert (module.program.state, module.program.counter) == (RunState.STOP, 1)


def test_134_beside_the_wire_gives_the_value_of_the_stored_command() -> None:
    module = module_with("MVP ABS, 1, 90000 \n STOP")
    assert module.execute(Instruction(134, 0, 0, 0)) == (Status.OK, 90000)
    assert module.execute(Instruction(134, 0, 0, 2048)) == (Status.INVALID_VALUE, 2048)
