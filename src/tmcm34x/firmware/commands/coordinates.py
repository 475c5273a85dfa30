"""SCO, GCO, CCO and ACO: stored positions.

Source: manual 6.7.25 to 6.7.28, 8.1 (84); fidelity FW-60, FW-61.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from tmcm34x.firmware.axis import X_ACTUAL
from tmcm34x.tmcl.commands import COORDINATES, MOTORS, POSITION_MAX, POSITION_MIN
from tmcm34x.tmcl.numbers import GP
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.firmware.state import ModuleState, Result

OK: Final = Status.OK
ALL_COORDINATES: Final = 255
"""Motor of SCO and GCO that copies between RAM and EEPROM."""
ALL_MOTORS: Final = 7
"""Motor of CCO that captures all."""


def coordinate(core: ModuleState, n: int, motor: int) -> int:
    """Coordinate 0 is in RAM, the others where global parameter 84 says."""
    if n and core.eeprom.global_values[GP.COORDINATE_STORAGE]:
        return core.eeprom.coordinates[motor][n - 1]
    return core.coordinates[motor][n]


def _set_coordinates(core: ModuleState, n: int, positions: dict[int, int]) -> Status:
    if any(not POSITION_MIN <= position <= POSITION_MAX for position in positions.values()):
        return Status.INVALID_VALUE
    if n and core.eeprom.global_values[GP.COORDINATE_STORAGE]:
        if core.eeprom.locked:
            return Status.EEPROM_LOCKED
        for motor, position in positions.items():
            core.eeprom.set_coordinate(n, motor, position)
    else:
        for motor, position in positions.items():
            core.coordinates[motor][n] = position
    return OK


def do_sco(core: ModuleState, type_: int, motor: int, value: int) -> Result:
    """SCO: set a coordinate; motor 255 copies one or (0) all from RAM to EEPROM.

    Source: manual 6.7.25; copying: fidelity FW-60.
    """
    if motor == ALL_COORDINATES:
        return _store_coordinates(core, type_), value
    if motor >= MOTORS:
        return Status.INVALID_VALUE, value
    return _set_coordinates(core, type_, {motor: value}), value


def _chosen(n: int) -> range:
    """Coordinate `n` alone, or for 0 all that the EEPROM has."""
    return range(n, n + 1) if n else range(1, COORDINATES)


def _store_coordinates(core: ModuleState, n: int) -> Status:
    if core.eeprom.locked:
        return Status.EEPROM_LOCKED
    for each in _chosen(n):
        for motor, positions in enumerate(core.coordinates):
            core.eeprom.set_coordinate(each, motor, positions[each])
    return OK


def do_gco(core: ModuleState, type_: int, motor: int, value: int) -> Result:
    """GCO: read a coordinate; motor 255 copies one or (0) all from EEPROM to RAM.

    Source: manual 6.7.26; copying: fidelity FW-60.
    """
    if motor == ALL_COORDINATES:
        for positions, stored in zip(core.coordinates, core.eeprom.coordinates, strict=True):
            for each in _chosen(type_):
                positions[each] = stored[each - 1]
        return OK, value
    return (OK, coordinate(core, type_, motor)) if motor < MOTORS else (Status.INVALID_VALUE, 0)


def do_cco(core: ModuleState, type_: int, motor: int, value: int) -> Result:
    """CCO: capture the actual position of a motor, or of all (7).  Source: manual 6.7.27; fidelity FW-61."""
    if MOTORS <= motor < ALL_MOTORS:
        return Status.INVALID_VALUE, value
    axes = core.axes if motor == ALL_MOTORS else (core.axes[motor],)
    return _set_coordinates(core, type_, {axis.motor: axis.read(X_ACTUAL) for axis in axes}), value


def do_aco(core: ModuleState, type_: int, motor: int, value: int) -> Result:
    """ACO: set a coordinate to the accumulator.  Source: manual 6.7.28."""
    return _set_coordinates(core, type_, {motor: core.application.accumulator}), value
