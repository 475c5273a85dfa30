"""Motion commands: what the firmware writes into the motion chip to make motors turn, move and stop.

An `Axis` is one motor as the firmware sees it: its corner of the motion chip, reached through 32-bit datagrams,
and its axis parameters in RAM.  `Motion` has the verbs.  Nothing else in the firmware starts or stops a motor.

In velocity mode the chip's V_MAX is open (2047), so that ROR and ROL are not limited by parameter 4; in position
mode it is parameter 4.  An interpolated move scales V_MAX and A_MAX for its own time only.

Source: manual 6.7.1 to 6.7.4; vendor's firmware for sister modules; fidelity FW-20 to FW-26.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Final, NamedTuple

from tmcm34x.chips.ramp import brake_factor
from tmcm34x.chips.registers import DATA, FIELDS, READ, at_target, left_switch

if TYPE_CHECKING:
    from tmcm34x.board.board import Board

RAMP: Final = 0
SOFT: Final = 1
VELOCITY: Final = 2
_FRACTION: Final = 64
"""Bits behind the point in the scaling of interpolated moves."""
OPEN: Final = 2047
"""The chip's V_MAX in velocity mode: no limit."""


class ChipField(NamedTuple):
    """A field of a motor's registers, made ready for datagrams."""

    read_word: int
    write_word: int
    mask: int
    low: int
    sign: int
    """The sign bit after shifting, or 0."""
    keep: int
    """The register's other bits, kept by reading before writing."""


def _chip_field(name: str) -> ChipField:
    register, field = FIELDS[name]
    return ChipField(
        register.index << 25 | READ,
        register.index << 25,
        field.mask,
        field.low,
        1 << field.width - 1 if field.signed else 0,
        register.writable & ~field.mask,
    )


MOTOR_FIELDS: Final = {name: _chip_field(name) for name, (row, _) in FIELDS.items() if row.area == 0}
"""All fields of the registers that every motor has, by name."""

X_TARGET: Final = MOTOR_FIELDS["X_TARGET"]
X_ACTUAL: Final = MOTOR_FIELDS["X_ACTUAL"]
V_MAX: Final = MOTOR_FIELDS["V_MAX"]
V_TARGET: Final = MOTOR_FIELDS["V_TARGET"]
V_ACTUAL: Final = MOTOR_FIELDS["V_ACTUAL"]
A_MAX: Final = MOTOR_FIELDS["A_MAX"]
A_ACTUAL: Final = MOTOR_FIELDS["A_ACTUAL"]
PMUL: Final = MOTOR_FIELDS["PMUL"]
PDIV: Final = MOTOR_FIELDS["PDIV"]
RAMP_MODE: Final = MOTOR_FIELDS["RAMP_MODE"]
PULSE_DIV: Final = MOTOR_FIELDS["PULSE_DIV"]
RAMP_DIV: Final = MOTOR_FIELDS["RAMP_DIV"]
STOP_SWITCHES: Final = MOTOR_FIELDS["DISABLE_STOP_L"], MOTOR_FIELDS["DISABLE_STOP_R"]

_SWITCHES: Final = FIELDS["L1"][0].read()


class Axis:
    """One motor: its registers in the motion chip, and its parameters in RAM by number."""

    __slots__ = (
        "_left",
        "_right",
        "at_target_bit",
        "base",
        "chip",
        "motor",
        "open",
        "scaled",
        "transfer",
        "values",
    )

    def __init__(self, board: Board, motor: int) -> None:
        chip, smda = board.wiring(motor)
        self.motor = motor
        self.chip = chip
        self.transfer: Callable[[int], int] = board.bus(chip)
        self.base = smda << 29
        self.at_target_bit = at_target(smda) << 24
        """The status bit, in every reply of the chip, that is set while actual and target position are equal."""
        self._left = left_switch(smda)
        self._right = self._left >> 1
        self.values: dict[int, int] = {}
        self.open = False
        """The chip's V_MAX is open, not parameter 4."""
        self.scaled = False
        """The chip's V_MAX and A_MAX are those of an interpolated move."""

    def read(self, field: ChipField) -> int:
        """The value of a register field, with its sign."""
        word, _, mask, low, sign, _ = field
        value = (self.transfer(self.base | word) & mask) >> low
        return value - ((value & sign) << 1)

    def write(self, field: ChipField, value: int) -> None:
        """Set a register field, leaving the others of its register as they are."""
        read_word, word, mask, low, _, keep = field
        data = value << low & mask
        if keep:
            data |= self.transfer(self.base | read_word) & keep
        self.transfer(self.base | word | data)

    @property
    def at_target(self) -> bool:
        """Whether actual and target position are equal."""
        return bool(self.transfer(self.base | READ) & self.at_target_bit)

    @property
    def left_switch(self) -> bool:
        """Whether the left (reference) switch is active."""
        return bool(self.transfer(_SWITCHES) & self._left)

    @property
    def right_switch(self) -> bool:
        """Whether the right switch is active."""
        return bool(self.transfer(_SWITCHES) & self._right)

    @property
    def reached(self) -> bool:
        """Whether the motor has come to its target position, as command 138 and WAIT POS take it.

        In position mode a motor that is at its target faster than V_MIN passes it, and comes back.

        Source: TMC429 datasheet 8.1.3; fidelity FW-49.
        """
        return self.at_target and (self.open or abs(self.read(V_ACTUAL)) <= self.values[130])

    @property
    def at_rest(self) -> bool:
        """Whether the ramp generator keeps the motor where it is.

        Speed and target speed are 0 both at rest and at the instant at which a motor turns round in position
        mode.  There the speed is changing, which A_ACTUAL tells; a motor that a switch holds, or that stays short
        of its target for another reason, does not change its speed.

        Source: fidelity FW-40.
        """
        if self.read(V_ACTUAL) or self.read(V_TARGET):
            return False
        return self.open or self.at_target or not self.read(A_ACTUAL)

    def set_acceleration(self, acceleration: int) -> None:
        """Write A_MAX and the braking factors that belong to it and to the divisors.

        Source: TMC429 datasheet 8.1.10; fidelity CHIP-9, FW-23.
        """
        p_mul, p_div = brake_factor(acceleration, self.values[153], self.values[154])
        word = PMUL.write_word
        self.transfer(self.base | word | p_mul << PMUL.low | p_div << PDIV.low)
        self.write(A_MAX, acceleration)

    def restore_limits(self) -> None:
        """Put parameters 4 and 5 back into the chip after velocity mode or an interpolated move."""
        if self.open or self.scaled:
            self.write(V_MAX, self.values[4])
            self.open = False
        if self.scaled:
            self.set_acceleration(self.values[5])
            self.scaled = False

    def scale_limits(self, speed: int, acceleration: int) -> None:
        """Take other limits for one move."""
        self.write(V_MAX, speed)
        self.set_acceleration(acceleration)
        self.open = False
        self.scaled = True


