"""A bench at work: modules on one line, what hangs on them, and virtual time for all of it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Any, Final, NamedTuple, SupportsIndex

from tmcm34x import clock
from tmcm34x.bench.action import Action, perform
from tmcm34x.bench.mount import Fitting
from tmcm34x.bench.snapshot import SnapshotError, pack_snapshot, unpack_snapshot
from tmcm34x.bench.world import World
from tmcm34x.board.board import Board
from tmcm34x.board.models import MODELS
from tmcm34x.clock import NEVER, Value
from tmcm34x.firmware.boot import BootLoader
from tmcm34x.firmware.module import INSTRUCTION_CLOCKS, FirmwareModule
from tmcm34x.firmware.storage import Eeprom
from tmcm34x.world.load import Carriage
from tmcm34x.world.load_axis import LoadAxis
from tmcm34x.world.motor import Motor

FREE_SHAFT: Final = Carriage(mass_kg=0.0, friction_n=0.0)
"""The load of a motor that nothing is fitted to; its position counts in millimetres of a 5 mm screw."""


class BenchError(ValueError):
    """A bench file that cannot be built; one line, with the path into the file."""


class Happening(NamedTuple):
    """Something that a bench does by itself at clock `when`; `number` orders those of one clock."""

    when: int
    number: int
    action: Action


class Expectation(NamedTuple):
    """What a bench file expects of module `unit` from clock `when` on, as a line of text; `where` names the event."""

    when: int
    unit: int
    where: str
    text: str


class Rig:
    """Modules and their worlds as one `Part`.

    modules: in the order of the bench file
    worlds: what hangs on each
    description: what it was built from; snapshots fit rigs of an equal description only
    recipe: builds an equal rig anew; a copied or unpickled rig is built by it and gets the state, but nothing that
        was added after building (ports, listeners, user functions)
    """

    def __init__(
        self,
        worlds: Sequence[World],
        happenings: Iterable[Happening] = (),
        *,
        description: Value = (),
        recipe: Callable[[], Rig] | None = None,
    ) -> None:
        self._recipe = recipe
        self.worlds = tuple(worlds)
        self.modules = tuple(world.module for world in worlds)
        self.now = 0
        self.on_action: list[Callable[[Action, int], None]] = []
        """Called with each action from outside and its clock, after it was done."""
        self.expectations: tuple[Expectation, ...] = ()
        """What the bench file expects to happen; a `bench.session.watch.Watch` looks after it."""
        self._fingerprint = bytes.fromhex(clock.digest(description))
        self._happenings = tuple(sorted(happenings))
        self._happened = 0
        """How many of them are over."""
        self.next_happening = NEVER
        """The clock at which the bench next does something by itself, or `NEVER`."""
        self._count_happened(0)
        self.settle()

    def next_event(self) -> int:
        """The next clock at which something could be noticed."""
        self.settle()
        due = self.next_happening
        for world in self.worlds:
            due = min(due, world.due, world.module.next_event())
        return due

    def next_disturbance(self) -> int:
        """The next clock at which something besides the stand-alone programs has an event."""
        self.settle()
        due = self.next_happening
        for world in self.worlds:
            due = min(due, world.due, world.module.next_disturbance())
        return due

    def advance(self, now: int) -> None:
        """Bring modules and worlds to clock `now`."""
        for module in self.modules:
            module.advance(now)
        self.now = now
        if self.next_happening <= now:
            self.happen()
        self.settle()

    def pass_to(self, now: int) -> None:
        """Bring the modules to clock `now`, before the next event: nothing happens that a world must look at."""
        for module in self.modules:
            module.pass_to(now)
        self.now = now

    def happen(self) -> None:
        """What the bench does by itself up to now."""
        while self.next_happening <= self.now:
            self._count_happened(self._happened + 1)
            perform(self.worlds, self._happenings[self._happened - 1].action)

    def _count_happened(self, count: int) -> None:
        self._happened = count
        rest = self._happenings[count : count + 1]
        self.next_happening = rest[0].when if rest else NEVER

    def act(self, action: Action) -> None:
        """Do something to the bench from outside, at the present clock; raises `ActionError`."""
        perform(self.worlds, action)
        self.settle()
        for listener in self.on_action:
            listener(action, self.now)

    # State

    def save(self) -> Value:
        """All that modules and worlds remember, as a plain value."""
        modules = tuple([module.save() for module in self.modules])
        return self.now, self._happened, modules, tuple([world.save() for world in self.worlds])

    def load(self, value: Any) -> None:
        """Become a rig of the same description that was saved; listeners are not called."""
        self.now, happened, modules, worlds = value
        self._count_happened(happened)
        for world, saved in zip(self.worlds, worlds, strict=True):
            world.load(saved)
        for module, saved in zip(self.modules, modules, strict=True):
            module.load(saved)

    def digest(self) -> str:
        """A fingerprint of the state: equal states have equal digests."""
        return clock.digest(self.save())

    def snapshot(self) -> bytes:
        """The state as bytes, for `restore` of a rig of the same description."""
        return pack_snapshot(self.save(), self._fingerprint)

    def restore(self, data: bytes) -> None:
        """Go back to a snapshot; raises `SnapshotError` and changes nothing where it is not one of this bench."""
        state = unpack_snapshot(data, self._fingerprint)
        before = self.save()
        try:
            self.load(state)
        except (TypeError, ValueError, LookupError) as error:
            self.load(before)
            raise SnapshotError("a damaged snapshot: its contents do not fit this bench") from error

    def replica(self) -> Rig:
        """Another rig of the same description, in the same state; see `recipe` for what it does not have.

        Raises `BenchError` for a rig without a recipe.
        """
        if self._recipe is None:
            raise BenchError("this bench was put together by hand: there is no second one of it")
        return _rebuilt(self._recipe, self._profiles, self.save())

    @property
    def _profiles(self) -> tuple[str, ...]:
        """Which parameters the modules have: a recipe does not know what they took later."""
        return tuple([module.eeprom.profile for module in self.modules])

    def __reduce_ex__(self, protocol: SupportsIndex, /) -> str | tuple[Any, ...]:
        """Copies and pickles are built by the recipe, where there is one: compiled chips cannot be copied otherwise."""
        if self._recipe is None:
            return super().__reduce_ex__(protocol)
        return _rebuilt, (self._recipe, self._profiles, self.save())

    def settle(self) -> None:
        """Bring the worlds to the modules' clock; what one does may concern another."""
        now = self.now
        waiting = True
        while waiting:
            waiting = False
            for world in self.worlds:
                if world.dirty or world.due <= now:
                    world.settle(now)
                    waiting = True


def _rebuilt(recipe: Callable[[], Rig], profiles: tuple[str, ...], state: Value) -> Rig:
    rig = recipe()
    for module, profile in zip(rig.modules, profiles, strict=True):
        if module.eeprom.profile != profile:
            module.take_profile(profile)
    rig.load(state)
    return rig


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
    module = FirmwareModule(
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
    recipe = partial(simple_rig, model, seed=seed, instruction_clocks=instruction_clocks)
    return Rig([world], description=("simple", model, seed, instruction_clocks), recipe=recipe)
