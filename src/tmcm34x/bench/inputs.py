"""What drives the inputs of a module in a bench file, and what is on its SPI bus."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

from tmcm34x.bench.tables import Index, Level, MotorNumber, NotNegative, Period, Struct, text


class Constant(Struct, frozen=True, tag_field="kind", tag="constant"):
    """A potentiometer at rest, or a steady digital line."""

    value: Annotated[Level, text("level, 0..1023")]


class Square(Struct, frozen=True, tag_field="kind", tag="square"):
    """A square wave."""

    period_ms: Annotated[Period, text("period")]
    duty: Annotated[
        float, Meta(ge=0, le=1), text("part of the period at the high level, from its beginning")
    ] = 0.5
    delay_ms: Annotated[NotNegative, text("low before this time")] = 0.0
    high: Annotated[Level, text("high level")] = 1023
    low: Annotated[Level, text("low level")] = 0


class Ramp(Struct, frozen=True, tag_field="kind", tag="ramp"):
    """A level that goes evenly from start to end, again and again."""

    period_ms: Annotated[Period, text("period")]
    start: Annotated[Level, text("level at the beginning of a period")] = 0
    end: Annotated[Level, text("level at its end")] = 1023
    delay_ms: Annotated[NotNegative, text("time before the first period")] = 0.0


class Sine(Struct, frozen=True, tag_field="kind", tag="sine"):
    """A sine."""

    period_ms: Annotated[Period, text("period")]
    middle: Annotated[Level, text("mean level")] = 512
    amplitude: Annotated[Level, text("greatest distance from it")] = 511
    delay_ms: Annotated[NotNegative, text("time of the first rise through the middle")] = 0.0


class Table(Struct, frozen=True, tag_field="kind", tag="table"):
    """Levels over time."""

    points: Annotated[
        list[tuple[NotNegative, Level]], Meta(min_length=1), text("pairs [from ms, level], by time")
    ]
    repeat_ms: Annotated[Period | None, text("time after which the table begins again")] = None
    interpolated: Annotated[bool, text("whether the level goes straight from point to point")] = False


class Output(Struct, frozen=True, tag_field="kind", tag="output"):
    """A wire from an output OUT_0..OUT_7 of a module."""

    output: Annotated[int, Meta(ge=0, le=7), text("number of the output")]
    module: Annotated[Index | None, text("index of the module in the file; this one unless given")] = None
    invert: Annotated[bool, text("whether an inverter is in the wire")] = False


class Position(Struct, frozen=True, tag_field="kind", tag="position"):
    """A potentiometer on an axis of this module."""

    motor: Annotated[MotorNumber, text("which axis")]
    low: Annotated[float, text("position that gives level 0")]
    high: Annotated[float, text("position that gives level 1023")]


Source = Constant | Square | Ramp | Sine | Table | Output | Position


class Inputs(Struct, frozen=True):
    """What drives the inputs; an open one reads 0."""

    IN_0: Annotated[Source | None, text("pin IN_0")] = None
    IN_1: Annotated[Source | None, text("pin IN_1")] = None
    IN_2: Annotated[Source | None, text("pin IN_2")] = None
    IN_3: Annotated[Source | None, text("pin IN_3")] = None
    IN_4: Annotated[Source | None, text("pin IN_4")] = None
    IN_5: Annotated[Source | None, text("pin IN_5")] = None
    IN_6: Annotated[Source | None, text("pin IN_6")] = None
    IN_7: Annotated[Source | None, text("pin IN_7")] = None
    SHUTDOWN: Annotated[Source | None, text("the SHUTDOWN pin")] = None


class Echo(Struct, frozen=True, tag_field="kind", tag="echo"):
    """A wire from data out to data in."""


class ShiftRegister(Struct, frozen=True, tag_field="kind", tag="shift_register"):
    """A chain of shift registers: bytes come back when they have passed it."""

    bytes: Annotated[int, Meta(ge=1, le=64), text("length of the chain")] = 1


class Buttons(Struct, frozen=True, tag_field="kind", tag="buttons"):
    """Parallel inputs read as bytes."""

    bytes: Annotated[int, Meta(ge=1, le=4), text("number of bytes")] = 1
    inputs: Annotated[int, Meta(ge=0, lt=1 << 32), text("levels, bit by bit")] = 0


class Tmcm323(Struct, frozen=True, tag_field="kind", tag="tmcm323"):
    """A TMCM-323 encoder module, which reads the encoders of the axes."""


Device = Echo | ShiftRegister | Buttons | Tmcm323


class Spi(Struct, frozen=True):
    """The external SPI bus."""

    SPI_SEL0: Annotated[Device | None, text("device on select line 0 (SAC bus 0)")] = None
    SPI_SEL1: Annotated[Device | None, text("device on select line 1 (SAC bus 2)")] = None
    SPI_SEL2: Annotated[Device | None, text("device on select line 2 (SAC bus 3)")] = None
