"""A module's settings as text: TMCL source that sets them, or TOML; and back.

What is kept: the axis parameters that STAP knows, the global parameters of bank 0 that the EEPROM keeps, user
variables and coordinates.  Left out both ways is what could cut the line or wipe the program while it is being
set: `LEFT_OUT`.

The form of the TMCL source is the one that the TMCL-IDE exports: a heading comment for each axis, one command a
line with the parameter's name behind it.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from typing import Any, Final, cast

from tmcm34x.board.models import Model
from tmcm34x.ide.wire import RefusalError, Watched
from tmcm34x.tmcl.axis_parameters import AXIS_PARAMETERS
from tmcm34x.tmcl.axis_parameters import BY_KEY as AXIS_BY_KEY
from tmcm34x.tmcl.axis_parameters import BY_NUMBER as AXIS_BY_NUMBER
from tmcm34x.tmcl.commands import BY_MNEMONIC, COORDINATES, MOTORS
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.global_parameters import BY_KEY as GLOBAL_BY_KEY
from tmcm34x.tmcl.global_parameters import BY_NUMBER as GLOBAL_BY_NUMBER
from tmcm34x.tmcl.global_parameters import GLOBAL_PARAMETERS
from tmcm34x.tmcl.mnemonic import format_instruction

LEFT_OUT: Final = frozenset({
    "eeprom_magic", "eeprom_lock", "code_protection", "baud_rate", "serial_address", "host_address", "ascii_mode",
    "serial_heartbeat", "telegram_pause", "can_bit_rate", "can_reply_id", "can_id", "can_secondary_id",
})  # fmt: skip
"""Global parameters that are set by hand only."""

AXIS: Final = -1
COORDINATE: Final = -2
_SAP: Final = BY_MNEMONIC["SAP"].number
_SGP: Final = BY_MNEMONIC["SGP"].number
_SCO: Final = BY_MNEMONIC["SCO"].number

Values = Mapping[Watched, int | None]


def wanted(model: int) -> list[Watched]:
    """All settings of a module."""
    items = [
        Watched(AXIS, row.number, motor)
        for motor in range(MOTORS)
        for row in AXIS_PARAMETERS
        if row.stored and model in row.models
    ]
    items += [
        Watched(row.bank, row.number, 0)
        for row in GLOBAL_PARAMETERS
        if row.stored and row.key not in LEFT_OUT
    ]
    items += [
        Watched(COORDINATE, number, motor) for number in range(1, COORDINATES) for motor in range(MOTORS)
    ]
    return items


def to_tmcl(model: Model, values: Values) -> str:
    """TMCL source; values that are 0 in user variables and coordinates are left away."""
    lines = [f"// Settings of a {model.name}, firmware {model.version}"]
    for motor in range(MOTORS):
        lines += ["", f"//=== module settings for axis {motor} ==="]
        lines += [_line(item, value) for item, value in _chosen(values, AXIS) if item.motor == motor]
    lines += ["", "//=== global parameters ==="]
    lines += [_line(item, value) for item, value in _chosen(values, 0)]
    for bank, title in ((2, "user variables"), (COORDINATE, "coordinates")):
        chosen = [_line(item, value) for item, value in _chosen(values, bank) if value]
        lines += ["", f"//=== {title} ===", *chosen] if chosen else []
    return "\n".join(lines) + "\n"


def to_toml(model: Model, values: Values) -> str:
    """TOML: a table `axis.N` for each motor, `module`, `variables` and `coordinates`."""
    lines = [f"# Settings of a {model.name}, firmware {model.version}", f"model = {model.number}"]
    for motor in range(MOTORS):
        lines += ["", f"[axis.{motor}]"]
        lines += [
            f"{AXIS_BY_NUMBER[item.number].key} = {value}"
            for item, value in _chosen(values, AXIS)
            if item.motor == motor
        ]
    lines += ["", "[module]"]
    lines += [f"{GLOBAL_BY_NUMBER[0, item.number].key} = {value}" for item, value in _chosen(values, 0)]
    lines += ["", "[variables]"]
    lines += [f"{item.number} = {value}" for item, value in _chosen(values, 2) if value]
    lines += ["", "[coordinates]"]
    for number in range(1, COORDINATES):
        row = [values.get(Watched(COORDINATE, number, motor)) or 0 for motor in range(MOTORS)]
        if any(row):
            lines.append(f"{number} = {row}")
    return "\n".join(lines) + "\n"


def from_text(text: str, model: int) -> list[Instruction]:
    """The commands that set what a text of `to_tmcl` or `to_toml` says; refuses other texts with a reason."""
    head = next((line for line in text.splitlines() if line.strip()), "")
    toml = head.startswith(("#", "[")) or ("=" in head and not head.startswith("//"))
    instructions = list(_from_toml(text) if toml else _from_tmcl(text))
    kept = [item for item in instructions if not _left_out(item) and _available(item, model)]
    if not kept:
        raise RefusalError("settings", "This text has no settings.")
    return kept


def _chosen(values: Values, bank: int) -> Iterator[tuple[Watched, int]]:
    for item, value in values.items():
        if item.bank == bank and value is not None:
            yield item, value


def _line(item: Watched, value: int) -> str:
    match item.bank:
        case -1:
            row = AXIS_BY_NUMBER[item.number]
            instruction, name = Instruction(_SAP, item.number, item.motor, value), row.name
            name = f"{name} [{row.unit}]" if row.unit else name
        case -2:
            instruction, name = Instruction(_SCO, item.number, item.motor, value), ""
        case bank:
            row = GLOBAL_BY_NUMBER[bank, item.number]
            instruction, name = Instruction(_SGP, item.number, bank, value), row.name if bank == 0 else ""
    text = format_instruction(instruction)
    return f"{text:<24}\t// {name}" if name else text


def _from_tmcl(text: str) -> Iterator[Instruction]:
    from tmcm34x.toolchain.assembler import assemble

    assembly = assemble(text, "settings")
    for item in assembly.diagnostics:
        if item.severity == "error":
            raise RefusalError("settings", f"Line {item.location.line}: {item.text}.")
    for number, instruction in enumerate(assembly.program):
        if instruction.number not in {_SAP, _SGP, _SCO}:
            place = assembly.source_map[number]
            raise RefusalError("settings", f"Line {place.line}: only SAP, SGP and SCO are settings.")
        yield instruction


def _from_toml(text: str) -> Iterator[Instruction]:
    try:
        table: dict[str, Any] = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise RefusalError("settings", f"No TOML: {error}.") from error
    for motor, settings in _table(table, "axis").items():
        for key, value in _table({motor: settings}, motor).items():
            number = AXIS_BY_KEY[key].number if key in AXIS_BY_KEY else _unknown(f"axis.{motor}.{key}")
            yield Instruction(_SAP, number, _number(motor, MOTORS - 1), _value(value))
    for key, value in _table(table, "module").items():
        number = GLOBAL_BY_KEY[key].number if key in GLOBAL_BY_KEY else _unknown(f"module.{key}")
        yield Instruction(_SGP, number, 0, _value(value))
    for number, value in _table(table, "variables").items():
        yield Instruction(_SGP, _number(number, 255), 2, _value(value))
    for number, row in _table(table, "coordinates").items():
        if not isinstance(row, list):
            _unknown(f"coordinates.{number}")
        for motor, value in enumerate(cast(list[Any], row)[:MOTORS]):
            yield Instruction(_SCO, _number(number, COORDINATES - 1), motor, _value(value))


def _table(parent: Mapping[str, Any], name: str) -> dict[str, Any]:
    found: Any = parent.get(name, {})
    return cast(dict[str, Any], found) if isinstance(found, dict) else _unknown(name)


def _unknown(what: str) -> Any:
    raise RefusalError("settings", f"No setting: {what}.")


def _number(text: str, high: int) -> int:
    return int(text) if text.isdecimal() and int(text) <= high else _unknown(text)


def _value(value: Any) -> int:
    if isinstance(value, int) and -(2**31) <= value < 2**31:
        return int(value)
    return _unknown(repr(value))


def _left_out(item: Instruction) -> bool:
    row = GLOBAL_BY_NUMBER.get((item.motor, item.type)) if item.number == _SGP else None
    return row is not None and row.key in LEFT_OUT


def _available(item: Instruction, model: int) -> bool:
    row = AXIS_BY_NUMBER.get(item.type) if item.number == _SAP else None
    return row is None or model in row.models
