"""Interrupts: a flag is set when its condition becomes true (fidelity CHIP-11).

Source: TMC429 datasheet 8.1.12 and 8.2.4.
"""

from __future__ import annotations

from typing import Final

from tmcm34x.chips.ramp import SOFT, RampState
from tmcm34x.chips.registers import DATA
from tmcm34x.chips.tmc429.core import FIELD, INDEX, INTERRUPTS, MOTORS, POS_COMP_INT, Core

POS_END: Final = 1
REF_WRONG: Final = 2
REF_MISS: Final = 4
STOP: Final = 8
STOP_LEFT_LOW: Final = 16
STOP_RIGHT_LOW: Final = 32
STOP_LEFT_HIGH: Final = 64
STOP_RIGHT_HIGH: Final = 128
POS_COMP: Final = 256
"""Not a bit of a motor's register: X_ACTUAL equals POS_COMP."""


def listens(core: Core, motor: int) -> bool:
    """Whether any interrupt is enabled that this motor could cause."""
    return core.words[motor][INTERRUPTS] > 255 or core.common[POS_COMP_INT] > 1


def conditions(core: Core, motor: int, state: RampState) -> int:
    """The conditions that are true of an axis in a state; none where nothing listens."""
    if not listens(core, motor):
        return 0
    axis = core.axes[motor]
    found = STOP if state.stopping else 0
    if state.x == axis.x_target:
        found |= POS_END
    if core.reference(motor):
        if abs(state.x) > axis.dx_ref_tolerance:
            found |= REF_WRONG
    elif state.x == 0:
        found |= REF_MISS
    if compared_motor(core) == motor and state.x & DATA == core.common[INDEX["POS_COMP"]]:
        found |= POS_COMP
    return found


def raise_flags(core: Core, motor: int, before: int) -> None:
    """Set the flags of conditions that have become true, as far as their masks allow."""
    if not listens(core, motor):
        return
    risen = conditions(core, motor, core.state(motor)) & ~before
    if core.axes[motor].mode > SOFT:
        risen &= ~POS_END
    flag(core, motor, risen)
    if risen & POS_COMP:
        core.status = -1
        core.common[POS_COMP_INT] |= 1


def flag(core: Core, motor: int, flags: int) -> None:
    """Set flags as far as their masks allow."""
    words = core.words[motor]
    core.status = -1
    words[INTERRUPTS] |= flags & words[INTERRUPTS] >> 8


def compared_motor(core: Core) -> int:
    """The motor whose position is compared with POS_COMP, if that interrupt is enabled; -1 otherwise."""
    if not core.common[POS_COMP_INT] & FIELD["MASK_POS_COMP"].mask:
        return -1
    return FIELD["POS_COMP_SEL"].get(core.common[INDEX["IF_CONFIGURATION"]])


def compared(core: Core) -> bool:
    """Whether the position compared with POS_COMP equals it."""
    motor = compared_motor(core)
    return motor in MOTORS and core.state(motor).x & DATA == core.common[INDEX["POS_COMP"]]
