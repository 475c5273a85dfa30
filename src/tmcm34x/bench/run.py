"""A stand-alone program at work on a bench, until it is over.

A run ends where nothing can change any more, and only there: programs have stopped, wait for ever, or go round in a
cycle that nothing disturbs, and motors are at rest or turn evenly for ever.  Where that is depends on the bench
alone, not on who looks at it or in which slices its time goes by.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Final, NamedTuple, Protocol

from tmcm34x.clock import HZ, NEVER
from tmcm34x.firmware.axis import V_ACTUAL, X_TARGET
from tmcm34x.tmcl.commands import WAIT_TYPES

if TYPE_CHECKING:
    from tmcm34x.bench.rig import Rig
    from tmcm34x.firmware.module import FirmwareModule
    from tmcm34x.firmware.program import ProgramError

STOPPED: Final = "stopped"
UNTIL: Final = "until"
IDLE: Final = "idle"
TURNING: Final = "turning"
BREAK: Final = "break"
INTERRUPTED: Final = "interrupted"

ENDINGS: Final = {
    STOPPED: "the program has stopped and every motor is at rest",
    UNTIL: "the time limit was reached",
    IDLE: "nothing can change any more",
    TURNING: "a motor keeps turning and nothing else can change any more",
    BREAK: "the condition holds",
    INTERRUPTED: "interrupted",
}
"""Why a run ends, in words."""

POSITIONS: Final = 1 << 24
"""Of the motion chip's counter."""
_NEAR: Final = 2
"""Microsteps by which the pass of a target position is known."""
_POS: Final = dict(WAIT_TYPES)["POS"]


class TimedRig(Protocol):
    """The rig, or the rig with recorders around it."""

    @property
    def now(self) -> int:
        """Its clock."""
        ...

    def next_event(self) -> int:
        """See `clock.Part`."""
        ...

    def advance(self, now: int) -> None:
        """See `clock.Part`."""
        ...


class MotorAt(NamedTuple):
    """A motor of a rig: number of the module, number of the motor."""

    module: int
    motor: int


def _never() -> int:
    return NEVER


class Run:
    """The program of a rig's first module, started at address 0 by `start`.

    part: the rig, or the rig with recorders around it
    condition: ends the run when it is true; it is asked after each command of the program and each other event
    looks: the next clock at which the condition is asked besides
    """

    def __init__(
        self,
        rig: Rig,
        part: TimedRig | None = None,
        condition: Callable[[], bool] | None = None,
        looks: Callable[[], int] = _never,
    ) -> None:
        self.rig = rig
        self.module = rig.modules[0]
        self.ending = ""
        """Why the run is over; empty while it is not."""
        self.refusals: Counter[ProgramError] = Counter()
        """Commands that were refused, or where the program ran past its end, and how often; in order of the first."""
        self._part: TimedRig = rig if part is None else part
        self._condition = condition
        self._looks = looks
        self._holds = False
        self._earlier: ProgramError | None = None

    def start(self, address: int | None = 0) -> None:
        """Start the program at an address; None: go on where it stands, or leave it stopped as it is."""
        program = self.module.program
        self._earlier = program.last_error
        program.on_refusal.append(self._note_refusal)
        if self._condition is not None:
            program.hook(self._asks)
        if address is not None:
            program.run(address)

    def finish(self, ending: str) -> None:
        """The run is over, for this reason."""
        program = self.module.program
        self.ending = ending
        program.unhook(self._asks)
        if self._note_refusal in program.on_refusal:
            program.on_refusal.remove(self._note_refusal)
            error = program.last_error
            if error is not None and error is not self._earlier and error not in self.refusals:
                self.refusals[error] += 1

    def go(self, until: int | None = None) -> str:
        """Run to the end, or to clock `until`; gives back why it ended."""
        for _ in self.events(until):
            pass
        return self.ending

    def events(self, until: int | None = None) -> Iterator[int]:
        """Run event by event; yields the clock of the next one, and brings the rig there when asked for one more.

        The rig may be brought nearer to it in between.  `ending` is set when the iterator ends.
        """
        limit = NEVER if until is None else until
        ending = BREAK if self._condition is not None and self._condition() else self._over(until is None)
        while not ending:
            when = min(self.rig.next_event(), self._looks(), limit)
            if when >= NEVER:
                ending = TURNING if self.turning() else IDLE
                break
            yield when
            self._go_to(when)
            ending = BREAK if self._holds else self._over(until is None) or (UNTIL if when >= limit else "")
        self.finish(ending)

    def approach(self, when: int) -> None:
        """Bring the rig to `when`, before its next event."""
        part = self._part
        while part.now < when:
            part.advance(min(part.next_event(), when))

    def turning(self) -> tuple[MotorAt, ...]:
        """The motors that turn now."""
        return tuple(
            MotorAt(number, axis.motor)
            for number, module in enumerate(self.rig.modules)
            for axis in module.axes
            if axis.read(V_ACTUAL)
        )

    def _go_to(self, when: int) -> None:
        """Bring the rig to its event at `when`, and the recorders to theirs before it."""
        self.approach(when)
        self._holds = self._condition is not None and self._condition()

    def _over(self, unlimited: bool) -> str:
        ending = ending_of(self.rig)
        return "" if ending == TURNING and not unlimited else ending

    def _asks(self, _address: int) -> bool:
        """Makes each command of the program an event, so that the condition is looked at after it."""
        return False

    def _note_refusal(self) -> bool:
        error = self.module.program.last_error
        if error is not None:
            self.refusals[error] += 1
        return False


