"""Stretches of motion with one simple law: constant velocity, and velocity that changes evenly."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from itertools import accumulate
from math import gcd, sqrt

from tmcm34x.chips.ramp.law import Law
from tmcm34x.chips.ramp.state import LAST, RampState, signed24


def floors(start: int, step: int, count: int) -> int:
    """The sum of (start + i*step) >> 8 for i = 0 .. count - 1."""
    divisor, places, sums = _residues(step & 255)
    first = places[(start & 255) // divisor]
    rounds, rest = divmod(count, len(places))
    residues = start % divisor * count + rounds * sums[len(places)] + sums[first + rest] - sums[first]
    return start * count + step * (count * (count - 1) >> 1) - residues >> 8


@cache
def _residues(step: int) -> tuple[int, list[int], list[int]]:
    """What i*step leaves when divided by 256 comes round: all multiples of a divisor, once in each round.

    Gives back that divisor; at which i each of its multiples comes; the sums of the first remainders, for two rounds.
    """
    divisor = gcd(step, 256)
    remainders = [i * step & 255 for i in range(256 // divisor)]
    places = [remainders.index(multiple) for multiple in range(0, 256, divisor)]
    return divisor, places, [0, *accumulate(remainders * 2)]


class Stretch:
    """A stretch of the future in one direction, from `start` (exclusive) to `end` (inclusive)."""

    __slots__ = ("_answer", "_asked", "bend", "direction", "law", "mark", "speed", "start", "stopping")

    def __init__(self, law: Law, start: RampState, direction: int, speed: int) -> None:
        self.law = law
        self.start = start
        self.direction = direction
        self.speed = speed
        self.stopping = False
        """Whether it is a stop switch that slows the axis."""
        self.mark = 0
        """A tick that is noticed for its velocity, or 0."""
        self.bend = False
        """Whether all that is noticed there is another acceleration."""
        self._asked = self._answer = -1

    def reached(self, steps: int) -> int:
        """The tick of that step, or `LAST` if the part does not make it; remembers the last answer."""
        if steps != self._asked:
            self._asked = steps
            self._answer = self.when(steps) if self.reaches(steps) else LAST
        return self._answer

    def reaches(self, steps: int) -> bool:
        """Whether the part makes so many steps."""
        raise NotImplementedError

    def when(self, steps: int) -> int:
        """The tick of a step within the part, the first being 1."""
        raise NotImplementedError

    def moved(self, n: int) -> int:
        """The number of steps from the start to tick n of the part."""
        raise NotImplementedError

    def position(self, n: int) -> int:
        """X_ACTUAL after tick n of the part."""
        return signed24(self.start.x + self.direction * self.moved(n))

    def velocity(self, n: int) -> int:
        """The velocity after tick n of the part, signed and in 1/256."""
        raise NotImplementedError

    def state(self, n: int, speed: int, steps: int, acc: int, *, a: int = 0, rest: int = 0) -> RampState:
        """The state after tick n, so many steps from the start."""
        start, way = self.start, self.direction * steps
        return RampState(
            n,
            self.direction * speed,
            signed24(start.x + way),
            acc,
            start.wave + way * self.law.wave_step,
            a,
            self.stopping,
            rest,
            self.direction < 0 if speed or start.v else start.down,
        )


class Coast(Stretch):
    """Constant velocity `speed`; the first ramp tick may have brought it about, with acceleration `a`."""

    __slots__ = ("a", "end")

    def __init__(self, law: Law, start: RampState, direction: int, speed: int, end: int) -> None:
        super().__init__(law, start, direction, speed)
        self.end = end
        self.a = 0

    def reaches(self, steps: int) -> bool:
        """Whether the part makes so many steps."""
        return self.speed >= 256 and (self.end == LAST or self.moved(self.end) >= steps)

    def velocity(self, n: int) -> int:
        """The velocity after tick n of the part, signed and in 1/256."""
        return self.direction * self.speed

    def weight(self, n: int) -> int:
        """What the accumulator at the start and the pulse ticks up to tick n add up to, in 2048ths of a step."""
        start, shift = self.start, self.law.pulse_div
        return start.acc + (self.speed >> 8) * ((n >> shift) - (start.n >> shift))

    def moved(self, n: int) -> int:
        """The number of steps from the start to tick n."""
        return self.weight(n) >> 11

    def when(self, steps: int) -> int:
        """The tick of a step within the part, the first being 1."""
        start = self.start
        shift = self.law.pulse_div
        pulses = -((start.acc - (steps << 11)) // (self.speed >> 8))
        return (start.n >> shift) + pulses << shift

    def at(self, n: int) -> RampState:
        """The state after a tick of the part."""
        start, law, speed = self.start, self.law, self.speed
        steps, acc = divmod(self.weight(n), 2048)
        ramps = (n >> law.ramp_div) - (start.n >> law.ramp_div)
        a = self.a if ramps == 1 else start.a if ramps == 0 else 0
        return self.state(n, speed, steps, acc, a=a, rest=start.rest if start.v == 0 else start.n + 1)

    def final(self) -> RampState:
        """The state after the last tick of the part."""
        return self.at(self.end)

    def steps(self, after: int, until: int) -> Iterator[int]:
        """The ticks of the steps within after + 1 .. until, both of the part."""
        for step in range(self.moved(after) + 1, self.moved(until) + 1):
            yield self.when(step)


class Change(Stretch):
    """The speed goes from `speed` by `step` per ramp tick, and stays at least zero."""

    __slots__ = ("_weighed", "_weight", "end", "step")

    def __init__(self, law: Law, start: RampState, direction: int, step: int, ramps: int) -> None:
        super().__init__(law, start, direction, abs(start.v))
        self._weighed, self._weight = start.n, start.acc
        self.step = step
        self.end = start.n + (ramps << law.ramp_div)

    def velocity(self, n: int) -> int:
        """The velocity after tick n of the part, signed and in 1/256."""
        ramp_div = self.law.ramp_div
        ramps = (n >> ramp_div) - (self.start.n >> ramp_div)
        return self.direction * (self.speed + self.step * ramps)

    def pulsed(self, ramps: int) -> int:
        """What the pulse ticks of so many whole ramp intervals add up to."""
        rise, speed, step = self.law.rise, self.speed, self.step
        if rise >= 0:
            return floors(speed + step, step, ramps) << rise
        first = -(self.start.n + 1 >> self.law.ramp_div) % (1 << -rise)
        if first >= ramps:
            return 0
        count = (ramps - 1 - first >> -rise) + 1
        return floors(speed + step * (first + 1), step << -rise, count)

    def reaches(self, steps: int) -> bool:
        """Whether the part makes so many steps."""
        fastest = max(self.speed, self.speed + self.step * (self.end - self.start.n >> self.law.ramp_div))
        pulses = (self.end >> self.law.pulse_div) - (self.start.n >> self.law.pulse_div)
        return fastest * pulses >= steps - 1 << 19 and self.weight(self.end) >> 11 >= steps

    def weight(self, n: int) -> int:
        """What the accumulator at the start and the pulse ticks up to tick n add up to, in 2048ths of a step."""
        if n != self._weighed:
            self._weighed, self._weight = n, self.start.acc + self._pulsed_until(n)
        return self._weight

    def _pulsed_until(self, n: int) -> int:
        """What the pulse ticks up to tick n of the part add up to."""
        law = self.law
        ramps = (n >> law.ramp_div) - (self.start.n >> law.ramp_div)
        if law.rise < 0 or ramps == 0:
            return self.pulsed(ramps)
        pulses = ((n & law.ramp_mask) >> law.pulse_div) + 1
        return self.pulsed(ramps - 1) + (self.speed + self.step * ramps >> 8) * pulses

    def moved(self, n: int) -> int:
        """The number of steps from the start to tick n."""
        return self.weight(n) >> 11

    def when(self, steps: int) -> int:
        """The tick of a step within the part, the first being 1."""
        law, start = self.law, self.start
        wanted = (steps << 11) - start.acc
        before, pulsed = self._before(wanted)
        boundary = start.n + 1 + (before << law.ramp_div)
        if law.rise < 0:
            return boundary
        pulses = -((pulsed - wanted) // (self.speed + self.step * (before + 1) >> 8))
        return boundary + (pulses - 1 << law.pulse_div)

    def _before(self, wanted: int) -> tuple[int, int]:
        """The most whole ramp intervals whose pulse ticks add up to less than `wanted`, and that sum.

        The part reaches what is wanted.
        """
        low, below, high = 0, 0, self.end - self.start.n >> self.law.ramp_div
        near, far = self._guess(wanted, high), 1
        if (total := self.pulsed(near)) < wanted:
            low, below = near, total
            while low + far < high and (total := self.pulsed(low + far)) < wanted:
                low, below, far = low + far, total, far << 1
            high = min(high, low + far)
        else:
            high = near
            while high - far > 0 and (total := self.pulsed(high - far)) >= wanted:
                high, far = high - far, far << 1
            if high - far > 0:
                low, below = high - far, total
        while high - low > 1:
            middle = low + high >> 1
            if (total := self.pulsed(middle)) < wanted:
                low, below = middle, total
            else:
                high = middle
        return low, below

    def _guess(self, wanted: int, most: int) -> int:
        """About what `_before` returns, 1..most: without the floors the sum is a polynomial of the second degree."""
        linear = self.speed + self.step / 2 - 128
        square = linear * linear + self.step * wanted * 2.0 ** (9 - self.law.rise)
        if square < 0:
            return most
        return max(1, min(most, int((sqrt(square) - linear) / self.step)))

    def at(self, n: int) -> RampState:
        """The state after a tick of the part."""
        law, start = self.law, self.start
        ramps = (n >> law.ramp_div) - (start.n >> law.ramp_div)
        if ramps == 0:
            return start
        steps, acc = divmod(self.weight(n), 2048)
        speed = self.speed + self.step * ramps
        return self.state(n, speed, steps, acc, a=self.direction * self.step, rest=n & ~law.ramp_mask)

    def final(self) -> RampState:
        """The state after the last tick of the part."""
        return self.at(self.end)

    def steps(self, after: int, until: int) -> Iterator[int]:
        """The ticks of the steps within after + 1 .. until, both of the part."""
        law = self.law
        while after < until:
            rest = min(until, after + 1 | law.ramp_mask)
            state = self.at(after + 1)
            begin = self.at(after).with_velocity(state.v)
            yield from Coast(law, begin, self.direction, abs(state.v), rest).steps(after, rest)
            after = rest
