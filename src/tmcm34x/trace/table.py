"""A table of what the motors do, as CSV."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final, TextIO

from tmcm34x.clock import MS
from tmcm34x.trace.recorder import Spot

if TYPE_CHECKING:
    from tmcm34x.bench import Rig
    from tmcm34x.firmware.module import FirmwareModule


class TableRecorder:
    """Writes a row for each motor every `period` clocks, from the present clock on, as CSV.

    module, inputs, outputs, counter: number of the module in the rig, its digital lines and its program counter
    left, right: whether the switches are active
    place: of the load on the bench, in its own unit (millimetres or degrees)
    lost: full steps by which the rotor is behind the chip
    """

    COLUMNS: Final = (
        "time_ms", "motor", "position", "speed", "acceleration", "left", "right", "place", "lost",
        "module", "inputs", "outputs", "counter",
    )  # fmt: skip

    def __init__(self, rig: Rig, stream: TextIO, period: int) -> None:
        if period < 1:
            raise ValueError(f"a period has at least one clock, not {period}")
        self._rig = rig
        self._stream = stream
        self._period = period
        self.due = rig.now
        self._written = -1
        stream.write(",".join(self.COLUMNS) + "\n")
        self.after(rig.now)

    def before(self, now: int) -> None:
        """Nothing to see."""

    def after(self, now: int) -> None:
        """Write rows when they are due."""
        if now >= self.due:
            self.due += self._period
            self._write(now)

    def close(self) -> None:
        """Write the rows of the end, unless the last ones are of it."""
        if self._written < self._rig.now:
            self._write(self._rig.now)

    def _write(self, now: int) -> None:
        self._written = now
        time = _decimal(now / MS)
        for number, world in enumerate(self._rig.worlds):
            self._stream.writelines(self._rows(time, number, world.module))

    def _rows(self, time: str, number: int, module: FirmwareModule) -> Iterator[str]:
        board = module.board
        views = self._rig.worlds[number].view()
        lines = f"{number},{board.digital_inputs()},{board.outputs},{module.program.counter}"
        for axis in module.axes:
            spot, view = Spot(module, number, axis.motor), views[axis.motor]
            left, right = board.switch(spot.motor, "left"), board.switch(spot.motor, "right")
            yield (
                f"{time},{spot.motor},{spot.position},{spot.speed},{spot.acceleration},{left:d},{right:d},"
                f"{_decimal(view.position)},{_decimal(view.lost_fullsteps)},{lines}\n"
            )


def _decimal(number: float) -> str:
    text = f"{number:.6f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text
