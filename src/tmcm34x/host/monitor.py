"""Looking at a running module: rows of readings, at a rate.

What acts when it is read (rows with an `effect`: load, driver flags, encoder) is read only when asked for.

Source: manual 7.1, 6.7.15.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

from tmcm34x.host.reading import Absent, Reading
from tmcm34x.host.steps import NUMBERS, Steps, now, reading
from tmcm34x.tmcl.axis_parameters import BY_KEY as AXIS_KEYS
from tmcm34x.tmcl.commands import MOTORS
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.global_parameters import BY_KEY as GLOBAL_KEYS

AXIS_COLUMNS: Final = (
    "actual_position", "target_position", "actual_speed", "target_speed", "position_reached",
    "left_switch", "right_switch", "max_current", "standby_current",
)  # fmt: skip
DRIVER_COLUMNS: Final = ("load_value", "driver_error_flags", "encoder_position")
"""Columns that make the module exchange datagrams with its drivers or encoders."""
_ALL_PORTS: Final = 255
ANALOG_INPUTS: Final = 8


class Column(NamedTuple):
    """A value: its name, the motor or None, and the command that reads it; None where it is absent."""

    name: str
    motor: int | None
    command: Instruction | None


class Sample(NamedTuple):
    """All values at one time [s]."""

    time_s: float
    readings: dict[Column, Reading]


def columns(model: int, motors: Sequence[int] = range(MOTORS), *, drivers: bool = False) -> list[Column]:
    """What there is to look at on a model."""
    keys = (*AXIS_COLUMNS, *(DRIVER_COLUMNS if drivers else ()))
    return [
        *(_axis_column(key, motor, model) for motor in motors for key in keys),
        _global_column("application_status"),
        _global_column("program_counter"),
        Column("inputs", None, Instruction(NUMBERS["GIO"], _ALL_PORTS, 0)),
        Column("outputs", None, Instruction(NUMBERS["GIO"], _ALL_PORTS, 2)),
        *(Column(f"analog_{n}", None, Instruction(NUMBERS["GIO"], n, 1)) for n in range(ANALOG_INPUTS)),
    ]


def sample(wanted: Sequence[Column]) -> Steps[Sample]:
    """One look at everything."""
    start = yield from now()
    readings: dict[Column, Reading] = {}
    for column in wanted:
        if column.command is None:
            readings[column] = Absent("not on this model")
        else:
            readings[column] = yield from reading(column.command)
    return Sample(start, readings)


def _axis_column(key: str, motor: int, model: int) -> Column:
    row = AXIS_KEYS[key]
    there = model in row.models
    return Column(key, motor, Instruction(NUMBERS["GAP"], row.number, motor) if there else None)


def _global_column(key: str) -> Column:
    return Column(key, None, Instruction(NUMBERS["GGP"], GLOBAL_KEYS[key].number))
