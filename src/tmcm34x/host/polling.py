"""What a display polls of a module: the motion of each motor in every round, one other value after the other.

`Polling` says what to read next and keeps what was read; whoever has the line sends.  Nothing here acts on a motor.

Source: manual 6.7.15 (GIO), 6.7.13 (RFS STATUS), 7.1, 8.1.
"""

from __future__ import annotations

from itertools import cycle, islice
from typing import Final, NamedTuple

from tmcm34x.host.steps import GET_STATUS, NUMBERS, SEARCHES, VERSION
from tmcm34x.tmcl.axis_parameters import BY_KEY as AXIS_BY_KEY
from tmcm34x.tmcl.commands import MOTORS
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.global_parameters import BY_KEY as GLOBAL_BY_KEY
from tmcm34x.tmcl.status import Status

COORDINATE_BANK: Final = -2
"""Stands for the coordinates among banks of global parameters."""
AXIS_BANK: Final = -1
"""Stands for the axis parameters."""
SLOW_PER_ROUND: Final = 3
_ALL_PORTS: Final = 255
_SHUTDOWN_PORT: Final = 10
_ANALOG_PORTS: Final = 8
_NEVER: Final = frozenset({
    Status.INVALID_COMMAND, Status.WRONG_TYPE, Status.INVALID_VALUE, Status.NOT_AVAILABLE,
})  # fmt: skip
"""Answers that will be the same next time."""


class Polled(NamedTuple):
    """A value that is polled, of a motor or port, and the command that reads it."""

    key: str
    motor: int
    command: Instruction


def _axis(key: str, motor: int) -> Polled:
    return Polled(key, motor, Instruction(NUMBERS["GAP"], AXIS_BY_KEY[key].number, motor))


def _global(name: str, key: str) -> Polled:
    return Polled(name, 0, Instruction(NUMBERS["GGP"], GLOBAL_BY_KEY[key].number))


def _port(name: str, port: int, bank: int, index: int = 0) -> Polled:
    return Polled(name, index, Instruction(NUMBERS["GIO"], port, bank))


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
    *(
        Polled("search", motor, Instruction(NUMBERS["RFS"], SEARCHES["STATUS"], motor))
        for motor in range(MOTORS)
    ),
    _global("state", "application_status"),
    _global("counter", "program_counter"),
    _port("inputs", _ALL_PORTS, 0),
    _port("outputs", _ALL_PORTS, 2),
    _port("shutdown", _SHUTDOWN_PORT, 0),
    *(_port("analog", port, 1, port) for port in range(_ANALOG_PORTS)),
)  # fmt: skip


PROBE: Final = Polled("probe", 0, Instruction(GET_STATUS))
"""Refused in download mode, and never stored (fidelity PROG-15)."""
_NEVER_STORED: Final = (PROBE.command, Instruction(VERSION))
"""Executed or refused in download mode (fidelity PROG-15)."""


class Polling:
    """What was read of a module, and what to read next.

    A module in download mode stores what it is asked: another host is loading a program.  Only `PROBE` is asked then.
    """

    def __init__(self) -> None:
        self.loading = False
        """Whether the module was in download mode at the last reply."""
        self.values: dict[tuple[str, int], int] = {}
        """By the key of a value and its motor or port; what the module has not sent is not there."""
        self._refused: set[Instruction] = set()
        self._slow = cycle(SLOW)

    def forget(self) -> None:
        """Another module may be at the other end now."""
        self.values.clear()
        self._refused.clear()
        self.loading = False

    def stored(self, command: Instruction) -> bool:
        """Whether the module would store this command as part of a program instead of answering it."""
        return self.loading and command not in _NEVER_STORED

    def see_mode(self, command: Instruction, status: int) -> None:
        """Take from a reply, status 0 for none, whether the module is in download mode."""
        if status == Status.LOADED or command == PROBE.command:
            self.loading = status != Status.OK

    def due(self) -> list[Polled]:
        """What to read in the next round; what the module has refused for good is left out."""
        if self.loading:
            return [PROBE]
        wanted = [*FAST, *islice(self._slow, SLOW_PER_ROUND)]
        return [polled for polled in wanted if polled.command not in self._refused]

    def take(self, polled: Polled, status: int, value: int) -> bool:
        """What came, status 0 for nothing; whether it is a value."""
        self.see_mode(polled.command, status)
        if status == Status.LOADED or polled is PROBE:
            return False
        if status == Status.OK:
            self.values[polled.key, polled.motor] = value
            return True
        if status in _NEVER:
            self._refused.add(polled.command)
            self.values.pop((polled.key, polled.motor), None)
        return False


def reader(bank: int, number: int, motor: int) -> Instruction | None:
    """The command that reads a parameter or coordinate; None for what no telegram can ask for.

    bank: of a global parameter, or `AXIS_BANK` or `COORDINATE_BANK`
    """
    if not (0 <= number <= 255 and 0 <= motor <= 255 and COORDINATE_BANK <= bank <= 255):
        return None
    mnemonic = {COORDINATE_BANK: "GCO", AXIS_BANK: "GAP"}.get(bank, "GGP")
    return Instruction(NUMBERS[mnemonic], number, motor if bank < 0 else bank)
