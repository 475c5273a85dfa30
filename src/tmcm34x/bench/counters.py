"""What has happened to the modules of a bench since counting began, in figures.

Refused commands by their status, telegrams with a wrong sum among them, of hosts and of programs; writes of EEPROM
cells, which wear; full steps that each motor has lost; commands that were accepted and moved nothing.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

from tmcm34x.firmware.changes import Cell
from tmcm34x.tmcl.status import STATUS_TEXTS

if TYPE_CHECKING:
    from tmcm34x.bench.rig import Rig
    from tmcm34x.bench.world import World
    from tmcm34x.firmware.changes import EepromWrite
    from tmcm34x.firmware.module import FirmwareModule

WITHOUT_EFFECT: Final = {
    "no_speed": "moves with a largest speed of 0 (axis parameter 4)",
    "no_positioning": "target positions set in velocity mode (axis parameter 0)",
}
"""Events of the firmware for commands that are accepted and move nothing, and what they mean."""


class ModuleCounters:
    """The figures of one module: a listener of it, its program and its EEPROM, to whom good telegrams are nothing."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._module: FirmwareModule = world.module
        self.refused: Counter[int] = Counter()
        self.writes: Counter[str] = Counter()
        self.without_effect: Counter[str] = Counter()
        self._module.on_refusal.append(self._refuse)
        self._module.on_event.append(self._happened)
        self._module.eeprom.listeners.append(self._written)
        self._module.program.on_refusal.append(self._program_refused)

    def _happened(self, kind: str) -> None:
        if kind in WITHOUT_EFFECT:
            self.without_effect[kind] += 1

    def figures(self) -> dict[str, Any]:
        """All of them, as JSON takes them."""
        return {
            "refused": {
                f"{status} {STATUS_TEXTS.get(status, '')}".strip(): n for status, n in self.refused.items()
            },
            "eeprom_writes": dict(self.writes),
            "without_effect": dict(self.without_effect),
            "lost_fullsteps": [round(mount.view().lost_fullsteps, 2) for mount in self._world.mounts],
        }

    def notes(self) -> list[str]:
        """EEPROM writes and commands without effect, in words."""
        writes = self.writes
        notes = [
            f"{_count(writes.total(), 'EEPROM write')}, {n} of them to {cell}"
            for cell, n in writes.most_common(1)
        ]
        return [*notes, *(f"{WITHOUT_EFFECT[kind]}: {n}" for kind, n in self.without_effect.items())]

    def _refuse(self, status: int) -> None:
        self.refused[status] += 1

    def _program_refused(self) -> bool:
        """The program goes on as it would."""
        error = self._module.program.last_error
        if error is not None:
            self.refused[error.status] += 1
        return False

    def _written(self, changes: Sequence[EepromWrite]) -> None:
        self.writes.update(map(_cell_name, changes))


def _cell_name(change: EepromWrite) -> str:
    """What a write is of: `global_parameter 68`, `axis_parameter 4 of motor 0`."""
    name = change.cell.name.lower()
    if change.cell in _WHOLE:
        return name
    return f"{name} {change.number}{f' of motor {change.motor}' if change.cell in _OF_MOTORS else ''}"


_OF_MOTORS: Final = frozenset({Cell.AXIS_PARAMETER, Cell.COORDINATE})
_WHOLE: Final = frozenset({Cell.PROGRAM_ERASED, Cell.DEFAULTS})
"""Writes of more than one cell."""


class Counters:
    """The figures of all modules of a bench."""

    def __init__(self, rig: Rig) -> None:
        self.modules = [ModuleCounters(world) for world in rig.worlds]

    def figures(self) -> list[dict[str, Any]]:
        """Those of each module, in the order of the bench."""
        return [module.figures() for module in self.modules]

    def lines(self) -> list[str]:
        """What is worth knowing at the end of a run, in words."""
        return [line for number, module in enumerate(self.modules) for line in _lines(number, module)]


def _lines(number: int, module: ModuleCounters) -> list[str]:
    figures = module.figures()
    parts = [
        f"{_count(count, 'command')} refused with {status}" for status, count in figures["refused"].items()
    ]
    parts += module.notes()
    parts += [
        f"motor {motor} has lost {abs(lost):g} full steps"
        for motor, lost in enumerate(figures["lost_fullsteps"])
        if abs(lost) >= 1
    ]
    return [f"module {number}: {part}" for part in parts]


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"
