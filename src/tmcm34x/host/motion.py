"""Moving: operations on the motors of a module, as steps.

What waits for a motor looks at it again and again; where no time limit is given, until the operation is interrupted.

Source: manual 5.4, 6.7.1 to 6.7.4, 6.7.13, 6.7.34, 7.1 (1, 3, 8).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Final

from tmcm34x.host import commands
from tmcm34x.host.exceptions import DownloadModeError, NotReachedError
from tmcm34x.host.steps import (
    MOVES,
    NUMBERS,
    QUIT_DOWNLOAD,
    REQUEST_EVENT,
    SEARCHES,
    STOP,
    Pause,
    Steps,
    insist,
    now,
    value,
)
from tmcm34x.tmcl.commands import MOTORS
from tmcm34x.tmcl.datagram import Instruction

POLL_S: Final = 0.02
"""Between two looks at a motor that is moving."""
STANDING: Final = 10
"""Looks in a row at which a motor stands still elsewhere than at its target, until it counts as stopped."""
_ATTEMPTS: Final = 3
"""How often a command that may be executed twice is sent until it is answered."""


def move(kind: str, motor: int, target: int) -> Steps[int]:
    """Start a move: `ABS` to a position, `REL` by a distance, `COORD` to a coordinate (MVP)."""
    return (yield from value(Instruction(NUMBERS["MVP"], MOVES[kind], motor, target)))


def wait_reached(motor: int, timeout_s: float) -> Steps[None]:
    """Wait until a motor is at its target.  Raises `NotReachedError`, the motor untouched."""
    standing, end = 0, (yield from now()) + timeout_s
    while True:
        reached = yield from value(commands.read_axis("position_reached", motor))
        speed = yield from value(commands.read_axis("actual_speed", motor))
        if reached and not speed:
            return
        standing = 0 if speed else standing + 1
        if standing >= STANDING:
            raise (yield from _elsewhere(motor, "it has stopped; `tmcm34x why` says why"))
        if (yield from now()) > end:
            raise (yield from _elsewhere(motor, f"it is not there after {timeout_s:g} s"))
        yield Pause(POLL_S)


def _elsewhere(motor: int, what: str) -> Steps[NotReachedError]:
    position = yield from value(commands.read_axis("actual_position", motor))
    target = yield from value(commands.read_axis("target_position", motor))
    return NotReachedError(f"motor {motor} is at {position}, its target is {target}: {what}")


def move_and_wait(kind: str, motor: int, target: int, timeout_s: float) -> Steps[None]:
    """A move, and back when it is over.  Raises `NotReachedError`."""
    yield from move(kind, motor, target)
    yield from wait_reached(motor, timeout_s)


def search(motor: int, action: str) -> Steps[int]:
    """Start or give up a reference search, or ask for its state: 0 is over (RFS)."""
    return (yield from value(Instruction(NUMBERS["RFS"], SEARCHES[action], motor)))


def find_reference(motor: int, timeout_s: float = math.inf) -> Steps[None]:
    """A whole reference search; one that is interrupted goes on in the module.  Raises `NotReachedError`."""
    end = (yield from now()) + timeout_s
    yield from send(commands.start_search(motor))
    while (yield from send(commands.search_state(motor))):
        if (yield from now()) > end:
            raise NotReachedError(f"motor {motor} has not found its reference point in {timeout_s:g} s")
        yield Pause(POLL_S)


def home(motor: int, timeout_s: float) -> Steps[None]:
    """`find_reference`; a search that takes too long or is interrupted is given up.  Raises `NotReachedError`."""
    try:
        yield from find_reference(motor, timeout_s)
    except BaseException:
        yield from insist(commands.stop_search(motor))
        raise


def zero(motor: int) -> Steps[None]:
    """Stop a motor and set actual and target position to 0 where it rests.

    The actual position is written first: while the motor is in velocity mode that moves nothing, and the target
    position is then where the motor is.
    """
    yield from send(commands.stop(motor))
    yield from until("actual_speed", motor, 0)
    yield from send(commands.set_axis("actual_position", motor, 0))
    yield from send(commands.set_axis("target_position", motor, 0))


def go(motors: Sequence[int], coordinate: int) -> Steps[None]:
    """Move motors to a stored coordinate, so that they arrive together; ends when all are there (MVP COORD)."""
    yield from send(commands.to_coordinate(motors, coordinate))
    for motor in motors:
        yield from until("position_reached", motor, 1)


def until(key: str, motor: int, wanted: int) -> Steps[None]:
    """Look at an axis parameter until it has the value `wanted`."""
    while (yield from send(commands.read_axis(key, motor))) != wanted:
        yield Pause(POLL_S)


def send(instruction: Instruction) -> Steps[int]:
    """A command that may be executed twice: sent again where a bad line loses it.  Returns the value of the reply."""
    return (yield from insist(instruction, _ATTEMPTS))


def stop(motor: int) -> Steps[None]:
    """Come to rest along the ramp; sent until it is acknowledged (MST)."""
    yield from _insist_free(commands.stop(motor))


def stop_all(tell: Callable[[str], None] = lambda _: None) -> Steps[None]:
    """Stop the program and all motors, each command sent until it is acknowledged.

    The program first, so that it does not start a motor again.  A module in download mode would store the commands:
    it is taken out of that mode.  `tell` takes a line about it.
    """
    for instruction in (
        Instruction(STOP),
        *map(commands.stop, range(MOTORS)),
    ):
        yield from _insist_free(instruction, tell)


def _insist_free(instruction: Instruction, tell: Callable[[str], None] = lambda _: None) -> Steps[None]:
    try:
        yield from insist(instruction)
    except DownloadModeError:
        tell(
            "the module was in download mode and stored commands instead of executing them; it has left it (133)"
        )
        yield from insist(Instruction(QUIT_DOWNLOAD))
        yield from insist(instruction)


def request_event(motors: int) -> Steps[int]:
    """Have the module tell when all motors of the mask are at their targets (138)."""
    return (yield from value(Instruction(REQUEST_EVENT, 0, 0, motors)))
