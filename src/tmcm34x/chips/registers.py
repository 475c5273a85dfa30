"""The register map of TMC428 and TMC429, and the 32-bit datagrams that reach it.

A datagram is 32 bits, most significant first: RRS (1 = on-chip RAM), two bits SMDA (motor 0..2, 3 = common
registers), four bits IDX or JDX, RW (1 = read), 24 data bits.  The reply to the same transfer is the status
byte and 24 bits read, which are zero after a write.

Columns of a register:

name      the datasheet's (without its _429 suffix); of a one-field register also the field's
area      MOTOR: three copies, one per SMDA 0..2; COMMON: SMDA 3
index     IDX or JDX
fields    name, highest and lowest bit, access, signedness, value after power-on
          access: R readable, W writable, C cleared by writing ones
section   of the TMC429 datasheet, rev. 2.06
parts     chips that have it; in another one it reads zero and writes have no effect
ones      bits that always read one

Field names are unique over the whole map: `FIELDS["RAMP_DIV"]` finds register and bits.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType
from typing import Final, NamedTuple

MOTOR: Final = 0
COMMON: Final = 3
"""The SMDA of the registers that all motors share."""

READ: Final = 1 << 24
RAM: Final = 1 << 31
DATA: Final = 0xFFFFFF

BOTH: Final = frozenset({"TMC428", "TMC429"})
ONLY_429: Final = frozenset({"TMC429"})


class Field(NamedTuple):
    """Some bits of a register; the module docstring names the columns."""

    name: str
    high: int
    low: int
    access: str = "RW"
    signed: bool = False
    reset: int = 0

    @property
    def width(self) -> int:
        """Number of bits."""
        return self.high - self.low + 1

    @property
    def mask(self) -> int:
        """The field's bits within the 24 data bits."""
        return (1 << self.high + 1) - (1 << self.low)

    def get(self, data: int) -> int:
        """The field's value within `data`, with its sign if it has one."""
        value = (data & self.mask) >> self.low
        return sign_extended(value, self.width) if self.signed else value

    def put(self, data: int, value: int) -> int:
        """`data` with this field set to `value`; bits that do not fit are cut off."""
        return data & ~self.mask | value << self.low & self.mask


@dataclass(frozen=True, slots=True)
class Register:
    """One row of `REGISTERS`; the module docstring names the columns."""

    name: str
    area: int
    index: int
    fields: tuple[Field, ...]
    section: str
    parts: frozenset[str] = BOTH
    ones: int = 0

    @property
    def writable(self) -> int:
        """The data bits that keep what is written."""
        return sum(field.mask for field in self.fields if "W" in field.access)

    @property
    def reset(self) -> int:
        """The data bits after power-on."""
        return sum(field.reset << field.low for field in self.fields)

    def write(self, data: int, motor: int = COMMON) -> int:
        """The datagram that writes this register (of `motor`, unless it is a common one)."""
        return write(motor if self.area == MOTOR else COMMON, self.index, data)

    def read(self, motor: int = COMMON) -> int:
        """The datagram that reads this register (of `motor`, unless it is a common one)."""
        return read(motor if self.area == MOTOR else COMMON, self.index)


def _value(name: str, bits: int, access: str = "RW", *, signed: bool = False) -> tuple[Field, ...]:
    return (Field(name, bits - 1, 0, access, signed),)


def _flags(*names: str, low: int, access: str = "RW") -> tuple[Field, ...]:
    return tuple(Field(name, low + bit, low + bit, access) for bit, name in enumerate(names))


_INTERRUPTS: Final = (
    "POS_END",
    "REF_WRONG",
    "REF_MISS",
    "STOP",
    "STOP_LEFT_LOW",
    "STOP_RIGHT_LOW",
    "STOP_LEFT_HIGH",
    "STOP_RIGHT_HIGH",
)

