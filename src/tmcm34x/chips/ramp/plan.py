"""The simple part that begins at a state: what the next ramp tick does, and for how long it goes on like that."""

from __future__ import annotations

from tmcm34x.chips.ramp.law import Law
from tmcm34x.chips.ramp.parts import Change, Coast
from tmcm34x.chips.ramp.state import HALF_TURN, HOLD, LAST, SOFT, TURN, VELOCITY, RampState


def held(law: Law, start: RampState) -> Coast | None:
    """The rest of a ramp interval that `start` falls into."""
    if not start.n + 1 & law.ramp_mask:
        return None
    part = Coast(law, start, -1 if start.v < 0 else 1, abs(start.v), start.n | law.ramp_mask)
    part.stopping = start.stopping
    return part


def brakes(law: Law, start: RampState, aim: int) -> bool:
    """Whether from here on the velocity follows the distance."""
    direction = 1 if aim > 0 else -1
    return (
        law.mode <= SOFT
        and max(direction * aim - law.a_max, 0) <= direction * start.v
        and direction * aim < law.v_max << 8
        and law.a_max > 0
        and not ((law.left or law.right) and (law.windowed(direction) or law.blocked(direction, start.x)))
    )


def simple_part(law: Law, start: RampState, aim: int) -> Coast | Change:
    """The part that begins with a ramp tick, cut where its law could change.

    aim: the velocity that the axis moves toward, signed and in 1/256
    """
    v, x = start.v, start.x
    direction = -1 if (v or aim) < 0 else 1
    speed, aim = abs(v), direction * aim
    step = 0 if law.mode == HOLD else law.a_max
    if law.mode <= SOFT and x == law.x_target and speed >> 8 <= law.v_min:
        return _coast(law, start, direction, 0)
    new = min(speed + step, aim) if speed < aim else max(speed - step, aim)
    if new and (law.left or law.right) and law.blocked(direction if new > 0 else -direction, x):
        return _stop(law, start, direction, step, new, aim)
    if new < 0:
        return _coast(law, start, -direction, -new, once=True)
    room = _room(law, x, direction)
    if new in (aim, speed):
        if law.mode <= SOFT and step and new:
            room = min(room, direction * law.distance(x) - law.nearest(new >> 8) + 1)
        return _until(law, _coast(law, start, direction, new), room)
    if speed < aim:
        part = _rising(law, start, direction, aim)
    elif aim < 0:
        part = Change(law, start, direction, -step, speed // step)
        if speed % step == 0:
            part.mark = part.end - law.ramp_mask
    else:
        ramps = (speed - aim - 1) // step
        at_target = law.mode <= SOFT and x == law.x_target
        if at_target:
            ramps = min(ramps, (speed - (law.v_min + 1 << 8)) // step + 1)
        part = Change(law, start, direction, -step, ramps)
        if at_target:
            part.mark = part.end - law.ramp_mask
    return _until(law, part, room)


def _coast(law: Law, start: RampState, direction: int, speed: int, *, once: bool = False) -> Coast:
    """Constant velocity from the next ramp tick on, for good or for one ramp interval."""
    end = start.n + law.ramp_mask + 1 if once else LAST
    part = Coast(law, start, direction, speed, end)
    change = direction * speed - start.v
    if change:
        part.a = law.a_max if change > 0 else -law.a_max
        if not once and (law.mode == VELOCITY or speed in (0, law.v_max << 8)):
            part.mark = start.n + 1
            part.bend = speed != 0
    return part


def _stop(  # noqa: PLR0917
    law: Law, start: RampState, direction: int, step: int, new: int, aim: int
) -> Coast | Change:
    """What a stop switch makes of a ramp tick that would have led to speed `new`."""
    speed = abs(start.v)
    if not speed:
        return _coast(law, start, direction, 0)
    soft = law.soft_stop and law.mode != HOLD and new > 0
    part: Coast | Change
    if not soft or 0 < speed <= step:
        part = _coast(law, start, direction, 0, once=True)
    elif step:
        part = Change(law, start, direction, -step, (speed - 1) // step)
    else:
        part = _coast(law, start, direction, speed)
    part.stopping = True
    if not start.stopping or part.speed == 0:
        part.mark = start.n + 1
    room = _room(law, start.x, direction)
    if law.mode <= SOFT and aim > 0:
        room = min(room, direction * law.distance(start.x) - law.nearest(1) + 1)
    return _until(law, part, room)


def _rising(law: Law, start: RampState, direction: int, aim: int) -> Change:
    """The ramp ticks that add the full A_MAX before the velocity aimed at is reached."""
    step, speed = law.a_max, abs(start.v)
    ramps = (aim - speed - 1) // step
    part = Change(law, start, direction, step, ramps)
    if law.mode > SOFT:
        return part
    ahead = direction * law.distance(start.x)
    if not part.reaches(ahead - law.nearest(aim >> 8)) or _full(part, ahead, ramps):
        return part
    low, high = 1, ramps
    while high - low > 1:
        middle = low + high >> 1
        low, high = (middle, high) if _full(part, ahead, middle) else (low, middle)
    return Change(law, start, direction, step, low)


def _full(part: Change, ahead: int, ramps: int) -> bool:
    """Whether ramp tick number `ramps` of a rising part still adds the full A_MAX, the target being so far ahead."""
    left = ahead - (part.start.acc + part.pulsed(ramps - 1) >> 11)
    return left > 0 and part.speed + part.step * ramps < part.law.allowed(left) << 8


def _until(law: Law, part: Coast | Change, room: int) -> Coast | Change:
    """`part`, cut at the end of the ramp interval in which it makes its step number `room`."""
    tick = part.reached(room)
    if tick < LAST:
        part.end = tick | law.ramp_mask
        if part.mark > part.end:
            part.mark = 0
    return part


def _room(law: Law, x: int, direction: int) -> int:
    """The number of steps after which the law of motion could be another, because of the position."""
    room = TURN
    if law.mode <= SOFT:
        distance = law.distance(x)
        ahead = direction * distance
        room = 1 if distance in (0, -HALF_TURN) else ahead if ahead > 0 else HALF_TURN + ahead
    if law.dx_ref_tolerance and law.windowed(direction):
        inside, outside = -direction * law.dx_ref_tolerance, direction * (law.dx_ref_tolerance + 1)
        room = min(
            room, (direction * (inside - x) - 1) % TURN + 1, (direction * (outside - x) - 1) % TURN + 1
        )
    return room
