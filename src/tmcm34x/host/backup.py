"""The whole module in one text file that belongs into version control.

Axis parameters, user variables, coordinates and the motion chip's tables have two values: the one in use and the one
that the EEPROM brings back at power-on.  No command reads the latter; RSAP, RSGP and GCO 255 put it into use.  So it is
read by recalling it and setting the value in use again, which does nothing where the two are equal, and is done only
while no motor turns and no program runs.

What is only a state (positions, speeds, switches, counters) is not part of it, nor what acts when it is read (driver
flags, load, random numbers).  What could not be read is listed with the reason, and the first line says so.

Source: manual 6.7.5 to 6.7.12, 6.7.25, 6.7.26, 6.7.36, chapters 7 and 8; fidelity FW-53, FW-60.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, Final, NamedTuple, cast

from tmcm34x.host.exceptions import (
    FileError,
    NoReplyError,
    NotAvailableError,
    ProtectedError,
    RefusedError,
    ReplyError,
)
from tmcm34x.host.items import MODELS, Item, all_items
from tmcm34x.host.program import Tell, read_instruction, silent
from tmcm34x.host.reading import Absent, Reading, Refused, Silent, Value
from tmcm34x.host.settings import PATIENCE, Progress, check_tables, identify, rows, values_of
from tmcm34x.host.steps import NUMBERS, SEARCHES, Steps, ask_again, insist, reading, settle, value
from tmcm34x.host.toml import Document, literal, table
from tmcm34x.tmcl.axis_parameters import BY_KEY as AXIS_KEYS
from tmcm34x.tmcl.commands import MOTORS, PROGRAM_SIZE
from tmcm34x.tmcl.datagram import ChecksumError, Instruction, pack_record, unpack_record
from tmcm34x.tmcl.global_parameters import BY_KEY as GLOBAL_KEYS

FORMAT: Final = 1
TABLES: Final = (*(f"axis.{motor}" for motor in range(MOTORS)), "module", "variables", "coordinates", "chip")
_GGP: Final = NUMBERS["GGP"]
_GAP: Final = NUMBERS["GAP"]
_KEYS: Final = frozenset({
    "format", "complete", "model", "version", "not_read",
    "axis", "module", "variables", "coordinates", "chip", "program",
})  # fmt: skip


class Backup(NamedTuple):
    """All that a module keeps.

    present: the values in use
    stored: those that the EEPROM brings back, for items that have both
    program: the program memory up to its last instruction; None where it could not be read
    not_read: what could not be read and why, a line each
    """

    model: int
    version: str
    present: dict[Item, Reading]
    stored: dict[Item, Reading]
    program: tuple[Instruction, ...] | None
    not_read: list[str]

    @property
    def complete(self) -> bool:
        """Whether nothing is missing."""
        return not self.not_read


# From the module


def read(*, stored: bool = True, progress: Progress = silent, tell: Tell = silent) -> Steps[Backup]:
    """Read everything.  Raises `HostError` where the module does not say what it is, or the line is gone.

    stored: also the values that the EEPROM brings back; see the module's text for how
    """
    model, version = yield from identify()
    if model not in MODELS:
        raise NotAvailableError(
            f"the module says that it is a {version}, which is not a TMCM-341, 342 or 343"
        )
    storage = GLOBAL_KEYS["coordinate_storage"].number
    in_eeprom = (yield from value(Instruction(_GGP, storage))) == 1
    items = all_items(model, stored_in_eeprom=in_eeprom)
    groups = groups_of(items)
    count = _Count(progress, len(items) + len(groups) + sum(map(len, groups.values())) + PROGRAM_SIZE)
    present = yield from _read_present(items, count)
    recalled = yield from _read_stored(groups, present, stored, count)
    program, why = yield from _read_program(count)
    missing = [
        f"{item.path}: {found.text}" for item, found in present.items() if not isinstance(found, Value)
    ]
    missing += _missing_stored(recalled)
    missing += [f"program: {why}"] if why else []
    count.finish()
    for line in missing:
        tell(line)
    return Backup(model, version, present, recalled, program, missing)


class _Count:
    """Progress over all parts."""

    def __init__(self, progress: Progress, total: int) -> None:
        self._progress, self._total, self._done = progress, total, 0

    def step(self) -> None:
        """One more is done."""
        self._done = min(self._done + 1, self._total - 1)
        self._progress(self._done, self._total)

    def finish(self) -> None:
        """All is done."""
        self._progress(self._total, self._total)


def _read_present(items: Sequence[Item], count: _Count) -> Steps[dict[Item, Reading]]:
    present: dict[Item, Reading] = {}
    silent_items = 0
    for item in items:
        found = present[item] = yield from reading(item.read, ask_again)
        silent_items = silent_items + 1 if isinstance(found, Silent) else 0
        if silent_items >= PATIENCE:
            raise NoReplyError(
                item.read, "the module has stopped replying; check power and wiring, and begin again"
            )
        count.step()
    return present


def groups_of(items: Iterable[Item]) -> dict[Instruction, list[Item]]:
    """Items by the command that recalls them: one for most, all words of a chip's table, three motors' coordinates."""
    groups: dict[Instruction, list[Item]] = {}
    for item in items:
        if item.recall is not None:
            groups.setdefault(item.recall, []).append(item)
    return groups


def _read_stored(
    groups: Mapping[Instruction, list[Item]], present: Mapping[Item, Reading], wanted: bool, count: _Count
) -> Steps[dict[Item, Reading]]:
    why = "not wanted" if not wanted else (yield from busy())
    recalled: dict[Item, Reading] = {}
    for recall, items in groups.items():
        if why:
            recalled |= dict.fromkeys(items, Absent(f"stored values are not read: {why}"))
        elif all(isinstance(present[item], Value) for item in items):
            recalled |= yield from _recall(recall, items, present)
        else:
            recalled |= dict.fromkeys(items, Absent("the value in use could not be read, and would be lost"))
        for _ in range(len(items) + 1):
            count.step()
    return recalled


def busy() -> Steps[str]:
    """Why values must not be changed for a moment; empty where they may."""
    if (yield from value(Instruction(_GGP, GLOBAL_KEYS["application_status"].number))) == 1:
        return "the program is running"
    for motor in range(MOTORS):
        speed = yield from value(Instruction(_GAP, AXIS_KEYS["actual_speed"].number, motor))
        search = yield from value(Instruction(NUMBERS["RFS"], SEARCHES["STATUS"], motor))
        if speed or search:
            return f"motor {motor} is turning"
    return ""


def _recall(
    recall: Instruction, items: Sequence[Item], present: Mapping[Item, Reading]
) -> Steps[dict[Item, Reading]]:
    """The stored values of one group; whatever happens, the values in use are set again."""
    found: dict[Item, Reading] = {}
    try:
        try:
            yield from insist(recall)
        except RefusedError as error:
            return dict.fromkeys(items, Refused(error.status))
        except ReplyError as error:
            return dict.fromkeys(items, Silent(str(error)))
        for item in items:
            found[item] = yield from reading(item.read, ask_again)
    finally:
        for item in items:
            before = present[item]
            if isinstance(before, Value) and found.get(item) != before:
                yield from settle(item.to(before.value), item.read)
    return found


def _missing_stored(recalled: Mapping[Item, Reading]) -> list[str]:
    """One line for all that has the same reason in general, else one for each."""
    lines: dict[str, None] = {}
    for item, found in recalled.items():
        if isinstance(found, Absent) and found.why.startswith("stored values"):
            lines[found.why] = None
        elif not isinstance(found, Value):
            lines[f"{item.path}, stored: {found.text}"] = None
    return list(lines)


def _read_program(count: _Count) -> Steps[tuple[tuple[Instruction, ...] | None, str]]:
    """All of the program memory, and why not."""
    program: list[Instruction] = []
    for address in range(PROGRAM_SIZE):
        try:
            program.append((yield from read_instruction(address)))
        except (ProtectedError, ReplyError, RefusedError) as error:
            return None, str(error)
        count.step()
    return trimmed(program), ""


def trimmed(program: Iterable[Instruction]) -> tuple[Instruction, ...]:
    """A program memory without the empty rest."""
    memory = list(program)
    while memory and memory[-1] == Instruction(0):
        memory.pop()
    return tuple(memory)


# Text


def to_text(backup: Backup) -> str:
    """The file."""
    return "\n".join(_lines(backup)) + "\n"


def _lines(backup: Backup) -> Iterator[str]:
    count = len(backup.not_read)
    state = f"INCOMPLETE backup ({count} not read, see not_read)" if count else "Complete backup"
    yield f"# {state} of a TMCM-{backup.model}, firmware {backup.version}"
    yield "# Values in use are in [axis.N], [variables], ...; those that the EEPROM brings back in [axis.N.stored], ..."
    yield f"format = {FORMAT}"
    yield f"complete = {str(backup.complete).lower()}"
    yield f"model = {backup.model}"
    yield f'version = "{backup.version}"'
    if backup.not_read:
        yield from ("not_read = [", *(f"    {literal(line)}," for line in backup.not_read), "]")
    for name in TABLES:
        yield from table(name, rows(backup.present, name))
        yield from table(f"{name}.stored", rows(backup.stored, name))
    if backup.program is not None:
        yield from _program_lines(backup.program)


def _program_lines(program: Sequence[Instruction]) -> Iterator[str]:
    from tmcm34x.toolchain.disassembler import disassemble
    from tmcm34x.toolchain.formatter import format_source

    image = "".join(f"{pack_record(instruction).hex(' ')}\n" for instruction in program)
    source = format_source(disassemble(program)) if program else ""
    yield from table("program", (("length", len(program)), ("source", source), ("image", image)))


def from_text(text: str, path: str) -> Backup:
    """The backup in a file, which may have been edited.  Raises `FileError` with path and line."""
    document = Document(text, path)
    if document.root.get("format") != FORMAT:
        raise FileError(path, document.line("format"), f"not a backup: it needs format = {FORMAT}")
    check_tables(document, set(_KEYS))
    model = document.root.get("model")
    if model not in MODELS:
        raise document.error("model", f"must be one of {', '.join(map(str, MODELS))}")
    present, stored = _both(document, model)
    return Backup(model, _text(document, "version"), present, stored, _program(document), _not_read(document))


def _both(document: Document, model: int) -> tuple[dict[Item, Reading], dict[Item, Reading]]:
    in_eeprom = document.table("module").get("coordinate_storage") == 1
    items = all_items(model, stored_in_eeprom=in_eeprom)
    found = [values_of(document, items, inner, skipped := []) for inner in ("", "stored")]
    del skipped
    present, stored = ({item: cast(Reading, Value(n)) for item, n in values.items()} for values in found)
    return present, stored


def _text(document: Document, key: str) -> str:
    text = document.root.get(key, "")
    if not isinstance(text, str):
        raise document.error(key, "must be a string")
    return text


def _not_read(document: Document) -> list[str]:
    lines: Any = document.root.get("not_read", [])
    if not isinstance(lines, list):
        raise document.error("not_read", "must be a list of strings")
    return [str(line) for line in cast("list[Any]", lines)]


def _program(document: Document) -> tuple[Instruction, ...] | None:
    """From the image; a source beside it must say the same, and does alone too."""
    if "program" not in document.root:
        return None
    found = document.table("program")
    for key in found:
        if key not in {"length", "source", "image"}:
            raise document.unknown(f"program.{key}", key, ("length", "source", "image"))
    image = _image(document, found["image"]) if "image" in found else None
    source = _source(document, found["source"]) if found.get("source") else None
    if image is not None and source is not None and trimmed(source) != trimmed(image):
        raise document.error(
            "program.source", "says another program than image; remove the one that is out of date"
        )
    program = image if image is not None else source
    if program is not None and len(program) > PROGRAM_SIZE:
        raise document.error("program", f"has more than {PROGRAM_SIZE} instructions")
    return () if program is None else trimmed(program)


def _image(document: Document, text: object) -> tuple[Instruction, ...]:
    start = document.line("program.image")
    program: list[Instruction] = []
    for number, line in enumerate(str(text).splitlines(), 1):
        try:
            program.append(unpack_record(bytes.fromhex(line)))
        except (ChecksumError, ValueError) as error:
            raise FileError(document.path, start + number, f"program.image: {error}") from error
    return tuple(program)


def _source(document: Document, text: object) -> tuple[Instruction, ...]:
    from tmcm34x.toolchain.assembler import assemble

    assembly = assemble(str(text), document.path)
    for item in assembly.diagnostics:
        if item.severity == "error":
            line = document.line("program.source") + item.location.line
            raise FileError(document.path, line, f"program.source: {item.text}")
    return assembly.program


# Comparing


class RowDifference(NamedTuple):
    """A row in which two modules differ, or of which one side is not known."""

    path: str
    left: str
    right: str


def compare(left: Backup, right: Backup, ignore: Iterable[str] = ()) -> list[RowDifference]:
    """All rows in which two modules are not known to be equal, the program's instruction by instruction.

    ignore: keys of global parameters that may differ
    """
    different: list[RowDifference] = []
    if left.model != right.model:
        different.append(RowDifference("model", str(left.model), str(right.model)))
    for suffix, ours, theirs in (("", left.present, right.present), (", stored", left.stored, right.stored)):
        different += _compare_readings(suffix, ours, theirs, frozenset(ignore))
    return different + list(_compare_programs(left.program, right.program))


def _compare_readings(
    suffix: str, left: Mapping[Item, Reading], right: Mapping[Item, Reading], ignore: frozenset[str]
) -> Iterator[RowDifference]:
    ours, theirs = ({item.path: found for item, found in side.items()} for side in (left, right))
    for path in dict.fromkeys((*ours, *theirs)):
        one, other = ours.get(path), theirs.get(path)
        if path.removeprefix("module.") in ignore or (isinstance(one, Value) and one == other):
            continue
        yield RowDifference(
            path + suffix, *("not there" if side is None else side.text for side in (one, other))
        )


def _compare_programs(
    left: tuple[Instruction, ...] | None, right: tuple[Instruction, ...] | None
) -> Iterator[RowDifference]:
    from tmcm34x.tmcl.mnemonic import format_instruction

    if left is None or right is None:
        texts = ("not read" if side is None else f"{len(side)} instructions" for side in (left, right))
        yield RowDifference("program", *texts)
        return
    for address in range(max(len(left), len(right))):
        one, other = (side[address] if address < len(side) else Instruction(0) for side in (left, right))
        if one != other:
            yield RowDifference(f"program {address}", format_instruction(one), format_instruction(other))
