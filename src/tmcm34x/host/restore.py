"""A backup brought back into a module: what was stored is stored, what was in use only is in use only.

The order cannot lose the line and cannot wipe what it has written: the EEPROM lock is opened first; then axes,
variables, coordinates and chip tables; then the other global parameters; then the program, for which a code protection
has to be given up; then the protection; then communication, following its own changes; the lock comes last.

Every value is written only where it differs, and a write whose reply is lost is read back before it is sent again.

Source: manual 6.7.5 to 6.7.12, 6.7.25, 6.7.36, 8.1 (64 to 85); order of 153 and 154 before 5: fidelity CHIP-9.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from typing import Final, NamedTuple

from tmcm34x.host import program
from tmcm34x.host.backup import Backup, RowDifference, compare, groups_of
from tmcm34x.host.exceptions import RefusedError, VerifyError, unfinished
from tmcm34x.host.following import following
from tmcm34x.host.items import COMMUNICATION, GUARDED, Item, all_items
from tmcm34x.host.program import Progress, silent
from tmcm34x.host.reading import Reading, Value
from tmcm34x.host.settings import Failure, in_order
from tmcm34x.host.steps import LOST, NUMBERS, Steps, insist, settle, value
from tmcm34x.tmcl.commands import PROGRAM_SIZE
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.global_parameters import BY_KEY as GLOBAL_KEYS
from tmcm34x.tmcl.global_parameters import EEPROM_MAGIC, LOCK_KEY, UNLOCK_KEY

_SGP: Final = NUMBERS["SGP"]
_GGP: Final = NUMBERS["GGP"]
_AFTER_PROGRAM: Final = "auto_start"
GAP: Final = 8
"""Equal instructions between two differing ones that are written along, rather than beginning a new download."""


class Plan(NamedTuple):
    """What a restore will do.

    differences: rows in which the module differs from the backup: left the backup, right the module
    warnings: what the user should know before it is done
    """

    differences: list[RowDifference]
    warnings: list[str]


def plan(wanted: Backup, present: Backup, keep: Iterable[str] = ()) -> Plan:
    """What restoring `wanted` changes in a module that is as `present` says.

    keep: keys of global parameters that stay as they are
    """
    differences = unequal(wanted, present, keep)
    return Plan(differences, list(_warnings(wanted, present, differences)))


def for_model(wanted: Backup, model: int) -> tuple[Backup, list[str]]:
    """What of a backup of another model `model` takes, and the keys or the table of what is left out.

    The chip's tables are left out: driver chain and microstep table fit the drivers of their own model.
    """
    known = {item.path for item in all_items(model) if item.table != "chip"}
    present, stored = (
        {item: found for item, found in side.items() if item.path in known}
        for side in (wanted.present, wanted.stored)
    )
    left_out = dict.fromkeys(
        item.table if item.table == "chip" else item.key for item in wanted.present if item.path not in known
    )
    return wanted._replace(model=model, present=present, stored=stored), list(left_out)


def _warnings(wanted: Backup, present: Backup, differences: list[RowDifference]) -> Iterator[str]:
    settings, target = _module(present.present), _module(wanted.present)
    if wanted.not_read:
        yield f"The backup is not complete: {len(wanted.not_read)} things are not in it and stay as they are."
    if settings.get("eeprom_lock") == 1:
        yield "The EEPROM is locked (73): it is unlocked, and locked again only where the backup says so."
    if any(row.path.startswith("program") for row in differences) and wanted.program is not None:
        yield "The program in the module is overwritten."
        if settings.get("code_protection", 0) & 1:
            yield "The program is protected against reading (81); giving up the protection wipes it."
    if target.get("eeprom_magic", EEPROM_MAGIC) != EEPROM_MAGIC:
        yield "The EEPROM magic (64) of the backup would bring back factory settings at power-on: it is not written."
    changed = [key for key in COMMUNICATION if target.get(key, settings.get(key)) != settings.get(key)]
    if changed:
        yield f"Communication settings change: {', '.join(changed)}."


def _module(readings: Mapping[Item, Reading]) -> dict[str, int]:
    return {
        item.key: r.value for item, r in readings.items() if item.table == "module" and isinstance(r, Value)
    }


def restore(
    wanted: Backup, present: Backup, keep: Iterable[str] = (), progress: Progress = silent
) -> Steps[list[Failure]]:
    """Bring `wanted` into the module, which is as `present` says; returns what the module refused.

    A refused value does not end it; `backup.read` and `unequal` show afterwards whether the module is equal.  Raises
    `HostError` where the line is gone or the program is not as written.
    """
    work = _Restore(wanted, present, frozenset(keep), progress)
    with unfinished(
        lambda: f"{work.done} steps of the restore are done and it is not complete; restore again"
    ):
        yield from work.run()
    return work.failures


class _Restore:
    """One restore under way."""

    def __init__(self, wanted: Backup, present: Backup, keep: frozenset[str], progress: Progress) -> None:
        self.wanted, self.present, self.keep = wanted, present, keep
        self.failures: list[Failure] = []
        self._progress = progress
        self._now = _module(present.present)
        self._target = {key: n for key, n in _module(wanted.present).items() if key not in keep}
        self._items = {item.key: item for item in wanted.present if item.table == "module"}
        self._current: dict[str, int] = _known(present.present)
        self._stored: dict[str, int] = _known(present.stored)
        self.done = 0
        """Values, instructions and settings of the line that are as wanted."""

    def run(self) -> Steps[None]:
        yield from program.stop()
        if self._now.get("eeprom_lock") == 1:
            yield from insist(Instruction(_SGP, GLOBAL_KEYS["eeprom_lock"].number, 0, UNLOCK_KEY))
        yield from self._global("coordinate_storage")
        if self._now.get("coordinate_storage") != self._target.get("coordinate_storage"):
            self._forget_coordinates()
        yield from self._write_stored()
        yield from self._write_present()
        yield from self._write_globals()
        yield from self._write_program()
        for key in (_AFTER_PROGRAM, "code_protection"):
            yield from self._global(key)
        yield from self._write_communication()
        if self._target.get("eeprom_lock") == 1 or (
            "eeprom_lock" not in self._target and self._now.get("eeprom_lock") == 1
        ):
            yield from insist(Instruction(_SGP, GLOBAL_KEYS["eeprom_lock"].number, 0, LOCK_KEY))

    def _forget_coordinates(self) -> None:
        """After 84 has changed the coordinates are others: nothing is known of them."""
        for known in (self._current, self._stored):
            for path in [path for path in known if path.startswith("coordinates.")]:
                del known[path]

    # Values with a copy in the EEPROM

    def _write_stored(self) -> Steps[None]:
        """Set the values that are to be stored, and store them, group by group."""
        for items in groups_of(dict(in_order((item, 0) for item in self.wanted.stored))).values():
            targets = {item: r.value for item in items if isinstance(r := self.wanted.stored[item], Value)}
            if any(self._stored.get(item.path) != number for item, number in targets.items()):
                yield from self._store_group(targets)

    def _store_group(self, targets: Mapping[Item, int]) -> Steps[None]:
        for item, number in targets.items():
            yield from self._set(item, number)
        store = next(item.store for item in targets)
        if store is not None and not any(failure.item in targets for failure in self.failures):
            yield from self._try(next(iter(targets)), insist(store))

    def _write_present(self) -> Steps[None]:
        values = (
            (item, r.value)
            for item, r in self.wanted.present.items()
            if item.table != "module" and isinstance(r, Value)
        )
        for item, number in in_order(values):
            yield from self._set(item, number)

    def _set(self, item: Item, number: int) -> Steps[None]:
        self._step()
        if self._current.get(item.path) != number:
            self._current[item.path] = number
            yield from self._try(item, settle(item.to(number), item.read))

    def _try(self, item: Item, steps: Steps[object]) -> Steps[None]:
        """A refusal is noted, and does not end the restore."""
        try:
            yield from steps
        except RefusedError as error:
            self.failures.append(Failure(item, str(error)))

    # Global parameters

    def _write_globals(self) -> Steps[None]:
        late = {*COMMUNICATION, *GUARDED, _AFTER_PROGRAM}
        for key in self._target:
            if key not in late:
                yield from self._global(key)
        if self._target.get("eeprom_magic") == EEPROM_MAGIC:
            yield from self._global("eeprom_magic")

    def _global(self, key: str) -> Steps[None]:
        number = self._target.get(key)
        if number is None or number == self._now.get(key):
            return
        item = self._items[key]
        self._step()
        yield from self._try(item, settle(item.to(number), item.read))
        self._now[key] = number

    # The program

    def _write_program(self) -> Steps[None]:
        if self.wanted.program is None:
            self._target.pop("code_protection", None)
            return
        memory = _padded(self.wanted.program)
        found = None if self.present.program is None else _padded(self.present.program)
        if found == memory:
            return
        protection = self._now.get("code_protection", 0)
        if protection:
            yield from insist(Instruction(_SGP, GLOBAL_KEYS["code_protection"].number, 0, 0))
            self._now["code_protection"] = 0
            found = _padded(()) if protection & 1 else found
        for start, end in runs(memory, found):
            yield from program.store(memory[start:end], start, self._stepped)
            yield from program.check_stored(memory[start:end], start, self._stepped)
        yield from program.reset()

    # Communication

    def _write_communication(self) -> Steps[None]:
        for key in COMMUNICATION:
            number = self._target.get(key)
            if number is not None and number != self._now.get(key):
                self._step()
                yield from self._try(self._items[key], _change_line(key, self._now.get(key, 0), number))
                self._now[key] = number

    def _stepped(self, _done: int, _total: int) -> None:
        self._step()

    def _step(self) -> None:
        self.done += 1
        self._progress(self.done, self.done + 1)


def _change_line(key: str, before: int, number: int) -> Steps[None]:
    """Set a parameter of the line and follow it; where no reply comes, see which of the two the module uses."""
    row = GLOBAL_KEYS[key]
    write, read = Instruction(_SGP, row.number, 0, number), Instruction(_GGP, row.number)
    there, back = following(write), following(write._replace(value=before))
    for _ in range(program.ATTEMPTS):
        with suppress(*LOST):
            yield from value(write)
        if there is not None:
            yield there
        try:
            if (yield from value(read)) == number:
                return
        except LOST:
            if back is not None:
                yield back
    raise VerifyError(
        f"{key}: the module answers neither with the value {before} nor with {number}; `tmcm34x scan` finds it"
    )


def _known(readings: Mapping[Item, Reading]) -> dict[str, int]:
    return {item.path: r.value for item, r in readings.items() if isinstance(r, Value)}


def _padded(memory: Iterable[Instruction]) -> list[Instruction]:
    listed = list(memory)
    return listed + [Instruction(0)] * (PROGRAM_SIZE - len(listed))


def runs(wanted: list[Instruction], found: list[Instruction] | None) -> Iterator[tuple[int, int]]:
    """From where to where the program memory has to be written; all of it where nothing is known of it."""
    if found is None:
        yield 0, len(wanted)
        return
    different = [address for address in range(len(wanted)) if wanted[address] != found[address]]
    start = 0
    for index, address in enumerate(different):
        if index + 1 == len(different) or different[index + 1] > address + GAP:
            yield different[start], address + 1
            start = index + 1


def unequal(wanted: Backup, after: Backup, keep: Iterable[str] = ()) -> list[RowDifference]:
    """Rows that are not as the backup says after a restore, where the backup says something."""
    return [row for row in compare(wanted, after, keep) if row.left != "not there"]
