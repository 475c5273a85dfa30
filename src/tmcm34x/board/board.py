"""A module's circuit board: motion chips, motor drivers, pins.

Two sides.  The firmware exchanges datagrams with the motion chips, reads inputs and sets outputs.  The world
works the pins: switches, analogue levels, SHUTDOWN, devices on the external SPI bus, motors on the drivers.
The board itself keeps levels only; what moves in time are the motion chips.

Switch levels are those that the chips see: true is active, whatever polarity the contact has.

Source: manual 2 and 6.7.14, 6.7.15, 6.7.24; wiring: `models`; thresholds and idle levels: fidelity FW-2, FW-3.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, Literal, Protocol, SupportsIndex

from tmcm34x.board.circuit import SpiDevice
from tmcm34x.board.models import MODELS, Model
from tmcm34x.chips.tmc429 import Tmc429
from tmcm34x.clock import NEVER, Value, digest

INPUTS: Final = 8
OUTPUTS: Final = 8
ANALOG_MAX: Final = 1023
ANALOG_THRESHOLD: Final = 512
"""An ADIN line reads 1 as a digital input from here up."""
SELECTS: Final = 3
"""Chip select lines of the external SPI bus."""

QUIET_DRIVER: Final = 0xF00
"""Status word where no driver is attached: no load, no error."""
DRIVER_BITS: Final = 12
_DRIVER_MASK: Final = (1 << DRIVER_BITS) - 1

Side = Literal["left", "right"]


class Driver(Protocol):
    """A motor driver in the motion chip's chain."""

    def transfer(self, word: int) -> int:
        """Take a control word of 12 bits, return the status word."""
        ...

    def preview(self, word: int) -> int:
        """The status word that `transfer` would return, without any effect."""
        ...


