"""What datagrams read and write: status byte, registers of the motors, common registers, RAM.

Source: TMC429 datasheet 6, 7 and 8.
"""

from __future__ import annotations

from tmcm34x.chips import registers
from tmcm34x.chips.ramp import LAST, SOFT, RampAxis, RampState, v_actual
from tmcm34x.chips.registers import DATA, Register, sign_extended
from tmcm34x.chips.tmc429 import chain, interrupts, switches
from tmcm34x.chips.tmc429.core import (
    A_ACTUAL,
    FIELD,
    INDEX,
    INTERRUPTS,
    POS_COMP_INT,
    REF_CONF_RAMP_MODE,
    USTEP_COUNT,
    V_ACTUAL,
    V_TARGET,
    X_ACTUAL,
    Core,
)
from tmcm34x.clock import NEVER


def ram(core: Core, address: int, data: int, *, reading: bool) -> int:
    """Read or write two cells; returns what is read."""
    if reading:
        return core.ram[2 * address + 1] << 8 | core.ram[2 * address]
    core.ram[2 * address : 2 * address + 2] = bytes((data & 63, data >> 8 & 63))
    chain.resolve(core)
    return 0


def status(core: Core) -> int:
    """The status byte now."""
    status = (core.equal if core.equal >= 0 else _targets(core)) | core.switches & 0b101010
    first, second, third = core.words
    if (first[INTERRUPTS] | second[INTERRUPTS] | third[INTERRUPTS]) & 255 or core.common[POS_COMP_INT] & 1:
        status |= registers.INT
    return status | registers.CDGW if core.cover or core.armed or core.sent else status


def _targets(core: Core) -> int:
    """The status bits of the axes whose X_ACTUAL equals X_TARGET.

    To reach the target is an event, to leave it is none: the bits hold until the next event if the axes that are
    there have none of their own.
    """
    tick, bits, holds = core.tick(), 0, core.due >= 0
    for motor, axis in enumerate(core.axes):
        if axis.position(tick) == axis.x_target:
            bits |= registers.at_target(motor)
            holds = holds and core.marks[motor] == LAST
    core.equal, core.holds = bits, holds
    return bits


def wake(core: Core) -> None:
    """The falling edge of nSCS_C ends the power-down mode."""
    slept = core.now - core.asleep
    core.asleep = NEVER
    core.origin += slept
    if core.flight != NEVER:
        core.flight += slept
    core.due = core.equal = -1
    switches.set_reference_inputs(core, core.levels)


# Registers of a motor


def read_motor(core: Core, motor: int, index: int) -> int:
    """The 24 bits of a register of a motor."""
    axis = core.axes[motor]
    if index == X_ACTUAL:
        return axis.position(core.tick()) & DATA
    if index == V_ACTUAL:
        return v_actual(axis.at(core.tick())) & 0xFFF
    if index == V_TARGET:
        return axis.v_target_read(axis.at(core.tick())) & 0xFFF
    if index == A_ACTUAL:
        return axis.at(core.tick()).a & 0xFFF
    if index == USTEP_COUNT:
        return axis.at(core.tick()).wave & 255 if core.part == "TMC429" else 0
    return core.words[motor][index]


def write_motor(core: Core, motor: int, row: Register, data: int) -> None:
    """Write 24 bits to a register of a motor."""
    words, axis = core.words[motor], core.axes[motor]
    match row.name:
        case "INTERRUPTS":
            mask = data & 0xFF00
            words[INTERRUPTS] = mask | words[INTERRUPTS] & ~data & mask >> 8
            core.replan(motor)
            return
        case "X_LATCHED":
            words[REF_CONF_RAMP_MODE] |= FIELD["LP"].mask
            return
        case "A_ACTUAL" | "USTEP_COUNT":
            return
        case "V_TARGET" if axis.mode <= SOFT:
            return
        case "X_ACTUAL" | "V_ACTUAL":
            pass
        case _:
            data = data & row.writable | words[row.index] & ~row.writable | row.ones
            if data == words[row.index]:
                return
    state = axis.at(core.tick())
    before = interrupts.conditions(core, motor, state)
    words[row.index] = data
    core.cut(motor, _take(core, motor, row.name, data, state))
    interrupts.raise_flags(core, motor, before)
    core.replan(motor)


def _take(core: Core, motor: int, name: str, data: int, state: RampState) -> RampState:
    """Let an axis take what was written into a register; returns the state that it goes on from."""
    axis = core.axes[motor]
    match name:
        case "X_ACTUAL":
            return state.with_position(sign_extended(data, 24))
        case "V_ACTUAL":
            return state.with_velocity(sign_extended(data, 12) << 8)
        case "REF_CONF_RAMP_MODE":
            mode = FIELD["RAMP_MODE"].get(data)
            if mode > SOFT:
                axis.v_target = axis.v_target_read(state)
                core.words[motor][INDEX["V_TARGET"]] = axis.v_target & 0xFFF
            axis.mode = mode
            axis.soft_stop = bool(FIELD["SOFT_STOP"].get(data))
            switches.resolve_stops(core, motor)
        case "I_SCALES_A_THRESHOLD":
            core.derive()
        case _:
            _take_number(axis, name, data)
    return state


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


def _take_number(axis: RampAxis, name: str, data: int) -> None:
    """Let an axis take a register of numbers."""
    match name:
        case "X_TARGET":
            axis.x_target = FIELD["X_TARGET"].get(data)
        case "V_MIN":
            axis.v_min = data
        case "V_MAX":
            axis.v_max = data
        case "V_TARGET":
            axis.v_target = FIELD["V_TARGET"].get(data)
        case "A_MAX":
            axis.a_max = data
        case "PMUL_PDIV":
            axis.pmul, axis.pdiv = FIELD["PMUL"].get(data), FIELD["PDIV"].get(data)
        case "DIVISORS":
            axis.ramp_div, axis.pulse_div = FIELD["RAMP_DIV"].get(data), FIELD["PULSE_DIV"].get(data)
            axis.usrs = FIELD["USRS"].get(data)
        case _:
            axis.dx_ref_tolerance = data
