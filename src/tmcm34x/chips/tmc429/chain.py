"""The drivers' chain: when driver datagrams are sent, and what is in them.

Source: TMC429 datasheet 8.1.9, 8.2.1 to 8.2.3 and 11; timing: fidelity CHIP-18.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, NamedTuple

from tmcm34x.chips.ramp import RampState
from tmcm34x.chips.registers import DATA
from tmcm34x.chips.tmc429 import switches
from tmcm34x.chips.tmc429.core import CHAIN_END, FIELD, I_SCALES, INDEX, MOTORS, Core
from tmcm34x.clock import NEVER

COVER: Final = 1
WORDS: Final = 2
"""What the driver datagram that is being sent was waited for: bits of `Core.sent`."""


class Coils(NamedTuple):
    """What the chip wants of one driver, before the polarities of SMGP; `a` is the sine, `b` the cosine."""

    dac_a: int
    """Current, 0..63."""
    dac_b: int
    ph_a: int
    """Sign of the current, 1 in the positive half wave."""
    ph_b: int
    fd_a: int
    """Fast decay: 1 while the current falls."""
    fd_b: int


# When


def resolve(core: Core) -> None:
    """RAM or SMGP were written: derive how long a driver datagram takes, and send what could not be sent."""
    core.derive_duration()
    if core.cover:
        send(core)
    if core.armed or core.unsampled:
        core.replan_all()


def wanted(core: Core) -> bool:
    """Whether the next driver datagram, whatever its cause, makes a difference."""
    return (core.armed or core.unsampled) and core.duration > 0 and core.flight == NEVER


def requested(core: Core, tick: int) -> int:
    """The tick after `tick` at which continuous update asks for a driver datagram."""
    if not core.setting("CONTINUOUS_UPDATE"):
        return NEVER
    return min([(tick >> shift) + 1 << shift for shift in [10 + axis.ramp_div for axis in core.axes]])


def send(core: Core) -> None:
    """Begin to send a driver datagram, unless one is being sent or none can be."""
    if core.flight == NEVER and core.duration:
        core.flight = core.now + core.duration
        core.sent = COVER * core.cover | WORDS * core.armed
        core.cover = core.armed = False
        core.replan_all()


def arrived(core: Core) -> None:
    """The driver datagram has arrived: the drivers' bits are in, the multiplexed inputs are read."""
    status = core.driver_status() if core.driver_status else 0
    if core.sent & WORDS:
        core.common[INDEX["DATAGRAM_HIGH_WORD"]] = status >> 24 & DATA
        core.common[INDEX["DATAGRAM_LOW_WORD"]] = status & DATA
    core.flight = NEVER
    core.sent = 0
    if switches.multiplexed(core):
        core.sampled, core.unsampled = core.levels, False
        switches.resolve_inputs(core)
    if core.cover:
        send(core)
    core.replan_all()


# What


def driver_datagram(core: Core) -> tuple[int, int]:
    """The bits a driver datagram would hold now, the first one most significant, and their number.

    A cover datagram that waits or is being sent lies over them.  Without an end in the configuration
    (no NxM) the 64 bits of one round.

    Source: datasheet 8.2.1 to 8.2.3 and 11.4.
    """
    length = core.chain_end() or 64
    bits, motor, signals = 0, 0, _signals(core, 0)
    for cell in bytes(core.ram[:length]):
        bits = bits << 1 | signals >> (cell & 31) & 1
        if cell & CHAIN_END and motor < 2:
            motor += 1
            signals = _signals(core, motor)
    if core.cover or core.sent & COVER:
        bits = _covered(core, bits, length)
    return bits, length


def _covered(core: Core, bits: int, length: int) -> int:
    """`bits` with the cover datagram over them."""
    word = core.common[INDEX["COVER_POSITION_LEN"]]
    cover = core.common[INDEX["COVER_DATAGRAM"]]
    size = FIELD["COVER_LEN"].get(word)
    shift = length - FIELD["COVER_POSITION"].get(word) - size
    mask, cover = (1 << size) - 1, cover & (1 << size) - 1
    mask, cover = (mask << shift, cover << shift) if shift >= 0 else (mask >> -shift, cover >> -shift)
    return (bits & ~mask | cover) & (1 << length) - 1


def _signals(core: Core, motor: int) -> int:
    """The 32 signals of the chain configuration, by code (datasheet 11.4.1)."""
    coils = coil_currents(core, motor)
    dac = 0b111111 * core.setting("POL_DAC_AB")
    ph, fd = core.setting("POL_PH_AB"), core.setting("POL_FD_AB")
    signals = coils.dac_a ^ dac | (coils.ph_a ^ ph) << 6 | (coils.fd_a ^ fd) << 7
    signals |= (coils.dac_b ^ dac) << 8 | (coils.ph_b ^ ph) << 14 | (coils.fd_b ^ fd) << 15
    return signals | 1 << 17 | core.state(motor).down << 18 | 0xFFF00000


def coil_currents(core: Core, motor: int) -> Coils:
    """What the chip wants of the driver of a motor, before the polarities of SMGP.

    Source: datasheet 8.1.9 and 11.5; falling motion: fidelity CHIP-16; rounding: fidelity CHIP-17.
    """
    state = core.state(motor)
    scale = _scale(core, motor, state)
    sine, cosine = state.wave & 255, state.wave + 64 & 255
    quadrant = sine >> 6
    fd_a = (quadrant ^ state.down) & 1
    return Coils(
        dac_a=_amplitude(core, sine) * scale >> 3,
        dac_b=_amplitude(core, cosine) * scale >> 3,
        ph_a=1 - (sine >> 7),
        ph_b=1 - (cosine >> 7),
        fd_a=fd_a,
        fd_b=1 - fd_a,
    )


def _amplitude(core: Core, wave: int) -> int:
    """The magnitude of the wave, from the quarter of it that the RAM holds."""
    index = wave & 63
    return core.ram[64 + (min(63, 64 - index) if wave & 64 else index)]


# Current scales


def _scale(core: Core, motor: int, state: RampState) -> int:
    """The current scale in eighths (I_SCALE)."""
    word = core.words[motor][I_SCALES]
    threshold = FIELD["A_THRESHOLD"].get(word)
    if state.v == 0 and core.tick() >= _standstill(core, motor, state):
        name = "IS_V0"
    elif threshold > 1023 or abs(state.a) <= threshold:
        name = "IS_ALEAT"
    else:
        name = "IS_AGTAT"
    return FIELD[name].get(word) or 8


def _standstill(core: Core, motor: int, state: RampState) -> int:
    """The tick from which on IS_V0 holds for an axis at rest."""
    word = core.words[motor][I_SCALES]
    if not (FIELD["IS_AGTAT"].get(word) and FIELD["IS_ALEAT"].get(word)):
        return NEVER
    return state.rest + (255 << core.axes[motor].ramp_div)


def standstills(core: Core, tick: int) -> Iterator[int]:
    """The ticks after `tick` at which an axis at rest changes its current scale."""
    for motor in MOTORS:
        state = core.axes[motor].at(tick)
        when = _standstill(core, motor, state)
        yield when if state.v == 0 and when > tick else NEVER
