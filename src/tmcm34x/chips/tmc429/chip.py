"""The chip: time, datagrams, registers, and what can be seen of it from outside.

Source: TMC429 datasheet 6 and 8.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, NamedTuple

from tmcm34x.chips.ramp import HALF_TURN, LAST, TURN, v_actual
from tmcm34x.chips.registers import BY_INDEX, COMMON, DATA, RAM, READ
from tmcm34x.chips.tmc429 import bus, chain, interrupts, switches
from tmcm34x.chips.tmc429.chain import Coils
from tmcm34x.chips.tmc429.core import (
    ALL_MOTORS,
    INDEX,
    INTERRUPTS,
    MOTORS,
    ChipName,
    Core,
)
from tmcm34x.clock import HZ, NEVER, digest

_MOTOR_READS: Final = {
    motor << 29 | index << 25 | READ: (motor, index) for motor in MOTORS for index in range(16)
}
"""The datagrams that read a register of a motor, the most frequent ones: motor and index."""


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


class Tmc429(Core):
    """A TMC429, or a TMC428 (`part`): registers, three axes, driver chain.

    The RAM of a TMC428 holds noise from `seed` after power-on (fidelity CHIP-15).

    `driver_status` returns 48 bits shifted in from the drivers, asked at the end of each driver datagram that
    something waits for; while it is asked `driver_datagram` is the one just sent.
    """

    def __init__(self, part: ChipName = "TMC429", *, seed: int = 0) -> None:
        super().__init__(part, seed)

    def reset(self) -> None:
        """Power-on at `now`: everything but the input lines is forgotten."""
        for listener in self.on_restart:
            listener()
        self.clear()
        switches.resolve_inputs(self)

    def digest(self) -> str:
        """A fingerprint of the state."""
        return digest(self.save())

    # ---- time

    def next_event(self) -> int:
        """The clock of the next change that something could wait for; NEVER at rest.

        That is: X_ACTUAL reaches X_TARGET, leaves its watched range, or something with its interrupt enabled
        happens; the velocity reaches zero or the one aimed at, or begins to brake; a driver datagram ends.
        """
        due = self.due
        if due < 0:
            due = self.due = self._plan()
        return due

    def advance(self, now: int) -> None:
        """Bring the chip to clock `now`."""
        if now < self.now:
            raise ValueError(f"the chip is at clock {self.now} and cannot go back to {now}")
        if now < self.due:
            self.now = now
            if not self.holds:
                self.status = -1
            return
        due = self.next_event()
        while due <= now:
            if due == NEVER:
                raise ValueError("NEVER is not a clock to go to")
            self.now = due
            self._happen()
            due = self.due = self._plan()
        self.now = now
        self.status = -1

    def changed_motors(self) -> int:
        """The motors, as bits, to which an event at `now` may have meant more than another acceleration."""
        return self.changed if self.changed_at == self.now else 0

    def watch(self, motor: int, low: int, high: int) -> None:
        """Make the step that takes X_ACTUAL out of low..high an event, until watched anew.

        The range from -2^23 to 2^23 - 1 watches nothing.
        """
        self.watched[motor] = (low, high) if high - low < TURN - 1 else None
        self.replan(motor)

    def _plan(self) -> int:
        """The clock of the next event."""
        if self.asleep != NEVER:
            return NEVER
        tick, marks = self.now - self.origin >> 5, self.marks
        wanted = (self.armed or self.unsampled) and chain.wanted(self)
        for motor, mark in enumerate(marks):
            if mark <= tick:
                up, down = ([], []) if wanted else self._noticed(motor)
                marks[motor] = self.axes[motor].next_mark(tick, up, down)
        first = min(marks)
        if wanted:
            first = min(first, chain.requested(self, tick))
        if self.scaled:
            first = min(first, *chain.standstills(self, tick))
        return min(self.flight, self.origin + (first << 5)) if first < NEVER else self.flight

    def _noticed(self, motor: int) -> tuple[list[int], list[int]]:
        """The positions that something waits for, on the way up and on the way down."""
        axis, watched, listens = self.axes[motor], self.watched[motor], interrupts.listens(self, motor)
        up = [axis.x_target]
        if watched is None and not listens:
            return up, up
        down = up.copy()
        if watched is not None:
            up.append(watched[1] + 1)
            down.append(watched[0] - 1)
        if listens:
            mask = self.words[motor][INTERRUPTS] >> 8
            if mask & interrupts.REF_WRONG:
                up.append(axis.dx_ref_tolerance + 1)
                down.append(-axis.dx_ref_tolerance - 1)
            both = [0] if mask & interrupts.REF_MISS else []
            if interrupts.compared_motor(self) == motor:
                both.append(self.common[INDEX["POS_COMP"]])
            up += both
            down += both
        return up, down

    def _happen(self) -> None:
        """What is due at `now` happens."""
        tick = self.tick()
        changed = 0
        for motor, mark in enumerate(self.marks):
            if mark == tick:
                if not self.axes[motor].bend:
                    changed |= 1 << motor
                    self.stays[motor] = None
                self._mark(motor, tick)
        if self.flight == self.now:
            changed = ALL_MOTORS
            chain.arrived(self)
        elif (
            (self.armed or self.unsampled) and chain.wanted(self) and chain.requested(self, tick - 1) == tick
        ):
            chain.send(self)
        self.changed, self.changed_at = changed, self.now
        self.due = self.status = -1

    def _mark(self, motor: int, tick: int) -> None:
        """An axis has come to a tick at which something waits for it."""
        axis = self.axes[motor]
        if interrupts.listens(self, motor):
            interrupts.raise_flags(self, motor, interrupts.conditions(self, motor, axis.at(tick - 1)))
        if (self.armed or self.unsampled) and chain.wanted(self) and axis.at(tick - 1).x != axis.at(tick).x:
            chain.send(self)
        axis.forget(tick)
        if self.on_plan:
            self.plan_changed(motor)

    # ---- the datagram

    def transfer(self, datagram: int) -> int:
        """One SPI transfer at `now`: executes 32 bits, answers the status byte and 24 bits read.

        The status is the one before a write takes effect.

        Source: datasheet 6.2.
        """
        if self.asleep != NEVER:
            bus.wake(self)
        reply = (self.status if self.status >= 0 else bus.status(self)) << 24
        read = _MOTOR_READS.get(datagram)
        if read is not None:
            motor, index = read
            return reply | bus.read_motor(self, motor, index)
        area, index = datagram >> 29 & 3, datagram >> 25 & 15
        if datagram & RAM:
            reading = bool(datagram & READ)
            return reply | bus.ram(self, datagram >> 25 & 63, datagram & DATA, reading=reading)
        if area != COMMON:
            if datagram & READ:
                return reply | bus.read_motor(self, area, index)
            bus.write_motor(self, area, index, datagram & DATA)
        elif datagram & READ:
            return reply | bus.read_common(self, index)
        else:
            row = BY_INDEX.get((COMMON, index))
            if row is not None and self.part in row.parts:
                bus.write_common(self, row, datagram & DATA)
        return reply

    def read_status(self) -> int:
        """A transfer of one byte only: the status byte."""
        if self.asleep != NEVER:
            bus.wake(self)
        return bus.status(self)

    # ---- the pins

    def set_reference_inputs(self, levels: int) -> None:
        """Set the input lines; see the package for their order.

        Behind a multiplexer (REFMUX) they are read when the next driver datagram has been sent.

        Source: datasheet 8.2.4.5 and 9.
        """
        switches.set_reference_inputs(self, levels)

    def driver_datagram(self) -> tuple[int, int]:
        """The bits a driver datagram would hold now, the first one most significant, and their number."""
        return chain.driver_datagram(self)

    def coil_currents(self, motor: int) -> Coils:
        """What the chip wants of the driver of a motor, before the polarities of SMGP."""
        return chain.coil_currents(self, motor)

    # ---- what can be seen from outside, without side effects

    def position(self, motor: int) -> int:
        """X_ACTUAL in microsteps, -2^23 .. 2^23 - 1."""
        return self.axes[motor].position(self.tick())

    def velocity(self, motor: int) -> int:
        """V_ACTUAL, signed."""
        return v_actual(self.axes[motor].velocity(self.tick()))

    def acceleration(self, motor: int) -> int:
        """A_ACTUAL: A_MAX with the sign of the last ramp tick's change of velocity, or 0."""
        return self.state(motor).a

    def phase(self, motor: int) -> int:
        """Index into the sine wave, 0..255."""
        return self.state(motor).wave & 255

    def motion(self, motor: int) -> Motion:
        """How a motor moves from now on.

        Source: datasheet 8.1.13, rate = f * v / (2^PULSE_DIV * 2048 * 32).
        """
        axis, tick = self.axes[motor], self.tick()
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

    def reaches(self, motor: int, position: int) -> int:
        """The clock at which X_ACTUAL comes to `position`, as the registers and inputs are now.

        NEVER where it does not before the next change of the motor that something could wait for.
        """
        if self.asleep != NEVER:
            return NEVER
        axis = self.axes[motor]
        mark = self._foreseen(motor, [position], [position])
        if mark == LAST or axis.at(mark).x != position or axis.at(mark - 1).x == position:
            return NEVER
        return self.origin + (mark << 5)

    def stays_within(self, motor: int, low: int, high: int) -> int:
        """The clock until which X_ACTUAL certainly stays within low..high, where it is, if no event comes before."""
        if self.asleep != NEVER:
            return self.now
        mark = self._foreseen(motor, [high + 1, -HALF_TURN], [low - 1, HALF_TURN - 1])
        return NEVER if mark == LAST else self.origin + (mark << 5)

    def position_at(self, motor: int, when: int) -> int:
        """X_ACTUAL at a clock before the next event, as the registers and inputs are now."""
        return self.axes[motor].position(min(when, self.asleep) - self.origin >> 5)

    def _foreseen(self, motor: int, up: list[int], down: list[int]) -> int:
        """The next tick at which an axis comes to one of some positions or has a mark; looking changes nothing."""
        axis = self.axes[motor]
        bend = axis.bend
        mark = axis.next_mark(self.tick(), up, down)
        axis.bend = bend
        return mark

    def steps(self, motor: int, start: int, end: int) -> Iterator[tuple[int, int]]:
        """Clock and direction (1 or -1) of each microstep after clock `start` (>= now) up to `end`.

        As the registers and inputs are now; to be consumed before they change.
        """
        origin, axis = self.origin, self.axes[motor]
        if self.asleep == NEVER:
            for tick, direction in axis.steps(start - origin >> 5, end - origin >> 5):
                yield origin + (tick << 5), direction

    def bends(self, motor: int, end: int) -> Iterator[tuple[int, int]]:
        """Speed (V_ACTUAL) and phase of a motor at `end`, and before it wherever the speed begins to rise or to fall.

        As the registers and inputs are now; the phase counts on as in `motion`.
        """
        until = min(end, self.asleep) - self.origin >> 5
        for state in self.axes[motor].bends(self.tick(), until):
            yield v_actual(state.v), state.wave
