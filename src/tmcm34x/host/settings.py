"""A module's settings: read, written, stored, compared; and as text, TOML or TMCL source, both ways.

What is kept: the axis parameters that STAP knows, the global parameters of bank 0 that the EEPROM keeps, user
variables and coordinates.  Left out both ways is what could cut the line or wipe the program while it is being set;
`backup` has all of it.

The form of the TMCL source is the one that the TMCL-IDE exports: a heading comment for each axis, one command a
line with the parameter's name behind it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Final, NamedTuple, cast

from tmcm34x.host import commands
from tmcm34x.host.exceptions import DownloadModeError, FileError, HostError, RefusedError, unfinished
from tmcm34x.host.items import COMMUNICATION, GUARDED, MODELS, Item, settings_items
from tmcm34x.host.motion import send
from tmcm34x.host.reading import Reading, Silent, Value
from tmcm34x.host.steps import (
    NUMBERS,
    VERSION,
    Steps,
    ask,
    ask_again,
    check,
    executing,
    insist,
    reading,
    settle,
    value,
)  # fmt: skip
from tmcm34x.host.toml import Document, table
from tmcm34x.tmcl.axis_parameters import BY_KEY as AXIS_BY_KEY
from tmcm34x.tmcl.commands import MOTORS
from tmcm34x.tmcl.datagram import Instruction, Reply
from tmcm34x.tmcl.mnemonic import format_instruction
from tmcm34x.tmcl.numbers import GP
from tmcm34x.tmcl.status import Status

Readings = Mapping[Item, Reading]
Progress = Callable[[int, int], None]


PATIENCE: Final = 3
"""Values in a row without a reply until the module counts as lost."""
KEPT: Final = {"store": "stored in the EEPROM", "restore": "restored from the EEPROM"}
"""What has become of a value after either action of `keep`."""
_NOT_ASKED: Final = Silent("not asked, because the module had stopped replying")


def _silent(done: int, total: int) -> None:
    """Progress that is not shown."""


class Settings(NamedTuple):
    """What a text sets.

    model: that the text says it is of; None where it does not
    skipped: what it names and this model does not have, or settings leave out
    """

    values: dict[Item, int]
    model: int | None
    skipped: list[str]


class Failure(NamedTuple):
    """A setting that was not set or stored, and why."""

    item: Item
    why: str


# The module


def identify(*, in_download_mode: bool = False) -> Steps[tuple[int, str]]:
    """Type and version of the module.  Raises `DownloadModeError` where it stores commands instead of executing them.

    in_download_mode: be content with that
    """
    instruction = Instruction(VERSION)
    text = check(instruction, (yield from ask(instruction))).text
    if not in_download_mode:
        yield from executing()
    return (int(text[:3]) if text[:3].isdecimal() else 0), text


def read(items: Sequence[Item], progress: Progress = _silent) -> Steps[dict[Item, Reading]]:
    """The values in use; a module that has stopped replying is asked no more.  Raises `LinkError`."""
    readings: dict[Item, Reading] = {}
    silent = 0
    for done, item in enumerate(items, 1):
        found = readings[item] = (
            _NOT_ASKED if silent >= PATIENCE else (yield from reading(item.read, ask_again))
        )
        silent = silent + 1 if isinstance(found, Silent) else 0
        progress(done, len(items))
    return readings


def apply(values: Mapping[Item, int], progress: Progress = _silent) -> Steps[list[Failure]]:
    """Set all values, divisors before what depends on them; a refusal does not end it.

    Raises `ReplyError` or `LinkError`, which say how many values are set.
    """
    steps = {item: settle(item.to(number), item.read) for item, number in in_order(values.items())}
    return (yield from _each(steps, "set", progress))


def store(items: Iterable[Item], progress: Progress = _silent) -> Steps[list[Failure]]:
    """Copy the values in use to the EEPROM, each command sent until it is acknowledged.

    Raises `ReplyError` or `LinkError`, which say how many values are stored, and `RefusedError` where the EEPROM is
    locked.
    """
    chosen = {item.store: item for item in items if item.store is not None}
    if chosen and (yield from value(_READ_LOCK)) == 1:
        command = next(iter(chosen))
        raise RefusedError(command, Reply(0, 0, Status.EEPROM_LOCKED, command.number))
    steps = {item: insist(command) for command, item in chosen.items()}
    return (yield from _each(steps, "stored", progress))


def keep(
    action: commands.Keeping, parameters: Sequence[tuple[int, int, int]], progress: Progress = _silent
) -> Steps[None]:
    """Store parameters in the EEPROM, or bring them back from there, in their order, until one is refused.

    parameters: bank, number and motor of each, as for `commands.keep`
    Raises `HostError`, which says how many are done.
    """
    done, total = 0, len(parameters)
    with unfinished(lambda: f"{done} of {total} values are {KEPT[action]}, the others are not", (HostError,)):
        for done, (bank, number, motor) in enumerate(parameters):
            progress(done, total)
            yield from send(commands.keep(action, bank, number, motor))


_READ_LOCK: Final = Instruction(NUMBERS["GGP"], GP.EEPROM_LOCK)


def _each(items: Mapping[Item, Steps[object]], what: str, progress: Progress) -> Steps[list[Failure]]:
    """Do the steps of all items; returns what the module refused."""
    failures: list[Failure] = []
    done = 0
    with unfinished(lambda: f"{done - len(failures)} of {len(items)} values are {what}, the others are not"):
        for item, steps in items.items():
            try:
                yield from steps
            except DownloadModeError:
                raise
            except RefusedError as error:
                failures.append(Failure(item, str(error)))
            done += 1
            progress(done, len(items))
    return failures


_FIRST: Final = ("pulse_divisor", "ramp_divisor", "microstep_resolution")


def in_order(values: Iterable[tuple[Item, int]]) -> list[tuple[Item, int]]:
    """The divisors first: setting the acceleration computes the braking factors from them."""
    return sorted(values, key=lambda entry: entry[0].key not in _FIRST)


# Text


def to_tmcl(model: int, version: str, readings: Readings) -> str:
    """TMCL source; values that are 0 in user variables and coordinates are left away."""
    lines = [_head(model, version, readings, "//")]
    for motor in range(MOTORS):
        lines += ["", f"//=== module settings for axis {motor} ===", *_tmcl_lines(readings, f"axis.{motor}")]
    lines += ["", "//=== global parameters ===", *_tmcl_lines(readings, "module")]
    for name, title in (("variables", "user variables"), ("coordinates", "coordinates")):
        chosen = _tmcl_lines(readings, name, only_set=True)
        lines += ["", f"//=== {title} ===", *chosen] if chosen else []
    return "\n".join([*lines, *_missing(readings, "//")]) + "\n"


def _tmcl_lines(readings: Readings, name: str, *, only_set: bool = False) -> list[str]:
    values = ((item, found.value) for item, found in readings.items() if isinstance(found, Value))
    chosen = ((item, number) for item, number in values if item.table == name and (number or not only_set))
    return [_tmcl_line(item, number) for item, number in in_order(chosen)]


def _tmcl_line(item: Item, number: int) -> str:
    text = format_instruction(item.to(number))
    named = item.table not in {"variables", "coordinates"}
    return f"{text:<24}\t// {item.name}" if named else text


def to_toml(model: int, version: str, readings: Readings) -> str:
    """TOML: a table `axis.N` for each motor, `module`, `variables` and `coordinates`."""
    lines = [_head(model, version, readings, "#"), f"model = {model}"]
    for name in (*(f"axis.{motor}" for motor in range(MOTORS)), "module"):
        lines += table(name, rows(readings, name))
    lines += table("variables", (row for row in rows(readings, "variables") if row[1]))
    lines += table("coordinates", (row for row in rows(readings, "coordinates") if any(cast("Any", row[1]))))
    return "\n".join([*lines, *_missing(readings, "#")]) + "\n"


def rows(readings: Readings, name: str) -> list[tuple[str, object]]:
    """Keys and values of one table; a coordinate is a row of three, and there only when all three are known."""
    found = {item: r.value for item, r in readings.items() if item.table == name and isinstance(r, Value)}
    if name != "coordinates":
        return [(item.key, number) for item, number in found.items()]
    numbers = dict.fromkeys(item.key for item in found)
    triples = {key: [number for item, number in found.items() if item.key == key] for key in numbers}
    return [(key, triple) for key, triple in triples.items() if len(triple) == MOTORS]


def missing(readings: Readings) -> list[str]:
    """What could not be read and why, a line each."""
    return [f"{item.path}: {found.text}" for item, found in readings.items() if not isinstance(found, Value)]


def _head(model: int, version: str, readings: Readings, comment: str) -> str:
    count = len(missing(readings))
    state = f"INCOMPLETE settings ({count} could not be read, see the end)" if count else "Settings"
    return f"{comment} {state} of a TMCM-{model}, firmware {version}"


def _missing(readings: Readings, comment: str) -> list[str]:
    lines = missing(readings)
    return ["", f"{comment} Not read:", *(f"{comment}   {line}" for line in lines)] if lines else []


def from_text(text: str, model: int, path: str = "settings") -> Settings:
    """What a text of `to_tmcl` or `to_toml` sets, as far as the model has it.  Raises `FileError`."""
    head = next((line for line in text.splitlines() if line.strip()), "")
    toml = not path.lower().endswith(".tmc") and _TOML.match(head) is not None
    found = _from_toml(Document(text, path), model) if toml else _from_tmcl(text, model, path)
    if not found.values:
        raise FileError(path, 0, "there are no settings in it")
    return found


def _from_tmcl(text: str, model: int, path: str) -> Settings:
    from tmcm34x.toolchain.assembler import assemble

    assembly = assemble(text, path)
    for item in assembly.diagnostics:
        if item.severity == "error":
            raise FileError(path, item.location.line, item.text)
    known = {item.write[:3]: item for item in settings_items(model)}
    writes = {item.write.number for item in known.values()}
    values: dict[Item, int] = {}
    skipped: list[str] = []
    for number, instruction in enumerate(assembly.program):
        line = assembly.source_map[number].line
        if instruction.number not in writes:
            raise FileError(path, line, "only SAP, SGP and SCO are settings")
        item = known.get(instruction[:3])
        if item is None:
            skipped.append(format_instruction(instruction))
        elif not item.low <= instruction.value <= item.high:
            raise FileError(
                path, line, f"{item.path}: must be {item.low}..{item.high}, not {instruction.value}"
            )
        else:
            values[item] = instruction.value
    said = _SAID.search(text)
    return Settings(values, int(said[1]) if said else None, skipped)


_TOML: Final = re.compile(r"\s*(?:[#\[]|[\w.\"-]+\s*=)")
"""How the first line of a TOML text begins; no line of TMCL source with settings does."""
_SAID: Final = re.compile(r"\A\s*//.* of a TMCM-(34[123]),")


def _from_toml(document: Document, model: int) -> Settings:
    check_tables(document, {"model", "axis", "module", "variables", "coordinates"})
    said = document.root.get("model")
    if said is not None and said not in MODELS:
        raise document.error("model", f"must be one of {', '.join(map(str, MODELS))}")
    skipped: list[str] = []
    return Settings(values_of(document, settings_items(model), "", skipped), said, skipped)


def check_tables(document: Document, known: set[str]) -> None:
    """Raises `FileError` for a table or key at the top that nothing reads."""
    for name in document.root:
        if name not in known:
            raise document.unknown(name, name, known)
    for motor in document.table("axis"):
        if not (motor.isdecimal() and int(motor) < MOTORS):
            raise document.error(f"axis.{motor}", f"motors are 0..{MOTORS - 1}")


def values_of(document: Document, items: Iterable[Item], inner: str, skipped: list[str]) -> dict[Item, int]:
    """The values in a document's tables, or in their `inner` tables.  Raises `FileError`.

    skipped: takes what another model has, and what `items` leave out
    """
    values: dict[Item, int] = {}
    for name, keys in _by_table(items).items():
        path = f"{name}.{inner}" if inner else name
        for key, cell in document.table(path).items():
            if key in keys:
                values |= _value(document, f"{path}.{key}", keys[key], cell)
            elif key == "stored" and not inner and isinstance(cell, dict):
                continue
            elif _elsewhere(name, key):
                skipped.append(f"{path}.{key}")
            else:
                raise document.unknown(f"{path}.{key}", key, keys)
    return values


def _by_table(items: Iterable[Item]) -> dict[str, dict[str, list[Item]]]:
    tables: dict[str, dict[str, list[Item]]] = {}
    for item in items:
        tables.setdefault(item.table, {}).setdefault(item.key, []).append(item)
    return tables


def _elsewhere(name: str, key: str) -> bool:
    """Whether a key is one of another model, or one that settings leave out."""
    if name.startswith("axis."):
        return key in AXIS_BY_KEY
    return (name == "module" and key in {*COMMUNICATION, *GUARDED}) or (name == "coordinates" and key == "0")


def _value(document: Document, path: str, items: Sequence[Item], value: Any) -> dict[Item, int]:
    if items[0].table != "coordinates":
        return {items[0]: document.integer(path, value, items[0].low, items[0].high)}
    if not isinstance(value, list) or len(cast("list[Any]", value)) != MOTORS:
        raise document.error(path, f"must be a list of {MOTORS} positions")
    numbers = cast("list[Any]", value)
    return {
        item: document.integer(path, number, item.low, item.high)
        for item, number in zip(items, numbers, strict=True)
    }
