"""The ramp and pulse generator of one axis, in closed form.

The chip divides its clock by 32; one *tick* is 32 clocks.  Every 2^RAMP_DIV ticks the velocity moves by at most
A_MAX (in 1/256 of a velocity unit) toward the velocity the mode asks for; every 2^PULSE_DIV ticks the integer
part of the velocity is added to an accumulator of 11 bits, whose overflow is a step.  A ramp tick comes before
the pulse tick of the same tick.  The definition, tick by tick, is tests/chips/oracle.py; this module computes
the same states without visiting the ticks.

The future of an axis is a chain of *parts*, each a stretch of time with one law of motion in one direction:

Coast    the velocity is constant: a step count is one division.
Change   the velocity moves by A_MAX per ramp tick: a step count is a sum of floors of an arithmetic progression.
Braking  the velocity follows the square root of the distance: one small step per velocity unit or ramp tick,
         whichever are fewer, with a checkpoint now and then to resume from.

Except for the rest of a ramp interval after something was written, parts begin and end between two ramp ticks:
`start.n` and `end` are the last ticks before one.  The chain is prolonged only as far as the next *mark*, the
next tick somebody could want to be told of; what is written, or a switch, cuts it off.

Source: TMC429 datasheet 8.1; model: docs/fidelity/chips.md CHIP-1 to CHIP-8.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterator
from math import isqrt
from typing import Final, NamedTuple

from tmcm34x.clock import NEVER

RAMP: Final = 0
SOFT: Final = 1
VELOCITY: Final = 2
HOLD: Final = 3

TURN: Final = 1 << 24
HALF_TURN: Final = 1 << 23
FARTHEST: Final = (1 << 19) - 1
"""Distances beyond this count as this in the calculation of the braking velocity."""

LAST: Final = NEVER
"""The tick at which a part that lasts ends."""


Place = tuple[int, int, int]
"""Between two ramp ticks while braking: tick, speed, and what the pulse ticks have to add up to for the target."""


def signed24(x: int) -> int:
    """The position that 24 bits of `x` stand for, -2^23 .. 2^23 - 1."""
    return (x + HALF_TURN & TURN - 1) - HALF_TURN


def brake_factor(a_max: int, ramp_div: int, pulse_div: int) -> tuple[int, int]:
    """P_MUL (128..255) and P_DIV (0..13) that brake with an A_MAX of 0..2047, 1.2 % early.

    Where no pair fits, the nearest: 255 and 0, or 128 and 13.

    Source: TMC429 datasheet 8.1.10; reduction and nearest pair: fidelity CHIP-9.
    """
    exponent = pulse_div - ramp_div - 4
    for p_div in range(13, -1, -1):
        shift = exponent + p_div
        numerator, denominator = 988 * a_max << max(shift, 0), 1000 << max(-shift, 0)
        if (p_mul := numerator // denominator) <= 255:
            return (p_mul, p_div) if p_mul >= 128 else (128, 13)
    return 255, 0


def floors(start: int, step: int, count: int) -> int:
    """The sum of (start + i*step) >> 8 for i = 0 .. count - 1."""
    total = (start >> 8) * count + (step >> 8) * (count * (count - 1) >> 1)
    start &= 255
    step &= 255
    modulus = 256
    while (top := step * count + start) >= modulus:
        count, start = divmod(top, modulus)
        modulus, step = step, modulus
        quotient, step = divmod(step, modulus)
        total += quotient * (count * (count - 1) >> 1)
        quotient, start = divmod(start, modulus)
        total += quotient * count
    return total


class State(NamedTuple):
    """An axis after one tick."""

    n: int = 0
    """The tick, counted from power-on."""
    v: int = 0
    """Velocity, signed, in 1/256 of a velocity unit."""
    x: int = 0
    """X_ACTUAL, signed."""
    acc: int = 0
    """Accumulator of the pulse generator, 0..2047."""
    wave: int = 0
    """Microstep phase in 64ths of a full step, counted on past the wave's 256."""
    a: int = 0
    """A_ACTUAL: what the last ramp tick did to the velocity, signed."""
    stopping: bool = False
    """Whether the last ramp tick took speed away because of a stop switch."""
    rest: int = 0
    """Tick since which v is zero; while it is not, some earlier tick."""
    down: bool = False
    """Whether the motion, or the last one, is toward lower positions."""


