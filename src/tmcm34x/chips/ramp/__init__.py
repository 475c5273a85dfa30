"""The ramp and pulse generator of one axis, in closed form.

The chip divides its clock by 32; one *tick* is 32 clocks.  Every 2^RAMP_DIV ticks the velocity moves by at most
A_MAX (in 1/256 of a velocity unit) toward the velocity the mode asks for; every 2^PULSE_DIV ticks the integer
part of the velocity is added to an accumulator of 11 bits, whose overflow is a step.  A ramp tick comes before
the pulse tick of the same tick.  The definition, tick by tick, is tests/chips/oracle.py; this package computes
the same states without visiting the ticks.

The future of an axis is a chain of *parts*, each a stretch of time with one law of motion in one direction:

Coast    the velocity is constant: a step count is one division.
Change   the velocity moves by A_MAX per ramp tick: a step count is a sum of floors of an arithmetic progression.
Braking  the velocity follows the square root of the distance: one small step per velocity unit or ramp tick,
         whichever are fewer, with a checkpoint now and then to resume from.

Except for the rest of a ramp interval after something was written, parts begin and end between two ramp ticks:
`start.n` and `end` are the last ticks before one.  The chain is prolonged only as far as the next *mark*, the
next tick that something could wait for; what is written, or a switch, cuts it off.

state    the state after a tick
law      the registers, and the velocity that they ask for
parts    Coast and Change
plan     the Coast or Change that begins at a state
braking  Braking
axis     the chain of parts, and what is asked of it

Source: TMC429 datasheet 8.1; model: docs/fidelity/chips.md CHIP-1 to CHIP-8.
"""

from tmcm34x.chips.ramp.axis import RampAxis
from tmcm34x.chips.ramp.law import brake_factor
from tmcm34x.chips.ramp.state import (
    HALF_TURN,
    HOLD,
    LAST,
    RAMP,
    SOFT,
    TURN,
    VELOCITY,
    RampState,
    signed24,
    v_actual,
)

__all__ = [
    "HALF_TURN",
    "HOLD",
    "LAST",
    "RAMP",
    "SOFT",
    "TURN",
    "VELOCITY",
    "RampAxis",
    "RampState",
    "brake_factor",
    "signed24",
    "v_actual",
]
