"""What a command, a parameter or a name is, in Markdown."""

from __future__ import annotations

from tmcm34x.tmcl import axis_parameters, global_parameters
from tmcm34x.tmcl.axis_parameters import AxisParameter
from tmcm34x.tmcl.commands import BY_MNEMONIC, SISTER_COMMANDS, Command
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.global_parameters import GlobalParameter
from tmcm34x.toolchain.assembler import Symbol


def parameter_of(row: Command, instruction: Instruction) -> AxisParameter | GlobalParameter | None:
    """The parameter that an instruction reads or writes."""
    for operand in row.operands:
        if operand.kind == "axis_parameter":
            return axis_parameters.BY_NUMBER.get(instruction.type)
        if operand.kind == "global_parameter":
            return global_parameters.BY_NUMBER.get((instruction.motor, instruction.type))
    return None


def command_text(mnemonic: str) -> str:
    """A command in Markdown; empty for what is none."""
    name = mnemonic.upper()
    row = BY_MNEMONIC.get(name)
    if row is None:
        number = SISTER_COMMANDS.get(name)
        return f"**{name}**: command {number} of other TMCL firmware, not on a TMCM-34x" if number else ""
    named = "reads" not in row.where or "accumulator" in row.meaning
    reads = "" if named else " In a program the value goes to the accumulator."
    return f"`{row.syntax}`\n\n**{row.title}**. {row.meaning}{reads}\n\nCommand {row.number}, manual {row.section}"


def parameter_text(row: AxisParameter | GlobalParameter) -> str:
    """A parameter in Markdown: meaning, range, unit, default, choices, access, section."""
    kind = "axis parameter" if isinstance(row, AxisParameter) else f"global parameter, bank {row.bank}"
    unit = f" {row.unit}" if row.unit else ""
    limits = f"{row.low} to {row.high}{unit}, default {row.default}" if row.writable else f"read only{unit}"
    stored = ", kept over power-off" if row.stored else ""
    choices = "".join(f"\n- {number}: {text}" for number, text in row.choices)
    models = ""
    if isinstance(row, AxisParameter) and row.models != axis_parameters.ALL:
        models = f" Only on a TMCM-{' and '.join(map(str, sorted(row.models)))}."
    return (
        f"**{row.name}** ({kind} {row.number})\n\n{row.meaning}{models}\n\n"
        f"{limits}{stored}{choices}\n\nManual {row.section}"
    )


def symbol_text(symbol: Symbol) -> str:
    """A label or constant in Markdown."""
    uses = len(symbol.references)
    used = "never used" if not uses else "used once" if uses == 1 else f"used {uses} times"
    comment = f"\n\n{symbol.comment}" if symbol.comment else ""
    if symbol.kind == "label":
        return f"label **{symbol.name}**: address {symbol.value:g}, {used}{comment}"
    return f"constant **{symbol.name}** = {symbol.value:.15g}, {used}{comment}"