class Board:
    """A board of one `model`, a `circuit.Circuit` for the firmware; all pins idle, nothing attached."""

    def __init__(self, model: Model, *, seed: int = 0) -> None:
        self.model = model
        self._seed = seed
        self.chips = tuple(Tmc429(part, seed=seed + n) for n, part in enumerate(model.parts))
        alone = self.chips[0] if len(self.chips) == 1 else None
        self.next_event: Callable[[], int] = alone.next_event if alone else self._next_of_all
        """The next clock at which a motion chip has something to notice."""
        self.advance: Callable[[int], None] = alone.advance if alone else self._advance_all
        """Brings the motion chips to a clock."""
        self.changed_motors: Callable[[], int] = alone.changed_motors if alone else self._changed_of_all
        """The motors, as bits, to which an event at `now` may have meant more than another acceleration."""
        self.outputs = 0
        """The eight digital outputs, OUT_0 in bit 0."""
        self.currents = [0, 0, 0]
        """Current scaling of each motor's driver, 0..255 of the module's maximum."""
        self.enabled = [True, True, True]
        """Whether each motor's driver is switched on; off means freewheeling."""
        self.on_output: list[Callable[[int], None]] = []
        """Called with the outputs whenever one changes."""
        self.on_current: list[Callable[[int, int, bool], None]] = []
        """Called with motor, current 0..255 and whether the driver is on, whenever one of them changes."""
        self.on_pins: list[Callable[[], None]] = []
        """Called whenever the world changed a switch, an input or SHUTDOWN."""
        self._analog = [0] * INPUTS
        self._sources: list[Callable[[], int] | None] = [None] * INPUTS
        self._next_edges: list[Callable[[], int] | None] = [None] * INPUTS
        self._switches = 0
        self._shutdown = 0
        self._spi: list[SpiDevice | None] = [None] * SELECTS
        self._drivers: list[Driver | None] = [None] * len(model.wiring)
        if model.drivers is not None:
            self.chips[0].driver_status = self.driver_statuses

    # Time

    @property
    def now(self) -> int:
        """The clock the board has been brought to."""
        return self.chips[0].now

    def _next_of_all(self) -> int:
        return min([chip.due if chip.due >= 0 else chip.next_event() for chip in self.chips])

    def _advance_all(self, now: int) -> None:
        for chip in self.chips:
            chip.advance(now)

    def _changed_of_all(self) -> int:
        motors = 0
        for motor, (n, smda) in enumerate(self.model.wiring):
            chip = self.chips[n]
            if chip.changed_at == chip.now:
                motors |= (chip.changed >> smda & 1) << motor
        return motors

    def stays_within(self, motor: int, low: int, high: int) -> int:
        """The clock until which X_ACTUAL certainly stays within low..high, where it is, if no event comes before."""
        chip, smda = self.model.wiring[motor]
        return self.chips[chip].stays_within(smda, low, high)

    def position_at(self, motor: int, when: int) -> int:
        """X_ACTUAL of a motor at a clock before the next event."""
        chip, smda = self.model.wiring[motor]
        return self.chips[chip].position_at(smda, when)

    def reset(self) -> None:
        """Power-on: chips in their initial state, outputs low, drivers on without current."""
        for chip in self.chips:
            chip.reset()
        self._wire_switches()
        self.set_outputs(0)
        for motor in range(len(self.model.wiring)):
            self.set_current(motor, 0)
            self.driver_enable(motor, True)

    # State

    def save(self) -> Value:
        """Chips, outputs, and the levels of the pins; what is attached to the pins is the world's."""
        return (
            tuple([chip.save() for chip in self.chips]),
            (self.outputs, tuple(self.currents), tuple(self.enabled)),
            (tuple(self._analog), self._switches, self._shutdown),
        )

    def load(self, value: Any) -> None:
        """Become a board that was saved; no listener is called."""
        chips, (self.outputs, currents, enabled), (analog, self._switches, self._shutdown) = value
        for chip, saved in zip(self.chips, chips, strict=True):
            chip.load(saved)
        self.currents[:], self.enabled[:], self._analog[:] = currents, enabled, analog

    def digest(self) -> str:
        """A fingerprint of the state."""
        return digest(self.save())

    def __reduce_ex__(self, protocol: SupportsIndex, /) -> tuple[Any, ...]:
        """A copy has nothing attached to it, and no listeners."""
        return _rebuilt, (self.model.number, self._seed, self.save())

    # The firmware's side

    def wiring(self, motor: int) -> tuple[int, int]:
        """Index of the motor's chip, and its number within the chip."""
        return self.model.wiring[motor]

    def bus(self, chip: int) -> Callable[[int], int]:
        """The wire to a motion chip: takes a 32-bit datagram, returns the reply."""
        return self.chips[chip].transfer

    def transfer(self, chip: int, datagram: int) -> int:
        """Exchange one 32-bit datagram with a motion chip."""
        return self.chips[chip].transfer(datagram)

    def digital_inputs(self) -> int:
        """The eight inputs IN_0..IN_7 as bits."""
        return sum((self.analog_input(n) >= ANALOG_THRESHOLD) << n for n in range(INPUTS))

    def analog_input(self, n: int) -> int:
        """The level of IN_n, 0..1023."""
        source = self._sources[n]
        return self._analog[n] if source is None else source()

    def shutdown_level(self) -> int:
        """The level of the SHUTDOWN pin, 0 or 1."""
        return self._shutdown

    def set_outputs(self, bits: int) -> None:
        """Set all eight outputs."""
        if bits != self.outputs:
            self.outputs = bits
            for listener in self.on_output:
                listener(bits)

    def spi_exchange(self, select: int, data: int, nbytes: int) -> int:
        """One transfer of 1..4 bytes with select line 0..2; an open line reads zeros."""
        device = self._spi[select]
        if device is None:
            return 0
        mask = (1 << 8 * nbytes) - 1
        return device.exchange(data & mask, nbytes) & mask

    def spi_device(self, select: int) -> SpiDevice | None:
        """What is connected to select line 0..2."""
        return self._spi[select]

    def set_current(self, motor: int, current: int) -> None:
        """Set the driver's current scaling, 0..255; a TMCM-342 has no such wire."""
        if self.model.drivers is not None and current != self.currents[motor]:
            self.currents[motor] = current
            self._tell_current(motor)

    def driver_enable(self, motor: int, on: bool) -> None:
        """Switch the driver's outputs on, or off so that the motor turns freely."""
        if self.model.drivers is not None and on != self.enabled[motor]:
            self.enabled[motor] = on
            self._tell_current(motor)

    def _tell_current(self, motor: int) -> None:
        for listener in self.on_current:
            listener(motor, self.currents[motor], self.enabled[motor])

    # The world's side

    def set_switch(self, motor: int, side: Side, active: bool) -> None:
        """A reference or stop switch of a motor; active as the chip sees it."""
        bit = (2 if side == "left" else 1) << 2 * motor
        switches = self._switches | bit if active else self._switches & ~bit
        if switches != self._switches:
            self._switches = switches
            self._wire_switches()
            self._tell_pins()

    def switch(self, motor: int, side: Side) -> bool:
        """Whether a switch is active."""
        return bool(self._switches >> 2 * motor & (2 if side == "left" else 1))

    def set_input(self, n: int, level: int) -> None:
        """Drive IN_n low (0) or high (1)."""
        self.set_analog(n, ANALOG_MAX if level else 0)

    def set_analog(self, n: int, level: int) -> None:
        """Drive IN_n to a level 0..1023; the same line is digital and analogue (manual 6.7.15.1)."""
        if level != self._analog[n]:
            self._analog[n] = level
            self._tell_pins()

    def attach_analog(
        self, n: int, source: Callable[[], int] | None, next_edge: Callable[[], int] | None = None
    ) -> None:
        """Have IN_n driven by something that is asked for its level 0..1023 when it is read, or take it away.

        next_edge: gives the next clock at which the digital level may change; without it that is not known
        """
        self.wire_analog(n, source, next_edge)
        self._tell_pins()

    def wire_analog(
        self, n: int, source: Callable[[], int] | None, next_edge: Callable[[], int] | None = None
    ) -> None:
        """The same without a call of `on_pins`: for loading a state, which includes what the call would do."""
        self._sources[n] = source
        self._next_edges[n] = next_edge

    def steady(self, n: int) -> bool:
        """Whether IN_n keeps its level until `on_pins` is called."""
        return self._sources[n] is None

    def next_edge(self, n: int) -> int:
        """The next clock at which IN_n may change as a digital input without the world telling; 0: not known."""
        if self._sources[n] is None:
            return NEVER
        next_edge = self._next_edges[n]
        return next_edge() if next_edge else 0

    def set_shutdown(self, level: int) -> None:
        """Drive the SHUTDOWN pin low (0) or high (1)."""
        if level != self._shutdown:
            self._shutdown = level
            self._tell_pins()

    def attach_spi(self, select: int, device: SpiDevice | None) -> None:
        """Connect a device to select line 0..2 of the external SPI bus, or take it away."""
        self._spi[select] = device

    def attach_driver(self, motor: int, driver: Driver | None) -> None:
        """Connect a motor driver, or take it away."""
        self._drivers[motor] = driver

    def _tell_pins(self) -> None:
        for listener in self.on_pins:
            listener()

    def _wire_switches(self) -> None:
        """Bring the switches to the reference inputs of the chips, by their wiring (fidelity FW-1)."""
        if len(self.chips) == 1:
            self.chips[0].set_reference_inputs(self._switches)
            return
        for motor, chip in enumerate(self.chips):
            left, right = self._switches >> 2 * motor + 1 & 1, self._switches >> 2 * motor & 1
            chip.set_reference_inputs(left << 1 | right << 5)

    def driver_statuses(self) -> int:
        """Send the motion chip's present datagram to the drivers; their three status words, motor 0 first.

        Stands for a datagram and the wait for its end, in no time (fidelity FW-30).  0 on a TMCM-342.
        """
        if self.model.drivers is None:
            return 0
        statuses = 0
        for driver, word in zip(self._drivers, self._driver_words(), strict=True):
            statuses = statuses << DRIVER_BITS | (QUIET_DRIVER if driver is None else driver.transfer(word))
        return statuses

    def preview_driver_status(self, motor: int) -> int:
        """The status word that a motor's driver would send now, without a datagram; 0 on a TMCM-342."""
        if self.model.drivers is None:
            return 0
        driver = self._drivers[motor]
        return QUIET_DRIVER if driver is None else driver.preview(self._driver_words()[motor])

    def _driver_words(self) -> list[int]:
        """The control words of the motion chip's present datagram, by motor."""
        bits, _ = self.chips[0].driver_datagram()
        return [bits >> DRIVER_BITS * (2 - motor) & _DRIVER_MASK for motor in range(len(self._drivers))]


def _rebuilt(model: int, seed: int, state: Any) -> Board:
    """The copy that `Board.__reduce_ex__` describes."""
    board = Board(MODELS[model], seed=seed)
    board.load(state)
    return board
