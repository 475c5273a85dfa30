"""One command as text: `MVP ABS, 1, 90000`, both ways.

For everything that shows or takes single commands: the ASCII interface, direct mode, logs, disassembly.
Source files with labels, constants and expressions are the tool chain's business.

Source: manual 6.5 (grammar), 6.6.1 (blanks and commas alike in the ASCII interface).
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from tmcm34x.tmcl.commands import BY_MNEMONIC, BY_NUMBER, SISTER_COMMANDS, Command, Field, Operand
from tmcm34x.tmcl.datagram import Instruction

_NUMBER: Final = re.compile(r"([+-]?)(?:(\d+)|\$([0-9a-f]+)|%([01]+))\Z", re.IGNORECASE)
_NO_LABELS: Final[Mapping[int, str]] = MappingProxyType({})
_FIELDS: Final[tuple[Field, ...]] = ("type", "motor", "value")


class MnemonicError(ValueError):
    """A line that is no command; the text says why.

    known: whether the mnemonic itself was one
    word: the word of the line that is wrong; empty where none is
    """

    def __init__(self, message: str, *, known: bool = True, word: str = "") -> None:
        super().__init__(message)
        self.known = known
        self.word = word


def format_instruction(instruction: Instruction, labels: Mapping[int, str] = _NO_LABELS) -> str:
    """`instruction` as source text; unused fields are shown only where they are not 0.

    labels: names of addresses, shown instead of their numbers as the targets of jumps

    A number that is no command with a mnemonic becomes `<number> <type>, <motor>, <value>`, which
    `parse_instruction` takes back.
    """
    row = BY_NUMBER.get(instruction.number)
    if row is None or not row.mnemonic:
        return f"{instruction.number} {instruction.type}, {instruction.motor}, {instruction.value}"
    texts = [
        _format_operand(operand, getattr(instruction, operand.field), labels) for operand in row.operands
    ]
    if any(text is None for text in texts):
        return f"{instruction.number} {instruction.type}, {instruction.motor}, {instruction.value}"
    spare = [getattr(instruction, field) for field in row.spare]
    while spare and spare[-1] == 0:
        spare.pop()
    operands = [text for text in texts if text is not None] + [str(value) for value in spare]
    while operands and row.operands and not row.operands[0].required and operands[-1] == "0":
        operands.pop()
    return f"{row.mnemonic} {', '.join(operands)}".strip()


def parse_instruction(line: str) -> Instruction:
    """The command in `line`: a mnemonic or number, then operands with commas or blanks between.

    Raises `MnemonicError`.  Ranges are not checked here: the module answers a wrong value with a status.
    """
    words = line.replace(",", " ").split()
    if not words:
        raise MnemonicError("no command", known=False)
    name, operands = words[0].upper(), words[1:]
    if name.isdecimal():
        values = [_parse_number(text) for text in operands]
        return _build(int(name), dict(zip(_FIELDS, values, strict=False)))
    row = BY_MNEMONIC.get(name)
    if row is None:
        hint = " (of another firmware)" if name in SISTER_COMMANDS else ""
        raise MnemonicError(f"unknown command {words[0]}{hint}", known=False, word=words[0])
    return _build(row.number, _parse_operands(row, operands))


def _parse_operands(row: Command, texts: list[str]) -> dict[Field, int]:
    required = sum(operand.required for operand in row.operands)
    if len(texts) < required:
        raise MnemonicError(f"{row.mnemonic} needs {required} operands: {row.syntax}")
    if len(texts) > len(row.operands) + len(row.spare):
        raise MnemonicError(f"{row.mnemonic} has too many operands: {row.syntax}")
    fields: dict[Field, int] = {}
    for operand, text in zip(row.operands, texts, strict=False):
        fields[operand.field] = _parse_operand(operand, text)
    for field, text in zip(row.spare, texts[len(row.operands) :], strict=False):
        fields[field] = _parse_number(text)
    return fields


def _parse_operand(operand: Operand, text: str) -> int:
    for word, number in operand.words:
        if word == text.upper():
            return number
    return _parse_number(text)


def _parse_number(text: str) -> int:
    match = _NUMBER.match(text)
    if match is None:
        raise MnemonicError(f"not a number: {text}", word=text)
    sign, decimal, hexadecimal, binary = match.groups()
    value = int(decimal) if decimal else int(hexadecimal, 16) if hexadecimal else int(binary, 2)
    return -value if sign == "-" else value


def _format_operand(operand: Operand, value: int, labels: Mapping[int, str]) -> str | None:
    if operand.kind == "address":
        return labels.get(value, str(value))
    if operand.kind != "word":
        return f"${value:x}" if operand.kind == "motor" and value > 9 else str(value)
    return next((word for word, number in operand.words if number == value), None)


def _build(number: int, fields: dict[Field, int]) -> Instruction:
    type_, motor, value = (fields.get(field, 0) for field in _FIELDS)
    if not (0 <= number <= 255 and 0 <= type_ <= 255 and 0 <= motor <= 255):
        raise MnemonicError("command, type and motor are 0..255")
    if not -(2**31) <= value < 2**32:
        raise MnemonicError("the value has 32 bits")
    return Instruction(number, type_, motor, value - 2**32 if value >= 2**31 else value)
