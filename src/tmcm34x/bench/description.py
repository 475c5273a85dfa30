"""The bench file: what its tables and keys mean.

One struct per table of the TOML file; the reference page docs/bench.md is generated from them.  Lengths, angles and
forces are those of the axis (millimetres and newtons of a carriage, degrees and newton metres of a turntable).
"""

from __future__ import annotations

import tomllib
from math import isfinite
from pathlib import Path
from typing import Annotated, Literal, cast

import msgspec
from msgspec import Meta

from tmcm34x.bench.inputs import Inputs, Spi
from tmcm34x.bench.rig import BenchError
from tmcm34x.bench.tables import (
    Byte,
    Count,
    Index,
    ModelNumber,
    MotorNumber,
    NotNegative,
    Positive,
    Struct,
    text,
)
from tmcm34x.bench.validation import TableError, convert
from tmcm34x.chips.tmc246 import FAULTS
from tmcm34x.files import parse_toml, read_text
from tmcm34x.world.load import Carriage as CarriageLoad
from tmcm34x.world.load import Turntable as TurntableLoad
from tmcm34x.world.motor import Motor as MotorModel

FaultName = Literal[
    "open_load_a", "open_load_b", "short_a", "short_b", "short_to_ground", "under_voltage", "temperature_warning",
    "over_temperature",
]  # fmt: skip

Shape = Literal["rail", "turntable", "belt", "shaft"]
"""How an axis is drawn."""

_MOTOR = MotorModel()
_CARRIAGE = CarriageLoad()
_TURNTABLE = TurntableLoad()


class Motor(Struct, frozen=True):
    """The data sheet of a stepper motor."""

    steps_per_turn: Annotated[Count, text("full steps of a turn")] = _MOTOR.steps_per_turn
    rated_current_ma: Annotated[Positive, text("coil current (RMS) that gives the holding torque")] = (
        _MOTOR.rated_current_ma
    )
    holding_torque_nm: Annotated[Positive, text("torque at rest with rated current")] = (
        _MOTOR.holding_torque_nm
    )
    detent_torque_nm: Annotated[NotNegative, text("torque that holds the rotor without current")] = (
        _MOTOR.detent_torque_nm
    )
    inertia_kgm2: Annotated[NotNegative, text("inertia of the rotor")] = _MOTOR.inertia_kgm2
    corner_speed: Annotated[Positive, text("full steps per second above which the torque falls")] = (
        _MOTOR.corner_speed
    )
    start_speed: Annotated[
        Positive, text("full steps per second at which a rotor that lost its steps catches on again")
    ] = _MOTOR.start_speed
    load_speed: Annotated[
        Positive, text("full steps per second at which the load measurement of a free motor reads best")
    ] = _MOTOR.load_speed


class Carriage(Struct, frozen=True, tag_field="kind", tag="carriage"):
    """A carriage on a screw or belt: positions in millimetres, forces in newtons."""

    lead_mm: Annotated[Positive, text("distance of one motor turn")] = _CARRIAGE.lead_mm
    mass_kg: Annotated[NotNegative, text("moved mass")] = _CARRIAGE.mass_kg
    friction_n: Annotated[NotNegative, text("force against the motion")] = _CARRIAGE.friction_n
    low: Annotated[float | None, text("lower hard stop")] = None
    high: Annotated[float | None, text("upper hard stop")] = None
    start: Annotated[float, text("position at the first power-on")] = _CARRIAGE.start
    force: Annotated[
        float | list[tuple[float, float]],
        text("outer force toward lower positions, or pairs [from position, force]"),
    ] = 0.0


class Turntable(Struct, frozen=True, tag_field="kind", tag="turntable"):
    """A table that turns endlessly: positions in degrees, torques in newton metres, all at the table."""

    ratio: Annotated[Positive, text("motor turns in one turn of the table")] = _TURNTABLE.ratio
    inertia_kgm2: Annotated[NotNegative, text("inertia of the table")] = _TURNTABLE.table_inertia_kgm2
    friction_nm: Annotated[NotNegative, text("torque against the motion")] = _TURNTABLE.table_friction_nm
    start: Annotated[float, text("position at the first power-on")] = _TURNTABLE.start
    torque: Annotated[
        float | list[tuple[float, float]],
        text("outer torque toward lower positions, or pairs [from degrees 0..360, torque]"),
    ] = 0.0


