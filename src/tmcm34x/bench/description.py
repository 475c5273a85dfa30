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

from tmcm34x.bench.rig import BenchError
from tmcm34x.chips.tmc246 import FAULTS
from tmcm34x.files import parse_toml, read_text
from tmcm34x.world.load import Carriage as CarriageLoad
from tmcm34x.world.load import Turntable as TurntableLoad
from tmcm34x.world.motor import Motor as MotorModel


class Struct(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """A table of the file; unknown keys are errors."""


def _text(text: str) -> Meta:
    return Meta(description=text)


Positive = Annotated[float, Meta(gt=0)]
Period = Annotated[float, Meta(ge=0.01)]
Count = Annotated[int, Meta(ge=1)]
NotNegative = Annotated[float, Meta(ge=0)]
Level = Annotated[int, Meta(ge=0, le=1023)]
Bit = Annotated[int, Meta(ge=0, le=1)]
Byte = Annotated[int, Meta(ge=0, le=255)]
Index = Annotated[int, Meta(ge=0)]
MotorNumber = Annotated[int, Meta(ge=0, le=2)]
ModelNumber = Literal[341, 342, 343]
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

    steps_per_turn: Annotated[Count, _text("full steps of a turn")] = _MOTOR.steps_per_turn
    rated_current_ma: Annotated[Positive, _text("coil current (RMS) that gives the holding torque")] = (
        _MOTOR.rated_current_ma
    )
    holding_torque_nm: Annotated[Positive, _text("torque at rest with rated current")] = (
        _MOTOR.holding_torque_nm
    )
    detent_torque_nm: Annotated[NotNegative, _text("torque that holds the rotor without current")] = (
        _MOTOR.detent_torque_nm
    )
    inertia_kgm2: Annotated[NotNegative, _text("inertia of the rotor")] = _MOTOR.inertia_kgm2
    corner_speed: Annotated[Positive, _text("full steps per second above which the torque falls")] = (
        _MOTOR.corner_speed
    )
    start_speed: Annotated[
        Positive, _text("full steps per second at which a rotor that lost its steps catches on again")
    ] = _MOTOR.start_speed
    load_speed: Annotated[
        Positive, _text("full steps per second at which the load measurement of a free motor reads best")
    ] = _MOTOR.load_speed


class Carriage(Struct, frozen=True, tag_field="kind", tag="carriage"):
    """A carriage on a screw or belt: positions in millimetres, forces in newtons."""

    lead_mm: Annotated[Positive, _text("way of one motor turn")] = _CARRIAGE.lead_mm
    mass_kg: Annotated[NotNegative, _text("moved mass")] = _CARRIAGE.mass_kg
    friction_n: Annotated[NotNegative, _text("force against the motion")] = _CARRIAGE.friction_n
    low: Annotated[float | None, _text("lower hard stop")] = None
    high: Annotated[float | None, _text("upper hard stop")] = None
    start: Annotated[float, _text("position at the first power-on")] = _CARRIAGE.start
    force: Annotated[
        float | list[tuple[float, float]],
        _text("outer force toward lower positions, or pairs [from position, force]"),
    ] = 0.0


class Turntable(Struct, frozen=True, tag_field="kind", tag="turntable"):
    """A table that turns endlessly: positions in degrees, torques in newton metres, all at the table."""

    ratio: Annotated[Positive, _text("motor turns in one turn of the table")] = _TURNTABLE.ratio
    inertia_kgm2: Annotated[NotNegative, _text("inertia of the table")] = _TURNTABLE.table_inertia_kgm2
    friction_nm: Annotated[NotNegative, _text("torque against the motion")] = _TURNTABLE.table_friction_nm
    start: Annotated[float, _text("position at the first power-on")] = _TURNTABLE.start
    torque: Annotated[
        float | list[tuple[float, float]],
        _text("outer torque toward lower positions, or pairs [from degrees 0..360, torque]"),
    ] = 0.0


class Switch(Struct, frozen=True):
    """A switch on an axis."""

    position: Annotated[float, _text("where it closes: an end switch from here on outward")]
    width: Annotated[
        Positive | None,
        _text("length of the cam, around the position; needed on a reference switch and on a turntable"),
    ] = None
    hysteresis: Annotated[NotNegative, _text("how much later it opens again")] = 0.0


class Switches(Struct, frozen=True):
    """The switches of an axis."""

    left: Annotated[Switch | None, _text("left stop switch, on the left line")] = None
    right: Annotated[Switch | None, _text("right stop switch, on the right line")] = None
    reference: Annotated[Switch | None, _text("reference switch, in series with the left one")] = None
    contact: Annotated[Literal["normally_closed", "normally_open"], _text("an open line is active")] = (
        "normally_closed"
    )
    bounce_ms: Annotated[NotNegative, _text("how long contacts bounce, by the seed")] = 0.0


class Encoder(Struct, frozen=True):
    """An incremental encoder on a motor's shaft, read by a TMCM-323."""

    lines: Annotated[Count, _text("lines of the disc, four counts each")]
    slip: Annotated[float, Meta(ge=-1, le=1), _text("part of the way that the disc does not make")] = 0.0
    null: Annotated[Literal["high", "low", "none"], _text("level of the null channel at its mark")] = "high"


class AxisDescription(Struct, frozen=True):
    """One motor with what it drives."""

    motor: Annotated[Motor, _text("the motor")] = Motor()
    load: Annotated[Carriage | Turntable, _text("what it drives")] = Carriage()
    switch: Annotated[Switches, _text("its switches")] = Switches()
    encoder: Annotated[Encoder | None, _text("an encoder on its shaft")] = None
    reverse: Annotated[bool, _text("whether the load moves to lower positions when the counter goes up")] = (
        False
    )
    max_current_ma: Annotated[
        Positive, _text("coil current (RMS) of current setting 255; that of an outside driver on a TMCM-342")
    ] = 1100.0
    microsteps: Annotated[
        Literal[1, 2, 4, 8, 16, 32, 64], _text("microsteps of the driver behind a TMCM-342's step output")
    ] = 16
    name: Annotated[str, Meta(max_length=20), _text("what the axis is called in the drawing of the IDE")] = ""
    shape: Annotated[
        Shape | None,
        _text(
            "how the IDE draws it; unless given, a turntable as one, a carriage with hard stops or switches as a rail, "
            "and one without as a shaft"
        ),
    ] = None


class Constant(Struct, frozen=True, tag_field="kind", tag="constant"):
    """A potentiometer at rest, or a steady digital line."""

    value: Annotated[Level, _text("level, 0..1023")]


class Square(Struct, frozen=True, tag_field="kind", tag="square"):
    """A square wave."""

    period_ms: Annotated[Period, _text("period")]
    duty: Annotated[
        float, Meta(ge=0, le=1), _text("part of the period at the high level, from its beginning")
    ] = 0.5
    delay_ms: Annotated[NotNegative, _text("low before this time")] = 0.0
    high: Annotated[Level, _text("high level")] = 1023
    low: Annotated[Level, _text("low level")] = 0


class Ramp(Struct, frozen=True, tag_field="kind", tag="ramp"):
    """A level that goes evenly from start to end, again and again."""

    period_ms: Annotated[Period, _text("period")]
    start: Annotated[Level, _text("level at the beginning of a period")] = 0
    end: Annotated[Level, _text("level at its end")] = 1023
    delay_ms: Annotated[NotNegative, _text("time before the first period")] = 0.0


class Sine(Struct, frozen=True, tag_field="kind", tag="sine"):
    """A sine."""

    period_ms: Annotated[Period, _text("period")]
    middle: Annotated[Level, _text("mean level")] = 512
    amplitude: Annotated[Level, _text("greatest distance from it")] = 511
    delay_ms: Annotated[NotNegative, _text("time of the first rise through the middle")] = 0.0


class Table(Struct, frozen=True, tag_field="kind", tag="table"):
    """Levels over time."""

    points: Annotated[
        list[tuple[NotNegative, Level]], Meta(min_length=1), _text("pairs [from ms, level], by time")
    ]
    repeat_ms: Annotated[Period | None, _text("time after which the table begins again")] = None
    interpolated: Annotated[bool, _text("whether the level goes straight from point to point")] = False


class Output(Struct, frozen=True, tag_field="kind", tag="output"):
    """A wire from an output OUT_0..OUT_7 of a module."""

    output: Annotated[int, Meta(ge=0, le=7), _text("number of the output")]
    module: Annotated[Index | None, _text("index of the module in the file; this one unless given")] = None
    invert: Annotated[bool, _text("whether an inverter is in the wire")] = False


class Position(Struct, frozen=True, tag_field="kind", tag="position"):
    """A potentiometer on an axis of this module."""

    motor: Annotated[MotorNumber, _text("which axis")]
    low: Annotated[float, _text("position that gives level 0")]
    high: Annotated[float, _text("position that gives level 1023")]


Source = Constant | Square | Ramp | Sine | Table | Output | Position


class Inputs(Struct, frozen=True):
    """What drives the inputs; an open one reads 0."""

    IN_0: Annotated[Source | None, _text("pin IN_0")] = None
    IN_1: Annotated[Source | None, _text("pin IN_1")] = None
    IN_2: Annotated[Source | None, _text("pin IN_2")] = None
    IN_3: Annotated[Source | None, _text("pin IN_3")] = None
    IN_4: Annotated[Source | None, _text("pin IN_4")] = None
    IN_5: Annotated[Source | None, _text("pin IN_5")] = None
    IN_6: Annotated[Source | None, _text("pin IN_6")] = None
    IN_7: Annotated[Source | None, _text("pin IN_7")] = None
    SHUTDOWN: Annotated[Source | None, _text("the SHUTDOWN pin")] = None


class Echo(Struct, frozen=True, tag_field="kind", tag="echo"):
    """A wire from data out to data in."""


class ShiftRegister(Struct, frozen=True, tag_field="kind", tag="shift_register"):
    """A chain of shift registers: bytes come back when they have passed it."""

    bytes: Annotated[int, Meta(ge=1, le=64), _text("length of the chain")] = 1


class Buttons(Struct, frozen=True, tag_field="kind", tag="buttons"):
    """Parallel inputs read as bytes."""

    bytes: Annotated[int, Meta(ge=1, le=4), _text("number of bytes")] = 1
    inputs: Annotated[int, Meta(ge=0, lt=1 << 32), _text("levels, bit by bit")] = 0


class Tmcm323(Struct, frozen=True, tag_field="kind", tag="tmcm323"):
    """A TMCM-323 encoder module, which reads the encoders of the axes."""


Device = Echo | ShiftRegister | Buttons | Tmcm323


class Spi(Struct, frozen=True):
    """The external SPI bus."""

    SPI_SEL0: Annotated[Device | None, _text("device on select line 0 (SAC bus 0)")] = None
    SPI_SEL1: Annotated[Device | None, _text("device on select line 1 (SAC bus 2)")] = None
    SPI_SEL2: Annotated[Device | None, _text("device on select line 2 (SAC bus 3)")] = None


class ModuleDescription(Struct, frozen=True):
    """One module on the line."""

    model: Annotated[ModelNumber, _text("type number")] = 343
    address: Annotated[Byte | None, _text("serial and CAN address; kept as is in a given EEPROM image")] = (
        None
    )
    host_address: Annotated[Byte | None, _text("address of replies; kept as is in a given EEPROM image")] = (
        None
    )
    parameters: Annotated[
        Literal["standard", "later"],
        _text("later: some parameters of later firmware exist too (docs/fidelity, TMCL-18)"),
    ] = "standard"
    powered: Annotated[bool, _text("whether it is switched on at the beginning")] = True
    axis: Annotated[
        list[AxisDescription], Meta(max_length=3), _text("axes of motors 0, 1, 2; those left out turn freely")
    ] = msgspec.field(default_factory=list[AxisDescription])
    plane: Annotated[
        tuple[MotorNumber, MotorNumber] | None,
        _text("motors of two carriages that move one tool, X first; the IDE draws them as one plan view"),
    ] = None
    input: Annotated[Inputs, _text("what drives the inputs")] = Inputs()
    spi: Annotated[Spi, _text("devices on the SPI bus")] = Spi()


class Event(Struct, frozen=True):
    """Something that happens at a time, whatever the modules do."""

    at_ms: Annotated[NotNegative, _text("when")]
    do: Annotated[
        Literal["fault", "power", "unplug", "switch", "push", "move", "level", "expect"],
        _text(
            "fault: put `fault` on a driver or end it; power: switch the supply; unplug: break the cable of a switch "
            "line (`side`); switch: hold a line (`side`) at a level; push: an outer torque (`value`, Nm at the motor) "
            "on the shaft; move: take the load to a position (`value`) by force; level: hold input `input` at `value`; "
            "expect: from here on, "
            "`expect` must come true (docs/sessions.md), which `run --bench` checks"
        ),
    ]
    module: Annotated[Index, _text("index of the module in the file")] = 0
    motor: Annotated[MotorNumber, _text("which axis")] = 0
    side: Annotated[Literal["left", "right"], _text("which switch line")] = "left"
    fault: Annotated[FaultName, _text("which fault of the driver")] = "open_load_a"
    input: Annotated[
        Literal["IN_0", "IN_1", "IN_2", "IN_3", "IN_4", "IN_5", "IN_6", "IN_7", "SHUTDOWN"],
        _text("which input"),
    ] = "IN_0"
    on: Annotated[bool, _text("whether it begins or ends; for a switch line, active or not")] = True
    value: Annotated[float, _text("torque, position or level")] = 0.0
    expect: Annotated[
        str, _text("`within 5 s: motor 0 at 100`, `always: outputs 00000000` or `never: motor 0 lost steps`")
    ] = ""


class Bench(Struct, frozen=True):
    """The whole file: modules on one line, and events."""

    module: Annotated[list[ModuleDescription], Meta(min_length=1), _text("the modules")]
    title: Annotated[str, _text("what the bench is, in a line")] = ""
    seed: Annotated[int, _text("of everything random: bouncing contacts, random numbers of the modules")] = 0
    instruction_us: Annotated[Positive, _text("time of one TMCL instruction in stand-alone mode")] = 100.0
    event: Annotated[list[Event], _text("what happens by itself")] = msgspec.field(
        default_factory=list[Event]
    )


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
        return msgspec.convert(table, Bench)
    except msgspec.ValidationError as error:
        raise BenchError(_with_path_first(str(error))) from error


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


def _with_path_first(message: str) -> str:
    """The validator's message with its path in front: ``module[1].axis[0].motor: expected ...``."""
    problem, _, path = message.partition(" - at `$")
    path = path.rstrip("`").lstrip(".")
    problem = problem[0].lower() + problem[1:].replace("`", "")
    return f"{path}: {problem}" if path else problem


assert set(FaultName.__args__) == set(FAULTS)
