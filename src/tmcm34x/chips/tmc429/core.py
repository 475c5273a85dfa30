"""What a TMC429 or TMC428 remembers, and the questions that all of its functions ask."""

from __future__ import annotations

from collections.abc import Callable
from hashlib import shake_128
from math import floor, pi, sin
from typing import Any, Final, Literal

from tmcm34x.chips.ramp import RampAxis, RampState
from tmcm34x.chips.registers import BY_INDEX, COMMON, FIELDS, MOTOR, REGISTERS
from tmcm34x.clock import NEVER, Value

MOTORS: Final = range(3)
ALL_MOTORS: Final = 7

INDEX: Final = {register.name: register.index for register in REGISTERS}
FIELD: Final = {name: field for name, (_, field) in FIELDS.items()}

INTERRUPTS: Final = INDEX["INTERRUPTS"]
POS_COMP_INT: Final = INDEX["POS_COMP_INT"]
REF_CONF_RAMP_MODE: Final = INDEX["REF_CONF_RAMP_MODE"]
X_TARGET: Final = INDEX["X_TARGET"]
X_ACTUAL: Final = INDEX["X_ACTUAL"]
V_MIN: Final = INDEX["V_MIN"]
V_MAX: Final = INDEX["V_MAX"]
V_TARGET: Final = INDEX["V_TARGET"]
V_ACTUAL: Final = INDEX["V_ACTUAL"]
A_MAX: Final = INDEX["A_MAX"]
A_ACTUAL: Final = INDEX["A_ACTUAL"]
I_SCALES: Final = INDEX["I_SCALES_A_THRESHOLD"]
PMUL_PDIV: Final = INDEX["PMUL_PDIV"]
DIVISORS: Final = INDEX["DIVISORS"]
DX_REF_TOLERANCE: Final = INDEX["DX_REF_TOLERANCE"]
X_LATCHED: Final = INDEX["X_LATCHED"]
USTEP_COUNT: Final = INDEX["USTEP_COUNT"]

CHAIN_END: Final = 0x20
"""Chain configuration: this bit is the last of its driver (NxM)."""

DRIVER_CHAIN: Final = bytes((0x11, 5, 4, 3, 2, 6, 0x11, 13, 12, 11, 10, 14 | CHAIN_END)) * 3 + b"\x11" * 28
"""The chain configuration of a TMC429 after power-on: three TMC236 (MDA CA3..0 PHA MDB CB3..0 PHB), mixed decay."""

QUARTER_SINE: Final = bytes(min(63, floor(0.5 + 64 * sin(pi / 2 * i / 64))) for i in range(64))
"""The wave table of a TMC429 after power-on (fidelity CHIP-14)."""

ChipName = Literal["TMC428", "TMC429"]


