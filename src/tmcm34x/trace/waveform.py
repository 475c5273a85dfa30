"""Waveforms for GTKWave or Surfer, as a value change dump (IEEE 1364, VCD)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple, TextIO

from tmcm34x.clock import HZ, NEVER
from tmcm34x.trace.recorder import Spot, spots

if TYPE_CHECKING:
    from tmcm34x.bench import Rig


class _Signal(NamedTuple):
    code: str
    width: int


class WaveformRecorder:
    """Writes a value change dump (IEEE 1364): step pulses of a microsecond, and levels at every event.

    A value is written when it has changed; the time unit is 100 ps, since a clock has 62.5 ns.
    """

    UNITS_PER_CLOCK: Final = 10_000_000_000 // HZ
    PULSE: Final = 16
    """Clocks that a step pulse is high."""

    FLUSH: Final = HZ // 10
    """Clocks after which what was taken down is written at the latest."""

    def __init__(self, rig: Rig, stream: TextIO) -> None:
        self.due = rig.now + self.FLUSH
        self._rig = rig
        self._stream = stream
        self._spots = spots(rig)
        self._signals: dict[tuple[int, int, str], _Signal] = {}
        self._values: dict[tuple[int, int, str], int] = {}
        self._pending: list[tuple[int, int, tuple[int, int, str], int]] = []
        """Clock, order within the clock, signal and value of changes to write."""
        self._written = -1
        self._declare()
        self._look(rig.now)
        self._write(rig.now)

    def before(self, now: int) -> None:
        """Take down the steps on the way."""
        for spot in self._spots:
            step, direction = self._key(spot, "step"), self._key(spot, "direction")
            for when, sign in spot.steps(self._rig.now, now):
                self._change(when, direction, int(sign > 0))
                self._change(when, step, 1)
                self._change(when + self.PULSE, step, 0)

    def after(self, now: int) -> None:
        """Take down levels that changed, and write."""
        self._look(now)
        self._write(now)
        self.due = now + self.FLUSH

    def instruction(self, address: int, now: int, module: int = 0) -> None:
        """The program of a module executes the command at `address`."""
        self._change(now, (module, -1, "counter"), address)

    def close(self) -> None:
        """Write what is left, and the end of the time."""
        self._write(NEVER)
        self._stream.write(f"#{self._rig.now * self.UNITS_PER_CLOCK}\n")

    @staticmethod
    def _key(spot: Spot, name: str) -> tuple[int, int, str]:
        return spot.number, spot.motor, name

    def _declare(self) -> None:
        write = self._stream.write
        write("$version tmcm34x $end\n$timescale 100 ps $end\n")
        for number, module in enumerate(self._rig.modules):
            write(f"$scope module module{number} $end\n")
            for name, width in (
                ("counter", 12),
                ("running", 1),
                ("inputs", 8),
                ("outputs", 8),
                ("shutdown", 1),
            ):
                self._declare_signal(number, -1, name, width)
            for axis in module.axes:
                write(f"$scope module motor{axis.motor} $end\n")
                for name in ("step", "direction", "enable", "left_switch", "right_switch"):
                    self._declare_signal(number, axis.motor, name, 1)
                write("$upscope $end\n")
            write("$upscope $end\n")
        write("$enddefinitions $end\n")
        for spot in self._spots:
            for name in ("step", "direction"):
                self._change(self._rig.now, self._key(spot, name), 0)

    def _declare_signal(self, number: int, motor: int, name: str, width: int) -> None:
        code = _code(len(self._signals))
        self._signals[number, motor, name] = _Signal(code, width)
        self._stream.write(f"$var wire {width} {code} {name} $end\n")

    def _look(self, now: int) -> None:
        for number, module in enumerate(self._rig.modules):
            board = module.board
            self._change(now, (number, -1, "counter"), module.program.counter)
            self._change(now, (number, -1, "running"), int(module.program.active))
            self._change(now, (number, -1, "inputs"), board.digital_inputs())
            self._change(now, (number, -1, "outputs"), board.outputs)
            self._change(now, (number, -1, "shutdown"), board.shutdown_level())
            for axis in module.axes:
                motor = axis.motor
                self._change(now, (number, motor, "enable"), int(board.enabled[motor]))
                self._change(now, (number, motor, "left_switch"), int(board.switch(motor, "left")))
                self._change(now, (number, motor, "right_switch"), int(board.switch(motor, "right")))

    def _change(self, when: int, key: tuple[int, int, str], value: int) -> None:
        self._pending.append((when, len(self._pending), key, value))

    def _write(self, now: int) -> None:
        """Write what is pending up to `now`."""
        self._pending.sort()
        later: list[tuple[int, int, tuple[int, int, str], int]] = []
        for when, _, key, value in self._pending:
            if when > now:
                later.append((when, len(later), key, value))
            elif self._values.get(key) != value:
                self._values[key] = value
                if when != self._written:
                    self._stream.write(f"#{when * self.UNITS_PER_CLOCK}\n")
                    self._written = when
                code, width = self._signals[key]
                self._stream.write(f"{value}{code}\n" if width == 1 else f"b{value:b} {code}\n")
        self._pending = later


def _code(number: int) -> str:
    """An identifier of printable characters."""
    digits = ""
    while True:
        number, digit = divmod(number, 94)
        digits += chr(33 + digit)
        if not number:
            return digits
