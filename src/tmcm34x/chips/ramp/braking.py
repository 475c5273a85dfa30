"""The stretch in which an law brakes for its target."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from math import isqrt
from typing import Final

from tmcm34x.chips.ramp.law import FARTHEST, Law
from tmcm34x.chips.ramp.parts import Change, Coast, Stretch
from tmcm34x.chips.ramp.plan import simple_part
from tmcm34x.chips.ramp.roots import roots
from tmcm34x.chips.ramp.state import LAST, TURN, RampState

Place = tuple[int, int, int]
"""Between two ramp ticks while braking: tick, speed, and what the pulse ticks have to add up to for the target."""

_FEW: Final = 4
"""So many ramp intervals are walked one by one sooner than by a part of their own."""

BEYOND: Final = -TURN << 11
"""Left of the way where a walk need not stop short of anything."""


class Braking(Stretch):
    """The speed follows the braking velocity of the distance, as far as A_MAX allows, down to the target.

    The way there is a sequence of places between two ramp ticks, some of which are kept as checkpoints.
    """

    __slots__ = ("_checkpoints", "_end", "_found", "_near", "_recent", "_ticks")

    EVERY: Final = 128
    """Small steps from one checkpoint to the next."""

    def __init__(self, law: Law, start: RampState, direction: int) -> None:
        super().__init__(law, start, direction, abs(start.v))
        self.mark = start.n + 1
        self.bend = True
        way = (direction * law.distance(start.x) << 11) - start.acc
        self._checkpoints: list[Place] = [(start.n, self.speed, way)]
        self._ticks = [start.n]
        self._recent = self._checkpoints[0]
        self._near = law.nearest(law.v_min + 1) - 1 << 11 if law.dense else 0
        """What is left of the way where the root of the distance falls to V_MIN."""
        self._end = 0
        self._found: Coast | Change | None = None

    @property
    def end(self) -> int:
        """The tick before the ramp tick that no longer brakes for the target."""
        if not self._end:
            place = self._checkpoints[0]
            while (after := self._walk(place, LAST, BEYOND)) != place:
                place = after
                self._checkpoints.append(place)
                self._ticks.append(place[0])
            self._end = place[0]
        return self._end

    def reaches(self, steps: int) -> bool:
        """Whether the part makes so many steps."""
        return self.end > 0 and _ahead(self._checkpoints[0]) - _ahead(self._checkpoints[-1]) >= steps

    def at(self, n: int) -> RampState:
        """The state after a tick of the part."""
        return self.start if n == self.start.n else self._piece_at(n).at(n)

    def velocity(self, n: int) -> int:
        """The velocity after tick n of the part, signed and in 1/256."""
        if n == self.start.n:
            return self.start.v
        piece = self._found
        if piece is None or not piece.start.n < n <= piece.end:
            place = self._place(n)
            after = self._interval(place)
            if after[0] >= n:
                return self.direction * after[1]
        return self._piece_at(n).velocity(n)

    def _piece_at(self, n: int) -> Coast | Change:
        """The simple part of the way that holds tick n."""
        piece = self._found
        if piece is None or not piece.start.n < n <= piece.end:
            piece = self._piece(self._place(n))
            while piece.end < n:
                piece = self._simple(piece.final())
            self._found = piece
        return piece

    def _place(self, n: int) -> Place:
        """The last place before tick n, found from a checkpoint or from where the last one was found."""
        if n > self.start.n + 1 and n > self.end:
            raise ValueError(f"tick {n} is past the end of the part")
        place = self._checkpoints[bisect_right(self._ticks, n - 1) - 1]
        if place[0] < self._recent[0] < n:
            place = self._recent
        self._recent = place = self._walk(place, n - 1, BEYOND)
        return place

    def position(self, n: int) -> int:
        """X_ACTUAL after tick n of the part."""
        return self.start.x if n == self.start.n else self._piece_at(n).position(n)

    def moved(self, n: int) -> int:
        """The number of steps from the start to tick n; less than half a turn of the counter."""
        return self.direction * (self.position(n) - self.start.x) % TURN

    def when(self, steps: int) -> int:
        """The tick of a step within the part, the first being 1."""
        piece = self._found
        if piece is not None and (before := self._before(piece)) < steps:
            tick = piece.reached(steps - before)
            if tick < LAST:
                return tick
        left = _ahead(self._checkpoints[0]) - steps << 11
        index = bisect_left(self._checkpoints, -left, key=lambda place: -place[2]) - 1
        piece = self._piece(self._walk(self._checkpoints[index], self.end, left))
        while (tick := piece.reached(steps - self._before(piece))) == LAST:
            piece = self._simple(piece.final())
        self._found = piece
        return tick

    def final(self) -> RampState:
        """The state after the last tick of the part, but for A_ACTUAL."""
        return self._state(self._checkpoints[-1]) if self.end else self.start

    def _state(self, place: Place) -> RampState:
        """The state at a place on the way, but for A_ACTUAL."""
        n, speed, way = place
        steps = _ahead(self._checkpoints[0]) - _ahead(place)
        return self.state(n, speed, steps, -way & 2047)

    def _piece(self, place: Place) -> Coast | Change:
        """The simple part that begins at a place on the way."""
        return self._simple(self.start if place[0] == self.start.n else self._state(place))

    def _simple(self, start: RampState) -> Coast | Change:
        return simple_part(self.law, start, self.law.aim(start.v, start.x))

    def _before(self, piece: Coast | Change) -> int:
        """The number of steps before a simple part of the way."""
        return self.direction * (piece.start.x - self.start.x) % TURN

    def _walk(self, place: Place, until: int, left: int) -> Place:
        """Some small steps on the way, none of them past tick `until` or to where no more than `left` of it is left."""
        if self._follows(place):
            after = self._walk_intervals(place, until, left)
            if after[0] != place[0]:
                return after
        return self._walk_velocities(place, until, left)

    def _follows(self, place: Place) -> bool:
        """Whether ramp intervals are the small steps here."""
        law = self.law
        return law.dense and 0 < place[2] <= FARTHEST << 11 and place[1] > law.v_min << 8

    def _interval(self, place: Place) -> Place:
        """The place one ramp interval later, where intervals are the small steps; else the same."""
        until = place[0] + self.law.ramp_mask + 1
        return self._walk_intervals(place, until, BEYOND) if self._follows(place) else place

    def _walk_intervals(self, place: Place, until: int, left: int) -> Place:
        """Up to EVERY ramp intervals, while the root of the distance is more than V_MIN.

        The speed follows the root unless it would have to fall by more than A_MAX.  It does not rise, so that some
        intervals are certain not to come near the end, or else one is tried.
        """
        law = self.law
        n, speed, way = place
        step, pulses, interval = law.a_max, 1 << law.rise, law.ramp_mask + 1
        near = max(left, self._near)
        if way <= near:
            return place
        room = min(until - n >> law.ramp_div, self.EVERY)
        way -= 1
        factor, shift = law.factor, law.shift
        known = roots(factor, shift, way >> 11)
        fastest = max(speed >> 8, isqrt(factor * (way >> 11) >> shift))
        while room > 0 and way >= near:
            before = n, speed, way + 1
            count = max(1, min(room, (way - near) // (fastest * pulses)))
            for _ in range(count):
                speed -= step
                root = known[way >> 11]
                if not root:
                    root = known[way >> 11] = isqrt(factor * (way >> 11) >> shift) << 8
                if root > speed:  # noqa: PLR1730 - a call would cost as much as the rest of the round
                    speed = root
                way -= (speed >> 8) * pulses
            if way < left:
                return before
            n += count * interval
            room -= count
            fastest = speed >> 8
        return n, speed, way + 1

    def _slowed(self, place: Place, aim: int) -> Place:
        """The place after the speed has fallen by A_MAX, or by a multiple of it where that is far from the aim."""
        n, speed, way = place
        law = self.law
        slower = speed - law.a_max
        if law.rise >= 0 and slower - _FEW * law.a_max >> 8 <= aim:
            return n + law.ramp_mask + 1, slower, way - (slower >> 8 << law.rise)
        self._found = piece = self._piece(place)
        end = piece.end
        return end, abs(piece.velocity(end)), way - (piece.weight(end) - piece.start.acc)

    def _walk_velocities(self, place: Place, until: int, left: int) -> Place:
        """Up to EVERY stretches in which the integer part of the velocity is the one aimed at."""
        law = self.law
        a_max, rise, ramp_div = law.a_max, law.rise, law.ramp_div
        for _ in range(self.EVERY):
            n, speed, way = place
            if way <= 0:
                break
            aim = law.allowed(-(-way >> 11))
            if speed - a_max >> 8 > aim:
                after = self._slowed(place, aim)
            elif aim:
                pulses = -(-(way - (law.nearest(aim) - 1 << 11)) // aim)
                if rise >= 0:
                    ramps = (pulses - 1 >> rise) + 1
                    pulses = ramps << rise
                else:
                    ramps = -(n + 1 >> ramp_div) % (1 << -rise) + (pulses - 1 << -rise) + 1
                after = n + (ramps << ramp_div), max(speed - ramps * a_max, aim << 8), way - aim * pulses
            else:
                break
            if after[0] > until or after[2] <= left:
                break
            place = after
        return place


def _ahead(place: Place) -> int:
    """The number of steps from a place to the target."""
    return -(-place[2] >> 11)
