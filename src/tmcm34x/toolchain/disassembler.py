"""Instructions to source text that assembles to the same instructions again.

Jump targets become labels, words come back (ABS, TICKS, ZE), fields that a command does not use are shown as
spare operands where they are not 0.  What has no source form, because its opcode or a word's number is
unknown, becomes a line `//! DATA number, type, motor, value`: a comment for other assemblers, an instruction
for ours (fidelity TOOL-8).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from tmcm34x.tmcl import axis_parameters, global_parameters
from tmcm34x.tmcl.commands import BY_NUMBER, SISTER_COMMANDS, Operand
from tmcm34x.tmcl.datagram import END_MARK, Instruction
from tmcm34x.tmcl.mnemonic import format_instruction

_CALLS: Final = frozenset(row.number for row in BY_NUMBER.values() if row.mnemonic == "CSUB")
_JUMPS: Final = frozenset(row.number for row in BY_NUMBER.values() if row.mnemonic in ("JA", "JC")) | _CALLS
_MNEMONIC_COLUMN: Final = 8
_COMMENT_COLUMN: Final = 36
_SISTERS: Final = {number: name for name, number in SISTER_COMMANDS.items()}


def disassemble(program: Sequence[Instruction], *, explain: bool = True) -> str:
    """Source text for `program`.

    explain: names the parameter that a command reads or writes in a comment
    """
    labels = jump_labels(program)
    lines: list[str] = []
    for address, instruction in enumerate(program):
        label = f"{labels[address]}:" if address in labels else ""
        text = f"{label:<{_MNEMONIC_COLUMN - 1}} {source_form(instruction, labels)}"
        remark = explanation(instruction) if explain else ""
        lines.append(f"{text:<{_COMMENT_COLUMN - 1}} // {remark}" if remark else text)
    if len(program) in labels:
        lines.append(f"{labels[len(program)]}:")
    return "".join(f"{line}\n" for line in lines)


def up_to_end_mark(program: Sequence[Instruction]) -> tuple[Instruction, ...]:
    """The part of a memory before the first opcode 0, which marks the end of a download."""
    for address, instruction in enumerate(program):
        if instruction.number == END_MARK.number:
            return tuple(program[:address])
    return tuple(program)


def jump_labels(program: Sequence[Instruction]) -> dict[int, str]:
    """A label for each address that a jump or call goes to, the end of the program included."""
    calls = {i.value for i in program if i.number in _CALLS}
    targets = {i.value for i in program if i.number in _JUMPS and 0 <= i.value <= len(program)}
    return {address: f"{'Sub' if address in calls else 'L'}{address}" for address in sorted(targets)}


def source_form(instruction: Instruction, labels: dict[int, str]) -> str:
    """One instruction as the assembler takes it, with its target's name from `labels`."""
    row = BY_NUMBER.get(instruction.number)
    text = format_instruction(instruction, labels)
    if row is None or not row.mnemonic or text[0].isdigit():
        return "//! DATA " + ", ".join(map(str, instruction))
    return text


def explanation(instruction: Instruction) -> str:
    """What the parameter operand of an instruction means, or the name of a command of sister firmware; else empty."""
    row = BY_NUMBER.get(instruction.number)
    sister = _SISTERS.get(instruction.number)
    if sister is not None:
        return f"{sister} of other firmware"
    for operand in row.operands if row is not None else ():
        name = _parameter_name(operand, instruction)
        if name:
            return name
    return ""


def _parameter_name(operand: Operand, instruction: Instruction) -> str:
    if operand.kind == "axis_parameter":
        parameter = axis_parameters.BY_NUMBER.get(instruction.type)
        return parameter.name if parameter else "unknown axis parameter"
    if operand.kind == "global_parameter":
        parameter = global_parameters.BY_NUMBER.get((instruction.motor, instruction.type))
        return parameter.name if parameter else "unknown global parameter"
    return ""
