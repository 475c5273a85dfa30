"""What datagrams read and write: status byte, registers of the motors, common registers, RAM.

Source: TMC429 datasheet 6, 7 and 8.
"""

from __future__ import annotations

from typing import Final

from tmcm34x.chips import registers
from tmcm34x.chips.ramp import LAST, SOFT, RampAxis, RampState, v_actual
from tmcm34x.chips.registers import BY_INDEX, DATA, MOTOR, Register, sign_extended
from tmcm34x.chips.tmc429 import chain, interrupts, switches
from tmcm34x.chips.tmc429.core import (
    A_ACTUAL,
    A_MAX,
    DIVISORS,
    DX_REF_TOLERANCE,
    FIELD,
    I_SCALES,
    INDEX,
    INTERRUPTS,
    PMUL_PDIV,
    POS_COMP_INT,
    REF_CONF_RAMP_MODE,
    USTEP_COUNT,
    V_ACTUAL,
    V_MAX,
    V_MIN,
    V_TARGET,
    X_ACTUAL,
    X_LATCHED,
    X_TARGET,
    Core,
)
from tmcm34x.clock import NEVER

_MOTOR: Final = {index: row for (area, index), row in BY_INDEX.items() if area == MOTOR}
_WRITABLE: Final = {index: row.writable for index, row in _MOTOR.items()}
"""The bits of each register of a motor that keep what is written."""
_ACTING: Final = frozenset({INTERRUPTS, X_LATCHED, A_ACTUAL, USTEP_COUNT})
"""Registers of a motor in which what is written is not kept."""
_MOVING: Final = frozenset({X_ACTUAL, V_ACTUAL})
"""Registers that change by themselves: whatever is written is new."""
_LIVING: Final = frozenset({X_ACTUAL, V_TARGET, V_ACTUAL, A_ACTUAL, USTEP_COUNT})
"""Registers of a motor in which something else is read than what was written last."""
_NUMBERS: Final = {
    V_MIN: (("v_min", FIELD["V_MIN"]),),
    V_MAX: (("v_max", FIELD["V_MAX"]),),
    V_TARGET: (("v_target", FIELD["V_TARGET"]),),
    A_MAX: (("a_max", FIELD["A_MAX"]),),
    PMUL_PDIV: (("pmul", FIELD["PMUL"]), ("pdiv", FIELD["PDIV"])),
    DIVISORS: (("ramp_div", FIELD["RAMP_DIV"]), ("pulse_div", FIELD["PULSE_DIV"]), ("usrs", FIELD["USRS"])),
    DX_REF_TOLERANCE: (("dx_ref_tolerance", FIELD["DX_REF_TOLERANCE"]),),
}
"""Attributes of an axis that a register sets, with the register's fields, by its index."""


def ram(core: Core, address: int, data: int, *, reading: bool) -> int:
    """Read or write two cells; returns what is read."""
    if reading:
        return core.ram[2 * address + 1] << 8 | core.ram[2 * address]
    core.ram[2 * address : 2 * address + 2] = bytes((data & 63, data >> 8 & 63))
    chain.resolve(core)
    return 0


def status(core: Core) -> int:
    """The status byte now, looked up where nothing has changed since it was asked for last."""
    if core.status < 0:
        status = _targets(core) | core.switches & 0b101010
        first, second, third = core.words
        if (first[INTERRUPTS] | second[INTERRUPTS] | third[INTERRUPTS]) & 255 or core.common[
            POS_COMP_INT
        ] & 1:
            status |= registers.INT
        core.status = status | registers.CDGW if core.cover or core.armed or core.sent else status
    return core.status


def _targets(core: Core) -> int:
    """The status bits of the axes whose X_ACTUAL equals X_TARGET.

    To reach the target is an event, to leave it is none: an axis that is elsewhere stays so until its next event, and
    one that is there does if it has no event of its own.  The bits hold until the next event if all axes stay.
    """
    tick, bits, holds = core.tick(), 0, core.due >= 0
    marks, stays = core.marks, core.stays
    for motor, axis in enumerate(core.axes):
        place = stays[motor]
        if place is None or tick >= marks[motor]:
            place = axis.position(tick) == axis.x_target
            lasting = not place or marks[motor] == LAST
            stays[motor] = place if lasting else None
            holds = holds and lasting
        if place:
            bits |= 1 << 2 * motor
    core.holds = holds
    return bits


def wake(core: Core) -> None:
    """The falling edge of nSCS_C ends the power-down mode."""
    slept = core.now - core.asleep
    core.asleep = NEVER
    core.origin += slept
    if core.flight != NEVER:
        core.flight += slept
    core.due = core.status = -1
    switches.set_reference_inputs(core, core.levels)


# Registers of a motor


