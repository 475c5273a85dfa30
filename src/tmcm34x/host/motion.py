"""Moving: operations on the motors of a module, as steps.

Source: manual 6.7.1 to 6.7.4, 6.7.13, 6.7.34, 7.1 (3, 8).
"""

from __future__ import annotations

from collections.abc import Callable
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
from tmcm34x.tmcl.axis_parameters import BY_KEY
from tmcm34x.tmcl.commands import MOTORS
from tmcm34x.tmcl.datagram import Instruction

POLL_S: Final = 0.02
"""Between two looks at a motor that is moving."""
STANDING: Final = 10
"""Looks in a row at which a motor stands still elsewhere than at its target, until it counts as stopped."""
_GAP: Final = NUMBERS["GAP"]
_REACHED, _POSITION, _SPEED, _TARGET = (
    BY_KEY[key].number for key in ("position_reached", "actual_position", "actual_speed", "target_position")
)


def rotate(motor: int, speed: int) -> Steps[int]:
    """Turn at a velocity setting, toward higher positions if positive (ROR)."""
    return (yield from value(Instruction(NUMBERS["ROR"], 0, motor, speed)))


def move(kind: str, motor: int, target: int) -> Steps[int]:
    """Start a move: `ABS` to a position, `REL` by a distance, `COORD` to a coordinate (MVP)."""
    return (yield from value(Instruction(NUMBERS["MVP"], MOVES[kind], motor, target)))


def wait_reached(motor: int, timeout_s: float) -> Steps[None]:
    """Wait until a motor is at its target.  Raises `NotReachedError`, the motor untouched."""
    standing, end = 0, (yield from now()) + timeout_s
    while True:
        reached = yield from value(Instruction(_GAP, _REACHED, motor))
        speed = yield from value(Instruction(_GAP, _SPEED, motor))
        if reached and not speed:
            return
        standing = 0 if speed else standing + 1
        if standing >= STANDING:
            raise (yield from _elsewhere(motor, "it has stopped; `tmcm34x why` says why"))
        if (yield from now()) > end:
            raise (yield from _elsewhere(motor, f"it is not there after {timeout_s:g} s"))
        yield Pause(POLL_S)


def _elsewhere(motor: int, what: str) -> Steps[NotReachedError]:
    position = yield from value(Instruction(_GAP, _POSITION, motor))
    target = yield from value(Instruction(_GAP, _TARGET, motor))
    return NotReachedError(f"motor {motor} is at {position}, its target is {target}: {what}")


def move_and_wait(kind: str, motor: int, target: int, timeout_s: float) -> Steps[None]:
    """A move, and back when it is over.  Raises `NotReachedError`."""
    yield from move(kind, motor, target)
    yield from wait_reached(motor, timeout_s)


def search(motor: int, action: str) -> Steps[int]:
    """Start or give up a reference search, or ask for its state: 0 is over (RFS)."""
    return (yield from value(Instruction(NUMBERS["RFS"], SEARCHES[action], motor)))


def home(motor: int, timeout_s: float) -> Steps[None]:
    """A whole reference search; one that takes too long is given up.  Raises `NotReachedError`."""
    yield from search(motor, "START")
    end = (yield from now()) + timeout_s
    try:
        while (yield from search(motor, "STATUS")):
            if (yield from now()) > end:
                raise NotReachedError(f"motor {motor} has not found its reference point in {timeout_s:g} s")
            yield Pause(POLL_S)
    except BaseException:
        yield from insist(commands.stop_search(motor))
        raise


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