class Switch(Struct, frozen=True):
    """A switch on an axis."""

    position: Annotated[float, text("where it closes: an end switch from here on outward")]
    width: Annotated[
        Positive | None,
        text("length of the cam, around the position; needed on a reference switch and on a turntable"),
    ] = None
    hysteresis: Annotated[NotNegative, text("how much later it opens again")] = 0.0


class Switches(Struct, frozen=True):
    """The switches of an axis."""

    left: Annotated[Switch | None, text("left stop switch, on the left line")] = None
    right: Annotated[Switch | None, text("right stop switch, on the right line")] = None
    reference: Annotated[Switch | None, text("reference switch, in series with the left one")] = None
    contact: Annotated[Literal["normally_closed", "normally_open"], text("an open line is active")] = (
        "normally_closed"
    )
    bounce_ms: Annotated[NotNegative, text("how long contacts bounce, by the seed")] = 0.0


class Encoder(Struct, frozen=True):
    """An incremental encoder on a motor's shaft, read by a TMCM-323."""

    lines: Annotated[Count, text("lines of the disc, four counts each")]
    slip: Annotated[float, Meta(ge=-1, le=1), text("part of the rotation that the disc does not follow")] = (
        0.0
    )
    null: Annotated[Literal["high", "low", "none"], text("level of the null channel at its mark")] = "high"


class AxisDescription(Struct, frozen=True):
    """One motor with what it drives."""

    motor: Annotated[Motor, text("the motor")] = Motor()
    load: Annotated[Carriage | Turntable, text("what it drives")] = Carriage()
    switch: Annotated[Switches, text("its switches")] = Switches()
    encoder: Annotated[Encoder | None, text("an encoder on its shaft")] = None
    reverse: Annotated[bool, text("whether the load moves to lower positions when the counter goes up")] = (
        False
    )
    max_current_ma: Annotated[
        Positive, text("coil current (RMS) of current setting 255; that of an outside driver on a TMCM-342")
    ] = 1100.0
    microsteps: Annotated[
        Literal[1, 2, 4, 8, 16, 32, 64], text("microsteps of the driver behind a TMCM-342's step output")
    ] = 16
    name: Annotated[str, Meta(max_length=20), text("what the axis is called in the drawing of the IDE")] = ""
    shape: Annotated[
        Shape | None,
        text(
            "how the IDE draws it; unless given, a turntable as one, a carriage with hard stops or switches as a rail, "
            "and one without as a shaft"
        ),
    ] = None


class ModuleDescription(Struct, frozen=True):
    """One module on the line."""

    model: Annotated[ModelNumber, text("type number")] = 343
    address: Annotated[Byte | None, text("serial and CAN address; kept as is in a given EEPROM image")] = None
    host_address: Annotated[Byte | None, text("address of replies; kept as is in a given EEPROM image")] = (
        None
    )
    parameters: Annotated[
        Literal["standard", "later"],
        text("later: some parameters of later firmware exist too (docs/fidelity, TMCL-18)"),
    ] = "standard"
    powered: Annotated[bool, text("whether it is switched on at the beginning")] = True
    axis: Annotated[
        list[AxisDescription], Meta(max_length=3), text("axes of motors 0, 1, 2; those left out turn freely")
    ] = msgspec.field(default_factory=list[AxisDescription])
    plane: Annotated[
        tuple[MotorNumber, MotorNumber] | None,
        text("motors of two carriages that move one tool, X first; the IDE draws them as one plan view"),
    ] = None
    input: Annotated[Inputs, text("what drives the inputs")] = Inputs()
    spi: Annotated[Spi, text("devices on the SPI bus")] = Spi()


