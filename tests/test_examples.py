"""Every program under examples/ runs, and does what it says."""

from __future__ import annotations

from pathlib import Path

import pytest

from tmcm34x.bench import Rig, load, simple_rig
from tmcm34x.cli.source_files import assemble_file
from tmcm34x.clock import HZ, MS, run_until
from tmcm34x.firmware.module import FirmwareModule
from tmcm34x.tmcl.mnemonic import parse_instruction
from tmcm34x.toolchain.formatter import format_source
from tmcm34x.toolchain.linter import lint

EXAMPLES = Path(__file__).parent.parent / "examples"
PROGRAMS = sorted(path for path in EXAMPLES.rglob("*.tmc") if path.parent.name != "include")


class Example:
    """A program of the examples, started on a bench."""

    def __init__(self, program: str, bench: str | None = None) -> None:
        self.rig: Rig = load(EXAMPLES / "benches" / bench) if bench else simple_rig(343)
        self.module: FirmwareModule = self.rig.modules[0]
        assembly = assemble_file(EXAMPLES / program)
        assert assembly.ok, assembly.diagnostics
        self.module.eeprom.write_program(assembly.program)
        self.module.program.run(0)

    def run(self, seconds: float) -> None:
        run_until(self.rig, self.rig.now + round(seconds * HZ))

    def run_to_stop(self, limit_s: float) -> None:
        limit = self.rig.now + round(limit_s * HZ)
        while self.module.program.active and self.rig.now < limit:
            self.rig.advance(min(self.rig.next_event(), limit))
        assert not self.module.program.active
        assert self.module.program.last_error is None

    def do(self, line: str) -> int:
        status, value = self.module.execute(parse_instruction(line))
        assert status == 100
        return value

    def positions(self) -> list[int]:
        return [self.do(f"GAP 1, {motor}") for motor in range(3)]

    @property
    def variables(self) -> list[int]:
        return self.module.program.variables

    @property
    def outputs(self) -> int:
        return self.module.board.outputs

    def place(self, motor: int) -> float:
        return self.rig.worlds[0].view()[motor].position


@pytest.mark.parametrize("path", PROGRAMS, ids=lambda path: path.stem)
def test_examples_assemble_without_a_remark(path: Path) -> None:
    assembly = assemble_file(path)
    assert assembly.diagnostics == ()
    assert lint(assembly, model=343) == ()


@pytest.mark.parametrize("path", PROGRAMS, ids=lambda path: path.stem)
def test_examples_are_in_columns(path: Path) -> None:
    text = path.read_text("utf-8")
    assert format_source(text) == text


def test_manual_5_2() -> None:
    example = Example("manual/5.2-first-program.tmc")
    example.run(4.9)
    assert example.do("GAP 3, 0") == -500
    example.run(5)
    assert example.do("GAP 3, 1") == 250
    places: list[int] = []
    for _ in range(1000):
        example.run(0.01)
        places.append(example.do("GAP 1, 2"))
    assert -10_000 <= min(places) < -9_990
    assert 9_990 < max(places) <= 10_000


def test_manual_6_7_14_mirrors_the_inputs() -> None:
    example = Example("manual/6.7.14-mirror.tmc")
    for bits in (0, 0b1010_0101, 0xFF, 1):
        for n in range(8):
            example.module.board.set_input(n, bits >> n & 1)
        example.run(0.001)
        assert example.outputs == bits


def test_manual_6_7_16_calculates() -> None:
    example = Example("manual/6.7.16-calculate.tmc")
    example.run_to_stop(1)
    assert example.variables[:2] == [-35_000, 65_536]


def test_manual_6_7_17_compares() -> None:
    example = Example("manual/6.7.17-compare.tmc")
    while not example.outputs:
        assert example.do("GAP 1, 2") < 1010
        example.rig.advance(example.rig.next_event())
    assert example.do("GAP 1, 2") >= 1000
    example.run_to_stop(2)
    assert example.do("GAP 1, 0") < -5000


def test_manual_6_7_19_goes_to_and_fro() -> None:
    example = Example("manual/6.7.19-endless.tmc")
    example.run(5)
    assert example.module.program.active
    assert example.module.program.executed > 20


def test_manual_6_7_20_rests_in_the_subroutine() -> None:
    example = Example("manual/6.7.20-subroutine.tmc")
    example.run(0.7)
    assert example.module.program.stack == (2,)
    assert example.positions()[0] == 10_000
    example.run(10)
    assert example.module.program.active


def test_manual_6_7_30_follows_the_potentiometer() -> None:
    example = Example("manual/6.7.30-potentiometer.tmc")
    for level in (1023, 200):
        example.module.board.set_analog(0, level)
        example.run(0.5)
        assert example.positions()[0] == 4 * level