class Core:
    """Registers, RAM, axes and lines of a chip, and when something happens next.

    now: the clock the chip has been brought to
    origin: the clock that its ticks are counted from
    asleep: the clock at which POWER_DOWN stopped the ticks, or `NEVER`
    common, words: registers by index, the common ones and those of each motor
    ram: chain configuration and wave table
    levels, sampled, switches: the input lines, as the chip read them last, and the switches that they mean
    unsampled: whether multiplexed lines are to be read by the next driver datagram
    cover, armed: whether a cover datagram or the datagram words wait for a driver datagram
    flight: the clock at which the driver datagram that is being sent ends, or `NEVER`
    sent: what the driver datagram that is being sent was waited for, bits of `chain`
    watched: positions of each axis that its step out of them is an event, or None
    duration, scaled, marks, due, status, stays, holds, changed, changed_at: derived, see `derive`
    """

    def __init__(self, part: ChipName, seed: int) -> None:
        self.part: Final = part
        self.seed: Final = seed
        self.driver_status: Callable[[], int] | None = None
        self.on_plan: list[Callable[[int], None]] = []
        """Called with a motor that moves otherwise than `motion` said, or that has an event of its own."""
        self.on_restart: list[Callable[[], None]] = []
        """Called before a reset."""
        self.now: int = 0
        self.levels: int = 0
        self.watched: list[tuple[int, int] | None] = [None, None, None]
        self.clear()

    def clear(self) -> None:
        """Power-on at `now`: everything but the lines and what is watched is forgotten."""
        self.origin: int = self.now
        self.asleep: int = NEVER
        self.common = self._reset_words(COMMON)
        self.words = [self._reset_words(MOTOR) for _ in MOTORS]
        if self.part == "TMC429":
            self.ram = bytearray(DRIVER_CHAIN + QUARTER_SINE)
        else:
            noise = shake_128(self.seed.to_bytes(8, "big", signed=True)).digest(128)
            self.ram = bytearray(cell & 63 for cell in noise)
        self.axes = [RampAxis() for _ in MOTORS]
        self.flight: int = NEVER
        self.cover = self.armed = self.unsampled = False
        self.sent: int = 0
        self.sampled: int = self.levels
        self.switches: int = 0
        self.derive()

    def _reset_words(self, area: int) -> list[int]:
        """The registers of an area after power-on, by index."""
        rows = (BY_INDEX.get((area, index)) for index in range(16))
        return [row.reset if row and self.part in row.parts else 0 for row in rows]

    def derive(self) -> None:
        """Compute what follows from the rest."""
        self.marks = [-1, -1, -1]
        """The next tick of each axis at which it has an event, or one that has passed."""
        self.due = -1
        """The clock of the next event, or -1 while it is not known."""
        self.status = -1
        """The status byte at `now`, or -1 while it is not known: set to -1 by whatever may change it."""
        self.stays: list[bool | None] = [None, None, None]
        """Whether an axis is at its target, and will be so or not so until its next event; None: not known."""
        self.holds = False
        """Whether its bits of axes at their targets hold until the next event."""
        self.changed = 0
        """Motors, as bits, to which the last event may have meant more than another acceleration."""
        self.changed_at = -1
        """The clock of that event."""
        self.scaled = any(words[I_SCALES] for words in self.words)
        """Whether any current scale is set."""
        self.derive_duration()

    def derive_duration(self) -> None:
        """Compute from RAM and SMGP how long a driver datagram takes."""
        self.duration = 0
        """Clocks that a driver datagram takes; 0 where none is ever finished."""
        end = self.chain_end()
        if end and not self.setting("EN_SD"):
            self.duration = 2 * (self.setting("CLK2_DIV") + 1) * (end + self.drivers() + 2)

    # State

    def save(self) -> Value:
        """All but what is derived."""
        return (
            (self.now, self.origin, self.asleep, tuple(self.common), tuple(map(tuple, self.words))),
            (bytes(self.ram), tuple([axis.save() for axis in self.axes]), tuple(self.watched)),
            (self.levels, self.sampled, self.switches, self.unsampled),
            (self.cover, self.armed, self.flight, self.sent),
        )

    def load(self, value: Any) -> None:
        """Become a chip that was saved."""
        (self.now, self.origin, self.asleep, common, words), (ram, axes, watched), lines, datagram = value
        self.common, self.words = list(common), [list(row) for row in words]
        self.ram, self.watched = bytearray(ram), list(watched)
        for axis, saved in zip(self.axes, axes, strict=True):
            axis.load(saved)
        self.levels, self.sampled, self.switches, self.unsampled = lines
        self.cover, self.armed, self.flight, self.sent = datagram
        self.derive()

    # Questions

    def tick(self) -> int:
        """Ticks of 32 clocks since power-on, as far as the chip's clock ran."""
        now = self.now
        return (now if now < self.asleep else self.asleep) - self.origin >> 5

    def state(self, motor: int) -> RampState:
        """The state of an axis now."""
        return self.axes[motor].at(self.tick())

    def setting(self, name: str) -> int:
        """A field of SMGP or IF_CONFIGURATION."""
        return FIELD[name].get(self.common[FIELDS[name][0].index])

    def reference(self, motor: int) -> bool:
        """Whether the reference switch of a motor is active."""
        right = FIELD["REF_RNL"].get(self.words[motor][REF_CONF_RAMP_MODE])
        return bool(self.switches >> 2 * motor & (1 if right else 2))

    def drivers(self) -> int:
        """The number of drivers in the chain."""
        return min(self.setting("LSMD") + 1, 3)

    def chain_end(self) -> int:
        """The number of bits of a driver datagram, or 0 if the configuration holds no end."""
        drivers = self.drivers()
        for position in range(64):
            drivers -= self.ram[position] >> 5
            if not drivers:
                return position + 1
        return 0

    # Another future

    def replan(self, motor: int) -> None:
        """Look for the next event of an axis anew."""
        self.marks[motor] = -1
        self.stays[motor] = None
        self.due = self.status = -1

    def replan_all(self) -> None:
        """Look for the next events anew."""
        self.marks = [-1, -1, -1]
        self.stays = [None, None, None]
        self.due = self.status = -1

    def cut(self, motor: int, state: RampState) -> None:
        """Begin another plan of an axis."""
        self.axes[motor].cut(state)
        self.status = -1
        self.plan_changed(motor)

    def plan_changed(self, motor: int) -> None:
        """Call the listeners."""
        for listener in self.on_plan:
            listener(motor)
