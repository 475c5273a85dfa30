"""The three modules: one row each.

Columns:

number            type number, as in the binary version reply
version           firmware version string, the eight characters of command 136
parts             motion chips, by part number
wiring            for each motor: index of its motion chip, and the motor number within that chip (SMDA)
smgp              what the firmware writes into each motion chip's common parameters at power-on
if_configuration  the same for its interface configuration: with EN_REFR right switches have pins of their own
driver_chain      64 cells for each motion chip: how it talks to its drivers
drivers           part number of the motor drivers, or None where step and direction leave the board
max_current_ma    coil current (RMS) of current setting 255, or None
max_step_hz       fastest microsteps by the manual
shutdown_pin      number of the SHUTDOWN pin on the 68-pin connector

Sources: manual 2.1 to 2.3 and 6.7.15.1; TMC429 datasheet rev. 2.06, 8.2.5, 9 and 11.4; wiring of the switches
and the step and direction codes: fidelity FW-1.
"""

from __future__ import annotations

from math import floor, pi, sin
from types import MappingProxyType
from typing import Final, Literal, NamedTuple

from tmcm34x.chips.registers import FIELDS

CELLS: Final = 64
"""Cells of the driver chain, and of the microstep table."""

FIRMWARE_MAJOR: Final = 4
FIRMWARE_MINOR: Final = 36

LAST: Final = 0x20
"""Bit of a cell: last bit of this driver (NxM)."""
ZERO: Final = 0x10
ONE: Final = 0x11
DIRECTION: Final = 0x12
STEP: Final = 0x13
FAST_DECAY_A: Final = 0x07
FAST_DECAY_B: Final = 0x0F

TMC236_CELLS: Final[tuple[int, ...]] = (ZERO, 5, 4, 3, 2, 6, ZERO, 13, 12, 11, 10, LAST | 14)
"""The word of a TMC236, 239, 246 or 249: mixed decay, four current bits and phase, for bridge A and B."""


class Model(NamedTuple):
    """One row of `MODELS`; the module docstring names the columns."""

    number: int
    version: str
    parts: tuple[Literal["TMC428", "TMC429"], ...]
    wiring: tuple[tuple[int, int], ...]
    smgp: int
    if_configuration: int
    driver_chain: bytes
    drivers: str | None
    max_current_ma: int | None
    max_step_hz: int
    shutdown_pin: int

    @property
    def name(self) -> str:
        """What is printed on the module."""
        return f"TMCM-{self.number}"

    @property
    def binary_version(self) -> int:
        """The version as command 136 type 1 answers it: type number, major and minor version."""
        return self.number << 16 | FIRMWARE_MAJOR << 8 | FIRMWARE_MINOR


def _register(**fields: int) -> int:
    data = 0
    for name, value in fields.items():
        data = FIELDS[name][1].put(data, value)
    return data


def _chain(*cells: int) -> bytes:
    return bytes(cells) + bytes((ONE,)) * (CELLS - len(cells))


_THREE_DRIVERS: Final = _chain(*TMC236_CELLS * 3)
_ONE_CHIP: Final = ((0, 0), (0, 1), (0, 2))
_SPI: Final = _register(CONTINUOUS_UPDATE=1, CLK2_DIV=7, LSMD=2), _register(EN_REFR=1)

MODELS: Final = MappingProxyType({
    341: Model(341, "341V4.36", ("TMC429",), _ONE_CHIP, *_SPI, _THREE_DRIVERS, "TMC249", None, 460_000, 32),
    342: Model(
        342, "342V4.36", ("TMC429", "TMC429", "TMC429"), ((0, 0), (1, 0), (2, 0)), _register(MOT1R=1, CLK2_DIV=7), 0,
        _chain(STEP, LAST | DIRECTION), None, None, 300_000, 43,
    ),
    343: Model(343, "343V4.36", ("TMC429",), _ONE_CHIP, *_SPI, _THREE_DRIVERS, "TMC246", 1100, 460_000, 44),
})  # fmt: skip
"""All modules, by number."""

MICROSTEP_TABLE: Final = bytes(min(63, floor(0.5 + 64 * sin(pi / 2 * i / CELLS))) for i in range(CELLS))
"""A quarter of a sine wave, which the firmware loads into the motion chips (TMC429 datasheet 11.5)."""