def test_manual_9_2_finds_the_hard_stop() -> None:
    example = Example("manual/9.2-stall-homing.tmc", "stall-homing.toml")
    example.run_to_stop(30)
    example.run(1)
    assert example.positions()[0] == 0
    assert example.do("GAP 3, 0") == 0
    assert example.place(0) == pytest.approx(0.0, abs=0.1)


def test_homing_finds_both_axes_and_goes_to_work() -> None:
    example = Example("homing.tmc", "xy-stage.toml")
    example.run_to_stop(60)
    assert example.outputs == 0b0000_0001
    assert example.positions()[:2] == [256_000, 128_000]
    assert (example.place(0), example.place(1)) == (pytest.approx(100, abs=0.1), pytest.approx(50, abs=0.1))


def test_homing_gives_up_when_a_switch_is_missing() -> None:
    example = Example("homing.tmc")
    example.run_to_stop(25)
    example.run(2)
    assert example.outputs == 0b1000_0000
    assert example.variables[0] == 1
    assert [example.do(f"GAP 3, {motor}") for motor in range(2)] == [0, 0]


def test_pick_and_place_carries_four_parts() -> None:
    example = Example("pick-and-place.tmc", "pick-and-place.toml")
    grips: list[int] = []
    example.module.board.on_output.append(lambda bits: grips.append(bits & 1))
    example.run_to_stop(200)
    assert example.variables[:2] == [4, 0]
    assert grips == [1, 0] * 4
    assert example.outputs == 0
    assert example.positions()[:2] == [0, 0]


def test_pick_and_place_tries_again_after_an_empty_grip() -> None:
    example = Example("pick-and-place.tmc", "pick-and-place.toml")
    world = example.rig.worlds[0]
    world.set_level(0, 0)
    while not example.variables[1]:
        example.run(0.1)
        assert example.rig.now < 100 * HZ
    world.set_level(0, None)
    example.run_to_stop(200)
    assert example.variables[0] == 4
    assert example.variables[1] >= 1


def test_the_conveyor_counts_until_the_emergency_stop() -> None:
    example = Example("conveyor.tmc", "conveyor.toml")
    flaps: list[tuple[float, int]] = []
    example.module.board.on_output.append(lambda bits: flaps.append((example.module.now / MS, bits)))
    example.run_to_stop(10)
    assert example.rig.now / MS == pytest.approx(8000, abs=20)
    assert example.variables[:2] == [9, 1]
    assert [bits for _, bits in flaps] == [2, 0, 2, 0, 0x80]
    assert [when for when, _ in flaps][:2] == [pytest.approx(2000, abs=2), pytest.approx(2400, abs=2)]
    example.run(1)
    assert example.do("GAP 3, 0") == 0


def test_the_joystick_turns_the_motor_both_ways() -> None:
    example = Example("joystick.tmc", "joystick.toml")
    speeds = []
    for _ in range(12):
        example.run(1)
        speeds.append(example.do("GAP 3, 0"))
    assert speeds[0] == 0
    assert speeds[2] == speeds[3] == 4 * (1000 - 512 - 40)
    assert speeds[5] == 0
    assert speeds[7] == speeds[8] == -4 * (512 - 200 - 40)
    example.run_to_stop(1)


def ask(example: Example, order: int, goal: int = 0) -> int:
    """Give an order as a host does, and wait for its answer."""
    example.do(f"SGP 1, 2, {goal}")
    example.do("SGP 2, 2, 0")
    example.do(f"SGP 0, 2, {order}")
    for _ in range(1000):
        example.run(0.01)
        if answer := example.do("GGP 2, 2"):
            return answer
    raise AssertionError("no answer")


def test_the_handshake_carries_out_orders_and_answers() -> None:
    example = Example("handshake.tmc")
    example.run(1)
    assert ask(example, 1, 30_000) == 1
    example.run(0.1)
    assert example.positions()[0] == 30_000
    assert ask(example, 1, 2_000_000) == -1
    assert ask(example, 7) == -1
    assert ask(example, 2) == 1
    example.run(0.1)
    assert example.positions()[0] == 0
    assert example.variables[3] == 2
    example.do("SGP 0, 2, 9")
    example.run_to_stop(1)


def test_the_speed_profile_goes_up_and_down() -> None:
    example = Example("speed-profile.tmc")
    speeds: list[int] = []
    while example.module.program.active:
        example.run(0.5)
        speeds.append(example.do("GAP 3, 0"))
    top = speeds.index(max(speeds))
    assert max(speeds) == 1600
    assert speeds[:top] == sorted(speeds[:top])
    assert speeds[top:] == sorted(speeds[top:], reverse=True)
    assert example.do("GAP 3, 0") == 0
    assert 0 < example.variables[1] < example.positions()[0]


def test_three_axes_count_their_rounds() -> None:
    example = Example("three_axes.tmc")
    example.run(30)
    assert example.variables[0] >= 3
    assert example.do("GAP 3, 2") == 300
