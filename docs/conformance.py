"""What the manual describes, row by row, and the tests that pin each row.

The rows come from the product's own tables (`tmcm34x.tmcl`) and, where the manual describes behaviour that is no
row of a table, from the lists below.  A pin is the key of a row, named

- in a session file (`tests/sessions/*.txt`) on a line `# pins: MVP.ABS AP.4 STATUS.5`, or
- at a test: `@pytest.mark.pins("AP.206 HINT.9.2")`.

`docs/generate.py` writes the page; `tests/test_conformance.py` fails when a row has no pin or a pin has no row.
"""

from __future__ import annotations

import ast
import inspect
import re
from collections import defaultdict
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

from tmcm34x.bench.session.language import load
from tmcm34x.firmware import boot, control, dispatch
from tmcm34x.firmware.parameters.axis import EFFECTS
from tmcm34x.firmware.parameters.tables import tables as parameter_tables
from tmcm34x.tmcl import commands
from tmcm34x.tmcl.axis_parameters import ALL, AXIS_PARAMETERS, WITH_DRIVERS
from tmcm34x.tmcl.commands import ASCII_COMMANDS, COMMANDS, CONTROL_FUNCTIONS
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.global_parameters import GLOBAL_PARAMETERS
from tmcm34x.tmcl.status import STATUS_TEXTS

TESTS = Path(__file__).parent.parent / "tests"
SESSIONS = TESTS / "sessions"

PINS_LINE = re.compile(r"#\s*pins:(.*)", re.IGNORECASE)
RANGE = re.compile(r"(.+\.)(\d+)\.\.(\d+)\Z")


class Row(NamedTuple):
    """One thing that the manual describes."""

    key: str
    name: str
    section: str
    models: frozenset[int] = ALL
    members: tuple[str, ...] = ()
    """Marks that a session must leave to pin the row; none for what only a reader can judge."""
    refused: frozenset[int] = frozenset()
    """Models that answer status 3."""


class Pin(NamedTuple):
    """A test or session that claims a row."""

    key: str
    where: str
    models: frozenset[int]


def _exercised(key: str, name: str, section: str, models: frozenset[int] = ALL) -> Row:
    return Row(key, name, section, models, (key,))


def _commands() -> Iterator[Row]:
    for row in COMMANDS:
        yield _exercised(row.mnemonic, f"`{row.syntax}` {row.title}", row.section)


def _command_types() -> Iterator[Row]:
    for row in COMMANDS:
        for operand in row.operands:
            for word, _ in operand.words:
                yield _exercised(f"{row.mnemonic}.{word}", f"`{row.mnemonic} {word}`", row.section)
    for key, name, section in (
        ("MVP.COORD.$80", "`MVP COORD` with bit 7: several motors", "6.7.4"),
        ("MVP.COORD.$40", "`MVP COORD` with bit 6: several motors, interpolated", "6.7.4"),
        ("SIO.255", "`SIO 255, 2`: all outputs", "6.7.14"),
        ("SIO.-1", "`SIO 255, 2, -1`: outputs from the accumulator", "6.7.14"),
        ("GIO.bank.0", "`GIO`, bank 0: digital inputs", "6.7.15.1"),
        ("GIO.bank.1", "`GIO`, bank 1: analogue inputs", "6.7.15.2"),
        ("GIO.bank.2", "`GIO`, bank 2: outputs read back", "6.7.15.3"),
        ("GIO.10", "`GIO 10, 0`: SHUTDOWN pin", "6.7.15.1"),
        ("GIO.255", "`GIO 255, 0`: all inputs", "6.7.15.1"),
        *((f"SAC.{bus}", f"`SAC {bus}`: SPI_SEL{n}{what}", "6.7.24")
          for start, what in ((0, ""), (128, ", from the accumulator"))
          for n, bus in enumerate((start, start + 2, start + 3))),
        ("SCO.255", "`SCO n, 255`: coordinates from RAM to EEPROM", "6.7.25"),
        ("GCO.255", "`GCO n, 255`: coordinates from EEPROM to RAM", "6.7.26"),
        ("CCO.7", "`CCO n, 7`: all three axes", "6.7.27"),
        ("UF.customer", "`UF0` to `UF7` with a customer's functions", "6.7.33"),
    ):  # fmt: skip
        yield _exercised(key, name, section)


def _control_functions() -> Iterator[Row]:
    for row in CONTROL_FUNCTIONS:
        yield _exercised(f"CF.{row.number}", f"{row.number}, {row.title}", row.section)
        for operand in row.operands:
            for word, number in operand.words:
                yield _exercised(
                    f"CF.{row.number}.{word}", f"{row.number} type {number}: {word}", row.section
                )


