"""What an editor asks about a program: hover texts, completions, references, hints, fixes.

Pure: no protocol, no files, no event loop.  The language server turns the answers into messages; everything else
that shows source text may use them too.  Lines and columns of places count from 0 here, as editors do, in
characters; `Location`s count from 1, as people do.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import Final, Literal, NamedTuple

from tmcm34x import clock
from tmcm34x.tmcl import axis_parameters, global_parameters
from tmcm34x.tmcl.axis_parameters import AXIS_PARAMETERS, AxisParameter
from tmcm34x.tmcl.commands import BY_MNEMONIC, COMMANDS, FOREIGN_COMMANDS, MOTORS, Command
from tmcm34x.tmcl.commands import Operand as OperandRow
from tmcm34x.tmcl.datagram import Instruction, pack_record
from tmcm34x.tmcl.global_parameters import GLOBAL_PARAMETERS, GlobalParameter
from tmcm34x.toolchain import parser
from tmcm34x.toolchain.assembler import Assembly, Code, Symbol
from tmcm34x.toolchain.diagnostics import Diagnostic, Edit, Fix, Location
from tmcm34x.toolchain.expressions import FUNCTIONS, Operand
from tmcm34x.toolchain.flow import CSUB
from tmcm34x.toolchain.formatter import format_source
from tmcm34x.toolchain.linter import RULES, ignored_codes
from tmcm34x.toolchain.reference import word_meaning
from tmcm34x.toolchain.tokens import BLANKS, Token, tokenize

TokenType = Literal[
    "keyword",
    "enumMember",
    "variable",
    "function",
    "number",
    "operator",
    "comment",
    "macro",
    "method",
    "string",
]
TOKEN_TYPES: Final[tuple[TokenType, ...]] = (
    "keyword", "enumMember", "variable", "function", "number", "operator", "comment", "macro", "method", "string",
)  # fmt: skip
"""How the words of a source are coloured: commands, words, constants, labels, numbers, operators, comments,
directives, functions, file names."""

CompletionKind = Literal[
    "command", "word", "constant", "label", "function", "parameter", "number", "directive"
]
HintKind = Literal["address", "parameter", "value"]

_NAME: Final = re.compile(r"[A-Za-z_]\w*\Z", re.ASCII)
_RESOLUTION, _RAMP_DIVISOR, _PULSE_DIVISOR = (
    axis_parameters.BY_KEY[key] for key in ("microstep_resolution", "ramp_divisor", "pulse_divisor")
)
_DIVISORS: Final = (_RESOLUTION, _RAMP_DIVISOR, _PULSE_DIVISOR)
_SPEED_UNIT: Final = "velocity units"
_ACCELERATION_UNIT: Final = "acceleration units"
_TICKS_A_SECOND: Final = 100
_WRITES: Final = frozenset({"SAP", "SGP", "AAP", "AGP"})
_STORES: Final = frozenset({"STAP", "RSAP"})
_TICKS: Final = dict(BY_MNEMONIC["WAIT"].operands[0].words)["TICKS"]


class Place(NamedTuple):
    """A place between two characters."""

    file: str
    line: int
    column: int


class Hover(NamedTuple):
    """A text in Markdown about the word at a location."""

    text: str
    location: Location


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


class Hint(NamedTuple):
    """A text shown between the characters of a line."""

    line: int
    column: int
    kind: HintKind
    text: str


class Outline(NamedTuple):
    """A name that a file defines; `last_line` is the last one that belongs to it."""

    symbol: Symbol
    is_subroutine: bool
    last_line: int


class Fold(NamedTuple):
    """Lines that may be folded into the first."""

    first: int
    last: int
    kind: Literal["comment", "imports", "region"]


class Coloured(NamedTuple):
    """A word with its type."""

    line: int
    start: int
    length: int
    type: TokenType
    definition: bool


class Action(NamedTuple):
    """A change that the editor may offer for a diagnostic."""

    title: str
    diagnostic: Diagnostic
    edits: tuple[Edit, ...]
    preferred: bool


class Cursor(NamedTuple):
    """Where in a line the cursor is.

    row: of the command whose operand is being written; None at the place of a command
    operand: the number of this operand, from 0
    before: the operands before it, as text
    word: what is written of the word at the cursor, and `start` its column
    """

    place: Literal["head", "operand", "expression", "none"]
    row: Command | None
    operand: int
    before: tuple[str, ...]
    word: str
    start: int


class Analysis:
    """One program, with the files that it includes, and all that is known about it."""

    def __init__(self, assembly: Assembly, findings: Sequence[Diagnostic], model: int = 343) -> None:
        self.assembly = assembly
        self.findings = (*assembly.diagnostics, *findings)
        self.model = model

    # Places

    def text(self, file: str, line: int) -> str:
        """One line; empty where there is none."""
        lines = self.assembly.sources.get(file, [])
        return lines[line] if 0 <= line < len(lines) else ""

    def token_at(self, place: Place) -> Token | None:
        """The word that a place touches."""
        tokens = tokenize(self.text(place.file, place.line))
        touching = [token for token in tokens if token.start <= place.column <= token.end]
        names = [token for token in touching if token.kind != "operator"]
        return (names or touching or [None])[-1]

    def symbol_at(self, place: Place) -> tuple[Symbol, Location] | None:
        """The label or constant at a place, and where exactly its name stands."""
        token = self.token_at(place)
        symbol = self.assembly.symbols.get(token.text.upper()) if token is not None else None
        if symbol is None:
            return None
        for name in (symbol.definition, *symbol.references):
            here = name.file == place.file and name.line == place.line + 1
            if here and name.column - 1 <= place.column <= name.end - 1:
                return symbol, name
        return None

    @cached_property
    def codes(self) -> Mapping[tuple[str, int], tuple[int, Code]]:
        """Address and code of each line that holds an instruction; lines count from 0."""
        return {(code.file, code.number - 1): (n, code) for n, code in enumerate(self.assembly.code)}

    # Diagnostics

    def diagnostics(self, file: str) -> list[Diagnostic]:
        """The findings in one file; those of files that it includes stand at the include line."""
        found: list[Diagnostic] = []
        for item in self.findings:
            if item.location.file == file:
                found.append(item)
            elif item.severity != "information":
                place = self._include_of(file, item.location.file)
                if place is not None:
                    text = f"{item.location.file}:{item.location.line}: {item.text}"
                    found.append(item._replace(location=place, text=text, fixes=()))
        return found

    def _include_of(self, file: str, included: str) -> Location | None:
        """The line of `file` by which `included` comes in, directly or through others."""
        seen: set[str] = set()
        while included not in seen:
            seen.add(included)
            for (name, number), target in self.assembly.includes.items():
                if target != included:
                    continue
                if name == file:
                    return Location(file, number, 1, len(self.assembly.sources[file][number - 1]) + 1)
                included = name
                break
        return None

    def actions(self, file: str, first_line: int, last_line: int) -> list[Action]:
        """The changes to offer for the findings on some lines."""
        actions: list[Action] = []
        for item in self.findings:
            if item.location.file != file or not first_line <= item.location.line - 1 <= last_line:
                continue
            actions += [
                Action(fix.title, item, fix.edits, preferred=n == 0) for n, fix in enumerate(item.fixes)
            ]
            if item.code in RULES:
                ignore = self._ignore(item)
                actions.append(Action(ignore.title, item, ignore.edits, preferred=False))
        return actions

    def _ignore(self, item: Diagnostic) -> Fix:
        """The comment that keeps a rule quiet on its line."""
        place = item.location
        text = self.text(place.file, place.line - 1)
        end = len(text) + 1
        comment = self.assembly.lines[place.file][place.line - 1].comment
        codes = ignored_codes(text[comment:]) if comment is not None else frozenset[str]()
        addition = f", {item.code}" if codes and text.rstrip().upper().endswith(tuple(codes)) else ""
        if not addition:
            addition = f" // lint: ignore {item.code}" if comment is None else f" lint: ignore {item.code}"
        return Fix(
            f"Ignore {item.code} on this line", (Edit(Location(place.file, place.line, end, end), addition),)
        )

    # Hover

    def hover(self, place: Place) -> Hover | None:
        """What the word at a place means."""
        token = self.token_at(place)
        parsed = self._line(place.file, place.line)
        if token is None or parsed is None:
            return None
        text = "\n\n---\n\n".join(self._hover_texts(place.file, place.line, token, parsed))
        return (
            Hover(text, Location(place.file, place.line + 1, token.start + 1, token.end + 1))
            if text
            else None
        )

    def _line(self, file: str, line: int) -> parser.Line | None:
        lines = self.assembly.lines.get(file, [])
        return lines[line] if 0 <= line < len(lines) else None

    def _hover_texts(self, file: str, line: int, token: Token, parsed: parser.Line) -> Iterator[str]:
        statement = parsed.statement
        if (
            parsed.comment is not None
            and token.start >= parsed.comment
            and not isinstance(statement, parser.Data)
        ):
            return
        if isinstance(statement, parser.Include):
            included = self.assembly.includes.get((file, line + 1))
            if included is not None:
                yield f"includes `{included}`"
            return
        if isinstance(statement, parser.Command) and token.start == statement.start:
            yield command_text(statement.mnemonic)
            entry = self.codes.get((file, line))
            if entry is not None and entry[1].instruction is not None:
                yield _address_text(entry[0], entry[1].instruction)
            return
        symbol = self.symbol_at(Place(file, line, token.start))
        if symbol is not None:
            yield symbol_text(symbol[0])
        entry = self.codes.get((file, line))
        if entry is not None and isinstance(statement, parser.Command) and entry[1].row is not None:
            index = _operand_index(statement.operands, token)
            if index is not None:
                yield from self._operand_texts(entry, index, token)
                return
        function = FUNCTIONS.get(token.text.upper())
        if symbol is None and function is not None:
            yield f"**{token.text.upper()}(x)**: {function.meaning}"

    def _operand_texts(self, entry: tuple[int, Code], index: int, token: Token) -> Iterator[str]:
        address, code = entry
        row, instruction = code.row, code.instruction
        assert row is not None
        if token.text.upper() in FUNCTIONS and token.kind == "name":
            yield f"**{token.text.upper()}(x)**: {FUNCTIONS[token.text.upper()].meaning}"
        if index >= len(row.operands):
            yield "surplus number: goes to a field that the command does not use"
            return
        operand = row.operands[index]
        if operand.kind == "word":
            meaning = word_meaning(row.mnemonic, token.text.upper())
            yield f"**{token.text.upper()}** ({operand.name} of {row.mnemonic}){': ' + meaning if meaning else ''}"
        elif instruction is not None:
            yield self.operand_text(address, row, operand, instruction)

    def operand_text(self, address: int, row: Command, operand: OperandRow, instruction: Instruction) -> str:
        """What an operand's number means in its instruction, in Markdown."""
        number = getattr(instruction, operand.field)
        parameter = parameter_of(row, instruction)
        if operand.kind in ("axis_parameter", "global_parameter"):
            if parameter is None:
                return f"{operand.name} {number}: not in this firmware"
            return parameter_text(parameter)
        if operand.kind == "address":
            return f"address {number}"
        unit = self.value_text(address, row, instruction) if operand.field == "value" else ""
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

    # Physical values

    def value_text(self, address: int, row: Command, instruction: Instruction) -> str:
        """The value field in physical units: a speed, an acceleration, a time; empty where it is none."""
        parameter = parameter_of(row, instruction)
        motor, value = instruction.motor, instruction.value
        unit = ""
        if row.mnemonic in ("ROR", "ROL"):
            unit = _SPEED_UNIT
        elif row.mnemonic == "SAP" and isinstance(parameter, AxisParameter):
            unit = parameter.unit
        if unit in (_SPEED_UNIT, _ACCELERATION_UNIT) and motor < MOTORS and 0 < abs(value) < 2048:
            resolution, ramp, pulse = (self._setting(address, motor, row) for row in _DIVISORS)
            if unit == _SPEED_UNIT:
                rate = clock.HZ * value / (2**pulse * 2048 * 32)
                return f"{rate:,.0f} microsteps/s, {rate / 2**resolution:,.1f} steps/s"
            rate = clock.HZ**2 * value / 2 ** (pulse + ramp + 29)
            return f"{rate:,.0f} microsteps/s², {rate / 2**resolution:,.1f} steps/s²"
        if row.mnemonic == "WAIT" and value > 0:
            return f"{value / _TICKS_A_SECOND:g} s"
        return f"{value / _TICKS_A_SECOND:g} s" if unit == "10 ms" and value > 0 else ""

    def _setting(self, address: int, motor: int, parameter: AxisParameter) -> int:
        """The value that the program last gave to a parameter above `address`, else its default."""
        settings = self._settings.get((parameter.number, motor), [])
        place = bisect_right(settings, (address, 2**31))
        value = settings[place - 1][1] if place else settings[0][1] if settings else parameter.default
        return value if parameter.low <= value <= parameter.high else parameter.default

    @cached_property
    def _settings(self) -> Mapping[tuple[int, int], list[tuple[int, int]]]:
        """Addresses and values of the SAPs of divisors and resolutions, by parameter and motor."""
        numbers = {row.number for row in _DIVISORS}
        sap = BY_MNEMONIC["SAP"].number
        settings: dict[tuple[int, int], list[tuple[int, int]]] = {}
        for address, code in enumerate(self.assembly.code):
            instruction = code.instruction
            if instruction is not None and instruction.number == sap and instruction.type in numbers:
                key = (instruction.type, instruction.motor)
                settings.setdefault(key, []).append((address, instruction.value))
        return settings

    def hints(self, file: str, first_line: int, last_line: int) -> list[Hint]:
        """Addresses, names of parameters beside their numbers, values in physical units."""
        hints: list[Hint] = []
        for line in range(max(0, first_line), last_line + 1):
            entry = self.codes.get((file, line))
            if entry is None:
                continue
            address, code = entry
            statement = code.line.statement
            if not isinstance(statement, parser.Command | parser.Data):
                continue
            hints.append(Hint(line, statement.start, "address", f"{address:04}"))
            if (
                code.row is not None
                and code.instruction is not None
                and isinstance(statement, parser.Command)
            ):
                hints += self._operand_hints(line, address, code.row, code.instruction, statement.operands)
        return hints

    def _operand_hints(
        self, line: int, address: int, row: Command, instruction: Instruction, operands: parser.Operands
    ) -> Iterator[Hint]:
        for operand, written in zip(row.operands, operands, strict=False):
            if written is None:
                continue
            if operand.kind in ("axis_parameter", "global_parameter"):
                parameter = parameter_of(row, instruction)
                if parameter is not None and isinstance(written, Token) and written.kind == "number":
                    yield Hint(line, written.end, "parameter", parameter.name)
            elif operand.field == "value":
                text = self.value_text(address, row, instruction)
                if text:
                    yield Hint(line, written.end, "value", text.split(", ")[-1])

    # Completion

    def completions(self, place: Place) -> list[Completion]:
        """What may stand at a place."""
        cursor = cursor_at(self.text(place.file, place.line), place.column)
        if cursor.place == "head":
            return [*command_completions(), *_DIRECTIVES]
        if cursor.place == "expression":
            return [*self._symbol_completions("constant"), *function_completions()]
        if cursor.place == "none" or cursor.row is None or cursor.operand >= len(cursor.row.operands):
            return []
        return list(self._operand_completions(cursor, cursor.row))

    def _operand_completions(self, cursor: Cursor, row: Command) -> Iterator[Completion]:
        operand = row.operands[cursor.operand]
        if operand.kind == "word":
            for word, number in operand.words:
                yield Completion(word, "word", word, f"{number}", word_meaning(row.mnemonic, word))
            return
        if operand.kind == "address":
            yield from self._symbol_completions("label")
            return
        if operand.kind == "axis_parameter":
            yield from parameter_completions(self._axis_parameters(row))
        elif operand.kind == "global_parameter":
            yield from parameter_completions(_global_parameters(row))
        elif operand.kind == "motor":
            for motor in range(MOTORS):
                yield Completion(str(motor), "number", str(motor), f"motor {motor}")
        elif operand.kind == "bank":
            for bank, meaning in _banks(row):
                yield Completion(str(bank), "number", str(bank), meaning)
        elif operand.field == "value" and row.mnemonic in ("SAP", "SGP"):
            for number, meaning in self._choices(row, cursor.before):
                yield Completion(f"{number} {meaning}", "number", str(number), filter=f"{number} {meaning}")
        yield from self._symbol_completions("constant")
        yield from function_completions()

    def _axis_parameters(self, row: Command) -> Iterator[AxisParameter]:
        for parameter in AXIS_PARAMETERS:
            wrong = row.mnemonic in _WRITES and not parameter.writable
            wrong = wrong or (row.mnemonic in _STORES and not parameter.stored)
            if not wrong and self.model in parameter.models:
                yield parameter

    def _choices(self, row: Command, before: Sequence[str]) -> Sequence[tuple[int, str]]:
        numbers = [int(text) for text in before if text.isdecimal() and len(text) < 9]
        if len(numbers) != len(before) or len(numbers) < 2:
            return ()
        parameter = parameter_of(row, Instruction(row.number, numbers[0], numbers[1]))
        return parameter.choices if parameter is not None else ()

    def _symbol_completions(self, kind: Literal["label", "constant"]) -> Iterator[Completion]:
        for symbol in self.assembly.symbols.values():
            if symbol.kind == kind:
                detail = f"address {symbol.value:g}" if kind == "label" else f"= {symbol.value:.15g}"
                yield Completion(symbol.name, kind, symbol.name, detail, symbol.comment)

    def signature(self, place: Place) -> Signature | None:
        """How the command around a place is written."""
        cursor = cursor_at(self.text(place.file, place.line), place.column)
        row = cursor.row
        if row is None or cursor.place != "operand" or cursor.operand >= max(1, len(row.operands)):
            return None
        parts = row.syntax.removeprefix(row.mnemonic).strip()
        labels = [part.strip() for part in parts.split(",")] if parts else []
        documents = (_operand_document(operand) for operand in row.operands)
        return Signature(row.syntax, row.meaning, tuple(zip(labels, documents, strict=True)), cursor.operand)

    # Names

    def definition(self, place: Place) -> Location | None:
        """Where the name at a place is defined; for an `#include` the beginning of that file."""
        included = self.assembly.includes.get((place.file, place.line + 1))
        if included is not None:
            return Location(included, 1, 1, 1)
        found = self.symbol_at(place)
        return found[0].definition if found is not None else None

    def references(self, place: Place, *, definition: bool = True) -> list[Location]:
        """Where the name at a place is used, and defined if wanted."""
        found = self.symbol_at(place)
        if found is None:
            return []
        symbol = found[0]
        return [symbol.definition, *symbol.references] if definition else list(symbol.references)

    def rename(self, place: Place, new_name: str) -> tuple[Edit, ...]:
        """The edits that rename the label or constant at a place; raises `ValueError` where that cannot be."""
        found = self.symbol_at(place)
        if found is None:
            raise ValueError("there is no label or constant here")
        if not _NAME.match(new_name):
            raise ValueError(f"{new_name!r} is no name: a letter or _, then letters, digits and _")
        other = self.assembly.symbols.get(new_name.upper())
        if other is not None and other is not found[0]:
            raise ValueError(f"{other.name} is already a {other.kind}")
        names = {found[0].definition, *found[0].references}
        return tuple(Edit(name, new_name) for name in sorted(names))

    def outline(self, file: str) -> list[Outline]:
        """The labels and constants that a file defines, in order, with the lines that belong to each label."""
        symbols = sorted(
            (s for s in self.assembly.symbols.values() if s.definition.file == file),
            key=lambda s: s.definition,
        )
        called = {
            i.value for code in self.assembly.code if (i := code.instruction) is not None and i.number == CSUB
        }
        last = len(self.assembly.sources[file])
        outline: list[Outline] = []
        for symbol in reversed(symbols):
            first = symbol.definition.line
            if symbol.kind == "constant":
                outline.append(Outline(symbol, is_subroutine=False, last_line=first))
                continue
            outline.append(Outline(symbol, symbol.value in called, self._last_filled(file, first, last)))
            last = max(1, first - 1)
        return outline[::-1]

    def _last_filled(self, file: str, first: int, last: int) -> int:
        """The last line from `first` to `last` that is neither blank nor a comment."""
        lines = self.assembly.lines[file]
        while last > first and lines[last - 1].statement is None and not lines[last - 1].labels:
            last -= 1
        return max(first, last)

    def folds(self, file: str) -> list[Fold]:
        """Blocks of comments, includes and constants, `// #region` to `// #endregion`, the code of each label."""
        folds = list(_regions(self.assembly.sources[file]))
        lines = self.assembly.lines[file]
        start, kind = 0, ""
        for number in range(len(lines) + 1):
            here = _fold_kind(lines[number]) if number < len(lines) else ""
            if here != kind:
                if kind and number - start > 1:
                    folds.append(Fold(start, number - 1, kind))  # type: ignore[arg-type]
                start, kind = number, here
        for entry in self.outline(file):
            first = entry.symbol.definition.line
            if entry.symbol.kind == "label" and entry.last_line > first:
                folds.append(Fold(first - 1, entry.last_line - 1, "region"))
        return sorted(folds)

    def colours(self, file: str, first_line: int = 0, last_line: int = 2**31) -> Iterator[Coloured]:
        """The words of some lines with their types, in order."""
        texts = self.assembly.sources[file]
        for number in range(max(0, first_line), min(last_line, len(texts) - 1) + 1):
            yield from self._line_colours(number, texts[number], self.assembly.lines[file][number])

    def _line_colours(self, number: int, text: str, line: parser.Line) -> Iterator[Coloured]:
        statement = line.statement
        if isinstance(statement, parser.Include):
            start = text.index("#")
            yield Coloured(
                number, start, len(text[start : statement.start].rstrip()), "macro", definition=False
            )
            yield Coloured(
                number, statement.start, statement.end - statement.start, "string", definition=False
            )
        words = range(0)
        head = -1
        if isinstance(statement, parser.Command):
            head = statement.start
            row = BY_MNEMONIC.get(statement.mnemonic.upper())
            first = statement.operands[0] if statement.operands else None
            if row is not None and row.operands and row.operands[0].kind == "word" and first is not None:
                words = range(first.start, first.end)
        is_include = isinstance(statement, parser.Include)
        is_data = isinstance(statement, parser.Data)
        labels = {token.start for token in line.labels}
        for token in tokenize(text):
            if token.kind == "comment":
                type_: TokenType = "macro" if is_data else "comment"
                yield Coloured(number, token.start, len(token.text), type_, definition=False)
            elif is_include:
                continue
            elif token.kind == "number":
                yield Coloured(number, token.start, len(token.text), "number", definition=False)
            elif token.kind == "operator" and token.text not in ",:":
                yield Coloured(number, token.start, len(token.text), "operator", definition=False)
            elif token.kind == "name":
                defines = token.start in labels or (
                    isinstance(statement, parser.Constant) and token.start == statement.name.start
                )
                type_ = self._name_type(token, head, words)
                yield Coloured(number, token.start, len(token.text), type_, definition=defines)

    def _name_type(self, token: Token, head: int, words: range) -> TokenType:
        if token.start == head:
            return "keyword"
        if token.start in words:
            return "enumMember"
        symbol = self.assembly.symbols.get(token.text.upper())
        if symbol is None and token.text.upper() in FUNCTIONS:
            return "method"
        return "function" if symbol is not None and symbol.kind == "label" else "variable"

    def format_edits(self, file: str) -> tuple[Edit, ...]:
        """The edits that put a file into columns, line by line."""
        texts = self.assembly.sources[file]
        formatted = format_source("\n".join(texts)).split("\n")
        edits = [
            Edit(Location(file, number, 1, len(old) + 1), new)
            for number, (old, new) in enumerate(zip(texts, formatted, strict=False), 1)
            if old != new
        ]
        if len(formatted) > len(texts):
            end = len(texts[-1]) + 1
            last = Location(file, len(texts), end, end)
            edits.append(Edit(last, "\n"))
        return tuple(edits)