def ending_of(rig: Rig) -> str:
    """Why a run is over now; empty while it is not.  To be asked at events of the rig only."""
    if not all(map(_quiet, rig.modules)) or not all(map(_settled, rig.modules)):
        return ""
    turning = any(axis.read(V_ACTUAL) for module in rig.modules for axis in module.axes)
    if not turning and not any(module.program.active or _searching(module) for module in rig.modules):
        return STOPPED
    if any(map(_awaits_pass, rig.modules)) or not _uneventful(rig):
        return ""
    return TURNING if turning else IDLE


def _quiet(module: FirmwareModule) -> bool:
    """Whether the program has stopped, waits without end, or goes round in a cycle."""
    program = module.program
    if not program.active:
        return True
    return program.cycle is not None or (program.waiting and program.next_event() >= NEVER)


def _uneventful(rig: Rig) -> bool:
    """Whether nothing is ahead but that evenly turning motors pass their target positions, which has no effect.

    A target position less than half a turn of the counter ahead must be passed first: what comes behind it, such as
    a switch, is not known before.
    """
    passes = NEVER
    for module in rig.modules:
        for axis in module.axes:
            chip, smda = module.board.wiring(axis.motor)
            motion = module.board.chips[chip].motion(smda)
            if motion.rate_hz:
                way = axis.read(X_TARGET) - motion.position
                steps = ((way if motion.rate_hz > 0 else -way) - 1) % POSITIONS + 1 - _NEAR
                if steps < POSITIONS // 2:
                    return False
                passes = min(passes, module.now + int(steps / abs(motion.rate_hz) * HZ))
        cycle = module.program.cycle
        if module.program.active and cycle is not None and cycle.until < passes:
            return False
    return rig.next_disturbance() >= passes


def _awaits_pass(module: FirmwareModule) -> bool:
    """Whether the program waits until a turning motor passes its target position."""
    wait = module.program.wait
    return wait is not None and wait.kind == _POS and bool(module.axes[wait.motor].read(V_ACTUAL))


def _searching(module: FirmwareModule) -> bool:
    return any(axis.search for axis in module.axes)


def _settled(module: FirmwareModule) -> bool:
    """Whether each motor goes on as it does now: at rest, turning evenly, or held by a switch."""
    return all(axis.steady for axis in module.axes) or _held(module)


def _held(module: FirmwareModule) -> bool:
    """Whether motors that want to move are held by switches, all of them at rest."""
    return module.board.next_event() >= NEVER and not any(axis.read(V_ACTUAL) for axis in module.axes)