def _axis_parameters() -> Iterator[Row]:
    for row in AXIS_PARAMETERS:
        key = f"AP.{row.number}"
        yield Row(key, f"{row.number}, {row.name} ({row.access})", row.section, ALL, (key,), ALL - row.models)


def _global_parameters() -> Iterator[Row]:
    families = {7: range(7, 23), 23: range(23, 39)}
    members = {number for family in families.values() for number in family}
    for row in GLOBAL_PARAMETERS:
        if row.bank or (row.number in members and row.number not in families):
            continue
        numbers = families.get(row.number, (row.number,))
        name = row.name if len(numbers) == 1 else row.name.rsplit(" ", 1)[0] + "s 0..15"
        key = str(numbers[0]) if len(numbers) == 1 else f"{numbers[0]}..{numbers[-1]}"
        marks = tuple(f"GP.{number}" for number in numbers)
        yield Row(f"GP.{key}", f"{key}, {name} ({row.access})", row.section, ALL, marks)
    yield _exercised("GP1", "bank 1: not available", "8.2")
    variables = [row.number for row in GLOBAL_PARAMETERS if row.bank == 2]
    key = f"{variables[0]}..{variables[-1]}"
    marks = tuple(f"GP2.{number}" for number in variables)
    yield Row(f"GP2.{key}", f"bank 2, {key}: user variables (RWE)", "8.3", ALL, marks)


def _status_codes() -> Iterator[Row]:
    for number, text in STATUS_TEXTS.items():
        yield _exercised(f"STATUS.{number}", f"{int(number)}, {text}", "6.2.1" if number != 128 else "6.7.34")


def _ascii() -> Iterator[Row]:
    for row in COMMANDS:
        if "ascii" in row.where:
            yield _exercised(f"ASCII.{row.mnemonic}", f"`{row.mnemonic}` as text", "6.6.3")
    for word in ASCII_COMMANDS:
        yield _exercised(f"ASCII.{word}", f"`{word}`", "6.6.3")
    for key, name, section in (
        ("line", "address letter, blanks, commas, carriage return", "6.6.1"),
        ("address", "a line for another module is passed over", "6.6.1"),
        ("reply", "host letter, module letter, status, value, carriage return", "6.6.2"),
        ("others", "commands that are not for the ASCII interface are refused", "6.6.3"),
        ("start", "parameter 67 bit 0: ASCII mode at power-on", "6.6.4"),
        ("echo.characters", "parameter 67 bits 5, 4 = 00: every character echoed", "6.6.4"),
        ("echo.line", "parameter 67 bits 5, 4 = 01: the line echoed after the carriage return", "6.6.4"),
        ("echo.none", "parameter 67 bits 5, 4 = 10: no echo", "6.6.4"),
        ("backspace", "backspace erases a character", "6.6.4"),
    ):
        yield Row(f"ASCII.{key}", name, section)


def _wire() -> Iterator[Row]:
    yield _exercised("CAN.7", "seven data bytes: no address, no checksum", "6.1")
    yield _exercised("CAN.8", "an eight byte frame is answered by eight bytes", "6.7.36")
    for key, name, section in (
        ("WIRE.telegram", "nine bytes, value most significant byte first", "6.1"),
        ("WIRE.checksum", "8-bit sum; a wrong one answers status 1", "6.1"),
        ("WIRE.address", "a telegram for another address is passed over", "6.1"),
        ("WIRE.reply", "reply address, module address, status, command, value, sum", "6.2"),
        ("WIRE.any-address", "USB takes telegrams for any address", "6.1"),
        ("WIRE.bus", "several modules on one line, each with its address", "6"),
        ("WIRE.time-out", "an incomplete telegram is dropped", "6.1"),
        ("CAN.id", "identifiers of module and reply (parameters 71, 70)", "8.1"),
        ("CAN.secondary", "second identifier (parameter 83)", "8.1"),
        ("CAN.version", "version string in seven and eight byte frames", "6.7.36"),
    ):
        yield Row(key, name, section)


def _stand_alone() -> Iterator[Row]:
    for key, name, section in (
        ("PROG.accumulator", "reading commands of a program load the accumulator", "6.4.5"),
        ("PROG.direct", "reading commands of the host leave it alone", "6.4.5"),
        ("PROG.refused", "commands for programs only are refused in direct mode", "6.4.4"),
        ("PROG.size", "2,048 commands", "2.1"),
        ("PROG.example", "the example program runs as described", "5.2"),
    ):
        yield Row(key, name, section)


