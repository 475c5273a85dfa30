"""The TMCM-323 encoder module on the external SPI bus.

Global parameter 74 says on which select line its TMC423 sits; with 0 there is none.

Source: TMC423 datasheet 5 to 7; manual 7.1 (209, 210, 212), 8.1 (74); fidelity FW-34, WORLD-2.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from tmcm34x.chips.ramp import signed24
from tmcm34x.chips.tmc423 import CONFIGURATION, POSITION, Tmc423, configuration, datagram

if TYPE_CHECKING:
    from tmcm34x.board.board import Board


class Encoders:
    """The three counters; `interface` is global parameter 74."""

    __slots__ = ("_board", "interface")

    def __init__(self, board: Board) -> None:
        self._board = board
        self.interface = 0

    def position(self, motor: int) -> int:
        """The counter of a motor's encoder; 0 without an encoder module."""
        if not self.interface:
            return 0
        return signed24(self._exchange(datagram(POSITION[motor])))

    def peek(self, motor: int) -> int | None:
        """What `position` would give now, without a datagram; None where another device answers."""
        if not self.interface:
            return 0
        device = self._board.spi_device(self.interface - 1)
        if device is None:
            return 0
        return signed24(device.preview(motor)) if isinstance(device, Tmc423) else None

    def preload(self, motor: int, position: int) -> None:
        """Set a counter."""
        self._exchange(datagram(POSITION[motor], position, write=True))

    def configure(self, motor: int, prescaler: int) -> None:
        """Send axis parameter 210 of a motor to the encoder module, if there is one."""
        if self.interface:
            self._exchange(datagram(CONFIGURATION[motor], configuration(prescaler), write=True))

    def _exchange(self, data: int) -> int:
        return self._board.spi_exchange(self.interface - 1, data, 4)
