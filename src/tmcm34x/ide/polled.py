"""The state of a real module as pages get it, made of values that were polled: what was not is marked unknown.

Source: `wire.GROUPS`, which is the layout.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

from tmcm34x.ide.state import Groups, bits, empty, put, unknown
from tmcm34x.tmcl.commands import MOTORS

Values = Mapping[tuple[str, int], int]
"""By the key of a reading and its motor or port."""

_PORTS: Final = 8
_SOURCES: Final = {
    "position": "actual_position", "target": "target_position", "speed": "actual_speed",
    "target_speed": "target_speed", "acceleration": "actual_acceleration", "encoder": "encoder_position",
    "flags": "left_switch", "load": "load_value", "errors": "driver_error_flags", "current": "standby_current",
    "mode": "ramp_mode", "search": "search", "resolution": "microstep_resolution",
    "pulse_div": "pulse_divisor", "ramp_div": "ramp_divisor",
    "angle": "actual_position",
}  # fmt: skip
"""What a motor's state is made of: rows of its group, and the readings that they come from."""
_NEVER_KNOWN: Final = ("slip", "strain", "place")
"""Rows that only a bench has."""
_PROGRAM_SOURCES: Final = {"state": "state", "counter": "counter"}
_REGISTERS: Final = ("depth", "accumulator", "x")
"""Rows of the program that no command reads."""
_LINES: Final = {name: name for name in ("inputs", "outputs", "shutdown")}
STEPPING: Final = 2
"""State of a program that executes single commands, as parameter 128 has it."""
FULLSTEPS: Final = 200
"""Of a turn, for the dials: the usual motor."""


def pack(values: Values, now: float, seen: float, *, connected: bool) -> Groups:
    """The state; `seen` is when the module last sent a value [clocks]."""
    state = empty()
    put(state, "time", now, 1.0, 1.0, bits(False, True, connected))
    program, counter = values.get(("state", 0), 0), values.get(("counter", 0), 0)
    put(state, "program", program & 3, 0, 0, counter & 0xFFFF, 0, 0, 0)
    for motor in range(MOTORS):
        _put_motor(state, values, motor)
    levels = (values.get(("analog", port), 0) & 0xFFFF for port in range(_PORTS))
    lines = (values.get((key, 0), 0) & 0xFF for key in _LINES)
    put(state, "board", *lines, *levels)
    _put_quality(state, values, seen)
    return state


def put_held(state: Groups, counter: int, *, held: bool) -> None:
    """The program goes on in single steps, or is held: between two steps it stands, which is not what is shown."""
    put(state, "program", 0 if held else STEPPING, held, 0, counter & 0xFFFF, 0, 0, 0)


def _put_motor(state: Groups, values: Values, motor: int) -> None:
    def value(key: str) -> int:
        return values.get((key, motor), 0)

    speed, resolution = value("actual_speed"), value("microstep_resolution") & 7
    left, right = value("left_switch") != 0, value("right_switch") != 0
    flags = bits(
        left, right, left, value("position_reached") != 0, value("left_switch_disable") != 0,
        value("right_switch_disable") != 0, True, False,
    )  # fmt: skip
    turn = FULLSTEPS << resolution
    put(
        state, f"motor{motor}", value("actual_position"), value("target_position"), _short(speed),
        _short(value("target_speed")), _short(value("actual_acceleration")), value("encoder_position"), flags,
        value("load_value") & 7, value("driver_error_flags") & 0xFF,
        value("max_current" if speed else "standby_current") & 0xFF, value("ramp_mode") & 3, value("search") & 0xFF,
        resolution, value("pulse_divisor") & 15, value("ramp_divisor") & 15,
        value("actual_position") % turn / turn * 2 * math.pi, 0, 0.0, 0.0,
    )  # fmt: skip


def _put_quality(state: Groups, values: Values, seen: float) -> None:
    """What the module has not said."""

    def missing(keys: Mapping[str, str], number: int = 0) -> list[str]:
        return [row for row, key in keys.items() if (key, number) not in values]

    analog = [f"analog{port}" for port in range(_PORTS) if ("analog", port) not in values]
    motors = [unknown(f"motor{motor}", [*missing(_SOURCES, motor), *_NEVER_KNOWN]) for motor in range(MOTORS)]
    program = unknown("program", [*missing(_PROGRAM_SOURCES), *_REGISTERS])
    put(state, "quality", *motors, program, unknown("board", [*missing(_LINES), *analog]), seen)


def _short(value: int) -> int:
    return max(-32768, min(32767, value))
