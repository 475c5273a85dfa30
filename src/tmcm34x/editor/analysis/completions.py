"""What may stand at a place: completions, and how the command there is written."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from typing import Final, Literal, NamedTuple

from tmcm34x.editor.analysis.program import Analysis, TextPosition
from tmcm34x.editor.analysis.texts import command_text, parameter_of, parameter_text
from tmcm34x.tmcl.axis_parameters import AXIS_PARAMETERS, AxisParameter
from tmcm34x.tmcl.commands import BY_MNEMONIC, COMMANDS, MOTORS, Command
from tmcm34x.tmcl.commands import Operand as OperandRow
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.global_parameters import GLOBAL_PARAMETERS, GlobalParameter
from tmcm34x.toolchain import parser
from tmcm34x.toolchain.expressions import FUNCTIONS
from tmcm34x.toolchain.reference import word_meaning
from tmcm34x.toolchain.structure import MODEL
from tmcm34x.toolchain.tokens import BLANKS

CompletionKind = Literal[
    "command", "word", "constant", "label", "function", "parameter", "number", "directive"
]
WORD: Final = re.compile(r"(?:[$%#]|(?<![\w.])\.)?\w*\Z", re.ASCII)
"""What is written of a word before the cursor; `#` and the point of a local label are a part of it."""
_WRITES: Final = frozenset({"SAP", "SGP", "AAP", "AGP"})
_STORES: Final = frozenset({"STAP", "RSAP"})


class Completion(NamedTuple):
    """A proposal.  `insert` is the text to put in the place of the word before the cursor."""

    label: str
    kind: CompletionKind
    insert: str
    detail: str = ""
    documentation: str = ""
    filter: str = ""


class Signature(NamedTuple):
    """How a command is written; `active` is the operand at the cursor, `parameters` texts of `label`."""

    label: str
    documentation: str
    parameters: tuple[tuple[str, str], ...]
    active: int


Where = Literal["head", "operand", "expression", "condition", "none"]
"""What part of a line is being written."""


class Cursor(NamedTuple):
    """Where in a line the cursor is.

    row: of the command whose operand is being written; None at the place of a command
    operand: the number of this operand, from 0
    before: the operands before it, as text
    word: what is written of the word at the cursor, and `start` its column
    """

    place: Where
    row: Command | None
    operand: int
    before: tuple[str, ...]
    word: str
    start: int


def completions(program: Analysis, place: TextPosition) -> list[Completion]:
    """What may stand at a place."""
    cursor = cursor_at(program.text(place.file, place.line), place.column)
    if cursor.place == "head":
        return [*command_completions(), *_DIRECTIVES]
    if cursor.place == "condition":
        return [_MODEL, *_symbol_completions(program, "constant"), *function_completions()]
    if cursor.place == "expression":
        return [*_symbol_completions(program, "constant"), *function_completions()]
    if cursor.place == "none" or cursor.row is None or cursor.operand >= len(cursor.row.operands):
        return []
    if cursor.row.operands[cursor.operand].kind == "address":
        return [*_local_labels(program, place), *_symbol_completions(program, "label")]
    return list(_operand_completions(program, cursor, cursor.row))


def _operand_completions(program: Analysis, cursor: Cursor, row: Command) -> Iterator[Completion]:
    operand = row.operands[cursor.operand]
    if operand.kind == "word":
        for word, number in operand.words:
            yield Completion(word, "word", word, f"{number}", word_meaning(row.mnemonic, word))
        return
    if operand.kind == "axis_parameter":
        yield from parameter_completions(_axis_parameters(program, row))
    elif operand.kind == "global_parameter":
        yield from parameter_completions(_global_parameters(row))
    elif operand.kind == "motor":
        for motor in range(MOTORS):
            yield Completion(str(motor), "number", str(motor), f"motor {motor}")
    elif operand.kind == "bank":
        for bank, meaning in _banks(row):
            yield Completion(str(bank), "number", str(bank), meaning)
    elif operand.field == "value" and row.mnemonic in ("SAP", "SGP"):
        for number, meaning in _choices(program, row, cursor.before):
            yield Completion(f"{number} {meaning}", "number", str(number), filter=f"{number} {meaning}")
    yield from _symbol_completions(program, "constant")
    yield from function_completions()


def _axis_parameters(program: Analysis, row: Command) -> Iterator[AxisParameter]:
    for parameter in AXIS_PARAMETERS:
        wrong = row.mnemonic in _WRITES and not parameter.writable
        wrong = wrong or (row.mnemonic in _STORES and not parameter.stored)
        if not wrong and program.model in parameter.models:
            yield parameter


def _choices(program: Analysis, row: Command, before: Sequence[str]) -> Sequence[tuple[int, str]]:
    numbers = [int(text) for text in before if text.isdecimal() and len(text) < 9]
    if len(numbers) != len(before) or len(numbers) < 2:
        return ()
    parameter = parameter_of(row, Instruction(row.number, numbers[0], numbers[1]))
    return parameter.choices if parameter is not None else ()


def _symbol_completions(program: Analysis, kind: Literal["label", "constant"]) -> Iterator[Completion]:
    for symbol in program.assembly.symbols.values():
        if symbol.kind == kind:
            detail = f"address {symbol.value:g}" if kind == "label" else f"= {symbol.value:.15g}"
            yield Completion(symbol.name, kind, symbol.name, detail, symbol.comment)


def _local_labels(program: Analysis, place: TextPosition) -> Iterator[Completion]:
    """The local labels of the routine around a place."""
    routine = 0
    found: list[str] = []
    for index, text in enumerate(program.assembly.sources.get(place.file, ())):
        local = _LOCAL.match(text)
        if local is not None:
            found.append(local[1])
        elif _ROUTINE.match(text):
            if index > place.line:
                break
            routine = len(found)
    for name in found[routine:]:
        yield Completion(name, "label", name, "local label")


def signature(program: Analysis, place: TextPosition) -> Signature | None:
    """How the command around a place is written."""
    cursor = cursor_at(program.text(place.file, place.line), place.column)
    row = cursor.row
    if row is None or cursor.place != "operand" or cursor.operand >= max(1, len(row.operands)):
        return None
    parts = row.syntax.removeprefix(row.mnemonic).strip()
    labels = [part.strip() for part in parts.split(",")] if parts else []
    documents = (_operand_document(operand) for operand in row.operands)
    return Signature(row.syntax, row.meaning, tuple(zip(labels, documents, strict=True)), cursor.operand)


def cursor_at(text: str, column: int) -> Cursor:
    """What is being written at `column` of a line."""
    before = text[:column]
    line = parser.parse_line(_POINT.sub("_", before))
    word = WORD.search(before)
    assert word is not None
    nothing = Cursor("none", None, 0, (), word.group(), word.start())
    if line.comment is not None:
        return nothing
    if isinstance(line.statement, parser.WrittenCommand):
        return _in_command(line.statement, before, nothing)
    return nothing._replace(place=_place(line.statement, before))


def _place(statement: parser.Statement | None, before: str) -> Where:
    """What is being written on a line without a command."""
    match statement:
        case parser.Directive():
            condition = statement.kind in _CONDITIONS and len(before) >= statement.start
            return "condition" if condition else "none"
        case parser.ConstantDefinition():
            return "expression"
        case parser.Include() | parser.Data():
            return "none"
        case _:
            rest = before.strip(BLANKS)
            return "head" if not rest or rest[-1] == ":" or rest[0] == "#" else "none"


def _in_command(statement: parser.WrittenCommand, before: str, cursor: Cursor) -> Cursor:
    end = statement.start + len(statement.mnemonic)
    if len(before) <= end:
        return cursor._replace(place="head")
    row = BY_MNEMONIC.get(statement.mnemonic.upper())
    parts = before[end:].split(",")
    operands = tuple(part.strip() for part in parts[:-1])
    return cursor._replace(
        place="operand" if row else "none", row=row, operand=len(parts) - 1, before=operands
    )


def command_completions() -> list[Completion]:
    """All commands."""
    return [
        Completion(row.mnemonic, "command", row.mnemonic, row.title, command_text(row.mnemonic))
        for row in COMMANDS
    ]


def function_completions() -> list[Completion]:
    """All functions of expressions."""
    return [Completion(name, "function", f"{name}(", row.meaning) for name, row in FUNCTIONS.items()]


def parameter_completions(rows: Iterable[AxisParameter | GlobalParameter]) -> Iterator[Completion]:
    """Parameters, found by number, name or key, inserted as numbers."""
    for row in rows:
        label = f"{row.number} {row.name}"
        yield Completion(
            label, "parameter", str(row.number), row.unit, parameter_text(row), f"{label} {row.key}"
        )


_DIRECTIVES: Final = (
    Completion("#include", "directive", "#include ", "puts another file here"),
    Completion("#if", "directive", "#if ", "lines that count only where a condition holds"),
    Completion("#else", "directive", "#else", "lines that count where it does not"),
    Completion("#endif", "directive", "#endif", "ends #if"),
    Completion("#assert", "directive", "#assert ", "an error unless a condition holds"),
)
_CONDITIONS: Final = frozenset({"if", "assert"})
_MODEL: Final = Completion(MODEL, "constant", MODEL, "341, 342 or 343", "The module that the program is for.")
_ROUTINE: Final = re.compile(r"\s*[A-Za-z_]\w*\s*:(?!=)", re.ASCII)
_POINT: Final = re.compile(r"(?<![\w.])\.(?=[A-Za-z_]|\Z)", re.ASCII)
"""The point of a local label: to the parser it is a letter."""
_LOCAL: Final = re.compile(r"\s*(\.[A-Za-z_]\w*)\s*:(?!=)", re.ASCII)


def _global_parameters(row: Command) -> Iterator[GlobalParameter]:
    for parameter in GLOBAL_PARAMETERS:
        if row.mnemonic not in _WRITES or parameter.writable:
            yield parameter


def _banks(row: Command) -> Sequence[tuple[int, str]]:
    if row.operands[0].kind == "port":
        banks = ((0, "digital inputs"), (1, "analogue inputs"), (2, "outputs"))
        return banks if row.mnemonic == "GIO" else banks[2:]
    return ((0, "parameters of the module"), (2, "user variables"))


def _operand_document(operand: OperandRow) -> str:
    if operand.kind == "word":
        return "one of " + ", ".join(word for word, _ in operand.words)
    if operand.kind == "address":
        return "a label or an address"
    if operand.kind == "motor":
        return f"motor 0 to {MOTORS - 1}"
    return f"{operand.name}, {operand.low} to {operand.high}"
