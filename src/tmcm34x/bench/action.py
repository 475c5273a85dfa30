"""What can be done to a bench from outside, as plain values.

An `Action` can be stored, sent over a socket and done again at the same clock of another run: bench files, session
files, the control socket, the page and the history all use this one table.  Telegrams are not actions; they reach a
module through its ports.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from tmcm34x.bench.world import SHUTDOWN, World
from tmcm34x.board.board import ANALOG_MAX, SELECTS
from tmcm34x.chips.tmc246 import FAULTS
from tmcm34x.tmcl.commands import MOTORS
from tmcm34x.world.device import Constant, Previous

if TYPE_CHECKING:
    from tmcm34x.board.circuit import SpiDevice

Value = int | float | str | bool | None
Accept = Callable[[Any], bool]


class ActionError(ValueError):
    """An action that the bench cannot do; one line."""


class Action(NamedTuple):
    """One operation on a bench: a key of `ACTIONS`, the module's index, and the operands of the row."""

    name: str
    module: int
    operands: tuple[Value, ...]


class ActionOperand(NamedTuple):
    """One operand of an action: what it means, and which values it takes."""

    name: str
    meaning: str
    accept: Accept


class ActionRow(NamedTuple):
    """An action: its operands in order, what it does, and the method of the world that does it."""

    meaning: str
    operands: tuple[ActionOperand, ...]
    do: Callable[..., None]


def _whole(low: int, high: int) -> Accept:
    return lambda value: type(value) is int and low <= value <= high


def _one_of(*words: str) -> Accept:
    return lambda value: value in words


def _number(value: object) -> bool:
    return type(value) in {int, float}


def _switched(value: object) -> bool:
    return type(value) is bool


def _level(value: object) -> bool:
    return value is None or _whole(0, ANALOG_MAX)(value)


def _held(value: object) -> bool:
    return value is None or type(value) is bool


_MOTOR: Final = ActionOperand("motor", f"motor 0..{MOTORS - 1}", _whole(0, MOTORS - 1))
_SIDE: Final = ActionOperand("side", "left or right", _one_of("left", "right"))
_ON: Final = ActionOperand("on", "true or false", _switched)


def _previous(value: int) -> SpiDevice:
    del value
    return Previous()


_DEVICES: Final[Mapping[str, Callable[[int], SpiDevice]]] = {"previous": _previous, "constant": Constant}


def _attach(world: World, select: int, device: str, value: int) -> None:
    world.module.board.attach_spi(select, _DEVICES[device](value))


ACTIONS: Final[Mapping[str, ActionRow]] = {
    "switch": ActionRow(
        "hold a switch line active or inactive, or give it back to its switches",
        (_MOTOR, _SIDE, ActionOperand("active", "true, false or null", _held)),
        World.set_switch,
    ),
    "unplug": ActionRow("break the cable of a switch line, or mend it", (_MOTOR, _SIDE, _ON), World.unplug),
    "level": ActionRow(
        "hold an input at a level, or give it back to its source",
        (
            ActionOperand("input", f"input 0..7, or {SHUTDOWN} for SHUTDOWN", _whole(0, SHUTDOWN)),
            ActionOperand("level", f"0..{ANALOG_MAX}, or null (on the command line: auto)", _level),
        ),
        World.set_level,
    ),
    "fault": ActionRow(
        "raise or end a fault of a driver",
        (_MOTOR, ActionOperand("fault", f"one of {', '.join(FAULTS)}", _one_of(*FAULTS)), _ON),
        World.set_fault,
    ),
    "push": ActionRow(
        "load a shaft with a torque; a positive torque pushes toward lower positions",
        (_MOTOR, ActionOperand("torque_nm", "torque in newton metres", _number)),
        World.push,
    ),
    "move": ActionRow(
        "take a load to a position by force",
        (_MOTOR, ActionOperand("position", "position in millimetres or degrees", _number)),
        World.move,
    ),
    "spi": ActionRow(
        "put a device on a select line of the SPI bus, instead of what is there",
        (
            ActionOperand("select", f"select line 0..{SELECTS - 1}", _whole(0, SELECTS - 1)),
            ActionOperand(
                "device",
                "previous, which answers with the previous transfer, or constant",
                _one_of(*_DEVICES),
            ),
            ActionOperand("value", "what constant answers, 32 bits", _whole(0, 0xFFFF_FFFF)),
        ),
        _attach,
    ),
    "power": ActionRow("switch the supply of the module", (_ON,), World.set_power),
}
"""Every action by name; the operands of a row are those of the world's method."""


def check(worlds: Sequence[World], action: Action) -> None:
    """Raise `ActionError` where a bench of `worlds` cannot do `action`: nothing is changed then."""
    row = ACTIONS.get(action.name)
    if row is None:
        raise ActionError(f"no action {action.name!r}; there are {', '.join(ACTIONS)}")
    if not 0 <= action.module < len(worlds):
        raise ActionError(f"no module {action.module}; the bench has {len(worlds)}")
    if len(action.operands) != len(row.operands):
        names = ", ".join(operand.name for operand in row.operands)
        raise ActionError(f"{action.name} takes {names}")
    for operand, value in zip(row.operands, action.operands, strict=True):
        if not operand.accept(value):
            raise ActionError(f"{action.name}: {operand.name} is {operand.meaning}, not {value!r}")
    if action.name == "fault" and worlds[action.module].module.board.model.drivers is None:
        raise ActionError(f"a {worlds[action.module].module.board.model.name} has no drivers to fail")


def perform(worlds: Sequence[World], action: Action) -> None:
    """Do `action` at the present clock of the bench; raises `ActionError`."""
    check(worlds, action)
    ACTIONS[action.name].do(worlds[action.module], *action.operands)
