"""Steps of the arrows: presses in quick succession add up, also while the motor is still on its way.

The module counts MVP REL from where the motor is, so that a step sent to a moving motor would be cut short.  While a
motor is on its way to where the steps before have sent it, a further one moves the target position (axis parameter 0)
on instead, which starts no motor: where anything else has taken the motor, the parameter has no effect.

Source: manual 6.7.4, 7.1 (0, 1, 10 to 13, 138, 213); fidelity FW-21, FW-25.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Final

from tmcm34x.host import commands
from tmcm34x.host.polling import AXIS_BANK
from tmcm34x.ide import wire
from tmcm34x.tmcl.axis_parameters import BY_KEY
from tmcm34x.tmcl.commands import MOTORS
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.ide.target import Target

_TARGET: Final = "target_position"
_LOOKED_AT: Final = (
    _TARGET, "actual_position", "ramp_mode", "group_index", "left_switch", "left_switch_disable", "right_switch",
    "right_switch_disable",
)  # fmt: skip
_POSITION_MODE: Final = 0

Facts = Mapping[str, int | None]
"""Axis parameters by key; None is not known."""


class Strides:
    """Steps of the motors of `target`; `permit` refuses a command that may not be sent now, and takes its motors."""

    def __init__(self, target: Target, permit: Callable[[Instruction], None]) -> None:
        self._target = target
        self._permit = permit
        self._due: dict[int, int] = {}
        """Steps that are not sent yet [microsteps]."""
        self._goals: dict[int, int] = {}
        """Where steps have sent a motor that nothing else has taken since."""
        self._turns = [asyncio.Lock() for _ in range(MOTORS)]

    def drop(self, *motors: int) -> None:
        """Something else has these motors now: what is not sent is over."""
        for motor in motors:
            self._due.pop(motor, None)
            self._goals.pop(motor, None)

    async def step(self, motor: int, distance: int) -> None:
        """Move a motor by so many microsteps more.  Raises `wire.RefusalError`."""
        self._due[motor] = self._due.get(motor, 0) + distance
        async with self._turns[motor]:
            if motor in self._due:
                await self._send(motor, await self._goal(motor))

    async def _goal(self, motor: int) -> int | None:
        """Where the motor is on its way to because of steps, None where that cannot be counted on."""
        goal = self._goals.get(motor)
        if goal is None:
            return None
        return goal if _counts(await self._read(motor, _LOOKED_AT), goal) else None

    async def _send(self, motor: int, goal: int | None) -> None:
        distance = self._due.pop(motor, 0)
        if not distance:
            return
        instruction = (
            commands.move_by(motor, distance)
            if goal is None
            else commands.set_axis(_TARGET, motor, goal + distance)
        )
        self._permit(instruction)
        exchange = await self._target.exchange(instruction)
        if exchange.status != Status.OK:
            raise wire.RefusalError("module", f"{exchange.text}: {exchange.meaning}.")
        target = (await self._read(motor, (_TARGET,)))[_TARGET] if goal is None else goal + distance
        if target is not None:
            self._goals[motor] = target

    async def _read(self, motor: int, keys: tuple[str, ...]) -> Facts:
        items = [wire.Watched(AXIS_BANK, BY_KEY[key].number, motor) for key in keys]
        values = await self._target.read(items)
        if None in values:  # a reply was lost
            values = await self._target.read(items)
        return dict(zip(keys, values, strict=True))


def _counts(facts: Facts, goal: int) -> bool:
    """Whether the motor is on its way to `goal` or there, alone and with nothing in its way."""
    if None in facts.values():
        return False
    going = facts[_TARGET] == goal and facts["ramp_mode"] == _POSITION_MODE
    return going and not facts["group_index"] and not _blocked(facts, goal)


def _blocked(facts: Facts, goal: int) -> bool:
    """A closed switch keeps the motor from `goal`."""
    side = "left" if goal < (facts["actual_position"] or 0) else "right"
    away = goal != facts["actual_position"]
    return away and bool(facts[f"{side}_switch"]) and not facts[f"{side}_switch_disable"]
