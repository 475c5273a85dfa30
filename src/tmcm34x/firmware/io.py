"""Digital and analogue lines, and the external SPI bus.

Source: manual 6.7.14, 6.7.15, 6.7.24; fidelity FW-70, FW-71.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from tmcm34x.board.board import INPUTS, OUTPUTS
from tmcm34x.tmcl.datagram import signed32
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.board.circuit import Circuit

DIGITAL_INPUTS: Final = 0
ANALOG_INPUTS: Final = 1
DIGITAL_OUTPUTS: Final = 2
"""The banks of SIO and GIO."""

SHUTDOWN: Final = 10
"""Port of the SHUTDOWN pin in bank 0."""
ALL: Final = 255
"""Port that stands for all eight lines."""
FROM_ACCUMULATOR: Final = -1
"""Value of SIO 255 that stands for the accumulator."""

SELECT_LINES: Final = {0: 0, 2: 1, 3: 2}
"""Select line by the bus number of SAC; bit 7 of the number sends the accumulator (manual 6.7.24)."""
SEND_ACCUMULATOR: Final = 0x80


def set_output(board: Circuit, port: int, bank: int, value: int, accumulator: int) -> Status:
    """SIO: set one output to 0 or 1, or all of them to eight bits (of the accumulator for -1)."""
    if bank != DIGITAL_OUTPUTS:
        return Status.WRONG_TYPE
    if port == ALL:
        board.set_outputs((accumulator if value == FROM_ACCUMULATOR else value) & 0xFF)
        return Status.OK
    if port >= OUTPUTS:
        return Status.WRONG_TYPE
    if value not in {0, 1}:
        return Status.INVALID_VALUE
    board.set_outputs(board.outputs & ~(1 << port) | value << port)
    return Status.OK


def get_line(board: Circuit, port: int, bank: int) -> tuple[Status, int]:
    """GIO: an input or output line, or all eight of a digital bank."""
    if bank == ANALOG_INPUTS:
        return (Status.OK, board.analog_input(port)) if port < INPUTS else (Status.WRONG_TYPE, 0)
    bits = board.digital_inputs() if bank == DIGITAL_INPUTS else board.outputs
    if port == ALL:
        return Status.OK, bits
    if port < INPUTS:
        return Status.OK, bits >> port & 1
    if port == SHUTDOWN and bank == DIGITAL_INPUTS:
        return Status.OK, board.shutdown_level()
    return Status.WRONG_TYPE, 0


def exchange(board: Circuit, bus: int, size: int, value: int, accumulator: int) -> tuple[Status, int]:
    """SAC: send 1..4 bytes to an external SPI device, most significant first, and return what comes back."""
    select = SELECT_LINES.get(bus & ~SEND_ACCUMULATOR)
    if select is None:
        return Status.WRONG_TYPE, 0
    data = accumulator if bus & SEND_ACCUMULATOR else value
    return Status.OK, signed32(board.spi_exchange(select, data, size))
