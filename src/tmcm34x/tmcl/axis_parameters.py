"""The axis parameters of chapter 7: one row each.

Columns:

number    type field of SAP, GAP, STAP, RSAP, AAP
key       attribute name on the host and in settings files
name      the manual's
access    R readable, W writable, E stored by STAP and restored at power-on
low high  range of a written value; of a read value where the parameter is read-only
default   factory default, and value after power-on where not stored
unit      of the value, empty for a plain number
models    modules that have it
meaning   in our words
choices   values with a name
effect    what reading it does in the module; empty where reading does nothing
bits      what each bit stands for, lowest first
needs     hardware beside the module without which it has no effect; empty where it needs none

`kind` says what a value is; it follows from the other columns.

Source: manual 6.7.5 to 6.7.8 and 7.1; defaults and departures: docs/fidelity.md (TMCL).
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final, Literal, NamedTuple

from tmcm34x.tmcl.commands import INT32_MAX, INT32_MIN, POSITION_MAX, POSITION_MIN

Choices = tuple[tuple[int, str], ...]

Kind = Literal["position", "speed", "acceleration", "current", "time", "flag", "choice", "bits", "number"]
"""What the value of a parameter is."""

_KIND_OF_UNIT: Final[Mapping[str, Kind]] = MappingProxyType({
    "microsteps": "position", "encoder steps": "position", "velocity units": "speed",
    "acceleration units": "acceleration", "1/255 of the module's maximum": "current", "ms": "time", "10 ms": "time",
    "bit mask": "bits",
})  # fmt: skip


def kind_of(unit: str, low: int, high: int, choices: Choices) -> Kind:
    """What the values of a parameter with these columns are."""
    if choices:
        return "choice"
    return "flag" if (low, high) == (0, 1) else _KIND_OF_UNIT.get(unit, "number")


STANDARD: Final = "standard"
LATER: Final = "later"
PROFILES: Final = (STANDARD, LATER)
"""Which parameters a virtual module has: those of the manual, or some of later firmware too (fidelity TMCL-18)."""

ALL: Final = frozenset({341, 342, 343})
WITH_DRIVERS: Final = frozenset({341, 343})
"""Modules whose firmware sets currents and reads loads: a TMCM-342 puts out step and direction only."""


ENCODER: Final = "an encoder on a TMCM-323"


class AxisParameter(NamedTuple):
    """One row of `AXIS_PARAMETERS`; the module docstring names the columns."""

    number: int
    key: str
    name: str
    access: str
    low: int
    high: int
    default: int
    unit: str
    models: frozenset[int]
    meaning: str
    choices: Choices = ()
    effect: str = ""
    section: str = "7.1"
    bits: tuple[str, ...] = ()
    needs: str = ""

    @property
    def kind(self) -> Kind:
        """What its value is."""
        return kind_of(self.unit, self.low, self.high, self.choices)

    @property
    def readable(self) -> bool:
        """Whether GAP may read it."""
        return "R" in self.access

    @property
    def writable(self) -> bool:
        """Whether SAP and AAP may write it."""
        return "W" in self.access

    @property
    def stored(self) -> bool:
        """Whether STAP and RSAP know it."""
        return "E" in self.access


_DRIVER_FLAGS: Final = (
    "overcurrent on the low side of bridge A", "overcurrent on the low side of bridge B", "open load on bridge A",
    "open load on bridge B", "overcurrent on the high side", "undervoltage", "temperature warning", "overtemperature",
)  # fmt: skip
_ASKS_DRIVERS: Final = "sends the motor drivers a datagram"

AXIS_PARAMETERS: Final[tuple[AxisParameter, ...]] = (
    AxisParameter(
        0, "target_position", "target (next) position", "RW", POSITION_MIN, POSITION_MAX, 0, "microsteps", ALL,
        "Where the motor goes in position mode.",
    ),
    AxisParameter(
        1, "actual_position", "actual position", "RW", POSITION_MIN, POSITION_MAX, 0, "microsteps", ALL,
        "Where the motor is; write it only to set a reference point, together with parameter 0.",
    ),
    AxisParameter(
        2, "target_speed", "target (next) speed", "RW", -2047, 2047, 0, "velocity units", ALL,
        "The target speed in velocity mode; in position mode the chip's: maximum while speeding up or cruising, "
        "0 while braking and at rest.",
    ),
    AxisParameter(
        3, "actual_speed", "actual speed", "RW", -2047, 2047, 0, "velocity units", ALL,
        "The speed the motor has now.",
    ),
    AxisParameter(
        4, "max_speed", "maximum positioning speed", "RWE", 0, 2047, 1000, "velocity units", ALL,
        "Top speed of positioning moves; choose the pulse divisor (154) so that it is neither tiny nor at the limit.",
    ),
    AxisParameter(
        5, "max_acceleration", "maximum acceleration", "RWE", 0, 2047, 1000, "acceleration units", ALL,
        "Acceleration and deceleration; a change also recomputes the chip's braking factors.",
    ),
    AxisParameter(
        6, "max_current", "absolute max. current", "RWE", 0, 255, 128, "1/255 of the module's maximum",
        WITH_DRIVERS, "Coil current while the motor moves. Too much of it destroys motors.",
    ),
    AxisParameter(
        7, "standby_current", "standby current", "RWE", 0, 255, 8, "1/255 of the module's maximum", WITH_DRIVERS,
        "Coil current at rest, after the power down delay (214).",
    ),
    AxisParameter(
        8, "position_reached", "target pos. reached", "R", 0, 1, 1, "", ALL,
        "1 when the actual position equals the target position.",
    ),
    AxisParameter(
        9, "reference_switch", "ref. switch status", "R", 0, 1, 0, "", ALL,
        "1 when the reference switch is active; it shares the line of the left stop switch.",
    ),
    AxisParameter(
        10, "right_switch", "right limit switch status", "R", 0, 1, 0, "", ALL, "1 when the right switch is active.",
    ),
    AxisParameter(
        11, "left_switch", "left limit switch status", "R", 0, 1, 0, "", ALL, "1 when the left switch is active.",
    ),
    AxisParameter(
        12, "right_switch_disable", "right limit switch disable", "RWE", 0, 1, 0, "", ALL,
        "1: the right switch does not stop the motor.",
    ),
    AxisParameter(
        13, "left_switch_disable", "left limit switch disable", "RWE", 0, 1, 0, "", ALL,
        "1: the left switch does not stop the motor.",
    ),
    AxisParameter(
        130, "min_speed", "minimum speed", "RWE", 0, 2047, 1, "velocity units", ALL,
        "Speed of the last steps of a move; leave it at 1, or the target may be missed.",
    ),
    AxisParameter(
        135, "actual_acceleration", "actual acceleration", "R", 0, 2047, 0, "acceleration units", ALL,
        "The acceleration at this moment, without sign.",
    ),
    AxisParameter(
        138, "ramp_mode", "ramp mode", "RW", 0, 2, 0, "", ALL,
        "How the chip makes its ramp; ROR, ROL, MST and MVP set it themselves.",
        ((0, "position"), (1, "soft"), (2, "velocity")),
    ),
    AxisParameter(
        140, "microstep_resolution", "microstep resolution", "RWE", 0, 6, 6, "", ALL,
        "Microsteps of a full step; speed and distance in full steps change with it. A TMCM-342 keeps it without "
        "effect on its step outputs.",
        tuple((n, text) for n, text in enumerate((
            "full step", "half step", "4 microsteps", "8 microsteps", "16 microsteps", "32 microsteps",
            "64 microsteps",
        ))),
    ),
    AxisParameter(
        149, "soft_stop", "soft stop flag", "RWE", 0, 1, 0, "", ALL,
        "What a stop switch does: 0 stops at once, 1 along the ramp.",
    ),
    AxisParameter(
        153, "ramp_divisor", "ramp divisor", "RWE", 0, 13, 7, "power of two", ALL,
        "Divides the clock of the ramp generator; a step of one halves or doubles the acceleration.",
    ),
    AxisParameter(
        154, "pulse_divisor", "pulse divisor", "RWE", 0, 13, 3, "power of two", ALL,
        "Divides the clock of the pulse generator; a step of one halves or doubles speed and acceleration.",
    ),
    AxisParameter(
        193, "reference_mode", "referencing mode", "RWE", 1, 3, 1, "", ALL, "Which switches RFS looks for.",
        ((1, "left switch"), (2, "right, then left switch"), (3, "right, then reference switch")),
    ),
    AxisParameter(
        194, "reference_search_speed", "referencing search speed", "RWE", 0, 2047, 0, "velocity units", ALL,
        "Speed of RFS until the switch is found; 0 takes the maximum positioning speed (4).",
    ),
    AxisParameter(
        195, "reference_switch_speed", "referencing switch speed", "RWE", 0, 2047, 0, "velocity units", ALL,
        "Speed of RFS while it measures the switching points; 0 takes a quarter of parameter 4.",
    ),
    AxisParameter(
        196, "end_switch_distance", "distance end switches", "R", 0, POSITION_MAX, 0, "microsteps", ALL,
        "Way between the two end switches, measured by RFS in modes 2 and 3.",
    ),
    AxisParameter(
        203, "mixed_decay_threshold", "mixed decay threshold", "RWE", -1, 2048, 2048, "velocity units",
        WITH_DRIVERS, "Speed above which the drivers use mixed decay; -1 always and in every part of the wave.",
    ),
    AxisParameter(
        204, "freewheeling", "freewheeling", "RWE", 0, 65535, 0, "10 ms", WITH_DRIVERS,
        "Time at rest after which the coils are switched off; 0 never.",
    ),
    AxisParameter(
        205, "stall_threshold", "stall detection threshold", "RWE", 0, 7, 0, "", WITH_DRIVERS,
        "Load value at which the motor is stopped as stalled; 0 switches the detection off.",
    ),
    AxisParameter(
        206, "load_value", "actual load value", "R", 0, 7, 0, "", WITH_DRIVERS,
        "Load as the driver measures it, greater for more load.", effect=_ASKS_DRIVERS,
    ),
    AxisParameter(
        208, "driver_error_flags", "driver error flags", "R", 0, 255, 0, "bit mask", WITH_DRIVERS,
        "What the driver reports: " + ", ".join(f"{bit} {name}" for bit, name in enumerate(_DRIVER_FLAGS)) + ".",
        effect=_ASKS_DRIVERS, bits=_DRIVER_FLAGS,
    ),
    AxisParameter(
        209, "encoder_position", "encoder position", "RW", POSITION_MIN, POSITION_MAX, 0, "encoder steps", ALL,
        "Counter of the axis's encoder on a TMCM-323.", effect="exchanges a datagram with the encoder module",
        needs=ENCODER,
    ),
    AxisParameter(
        210, "encoder_prescaler", "encoder prescaler", "RWE", INT32_MIN, INT32_MAX, 512, "1/512", ALL,
        "What one encoder edge adds to parameter 209 (512 is 1.0); the low bits select null channel functions.",
        needs=ENCODER,
    ),
    AxisParameter(
        211, "fullstep_threshold", "fullstep threshold", "RWE", 0, 2048, 0, "velocity units", WITH_DRIVERS,
        "Speed above which the drivers do real full steps; 0 or 2048 never.",
    ),
    AxisParameter(
        212, "max_encoder_deviation", "maximum encoder deviation", "RWE", 0, 65535, 0, "microsteps", ALL,
        "The motor is stopped when parameters 1 and 209 differ by more; 0 switches the check off.",
        needs=ENCODER,
    ),
    AxisParameter(
        213, "group_index", "group index", "RW", 0, 255, 0, "", ALL,
        "Motors of one group index do ROR, ROL, MST, MVP and RFS together; 0 is no group.",
    ),
    AxisParameter(
        214, "power_down_delay", "power down delay", "RWE", 1, 65535, 200, "10 ms", WITH_DRIVERS,
        "Time at rest before the current goes down to standby.",
    ),
)  # fmt: skip
"""All axis parameters, by number."""

LATER_AXIS_PARAMETERS: Final[tuple[AxisParameter, ...]] = (
    AxisParameter(
        141, "reference_switch_tolerance", "ref. switch tolerance", "RW", 0, 4095, 0, "microsteps", ALL,
        "Range around position 0 in which the left switch does not stop the motor.", section="",
    ),
    AxisParameter(
        197, "last_reference_position", "last reference position", "R", POSITION_MIN, POSITION_MAX, 0, "microsteps",
        ALL, "Where the reference point was found, counted before it became 0.", section="",
    ),
    AxisParameter(
        200, "boost_current", "boost current", "RWE", 0, 255, 0, "1/255 of the module's maximum", WITH_DRIVERS,
        "Coil current while the speed changes; 0 takes parameter 6.", section="",
    ),
    AxisParameter(
        207, "extended_error_flags", "extended error flags", "R", 0, 3, 0, "bit mask", ALL,
        "Why the motor was stopped: bit 0 stall, bit 1 deviation; 0 again with the next motion command.", section="",
        bits=("stall", "deviation"),
    ),
)  # fmt: skip
"""Axis parameters of later firmware, which a module with the profile "later" has too (fidelity TMCL-18)."""

BY_NUMBER: Final = MappingProxyType({row.number: row for row in AXIS_PARAMETERS})
BY_KEY: Final = MappingProxyType({row.key: row for row in AXIS_PARAMETERS})


def axis_rows(model: int, profile: str) -> tuple[AxisParameter, ...]:
    """The axis parameters of a model with a profile."""
    later = LATER_AXIS_PARAMETERS if profile == LATER else ()
    return tuple(row for row in (*AXIS_PARAMETERS, *later) if model in row.models)
