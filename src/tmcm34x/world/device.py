"""Devices on the external SPI bus, which SAC reaches.

A device has `exchange(data, nbytes)`: it takes so many bytes, most significant first, and gives as many back in the
same transfer.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import Final, Protocol

from tmcm34x.clock import Value


class Device(Protocol):
    """One of the devices of this module."""

    def exchange(self, data: int, nbytes: int) -> int:
        """One transfer of `nbytes` bytes, most significant first; returns as many."""
        ...

    def save(self) -> Value:
        """What to make an equal device of: the arguments of its class."""
        ...


class Echo:
    """Returns what is sent, as a wire from data out to data in does."""

    def exchange(self, data: int, nbytes: int) -> int:
        """One transfer."""
        del nbytes
        return data

    def save(self) -> Value:
        """It remembers nothing."""
        return ()


class ShiftRegister:
    """A chain of shift registers of `size` bytes: what is sent comes back `size` bytes later.

    `latched` is what stands in the register after a transfer: the outputs of a 74HC595.
    """

    def __init__(self, size: int = 1, latched: int = 0) -> None:
        self.size = size
        self.latched = latched

    def exchange(self, data: int, nbytes: int) -> int:
        """One transfer."""
        shifted = self.latched << 8 * nbytes | data
        self.latched = shifted & (1 << 8 * self.size) - 1
        return shifted >> 8 * self.size

    def save(self) -> Value:
        """Size and what stands in it."""
        return self.size, self.latched


class Buttons:
    """Parallel inputs read as bytes, as a chain of 74HC165 gives them; `inputs` is what stands there."""

    def __init__(self, size: int = 1, inputs: int = 0) -> None:
        self.size = size
        self.inputs = inputs

    def exchange(self, data: int, nbytes: int) -> int:
        """One transfer: the inputs first, then what was shifted in behind them."""
        shifted = self.inputs << 8 * nbytes | data
        return shifted >> 8 * self.size

    def save(self) -> Value:
        """Size and inputs."""
        return self.size, self.inputs


class Previous:
    """Answers a transfer with what came in the one before, as many slaves with one buffer do."""

    def __init__(self, last: int = 0) -> None:
        self.last = last

    def exchange(self, data: int, nbytes: int) -> int:
        """One transfer."""
        answer, self.last = self.last, data
        return answer & ((1 << 8 * nbytes) - 1)

    def save(self) -> Value:
        """What came in last."""
        return (self.last,)


class Constant:
    """Answers every transfer with the low bytes of `value`."""

    def __init__(self, value: int) -> None:
        self.value = value

    def exchange(self, data: int, nbytes: int) -> int:
        """One transfer."""
        del data
        return self.value & ((1 << 8 * nbytes) - 1)

    def save(self) -> Value:
        """The value."""
        return (self.value,)


KINDS: Final = MappingProxyType(
    {
        "echo": Echo,
        "shift_register": ShiftRegister,
        "buttons": Buttons,
        "previous": Previous,
        "constant": Constant,
    }
)
"""The classes of devices, by the names that stand for them in saved states."""
