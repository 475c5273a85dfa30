"""A bench at work: modules on one line, what hangs on them, and virtual time for all of it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from heapq import heapify, heappop
from typing import TYPE_CHECKING, Final, NamedTuple

from tmcm34x.bench.action import Action, perform
from tmcm34x.bench.mount import Fitting
from tmcm34x.bench.world import World
from tmcm34x.board.board import Board
from tmcm34x.board.models import MODELS
from tmcm34x.clock import NEVER
from tmcm34x.firmware.boot import BootLoader
from tmcm34x.firmware.module import INSTRUCTION_CLOCKS, Module
from tmcm34x.firmware.storage import Eeprom
from tmcm34x.world.load import Carriage
from tmcm34x.world.load_axis import LoadAxis
from tmcm34x.world.motor import Motor

if TYPE_CHECKING:
    from tmcm34x.bench.session.watch import Expectation

FREE_SHAFT: Final = Carriage(mass_kg=0.0, friction_n=0.0)
"""The load of a motor that nothing is fitted to; its position counts in millimetres of a 5 mm screw."""


class BenchError(ValueError):
    """A bench file that cannot be built; one line, with the path into the file."""


class Happening(NamedTuple):
    """Something that a bench does by itself at clock `when`; `number` orders those of one clock."""

    when: int
    number: int
    action: Action


class Rig:
    """Modules and their worlds as one `Part`.

    modules: in the order of the bench file
    worlds: what hangs on each
    """

    def __init__(self, worlds: Sequence[World], happenings: Iterable[Happening] = ()) -> None:
        self.worlds = tuple(worlds)
        self.modules = tuple(world.module for world in worlds)
        self.now = 0
        self.on_action: list[Callable[[Action, int], None]] = []
        """Called with each action from outside and its clock, after it was done."""
        self.expectations: tuple[Expectation, ...] = ()
        """What the bench file expects to happen; a `bench.session.watch.Watch` looks after it."""
        self._happenings = list(happenings)
        heapify(self._happenings)
        self._settle()

    def next_event(self) -> int:
        """The next clock at which something could be noticed."""
        self._settle()
        due = self._happenings[0].when if self._happenings else NEVER
        for world in self.worlds:
            due = min(due, world.due, world.module.next_event())
        return due

    def next_disturbance(self) -> int:
        """The next clock at which something besides the stand-alone programs has an event."""
        self._settle()
        due = self._happenings[0].when if self._happenings else NEVER
        for world in self.worlds:
            due = min(due, world.due, world.module.next_disturbance())
        return due

    def advance(self, now: int) -> None:
        """Bring modules and worlds to clock `now`."""
        for module in self.modules:
            module.advance(now)
        self.now = now
        while self._happenings and self._happenings[0].when <= now:
            perform(self, heappop(self._happenings).action)
        self._settle()

    def act(self, action: Action) -> None:
        """Do something to the bench from outside, at the present clock; raises `ActionError`."""
        perform(self, action)
        for listener in self.on_action:
            listener(action, self.now)

    def _settle(self) -> None:
        """Bring the worlds to the modules' clock; what one does may concern another."""
        now = self.now
        waiting = True
        while waiting:
            waiting = False
            for world in self.worlds:
                if world.dirty or world.due <= now:
                    world.settle(now)
                    waiting = True


def simple_rig(
    model: int = 343,
    eeprom: Eeprom | None = None,
    *,
    seed: int = 0,
    address: int | None = None,
    host_address: int | None = None,
    instruction_clocks: int = INSTRUCTION_CLOCKS,
) -> Rig:
    """A powered module with bare motors and no switches.

    model: 341, 342 or 343
    eeprom: its memory, a new one unless given
    seed: of the random numbers
    address, host_address: written into the memory if given
    instruction_clocks: time of one instruction of a stand-alone program
    """
    module = Module(
        Board(MODELS[model], seed=seed),
        eeprom or Eeprom(model),
        seed=seed,
        instruction_clocks=instruction_clocks,
        address=address,
        host_address=host_address,
    )
    BootLoader(module)
    world = World(module, [Fitting(LoadAxis(Motor(), FREE_SHAFT)) for _ in range(3)])
    module.power_on()
    return Rig([world])
