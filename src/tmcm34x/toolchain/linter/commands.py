"""Rules about single commands: operands that the module refuses, or that cannot be meant."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import lru_cache
from itertools import chain
from typing import Final, NamedTuple

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
from tmcm34x.toolchain.expressions import Operand as Written
from tmcm34x.toolchain.linter.findings import Findings, field_location, is_number, name_of
from tmcm34x.toolchain.tokens import Token

_MVP: Final = dict(BY_MNEMONIC["MVP"].operands[0].words)
_MOVES: Final = {
    _MVP["ABS"]: (POSITION_MIN, POSITION_MAX),
    _MVP["REL"]: (POSITION_MIN - POSITION_MAX, POSITION_MAX - POSITION_MIN),
    _MVP["COORD"]: (0, COORDINATES - 1),
}
"""Values of MVP that can be right, by mode: an offset may lead from one end of the range to the other."""
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


class Verdict(NamedTuple):
    """What is wrong with an instruction, whatever stands around it.

    field: whose operand has the mistake
    change: title and text of the operand that would be right
    once: reported at the first of all lines that have it
    """

    code: str
    field: Field
    text: str
    change: tuple[str, str] | None = None
    once: bool = False


_Verdicts = Iterator[Verdict]


def check_commands(found: Findings) -> None:
    """Report what is wrong with single commands (W106, W201, W3xx, W403)."""
    count = len(found.assembly.code)
    for code in found.assembly.code:
        row, instruction = code.row, code.instruction
        statement = code.line.statement
        if row is None or instruction is None or not isinstance(statement, parser.WrittenCommand):
            continue
        for verdict in verdicts(row.mnemonic, instruction, found.model):
            _pronounce(found, code, verdict)
        if row.mnemonic in _JUMPS and not 0 <= instruction.value < count:
            text = f"address {instruction.value} is outside of the program, which ends at {count - 1}"
            found.report("W106", field_location(code, "value"), text)
        if len(statement.operands) > len(row.operands):
            _surplus(found, code, instruction, row.spare)
        _fractions(found, code, row, statement)


@lru_cache(maxsize=4096)
def verdicts(mnemonic: str, instruction: Instruction, model: int) -> tuple[Verdict, ...]:
    """What the module will refuse in an instruction, or what cannot be meant."""
    checks = _CHECKS[mnemonic]
    return tuple(
        chain.from_iterable(check(mnemonic, instruction, operand, model) for check, operand in checks)
    )


def _pronounce(found: Findings, code: Code, verdict: Verdict) -> None:
    place = field_location(code, verdict.field)
    if verdict.once:
        found.gather(verdict.code, place, verdict.text)
        return
    fixes: list[Fix] = []
    if verdict.change is not None:
        title, text = verdict.change
        fixes.append(Fix(title, (Edit(place, text),)))
    found.report(verdict.code, place, verdict.text, fixes)


def _motor(name: str, instruction: Instruction, operand: Operand, _model: int) -> _Verdicts:
    motor = instruction.motor
    if motor >= MOTORS and not (name in _SPECIAL_MOTORS and _SPECIAL_MOTORS[name](instruction)):
        yield Verdict("W303", operand.field, f"no motor {motor}; there are 0 to {MOTORS - 1}")


def _axis_parameter(name: str, instruction: Instruction, operand: Operand, model: int) -> _Verdicts:
    row, field = axis_parameters.BY_NUMBER.get(instruction.type), operand.field
    if row is None:
        sister = sisters.axis_parameter(instruction.type)
        hint = "" if sister is None else f": it is of {sister.owner}; a TMCM-34x has {sister.instead}"
        yield Verdict("W305", field, f"no axis parameter {instruction.type}{hint}", once=True)
    elif model not in row.models:
        yield Verdict("W302", field, f"a TMCM-{model} has no parameter {row.number} ({row.name})", once=True)
    elif name in _WRITES_PARAMETER and not row.writable:
        yield Verdict("W304", field, f"parameter {row.number} ({row.name}) is read-only")
    elif name in _STORES_PARAMETER and not row.stored:
        yield Verdict("W306", field, f"parameter {row.number} ({row.name}) is not stored")
    elif name == "SAP":
        yield from _range("W301", instruction, (row.low, row.high), f"parameter {row.number} ({row.name})")


def _global_parameter(name: str, instruction: Instruction, operand: Operand, _model: int) -> _Verdicts:
    number, bank, field = instruction.type, instruction.motor, operand.field
    row = global_parameters.BY_NUMBER.get((bank, number))
    if bank not in (0, 2):
        yield Verdict("W305", "motor", f"no bank {bank}; there are 0 and 2")
    elif row is None:
        yield Verdict("W305", field, f"no parameter {number} in bank {bank}")
    elif name in _WRITES_PARAMETER and not row.writable:
        yield Verdict("W304", field, f"parameter {number} ({row.name}) is read-only")
    elif name in _STORES_PARAMETER and not (bank == 2 or number in _STORED_TABLES):
        reason = "is stored by SGP itself" if row.stored else "is not stored"
        yield Verdict("W306", field, f"parameter {number} ({row.name}) {reason}")
    elif name == "SGP" and row.key in _KEYED and instruction.value not in _KEYED[row.key]:
        wanted = " or ".join(map(str, _KEYED[row.key]))
        text = f"{instruction.value} is none of the values of parameter {number} ({row.name}): {wanted}"
        yield Verdict("W301", "value", text)
    elif name == "SGP":
        yield from _range("W301", instruction, (row.low, row.high), f"parameter {number} ({row.name})")


def _port(name: str, instruction: Instruction, operand: Operand, _model: int) -> _Verdicts:
    bank, port = instruction.motor, instruction.type
    ports = _PORTS[name].get(bank)
    if ports is None:
        yield Verdict("W305", "motor", f"{name} has no bank {bank}")
    elif port not in ports:
        yield Verdict("W305", operand.field, f"no port {port} in bank {bank}")


def _number(name: str, instruction: Instruction, operand: Operand, _model: int) -> _Verdicts:
    if name in ("SAP", "SGP") or (name == "SCO" and instruction.motor == _COPY):
        return
    low, high = operand.low, operand.high
    if name == "SIO" and instruction.type != _ALL_PORTS:
        low, high = 0, 1
    elif name == "MVP":
        low, high = _MOVES[instruction.type]
    what = (
        "the coordinate" if name == "MVP" and instruction.type == _COORD else f"the {operand.name} of {name}"
    )
    yield from _range("W307", instruction, (low, high), what, operand.field)


def _coordinate(_name: str, instruction: Instruction, operand: Operand, _model: int) -> _Verdicts:
    yield from _range("W307", instruction, (operand.low, operand.high), "the coordinate", operand.field)


def _wait(_name: str, instruction: Instruction, _operand: Operand, _model: int) -> _Verdicts:
    if instruction.type in _ENDLESS_WAITS and instruction.value == 0:
        change = f"Wait {_TIMEOUT_TICKS // 100} s at most", str(_TIMEOUT_TICKS)
        yield Verdict("W201", "value", f"WAIT {_ENDLESS_WAITS[instruction.type]} without a time-out", change)


def _calculation(_name: str, instruction: Instruction, _operand: Operand, _model: int) -> _Verdicts:
    if instruction.value == 0 and instruction.type in (_CALC_WORDS["DIV"], _CALC_WORDS["MOD"]):
        yield Verdict("W309", "value", "division by zero")


def _range(
    code: str, instruction: Instruction, limits: tuple[int, int], what: str, field: Field = "value"
) -> _Verdicts:
    low, high = limits
    value = getattr(instruction, field)
    if not low <= value <= high:
        nearest = low if value < low else high
        text = f"{value} is out of range for {what}: {low} to {high}"
        yield Verdict(code, field, text, (f"Change {value} to {nearest}", str(nearest)))


def _surplus(found: Findings, code: Code, instruction: Instruction, spare: tuple[Field, ...]) -> None:
    name = name_of(code)
    ends = name in ("STOP", "RSUB")
    for field in spare[:1] if ends else spare:
        if ends or getattr(instruction, field):
            text = f"{name} ignores its {field} field"
            if name in ("AAP", "AGP", "ACO"):
                text += ": it takes the value from the accumulator"
            place = field_location(code, field)
            found.report("W403", place, text, _without(code, place))


def _without(code: Code, place: Location) -> Iterator[Fix]:
    """The fix that takes an operand away, and all after it, which have no effect either."""
    statement = code.line.statement
    assert isinstance(statement, parser.WrittenCommand)
    before = [o.end for o in statement.operands if o is not None and o.end < place.column]
    start = before[-1] if before else statement.start + len(statement.mnemonic)
    surplus = place._replace(column=start + 1, end=statement.end + 1)
    yield Fix("Remove what has no effect", (Edit(surplus, ""),))


def _fractions(found: Findings, code: Code, row: Command, statement: parser.WrittenCommand) -> None:
    """Numbers that lose a fraction: in a value where they are written with one, elsewhere always."""
    for operand, written in zip(row.operands, statement.operands, strict=False):
        if written is None or operand.kind == "word" or _is_whole(found, written):
            continue
        value = found.exact_value(written, literally=operand.field == "value")
        if value is not None and value != round(value):
            place = field_location(code, operand.field)
            fix = Fix(f"Write {round(value)}", (Edit(place, str(round(value))),))
            text = f"{value:.15g} is rounded to {round(value)} ({operand.name} of {row.mnemonic})"
            found.report("W310", place, text, [fix] if is_number(written) else [])


def _is_whole(found: Findings, operand: Written) -> bool:
    """Whether an operand is a number or a name, and its value a whole number."""
    if type(operand) is not Token:
        return False
    return operand.text.upper() not in found.broken if operand.kind == "name" else operand.text.isdecimal()


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
_Check = Callable[[str, Instruction, Operand, int], _Verdicts]
_BY_KIND: Final[Mapping[str, _Check]] = {
    "motor": _motor, "axis_parameter": _axis_parameter, "global_parameter": _global_parameter, "port": _port,
    "number": _number, "coordinate": _coordinate,
}  # fmt: skip
_BY_MNEMONIC: Final[Mapping[str, _Check]] = {"WAIT": _wait, "CALC": _calculation}
"""What is checked of a command beside its operands."""
_JUMPS: Final = frozenset(row.mnemonic for row in COMMANDS for o in row.operands if o.kind == "address")


def _checks(row: Command) -> Iterator[tuple[_Check, Operand]]:
    yield from ((_BY_KIND[operand.kind], operand) for operand in row.operands if operand.kind in _BY_KIND)
    if row.mnemonic in _BY_MNEMONIC:
        yield _BY_MNEMONIC[row.mnemonic], row.operands[0]


_CHECKS: Final = {row.mnemonic: tuple(_checks(row)) for row in COMMANDS}