def cursor_at(text: str, column: int) -> Cursor:
    """What is being written at `column` of a line."""
    before = text[:column]
    line = parser.parse_line(before)
    word = re.search(r"[$%]?\w*\Z", before, re.ASCII)
    assert word is not None
    start, written = word.start(), word.group()
    statement = line.statement
    nothing = Cursor("none", None, 0, (), written, start)
    if line.comment is not None or isinstance(statement, parser.Include | parser.Data):
        return nothing
    if isinstance(statement, parser.Constant):
        return Cursor("expression", None, 0, (), written, start)
    if isinstance(statement, parser.Command):
        end = statement.start + len(statement.mnemonic)
        row = BY_MNEMONIC.get(statement.mnemonic.upper())
        if column > end:
            parts = before[end:].split(",")
            operands = tuple(part.strip() for part in parts[:-1])
            return Cursor("operand" if row else "none", row, len(parts) - 1, operands, written, start)
        return Cursor("head", None, 0, (), written, start)
    rest = before.strip(BLANKS)
    at_head = not rest or rest[-1] == ":" or rest[0] == "#"
    return Cursor("head", None, 0, (), written, start) if at_head else nothing


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
        number = FOREIGN_COMMANDS.get(name)
        return f"**{name}**: command {number} of other TMCL firmware, not on a TMCM-34x" if number else ""
    reads = " A program gets the value into the accumulator." if "reads" in row.where else ""
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


_DIRECTIVES: Final = (Completion("#include", "directive", "#include ", "puts another file here"),)


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


def _operand_index(operands: Sequence[Operand | None], token: Token) -> int | None:
    for index, operand in enumerate(operands):
        if operand is not None and operand.start <= token.start < operand.end:
            return index
    return None


def _address_text(address: int, instruction: Instruction) -> str:
    return f"address {address}: `{pack_record(instruction).hex(' ')}`"


_REGION: Final = re.compile(r"\s*//\s*#?(end)?region\b")
"""A comment that begins or ends a region, as in other languages."""


def _regions(texts: Sequence[str]) -> Iterator[Fold]:
    begun: list[int] = []
    for number, text in enumerate(texts):
        mark = _REGION.match(text)
        if mark is not None and mark[1] is None:
            begun.append(number)
        elif mark is not None and begun:
            yield Fold(begun.pop(), number, "region")


def _fold_kind(line: parser.Line) -> str:
    if isinstance(line.statement, parser.Include):
        return "imports"
    if isinstance(line.statement, parser.Constant):
        return "region"
    return "comment" if line.comment is not None and line.statement is None and not line.labels else ""
