"""An axis: its registers, and the chain of parts that is its future."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from tmcm34x.chips.ramp.braking import Braking
from tmcm34x.chips.ramp.law import Law
from tmcm34x.chips.ramp.parts import Change, Coast
from tmcm34x.chips.ramp.plan import brakes, held, simple_part
from tmcm34x.chips.ramp.state import LAST, TURN, RampState
from tmcm34x.clock import Value

AnyPart = Coast | Change | Braking


class RampAxis(Law):
    """The registers of an axis, and its future; after setting registers (and `derive`), `cut` starts a new chain."""

    def __init__(self) -> None:
        super().__init__()
        self.parts: list[AnyPart] = []
        self.bend = False
        """Whether at the mark that was found last the axis does no more than to change its acceleration."""
        self.cut(RampState())

    def save(self) -> Value:
        """Registers, and the state from which the future follows."""
        return self.save_registers(), self.begin.save()

    def load(self, value: Any) -> None:
        """Become an axis that was saved; the chain is planned anew, and turns out as it was."""
        registers, begin = value
        self.load_registers(registers)
        self.cut(RampState.load(begin))

    def cut(self, state: RampState) -> None:
        """Start a new chain at `state`."""
        self.parts.clear()
        self.begin = self.seen = state
        self._asked, self._speed = state.n, state.v

    def at(self, n: int) -> RampState:
        """The state after tick n, which must not be earlier than the last `cut`."""
        if n != self.seen.n:
            self.seen = self._part(n).at(n) if n > self.begin.n else self.begin
        return self.seen

    def velocity(self, n: int) -> int:
        """The velocity after tick n, signed and in 1/256, like `at`."""
        if n != self._asked:
            self._speed = self._part(n).velocity(n) if n > self.begin.n else self.begin.v
            self._asked = n
        return self._speed

    def position(self, n: int) -> int:
        """X_ACTUAL after tick n, like `at`."""
        if n == self.seen.n:
            return self.seen.x
        return self._part(n).position(n) if n > self.begin.n else self.begin.x

    def next_mark(self, n: int, up: list[int], down: list[int]) -> int:
        """The first tick after n that something could wait for, or `LAST`.

        up, down: the positions that are noticed when a step upward or downward leads there; none: every step is
        """
        part = self._part(n + 1)
        while True:
            mark = part.mark if part.mark > n else LAST
            goals = up if part.direction > 0 else down
            steps = _steps_to(goals, part.start.x, part.direction)
            self.bend = part.bend and steps > 1
            if mark == part.start.n + 1:
                return mark
            tick = part.reached(steps)
            if tick <= n:
                tick = _reached_again(part, n, goals, steps)
            if tick <= mark:
                mark, self.bend = tick, False
            if mark < LAST or part.end == LAST:
                return mark
            part = self._part(part.end + 1)

    def steps(self, after: int, until: int) -> Iterator[tuple[int, int]]:
        """Tick and direction of each step within after + 1 .. until; the chain itself is left as it is."""
        state = self.at(after)
        while state.n < until:
            part = held(self, state) or simple_part(self, state, self.aim(state.v, state.x))
            end = min(part.end, until)
            for tick in part.steps(state.n, end):
                yield tick, part.direction
            state = part.at(end)

    def bends(self, after: int, until: int) -> Iterator[RampState]:
        """The states between which the speed only rises or only falls within after + 1 .. until, the last at until."""
        while after < until:
            after = min(self._part(after + 1).end, until)
            yield self.at(after)

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

    def _next_part(self, start: RampState) -> AnyPart:
        if (rest := held(self, start)) is not None:
            return rest
        aim = self.aim(start.v, start.x)
        if aim and brakes(self, start, aim):
            return Braking(self, start, 1 if aim > 0 else -1)
        return simple_part(self, start, aim)


def _reached_again(part: AnyPart, n: int, goals: list[int], first: int) -> int:
    """The tick after n at which a part comes to a goal that it has come to in `first` steps, or `LAST`."""
    if len(goals) == 1 and not part.reaches(first + TURN):
        return LAST
    before = part.moved(n)
    x = part.start.x + part.direction * before
    return part.reached(before + _steps_to(goals, x, part.direction))


def _steps_to(goals: list[int], x: int, direction: int) -> int:
    """The number of steps from x to the first of some positions; 1 where every step counts."""
    if not goals:
        return 1
    if len(goals) == 1:
        return (direction * (goals[0] - x) - 1) % TURN + 1
    return min([(direction * (goal - x) - 1) % TURN + 1 for goal in goals])