class Part:
    """A stretch of the future in one direction, from `start` (exclusive) to `end` (inclusive)."""

    __slots__ = ("_answer", "_asked", "axis", "direction", "mark", "speed", "start", "stopping")

    def __init__(self, axis: Axis, start: State, direction: int) -> None:
        self.axis = axis
        self.start = start
        self.direction = direction
        self.speed = abs(start.v)
        self.stopping = False
        """Whether it is a stop switch that slows the axis."""
        self.mark = 0
        """A tick that is noticed for its velocity, or 0."""
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

    def state(self, n: int, speed: int, steps: int, acc: int, *, a: int = 0, rest: int = 0) -> State:
        """The state after tick n, so many steps from the start."""
        start, way = self.start, self.direction * steps
        return State(
            n,
            self.direction * speed,
            signed24(start.x + way),
            acc,
            start.wave + way * self.axis.wave_step,
            a,
            self.stopping,
            rest,
            self.direction < 0 if speed or start.v else start.down,
        )


class Coast(Part):
    """Constant velocity `speed`; the first ramp tick may have brought it about, with acceleration `a`."""

    __slots__ = ("a", "end")

    def __init__(self, axis: Axis, start: State, direction: int, speed: int, end: int) -> None:
        super().__init__(axis, start, direction)
        self.speed = speed
        self.end = end
        self.a = 0

    def reaches(self, steps: int) -> bool:
        """Whether the part makes so many steps."""
        return self.speed >= 256 and (self.end == LAST or self.moved(self.end) >= steps)

    def moved(self, n: int) -> int:
        """The number of steps from the start to tick n."""
        start = self.start
        shift = self.axis.pulse_div
        return start.acc + (self.speed >> 8) * ((n >> shift) - (start.n >> shift)) >> 11

    def position(self, n: int) -> int:
        """X_ACTUAL after a tick of the part."""
        start = self.start
        return signed24(start.x + self.direction * self.moved(n)) if self.speed >= 256 else start.x

    def when(self, steps: int) -> int:
        """The tick of a step within the part, the first being 1."""
        start = self.start
        shift = self.axis.pulse_div
        pulses = -((start.acc - (steps << 11)) // (self.speed >> 8))
        return (start.n >> shift) + pulses << shift

    def at(self, n: int) -> State:
        """The state after a tick of the part."""
        start, axis, speed = self.start, self.axis, self.speed
        shift = axis.pulse_div
        steps, acc = divmod(start.acc + (speed >> 8) * ((n >> shift) - (start.n >> shift)), 2048)
        ramps = (n >> axis.ramp_div) - (start.n >> axis.ramp_div)
        a = self.a if ramps == 1 else start.a if ramps == 0 else 0
        return self.state(n, speed, steps, acc, a=a, rest=start.rest if start.v == 0 else start.n + 1)

    def final(self) -> State:
        """The state after the last tick of the part."""
        return self.at(self.end)

    def steps(self, after: int, until: int) -> Iterator[int]:
        """The ticks of the steps within after + 1 .. until, both of the part."""
        for step in range(self.moved(after) + 1, self.moved(until) + 1):
            yield self.when(step)


class Change(Part):
    """The speed goes from `speed` by `step` per ramp tick, and stays at least zero."""

    __slots__ = ("end", "step")

    def __init__(self, axis: Axis, start: State, direction: int, step: int, ramps: int) -> None:
        super().__init__(axis, start, direction)
        self.step = step
        self.end = start.n + (ramps << axis.ramp_div)

    def pulsed(self, ramps: int) -> int:
        """What the pulse ticks of so many whole ramp intervals add up to."""
        rise, speed, step = self.axis.rise, self.speed, self.step
        if rise >= 0:
            return floors(speed + step, step, ramps) << rise
        first = -(self.start.n + 1 >> self.axis.ramp_div) % (1 << -rise)
        if first >= ramps:
            return 0
        count = (ramps - 1 - first >> -rise) + 1
        return floors(speed + step * (first + 1), step << -rise, count)

    def reaches(self, steps: int) -> bool:
        """Whether the part makes so many steps."""
        fastest = max(self.speed, self.speed + self.step * (self.end - self.start.n >> self.axis.ramp_div))
        pulses = (self.end >> self.axis.pulse_div) - (self.start.n >> self.axis.pulse_div)
        return fastest * pulses >= steps - 1 << 19 and self._weight(self.end) >> 11 >= steps

    def _weight(self, n: int) -> int:
        axis = self.axis
        ramps = (n >> axis.ramp_div) - (self.start.n >> axis.ramp_div)
        if axis.rise < 0:
            return self.start.acc + self.pulsed(ramps)
        if ramps == 0:
            return self.start.acc
        pulses = ((n & axis.ramp_mask) >> axis.pulse_div) + 1
        return self.start.acc + self.pulsed(ramps - 1) + (self.speed + self.step * ramps >> 8) * pulses

    def moved(self, n: int) -> int:
        """The number of steps from the start to tick n."""
        return self._weight(n) >> 11

    def position(self, n: int) -> int:
        """X_ACTUAL after a tick of the part."""
        return signed24(self.start.x + self.direction * self.moved(n))

    def when(self, steps: int) -> int:
        """The tick of a step within the part, the first being 1."""
        axis, start = self.axis, self.start
        wanted = (steps << 11) - start.acc
        low, high = 0, self.end - start.n >> axis.ramp_div  # wanted is reached in interval low + 1 .. high
        while high - low > 1:
            middle = low + high >> 1
            if self.pulsed(middle) >= wanted:
                high = middle
            else:
                low = middle
        boundary = start.n + 1 + (low << axis.ramp_div)
        if axis.rise < 0:
            return boundary
        pulses = -((self.pulsed(low) - wanted) // (self.speed + self.step * high >> 8))
        return boundary + (pulses - 1 << axis.pulse_div)

    def at(self, n: int) -> State:
        """The state after a tick of the part."""
        axis, start = self.axis, self.start
        ramps = (n >> axis.ramp_div) - (start.n >> axis.ramp_div)
        if ramps == 0:
            return start
        steps, acc = divmod(self._weight(n), 2048)
        speed = self.speed + self.step * ramps
        return self.state(n, speed, steps, acc, a=self.direction * self.step, rest=n & ~axis.ramp_mask)

    def final(self) -> State:
        """The state after the last tick of the part."""
        return self.at(self.end)

    def steps(self, after: int, until: int) -> Iterator[int]:
        """The ticks of the steps within after + 1 .. until, both of the part."""
        axis = self.axis
        while after < until:
            rest = min(until, after + 1 | axis.ramp_mask)
            state = self.at(after + 1)
            begin = self.at(after)._replace(v=state.v)
            yield from Coast(axis, begin, self.direction, abs(state.v), rest).steps(after, rest)
            after = rest


class Braking(Part):
    """The speed follows the braking velocity of the distance, as far as A_MAX allows, down to the target.

    The way there is a sequence of places between two ramp ticks, some of which are kept as checkpoints.
    """

    __slots__ = ("_checkpoints", "_end", "_found", "_lowest", "_ticks")

    EVERY: Final = 32
    """Small steps from one checkpoint to the next."""

    def __init__(self, axis: Axis, start: State, direction: int) -> None:
        super().__init__(axis, start, direction)
        self.mark = start.n + 1
        way = (direction * axis.distance(start.x) << 11) - start.acc
        self._checkpoints: list[Place] = [(start.n, self.speed, way)]
        self._ticks = [start.n]
        self._lowest = axis.nearest(axis.v_min + 1) - 1 << 11
        """While more of the way than this is left, V_MIN does not matter."""
        self._end = 0
        self._found: Coast | Change | None = None

    @property
    def end(self) -> int:
        """The tick before the ramp tick that no longer brakes for the target."""
        if not self._end:
            place = self._checkpoints[0]
            while (after := self._walk(place, LAST, -TURN << 11)) != place:
                place = after
                self._checkpoints.append(place)
                self._ticks.append(place[0])
            self._end = place[0]
        return self._end

    def reaches(self, steps: int) -> bool:
        """Whether the part makes so many steps."""
        return self.end > 0 and _ahead(self._checkpoints[0]) - _ahead(self._checkpoints[-1]) >= steps

    def at(self, n: int) -> State:
        """The state after a tick of the part."""
        if n == self.start.n:
            return self.start
        piece = self._found
        if piece is None or not piece.start.n < n <= piece.end:
            if n > self.start.n + 1 and n > self.end:
                raise ValueError(f"tick {n} is past the end of the part")
            place = self._checkpoints[bisect_right(self._ticks, n - 1) - 1]
            piece = self._piece(self._walk(place, n - 1, -TURN << 11))
            while piece.end < n:
                piece = self.axis.simple_part(piece.at(piece.end))
            self._found = piece
        return piece.at(n)

    def moved(self, n: int) -> int:
        """The number of steps from the start to tick n; less than half a turn of the counter."""
        return self.direction * (self.at(n).x - self.start.x) % TURN

    def position(self, n: int) -> int:
        """X_ACTUAL after a tick of the part."""
        return self.at(n).x

    def when(self, steps: int) -> int:
        """The tick of a step within the part, the first being 1."""
        left = _ahead(self._checkpoints[0]) - steps << 11
        index = bisect_left(self._checkpoints, -left, key=lambda place: -place[2]) - 1
        piece = self._piece(self._walk(self._checkpoints[index], self.end, left))
        while not piece.reaches(steps - self._before(piece)):
            piece = self.axis.simple_part(piece.at(piece.end))
        self._found = piece
        return piece.when(steps - self._before(piece))

    def final(self) -> State:
        """The state after the last tick of the part, but for A_ACTUAL."""
        return self._state(self._checkpoints[-1]) if self.end else self.start

    def _state(self, place: Place) -> State:
        """The state at a place on the way, but for A_ACTUAL."""
        n, speed, way = place
        steps = _ahead(self._checkpoints[0]) - _ahead(place)
        return self.state(n, speed, steps, -way & 2047)

    def _piece(self, place: Place) -> Coast | Change:
        """The simple part that begins at a place on the way."""
        return self.axis.simple_part(self.start if place[0] == self.start.n else self._state(place))

    def _before(self, piece: Coast | Change) -> int:
        """The number of steps before a simple part of the way."""
        return self.direction * (piece.start.x - self.start.x) % TURN

    def _walk(self, place: Place, until: int, left: int) -> Place:
        """Some small steps on the way, none of them past tick `until` or to where no more than `left` of it is left."""
        axis, lowest = self.axis, self._lowest
        if axis.dense and lowest < place[2] <= FARTHEST << 11:
            interval = axis.ramp_mask + 1
            after = self._walk_intervals(
                place, min(self.EVERY, (until - place[0]) // interval), max(left, lowest)
            )
            if after[2] <= left:
                after = self._walk_intervals(place, (after[0] - place[0]) // interval - 1, lowest)
            if after != place:
                return after
        return self._walk_velocities(place, until, left)

    def _walk_intervals(self, place: Place, count: int, lowest: int) -> Place:
        """So many ramp intervals, while more than `lowest` of the way is left and V_MIN does not matter."""
        axis = self.axis
        n, speed, way = place
        a_max, rise, factor, shift = axis.a_max, axis.rise, axis.factor, axis.shift
        interval = axis.ramp_mask + 1
        for begin in range(n, n + count * interval, interval):
            if way <= lowest:
                return begin, speed, way
            v = isqrt(factor * (way - 1 >> 11) >> shift)
            slowest = speed - a_max
            speed = v << 8
            if slowest > speed:
                speed = slowest
                v = slowest >> 8
            way -= v << rise
        return n + count * interval, speed, way

    def _walk_velocities(self, place: Place, until: int, left: int) -> Place:
        """Up to EVERY stretches in which the integer part of the velocity is the one aimed at."""
        axis = self.axis
        a_max, rise, ramp_div = axis.a_max, axis.rise, axis.ramp_div
        for _ in range(self.EVERY):
            n, speed, way = place
            if way <= 0:
                break
            aim = axis.allowed(-(-way >> 11))
            if speed - a_max >> 8 > aim:
                piece = self._piece(place)
                state = piece.at(piece.end)
                ahead = self.direction * axis.distance(state.x)
                after = piece.end, abs(state.v), (ahead << 11) - state.acc
            elif aim:
                pulses = -(-(way - (axis.nearest(aim) - 1 << 11)) // aim)
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


AnyPart = Coast | Change | Braking


class Axis:
    """Registers and state of one axis, and the chain of parts that is its future.

    The attributes are the registers of these names as numbers; after setting them, `cut` starts a new chain.
    `left` and `right` say whether the stop function of a switch acts: active and not disabled.
    """

    __slots__ = (
        "a_max",
        "begin",
        "dense",
        "dx_ref_tolerance",
        "factor",
        "left",
        "margin",
        "mode",
        "parts",
        "pdiv",
        "pmul",
        "pulse_div",
        "ramp_div",
        "ramp_mask",
        "right",
        "rise",
        "seen",
        "shift",
        "soft_stop",
        "usrs",
        "v_max",
        "v_min",
        "v_target",
        "wave_step",
        "x_target",
    )

    def __init__(self) -> None:
        self.mode = RAMP
        self.x_target = self.v_min = self.v_max = self.v_target = self.a_max = 0
        self.pmul, self.pdiv = 128, 0
        self.ramp_div = self.pulse_div = 0
        self.usrs = 0
        self.left = self.right = self.soft_stop = False
        self.dx_ref_tolerance = 0
        self.parts: list[AnyPart] = []
        self.cut(State())

    # ---- time

    def cut(self, state: State) -> None:
        """Start a new chain at `state`."""
        self.ramp_div = min(self.ramp_div, 13)
        self.pulse_div = min(self.pulse_div, 13)
        self.wave_step = 64 >> min(self.usrs, 6)
        self.ramp_mask = (1 << self.ramp_div) - 1
        self.rise = self.ramp_div - self.pulse_div
        self.shift = 3 + self.pdiv
        self.factor = self.pmul if self.mode == SOFT else self.pmul << 11
        self.margin = 0 if self.mode == SOFT else 1
        self.dense = self.mode == RAMP and self.rise >= 0 and 8 << self.pdiv < self.pmul << self.rise
        self.parts.clear()
        self.begin = self.seen = state

    def at(self, n: int) -> State:
        """The state after tick n, which must not be earlier than the last `cut`."""
        if n != self.seen.n:
            self.seen = self._part(n).at(n) if n > self.begin.n else self.begin
        return self.seen

    def position(self, n: int) -> int:
        """X_ACTUAL after tick n, like `at`."""
        return (
            self.seen.x
            if n == self.seen.n
            else self._part(n).position(n)
            if n > self.begin.n
            else self.begin.x
        )

    def next_mark(self, n: int, steps: Callable[[State, int], int]) -> int:
        """The first tick after n that somebody could want to be told of, or `LAST`.

        `steps(state, direction)` says after how many steps in a direction a position is noticed; which positions
        are must not depend on the state.
        """
        part = self._part(n + 1)
        while True:
            seen = max(n, part.start.n)
            mark = part.mark if part.mark > n else LAST
            if mark == seen + 1:
                return mark
            tick = part.reached(steps(part.start, part.direction))
            if tick <= n:
                tick = part.reached(part.moved(n) + steps(self.at(n), part.direction))
            mark = min(mark, tick)
            if mark < LAST or part.end == LAST:
                return mark
            part = self._part(part.end + 1)

    def steps(self, after: int, until: int) -> Iterator[tuple[int, int]]:
        """Tick and direction of each step within after + 1 .. until; the chain itself is left as it is."""
        state = self.at(after)
        while state.n < until:
            part = self._held(state) or self.simple_part(state)
            end = min(part.end, until)
            for tick in part.steps(state.n, end):
                yield tick, part.direction
            state = part.at(end)

    def law(self, n: int) -> int:
        """What the ramp ticks after tick n add to the velocity, signed; while braking, about that."""
        part = self._part(n + 1)
        if isinstance(part, Coast) and part.end <= n | self.ramp_mask:
            part = self._part(part.end + 1)
        if isinstance(part, Coast):
            return 0
        return part.direction * part.step if isinstance(part, Change) else -part.direction * self.a_max

    def forget(self, n: int) -> None:
        """Drop the parts that ended before tick n."""
        while len(self.parts) > 1 and self.parts[0].end < n:
            self.begin = self.parts[1].start
            del self.parts[0]

    def _part(self, n: int) -> AnyPart:
        """The part that holds tick n, the chain prolonged as needed."""
        parts = self.parts
        if not parts:
            parts.append(self._next_part(self.begin))
        for part in parts:
            if n <= part.start.n + 1 or n <= part.end:
                return part
        part = parts[-1]
        while n > part.end:
            part = self._next_part(part.final())
            parts.append(part)
        return part

    # ---- what the ramp generator wants

    def distance(self, x: int) -> int:
        """From x to the target, the shorter way round."""
        return signed24(self.x_target - x)

    def allowed(self, far: int) -> int:
        """The highest velocity at a distance of at least 1 from which the axis can brake to the target.

        In ramp mode it brakes for the step before the target, and V_MIN makes the last one.

        Source: datasheet 8.1.10; fidelity CHIP-1 (square root) and CHIP-2 (soft mode).
        """
        limit = self.factor * (min(far, FARTHEST) - self.margin) >> self.shift
        return min(self.v_max, max(self.v_min, limit if self.mode == SOFT else isqrt(limit)))

    def nearest(self, velocity: int) -> int:
        """The smallest distance at which a velocity is allowed that is allowed at some distance."""
        if velocity <= self.v_min:
            return 1
        limit = velocity if self.mode == SOFT else velocity * velocity
        return self.margin - ((-limit << self.shift) // self.factor)

    def aim(self, v: int, x: int) -> int:
        """The velocity, signed and in 1/256, that the axis moves toward."""
        if self.mode == HOLD:
            return v
        if self.mode == VELOCITY:
            return max(-self.v_max, min(self.v_max, self.v_target)) << 8
        distance = self.distance(x)
        if distance in (0, -HALF_TURN):
            return 0
        return self.allowed(distance) << 8 if distance > 0 else -self.allowed(-distance) << 8

    def v_target_read(self, state: State) -> int:
        """The V_TARGET register: in ramp and soft mode V_MAX with the sign of the motion, 0 when braking or at rest.

        Source: manual chapter 7, parameter 2; fidelity CHIP-3.
        """
        v = state.v
        if self.mode > SOFT:
            return self.v_target
        if v == 0 or state.a * v < 0:
            return 0
        sign = -1 if v < 0 else 1
        aim = sign * self.aim(v, state.x)
        return 0 if aim < self.v_max << 8 and abs(v) >= aim else sign * self.v_max

    def blocked(self, direction: int, x: int) -> bool:
        """Whether a stop switch forbids that direction at x."""
        if self.dx_ref_tolerance and abs(x) <= self.dx_ref_tolerance:
            return False
        return self.right if direction > 0 else self.left

    # ---- the next part

    def _next_part(self, start: State) -> AnyPart:
        if (held := self._held(start)) is not None:
            return held
        aim = self.aim(start.v, start.x)
        if aim and self._brakes(start, aim):
            return Braking(self, start, 1 if aim > 0 else -1)
        return self._law(start, aim)

    def _held(self, start: State) -> Coast | None:
        """The rest of a ramp interval that `start` falls into."""
        if not start.n + 1 & self.ramp_mask:
            return None
        part = Coast(self, start, -1 if start.v < 0 else 1, abs(start.v), start.n | self.ramp_mask)
        part.stopping = start.stopping
        return part

    def _brakes(self, start: State, aim: int) -> bool:
        """Whether from here on the velocity follows the distance."""
        direction = 1 if aim > 0 else -1
        return (
            self.mode <= SOFT
            and max(direction * aim - self.a_max, 0) <= direction * start.v
            and direction * aim < self.v_max << 8
            and self.a_max > 0
            and not (self.dx_ref_tolerance and (self.left or self.right))
            and not self.blocked(direction, start.x)
        )

    def simple_part(self, start: State) -> Coast | Change:
        """The part that begins with a ramp tick, cut where its law could change."""
        return self._law(start, self.aim(start.v, start.x))

    def _law(self, start: State, aim: int) -> Coast | Change:
        v, x = start.v, start.x
        direction = -1 if (v or aim) < 0 else 1
        speed, aim = abs(v), direction * aim
        step = 0 if self.mode == HOLD else self.a_max
        if self.mode <= SOFT and x == self.x_target and speed >> 8 <= self.v_min:
            return self._coast(start, direction, 0)
        new = min(speed + step, aim) if speed < aim else max(speed - step, aim)
        if new and self.blocked(direction if new > 0 else -direction, x):
            return self._stop(start, direction, step, new, aim)
        if new < 0:
            return self._coast(start, -direction, -new, once=True)
        room = self._room(x, direction)
        if new in (aim, speed):
            if self.mode <= SOFT and step and new:
                room = min(room, direction * self.distance(x) - self.nearest(new >> 8) + 1)
            return self._until(self._coast(start, direction, new), room)
        if speed < aim:
            part = Change(self, start, direction, step, self._rising(start, direction, aim))
        elif aim < 0:
            part = Change(self, start, direction, -step, speed // step)
            if speed % step == 0:
                part.mark = part.end - self.ramp_mask
        else:
            ramps = (speed - aim - 1) // step
            if self.mode <= SOFT and x == self.x_target:
                ramps = min(ramps, (speed - (self.v_min + 1 << 8)) // step + 1)
            part = Change(self, start, direction, -step, ramps)
        return self._until(part, room)

    def _coast(self, start: State, direction: int, speed: int, *, once: bool = False) -> Coast:
        """Constant velocity from the next ramp tick on, for good or for one ramp interval."""
        end = start.n + self.ramp_mask + 1 if once else LAST
        part = Coast(self, start, direction, speed, end)
        change = direction * speed - start.v
        if change:
            part.a = self.a_max if change > 0 else -self.a_max
            if not once and (self.mode == VELOCITY or speed in (0, self.v_max << 8)):
                part.mark = start.n + 1
        return part

    def _stop(self, start: State, direction: int, step: int, new: int, aim: int) -> Coast | Change:
        """What a stop switch makes of a ramp tick that would have led to speed `new`."""
        speed = abs(start.v)
        if not speed:
            return self._coast(start, direction, 0)
        soft = self.soft_stop and self.mode != HOLD and new > 0
        if not soft or 0 < speed <= step:
            part = self._coast(start, direction, 0, once=True)
        elif step:
            part = Change(self, start, direction, -step, (speed - 1) // step)
        else:
            part = self._coast(start, direction, speed)
        part.stopping = True
        if not start.stopping or part.speed == 0:
            part.mark = start.n + 1
        room = self._room(start.x, direction)
        if self.mode <= SOFT and aim > 0:
            room = min(room, direction * self.distance(start.x) - self.nearest(1) + 1)
        return self._until(part, room)

    def _rising(self, start: State, direction: int, aim: int) -> int:
        """The number of ramp ticks that add the full A_MAX before the velocity aimed at is reached."""
        step, speed = self.a_max, abs(start.v)
        ramps = (aim - speed - 1) // step
        if self.mode > SOFT:
            return ramps
        part = Change(self, start, direction, step, ramps)
        ahead = direction * self.distance(start.x)

        def full(ramps: int) -> bool:
            left = ahead - (start.acc + part.pulsed(ramps - 1) >> 11)
            return left > 0 and speed + step * ramps < self.allowed(left) << 8

        if not part.reaches(ahead - self.nearest(aim >> 8)) or full(ramps):
            return ramps
        low, high = 1, ramps
        while high - low > 1:
            middle = low + high >> 1
            low, high = (middle, high) if full(middle) else (low, middle)
        return low

    def _until(self, part: Coast | Change, room: int) -> Coast | Change:
        """`part`, cut at the end of the ramp interval in which it makes its step number `room`."""
        if part.reaches(room):
            part.end = part.when(room) | self.ramp_mask
            if part.mark > part.end:
                part.mark = 0
        return part

    def _room(self, x: int, direction: int) -> int:
        """The number of steps after which the law of motion could be another, because of the position."""
        room = TURN
        if self.mode <= SOFT:
            distance = self.distance(x)
            ahead = direction * distance
            room = 1 if distance in (0, -HALF_TURN) else ahead if ahead > 0 else HALF_TURN + ahead
        if self.dx_ref_tolerance and (self.left or self.right):
            inside, outside = -direction * self.dx_ref_tolerance, direction * (self.dx_ref_tolerance + 1)
            room = min(
                room, (direction * (inside - x) - 1) % TURN + 1, (direction * (outside - x) - 1) % TURN + 1
            )
        return room
