"""What is measured in a run besides the figures of `trace.figures`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tmcm34x.clock import NEVER

if TYPE_CHECKING:
    from tmcm34x.bench import Rig


class LossRecorder:
    """The greatest number of full steps by which each rotor was off from what the chip counts, without sign.

    Steps that are lost on the way out may come back on the way home: the end alone does not show them.  Looked at after
    each event.
    """

    def __init__(self, rig: Rig) -> None:
        self.due = NEVER
        self._axes = [mount.axis for world in rig.worlds for mount in world.mounts]
        self.lost = [0] * len(self._axes)
        """Of each motor, so far."""

    def before(self, now: int) -> None:
        """Nothing to see."""

    def after(self, now: int) -> None:
        """Look at each rotor."""
        del now
        for n, axis in enumerate(self._axes):
            lost = axis.lost_fullsteps
            if lost:
                self.lost[n] = max(self.lost[n], round(abs(lost)))
