"""`tmcm34x units`: what velocity and acceleration settings are in physical units, and the best ones for a wish."""

from __future__ import annotations

import click

from tmcm34x.cli import CliError, FiniteRange
from tmcm34x.cli.host.common import json_option, print_json
from tmcm34x.tmcl.units import (
    FULLSTEPS_PER_TURN,
    LARGEST,
    LARGEST_DIVISOR,
    LARGEST_RESOLUTION,
    Scale,
    acceleration_hz_s,
    best_settings,
    brakes_exactly,
    speed_hz,
)


@click.command()
@click.option(
    "--pulse-divisor",
    type=click.IntRange(0, LARGEST_DIVISOR),
    default=3,
    show_default=True,
    help="Axis parameter 154.",
)
@click.option(
    "--ramp-divisor",
    type=click.IntRange(0, LARGEST_DIVISOR),
    default=7,
    show_default=True,
    help="Axis parameter 153.",
)
@click.option(
    "--resolution",
    type=click.IntRange(0, LARGEST_RESOLUTION),
    default=6,
    show_default=True,
    help="Axis parameter 140: a full step has 2 to this microsteps.",
)
@click.option(
    "--fullsteps",
    type=click.IntRange(1, 10_000),
    default=FULLSTEPS_PER_TURN,
    show_default=True,
    help="Full steps of one turn of the motor.",
)
@click.option(
    "--gear",
    type=FiniteRange(0, min_open=True),
    default=1.0,
    show_default=True,
    help="Turns of the motor for one turn of what it drives.",
)
@click.option(
    "--pitch",
    type=FiniteRange(0, min_open=True),
    default=360.0,
    show_default=True,
    help="Distance of one turn of what is driven, in any unit.",
)
@click.option(
    "--speed",
    type=click.IntRange(0, LARGEST),
    default=1000,
    show_default=True,
    help="Velocity setting (axis parameter 4).",
)
@click.option(
    "--acceleration",
    type=click.IntRange(0, LARGEST),
    default=1000,
    show_default=True,
    help="Acceleration setting (axis parameter 5).",
)
@click.option(
    "--distance", type=FiniteRange(0), metavar="UNITS", help="Tell how long a move by this distance takes."
)
@click.option(
    "--rev-min", type=FiniteRange(0, min_open=True), help="Find the settings for this speed, with --ramp."
)
@click.option(
    "--ramp",
    type=FiniteRange(0, min_open=True),
    metavar="SECONDS",
    help="Time from rest to the speed of --rev-min.",
)
@json_option
def command(
    *,
    pulse_divisor: int,
    ramp_divisor: int,
    resolution: int,
    fullsteps: int,
    gear: float,
    pitch: float,
    speed: int,
    acceleration: int,
    distance: float | None,
    rev_min: float | None,
    ramp: float | None,
    as_json: bool,
) -> int:
    """Show what settings mean in steps, turns and seconds; with --rev-min and --ramp, find the best settings first.

    Needs no module.
    """
    scale = Scale(pulse_divisor, ramp_divisor, resolution, fullsteps, gear, pitch)
    if (rev_min is None) != (ramp is None):
        raise click.UsageError("--rev-min and --ramp belong together")
    if rev_min is not None and ramp is not None:
        best = best_settings(scale, rev_min, ramp)
        if best is None:
            raise CliError(
                f"no divisors reach {rev_min:g} rev/min in {ramp:g} s at {1 << resolution} microsteps; lower "
                "--resolution or change the ramp"
            )
        scale, speed, acceleration = best
    rows = _rows(scale, speed, acceleration, distance)
    if as_json:
        print_json({name: number for name, number, _ in rows})
    else:
        for name, number, unit in rows:
            click.echo(f"{name:22} {_text(number)} {unit}".rstrip())
    return 0


Row = tuple[str, float | int | bool, str]


def _rows(scale: Scale, speed: int, acceleration: int, distance: float | None) -> list[Row]:
    rows: list[Row] = [
        ("pulse_divisor", scale.pulse_divisor, "(axis parameter 154)"),
        ("ramp_divisor", scale.ramp_divisor, "(axis parameter 153)"),
        ("max_speed", speed, "(axis parameter 4)"),
        ("max_acceleration", acceleration, "(axis parameter 5)"),
        ("speed", speed_hz(speed, scale.pulse_divisor), "microsteps/s"),
        ("speed_steps", scale.steps_s(speed), "full steps/s"),
        ("speed_rev_min", scale.rev_min(speed), "rev/min"),
        ("speed_units", scale.units_s(speed), "units/s"),
        (
            "acceleration",
            acceleration_hz_s(acceleration, scale.pulse_divisor, scale.ramp_divisor),
            "microsteps/s²",
        ),
        ("ramp", scale.ramp_s(speed, acceleration), "s from rest to that speed"),
        ("microsteps_per_turn", scale.microsteps_per_turn, ""),
        ("brakes_exactly", brakes_exactly(acceleration, scale.pulse_divisor, scale.ramp_divisor), ""),
    ]
    if distance is not None:
        microsteps = scale.microsteps(distance)
        rows += [
            ("distance", round(microsteps), "microsteps"),
            ("move", scale.move_s(microsteps, speed, acceleration), "s from rest to rest"),
        ]
    return rows


def _text(number: float | int | bool) -> str:
    if isinstance(number, bool):
        return (
            "yes"
            if number
            else "NO: the move overshoots or creeps; change the ramp divisor or the acceleration"
        )
    return f"{number:,.6g}" if isinstance(number, float) else f"{number}"
