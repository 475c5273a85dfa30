"""One motor as the firmware sees it: its corner of the motion chip, its parameters in RAM, what is going on with it.

The registers are reached through 32-bit datagrams, as on the real board.  Everything else here is plain state.

Source: TMC429 datasheet 6 and 8.1; manual 7.1.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from tmcm34x.chips.ramp import VELOCITY, brake_factor
from tmcm34x.chips.registers import FIELDS, READ, at_target, left_switch
from tmcm34x.clock import NEVER
from tmcm34x.tmcl.numbers import AP

if TYPE_CHECKING:
    from tmcm34x.board.circuit import Circuit
    from tmcm34x.clock import Value


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


class ReferenceSearch(IntEnum):
    """What a reference search is doing; RFS STATUS reads it."""

    IDLE = 0
    GOING_RIGHT = 1
    GOING_LEFT = 2
    LEAVING = 3
    REENTERING = 4
    GOING_TO_ZERO = 5
    LEAVING_RIGHT = 6


class AxisState:
    """One motor: its registers in the motion chip, its parameters in RAM by number, and its state."""

    __slots__ = (
        "_left",
        "_right",
        "ask_speed",
        "at_target_bit",
        "base",
        "bit",
        "chip",
        "decay",
        "free_due",
        "full_step",
        "grace",
        "look_due",
        "motor",
        "moving",
        "open",
        "opened",
        "power_due",
        "rest_since",
        "right_end",
        "scaled",
        "search",
        "transfer",
        "values",
    )

    def __init__(self, board: Circuit, motor: int) -> None:
        chip, smda = board.wiring(motor)
        self.motor = motor
        self.bit = 1 << motor
        self.chip = chip
        self.transfer: Callable[[int], int] = board.bus(chip)
        self.base = smda << 29
        self.ask_speed = self.base | V_ACTUAL.read_word
        """The datagram that reads V_ACTUAL."""
        self.at_target_bit = at_target(smda) << 24
        """The status bit, in every reply of the chip, that is set while actual and target position are equal."""
        self._left = left_switch(smda)
        self._right = self._left >> 1
        self.values: dict[int, int] = {}
        self.open = False
        """The chip's V_MAX is open, not parameter 4."""
        self.scaled = False
        """The chip's V_MAX and A_MAX are those of an interpolated move."""
        self.reset(0)

    def reset(self, now: int) -> None:
        """Power-on: at rest with standby current, no search; a plain wave without mixed decay in the driver chain."""
        self.moving = False
        """Whether the motor moves, as far as the firmware has noticed."""
        self.power_due = NEVER
        """The clock at which the current goes down to standby."""
        self.free_due = NEVER
        """The clock at which the driver is switched off."""
        self.grace = 0
        """The clock before which a motor that stands still may not have begun yet."""
        self.look_due = NEVER
        """The clock at which the motor is looked at, whether or not the motion chip has an event of it by then."""
        self.rest_since = now
        self.decay = 0
        self.full_step = False
        """Decay and current cells that the driver chain has for this motor; see `drivers`."""
        self.search = ReferenceSearch.IDLE
        self.right_end = 0
        """Where the right switch closed in this search."""
        self.opened = 0
        """Where the left switch opened in this search."""

    # Registers

    def read(self, field: ChipField) -> int:
        """The value of a register field, with its sign."""
        word, _, mask, low, sign, _ = field
        value = (self.transfer(self.base | word) & mask) >> low
        return value - ((value & sign) << 1)

    def write(self, field: ChipField, value: int) -> None:
        """Set a register field, leaving the others of its register as they are; no write where they all are so."""
        read_word, word, mask, low, _, keep = field
        data = value << low & mask
        if keep:
            before = self.transfer(self.base | read_word)
            if before & mask == data:
                return
            data |= before & keep
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
        reply = self.transfer(self.ask_speed)
        if not reply & self.at_target_bit:
            return False
        speed = reply & V_ACTUAL.mask
        return self.open or min(speed, V_ACTUAL.mask + 1 - speed) <= self.values[AP.MIN_SPEED]

    @property
    def at_rest(self) -> bool:
        """Whether the ramp generator keeps the motor where it is.

        Speed and target speed are 0 both at rest and at the instant at which a motor turns round in position
        mode.  There the speed is changing, which A_ACTUAL tells; a motor that a switch holds, or that stays short
        of its target for another reason, does not change its speed.

        Source: fidelity FW-40.
        """
        reply = self.transfer(self.ask_speed)
        if reply & V_ACTUAL.mask or self.read(V_TARGET):
            return False
        return self.open or bool(reply & self.at_target_bit) or not self.read(A_ACTUAL)

    @property
    def steady(self) -> bool:
        """Whether the motor goes on as it does now: at rest at its target, or in velocity mode at its target speed."""
        if self.read(RAMP_MODE) == VELOCITY:
            return self.read(V_ACTUAL) == self.read(V_TARGET)
        return self.settled

    @property
    def settled(self) -> bool:
        """Whether the motor is at rest at its target position."""
        reply = self.transfer(self.ask_speed)
        return not reply & V_ACTUAL.mask and bool(reply & self.at_target_bit)

    def set_acceleration(self, acceleration: int) -> None:
        """Write A_MAX and the braking factors that belong to it and to the divisors.

        Source: TMC429 datasheet 8.1.10; fidelity CHIP-9, FW-23.
        """
        divisors = self.values[AP.RAMP_DIVISOR], self.values[AP.PULSE_DIVISOR]
        p_mul, p_div = brake_factor(acceleration, *divisors)
        word = PMUL.write_word
        self.transfer(self.base | word | p_mul << PMUL.low | p_div << PDIV.low)
        self.write(A_MAX, acceleration)

    def restore_limits(self) -> None:
        """Put parameters 4 and 5 back into the chip after velocity mode or an interpolated move."""
        if self.open or self.scaled:
            self.write(V_MAX, self.values[AP.MAX_SPEED])
            self.open = False
        if self.scaled:
            self.set_acceleration(self.values[AP.MAX_ACCELERATION])
            self.scaled = False

    def scale_limits(self, speed: int, acceleration: int) -> None:
        """Take other limits for one move."""
        self.write(V_MAX, speed)
        self.set_acceleration(acceleration)
        self.open = False
        self.scaled = True

    # State as a plain value

    def save(self) -> Value:
        """What is not in the motion chip."""
        return (
            tuple(sorted(self.values.items())), self.open, self.scaled, self.moving, self.power_due, self.free_due,
            self.grace, self.look_due, self.rest_since, self.decay, self.full_step, int(self.search), self.right_end,
            self.opened,
        )  # fmt: skip

    def load(self, value: Any) -> None:
        """Go back to what `save` gave."""
        (
            values, self.open, self.scaled, self.moving, self.power_due, self.free_due,
            self.grace, self.look_due, self.rest_since, self.decay, self.full_step, search, self.right_end,
            self.opened,
        ) = value  # fmt: skip
        self.values = dict(values)
        self.search = ReferenceSearch(search)
