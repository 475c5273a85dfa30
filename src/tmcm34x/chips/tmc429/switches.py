"""Reference switches: from the input lines to what the axes do.

Source: TMC429 datasheet 8.1.11, 8.2.4.5 and 9.
"""

from __future__ import annotations

from tmcm34x.chips.registers import DATA
from tmcm34x.chips.tmc429 import interrupts
from tmcm34x.chips.tmc429.core import FIELD, INDEX, MOTORS, REF_CONF_RAMP_MODE, Core
from tmcm34x.clock import NEVER


def set_reference_inputs(core: Core, levels: int) -> None:
    """Set the input lines, in the order of the SWITCHES register."""
    core.levels = levels
    if core.asleep != NEVER:
        return
    behind = multiplexed(core)
    unsampled = behind and levels != core.sampled
    if unsampled != core.unsampled:
        core.unsampled = unsampled
        core.replan_all()
    if not behind:
        core.sampled = levels
    resolve_inputs(core)


def multiplexed(core: Core) -> bool:
    """Whether the inputs are read by driver datagrams only."""
    return bool(core.setting("REFMUX") and not core.setting("EN_SD") and not core.setting("EN_REFR"))


def resolve_inputs(core: Core) -> None:
    """Derive the switches from the lines, and act on those that changed."""
    switches = _switches(core)
    if switches == core.switches:
        return
    before = [interrupts.conditions(core, motor, core.state(motor)) for motor in MOTORS]
    changed, core.switches = switches ^ core.switches, switches
    core.status = -1
    for motor in MOTORS:
        if change := changed >> 2 * motor & 3:
            _switch(core, motor, change)
            interrupts.raise_flags(core, motor, before[motor])


def _switches(core: Core) -> int:
    """The switches that the lines mean, by the inputs that are connected."""
    lines = core.sampled
    if core.setting("EN_REFR") or multiplexed(core):
        connected = 0b111111
    elif core.setting("MOT1R"):
        connected = 0b001011
        lines = lines & 0b101010 | lines >> 5 & 1
    else:
        connected = 0b101010
    return (lines ^ -core.setting("INV_REF")) & connected


def _switch(core: Core, motor: int, changed: int) -> None:
    """Switches of a motor have changed (bit 1 left, bit 0 right)."""
    state, active = core.state(motor), core.switches >> 2 * motor & 3
    if changed & 2:
        interrupts.flag(core, motor, interrupts.STOP_LEFT_HIGH if active & 2 else interrupts.STOP_LEFT_LOW)
    if changed & 1:
        interrupts.flag(core, motor, interrupts.STOP_RIGHT_HIGH if active & 1 else interrupts.STOP_RIGHT_LOW)
    words = core.words[motor]
    configuration, lp = words[REF_CONF_RAMP_MODE], FIELD["LP"].mask
    reference = 1 if FIELD["REF_RNL"].get(configuration) else 2
    if changed & reference and state.v and configuration & lp:
        words[REF_CONF_RAMP_MODE] &= ~lp
        words[INDEX["X_LATCHED"]] = state.x & DATA
    axis = core.axes[motor]
    stops = axis.left, axis.right
    resolve_stops(core, motor)
    if (axis.left, axis.right) != stops:
        core.cut(motor, state)
    core.replan(motor)


def resolve_stops(core: Core, motor: int) -> None:
    """Derive which of its switches stop an axis."""
    axis, active = core.axes[motor], core.switches >> 2 * motor & 3
    configuration = core.words[motor][REF_CONF_RAMP_MODE]
    axis.left = bool(active & 2) and not FIELD["DISABLE_STOP_L"].get(configuration)
    axis.right = bool(active & 1) and not FIELD["DISABLE_STOP_R"].get(configuration)
