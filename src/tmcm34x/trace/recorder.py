"""A rig under the eyes of recorders."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, NamedTuple, Protocol

if TYPE_CHECKING:
    from tmcm34x.bench import Rig
    from tmcm34x.chips.tmc429 import Motion
    from tmcm34x.firmware.module import FirmwareModule


class Recorder(Protocol):
    """Records what a rig does."""

    due: int
    """The clock at which it must look next, whatever happens; `NEVER` for none."""

    def before(self, now: int) -> None:
        """The rig is about to be brought to `now`, at most to its next event."""
        ...

    def after(self, now: int) -> None:
        """The rig has been brought to `now`."""
        ...


class Trace:
    """A rig with recorders around it."""

    def __init__(self, rig: Rig, recorders: Iterable[Recorder]) -> None:
        self.rig = rig
        self.recorders = tuple(recorders)

    @property
    def now(self) -> int:
        """The rig's clock."""
        return self.rig.now

    def next_event(self) -> int:
        """The rig's next event, or the next clock at which a recorder must look."""
        return min([self.rig.next_event(), *(recorder.due for recorder in self.recorders)])

    def advance(self, now: int) -> None:
        """Bring the rig to clock `now` under the eyes of the recorders."""
        for recorder in self.recorders:
            recorder.before(now)
        self.rig.advance(now)
        for recorder in self.recorders:
            recorder.after(now)


class Spot(NamedTuple):
    """One motor of one module, as its motion chip has it."""

    module: FirmwareModule
    number: int
    """Of the module in the rig."""
    motor: int

    @property
    def position(self) -> int:
        """Actual position [microsteps]."""
        chip, smda = self.module.board.wiring(self.motor)
        return self.module.board.chips[chip].position(smda)

    @property
    def speed(self) -> int:
        """Actual speed [velocity units]."""
        chip, smda = self.module.board.wiring(self.motor)
        return self.module.board.chips[chip].velocity(smda)

    @property
    def acceleration(self) -> int:
        """Actual acceleration [acceleration units]."""
        chip, smda = self.module.board.wiring(self.motor)
        return self.module.board.chips[chip].acceleration(smda)

    @property
    def motion(self) -> Motion:
        """How it moves from now on; `phase` counts on, whatever the position was set to."""
        chip, smda = self.module.board.wiring(self.motor)
        return self.module.board.chips[chip].motion(smda)

    def bends(self, end: int) -> Iterator[tuple[int, int]]:
        """Speed and phase at `end`, and before it wherever the speed begins to rise or to fall."""
        chip, smda = self.module.board.wiring(self.motor)
        return self.module.board.chips[chip].bends(smda, end)

    def steps(self, start: int, end: int) -> Iterator[tuple[int, int]]:
        """Clock and direction of the microsteps to come after `start` up to `end`."""
        chip, smda = self.module.board.wiring(self.motor)
        return self.module.board.chips[chip].steps(smda, start, end)


def spots(rig: Rig) -> tuple[Spot, ...]:
    """All motors of a rig."""
    return tuple(
        Spot(module, number, axis.motor) for number, module in enumerate(rig.modules) for axis in module.axes
    )
