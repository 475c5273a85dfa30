"""Limit and reference switches on an axis, and the lines that bring them to the module.

A switch is pressed in a range of rotor positions; it opens late by its hysteresis.  The switches of one line are
wired in series (the manual's reference switch in series with the left limit switch); each change of a line may
bounce.  All edges are events at exact clocks.

Source: manual 9.1 for the wiring; numbers are the bench's.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, Final, NamedTuple

from tmcm34x.clock import NEVER, Value

FAR: Final = 1 << 40
"""A rotor position beyond all others."""

_MASK: Final = (1 << 64) - 1


def noise(*numbers: int) -> int:
    """32 bits that look random and depend on nothing but `numbers`."""
    state = 0
    for number in numbers:
        state = (state ^ number & _MASK) * 0x9E37_79B9_7F4A_7C15 & _MASK
        state = (state ^ state >> 29) * 0xBF58_476D_1CE4_E5B9 & _MASK
        state ^= state >> 32
    return state >> 16 & 0xFFFF_FFFF


class Switch:
    """A switch pressed between two rotor positions, both included.

    low, high: rotor positions, `-FAR` and `FAR` for no end
    hysteresis: how far outside the range a pressed switch is released
    turn: rotor units after which the range repeats, on a circular axis
    """

    def __init__(self, low: int, high: int, hysteresis: int = 0, turn: int | None = None) -> None:
        if high < low:
            raise ValueError(f"a switch pressed from {low} to {high} is never pressed")
        self.low = low
        self.high = high
        self.hysteresis = hysteresis
        self.turn = turn
        self.pressed = False

    def _range(self) -> tuple[int, int]:
        late = self.hysteresis if self.pressed else 0
        return self.low - late, self.high + late

    def _base(self, rotor: int) -> int:
        """What to add to the range so that `rotor` is in it or in the gap above it."""
        return (rotor - self._range()[0]) // self.turn * self.turn if self.turn else 0

    def room(self, rotor: int) -> tuple[int, int]:
        """The lowest and highest rotor position around `rotor` at which the switch stays as it is."""
        low, high = self._range()
        base = self._base(rotor)
        low, high = low + base, high + base
        if low <= rotor <= high:
            return low, high
        if rotor < low:
            return -FAR, low - 1
        return high + 1, low + self.turn - 1 if self.turn else FAR

    def follow(self, rotor: int) -> bool:
        """Bring the switch to a rotor position; returns whether it is pressed."""
        low, high = self._range()
        self.pressed = 0 <= rotor - low - self._base(rotor) <= high - low
        return self.pressed


class Contact(NamedTuple):
    """How a line is wired.

    normally_closed: pressing a switch opens the line, which the chip sees as active (manual 9.1)
    bounce: clocks during which a contact bounces after each change; 0 for a clean one
    """

    normally_closed: bool = True
    bounce: int = 0


CLEAN: Final = Contact()
"""Normally closed, without bouncing."""


class SwitchInput:
    """One switch input of the module with its switches in series.

    `active` is the level as the chip sees it.  Without a switch the input is strapped and never active
    (fidelity WORLD-4).
    """

    def __init__(self, switches: Sequence[Switch] = (), contact: Contact = CLEAN, seed: int = 0) -> None:
        self.switches = tuple(switches)
        self.contact = contact
        self.seed = seed
        self.override: bool | None = None
        """The level at which the line is held from outside, if it is."""
        self.unplugged = False
        """Whether the cable is broken; an open line is active."""
        self._pressed = False
        self._changes = 0
        self._bounces: tuple[int, ...] = ()

    def settle(self, rotor: int) -> None:
        """Take the state at a rotor position without bouncing, as before power-on."""
        for switch in self.switches:
            switch.pressed = False
            switch.follow(rotor)
        self._pressed = any(switch.pressed for switch in self.switches)
        self._bounces = ()

    def save(self) -> Value:
        """What is done to the line, its switches, and how its contact bounces."""
        pressed = tuple([switch.pressed for switch in self.switches])
        return self.override, self.unplugged, self._pressed, self._changes, self._bounces, pressed

    def load(self, value: Any) -> None:
        """Become a line that was saved."""
        self.override, self.unplugged, self._pressed, self._changes, self._bounces, pressed = value
        for switch, saved in zip(self.switches, pressed, strict=True):
            switch.pressed = saved

    def follow(self, now: int, rotor: int) -> None:
        """Bring the switches to a rotor position at clock `now`."""
        pressed = False
        for switch in self.switches:
            pressed |= switch.follow(rotor)
        if pressed != self._pressed:
            self._pressed = pressed
            self._changes += 1
            self._bounces = self._bounce(now) if self.contact.bounce else ()

    def _bounce(self, now: int) -> tuple[int, ...]:
        """The clocks at which the contact opens and closes again; an even number of them."""
        count = 2 + 2 * (noise(self.seed, self._changes) % 3)
        times = (1 + noise(self.seed, self._changes, n) % self.contact.bounce for n in range(1, count + 1))
        return tuple(now + time for time in sorted(times))

    def active(self, now: int) -> bool:
        """The level at clock `now`, as the chip sees it."""
        if self.override is not None:
            return self.override
        if self.unplugged:
            return True
        if not self.switches:
            return False
        passed = sum(when <= now for when in self._bounces) if self._bounces else 0
        pressed = self._pressed != bool(passed & 1)
        return pressed == self.contact.normally_closed

    def next_event(self, now: int) -> int:
        """The next clock after `now` at which a bouncing contact changes."""
        for when in self._bounces:
            if when > now:
                return when
        return NEVER

    def room(self, rotor: int) -> tuple[int, int]:
        """The lowest and highest rotor position at which all switches stay as they are."""
        return narrowest(switch.room(rotor) for switch in self.switches)


def narrowest(rooms: Iterable[tuple[int, int]]) -> tuple[int, int]:
    """The rotor positions common to all `rooms`."""
    low, high = -FAR, FAR
    for lower, upper in rooms:
        low, high = max(low, lower), min(high, upper)
    return low, high
