"""What the word at a place means, in Markdown."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from tmcm34x.editor.analysis.program import Analysis, TextPosition
from tmcm34x.editor.analysis.texts import command_text, parameter_of, parameter_text, symbol_text
from tmcm34x.editor.analysis.values import value_text
from tmcm34x.tmcl.commands import Command
from tmcm34x.tmcl.commands import Operand as OperandRow
from tmcm34x.tmcl.datagram import Instruction, pack_record
from tmcm34x.toolchain import parser
from tmcm34x.toolchain.assembler import Code
from tmcm34x.toolchain.diagnostics import Location
from tmcm34x.toolchain.explanations import page, title
from tmcm34x.toolchain.expressions import FUNCTIONS, Operand
from tmcm34x.toolchain.reference import word_meaning
from tmcm34x.toolchain.tokens import Token


class Hover(NamedTuple):
    """A text in Markdown about the word at a location."""

    text: str
    location: Location


def hover(program: Analysis, place: TextPosition) -> Hover | None:
    """What the word at a place means."""
    token = program.token_at(place)
    parsed = program.line_at(place.file, place.line)
    if token is None or parsed is None:
        return None
    texts = [*_hover_texts(program, place.file, place.line, token, parsed), *_explanations(program, place)]
    text = "\n\n---\n\n".join(filter(None, texts))
    return Hover(text, Location(place.file, place.line + 1, token.start + 1, token.end + 1)) if text else None


def _explanations(program: Analysis, place: TextPosition) -> Iterator[str]:
    """The pages of the diagnostics at a place."""
    codes = [
        item.code
        for item in program.findings
        if item.location[:2] == (place.file, place.line + 1)
        and item.location.column - 1 <= place.column < item.location.end
    ]
    for code in dict.fromkeys(codes):
        yield f"**{code}** {title(code)}\n\n{page(code)}"


def _hover_texts(
    program: Analysis, file: str, line: int, token: Token, parsed: parser.SourceLine
) -> Iterator[str]:
    statement = parsed.statement
    in_comment = parsed.comment is not None and token.start >= parsed.comment
    if isinstance(statement, parser.Include):
        included = program.assembly.includes.get((file, line + 1))
        if included is not None and not in_comment:
            yield f"includes `{included}`"
    elif in_comment and not isinstance(statement, parser.Data):
        return
    elif isinstance(statement, parser.WrittenCommand) and token.start == statement.start:
        yield command_text(statement.mnemonic)
        entry = program.codes.get((file, line))
        if entry is not None and entry[1].instruction is not None:
            yield _address_text(entry[0], entry[1].instruction)
    else:
        yield from _name_texts(program, file, line, token, statement)


def _name_texts(
    program: Analysis, file: str, line: int, token: Token, statement: parser.Statement | None
) -> Iterator[str]:
    """About a name or number: the symbol that it is, the operand that it is part of, the function that it calls."""
    symbol = program.symbol_at(TextPosition(file, line, token.start))
    if symbol is not None:
        yield symbol_text(symbol[0])
    entry = program.codes.get((file, line))
    if entry is not None and isinstance(statement, parser.WrittenCommand) and entry[1].row is not None:
        index = _operand_index(statement.operands, token)
        if index is not None:
            yield from _operand_texts(program, entry, index, token)
            return
    if symbol is None:
        yield from _function_texts(token)


def _function_texts(token: Token) -> Iterator[str]:
    function = FUNCTIONS.get(token.text.upper())
    if function is not None:
        yield f"**{token.text.upper()}(x)**: {function.meaning}"


def _operand_texts(program: Analysis, entry: tuple[int, Code], index: int, token: Token) -> Iterator[str]:
    address, code = entry
    row, instruction = code.row, code.instruction
    assert row is not None
    yield from _function_texts(token)
    if index >= len(row.operands):
        yield "surplus number: goes to a field that the command does not use"
        return
    operand = row.operands[index]
    if operand.kind == "word":
        meaning = word_meaning(row.mnemonic, token.text.upper())
        yield f"**{token.text.upper()}** ({operand.name} of {row.mnemonic}){': ' + meaning if meaning else ''}"
    elif instruction is not None:
        yield operand_text(program, address, row, operand, instruction)


def operand_text(
    program: Analysis, address: int, row: Command, operand: OperandRow, instruction: Instruction
) -> str:
    """What an operand's number means in its instruction, in Markdown."""
    number = getattr(instruction, operand.field)
    parameter = parameter_of(row, instruction)
    if operand.kind in ("axis_parameter", "global_parameter"):
        if parameter is None:
            return f"{operand.name} {number}: not in this firmware"
        return parameter_text(parameter)
    if operand.kind == "address":
        return f"address {number}"
    unit = value_text(program, address, row, instruction) if operand.field == "value" else ""
    text = f"**{operand.name}** of {row.mnemonic}: {number}"
    if unit:
        text += f" = {unit}"
    if operand.field == "value" and parameter is not None:
        choice = dict(parameter.choices).get(number)
        text += f" ({choice})" if choice else ""
        text += "\n\n" + parameter_text(parameter)
    elif operand.kind == "number":
        text += f", range {operand.low} to {operand.high}"
    return text


def _operand_index(operands: Sequence[Operand | None], token: Token) -> int | None:
    for index, operand in enumerate(operands):
        if operand is not None and operand.start <= token.start < operand.end:
            return index
    return None


def _address_text(address: int, instruction: Instruction) -> str:
    return f"address {address}: `{pack_record(instruction).hex(' ')}`"