class Motion:
    """The verbs.  `started` is told the number of each motor that may move from now on."""

    __slots__ = ("axes", "started")

    def __init__(self, axes: tuple[Axis, ...], started: Callable[[int], None]) -> None:
        self.axes = axes
        self.started = started

    def reached(self) -> int:
        """A mask of the motors that have reached their targets."""
        return sum(axis.reached << axis.motor for axis in self.axes)

    def enter_velocity_mode(self, motor: int) -> None:
        """Velocity mode with open V_MAX; the target speed stays what it is."""
        axis = self.axes[motor]
        if axis.scaled:
            axis.restore_limits()
        axis.write(RAMP_MODE, VELOCITY)
        axis.write(V_MAX, OPEN)
        axis.open = True

    def enter_ramp_mode(self, motor: int, mode: int) -> None:
        """Position mode (0) or soft mode (1), limited by parameter 4."""
        axis = self.axes[motor]
        axis.restore_limits()
        axis.write(RAMP_MODE, mode)
        self.started(motor)

    def rotate(self, motor: int, velocity: int) -> None:
        """Turn at `velocity` (-2047..2047) until told otherwise."""
        self.enter_velocity_mode(motor)
        self.axes[motor].write(V_TARGET, velocity)
        self.started(motor)

    def stop(self, motor: int) -> None:
        """Come to rest along the ramp: velocity mode, target speed 0."""
        self.rotate(motor, 0)

    def halt(self, motor: int) -> None:
        """Come to rest at once: velocity mode, target and actual speed 0."""
        self.rotate(motor, 0)
        self.axes[motor].write(V_ACTUAL, 0)

    def move_to(self, motor: int, position: int) -> None:
        """Go to `position` with the limits of parameters 4 and 5."""
        self.axes[motor].write(X_TARGET, position)
        self.enter_ramp_mode(motor, RAMP)

    def move_interpolated(self, targets: Iterable[tuple[int, int]]) -> None:
        """Take motors to positions so that all arrive together, on a straight line.

        Speeds and accelerations are in the ratio of the ways, as fast as parameters 4 and 5 of every motor allow:
        with equal settings the motor with the longest way uses its own, the others a fraction.

        Source: manual 6.7.4; scaling: fidelity FW-24.
        """
        moves = [
            (self.axes[motor], position, _distance(self.axes[motor].read(X_ACTUAL), position))
            for motor, position in targets
        ]
        speeds = _in_ratio([(axis.values[4], way << axis.values[154]) for axis, _, way in moves])
        accelerations = _in_ratio(
            [(axis.values[5], way << axis.values[153] + axis.values[154]) for axis, _, way in moves]
        )
        for (axis, position, _), speed, acceleration in zip(moves, speeds, accelerations, strict=True):
            axis.write(X_TARGET, position)
            if speed == axis.values[4] and acceleration == axis.values[5]:
                axis.restore_limits()
            else:
                axis.scale_limits(speed, acceleration)
            axis.write(RAMP_MODE, RAMP)
            self.started(axis.motor)


def _distance(start: int, end: int) -> int:
    """How far the chip goes, by the shorter way round its 24 bits."""
    way = (end - start) & DATA
    return min(way, DATA + 1 - way)


def _in_ratio(limits: list[tuple[int, int]]) -> list[int]:
    """Numbers in the ratio of the weights, none above its limit, from pairs of limit and weight.

    A number of no weight is its limit; one that would be rounded to zero is 1.
    """
    factor = min(((limit << _FRACTION) // weight for limit, weight in limits if weight), default=0)
    half = 1 << _FRACTION - 1
    return [
        max(factor * weight + half >> _FRACTION, factor > 0) if weight else limit for limit, weight in limits
    ]