def _boot_loader() -> Iterator[Row]:
    yield _exercised("BOOT.242", "242, enter the boot loader", "4")
    for row in boot.COMMANDS:
        yield _exercised(f"BOOT.{row.number}", f"{row.number}, {row.name}", "4")


def _hints() -> Iterator[Row]:
    for key, name, models, marks in (
        ("9.1.mode-1", "reference search, mode 1: left switch", ALL, "RFS.START"),
        ("9.1.mode-2", "reference search, mode 2: right, then left switch", ALL, "RFS.START AP.193"),
        ("9.1.mode-3", "reference search, mode 3: right, then reference switch", ALL, "RFS.START AP.193"),
        ("9.1.circular", "reference search of a circular system", ALL, "RFS.START"),
        ("9.1.three-at-once", "three searches at the same time", ALL, "RFS.START"),
        (
            "9.1.switches-disabled",
            "parameters 12 and 13 do not matter meanwhile",
            ALL,
            "RFS.START AP.12 AP.13",
        ),
        ("9.1.centre", "the reference point is the centre of the two switching points", ALL, "RFS.START"),
        ("9.2.stall", "the motor stops when the load gets too high", WITH_DRIVERS, "AP.205"),
        ("9.2.ramp", "no stall detection while accelerating or decelerating", WITH_DRIVERS, "AP.205"),
        (
            "9.2.homing",
            "the example of finding a mechanical stop",
            WITH_DRIVERS,
            "AP.205 ROL COMP JC.NE AP.1",
        ),
        ("9.3.mixed-decay", "mixed decay with threshold -1", WITH_DRIVERS, "AP.203"),
        ("9.4.pause", "telegram pause time for RS485", ALL, "GP.75"),
    ):
        yield Row(f"HINT.{key}", name, key[:3], models, tuple(marks.split()))


GROUPS = {
    "Telegrams and frames": _wire,
    "Status codes": _status_codes,
    "Commands": _commands,
    "Command types": _command_types,
    "Control functions": _control_functions,
    "Axis parameters": _axis_parameters,
    "Global parameters": _global_parameters,
    "Stand-alone programs": _stand_alone,
    "ASCII interface": _ascii,
    "Boot loader": _boot_loader,
    "Hints and tips": _hints,
}

ROWS = {row.key: row for rows in GROUPS.values() for row in rows()}


def marks(instruction: Instruction) -> Iterator[str]:
    """The marks that carrying out `instruction` leaves."""
    number, type_, motor, value = instruction
    row = commands.BY_NUMBER.get(number)
    if row is None:
        yield f"BOOT.{number}"
        return
    name = row.mnemonic or f"CF.{number}"
    yield name
    for operand in row.operands:
        yield from (f"{name}.{word}" for word, code in operand.words if code == type_)
        if operand.kind == "axis_parameter":
            yield f"AP.{type_}"
        elif operand.kind == "global_parameter":
            yield {0: f"GP.{type_}", 2: f"GP2.{type_}"}.get(motor, f"GP{motor}")
    if name == "MVP" and type_ == 2:
        yield from (f"MVP.COORD.${bit:x}" for bit in (0x80, 0x40) if motor & bit)
    elif name == "GIO":
        yield f"GIO.bank.{motor}"
    if name in {"SIO", "GIO", "SAC"}:
        yield f"{name}.{type_}"
    if name == "SIO" and value == -1:
        yield "SIO.-1"
    if name in {"SCO", "GCO", "CCO"}:
        yield f"{name}.{motor}"


def expand(text: str) -> list[str]:
    """The keys in the text of a pin: `AP.4..7 ROR` is AP.4 AP.5 AP.6 AP.7 ROR, unless AP.4..7 is itself a key."""
    keys = []
    for word in text.split():
        match = RANGE.match(word)
        if match and word not in ROWS:
            stem, first, last = match.groups()
            keys += [f"{stem}{number}" for number in range(int(first), int(last) + 1)]
        else:
            keys.append(word)
    return keys


def session_pins() -> Iterator[Pin]:
    """All pins of the session files."""
    for path in sorted(SESSIONS.glob("*.txt")):
        for case in load(path):
            for pin in case.pins:
                for key in expand(pin):
                    yield Pin(key, f"sessions/{path.name}", case.models)


def python_pins() -> Iterator[Pin]:
    """All pins at Python tests: arguments of `pytest.mark.pins`, at a function, a class or a whole file."""
    for path in sorted(TESTS.rglob("test_*.py")):
        text = path.read_text()
        if "mark.pins" not in text:
            continue
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.Call) and ast.unparse(node.func) == "pytest.mark.pins":
                for argument in node.args:
                    for key in expand(ast.literal_eval(argument)):
                        yield Pin(key, path.relative_to(TESTS).as_posix(), ALL)


