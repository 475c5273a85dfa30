"""The motion controllers TMC429 and TMC428: three axes behind a 32-bit datagram.

The chip knows its registers (`registers.py`), three axes whose motion is computed in closed form (`ramp.py`),
the reference switch inputs, and the chain of drivers that it feeds from its RAM.

Inputs are numbered as in the SWITCHES register: bit 2*motor + 1 is the line of the left switch, bit 2*motor
that of the right one.  Without a multiplexer the pins REF1..REF3 are the lines of the left switches; the lines
of the right ones then reach a TMC429 through its own inputs when EN_REFR is set, and otherwise nothing.

Source: TMC429 datasheet rev. 2.06, sections 6 to 12; choices: docs/fidelity/chips.md.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from hashlib import shake_128
from math import floor, pi, sin
from typing import Final, Literal, NamedTuple

from tmcm34x.chips import registers
from tmcm34x.chips.ramp import SOFT, TURN, Axis, State
from tmcm34x.chips.registers import (
    BY_INDEX,
    BY_NAME,
    COMMON,
    DATA,
    FIELDS,
    MOTOR,
    REGISTERS,
    Register,
    sign_extended,
)
from tmcm34x.clock import HZ, NEVER

MOTORS: Final = range(3)

POS_END, REF_WRONG, REF_MISS, STOP = 1, 2, 4, 8
STOP_LEFT_LOW, STOP_RIGHT_LOW, STOP_LEFT_HIGH, STOP_RIGHT_HIGH = 16, 32, 64, 128

_INDEX: Final = {register.name: register.index for register in REGISTERS}
_FIELD: Final = {name: field for name, (_, field) in FIELDS.items()}

_INTERRUPTS: Final = _INDEX["INTERRUPTS"]
_POS_COMP_INT: Final = _INDEX["POS_COMP_INT"]

_TAKEN: Final = {
    _INDEX[name]: tuple((field.name.lower(), field) for field in BY_NAME[name].fields)
    for name in (
        "X_TARGET",
        "V_MIN",
        "V_MAX",
        "V_TARGET",
        "A_MAX",
        "PMUL_PDIV",
        "DIVISORS",
        "DX_REF_TOLERANCE",
    )
}
"""What an axis takes from a register that is written: attributes and fields."""

_COVER: Final = 1
_WORDS: Final = 2
"""What the driver datagram that is being sent was waited for."""

CHAIN_END: Final = 0x20
"""Chain configuration: this bit is the last of its driver (NxM)."""

DRIVER_CHAIN: Final = bytes((0x11, 5, 4, 3, 2, 6, 0x11, 13, 12, 11, 10, 14 | CHAIN_END)) * 3 + b"\x11" * 28
"""The chain configuration of a TMC429 after power-on: three TMC236 (MDA CA3..0 PHA MDB CB3..0 PHB), mixed decay."""

QUARTER_SINE: Final = bytes(min(63, floor(0.5 + 64 * sin(pi / 2 * i / 64))) for i in range(64))
"""The wave table of a TMC429 after power-on (fidelity CHIP-14)."""


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


class Motion(NamedTuple):
    """How an axis moves from now on, until its plan changes or the chip has an event."""

    position: int
    """X_ACTUAL, signed."""
    phase: int
    """Microstep phase in 64ths of a full step, counted on past the wave's 256; 0 at power-on."""
    step: int
    """64ths of a full step in a microstep."""
    rate_hz: float
    """Microsteps per second, signed."""
    acceleration_hz_s: float
    """Change of the rate, per second; while braking, about that."""
    ramp_div: int
    """A ramp tick takes 32 * 2^ramp_div clocks."""


