"""The TMCM-323 encoder module on the external SPI bus.

Global parameter 74 says on which select line its TMC423 sits; with 0 there is none.

Source: TMC423 datasheet 5 to 7; manual 7.1 (209, 210, 212), 8.1 (74); fidelity FW-34, WORLD-2.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from tmcm34x.chips.ramp import signed24
from tmcm34x.chips.tmc423 import CONFIGURATION, POSITION, Tmc423, configuration, datagram

if TYPE_CHECKING:
    from tmcm34x.firmware.state import ModuleState


def position(core: ModuleState, motor: int) -> int:
    """The counter of a motor's encoder; 0 without an encoder module."""
    if not core.encoder_interface:
        return 0
    return signed24(_exchange(core, datagram(POSITION[motor])))


def peek(core: ModuleState, motor: int) -> int | None:
    """What `position` would give now, without a datagram; None where another device answers."""
    if not core.encoder_interface:
        return 0
    device = core.circuit.spi_device(core.encoder_interface - 1)
    if device is None:
        return 0
    return signed24(device.preview(motor)) if isinstance(device, Tmc423) else None


def preload(core: ModuleState, motor: int, position: int) -> None:
    """Set a counter, if there is one."""
    if core.encoder_interface:
        _exchange(core, datagram(POSITION[motor], position, write=True))


def configure(core: ModuleState, motor: int, prescaler: int) -> None:
    """Send axis parameter 210 of a motor to the encoder module, if there is one."""
    if core.encoder_interface:
        _exchange(core, datagram(CONFIGURATION[motor], configuration(prescaler), write=True))


def _exchange(core: ModuleState, data: int) -> int:
    return core.circuit.spi_exchange(core.encoder_interface - 1, data, 4)