REGISTERS: Final = (
    Register("X_TARGET", MOTOR, 0, _value("X_TARGET", 24, signed=True), "8.1.1"),
    Register("X_ACTUAL", MOTOR, 1, _value("X_ACTUAL", 24, signed=True), "8.1.2"),
    Register("V_MIN", MOTOR, 2, _value("V_MIN", 11), "8.1.3"),
    Register("V_MAX", MOTOR, 3, _value("V_MAX", 11), "8.1.4"),
    Register("V_TARGET", MOTOR, 4, _value("V_TARGET", 12, signed=True), "8.1.5"),
    Register("V_ACTUAL", MOTOR, 5, _value("V_ACTUAL", 12, signed=True), "8.1.6"),
    Register("A_MAX", MOTOR, 6, _value("A_MAX", 11), "8.1.7"),
    Register("A_ACTUAL", MOTOR, 7, _value("A_ACTUAL", 12, "R", signed=True), "8.1.8"),
    Register(
        "I_SCALES_A_THRESHOLD",
        MOTOR,
        8,
        (
            Field("IS_AGTAT", 22, 20),
            Field("IS_ALEAT", 18, 16),
            Field("IS_V0", 14, 12),
            Field("A_THRESHOLD", 10, 0),
        ),
        "8.1.9",
    ),
    Register(
        "PMUL_PDIV", MOTOR, 9, (Field("PMUL", 15, 8, reset=128), Field("PDIV", 3, 0)), "8.1.10", ones=0x8000
    ),
    Register(
        "REF_CONF_RAMP_MODE",
        MOTOR,
        10,
        (
            Field("LP", 16, 16, "R"),
            Field("REF_RNL", 11, 11),
            Field("SOFT_STOP", 10, 10),
            Field("DISABLE_STOP_R", 9, 9),
            Field("DISABLE_STOP_L", 8, 8),
            Field("RAMP_MODE", 1, 0),
        ),
        "8.1.11",
    ),
    Register(
        "INTERRUPTS",
        MOTOR,
        11,
        _flags(*(f"INT_{name}" for name in _INTERRUPTS), low=0, access="RC")
        + _flags(*(f"MASK_{name}" for name in _INTERRUPTS), low=8),
        "8.1.12",
    ),
    Register(
        "DIVISORS",
        MOTOR,
        12,
        (Field("PULSE_DIV", 15, 12), Field("RAMP_DIV", 11, 8), Field("USRS", 2, 0)),
        "8.1.13",
    ),
    Register("DX_REF_TOLERANCE", MOTOR, 13, _value("DX_REF_TOLERANCE", 12), "8.1.14"),
    Register("X_LATCHED", MOTOR, 14, _value("X_LATCHED", 24, "R", signed=True), "8.1.15"),
    Register("USTEP_COUNT", MOTOR, 15, _value("USTEP_COUNT", 8, "R"), "8.1.16", ONLY_429),
    Register("DATAGRAM_LOW_WORD", COMMON, 0, _value("DATAGRAM_LOW_WORD", 24, "R"), "8.2.1"),
    Register("DATAGRAM_HIGH_WORD", COMMON, 1, _value("DATAGRAM_HIGH_WORD", 24, "R"), "8.2.1"),
    Register(
        "COVER_POSITION_LEN",
        COMMON,
        2,
        (Field("CW", 23, 23, "R"), Field("COVER_POSITION", 13, 8), Field("COVER_LEN", 4, 0)),
        "8.2.2",
    ),
    Register("COVER_DATAGRAM", COMMON, 3, _value("COVER_DATAGRAM", 24), "8.2.3"),
    Register(
        "IF_CONFIGURATION",
        COMMON,
        4,
        (
            Field("EN_REFR", 8, 8),
            Field("POS_COMP_SEL", 7, 6),
            *_flags("INV_REF", "SDO_INT", "STEP_HALF", "INV_STP", "INV_DIR", "EN_SD", low=0),
        ),
        "8.2.4",
        ONLY_429,
    ),
    Register("POS_COMP", COMMON, 5, _value("POS_COMP", 24, signed=True), "8.2.4.1", ONLY_429),
    Register(
        "POS_COMP_INT",
        COMMON,
        6,
        (Field("MASK_POS_COMP", 8, 8), Field("INT_POS_COMP", 0, 0, "RC")),
        "8.2.4.2",
        ONLY_429,
    ),
    Register("POWER_DOWN", COMMON, 8, (), "8.2.4.3"),
    Register(
        "TYPE_VERSION", COMMON, 9, (Field("TYPE_VERSION", 23, 0, "R", reset=0x429101),), "8.2.4.4", ONLY_429
    ),
    Register(
        "SWITCHES", COMMON, 14, _flags("R1", "L1", "R2", "L2", "R3", "L3", low=0, access="R"), "8.2.4.5"
    ),
    Register(
        "SMGP",
        COMMON,
        15,
        (
            Field("MOT1R", 21, 21),
            Field("REFMUX", 20, 20),
            Field("CONTINUOUS_UPDATE", 16, 16),
            Field("CLK2_DIV", 15, 8, reset=15),
            *_flags(
                "POL_NSCS_S",
                "POL_SCK_S",
                "POL_PH_AB",
                "POL_FD_AB",
                "POL_DAC_AB",
                "CS_COMMON_INDIVIDUAL",
                low=2,
            ),
            Field("LSMD", 1, 0),
        ),
        "8.2.5",
    ),
)
"""Every register.  In step and direction mode bits 11..8 of SMGP set the pulse length (STPDIV)."""

BY_NAME: Final = MappingProxyType({register.name: register for register in REGISTERS})
BY_INDEX: Final = MappingProxyType({(register.area, register.index): register for register in REGISTERS})
FIELDS: Final = MappingProxyType(
    {field.name: (register, field) for register in REGISTERS for field in register.fields}
)

INT: Final = 0x80
"""Status byte: an enabled interrupt flag is set."""
CDGW: Final = 0x40
"""Status byte: a cover datagram waits, or the datagram words do."""


def at_target(motor: int) -> int:
    """The bit of the status byte (and of no register) that says X_ACTUAL = X_TARGET."""
    return 1 << 2 * motor


def left_switch(motor: int) -> int:
    """The bit of the status byte that shows the left switch, active high."""
    return 2 << 2 * motor


def write(motor: int, index: int, data: int) -> int:
    """The datagram that writes 24 bits to a register of `motor` 0..2, or a common one (3)."""
    return motor << 29 | index << 25 | data & DATA


def read(motor: int, index: int) -> int:
    """The datagram that reads a register of `motor` 0..2, or a common one (3)."""
    return motor << 29 | index << 25 | READ


def write_ram(address: int, even: int, odd: int) -> int:
    """The datagram that writes the RAM cells 2*address and 2*address + 1, six bits each."""
    return RAM | address << 25 | (odd & 63) << 8 | even & 63


def read_ram(address: int) -> int:
    """The datagram that reads the RAM cells 2*address (bits 5..0) and 2*address + 1 (bits 13..8)."""
    return RAM | address << 25 | READ


def data(reply: int) -> int:
    """The 24 data bits of a reply."""
    return reply & DATA


def sign_extended(value: int, bits: int) -> int:
    """The value of a two's complement number of so many bits."""
    sign = 1 << bits - 1
    return (value & (sign << 1) - 1 ^ sign) - sign
