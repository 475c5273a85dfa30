"""What the firmware knows of its board: datagrams to the motion chips, pins, drivers' switches, and when to look.

`board.Board` is one such circuit, with models of the chips.  Real chips on an SPI port would be another: `transfer`
and `bus` go to the port, `reset` pulses their power, and as they cannot say when something will happen `next_event`
answers the clocks of a grid at which the firmware looks (tests/firmware/test_circuit.py).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from tmcm34x.board.models import Model
    from tmcm34x.clock import Value


class SpiDevice(Protocol):
    """Something on the external SPI bus."""

    def exchange(self, data: int, nbytes: int) -> int:
        """One transfer of `nbytes` bytes, most significant first; returns as many."""
        ...


class Circuit(Protocol):
    """The firmware's side of a board."""

    outputs: int
    """The eight digital outputs, OUT_0 in bit 0."""
    currents: list[int]
    """Current scaling of each motor's driver, 0..255 of the module's maximum."""
    on_pins: list[Callable[[], None]]
    """Called whenever the world changed a switch, an input or SHUTDOWN."""

    @property
    def model(self) -> Model:
        """The kind of module."""
        ...

    # Time

    @property
    def now(self) -> int:
        """The clock the board has been brought to."""
        ...

    @property
    def next_event(self) -> Callable[[], int]:
        """Returns the next clock at which the firmware must look at the motion chips, later than `now`."""
        ...

    @property
    def advance(self) -> Callable[[int], None]:
        """Brings the motion chips to a clock."""
        ...

    @property
    def changed_motors(self) -> Callable[[], int]:
        """Returns the motors, as bits, that the firmware must look at after an event at `now`.

        All three where the chips cannot say; none where an acceleration is all that has changed.
        """
        ...

    def stays_within(self, motor: int, low: int, high: int) -> int:
        """The clock until which a motor's X_ACTUAL certainly stays within low..high; `now` where that is not known."""
        ...

    def position_at(self, motor: int, when: int) -> int:
        """A motor's X_ACTUAL at a clock before that which `stays_within` gave, and before `next_event`."""
        ...

    # Chips

    def reset(self) -> None:
        """Power-on: chips in their initial state, outputs low, drivers on without current."""
        ...

    def wiring(self, motor: int) -> tuple[int, int]:
        """Index of the motor's chip, and its number within the chip."""
        ...

    def bus(self, chip: int) -> Callable[[int], int]:
        """The wire to a motion chip: takes a 32-bit datagram, returns the reply."""
        ...

    def transfer(self, chip: int, datagram: int) -> int:
        """Exchange one 32-bit datagram with a motion chip."""
        ...

    # Drivers

    def set_current(self, motor: int, current: int) -> None:
        """Set the driver's current scaling, 0..255."""
        ...

    def driver_enable(self, motor: int, on: bool) -> None:
        """Switch the driver's outputs on, or off so that the motor turns freely."""
        ...

    def driver_statuses(self) -> int:
        """Have a driver datagram sent and wait for its end: three status words, motor 0 first (fidelity FW-30)."""
        ...

    def preview_driver_status(self, motor: int) -> int:
        """What `driver_statuses` would give for one motor, without a datagram."""
        ...

    # Pins

    def set_outputs(self, bits: int) -> None:
        """Set all eight outputs."""
        ...

    def digital_inputs(self) -> int:
        """The eight inputs IN_0..IN_7 as bits."""
        ...

    def analog_input(self, n: int) -> int:
        """The level of IN_n, 0..1023."""
        ...

    def steady(self, n: int) -> bool:
        """Whether IN_n keeps its level until `on_pins` is called."""
        ...

    def next_edge(self, n: int) -> int:
        """The next clock at which IN_n may change as a digital input without `on_pins` being called; 0: not known."""
        ...

    def shutdown_level(self) -> int:
        """The level of the SHUTDOWN pin, 0 or 1."""
        ...

    def spi_exchange(self, select: int, data: int, nbytes: int) -> int:
        """One transfer of 1..4 bytes with select line 0..2; an open line reads zeros."""
        ...

    def spi_device(self, select: int) -> SpiDevice | None:
        """What is connected to a select line, for looking without a transfer; None where that is not known."""
        ...

    # State

    def save(self) -> Value:
        """What the board and its chips remember."""
        ...

    def load(self, value: Any, /) -> None:
        """Become a board that was saved."""
        ...
