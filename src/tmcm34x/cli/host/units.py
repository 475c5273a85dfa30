"""`tmcm34x units`: what velocity, acceleration and current settings are in physical units, and the best for a wish."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import click

from tmcm34x.board.models import MODELS
from tmcm34x.cli import CliError, FiniteRange
from tmcm34x.cli.host.common import json_option, print_json
from tmcm34x.tmcl.axis_parameters import BY_KEY
from tmcm34x.tmcl.units import (
    FULLSTEPS_PER_TURN,
    Scale,
    acceleration_hz_s,
    best_settings,
    brakes_exactly,
    current_ma,
    current_units,
    speed_hz,
)

Decorator = Callable[[Callable[..., int]], Callable[..., int]]


def _setting(name: str, key: str, default: int | None = None, meaning: str = "") -> Decorator:
    """An option with the value of an axis parameter; range and number are those of its row."""
    row = BY_KEY[key]
    return click.option(
        name,
        type=click.IntRange(row.low, row.high),
        default=row.default if default is None else default,
        show_default=True,
        help=f"Axis parameter {row.number}: {meaning or row.name}.",
    )


def _positive(name: str, meaning: str, default: float | None = None, **options: Any) -> Decorator:
    """An option with a physical quantity."""
    return click.option(
        name,
        type=FiniteRange(0, min_open=True),
        default=default,
        show_default=default is not None,
        help=meaning,
        **options,
    )


@click.command()
@_setting("--pulse-divisor", "pulse_divisor")
@_setting("--ramp-divisor", "ramp_divisor")
@_setting("--resolution", "microstep_resolution", meaning="a full step has 2 to the power of this microsteps")
@click.option(
    "--fullsteps",
    type=click.IntRange(1, 10_000),
    default=FULLSTEPS_PER_TURN,
    show_default=True,
    help="Full steps of one turn of the motor.",
)
@_positive("--gear", "Turns of the motor for one turn of what it drives.", 1.0)
@_positive("--pitch", "Distance of one turn of what is driven, in any unit.", 360.0)
@_setting("--speed", "max_speed")
@_setting("--acceleration", "max_acceleration")
@_setting("--current", "max_current", meaning="coil current; that at rest (7) has the same unit")
@click.option(
    "--distance",
    type=FiniteRange(0),
    metavar="UNITS",
    help="Print how long a move by this distance takes; the unit is that of --pitch.",
)
@_positive("--rev-min", "Find the settings for this speed, with --ramp.")
@_positive("--ramp", "Time from rest to the speed of --rev-min.", metavar="SECONDS")
@_positive("--current-ma", "Find the setting for this coil current (RMS).", metavar="MA")
@_positive(
    "--largest-ma", "Coil current (RMS) of setting 255, where the model does not define it.", metavar="MA"
)
@click.option(
    "--model",
    type=click.Choice([str(number) for number in MODELS]),
    default="343",
    show_default=True,
    help="Module type.",
)
@json_option
def command(*, as_json: bool, **options: Any) -> int:
    """Show what settings mean in steps, turns, seconds and mA.

    With --rev-min and --ramp, or with --current-ma, the best settings are found first. Needs no module.
    """
    rows = [*_motion_rows(*_motion(options), options["distance"]), *_current_rows(options)]
    if as_json:
        print_json({name: number for name, number, _ in rows})
    else:
        for name, number, unit in rows:
            click.echo(f"{name:22} {_text(number)} {unit}".rstrip())
    return 0


def _motion(options: dict[str, Any]) -> tuple[Scale, int, int]:
    """Divisors, speed and acceleration: those of the options, or the best for what is wanted."""
    names = ("pulse_divisor", "ramp_divisor", "resolution", "fullsteps", "gear", "pitch")
    scale, rev_min, ramp = Scale(*(options[name] for name in names)), options["rev_min"], options["ramp"]
    if (rev_min is None) != (ramp is None):
        raise click.UsageError("--rev-min and --ramp belong together")
    if rev_min is None:
        return scale, options["speed"], options["acceleration"]
    best = best_settings(scale, rev_min, ramp)
    if best is None:
        raise CliError(
            f"no divisors reach {rev_min:g} rev/min in {ramp:g} s at {1 << scale.resolution} microsteps; lower "
            "--resolution or change the ramp"
        )
    return best


UnitRow = tuple[str, float | int | bool | None, str]


def _current_rows(options: dict[str, Any]) -> list[UnitRow]:
    """The coil current of a setting, or the setting for a wanted current, as far as the largest one is known."""
    wanted: float | None = options["current_ma"]
    largest: float | None = options["largest_ma"] or MODELS[int(options["model"])].max_current_ma
    if largest is None:
        full = f"the current of setting 255 on a TMCM-{options['model']}"
        if wanted is not None:
            raise CliError(f"{full} is not known; give --largest-ma")
        return [
            ("max_current", options["current"], "(axis parameter 6)"),
            ("current", None, f"give --largest-ma, {full}"),
        ]
    if wanted is not None and wanted > largest:
        raise CliError(f"{wanted:g} mA are more than the {largest:g} mA of setting 255")
    setting = options["current"] if wanted is None else round(current_units(wanted, largest))
    return [
        ("max_current", setting, "(axis parameter 6)"),
        ("current", current_ma(setting, largest), "mA RMS"),
    ]


def _motion_rows(scale: Scale, speed: int, acceleration: int, distance: float | None) -> list[UnitRow]:
    rows: list[UnitRow] = [
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


def _text(number: float | int | bool | None) -> str:
    if number is None:
        return "not known;"
    if isinstance(number, bool):
        return (
            "yes"
            if number
            else "NO: the move overshoots or creeps; change the ramp divisor or the acceleration"
        )
    return f"{number:,.6g}" if isinstance(number, float) else f"{number}"
