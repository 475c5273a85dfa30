"""TMC423 triple incremental encoder interface, the chip of a TMCM-323 encoder module.

Models position counters with prescalers, null channel functions, common hold and null flags behind 32-bit
datagrams.  Leaves out: the step and direction converter, the reference switch multiplexers, the LED and switch
matrices, the nINT pin.  Counting is done when the chip is asked: `sample` must be called where a shaft turns
round, so that null marks passed on the way are seen.

Source: TMC423 data sheet V1.3, chapters 5 to 7.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, Protocol

from tmcm34x.clock import Value

ENCODERS: Final = 3
UNITS: Final = 80
"""Counters hold eightieths, in which both sixteenths and fifths are whole."""

WRITE: Final = 0x01
"""Bit 0 of the first byte: set to write."""
CONFIGURATION: Final = (0x00, 0x02, 0x04)
"""First byte of the configuration of encoders 1 to 3; `WRITE` must be added, they cannot be read."""
CONFIGURATION_ALL: Final = 0x06
POSITION: Final = (0x08, 0x0A, 0x0C)
"""First byte of the position registers of encoders 1 to 3."""
TIMING: Final = 0x0E
CONTROL: Final = 0x10
NULL_CHANNELS: Final = 0x12

PRESCALER_SHIFT: Final = 12
FIFTHS: Final = 1 << 23
NULL_ACTIVE_HIGH: Final = 1 << 11
HOLD_ON_NULL: Final = 1 << 10
CLEAR_ON_NULL: Final = 1 << 9
EVERY_NULL: Final = 1 << 8
REVERSE: Final = 1 << 7
DEFAULT_CONFIGURATION: Final = 0x010 << PRESCALER_SHIFT
"""Prescaler 1, no null channel function."""

COMMON_HOLD: Final = 1 << 23
INTERRUPT_ENABLE: Final = 1 << 22
CLEAR_FLAGS: Final = 1 << 21


class Shaft(Protocol):
    """What turns an encoder: quadrature edges and the null mark."""

    @property
    def edges_per_turn(self) -> int:
        """Four times the lines of the disc."""
        ...

    @property
    def null_level(self) -> int | None:
        """Level of the null channel at its mark, one edge wide; None without a null channel."""
        ...

    def edges(self) -> int:
        """Quadrature edges passed since the start, signed; the marks are at multiples of `edges_per_turn`."""
        ...


def prescaler(configuration: int) -> int:
    """What an edge adds to the counter, in eightieths: 12 bits from bit 12 of a configuration.

    Bits 22..16 are whole; bits 15..12 are sixteenths, or fifths if bit 23 is set.
    Source: TMC423 data sheet table 6.
    """
    whole, fraction = (configuration >> 16) & 0x7F, (configuration >> PRESCALER_SHIFT) & 15
    return UNITS * whole + fraction * (UNITS // 5 if configuration & FIFTHS else UNITS // 16)


def configuration(parameter: int) -> int:
    """The configuration that axis parameter 210 stands for.

    Parameter 210 is the configuration without its seven reserved bits: 512 is prescaler 1, bits 4..0 are the null
    channel functions (fidelity WORLD-2).
    """
    return (parameter << 7) & 0xFF_FF80


def datagram(address: int, data: int = 0, *, write: bool = False) -> int:
    """The 32 bits that read or write a register."""
    return (address | write) << 24 | data & 0xFF_FFFF


class Counter:
    """One of the three encoder interfaces.

    A null channel whose polarity is set the wrong way round is active all the time; the gap of one edge at its mark
    is left out.
    """

    def __init__(self, shaft: Shaft | None) -> None:
        self.shaft = shaft
        self.reset()

    def reset(self) -> None:
        """Power-on: position 0, prescaler 1."""
        self.configuration = DEFAULT_CONFIGURATION
        self.null_seen = False
        self._edges = self.shaft.edges() if self.shaft else 0
        self._count = 0
        self._clear = False
        self._held: int | None = None

    def save(self) -> Value:
        """Configuration and counter."""
        return (self.configuration, self.null_seen, self._edges, self._count, self._clear, self._held)

    def load(self, value: Any) -> None:
        """Become a counter that was saved."""
        self.configuration, self.null_seen, self._edges, self._count, self._clear, self._held = value

    def configure(self, word: int) -> None:
        """Take bits 23..7 of a configuration datagram."""
        self.sample()
        self.configuration = word & 0xFF_FF80
        self._clear = bool(word & CLEAR_ON_NULL)
        self._held = None
        self.sample()
        if word & HOLD_ON_NULL and self._always_active:
            self._held = self.position

    @property
    def waits_for_null(self) -> bool:
        """Whether a null mark passed on the way makes a difference."""
        return self._clear

    @property
    def _always_active(self) -> bool:
        level = self.shaft.null_level if self.shaft else None
        return level is not None and level != bool(self.configuration & NULL_ACTIVE_HIGH)

    @property
    def at_null(self) -> bool:
        """Whether the shaft stands at its null mark."""
        shaft = self.shaft
        return (
            shaft is not None and shaft.null_level is not None and shaft.edges() % shaft.edges_per_turn == 0
        )

    def _null_place(self, start: int, end: int) -> int | None:
        """Where the null channel was active between two places: the last time, or the first if only that counts."""
        if self.shaft is None or self.shaft.null_level is None:
            return None
        if self._always_active:
            return end
        turn = self.shaft.edges_per_turn
        low, high = min(start, end), max(start, end)
        last = bool(self.configuration & EVERY_NULL)
        mark = high // turn * turn if (end >= start) == last else -(-low // turn) * turn
        return mark if low <= mark <= high else None

    def sample(self) -> None:
        """Count the edges since the last time; the shaft must not have turned round in between."""
        if self.shaft is None:
            return
        start, end = self._edges, self.shaft.edges()
        step = prescaler(self.configuration) * (-1 if self.configuration & REVERSE else 1)
        place = self._null_place(start, end)
        self._edges = end
        self._count += (end - start) * step
        if place is not None:
            self.null_seen = True
            if self._clear:
                self._count = (end - place) * step
                self._clear = place == end or bool(self.configuration & EVERY_NULL)

    @property
    def position(self) -> int:
        """The counter's whole part, 24 bits, unsigned."""
        return (self._count // UNITS if self._held is None else self._held) & 0xFF_FFFF

    def preview(self) -> int:
        """What `position` would be after sampling now; nothing is counted."""
        saved = self.save()
        self.sample()
        position = self.position
        self.load(saved)
        return position

    def preload(self, value: int) -> None:
        """Set the counter, dropping its fraction."""
        self.sample()
        self._count = (((value + 0x80_0000) & 0xFF_FFFF) - 0x80_0000) * UNITS


class Tmc423:
    """The encoder chip: three counters behind one chip select."""

    def __init__(self, shafts: Sequence[Shaft | None] = (None, None, None)) -> None:
        self.counters = tuple(Counter(shaft) for shaft in shafts)
        self._held: tuple[int, ...] | None = None

    def reset(self) -> None:
        """Power-on."""
        for counter in self.counters:
            counter.reset()
        self._held = None

    def save(self) -> Value:
        """The counters, and the positions that are held."""
        return tuple([counter.save() for counter in self.counters]), self._held

    def load(self, value: Any) -> None:
        """Become a chip that was saved."""
        counters, self._held = value
        for counter, saved in zip(self.counters, counters, strict=True):
            counter.load(saved)

    def sample(self) -> None:
        """Count what the shafts have turned; to be called where one turns round."""
        for counter in self.counters:
            counter.sample()

    def exchange(self, data: int, nbytes: int) -> int:
        """One transfer on the serial bus, most significant bit first.

        A datagram of other than four bytes does nothing.  Returns the null flags in bits 30..28 and the register.
        """
        self.sample()
        if nbytes != 4:
            return 0
        address, value = (data >> 24) & 0xFE, data & 0xFF_FFFF
        reply = self._register(address)
        if data >> 24 & WRITE:
            self._write(address, value)
            reply = 0
        return self._flags() | reply

    def preview(self, n: int) -> int:
        """The position register of encoder `n` as `exchange` would read it now; nothing is counted."""
        return self.counters[n].preview() if self._held is None else self._held[n]

    def _flags(self) -> int:
        return sum(counter.null_seen << (30 - n) for n, counter in enumerate(self.counters))

    def _register(self, address: int) -> int:
        if address in POSITION:
            n = POSITION.index(address)
            return self.counters[n].position if self._held is None else self._held[n]
        if address == NULL_CHANNELS:
            return sum(counter.at_null << (18 + n) for n, counter in enumerate(self.counters))
        return 0

    def _write(self, address: int, value: int) -> None:
        if address in CONFIGURATION:
            self.counters[CONFIGURATION.index(address)].configure(value)
        elif address == CONFIGURATION_ALL:
            for counter in self.counters:
                counter.configure(value)
        elif address in POSITION:
            self.counters[POSITION.index(address)].preload(value)
        elif address == CONTROL:
            if value & CLEAR_FLAGS:
                for counter in self.counters:
                    counter.null_seen = False
            self._held = tuple(counter.position for counter in self.counters) if value & COMMON_HOLD else None
