"""A run ends where nothing can change any more, whoever looks at it and however its time is sliced."""

from __future__ import annotations

from itertools import cycle
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware.test_program_properties import BENCH, PROGRAMS, state
from tmcm34x.bench import Rig, build, simple_rig
from tmcm34x.bench.run import Run, ending_of
from tmcm34x.clock import HZ, MS, NEVER, run_until
from tmcm34x.server.server import Server
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.toolchain.assembler import assemble
from tmcm34x.trace.figures import FiguresRecorder
from tmcm34x.trace.recorder import Trace

LIMIT = 120 * MS


class Looking:
    """Observes a module and wants each command."""

    def instruction(self, address: int, instruction: Instruction, now: int) -> None:
        pass

    def telegram(self, *_: object) -> None:
        pass

    def event(self, *_: object) -> None:
        pass


class Ticking:
    """A recorder that looks at odd times."""

    def __init__(self, periods: list[int]) -> None:
        self._periods = cycle(periods)
        self.due = next(self._periods)

    def before(self, now: int) -> None:
        pass

    def after(self, now: int) -> None:
        while self.due <= now:
            self.due += next(self._periods)


def outcome(rig: Rig, program: list[Instruction], periods: list[int], *, looking: bool) -> dict[str, Any]:
    figures = FiguresRecorder(rig)
    rig.modules[0].eeprom.write_program(program)
    if looking:
        rig.modules[0].observers.append(Looking())
    recorders = [figures, Ticking(periods)] if periods else [figures]
    run = Run(rig, Trace(rig, recorders))
    run.start()
    run.go(LIMIT)
    return {
        "ending": run.ending, "now": rig.now, "refusals": dict(run.refusals), "figures": figures.figures(),
        "switched": figures.switched, "state": state(rig),
    }  # fmt: skip


@pytest.mark.parametrize("bench", [True, False])
@settings(max_examples=40)
@given(program=PROGRAMS, periods=st.lists(st.integers(1000, 12 * MS), min_size=1, max_size=4))
def test_the_result_does_not_depend_on_who_looks_and_when(
    bench: bool, program: list[Instruction], periods: list[int]
) -> None:
    def rig() -> Rig:
        return build(BENCH) if bench else simple_rig(343)

    plain = outcome(rig(), program, [], looking=False)
    assert outcome(rig(), program, [], looking=True) == plain
    assert outcome(rig(), program, periods, looking=False) == plain
    assert outcome(rig(), program, periods, looking=True) == plain


class Wall:
    """A wall clock that goes on by itself with each look."""

    def __init__(self, step_s: float) -> None:
        self.now_s = 0.0
        self._step_s = step_s

    def __call__(self) -> float:
        self.now_s += self._step_s
        return self.now_s


def served(rig: Rig, program: list[Instruction], wall: Wall, speed: float, until: int) -> Rig:
    """The program run by a server at a speed, as long as its next event is not behind `until`."""
    module = rig.modules[0]
    server = Server(rig, speed=speed, monotonic=wall)
    module.eeprom.write_program(program)
    module.program.run(0)
    server.settle()
    while rig.now < until and rig.next_event() <= until:
        server.catch_up()
        server.settle()
    return rig


def source(text: str) -> list[Instruction]:
    return list(assemble(text).program)


@settings(max_examples=30)
@given(program=PROGRAMS)
def test_a_server_at_any_speed_runs_the_same_program(program: list[Instruction]) -> None:
    for speed, step_s in ((0.0, 3e-4), (1.0, 3e-4), (7.0, 1e-4)):
        rig = served(simple_rig(343), program, Wall(step_s), speed, 40 * MS)
        plain = simple_rig(343)
        plain.modules[0].eeprom.write_program(program)
        plain.modules[0].program.run(0)
        run_until(plain, rig.now)
        assert state(plain) == state(rig)


def test_a_server_without_pace_executes_what_leads_into_a_loop_and_a_host_goes_on_from_there() -> None:
    program = source(
        "SGP 0, 2, 1 \n L: GGP 1, 2 \n COMP 5 \n JC NE, L \n SGP 0, 2, 2 \n E: JA E"
    )  # fmt: skip
    rig = simple_rig(343)
    module = rig.modules[0]
    server = Server(rig, speed=0.0, monotonic=Wall(1e-5))
    replies = bytearray()
    line = server.connect("host", replies.extend)
    module.eeprom.write_program(program)
    module.program.run(0)
    server.settle()
    while not server.catch_up() or rig.next_event() < NEVER:
        server.settle()
    assert module.program.variables[0] == 1
    line.receive(bytes([1, 9, 1, 2, 0, 0, 0, 5, 18]))
    while not server.catch_up() or rig.next_event() < NEVER:
        server.settle()
    assert module.program.variables[:2] == [2, 5]


def test_a_condition_ends_a_run_before_the_command_that_follows_it() -> None:
    rig = simple_rig(343)
    module = rig.modules[0]
    module.eeprom.write_program(source("L: CALC ADD, 1 \n AGP 0, 2 \n JA L"))
    run = Run(rig, condition=lambda: module.program.variables[0] == 40)
    run.start()
    assert run.go(10 * HZ) == "break"
    assert (module.program.counter, module.program.variables[0]) == (2, 40)
    assert not module.program.hooked


def test_a_rig_whose_motor_has_not_come_to_rest_is_not_over() -> None:
    rig = simple_rig(343)
    rig.modules[0].execute(Instruction(4, 0, 0, 5000))
    assert ending_of(rig) == ""
    assert Run(rig).go() == "stopped"
    assert rig.modules[0].board.chips[0].position(0) == 5000
