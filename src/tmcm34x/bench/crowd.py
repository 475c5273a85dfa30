"""The time of a bench with many modules: one that has nothing to do costs nothing.

A rig brings all of its modules to each clock and asks all of them for their next event.  A crowd keeps these in a heap:
it advances the modules that have something due, and any other one when it is reached for.  The results are the same,
because time may be sliced at will.

Whoever works on the rig itself calls `gather` before and `forget` afterwards.
"""

from __future__ import annotations

from bisect import insort
from collections.abc import Callable, Collection, Sequence
from functools import partial
from heapq import heapify, heappop, heappush
from typing import TYPE_CHECKING, Final

from tmcm34x.clock import NEVER
from tmcm34x.tmcl.numbers import GP

if TYPE_CHECKING:
    from tmcm34x.bench.rig import Rig
    from tmcm34x.firmware.module import FirmwareModule

ANY: Final = -1
"""The key of modules that get every telegram: those with observers."""


class Book:
    """The modules that a telegram may be meant for, by its address or identifier."""

    def __init__(
        self, modules: Sequence[FirmwareModule], keys: Callable[[FirmwareModule], tuple[int, ...]]
    ) -> None:
        self._all = modules
        self._find = keys
        self._keys: list[tuple[int, ...]] = [()] * len(modules)
        self._modules: dict[int, list[int]] = {}

    def renew(self, index: int) -> None:
        """Something was done on a module: it may have other keys."""
        keys = self._find(self._all[index])
        if keys != self._keys[index]:
            for key in set(self._keys[index]):
                self._modules[key].remove(index)
            for key in set(keys):
                insort(self._modules.setdefault(key, []), index)
            self._keys[index] = keys

    def meant(self, keys: Collection[int]) -> Sequence[int]:
        """The modules with one of the keys, in their order."""
        modules = self._modules
        if len(keys) == 1 and not modules.get(ANY):
            return tuple(modules.get(next(iter(keys)), ()))
        found: set[int] = set()
        for key in (*keys, ANY):
            found.update(modules.get(key, ()))
        return sorted(found)


def _addresses(module: FirmwareModule) -> tuple[int, ...]:
    """The addresses of telegrams that a module takes or shows."""
    address = module.address
    return address, module.second_address or address, ANY if module.observers else address


def _identifiers(module: FirmwareModule) -> tuple[int, ...]:
    """The identifiers of frames that a module takes."""
    settings = module.eeprom.global_values
    return settings[GP.CAN_ID], settings[GP.CAN_SECONDARY_ID] or settings[GP.CAN_ID]


class Crowd:
    """The modules of `rig`, brought to the present one by one.

    on_look: called with the number of each module that something was done on, or may have been
    """

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        self._addresses = Book(rig.modules, _addresses)
        self._identifiers = Book(rig.modules, _identifiers)
        self.on_look: list[Callable[[int], None]] = [self._addresses.renew]
        self._due: list[int] = []
        """The next event of each module with its world; none while they are not known."""
        self._heap: list[tuple[int, int]] = []
        """Events and numbers of modules; those that are no longer in `_due` do not count."""
        self._stirred: list[int] = []
        """Modules on whose world another one has acted."""
        for index, world in enumerate(rig.worlds):
            world.on_wire.append(partial(self._stirred.append, index))

    # Time

    def next_event(self) -> int:
        """The next clock at which something could be noticed."""
        self.know()
        heap, due = self._heap, self._due
        while heap and due[heap[0][1]] != heap[0][0]:
            heappop(heap)
        return min(heap[0][0] if heap else NEVER, self._rig.next_happening)

    def advance(self, now: int) -> None:
        """Bring what has something due to clock `now`, at most `next_event()`; the others when they are reached for."""
        rig, late = self._rig, self._take_late(now)
        for index in late:
            rig.modules[index].advance(now)
        rig.now = now
        if rig.next_happening <= now:
            self.gather()
            rig.happen()
            self.forget()
        elif late:
            self.look(late)

    def pass_to(self, now: int) -> None:
        """Go to clock `now`, before `next_event()`: all modules are brought there when they are reached for."""
        self._rig.now = now

    def _take_late(self, now: int) -> list[int]:
        """The modules that have something due, in their order."""
        if self.next_event() > now:
            return []
        late: set[int] = set()
        while self._heap and self._heap[0][0] <= now:
            when, index = heappop(self._heap)
            if self._due[index] == when:
                late.add(index)
        return sorted(late)

    # One module

    def know(self) -> None:
        """See to it that it is known what the modules are called by."""
        if not self._due:
            self._look_at_all()

    def addressed(self, addresses: Collection[int]) -> Sequence[int]:
        """The modules that telegrams to these addresses are meant for, or shown to."""
        self.know()
        return self._addresses.meant(addresses)

    def identified(self, identifier: int) -> Sequence[int]:
        """The modules that a frame with this identifier is meant for."""
        if self._identifiers.renew not in self.on_look:
            self.on_look.append(self._identifiers.renew)
            self.forget()
        self.know()
        return self._identifiers.meant((identifier,))

    def reach(self, index: int) -> None:
        """Bring a module to the present, before something is done on it; `look` afterwards."""
        module = self._rig.modules[index]
        if module.now != self._rig.now:
            module.advance(self._rig.now)

    def look(self, modules: Sequence[int]) -> None:
        """Something was done on modules at the present: see what follows from it, and when their next events are."""
        if not self._due:
            return
        for index in modules:
            self._look_at(index)
        while self._stirred:
            waiting = sorted(set(self._stirred))
            self._stirred.clear()
            for index in waiting:
                self.reach(index)
                self._look_at(index)

    def _look_at(self, index: int) -> None:
        world, now = self._rig.worlds[index], self._rig.now
        while world.dirty or world.due <= now:
            world.settle(now)
        due, event = world.due, world.module.next_event()
        due = min(due, event)
        if due != self._due[index]:
            self._due[index] = due
            if due < NEVER:
                heappush(self._heap, (due, index))
        for listener in self.on_look:
            listener(index)

    # All of them

    def gather(self) -> None:
        """Bring all modules to the present."""
        for index in range(len(self._rig.modules)):
            self.reach(index)

    def forget(self) -> None:
        """Something may have been done on any of them."""
        self._due.clear()

    def _look_at_all(self) -> None:
        rig = self._rig
        self.gather()
        rig.settle()
        self._stirred.clear()
        self._due[:] = [min(world.due, world.module.next_event()) for world in rig.worlds]
        self._heap[:] = [(due, index) for index, due in enumerate(self._due) if due < NEVER]
        heapify(self._heap)
        for index in range(len(rig.modules)):
            for listener in self.on_look:
                listener(index)