def all_pins() -> dict[str, list[Pin]]:
    """All pins by key."""
    found: dict[str, list[Pin]] = defaultdict(list)
    for pin in (*session_pins(), *python_pins()):
        found[pin.key].append(pin)
    return dict(found)


SOURCE = Path(__file__).parent.parent / "src" / "tmcm34x"
_PROGRAM = "firmware/program/execution.py"
_PROGRAM_COMMANDS = {
    **dict.fromkeys(
        ("CALC", "CALCX", "COMP", "JC", "JA", "CSUB", "RSUB", "CLE"), "firmware/program/templates.py"
    ),
    "WAIT": "firmware/program/wait.py",
    "STOP": _PROGRAM,
}
_PLACES = {
    "CAN": "firmware/ports/can.py",
    "WIRE": "firmware/ports/serial.py",
    "STATUS": "tmcl/status.py",
    "ASCII": "firmware/ports/ascii.py",
    "BOOT": "firmware/boot.py",
    "HINT.9.1": "firmware/reference.py",
    "HINT.9.2": "firmware/supervision.py",
    "HINT.9.3": "firmware/drivers.py",
    "HINT.9.4": "firmware/ports/serial.py",
    "GP1": "firmware/commands/parameters.py",
    "GP2": "firmware/commands/parameters.py",
    "PROG": _PROGRAM,
    "UF": "firmware/commands/io.py",
}
"""Where rows are implemented that are in no table of functions, by the beginning of their key."""


def _file(function: Callable[..., object]) -> str:
    """The source file of a function, from `tmcm34x` on."""
    plain = function.func if isinstance(function, partial) else function
    return Path(inspect.getsourcefile(plain) or "").relative_to(SOURCE).as_posix()


def _parameter(number: int, readers: Any, writers: Any, effects: Any = MappingProxyType({})) -> str:
    row_and_writer = writers[number]
    functions = (readers[number], row_and_writer[1] if row_and_writer else None, effects.get(number))
    files = {_file(function) for function in functions if function}
    names = {f"`{function.__name__}`" for function in functions if function}
    return f"{files.pop()} {', '.join(sorted(names))}"


def implemented(key: str) -> str:
    """Where a row is implemented: a file of src/tmcm34x, and for parameters the functions that read and write it."""
    head, _, rest = key.partition(".")
    tables = parameter_tables(343, "standard")
    if head in _PROGRAM_COMMANDS:
        return _PROGRAM_COMMANDS[head]
    if head in commands.BY_MNEMONIC:
        return _file(dispatch.HANDLERS[commands.BY_MNEMONIC[head].number])
    if head == "CF":
        return _file(control.HANDLERS[commands.BY_NUMBER[int(rest.split(".")[0])].key])
    if head == "AP":
        return _parameter(int(rest), tables.axis_readers, tables.axis_writers, EFFECTS)
    if head == "GP":
        number = int(rest.split("..")[0])
        readers = {number: tables.global_readers[number]}
        return _parameter(number, readers, {number: tables.global_writers.get(number)})
    return next(place for start, place in _PLACES.items() if key.startswith(start))


HEAD = """\
# Conformance: what the manual describes and the tests that pin it

A row for everything that the manual of firmware V4.36 lets a user do. The models are those on which the tests of the
row run; `implemented in` names the place in `src/tmcm34x`.
Sessions (`tests/sessions/*.txt`, [how to read them](sessions.md)) are conversations with a module that a user
could type; a session that names a row must really exercise it, and the test suite checks that it does. Where the manual
is silent or wrong, [fidelity.md](fidelity.md) says what was chosen.

"""


def page() -> str:
    """The text of docs/conformance.md."""
    pins = all_pins()
    parts = [HEAD]
    for title, rows in GROUPS.items():
        parts.append(
            f"## {title}\n\n| row | what | manual | 341 | 342 | 343 | implemented in | pinned by |\n"
        )
        parts.append("| --- | --- | --- | --- | --- | --- | --- | --- |\n")
        for row in rows():
            found = pins.get(row.key, [])
            models = frozenset[int]().union(*(pin.models for pin in found))
            done = {model: "refused" if model in row.refused else "yes" for model in models}
            ticks = " | ".join(done.get(model, "") for model in sorted(ALL))
            where = ", ".join(
                f"[{Path(name).stem}](../tests/{name})" for name in sorted({pin.where for pin in found})
            )
            name = row.name.replace("|", "\\|")
            parts.append(
                f"| {row.key} | {name} | {row.section} | {ticks} | {implemented(row.key)} | {where} |\n"
            )
        parts.append("\n")
    return "".join(parts).rstrip() + "\n"
