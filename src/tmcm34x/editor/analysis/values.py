"""Numbers of a program in physical units, and the hints that an editor shows between the characters of a line."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from typing import Final, Literal, NamedTuple

from tmcm34x.editor.analysis.program import Analysis
from tmcm34x.editor.analysis.texts import parameter_of
from tmcm34x.tmcl import axis_parameters
from tmcm34x.tmcl.axis_parameters import AxisParameter
from tmcm34x.tmcl.commands import MOTORS, Command
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.units import acceleration_hz_s, speed_hz
from tmcm34x.toolchain import parser
from tmcm34x.toolchain.assembler import Code
from tmcm34x.toolchain.tokens import Token

HintKind = Literal["address", "parameter", "value"]
_RESOLUTION, _RAMP_DIVISOR, _PULSE_DIVISOR = (
    axis_parameters.BY_KEY[key] for key in ("microstep_resolution", "ramp_divisor", "pulse_divisor")
)
_DIVISORS: Final = (_RESOLUTION, _RAMP_DIVISOR, _PULSE_DIVISOR)
_SPEED_UNIT: Final = "velocity units"
_ACCELERATION_UNIT: Final = "acceleration units"
_TICKS_A_SECOND: Final = 100


class Hint(NamedTuple):
    """A text shown between the characters of a line."""

    line: int
    column: int
    kind: HintKind
    text: str


def value_text(program: Analysis, address: int, row: Command, instruction: Instruction) -> str:
    """The value field in physical units: a speed, an acceleration, a time; empty where it is none."""
    parameter = parameter_of(row, instruction)
    motor, value = instruction.motor, instruction.value
    unit = ""
    if row.mnemonic in ("ROR", "ROL"):
        unit = _SPEED_UNIT
    elif row.mnemonic == "SAP" and isinstance(parameter, AxisParameter):
        unit = parameter.unit
    if unit in (_SPEED_UNIT, _ACCELERATION_UNIT) and motor < MOTORS and 0 < abs(value) < 2048:
        resolution, ramp, pulse = (_setting(program, address, motor, row) for row in _DIVISORS)
        if unit == _SPEED_UNIT:
            rate = speed_hz(value, pulse)
            return f"{rate:,.0f} microsteps/s, {rate / 2**resolution:,.1f} steps/s"
        rate = acceleration_hz_s(value, pulse, ramp)
        return f"{rate:,.0f} microsteps/s², {rate / 2**resolution:,.1f} steps/s²"
    if row.mnemonic == "WAIT" and value > 0:
        return f"{value / _TICKS_A_SECOND:g} s"
    return f"{value / _TICKS_A_SECOND:g} s" if unit == "10 ms" and value > 0 else ""


def _setting(program: Analysis, address: int, motor: int, parameter: AxisParameter) -> int:
    """The value that the program last gave to a parameter above `address`, else its default."""
    settings = program.set_values.get((parameter.number, motor), [])
    place = bisect_right(settings, (address, 2**31))
    value = settings[place - 1][1] if place else settings[0][1] if settings else parameter.default
    return value if parameter.low <= value <= parameter.high else parameter.default


def hints(program: Analysis, file: str, first_line: int, last_line: int) -> list[Hint]:
    """Addresses, names of parameters beside their numbers, values in physical units.

    What the comment of a line already says is not said again.
    """
    hints: list[Hint] = []
    for line in range(max(0, first_line), min(last_line + 1, len(program.assembly.lines[file]))):
        entry = program.codes.get((file, line))
        if entry is None:
            continue
        address, code = entry
        statement = code.line.statement
        if not isinstance(statement, parser.WrittenCommand | parser.Data):
            continue
        hints.append(Hint(line, statement.start, "address", f"{address:04}"))
        if isinstance(statement, parser.WrittenCommand):
            hints += _operand_hints(program, line, entry, statement)
    return hints


def _operand_hints(
    program: Analysis, line: int, entry: tuple[int, Code], statement: parser.WrittenCommand
) -> Iterator[Hint]:
    address, code = entry
    row, instruction = code.row, code.instruction
    if row is None or instruction is None:
        return
    comment = _comment(program, code)
    for operand, written in zip(row.operands, statement.operands, strict=False):
        assert written is not None
        if operand.kind in ("axis_parameter", "global_parameter"):
            parameter = parameter_of(row, instruction)
            if (
                parameter is not None
                and isinstance(written, Token)
                and written.kind == "number"
                and parameter.name not in comment
            ):
                yield Hint(line, written.end, "parameter", parameter.name)
        elif operand.field == "value":
            text = value_text(program, address, row, instruction).split(", ")[-1]
            if text and text not in comment:
                yield Hint(line, written.end, "value", text)


def _comment(program: Analysis, code: Code) -> str:
    """The comment of the line of an instruction."""
    start = code.line.comment
    return "" if start is None else program.text(code.file, code.number - 1)[start:]
