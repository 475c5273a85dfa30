"""Rules about single commands: operands that the module refuses, or that cannot be meant."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Final

from tmcm34x.tmcl import axis_parameters, global_parameters
from tmcm34x.tmcl.commands import (
    BY_MNEMONIC,
    COMMANDS,
    COORDINATES,
    MOTORS,
    POSITION_MAX,
    POSITION_MIN,
    Command,
    Field,
    Operand,
)
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.toolchain import parser, sisters
from tmcm34x.toolchain.assembler import Code
from tmcm34x.toolchain.diagnostics import Edit, Fix, Location
from tmcm34x.toolchain.linter.findings import Findings, field_location, is_number, name_of
from tmcm34x.toolchain.tokens import Token

_MVP: Final = dict(BY_MNEMONIC["MVP"].operands[0].words)
_MOVES: Final = {
    _MVP["ABS"]: (POSITION_MIN, POSITION_MAX),
    _MVP["REL"]: (POSITION_MIN - POSITION_MAX, POSITION_MAX - POSITION_MIN),
    _MVP["COORD"]: (0, COORDINATES - 1),
}
"""Values of MVP that can be right, by mode: an offset may lead from one end of the range to the other."""
_SPARE: Final = {row.mnemonic: row.spare for row in COMMANDS}
_WAIT_WORDS: Final = dict(BY_MNEMONIC["WAIT"].operands[0].words)
_CALC_WORDS: Final = dict(BY_MNEMONIC["CALC"].operands[0].words)
_COORD: Final = dict(BY_MNEMONIC["MVP"].operands[0].words)["COORD"]
_WRITES_PARAMETER: Final = frozenset({"SAP", "AAP", "SGP", "AGP"})
_STORES_PARAMETER: Final = frozenset({"STAP", "RSAP", "STGP", "RSGP"})
_STORED_TABLES: Final = frozenset({7, 23})
"""Bank 0 parameters that STGP and RSGP take for a whole table (fidelity TOOL-9)."""
_TIMEOUT_TICKS: Final = 3000
"""The time-out that the fix for W201 proposes: 30 s."""
_KEYED: Final[Mapping[str, tuple[int, ...]]] = {"eeprom_lock": (1234, 4321)}
"""Global parameters that take some values alone: to lock and to unlock."""
_ALL_MOTORS: Final = 7
_COPY: Final = 255
"""Motor field of SCO and GCO that copies between RAM and EEPROM."""
_ALL_PORTS: Final = 255
_SHUTDOWN_PORT: Final = 10
_INPUTS, _ANALOGUE, _OUTPUTS = range(3)
_PORTS: Final = {
    "SIO": {_OUTPUTS: (*range(8), _ALL_PORTS)},
    "GIO": {
        _INPUTS: (*range(8), _SHUTDOWN_PORT, _ALL_PORTS), _ANALOGUE: tuple(range(8)),
        _OUTPUTS: (*range(8), _ALL_PORTS),
    },
}  # fmt: skip
"""Ports by command and bank (manual 6.7.14, 6.7.15)."""


def check_commands(found: Findings) -> None:
    """Report what is wrong with single commands (W201, W3xx, W403)."""
    for code in found.assembly.code:
        row, instruction = code.row, code.instruction
        if row is None or instruction is None:
            continue
        for operand in row.operands:
            check = _BY_KIND.get(operand.kind)
            if check is not None:
                check(found, code, instruction, operand)
        more = _BY_MNEMONIC.get(row.mnemonic)
        if more is not None:
            more(found, code, instruction)
        spare = _SPARE[row.mnemonic]
        if spare:
            _surplus(found, code, instruction, spare)
        _fractions(found, code, row)


def _motor(found: Findings, code: Code, instruction: Instruction, operand: Operand) -> None:
    motor, name = instruction.motor, name_of(code)
    if motor < MOTORS or (name in _SPECIAL_MOTORS and _SPECIAL_MOTORS[name](instruction)):
        return
    found.report(
        "W303", field_location(code, operand.field), f"no motor {motor}; there are 0 to {MOTORS - 1}"
    )


def _axis_parameter(found: Findings, code: Code, instruction: Instruction, operand: Operand) -> None:
    place, name = field_location(code, operand.field), name_of(code)
    row = axis_parameters.BY_NUMBER.get(instruction.type)
    if row is None:
        foreign = sisters.axis_parameter(instruction.type)
        hint = "" if foreign is None else f": it is of {foreign.owner}; a TMCM-34x has {foreign.instead}"
        found.gather("W305", place, f"no axis parameter {instruction.type}{hint}")
    elif found.model not in row.models:
        found.gather("W302", place, f"a TMCM-{found.model} has no parameter {row.number} ({row.name})")
    elif name in _WRITES_PARAMETER and not row.writable:
        found.report("W304", place, f"parameter {row.number} ({row.name}) is read-only")
    elif name in _STORES_PARAMETER and not row.stored:
        found.report("W306", place, f"parameter {row.number} ({row.name}) is not stored")
    elif name == "SAP":
        _range(found, "W301", code, (row.low, row.high), f"parameter {row.number} ({row.name})")


def _global_parameter(found: Findings, code: Code, instruction: Instruction, operand: Operand) -> None:
    place, name = field_location(code, operand.field), name_of(code)
    number, bank = instruction.type, instruction.motor
    row = global_parameters.BY_NUMBER.get((bank, number))
    if bank not in (0, 2):
        found.report("W305", field_location(code, "motor"), f"no bank {bank}; there are 0 and 2")
    elif row is None:
        found.report("W305", place, f"no parameter {number} in bank {bank}")
    elif name in _WRITES_PARAMETER and not row.writable:
        found.report("W304", place, f"parameter {number} ({row.name}) is read-only")
    elif name in _STORES_PARAMETER and not (bank == 2 or number in _STORED_TABLES):
        reason = "is stored by SGP itself" if row.stored else "is not stored"
        found.report("W306", place, f"parameter {number} ({row.name}) {reason}")
    elif name == "SGP" and row.key in _KEYED and instruction.value not in _KEYED[row.key]:
        wanted = " or ".join(map(str, _KEYED[row.key]))
        text = f"{instruction.value} is none of the values of parameter {number} ({row.name}): {wanted}"
        found.report("W301", field_location(code, "value"), text)
    elif name == "SGP":
        _range(found, "W301", code, (row.low, row.high), f"parameter {number} ({row.name})")


def _port(found: Findings, code: Code, instruction: Instruction, operand: Operand) -> None:
    name, bank, port = name_of(code), instruction.motor, instruction.type
    ports = _PORTS[name].get(bank)
    if ports is None:
        found.report("W305", field_location(code, "motor"), f"{name} has no bank {bank}")
    elif port not in ports:
        found.report("W305", field_location(code, operand.field), f"no port {port} in bank {bank}")


def _number(found: Findings, code: Code, instruction: Instruction, operand: Operand) -> None:
    name = name_of(code)
    if name in ("SAP", "SGP"):
        return
    low, high = operand.low, operand.high
    if name == "SIO" and instruction.type != _ALL_PORTS:
        low, high = 0, 1
    elif name == "SCO" and instruction.motor == _COPY:
        return
    elif name == "MVP":
        low, high = _MOVES[instruction.type]
    _range(found, "W307", code, (low, high), f"the {operand.name} of {name}", field=operand.field)


def _coordinate(found: Findings, code: Code, _instruction: Instruction, operand: Operand) -> None:
    _range(found, "W307", code, (operand.low, operand.high), "the coordinate", field=operand.field)


def _address(found: Findings, code: Code, instruction: Instruction, operand: Operand) -> None:
    count = len(found.assembly.code)
    if not 0 <= instruction.value < count:
        text = f"address {instruction.value} is outside of the program, which ends at {count - 1}"
        found.report("W106", field_location(code, operand.field), text)


def _surplus(found: Findings, code: Code, instruction: Instruction, spare: tuple[Field, ...]) -> None:
    statement = code.line.statement
    ends = (
        name_of(code) in ("STOP", "RSUB")
        and isinstance(statement, parser.Command)
        and bool(statement.operands)
    )
    for field in spare[:1] if ends else spare:
        if ends or getattr(instruction, field):
            name = name_of(code)
            text = f"{name} ignores its {field} field"
            if name in ("AAP", "AGP", "ACO"):
                text += ": it takes the value from the accumulator"
            place = field_location(code, field)
            found.report("W403", place, text, _without(code, place))


def _without(code: Code, place: Location) -> Iterator[Fix]:
    """The fix that takes an operand away, and all after it, which have no effect either."""
    statement = code.line.statement
    assert isinstance(statement, parser.Command)
    before = [o.end for o in statement.operands if o is not None and o.end < place.column]
    start = before[-1] if before else statement.start + len(statement.mnemonic)
    surplus = place._replace(column=start + 1, end=statement.end + 1)
    yield Fix("Remove what has no effect", (Edit(surplus, ""),))


def _wait(found: Findings, code: Code, instruction: Instruction) -> None:
    if instruction.type in _ENDLESS_WAITS and instruction.value == 0:
        place = field_location(code, "value")
        fix = Fix(f"Wait {_TIMEOUT_TICKS // 100} s at most", (Edit(place, str(_TIMEOUT_TICKS)),))
        found.report("W201", place, f"WAIT {_ENDLESS_WAITS[instruction.type]} without a time-out", [fix])


def _calculation(found: Findings, code: Code, instruction: Instruction) -> None:
    if instruction.value == 0 and instruction.type in (_CALC_WORDS["DIV"], _CALC_WORDS["MOD"]):
        found.report("W309", field_location(code, "value"), "division by zero")


def _fractions(found: Findings, code: Code, row: Command) -> None:
    """Numbers that lose a fraction: in a value where they are written with one, elsewhere always."""
    statement = code.line.statement
    if not isinstance(statement, parser.Command):
        return
    for operand, written in zip(row.operands, statement.operands, strict=False):
        if (
            written is None
            or operand.kind == "word"
            or (isinstance(written, Token) and written.text.isdecimal())
        ):
            continue
        value = found.exact_value(written, literally=operand.field == "value")
        if value is not None and value != round(value):
            place = field_location(code, operand.field)
            fix = Fix(f"Write {round(value)}", (Edit(place, str(round(value))),))
            text = f"{value:.15g} is rounded to {round(value)} ({operand.name} of {row.mnemonic})"
            found.report("W310", place, text, [fix] if is_number(written) else [])


def _range(
    found: Findings, code: str, where: Code, limits: tuple[int, int], what: str, *, field: Field = "value"
) -> None:
    low, high = limits
    value = getattr(where.instruction, field)
    if low <= value <= high:
        return
    place = field_location(where, field)
    nearest = low if value < low else high
    fix = Fix(f"Change {value} to {nearest}", (Edit(place, str(nearest)),))
    found.report(code, place, f"{value} is out of range for {what}: {low} to {high}", [fix])


def _several_motors(instruction: Instruction) -> bool:
    mask = instruction.motor & 0x3F
    return instruction.type == _COORD and instruction.motor >= 0x40 and 0 < mask <= _ALL_MOTORS


_SPECIAL_MOTORS: Final[Mapping[str, Callable[[Instruction], bool]]] = {
    "MVP": _several_motors,
    "CCO": lambda instruction: instruction.motor == _ALL_MOTORS,
    "SCO": lambda instruction: instruction.motor == _COPY,
    "GCO": lambda instruction: instruction.motor == _COPY,
    "WAIT": lambda instruction: instruction.type == _WAIT_WORDS["TICKS"],
}
"""What else than 0 to 2 the motor field of a command may hold."""
_ENDLESS_WAITS: Final = {_WAIT_WORDS[word]: word for word in ("REFSW", "LIMSW", "RFS")}
_Check = Callable[[Findings, Code, Instruction, Operand], None]
_BY_KIND: Final[Mapping[str, _Check]] = {
    "motor": _motor, "axis_parameter": _axis_parameter, "global_parameter": _global_parameter, "port": _port,
    "number": _number, "coordinate": _coordinate, "address": _address,
}  # fmt: skip
_BY_MNEMONIC: Final[Mapping[str, Callable[[Findings, Code, Instruction], None]]] = {
    "WAIT": _wait,
    "CALC": _calculation,
}
