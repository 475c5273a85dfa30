"""Why a motor does not turn, from what the module says: one line for each reason, with the command that changes it.

Nothing here acts: what has an effect when it is read (driver flags, load) is read only when asked for.

Source: manual 7.1 and 8.1; what each parameter means: fidelity FW.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Final, NamedTuple

from tmcm34x.host.exceptions import DownloadModeError
from tmcm34x.host.reading import Absent, Reading, Refused, Silent, Value
from tmcm34x.host.steps import NUMBERS, SEARCHES, Steps, executing, reading
from tmcm34x.tmcl.axis_parameters import BY_KEY as AXIS_KEYS
from tmcm34x.tmcl.commands import MOTORS
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.global_parameters import BY_KEY as GLOBAL_KEYS

_GAP, _GGP, _GIO = (NUMBERS[name] for name in ("GAP", "GGP", "GIO"))
SHUTDOWN_PORT: Final = 10
_AXIS: Final = (
    "target_position", "actual_position", "actual_speed", "target_speed", "ramp_mode", "max_speed", "max_acceleration",
    "max_current", "left_switch", "right_switch", "left_switch_disable", "right_switch_disable", "position_reached",
    "stall_threshold", "freewheeling", "group_index", "max_encoder_deviation", "encoder_position",
)  # fmt: skip
_DRIVER: Final = ("driver_error_flags", "load_value")
_GLOBAL: Final = ("shutdown_pin", "application_status", "eeprom_lock")
_VELOCITY_MODE: Final = 2


class Reason(NamedTuple):
    """One reason: what it is, the parameter that shows it, and what changes it."""

    text: str
    shown_by: str
    change: str

    @property
    def line(self) -> str:
        """All of it in one line."""
        return f"{self.text} ({self.shown_by}). {self.change}"


class Facts:
    """What a module says about one motor; a value that it did not say is None."""

    def __init__(self, motor: int, readings: dict[str, Reading]) -> None:
        self.motor = motor
        self.readings = readings

    def __getitem__(self, key: str) -> int | None:
        found = self.readings.get(key)
        return found.value if isinstance(found, Value) else None

    def sap(self, key: str, number: int | str) -> str:
        """The command that sets an axis parameter."""
        return f"SAP {AXIS_KEYS[key].number}, {self.motor}, {number}"


def read(motor: int, model: int, *, drivers: bool = False) -> Steps[Facts]:
    """Ask the module; `drivers` also for what makes it exchange datagrams with its motor drivers.

    In download mode it is asked nothing else, because it would store the questions.
    """
    readings: dict[str, Reading] = {}
    try:
        yield from executing()
    except DownloadModeError:
        return Facts(motor, {"download_mode": Value(1)})
    for key in (*_AXIS, *(_DRIVER if drivers else ())):
        row = AXIS_KEYS[key]
        if model in row.models:
            readings[key] = yield from reading(Instruction(_GAP, row.number, motor))
        else:
            readings[key] = Absent(f"a TMCM-{model} has no {row.name}")
    for key in _GLOBAL:
        readings[key] = yield from reading(Instruction(_GGP, GLOBAL_KEYS[key].number))
    readings["search"] = yield from reading(Instruction(NUMBERS["RFS"], SEARCHES["STATUS"], motor))
    readings["shutdown"] = yield from reading(Instruction(_GIO, SHUTDOWN_PORT))
    for other in range(MOTORS):
        group = Instruction(_GAP, AXIS_KEYS["group_index"].number, other)
        readings[f"group_{other}"] = yield from reading(group)
    return Facts(motor, readings)


def reasons(facts: Facts) -> list[Reason]:
    """All reasons, the most likely first; none while the motor turns."""
    if facts["actual_speed"]:
        return []
    return [found for rule in _RULES for found in rule(facts)]


def unknown(facts: Facts) -> list[str]:
    """What the module did not say, a line each: then a reason may be missing."""
    return [
        f"{key}: {found.text}"
        for key, found in facts.readings.items()
        if isinstance(found, (Silent, Refused))
    ]


# Rules, in the order in which the reasons are shown


def _downloading(facts: Facts) -> Iterator[Reason]:
    if facts["download_mode"]:
        yield Reason(
            "The module stores commands instead of executing them",
            "the status of control function 135",
            "`tmcm34x stop` ends download mode.",
        )


def _shutdown(facts: Facts) -> Iterator[Reason]:
    function, level = facts["shutdown_pin"], facts["shutdown"]
    if function and level is not None and level == (1 if function == 1 else 0):
        state = "high" if level else "low"
        yield Reason(
            f"The SHUTDOWN pin is {state}, which stops all motors",
            f"global parameter 80 is {function}, GIO 10, 0 is {level}",
            "Change the level at the pin, or SGP 80, 0, 0.",
        )


def _searching(facts: Facts) -> Iterator[Reason]:
    if facts["search"]:
        yield Reason(
            "A reference search is going on",
            f"RFS STATUS is {facts['search']}",
            f"RFS STOP, {facts.motor} ends it.",
        )


def _at_target(facts: Facts) -> Iterator[Reason]:
    if facts["ramp_mode"] == _VELOCITY_MODE:
        if facts["target_speed"] == 0:
            yield Reason(
                "The target speed is 0: the motor was stopped",
                "axis parameter 2 is 0, 138 is 2",
                f"ROR {facts.motor}, 500 or MVP ABS, {facts.motor}, POSITION starts it.",
            )
    elif facts["actual_position"] is not None and facts["actual_position"] == facts["target_position"]:
        yield Reason(
            "The motor is at its target position",
            f"axis parameters 0 and 1 are {facts['actual_position']}",
            f"MVP ABS, {facts.motor}, POSITION moves it.",
        )


def _zero(key: str, what: str, example: int) -> Callable[[Facts], Iterator[Reason]]:
    def rule(facts: Facts) -> Iterator[Reason]:
        if facts[key] == 0:
            yield Reason(what, f"axis parameter {AXIS_KEYS[key].number} is 0", f"{facts.sap(key, example)}.")

    return rule


def _switch(side: str, direction: int) -> Callable[[Facts], Iterator[Reason]]:
    def rule(facts: Facts) -> Iterator[Reason]:
        if (
            facts[f"{side}_switch"] == 1
            and facts[f"{side}_switch_disable"] == 0
            and _toward(facts) == direction
        ):
            disable = f"{side}_switch_disable"
            yield Reason(
                f"The {side} switch is closed and stops motion to the {side}",
                f"axis parameter {AXIS_KEYS[f'{side}_switch'].number} is 1, {AXIS_KEYS[disable].number} is 0",
                f"Move the other way, or {facts.sap(disable, 1)}.",
            )

    return rule


def _toward(facts: Facts) -> int:
    """The direction in which the motor should turn: 1 right, -1 left, 0 none or not known."""
    target, actual, speed = facts["target_position"], facts["actual_position"], facts["target_speed"]
    if facts["ramp_mode"] == _VELOCITY_MODE:
        return (speed or 0) > 0 or -int((speed or 0) < 0)
    if target is None or actual is None:
        return 0
    return (target > actual) - (target < actual)


def _driver(facts: Facts) -> Iterator[Reason]:
    flags = facts["driver_error_flags"] or 0
    for bit, what in enumerate(AXIS_KEYS["driver_error_flags"].bits):
        if flags >> bit & 1:
            yield Reason(
                f"The motor driver reports {what}",
                f"axis parameter 208 is {flags}",
                "Check the motor's wiring, the supply and the temperature.",
            )


def _stalled(facts: Facts) -> Iterator[Reason]:
    threshold = facts["stall_threshold"]
    if threshold and facts["position_reached"] == 0 and facts["target_speed"] == 0:
        load = f", 206 is {facts['load_value']}" if facts["load_value"] is not None else ""
        yield Reason(
            "Stall detection may have stopped it",
            f"axis parameter 205 is {threshold}{load}",
            f"Raise the threshold or switch it off: {facts.sap('stall_threshold', 0)}.",
        )


def _deviation(facts: Facts) -> Iterator[Reason]:
    limit, actual, encoder = (
        facts["max_encoder_deviation"],
        facts["actual_position"],
        facts["encoder_position"],
    )
    if limit and actual is not None and encoder is not None and abs(actual - encoder) > limit:
        yield Reason(
            f"Position and encoder differ by {abs(actual - encoder)}, which stops the motor",
            f"axis parameter 212 is {limit}",
            f"{facts.sap('encoder_position', actual)} makes them equal.",
        )


def _program(facts: Facts) -> Iterator[Reason]:
    if facts["application_status"] == 1:
        yield Reason(
            "The stand-alone program is running and may stop or move it",
            "global parameter 128 is 1",
            "`tmcm34x stop` stops the program.",
        )


def _group(facts: Facts) -> Iterator[Reason]:
    group = facts["group_index"]
    others = [str(n) for n in range(MOTORS) if n != facts.motor and facts[f"group_{n}"] == group]
    if group and others:
        yield Reason(
            f"Motor {' and '.join(others)} and this one are in group {group}: a command to one is done by all",
            f"axis parameter 213 is {group}",
            f"{facts.sap('group_index', 0)} leaves the group.",
        )


def _freewheeling(facts: Facts) -> Iterator[Reason]:
    delay = facts["freewheeling"]
    if delay:
        yield Reason(
            f"The coils are switched off {delay * 10} ms after a motion: the motor can be turned by hand",
            f"axis parameter 204 is {delay}",
            f"{facts.sap('freewheeling', 0)} keeps the current on.",
        )


def _locked(facts: Facts) -> Iterator[Reason]:
    if facts["eeprom_lock"] == 1:
        yield Reason(
            "The EEPROM is locked: settings that were to be stored were refused",
            "global parameter 73 is 1",
            "SGP 73, 0, 4321 unlocks it.",
        )


_RULES: Final[tuple[Callable[[Facts], Iterator[Reason]], ...]] = (
    _downloading,
    _shutdown,
    _searching,
    _zero("max_speed", "The maximum positioning speed is 0", 500),
    _zero("max_acceleration", "The maximum acceleration is 0", 500),
    _zero("max_current", "The run current is 0", 128),
    _switch("left", -1),
    _switch("right", 1),
    _driver,
    _deviation,
    _stalled,
    _at_target,
    _program,
    _group,
    _freewheeling,
    _locked,
)
