"""ROR, ROL, MST, MVP and RFS.

Motors of one group index (axis parameter 213) do these together; each motion command ends a reference search.

Source: manual 6.7.1 to 6.7.4, 6.7.13; fidelity FW-20 to FW-26.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from tmcm34x.firmware import motion, reference
from tmcm34x.firmware.axis import X_ACTUAL
from tmcm34x.firmware.commands.coordinates import coordinate
from tmcm34x.tmcl.commands import COORDINATES, MOTORS, MOVE_TYPES, POSITION_MAX, POSITION_MIN, RFS_TYPES
from tmcm34x.tmcl.numbers import AP
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.firmware.axis import AxisState
    from tmcm34x.firmware.state import ModuleState, Result

OK: Final = Status.OK
_REL, _COORD = (dict(MOVE_TYPES)[word] for word in ("REL", "COORD"))
_START, _STATUS = (dict(RFS_TYPES)[word] for word in ("START", "STATUS"))
TOGETHER: Final = 0x80
INTERPOLATED: Final = 0x40
"""Bits of MVP COORD's motor field that make a mask of the others."""


def _group(core: ModuleState, motor: int) -> list[AxisState]:
    """All motors that do what `motor` does: those of its group index, unless that is 0."""
    axis = core.axes[motor]
    group = axis.values[AP.GROUP_INDEX]
    if not group:
        return [axis]
    return [each for each in core.axes if each.values[AP.GROUP_INDEX] == group]


def _free(axis: AxisState) -> None:
    """A motion command ends a reference search (fidelity FW-26), and what parameter 207 of later firmware tells."""
    reference.abort(axis)
    if AP.EXTENDED_ERROR_FLAGS in axis.values:
        axis.values[AP.EXTENDED_ERROR_FLAGS] = 0


def do_ror(core: ModuleState, _type: int, motor: int, value: int) -> Result:
    """ROR: turn toward rising positions.  Source: manual 6.7.1."""
    for axis in _group(core, motor):
        _free(axis)
        motion.rotate(core, axis, value)
    return OK, value


def do_rol(core: ModuleState, _type: int, motor: int, value: int) -> Result:
    """ROL: turn toward falling positions.  Source: manual 6.7.2."""
    for axis in _group(core, motor):
        _free(axis)
        motion.rotate(core, axis, -value)
    return OK, value


def do_mst(core: ModuleState, _type: int, motor: int, value: int) -> Result:
    """MST: come to rest along the ramp.  Source: manual 6.7.3; fidelity FW-22."""
    for axis in _group(core, motor):
        _free(axis)
        motion.stop(core, axis)
    return OK, value


def do_mvp(core: ModuleState, type_: int, motor: int, value: int) -> Result:
    """MVP: go to a position, by an offset, or to a coordinate.

    Source: manual 6.7.4; the reply echoes the command's value, fidelity FW-5.
    """
    if type_ == _COORD and motor & (TOGETHER | INTERPOLATED):
        status = _move_together(core, motor, value)
    elif motor >= MOTORS:
        status = Status.INVALID_VALUE
    else:
        status = _move_group(core, type_, _group(core, motor), value)
    return status, value


def _move_group(core: ModuleState, type_: int, axes: list[AxisState], value: int) -> Status:
    if type_ == _COORD:
        if not 0 <= value < COORDINATES:
            return Status.INVALID_VALUE
        targets = [coordinate(core, value, axis.motor) for axis in axes]
    elif type_ == _REL:
        targets = [axis.read(X_ACTUAL) + value for axis in axes]
    else:
        targets = [value] * len(axes)
    if min(targets) < POSITION_MIN or max(targets) > POSITION_MAX:
        return Status.INVALID_VALUE
    for axis, target in zip(axes, targets, strict=True):
        _free(axis)
        motion.move_to(core, axis, target)
    return OK


def _move_together(core: ModuleState, field: int, n: int) -> Status:
    mask = field & ~(TOGETHER | INTERPOLATED)
    both = field & TOGETHER and field & INTERPOLATED
    if both or not 0 < mask < 1 << MOTORS or not 0 <= n < COORDINATES:
        return Status.INVALID_VALUE
    targets = [(axis, coordinate(core, n, axis.motor)) for axis in core.axes if mask >> axis.motor & 1]
    for axis, _ in targets:
        _free(axis)
    if field & INTERPOLATED:
        motion.move_interpolated(core, targets)
    else:
        for axis, target in targets:
            motion.move_to(core, axis, target)
    return OK


def do_rfs(core: ModuleState, type_: int, motor: int, value: int) -> Result:
    """RFS: start or abort a reference search, or tell its state.  Source: manual 6.7.13."""
    if type_ == _STATUS:
        return OK, core.axes[motor].search
    for axis in _group(core, motor):
        if type_ == _START:
            reference.start(core, axis)
        else:
            reference.stop(core, axis)
    return OK, value
