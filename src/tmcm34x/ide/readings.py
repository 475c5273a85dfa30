"""What is polled of a real module: the motion of each motor in every round, one other value after the other."""

from __future__ import annotations

from typing import Final, NamedTuple

from tmcm34x.ide import wire
from tmcm34x.ide.sampling import COUNTER, CURVES, OUTPUTS
from tmcm34x.tmcl.axis_parameters import BY_KEY as AXIS_BY_KEY
from tmcm34x.tmcl.commands import BY_MNEMONIC, MOTORS
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.global_parameters import BY_KEY as GLOBAL_BY_KEY

_GAP: Final = BY_MNEMONIC["GAP"].number
_GGP: Final = BY_MNEMONIC["GGP"].number
_GCO: Final = BY_MNEMONIC["GCO"].number
_GIO: Final = BY_MNEMONIC["GIO"].number
_RFS: Final = BY_MNEMONIC["RFS"].number
_RFS_STATUS: Final = 2
_ALL_PORTS: Final = 255
_SHUTDOWN_PORT: Final = 10
_COORDINATE_BANK: Final = -2


class Reading(NamedTuple):
    """A value that is polled, and the command that reads it."""

    key: str
    motor: int
    command: Instruction


def _axis(key: str, motor: int) -> Reading:
    return Reading(key, motor, Instruction(_GAP, AXIS_BY_KEY[key].number, motor))


FAST: Final = tuple(
    _axis(key, motor) for motor in range(MOTORS) for key in ("actual_position", "actual_speed")
)
SLOW: Final = (
    *(
        _axis(key, motor)
        for key in (
            "target_position", "target_speed", "position_reached", "left_switch", "right_switch", "load_value",
            "actual_acceleration", "ramp_mode", "driver_error_flags", "encoder_position", "microstep_resolution",
            "left_switch_disable", "right_switch_disable", "max_current", "standby_current",
            "pulse_divisor", "ramp_divisor",
        )
        for motor in range(MOTORS)
    ),
    *(Reading("search", motor, Instruction(_RFS, _RFS_STATUS, motor)) for motor in range(MOTORS)),
    Reading("state", 0, Instruction(_GGP, GLOBAL_BY_KEY["application_status"].number)),
    Reading("counter", 0, Instruction(_GGP, GLOBAL_BY_KEY["program_counter"].number)),
    Reading("inputs", 0, Instruction(_GIO, _ALL_PORTS, 0)),
    Reading("outputs", 0, Instruction(_GIO, _ALL_PORTS, 2)),
    Reading("shutdown", 0, Instruction(_GIO, _SHUTDOWN_PORT, 0)),
    *(Reading("analog", port, Instruction(_GIO, port, 1)) for port in range(8)),
)  # fmt: skip


def column_of(reading: Reading) -> int | None:
    """The column of a value in the samples for plots, None where it has none."""
    return _OTHERS.get(reading.key) if reading.key in _OTHERS else _CURVES.get((reading.key, reading.motor))


def command_of(item: wire.Watched) -> Instruction | None:
    """The command that reads a watched value; None where there is no such value."""
    if not (0 <= item.number <= 255 and 0 <= item.motor <= 255 and -2 <= item.bank <= 255):
        return None
    if item.bank == _COORDINATE_BANK:
        return Instruction(_GCO, item.number, item.motor)
    return (
        Instruction(_GAP, item.number, item.motor)
        if item.bank < 0
        else Instruction(_GGP, item.number, item.bank)
    )


_OTHERS: Final = {"counter": COUNTER, "outputs": OUTPUTS}
_CURVES: Final = {
    (curve.key, motor): motor * len(CURVES) + index
    for motor in range(MOTORS)
    for index, curve in enumerate(CURVES)
    if curve.key
}