def read_motor(core: Core, motor: int, index: int) -> int:
    """The 24 bits of a register of a motor."""
    axis = core.axes[motor]
    if index == V_ACTUAL:
        return v_actual(axis.velocity(core.tick())) & 0xFFF
    if index not in _LIVING:
        return core.words[motor][index]
    if index == X_ACTUAL:
        return axis.position(core.tick()) & DATA
    if index == V_TARGET:
        return axis.v_target_read(axis.at(core.tick())) & 0xFFF
    if index == A_ACTUAL:
        return axis.at(core.tick()).a & 0xFFF
    return axis.at(core.tick()).wave & 255 if core.part == "TMC429" else 0


def write_motor(core: Core, motor: int, index: int, data: int) -> None:
    """Write 24 bits to a register of a motor; a part that has no such register takes nothing."""
    if index in _ACTING:
        _act(core, motor, index, data)
        return
    if index not in _WRITABLE or (index == V_TARGET and core.axes[motor].mode <= SOFT):
        return
    words = core.words[motor]
    if index not in _MOVING:
        writable = _WRITABLE[index]
        data = data & writable | words[index] & ~writable | _MOTOR[index].ones
        if data == words[index]:
            return
    state = core.axes[motor].at(core.tick())
    before = interrupts.conditions(core, motor, state)
    words[index] = data
    core.cut(motor, _take(core, motor, index, data, state))
    interrupts.raise_flags(core, motor, before)
    core.replan(motor)


def _act(core: Core, motor: int, index: int, data: int) -> None:
    """A write to a register that keeps no data, or not those written."""
    words = core.words[motor]
    if index == INTERRUPTS:
        mask = data & 0xFF00
        words[INTERRUPTS] = mask | words[INTERRUPTS] & ~data & mask >> 8
        core.replan(motor)
    elif index == X_LATCHED:
        words[REF_CONF_RAMP_MODE] |= FIELD["LP"].mask


def _take(core: Core, motor: int, index: int, data: int, state: RampState) -> RampState:
    """Let an axis take what was written into a register; returns the state that it goes on from."""
    axis = core.axes[motor]
    if index == X_TARGET:
        axis.x_target = sign_extended(data, 24)
    elif index == X_ACTUAL:
        return state.with_position(sign_extended(data, 24))
    elif index == V_ACTUAL:
        return state.with_velocity(sign_extended(data, 12) << 8)
    elif index == REF_CONF_RAMP_MODE:
        _take_mode(core, motor, data, state)
    elif index == I_SCALES:
        core.derive()
    else:
        _take_number(axis, index, data)
    return state


def _take_mode(core: Core, motor: int, data: int, state: RampState) -> None:
    """Let an axis take its ramp mode and what its reference switches do."""
    axis = core.axes[motor]
    mode = FIELD["RAMP_MODE"].get(data)
    if mode > SOFT:
        axis.v_target = axis.v_target_read(state)
        core.words[motor][V_TARGET] = axis.v_target & 0xFFF
    axis.mode = mode
    axis.derive()
    axis.soft_stop = bool(FIELD["SOFT_STOP"].get(data))
    switches.resolve_stops(core, motor)


# Common registers


def read_common(core: Core, index: int) -> int:
    """The 24 bits of a common register."""
    if index == INDEX["SWITCHES"]:
        return core.switches
    word = core.common[index]
    if index != INDEX["COVER_POSITION_LEN"]:
        return word
    field = FIELD["COVER_POSITION"]
    waiting = core.cover or core.sent & chain.COVER != 0
    return FIELD["CW"].put(field.put(word, field.get(word) + 1), waiting)


def write_common(core: Core, row: Register, data: int) -> None:
    """Write 24 bits to a common register."""
    name, index = row.name, row.index
    compared = interrupts.compared(core)
    match name:
        case "DATAGRAM_LOW_WORD" | "DATAGRAM_HIGH_WORD":
            core.armed = True
        case "POS_COMP_INT":
            mask = data & FIELD["MASK_POS_COMP"].mask
            core.common[index] = mask | core.common[index] & ~data & mask >> 8
        case "POWER_DOWN":
            core.asleep = core.now
        case _:
            core.common[index] = data & row.writable | core.common[index] & ~row.writable
    match name:
        case "COVER_DATAGRAM":
            core.cover = True
            chain.send(core)
        case "IF_CONFIGURATION" | "SMGP":
            switches.set_reference_inputs(core, core.levels)
            chain.resolve(core)
        case _:
            pass
    core.replan_all()
    if name in {"POS_COMP", "IF_CONFIGURATION"} and interrupts.compared(core) and not compared:
        core.common[POS_COMP_INT] |= 1
        core.status = -1


def _take_number(axis: RampAxis, index: int, data: int) -> None:
    """Let an axis take a register of numbers."""
    for name, field in _NUMBERS[index]:
        setattr(axis, name, field.get(data))
    axis.derive()
