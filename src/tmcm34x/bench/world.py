"""What hangs on one module, joined to its board: motors, switches, inputs, encoders, SPI devices.

Analogue inputs, encoders and driver status words are computed when the module asks for them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from tmcm34x.bench.mount import AxisView, Fitting, Mount
from tmcm34x.board.board import SELECTS
from tmcm34x.chips.tmc246 import FAULTS
from tmcm34x.chips.tmc423 import Tmc423
from tmcm34x.clock import NEVER, Value
from tmcm34x.world import device
from tmcm34x.world.shaft import Encoder
from tmcm34x.world.signal import THRESHOLD, Constant, Signal, Wire
from tmcm34x.world.switch import SwitchInput

if TYPE_CHECKING:
    from tmcm34x.board.board import Side
    from tmcm34x.firmware.module import FirmwareModule

SHUTDOWN: Final = 8
"""Number of the SHUTDOWN pin among the inputs, behind IN_0..IN_7."""

_ENCODERS: Final = "encoders"
_OTHER: Final = "other"
"""Names of SPI devices in saved states, besides those of `device.KINDS`: the encoder chip, and what cannot be saved."""


class Disc(NamedTuple):
    """An encoder on a shaft: see `world.shaft.Encoder`."""

    lines: int
    slip: float = 0.0
    null_level: int | None = 1


class World:
    """What hangs on `module`: an axis on each motor, and what `connect` and `attach_encoders` add."""

    def __init__(self, module: FirmwareModule, fittings: Sequence[Fitting]) -> None:
        board = module.board
        self.module = module
        self.mounts = tuple(Mount(module, motor, fitting) for motor, fitting in enumerate(fittings))
        self.dirty = True
        """Whether something happened that must be looked at before time goes on."""
        self.due = NEVER
        """The clock at which `settle` must be called whatever the module does."""
        self.on_wire: list[Callable[[], None]] = []
        """Called when an output that is wired to an input here has changed."""
        self.encoder_chip: Tmc423 | None = None
        self.plane: tuple[int, int] | None = None
        """Motors of two carriages that move one tool, X first."""
        self._by_wiring = {board.wiring(mount.motor): mount for mount in self.mounts}
        self._sources: dict[int, Signal] = {}
        self._overrides: dict[int, Signal] = {}
        for index, chip in enumerate(board.chips):
            chip.on_plan.append(partial(self._plan_changed, index))
            chip.on_restart.append(partial(self._restarting, index))
        board.on_current.append(self._current_changed)

    def connect(self, number: int, source: Signal) -> None:
        """Drive input 0..7, or SHUTDOWN as number 8."""
        self._sources[number] = source
        self._attach(number)

    def _attach(self, number: int) -> None:
        if number != SHUTDOWN:
            board, source = self.module.board, self._source(number)
            board.attach_analog(number, *self._wires(number))
            if isinstance(source, Constant):
                board.set_analog(number, source.value)
        self.dirty = True

    def _wires(self, number: int) -> tuple[Callable[[], int] | None, Callable[[], int] | None]:
        """What the board asks for the level of an input and for its next edge; None where that is not asked."""
        source = self._source(number)
        if isinstance(source, Constant):
            return None, None
        if isinstance(source, Wire):
            return partial(self.level, number), None
        return partial(self.level, number), partial(self._next_edge, number)

    def _next_edge(self, number: int) -> int:
        return self._source(number).next_edge(self.module.now)

    def attach_encoders(self, select: int, encoders: Mapping[int, Disc]) -> None:
        """Put a TMCM-323 on select line 0..2 that reads encoders on the shafts of motors."""
        shafts = [
            self._shaft(mount, encoders[mount.motor]) if mount.motor in encoders else None
            for mount in self.mounts
        ]
        self.encoder_chip = Tmc423(shafts)
        for mount, counter in zip(self.mounts, self.encoder_chip.counters, strict=True):
            mount.counter = counter
        self.module.board.attach_spi(select, self.encoder_chip)

    @staticmethod
    def _shaft(mount: Mount, disc: Disc) -> Encoder:
        return Encoder(mount.rotor, mount.axis.motor, disc.lines, slip=disc.slip, null_level=disc.null_level)

    # Listeners of the board

    def _plan_changed(self, chip: int, smda: int) -> None:
        mount = self._by_wiring.get((chip, smda))
        if mount is not None:
            mount.plan_changed()
            self.dirty = True

    def _restarting(self, chip: int) -> None:
        for (index, _), mount in self._by_wiring.items():
            if index == chip:
                mount.restarting()
        self.dirty = True

    def _current_changed(self, motor: int, current: int, on: bool) -> None:
        del current
        mount = self.mounts[motor]
        if mount.driver is not None:
            mount.driver.enabled = on
        mount.dirty = self.dirty = True

    def wire_changed(self, outputs: int) -> None:
        """An output that is wired to an input here has changed."""
        del outputs
        self.dirty = True
        for listener in self.on_wire:
            listener()

    # Time

    def settle(self, now: int) -> None:
        """Bring everything to `now`, to which the module has come."""
        due = NEVER
        for mount in self.mounts:
            if mount.dirty or mount.due <= now:
                mount.settle(now)
            due = min(due, mount.due)
        if SHUTDOWN in self._sources or SHUTDOWN in self._overrides:
            source = self._source(SHUTDOWN)
            self.module.board.set_shutdown(int(source.level(now) >= THRESHOLD))
            due = min(due, source.next_edge(now))
        self.due = due
        self.dirty = False

    # State

    def save(self) -> Value:
        """Axes, drivers, encoders, inputs that are held and SPI devices; the module is not in it."""
        held = sorted(self._overrides.items())
        return (
            (self.dirty, self.due, tuple([(number, source.level(0)) for number, source in held])),
            tuple([mount.save() for mount in self.mounts]),
            None if self.encoder_chip is None else self.encoder_chip.save(),
            tuple([self._save_device(select) for select in range(SELECTS)]),
        )

    def load(self, value: Any) -> None:
        """Become a world that was saved; SPI devices that cannot be saved stay as they are."""
        (dirty, due, held), mounts, encoders, devices = value
        touched = self._overrides.keys() | dict(held).keys()
        self._overrides = {number: Constant(level) for number, level in held}
        for number in touched - {SHUTDOWN}:
            self.module.board.wire_analog(number, *self._wires(number))
        for mount, saved in zip(self.mounts, mounts, strict=True):
            mount.load(saved)
        if self.encoder_chip is not None:
            self.encoder_chip.load(encoders)
        for select, saved in enumerate(devices):
            self._load_device(select, saved)
        self.dirty, self.due = dirty, due

    def _save_device(self, select: int) -> Value:
        there = self.module.board.spi_device(select)
        if there is None:
            return None
        if there is self.encoder_chip:
            return _ENCODERS, ()
        for name, kind in device.KINDS.items():
            if isinstance(there, kind):
                return name, there.save()
        return _OTHER, ()

    def _load_device(self, select: int, saved: Any) -> None:
        attach = self.module.board.attach_spi
        kind, operands = saved or (None, ())
        if kind is None:
            attach(select, None)
        elif kind == _ENCODERS:
            attach(select, self.encoder_chip)
        elif kind != _OTHER:
            attach(select, device.KINDS[kind](*operands))

    # Inputs

    def _source(self, number: int) -> Signal:
        return self._overrides.get(number) or self._sources.get(number) or Constant(0)

    def level(self, number: int) -> int:
        """The level of input 0..7, or of SHUTDOWN as number 8, now."""
        return self._source(number).level(self.module.now)

    # What is done from outside

    def set_level(self, number: int, level: int | None) -> None:
        """Hold an input (0..7, 8 for SHUTDOWN) at a level 0..1023, or give it back to its source."""
        if level is None:
            self._overrides.pop(number, None)
        else:
            self._overrides[number] = Constant(level)
        self._attach(number)

    @property
    def overridden(self) -> list[int]:
        """Inputs that are held although they have a source."""
        return sorted(self._overrides.keys() & self._sources.keys())

    def set_switch(self, motor: int, side: Side, active: bool | None) -> None:
        """Hold a switch line at a level, or let its switches work again."""
        self._line(motor, side).override = active
        self._touch(motor)

    def unplug(self, motor: int, side: Side, unplugged: bool = True) -> None:
        """Break the cable of a switch line, or mend it."""
        self._line(motor, side).unplugged = unplugged
        self._touch(motor)

    def set_fault(self, motor: int, name: str, on: bool) -> None:
        """Raise or end a fault of a driver, one of `chips.tmc246.FAULTS`; a TMCM-342 has no drivers to fail."""
        driver = self.mounts[motor].driver
        if driver is None or name not in FAULTS:
            raise ValueError(f"no fault {name!r} on motor {motor} of a {self.module.board.model.name}")
        driver.set_fault(name, on)
        self._touch(motor)

    def push(self, motor: int, torque_nm: float) -> None:
        """Put a torque on the shaft; a positive one pushes toward lower positions."""
        self.mounts[motor].axis.push_nm = float(torque_nm)
        self._touch(motor)

    def move(self, motor: int, position: float) -> None:
        """Take the load somewhere by force."""
        mount = self.mounts[motor]
        mount.settle(self.module.now)
        mount.axis.push_to(position)
        self._touch(motor)

    def set_power(self, on: bool) -> None:
        """Switch the supply of the module."""
        if on == self.module.powered:
            return
        if on:
            self.module.power_on()
        else:
            self.module.power_off()
        for mount in self.mounts:
            mount.dirty = True
        if self.encoder_chip is not None:
            self.encoder_chip.reset()
        self.dirty = True

    def _line(self, motor: int, side: Side) -> SwitchInput:
        axis = self.mounts[motor].axis
        return axis.left if side == "left" else axis.right

    def _touch(self, motor: int) -> None:
        self.mounts[motor].dirty = self.dirty = True

    def view(self) -> tuple[AxisView, ...]:
        """All axes now."""
        return tuple(mount.view() for mount in self.mounts)
