"""WAIT: what a program waits for, as plain values, and whether it is there.

Source: manual 6.7.22; fidelity PROG-12 to PROG-14.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Final, NamedTuple

from tmcm34x.clock import MS, NEVER
from tmcm34x.tmcl.commands import MOTORS, WAIT_TYPES
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.firmware.state import ModuleState
    from tmcm34x.tmcl.datagram import Instruction

TICK: Final = 10 * MS
"""One tick of WAIT (manual 6.7.22)."""

_TICKS, _POS, _REFSW, _LIMSW, _RFS = (
    dict(WAIT_TYPES)[word] for word in ("TICKS", "POS", "REFSW", "LIMSW", "RFS")
)


class Wait(NamedTuple):
    """A WAIT that is being executed."""

    kind: int
    """The command's type: TICKS, POS, REFSW, LIMSW, RFS."""
    motor: int
    limit: int
    """The clock at which it ends anyway, `NEVER` without a time-out."""

    @property
    def conditional(self) -> bool:
        """Whether it waits for something else than time."""
        return self.kind != _TICKS


def _never(_core: ModuleState, _motor: int) -> bool:
    return False


def _reached(core: ModuleState, motor: int) -> bool:
    return core.axes[motor].reached


def _reference_switch(core: ModuleState, motor: int) -> bool:
    return core.axes[motor].left_switch


def _limit_switch(core: ModuleState, motor: int) -> bool:
    return core.axes[motor].left_switch or core.axes[motor].right_switch


def _searched(core: ModuleState, motor: int) -> bool:
    return not core.axes[motor].search


_CONDITIONS: Final[dict[int, Callable[[ModuleState, int], bool]]] = {
    _TICKS: _never,
    _POS: _reached,
    _REFSW: _reference_switch,
    _LIMSW: _limit_switch,
    _RFS: _searched,
}


def begin(instruction: Instruction, now: int) -> Wait | Status:
    """The wait that a WAIT at clock `now` begins, or the status that refuses it."""
    _, kind, motor, ticks = instruction
    if kind not in _CONDITIONS:
        return Status.WRONG_TYPE
    if ticks < 0 or (motor >= MOTORS and kind != _TICKS):
        return Status.INVALID_VALUE
    endless = kind != _TICKS and not ticks
    return Wait(kind, motor, NEVER if endless else now + ticks * TICK)


def fulfilled(core: ModuleState, wait: Wait) -> bool:
    """Whether what is waited for is there."""
    return _CONDITIONS[wait.kind](core, wait.motor)
