"""What has happened to the modules of a server since it began, in figures.

Refused commands by their status, telegrams with a wrong sum among them; writes of EEPROM cells, which wear; full steps
that each motor has lost; commands that were accepted and changed nothing: MVP while the largest speed is 0.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

from tmcm34x.tmcl.commands import BY_MNEMONIC
from tmcm34x.tmcl.datagram import unpack_can_reply, unpack_can_request, unpack_reply, unpack_request
from tmcm34x.tmcl.status import STATUS_TEXTS, Status

if TYPE_CHECKING:
    from tmcm34x.bench import Rig
    from tmcm34x.bench.world import World
    from tmcm34x.firmware.changes import Change
    from tmcm34x.firmware.module import Module

MAX_SPEED: Final = 4
"""Axis parameter: the largest speed of a move."""
_MVP: Final = BY_MNEMONIC["MVP"].number
_GOOD: Final = frozenset({Status.OK, Status.LOADED, Status.POSITION_REACHED})


class ModuleCounters:
    """The figures of one module: an observer of it and a listener of its EEPROM."""

    instruction = None

    def __init__(self, world: World) -> None:
        self._world = world
        self._module: Module = world.module
        self.refused: Counter[int] = Counter()
        self.writes: Counter[str] = Counter()
        self.without_effect = 0
        self._module.observers.append(self)
        self._module.eeprom.listeners.append(self._written)

    def telegram(self, port: object, direction: str, data: bytes, now: int) -> None:
        """Bytes come in or go out."""
        del port, now
        if direction == "out":
            status = _status(data)
            if status is not None and status not in _GOOD:
                self.refused[status] += 1
        elif self._changes_nothing(data):
            self.without_effect += 1

    def event(self, kind: str, motor: int, now: int) -> None:
        """Nothing to count."""

    def figures(self) -> dict[str, Any]:
        """All of them, as JSON takes them."""
        return {
            "refused": {
                f"{status} {STATUS_TEXTS.get(status, '')}".strip(): n for status, n in self.refused.items()
            },
            "eeprom_writes": dict(self.writes),
            "without_effect": self.without_effect,
            "lost_fullsteps": [round(mount.view().lost_fullsteps, 2) for mount in self._world.mounts],
        }

    def _written(self, changes: Sequence[Change]) -> None:
        for cell, motor, number, _ in changes:
            self.writes[f"{cell.name.lower()} {motor} {number}"] += 1

    def _changes_nothing(self, data: bytes) -> bool:
        try:
            asked = unpack_request(data)[1] if len(data) == 9 else unpack_can_request(data)
        except ValueError:
            return False
        axes = self._module.axes
        return (
            asked.number == _MVP
            and asked.motor < len(axes)
            and not axes[asked.motor].values.get(MAX_SPEED, 1)
        )


def _status(data: bytes) -> int | None:
    try:
        return (unpack_reply(data) if len(data) == 9 else unpack_can_reply(data)).status
    except ValueError:
        return None


class Counters:
    """The figures of all modules of a bench."""

    def __init__(self, rig: Rig) -> None:
        self.modules = [ModuleCounters(world) for world in rig.worlds]

    def figures(self) -> list[dict[str, Any]]:
        """Those of each module, in the order of the bench."""
        return [module.figures() for module in self.modules]

    def lines(self) -> list[str]:
        """What is worth telling a person."""
        return [line for number, module in enumerate(self.modules) for line in _lines(number, module)]


def _lines(number: int, module: ModuleCounters) -> list[str]:
    figures = module.figures()
    parts = [f"{count} commands refused with {status}" for status, count in figures["refused"].items()]
    if module.writes:
        cell, most = module.writes.most_common(1)[0]
        parts.append(f"{module.writes.total()} EEPROM writes, {most} of them to {cell}")
    if module.without_effect:
        parts.append(f"{module.without_effect} moves with a largest speed of 0")
    parts += [
        f"motor {motor} has lost {abs(lost):g} full steps"
        for motor, lost in enumerate(figures["lost_fullsteps"])
        if abs(lost) >= 1
    ]
    return [f"module {number}: {part}" for part in parts]
