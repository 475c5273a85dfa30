"""The motion controllers TMC429 and TMC428: three axes behind a 32-bit datagram.

The chip knows its registers (`registers.py`), three axes whose motion is computed in closed form (`ramp`), the
reference switch inputs, and the chain of drivers that it feeds from its RAM.

core        what the chip remembers: registers, RAM, axes, lines
interrupts  interrupt flags and their conditions
switches    reference switch inputs, and what they do
chain       driver datagrams, coil currents
bus         the 32-bit datagram: status, registers, RAM
chip        `Tmc429`: time, pins, and what can be seen from outside

Inputs are numbered as in the SWITCHES register: bit 2*motor + 1 is the line of the left switch, bit 2*motor
that of the right one.  Without a multiplexer the pins REF1..REF3 are the lines of the left switches; the lines
of the right ones then reach a TMC429 through its own inputs when EN_REFR is set, and otherwise nothing.

Source: TMC429 datasheet rev. 2.06, sections 6 to 12; choices: docs/fidelity/chips.md.
"""

from tmcm34x.chips.tmc429.chain import Coils
from tmcm34x.chips.tmc429.chip import Motion, Tmc429
from tmcm34x.chips.tmc429.core import MOTORS

__all__ = ["MOTORS", "Coils", "Motion", "Tmc429"]