class Event(Struct, frozen=True):
    """Something that happens at a time, whatever the modules do."""

    at_ms: Annotated[NotNegative, text("when")]
    do: Annotated[
        Literal["fault", "power", "unplug", "switch", "push", "move", "level", "expect"],
        text(
            "fault: put `fault` on a driver or end it; power: switch the supply; unplug: break the cable of a switch "
            "line (`side`); switch: hold a line (`side`) at a level; push: an outer torque (`value`, Nm at the motor) "
            "on the shaft; move: take the load to a position (`value`) by force; level: hold input `input` at `value`; "
            "expect: from here on, "
            "`expect` must come true (docs/sessions.md), which `run --bench` checks"
        ),
    ]
    module: Annotated[Index, text("index of the module in the file")] = 0
    motor: Annotated[MotorNumber, text("which axis")] = 0
    side: Annotated[Literal["left", "right"], text("which switch line")] = "left"
    fault: Annotated[FaultName, text("which fault of the driver")] = "open_load_a"
    input: Annotated[
        Literal["IN_0", "IN_1", "IN_2", "IN_3", "IN_4", "IN_5", "IN_6", "IN_7", "SHUTDOWN"],
        text("which input"),
    ] = "IN_0"
    on: Annotated[bool, text("whether it begins or ends; for a switch line, active or not")] = True
    value: Annotated[float, text("torque, position or level")] = 0.0
    expect: Annotated[
        str, text("`within 5 s: motor 0 at 100`, `always: outputs 00000000` or `never: motor 0 lost steps`")
    ] = ""


class Bench(Struct, frozen=True):
    """The whole file: modules on one line, and events."""

    module: Annotated[list[ModuleDescription], Meta(min_length=1), text("the modules")]
    title: Annotated[str, text("what the bench is, in a line")] = ""
    seed: Annotated[int, text("of everything random: bouncing contacts, random numbers of the modules")] = 0
    instruction_us: Annotated[Positive, text("time of one TMCL instruction in stand-alone mode")] = 100.0
    event: Annotated[list[Event], text("what happens by itself")] = msgspec.field(default_factory=list[Event])


msgspec.json.Decoder(Bench)
"""msgspec learns a struct when it first converts to it, which must not happen in two threads at a time."""


def parse(text: str) -> Bench:
    """The description in the text of a bench file.  Raises `BenchError` with the path to what is wrong."""
    try:
        return from_table(parse_toml(text))
    except tomllib.TOMLDecodeError as error:
        raise BenchError(str(error)) from error


def from_table(table: dict[str, object]) -> Bench:
    """The description in the table of a bench file.  Raises `BenchError` with the path to what is wrong."""
    _check_numbers(table, "")
    try:
        return convert(table, Bench)
    except TableError as error:
        raise BenchError(str(error)) from error


def read(path: str | Path) -> Bench:
    """The description in a bench file.  Raises `BenchError`."""
    try:
        return parse(read_text(Path(path)))
    except OSError as error:
        raise BenchError(f"{path}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise BenchError(f"{path}: not a text file in UTF-8") from error
    except BenchError as error:
        raise BenchError(f"{path}: {error}") from error


def with_model(bench: Bench, model: int | None) -> Bench:
    """The same with a first module of type `model`, unless that is None."""
    if model is None:
        return bench
    first, *others = bench.module
    return msgspec.structs.replace(bench, module=[msgspec.structs.replace(first, model=model), *others])


def _check_numbers(value: object, path: str) -> None:
    """Refuse nan and inf, which the limits of a struct do not catch."""
    if isinstance(value, dict):
        for name, inner in cast("dict[str, object]", value).items():
            _check_numbers(inner, f"{path}.{name}" if path else name)
    elif isinstance(value, list):
        for n, inner in enumerate(cast("list[object]", value)):
            _check_numbers(inner, f"{path}[{n}]")
    elif isinstance(value, float) and not isfinite(value):
        raise BenchError(f"{path}: {value} is not a number for a bench")


assert set(FaultName.__args__) == set(FAULTS)
