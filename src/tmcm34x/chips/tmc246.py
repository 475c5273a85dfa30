"""TMC236/239/246/249 stepper motor drivers: the 12-bit word on their serial bus.

Models the control word (phases, mixed decay, current codes), the status word (error flags, load value) and the
protective switching-off.  Everything is computed when a word is exchanged or a question asked; nothing runs in
between.  Leaves out: chopper timing, blank times, slope control, the overcurrent retries of a few milliseconds
(a short stays switched off until the outputs are disabled).

The load value of a TMC246/249 is qualitative (fidelity WORLD-1).

Source: TMC246 data sheet V2.02, chapters 3 to 5; the word is the same in the TMC236, TMC239 and TMC249.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import IntFlag
from types import MappingProxyType
from typing import Any, Final, NamedTuple

from tmcm34x.clock import Value

WORD_BITS: Final = 12
LOAD_MAX: Final = 7
"""The load value of a motor that runs without load: bits LD2..0, smaller for more load."""

MIXED_DECAY_A: Final = 1 << 11
PHASE_A: Final = 1 << 6
MIXED_DECAY_B: Final = 1 << 5
PHASE_B: Final = 1 << 0
CURRENT_A_SHIFT: Final = 7
CURRENT_B_SHIFT: Final = 1
ALWAYS_ONE: Final = 1 << 8
LOAD_SHIFT: Final = 9


class Flag(IntFlag):
    """The error flags, as in bits 7..0 of the status word and in axis parameter 208."""

    OCA = 1 << 0
    """Overcurrent, bridge A low side."""
    OCB = 1 << 1
    """Overcurrent, bridge B low side."""
    OLA = 1 << 2
    """Open load, bridge A."""
    OLB = 1 << 3
    """Open load, bridge B."""
    OCHS = 1 << 4
    """Overcurrent, high side."""
    UV = 1 << 5
    """Supply below 5.9 V."""
    OTPW = 1 << 6
    """Temperature prewarning, 145 degrees Celsius."""
    OT = 1 << 7
    """Overtemperature, 155 degrees Celsius."""


class DriverType(NamedTuple):
    """One row of `PARTS`."""

    name: str
    load_measurement: bool
    meaning: str


PARTS: Final = MappingProxyType(
    {
        row.name: row
        for row in (
            DriverType("TMC236", False, "integrated bridges"),
            DriverType("TMC239", False, "external transistors"),
            DriverType("TMC246", True, "integrated bridges, load measurement"),
            DriverType("TMC249", True, "external transistors, load measurement"),
        )
    }
)
"""The drivers that share this word."""


class DriverFault(NamedTuple):
    """One row of `FAULTS`: what can be wrong around a driver.

    raises: the flags it sets while current is asked of the bridges it touches
    bridges: the current codes that must not be 0000 for the flag to show; 0 if it always does
    stops: the motor gets no torque
    latched: the flag stays until the outputs are disabled or both codes are 0000
    """

    name: str
    raises: Flag
    bridges: str
    stops: bool
    latched: bool
    meaning: str


FAULTS: Final = MappingProxyType({
    row.name: row
    for row in (
        DriverFault("open_load_a", Flag.OLA, "a", True, False, "coil A is not connected"),
        DriverFault("open_load_b", Flag.OLB, "b", True, False, "coil B is not connected"),
        DriverFault("short_a", Flag.OCA | Flag.OLA, "a", True, True, "coil A is shorted to the supply"),
        DriverFault("short_b", Flag.OCB | Flag.OLB, "b", True, True, "coil B is shorted to the supply"),
        DriverFault(
            "short_to_ground", Flag.OCHS | Flag.OLA | Flag.OLB, "ab", True, True, "a coil is shorted to ground"
        ),
        DriverFault("under_voltage", Flag.UV | Flag.OLA | Flag.OLB, "", True, False, "the supply is below 5.9 V"),
        DriverFault("temperature_warning", Flag.OTPW, "", False, False, "the chip is at 145 degrees Celsius"),
        DriverFault("over_temperature", Flag.OT | Flag.OTPW | Flag.OLA | Flag.OLB, "", True, False,
              "the chip is above 155 degrees Celsius"),
    )
})  # fmt: skip
"""The faults a bench can put on a driver."""


class MotorCondition(NamedTuple):
    """How the motor on a driver runs at this moment.

    speed: full steps per second over the speed at which a free motor gives the greatest reading, 0 at rest
    load: torque asked of the motor over torque it has, 0..1; 1 when it is stalled
    """

    speed: float
    load: float


AT_REST: Final = MotorCondition(0.0, 0.0)


def load_reading(condition: MotorCondition, *, mixed_decay: bool = False) -> int:
    """The load value LD of a turning motor, 0 (stalled) to 7 (fast and free).

    Rises with speed, falls with load; mixed decay near the zero crossing of the current spoils it.
    Source: TMC246 data sheet chapter 3, whose curves have no numbers (fidelity WORLD-1).
    """
    reading = round(LOAD_MAX * min(1.0, condition.speed) * (1.0 - min(1.0, max(0.0, condition.load))))
    return max(0, reading - 2) if mixed_decay else reading


def _at_rest() -> MotorCondition:
    return AT_REST


class Tmc246:
    """One driver chip.

    `condition` returns how the motor runs; a bench sets it.  `enabled` is the ENN pin, true for outputs on.
    """

    def __init__(self, part: str = "TMC246") -> None:
        self.part = PARTS[part]
        self.condition: Callable[[], MotorCondition] = _at_rest
        self._faults: frozenset[str] = frozenset()
        self._load = 0
        self._enabled = True
        self.reset()

    def reset(self) -> None:
        """Power-on: all registers 0, coils off."""
        self.word = 0
        self._load = 0
        self._latched = Flag(0)

    def save(self) -> Value:
        """Registers, faults and the ENN pin."""
        return self.word, self._load, int(self._latched), tuple(sorted(self._faults)), self._enabled

    def load(self, value: Any) -> None:
        """Become a driver that was saved."""
        self.word, self._load, latched, faults, self._enabled = value
        self._latched, self._faults = Flag(latched), frozenset(faults)

    @property
    def enabled(self) -> bool:
        """Whether the ENN pin lets the outputs work; switching them off clears overcurrent flags."""
        return self._enabled

    @enabled.setter
    def enabled(self, enabled: bool) -> None:
        self._enabled = enabled
        if not enabled:
            self._latched = Flag(0)

    @property
    def current_codes(self) -> tuple[int, int]:
        """Current of bridges A and B, 0..15 fifteenths of the maximum; both 0 switches the coils off."""
        return (self.word >> CURRENT_A_SHIFT) & 15, (self.word >> CURRENT_B_SHIFT) & 15

    @property
    def standby(self) -> bool:
        """Whether both codes are 0000."""
        return self.current_codes == (0, 0)

    @property
    def mixed_decay(self) -> bool:
        """Whether either bridge uses mixed decay."""
        return bool(self.word & (MIXED_DECAY_A | MIXED_DECAY_B))

    @property
    def faults(self) -> frozenset[str]:
        """Names of the present faults, keys of `FAULTS`."""
        return self._faults

    def set_fault(self, name: str, on: bool) -> None:
        """Raise or end one of `FAULTS`."""
        row = FAULTS[name]
        self._faults = self._faults | {name} if on else self._faults - {name}
        if on and row.latched and self._enabled:
            self._latched |= self._raised(row)

    def _raised(self, row: DriverFault) -> Flag:
        codes = self.current_codes
        asked = [code for bridge, code in zip("ab", codes, strict=True) if bridge in row.bridges]
        return row.raises if not asked or any(asked) else Flag(0)

    @property
    def flags(self) -> Flag:
        """The error flags at this moment."""
        if not self._enabled:
            return Flag(0)
        present = self._latched
        for name in self._faults:
            present |= self._raised(FAULTS[name])
        code_a, code_b = self.current_codes
        if not code_a:
            present &= ~Flag.OLA
        if not code_b:
            present &= ~Flag.OLB
        return present

    @property
    def driving(self) -> bool:
        """Whether the motor gets torque: outputs enabled and no fault that switches a bridge off."""
        return self._enabled and not self._latched and not any(FAULTS[name].stops for name in self._faults)

    def status(self) -> int:
        """The status word: LD2..0, 1, OT, OTPW, UV, OCHS, OLB, OLA, OCB, OCA."""
        return self._load << LOAD_SHIFT | ALWAYS_ONE | self.flags

    def transfer(self, word: int) -> int:
        """Latch a control word and return the status word.

        word: MDA, CA3..0, PHA, MDB, CB3..0, PHB from bit 11 down
        """
        self.word = word & 0xFFF
        if self.standby:
            self._latched = Flag(0)
        elif self._enabled:
            for name in self._faults:
                if FAULTS[name].latched:
                    self._latched |= self._raised(FAULTS[name])
        if self.part.load_measurement:
            condition = self.condition()
            if condition.speed:
                self._load = load_reading(condition, mixed_decay=self.mixed_decay)
        return self.status()

    def preview(self, word: int) -> int:
        """The status word that `transfer` would return now; nothing is latched."""
        saved = self.save()
        status = self.transfer(word)
        self.load(saved)
        return status