class Tmc429:
    """A TMC429, or a TMC428 (`part`): registers, three axes, driver chain.

    The RAM of a TMC428 holds noise from `seed` after power-on (fidelity CHIP-15).

    Sources of `driver_status`: 48 bits shifted in from the drivers, asked at the end of each driver datagram that
    somebody waits for; while it is asked `driver_datagram` is the one just sent.
    """

    def __init__(self, part: Literal["TMC428", "TMC429"] = "TMC429", *, seed: int = 0) -> None:
        self.part: Final = part
        self.now = 0
        self.driver_status: Callable[[], int] | None = None
        self.plan_changed: Callable[[int], None] | None = None
        """Told a motor that moves otherwise than `motion` said, or that has an event of its own."""
        self.restarting: Callable[[], None] | None = None
        """Told before a reset."""
        self._seed = seed
        self._levels = 0
        self._watched: list[tuple[int, int] | None] = [None, None, None]
        self._noticed = [partial(self._noticed_after, motor) for motor in MOTORS]
        self.reset()

    def reset(self) -> None:
        """Power-on at `now`: everything but the input lines is forgotten."""
        if self.restarting:
            self.restarting()
        self._origin = self.now
        self._asleep = NEVER
        self._common = self._words(COMMON)
        self._motor = [self._words(MOTOR) for _ in MOTORS]
        if self.part == "TMC429":
            self._ram = bytearray(DRIVER_CHAIN + QUARTER_SINE)
        else:
            noise = shake_128(self._seed.to_bytes(8, "big", signed=True)).digest(128)
            self._ram = bytearray(cell & 63 for cell in noise)
        self._axes = [Axis() for _ in MOTORS]
        self._marks = [NEVER, NEVER, NEVER]
        self._due = -1
        self._equal = -1
        self._flight = NEVER
        self._cover = self._armed = self._unsampled = False
        self._sent = 0
        self._duration = 0
        self._scaled = False
        self._sampled = self._levels
        self._switches = 0
        self._resolve_inputs()
        self._resolve_chain()

    def _words(self, area: int) -> list[int]:
        """The registers of an area after power-on, by index."""
        rows = (BY_INDEX.get((area, index)) for index in range(16))
        return [row.reset if row and self.part in row.parts else 0 for row in rows]

    # ---- time

    def next_event(self) -> int:
        """The clock of the next change that somebody could wait for; NEVER at rest.

        That is: X_ACTUAL reaches X_TARGET, leaves its watched range, or something with its interrupt enabled
        happens; the velocity reaches zero or the one aimed at, or begins to brake; a driver datagram ends.
        """
        due = self._due
        if due < 0:
            due = self._due = self._plan()
        return due

    def advance(self, now: int) -> None:
        """Bring the chip to clock `now`."""
        if self.now <= now < self._due:
            self.now = now
            return
        if now < self.now:
            raise ValueError(f"the chip is at clock {self.now} and cannot go back to {now}")
        while (due := self.next_event()) <= now:
            self.now = due
            self._happen()
        self.now = now

    def watch(self, motor: int, low: int, high: int) -> None:
        """Make the step that takes X_ACTUAL out of low..high an event, until watched anew.

        The range from -2^23 to 2^23 - 1 watches nothing.
        """
        self._watched[motor] = (low, high) if high - low < TURN - 1 else None
        self._replan(motor)

    def _tick(self) -> int:
        """Ticks of 32 clocks since power-on, as far as the chip's clock ran."""
        return min(self.now, self._asleep) - self._origin >> 5

    def _plan(self) -> int:
        """The clock of the next event."""
        self._equal = -1
        if self._asleep != NEVER:
            return NEVER
        tick = self._tick()
        marks = self._marks
        for motor in MOTORS:
            if marks[motor] <= tick:
                marks[motor] = self._axes[motor].next_mark(tick, self._noticed[motor])
        first = min(marks)
        if self._wants_datagram():
            first = min(first, self._requested(tick))
        if self._scaled:
            first = min(first, *self._standstills(tick))
        return min(self._flight, self._origin + (first << 5) if first < NEVER else NEVER)

    def _replan(self, motor: int) -> None:
        self._marks[motor] = -1
        self._due = -1

    def _replan_all(self) -> None:
        self._marks = [-1, -1, -1]
        self._due = -1

    def _noticed_after(self, motor: int, state: State, direction: int) -> int:
        """After how many steps in a direction an axis reaches a position that somebody waits for."""
        if self._wants_datagram():
            return 1
        axis, x = self._axes[motor], state.x
        arrival = (direction * (axis.x_target - x) - 1) % TURN + 1
        if not self._watched[motor] and not self._listens(motor):
            return arrival
        mask = self._motor[motor][_INTERRUPTS] >> 8
        goals: list[int] = []
        if watched := self._watched[motor]:
            low, high = watched
            goals.append(high + 1 if direction > 0 else low - 1)
        if mask & REF_MISS:
            goals.append(0)
        if mask & REF_WRONG:
            goals.append(direction * (axis.dx_ref_tolerance + 1))
        if self._compared_motor() == motor:
            goals.append(sign_extended(self._common[_INDEX["POS_COMP"]], 24))
        return min([arrival, *((direction * (goal - x) - 1) % TURN + 1 for goal in goals)])

    def _happen(self) -> None:
        """What is due at `now` happens."""
        tick = self._tick()
        for motor in MOTORS:
            if self._marks[motor] == tick:
                axis = self._axes[motor]
                if self._listens(motor):
                    self._raise(motor, self._conditions(motor, axis.at(tick - 1)))
                if self._wants_datagram() and axis.at(tick - 1).x != axis.at(tick).x:
                    self._send_datagram()
                axis.forget(tick)
                if self.plan_changed:
                    self.plan_changed(motor)
        if self._flight == self.now:
            self._datagram_sent()
        elif self._wants_datagram() and self._requested(tick - 1) == tick:
            self._send_datagram()
        self._due = -1

    # ---- the datagram

    def transfer(self, datagram: int) -> int:
        """One SPI transfer at `now`: executes 32 bits, answers the status byte and 24 bits read.

        The status is the one before a write takes effect.

        Source: datasheet 6.2.
        """
        self._wake()
        reply = self._status() << 24
        address = datagram >> 25 & 63
        data = datagram & DATA
        if datagram & registers.RAM:
            if datagram & registers.READ:
                return reply | self._ram[2 * address + 1] << 8 | self._ram[2 * address]
            self._ram[2 * address : 2 * address + 2] = bytes((data & 63, data >> 8 & 63))
            self._resolve_chain()
            return reply
        area, index = divmod(address, 16)
        row = BY_INDEX.get((COMMON if area == COMMON else MOTOR, index))
        if row is None or self.part not in row.parts:
            return reply
        if datagram & registers.READ:
            data = self._read_common(index) if area == COMMON else self._read_motor(area, index)
            return reply | data
        if area == COMMON:
            self._write_common(row, data)
        else:
            self._write_motor(area, row, data)
        return reply

    def read_status(self) -> int:
        """A transfer of one byte only: the status byte."""
        self._wake()
        return self._status()

    def _status(self) -> int:
        status = self._targets() | self._switches & 0b101010
        for words in self._motor:
            if words[_INTERRUPTS] & 255:
                status |= registers.INT
        if self._common[_POS_COMP_INT] & 1:
            status |= registers.INT
        return status | registers.CDGW if self._cover or self._armed or self._sent else status

    def _targets(self) -> int:
        """The status bits of the axes whose X_ACTUAL equals X_TARGET.

        To reach the target is an event, to leave it is none: the bits hold until the next one if no axis is there,
        or if nothing at all is going on.
        """
        if self._due >= 0 and self._equal >= 0:
            return self._equal
        tick = self._tick()
        bits = 0
        for motor, axis in enumerate(self._axes):
            if axis.position(tick) == axis.x_target:
                bits |= registers.at_target(motor)
        if self._due == NEVER or (self._due >= 0 and not bits):
            self._equal = bits
        return bits

    def _wake(self) -> None:
        """The falling edge of nSCS_C ends the power-down mode."""
        if self._asleep == NEVER:
            return
        slept = self.now - self._asleep
        self._asleep = NEVER
        self._origin += slept
        if self._flight != NEVER:
            self._flight += slept
        self._due = -1
        self.set_reference_inputs(self._levels)

    # ---- registers of a motor

    def _read_motor(self, motor: int, index: int) -> int:
        axis, word = self._axes[motor], self._motor[motor][index]
        name = BY_INDEX[MOTOR, index].name
        if name == "X_ACTUAL":
            return axis.position(self._tick()) & DATA
        state = axis.at(self._tick())
        match name:
            case "V_TARGET":
                return axis.v_target_read(state) & 0xFFF
            case "V_ACTUAL":
                return _velocity(state) & 0xFFF
            case "A_ACTUAL":
                return state.a & 0xFFF
            case "USTEP_COUNT":
                return state.wave & 255
            case _:
                return word

    def _write_motor(self, motor: int, row: Register, data: int) -> None:
        words, axis, tick = self._motor[motor], self._axes[motor], self._tick()
        state = axis.at(tick)
        name, index = row.name, row.index
        match name:
            case "INTERRUPTS":
                mask = data & 0xFF00
                words[index] = mask | words[index] & ~data & mask >> 8
                self._replan(motor)
                return
            case "X_LATCHED":
                words[_INDEX["REF_CONF_RAMP_MODE"]] |= _FIELD["LP"].mask
                return
            case "A_ACTUAL" | "USTEP_COUNT":
                return
            case "V_TARGET" if axis.mode <= SOFT:
                return
            case "X_ACTUAL" | "V_ACTUAL":
                pass
            case _:
                data = data & row.writable | words[index] & ~row.writable | row.ones
                if data == words[index]:
                    return
        before = self._conditions(motor, state)
        words[index] = data
        match name:
            case "X_ACTUAL":
                state = state._replace(x=sign_extended(data, 24))
            case "V_ACTUAL":
                v = sign_extended(data, 12) << 8
                state = state._replace(
                    v=v, rest=state.rest if state.v == 0 else tick, down=v < 0 if v else state.down
                )
            case "REF_CONF_RAMP_MODE":
                mode = _FIELD["RAMP_MODE"].get(data)
                if mode > SOFT:
                    axis.v_target = axis.v_target_read(state)
                    words[_INDEX["V_TARGET"]] = axis.v_target & 0xFFF
                axis.mode = mode
                axis.soft_stop = bool(_FIELD["SOFT_STOP"].get(data))
                self._resolve_stops(motor)
            case "I_SCALES_A_THRESHOLD":
                self._scaled = any(words[index] for words in self._motor)
            case _:
                for attribute, field in _TAKEN[index]:
                    setattr(axis, attribute, field.get(data))
        self._cut(motor, state)
        self._raise(motor, before)
        self._replan(motor)

    def _cut(self, motor: int, state: State) -> None:
        """Begin another plan."""
        self._axes[motor].cut(state)
        if self.plan_changed:
            self.plan_changed(motor)

    # ---- interrupts: a flag is set when its condition becomes true (fidelity CHIP-11)

    def _listens(self, motor: int) -> bool:
        """Whether any interrupt is enabled that this motor could cause."""
        return self._motor[motor][_INTERRUPTS] > 255 or self._common[_POS_COMP_INT] > 1

    def _conditions(self, motor: int, state: State) -> int:
        if not self._listens(motor):
            return 0
        axis = self._axes[motor]
        conditions = STOP if state.stopping else 0
        if state.x == axis.x_target:
            conditions |= POS_END
        if self._reference(motor):
            if abs(state.x) > axis.dx_ref_tolerance:
                conditions |= REF_WRONG
        elif state.x == 0:
            conditions |= REF_MISS
        if self._compared_motor() == motor and state.x & DATA == self._common[_INDEX["POS_COMP"]]:
            conditions |= 256
        return conditions

    def _raise(self, motor: int, before: int) -> None:
        """Set the flags of conditions that have become true, as far as their masks allow."""
        if not self._listens(motor):
            return
        risen = self._conditions(motor, self._axes[motor].at(self._tick())) & ~before
        if self._axes[motor].mode > SOFT:
            risen &= ~POS_END
        self._flag(motor, risen)
        if risen & 256:
            self._common[_POS_COMP_INT] |= 1

    def _flag(self, motor: int, flags: int) -> None:
        words, index = self._motor[motor], _INTERRUPTS
        words[index] |= flags & words[index] >> 8

    def _compared_motor(self) -> int:
        """The motor whose position is compared with POS_COMP, if that interrupt is enabled."""
        if not self._common[_POS_COMP_INT] & _FIELD["MASK_POS_COMP"].mask:
            return -1
        return _FIELD["POS_COMP_SEL"].get(self._common[_INDEX["IF_CONFIGURATION"]])

    # ---- common registers

    def _setting(self, name: str) -> int:
        """A field of SMGP or IF_CONFIGURATION."""
        return _FIELD[name].get(self._common[FIELDS[name][0].index])

    def _read_common(self, index: int) -> int:
        word = self._common[index]
        match BY_INDEX[COMMON, index].name:
            case "SWITCHES":
                return self._switches
            case "COVER_POSITION_LEN":
                field = _FIELD["COVER_POSITION"]
                return _FIELD["CW"].put(
                    field.put(word, field.get(word) + 1), self._cover or self._sent & _COVER != 0
                )
            case _:
                return word

    def _write_common(self, row: Register, data: int) -> None:
        name, index = row.name, row.index
        compared = self._compared()
        match name:
            case "DATAGRAM_LOW_WORD" | "DATAGRAM_HIGH_WORD":
                self._armed = True
            case "POS_COMP_INT":
                mask = data & _FIELD["MASK_POS_COMP"].mask
                self._common[index] = mask | self._common[index] & ~data & mask >> 8
            case "POWER_DOWN":
                self._asleep = self.now
            case _:
                self._common[index] = data & row.writable | self._common[index] & ~row.writable
        match name:
            case "COVER_DATAGRAM":
                self._cover = True
                self._send_datagram()
            case "IF_CONFIGURATION" | "SMGP":
                self.set_reference_inputs(self._levels)
                self._resolve_chain()
            case _:
                pass
        self._replan_all()
        if name in ("POS_COMP", "IF_CONFIGURATION") and self._compared() and not compared:
            self._common[_POS_COMP_INT] |= 1

    def _compared(self) -> bool:
        """Whether the position compared with POS_COMP equals it."""
        motor = self._compared_motor()
        return motor in MOTORS and self.position(motor) & DATA == self._common[_INDEX["POS_COMP"]]

    # ---- reference switches

    def set_reference_inputs(self, levels: int) -> None:
        """Set the input lines; see the module for their order.

        Behind a multiplexer (REFMUX) they are read when the next driver datagram has been sent.

        Source: datasheet 8.2.4.5 and 9.
        """
        self._levels = levels
        if self._asleep != NEVER:
            return
        multiplexed = self._multiplexed()
        unsampled = multiplexed and levels != self._sampled
        if unsampled != self._unsampled:
            self._unsampled = unsampled
            self._replan_all()
        if not multiplexed:
            self._sampled = levels
        self._resolve_inputs()

    def _multiplexed(self) -> bool:
        return bool(self._setting("REFMUX") and not self._setting("EN_SD") and not self._setting("EN_REFR"))

    def _resolve_inputs(self) -> None:
        """Derive the switches from the lines, and act on those that changed."""
        lines = self._sampled
        if self._setting("EN_REFR") or self._multiplexed():
            connected = 0b111111
        elif self._setting("MOT1R"):
            connected = 0b001011
            lines = lines & 0b101010 | lines >> 5 & 1
        else:
            connected = 0b101010
        switches = (lines ^ -self._setting("INV_REF")) & connected
        if switches == self._switches:
            return
        before = [self._conditions(motor, self._state(motor)) for motor in MOTORS]
        changed, self._switches = switches ^ self._switches, switches
        for motor in MOTORS:
            if change := changed >> 2 * motor & 3:
                self._switch(motor, change)
                self._raise(motor, before[motor])

    def _switch(self, motor: int, changed: int) -> None:
        """Switches of a motor have changed (bit 1 left, bit 0 right)."""
        words, state = self._motor[motor], self._state(motor)
        active = self._switches >> 2 * motor & 3
        if changed & 2:
            self._flag(motor, STOP_LEFT_HIGH if active & 2 else STOP_LEFT_LOW)
        if changed & 1:
            self._flag(motor, STOP_RIGHT_HIGH if active & 1 else STOP_RIGHT_LOW)
        configuration, lp = _INDEX["REF_CONF_RAMP_MODE"], _FIELD["LP"].mask
        reference = 1 if _FIELD["REF_RNL"].get(words[configuration]) else 2
        if changed & reference and state.v and words[configuration] & lp:
            words[configuration] &= ~lp
            words[_INDEX["X_LATCHED"]] = state.x & DATA
        axis = self._axes[motor]
        stops = axis.left, axis.right
        self._resolve_stops(motor)
        if (axis.left, axis.right) != stops:
            self._cut(motor, state)
        self._replan(motor)

    def _resolve_stops(self, motor: int) -> None:
        """Tell the axis which of its switches stop it."""
        axis, active = self._axes[motor], self._switches >> 2 * motor & 3
        configuration = self._motor[motor][_INDEX["REF_CONF_RAMP_MODE"]]
        axis.left = bool(active & 2) and not _FIELD["DISABLE_STOP_L"].get(configuration)
        axis.right = bool(active & 1) and not _FIELD["DISABLE_STOP_R"].get(configuration)

    def _reference(self, motor: int) -> bool:
        """Whether the reference switch of a motor is active."""
        right = _FIELD["REF_RNL"].get(self._motor[motor][_INDEX["REF_CONF_RAMP_MODE"]])
        return bool(self._switches >> 2 * motor & (1 if right else 2))

    # ---- the drivers' chain

    def _resolve_chain(self) -> None:
        """Derive from RAM and SMGP how long a driver datagram takes; 0 where none is ever finished."""
        self._duration = 0
        end = self._chain_end()
        if end and not self._setting("EN_SD"):
            self._duration = 2 * (self._setting("CLK2_DIV") + 1) * (end + self._drivers() + 2)
        if self._cover:
            self._send_datagram()
        if self._armed or self._unsampled:
            self._replan_all()

    def _drivers(self) -> int:
        return min(self._setting("LSMD") + 1, 3)

    def _chain_end(self) -> int:
        """The number of bits of a driver datagram, or 0 if the configuration holds no end."""
        drivers = self._drivers()
        for position in range(64):
            drivers -= self._ram[position] >> 5
            if not drivers:
                return position + 1
        return 0

    def _wants_datagram(self) -> bool:
        """Whether the next driver datagram, whatever its cause, makes a difference."""
        return (self._armed or self._unsampled) and self._duration > 0 and self._flight == NEVER

    def _requested(self, tick: int) -> int:
        """The tick after `tick` at which continuous update asks for a driver datagram."""
        if not self._setting("CONTINUOUS_UPDATE"):
            return NEVER
        return min((tick >> shift) + 1 << shift for shift in (10 + axis.ramp_div for axis in self._axes))

    def _send_datagram(self) -> None:
        """Begin to send a driver datagram, unless one is being sent or none can be."""
        if self._flight == NEVER and self._duration:
            self._flight = self.now + self._duration
            self._sent = _COVER * self._cover | _WORDS * self._armed
            self._cover = self._armed = False
            self._replan_all()

    def _datagram_sent(self) -> None:
        """The driver datagram has arrived: the drivers' bits are in, the multiplexed inputs are read."""
        status = self.driver_status() if self.driver_status else 0
        if self._sent & _WORDS:
            self._common[_INDEX["DATAGRAM_HIGH_WORD"]] = status >> 24 & DATA
            self._common[_INDEX["DATAGRAM_LOW_WORD"]] = status & DATA
        self._flight = NEVER
        self._sent = 0
        if self._multiplexed():
            self._sampled, self._unsampled = self._levels, False
            self._resolve_inputs()
        if self._cover:
            self._send_datagram()
        self._replan_all()

    def driver_datagram(self) -> tuple[int, int]:
        """The bits a driver datagram would hold now, the first one most significant, and their number.

        A cover datagram that waits or is being sent lies over them.  Without an end in the configuration
        (no NxM) the 64 bits of one round.

        Source: datasheet 8.2.1 to 8.2.3 and 11.4.
        """
        length = self._chain_end() or 64
        bits, motor, signals = 0, 0, self._signals(0)
        for cell in self._ram[:length]:
            bits = bits << 1 | signals >> (cell & 31) & 1
            if cell & CHAIN_END and motor < 2:
                motor += 1
                signals = self._signals(motor)
        word = self._common[_INDEX["COVER_POSITION_LEN"]]
        if self._cover or self._sent & _COVER:
            cover = self._common[_INDEX["COVER_DATAGRAM"]]
            size = _FIELD["COVER_LEN"].get(word)
            shift = length - _FIELD["COVER_POSITION"].get(word) - size
            mask, cover = (1 << size) - 1, cover & (1 << size) - 1
            mask, cover = (mask << shift, cover << shift) if shift >= 0 else (mask >> -shift, cover >> -shift)
            bits = (bits & ~mask | cover) & (1 << length) - 1
        return bits, length

    def _signals(self, motor: int) -> int:
        """The 32 signals of the chain configuration, by code (datasheet 11.4.1)."""
        coils = self.coil_currents(motor)
        dac = 0b111111 * self._setting("POL_DAC_AB")
        ph, fd = self._setting("POL_PH_AB"), self._setting("POL_FD_AB")
        signals = coils.dac_a ^ dac | (coils.ph_a ^ ph) << 6 | (coils.fd_a ^ fd) << 7
        signals |= (coils.dac_b ^ dac) << 8 | (coils.ph_b ^ ph) << 14 | (coils.fd_b ^ fd) << 15
        return signals | 1 << 17 | self._state(motor).down << 18 | 0xFFF00000

    # ---- what can be seen from outside, without side effects

    def position(self, motor: int) -> int:
        """X_ACTUAL in microsteps, -2^23 .. 2^23 - 1."""
        return self._axes[motor].position(self._tick())

    def velocity(self, motor: int) -> int:
        """V_ACTUAL, signed."""
        return _velocity(self._state(motor))

    def acceleration(self, motor: int) -> int:
        """A_ACTUAL: A_MAX with the sign of the last ramp tick's change of velocity, or 0."""
        return self._state(motor).a

    def phase(self, motor: int) -> int:
        """Index into the sine wave, 0..255."""
        return self._state(motor).wave & 255

    def motion(self, motor: int) -> Motion:
        """How a motor moves from now on.

        Source: datasheet 8.1.13, rate = f * v / (2^PULSE_DIV * 2048 * 32).
        """
        axis, tick = self._axes[motor], self._tick()
        state = axis.at(tick)
        unit_hz = HZ / (1 << axis.pulse_div + 24)
        law = axis.law(tick)
        return Motion(
            state.x,
            state.wave,
            axis.wave_step,
            state.v * unit_hz,
            law * unit_hz * (HZ / (32 << axis.ramp_div)),
            axis.ramp_div,
        )

    def steps(self, motor: int, start: int, end: int) -> Iterator[tuple[int, int]]:
        """Clock and direction (1 or -1) of each microstep after clock `start` (>= now) up to `end`.

        As the registers and inputs are now; to be consumed before they change.
        """
        origin, axis = self._origin, self._axes[motor]
        if self._asleep == NEVER:
            for tick, direction in axis.steps(start - origin >> 5, end - origin >> 5):
                yield origin + (tick << 5), direction

    def coil_currents(self, motor: int) -> Coils:
        """What the chip wants of the driver of a motor, before the polarities of SMGP.

        Source: datasheet 8.1.9 and 11.5; falling motion: fidelity CHIP-16; rounding: fidelity CHIP-17.
        """
        state = self._state(motor)
        scale = self._scale(motor, state)
        sine, cosine = state.wave & 255, state.wave + 64 & 255
        quadrant = sine >> 6
        fd_a = (quadrant ^ state.down) & 1
        return Coils(
            dac_a=self._amplitude(sine) * scale >> 3,
            dac_b=self._amplitude(cosine) * scale >> 3,
            ph_a=1 - (sine >> 7),
            ph_b=1 - (cosine >> 7),
            fd_a=fd_a,
            fd_b=1 - fd_a,
        )

    def _amplitude(self, wave: int) -> int:
        """The magnitude of the wave, from the quarter of it that the RAM holds."""
        index = wave & 63
        return self._ram[64 + (min(63, 64 - index) if wave & 64 else index)]

    def _scale(self, motor: int, state: State) -> int:
        """The current scale in eighths (I_SCALE)."""
        word = self._motor[motor][_INDEX["I_SCALES_A_THRESHOLD"]]
        threshold = _FIELD["A_THRESHOLD"].get(word)
        if state.v == 0 and self._tick() >= self._standstill(motor, state):
            name = "IS_V0"
        elif threshold > 1023 or abs(state.a) <= threshold:
            name = "IS_ALEAT"
        else:
            name = "IS_AGTAT"
        return _FIELD[name].get(word) or 8

    def _standstill(self, motor: int, state: State) -> int:
        """The tick from which on IS_V0 holds for an axis at rest."""
        word = self._motor[motor][_INDEX["I_SCALES_A_THRESHOLD"]]
        if not (_FIELD["IS_AGTAT"].get(word) and _FIELD["IS_ALEAT"].get(word)):
            return NEVER
        return state.rest + (255 << self._axes[motor].ramp_div)

    def _standstills(self, tick: int) -> Iterator[int]:
        """The ticks after `tick` at which an axis at rest changes its current scale."""
        for motor, axis in enumerate(self._axes):
            state = axis.at(tick)
            when = self._standstill(motor, state)
            yield when if state.v == 0 and when > tick else NEVER

    def _state(self, motor: int) -> State:
        return self._axes[motor].at(self._tick())


def _velocity(state: State) -> int:
    """V_ACTUAL: the velocity toward zero."""
    return -(-state.v >> 8) if state.v < 0 else state.v >> 8
