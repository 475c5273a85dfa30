"""Figures about limits: margin, overshoot, time at the greatest current."""

import pytest

from tmcm34x.bench.description import parse as parse_bench
from tmcm34x.sweep.description import parse
from tmcm34x.sweep.plan import Job
from tmcm34x.sweep.single import result_of
from tmcm34x.sweep.sources import gather
from tmcm34x.toolchain.assembler import no_includes

BENCH = """
[[module]]
[[module.axis]]
load = {{ kind = "carriage", lead_mm = 40.0, mass_kg = {mass_kg}, friction_n = {friction_n} }}
"""
NAMES = ("margin", "overshoot", "peak_current_us", "lost")


def figures(program, mass_kg=1.0, friction_n=0.0):
    lines = "\n".join(f'{name} = "{name}[0]"' for name in NAMES)
    sweep = parse(f'program = "p"\nuntil_s = 100\n[[vary]]\nwhat = "seed"\nvalues = [0]\n[figures]\n{lines}')
    bench = parse_bench(BENCH.format(mass_kg=mass_kg, friction_n=friction_n))
    result = result_of(Job(sweep, gather(program, "p", no_includes, 343), bench), (0,))
    assert not result.error
    return dict(zip(NAMES, result.figures, strict=True))


MOVE = " SAP 5, 0, 1000\n MVP ABS, 0, 600000\n WAIT POS, 0, 0\n STOP\n"


def test_more_mass_leaves_less_margin_down_to_the_loss_of_steps():
    margins = [figures(MOVE, mass_kg=mass) for mass in (0.5, 1.0, 2.0, 100.0)]
    found = [each["margin"] for each in margins]
    assert found == sorted(found, reverse=True)
    assert len(set(found)) == len(found)
    for each in margins:
        assert (each["margin"] == 0) == (each["lost"] > 0)
    assert margins[-1]["lost"]


def test_friction_takes_its_part_of_the_torque_at_rest_and_at_speed():
    assert figures(MOVE, friction_n=5)["margin"] < figures(MOVE)["margin"]


def test_a_target_behind_a_moving_motor_is_passed_by_the_braking_distance():
    program = " MVP ABS, 0, 100000\n WAIT TICKS, 0, 50\n MVP ABS, 0, 0\n WAIT POS, 0, 0\n STOP\n"
    assert figures(MOVE)["overshoot"] == 0
    assert figures(program)["overshoot"] == 0
    late = " MVP ABS, 0, 100000\n WAIT TICKS, 0, 200\n GAP 1, 0\n CALC ADD, 10\n AAP 0, 0\n WAIT POS, 0, 0\n STOP\n"
    assert figures(late)["overshoot"] > 100


def test_the_greatest_current_is_there_while_the_motor_moves_and_until_power_down():
    """Standby current follows the power-down delay (AP 214) after the move."""
    program = " SAP 7, 0, 8\n SAP 6, 0, 200\n MVP ABS, 0, {}\n WAIT POS, 0, 0\n WAIT TICKS, 0, 500\n STOP\n"
    short, long = (figures(program.format(target))["peak_current_us"] for target in (10_000, 40_000))
    assert 0 < short < long < 5_000_000 + long


@pytest.mark.parametrize("name", NAMES)
def test_a_motor_that_is_not_there_is_named(name):
    text = f'program = "p"\nuntil_s = 1\n[[vary]]\nwhat = "seed"\nvalues = [0]\n[figures]\na = "{name}[3]"'
    result = result_of(Job(parse(text), gather("STOP\n", "p", no_includes, 343), None), (0,))
    assert result.error == f"figures.a: {name}: motors are 0 to 2"
