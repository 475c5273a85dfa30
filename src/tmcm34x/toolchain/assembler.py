"""Source text to instructions, with everything an editor, a listing or a debugger wants to know.

Two passes: the first walks the lines and the files they include, gives addresses to instructions and values
to names; the second fills the instructions in.  Both go on after mistakes, so `Assembly.diagnostics` has all
of them.  Files are read by the caller's `include` function alone.

What a line means comes from the rows of `tmcl.commands`: operands, words, fields, spare fields.  Whatever the
eight bytes of an instruction can hold assembles; what the module will not like is the linter's business.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Set
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Final, Literal, NamedTuple

from tmcm34x.tmcl.commands import BY_MNEMONIC, FOREIGN_COMMANDS, PROGRAM_SIZE
from tmcm34x.tmcl.commands import Command as Row
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.toolchain import sisters
from tmcm34x.toolchain.diagnostics import (
    Diagnostic,
    Edit,
    Fix,
    Location,
    article,
    did_you_mean,
    has_errors,
    one_of,
    shown,
)
from tmcm34x.toolchain.expressions import FUNCTIONS, ExpressionError, Operand, evaluate, names_in
from tmcm34x.toolchain.includes import standard
from tmcm34x.toolchain.mending import words as meanings
from tmcm34x.toolchain.mending.files import Mistake, mend, moved
from tmcm34x.toolchain.mending.lines import changed, repair
from tmcm34x.toolchain.mending.spelling import limit, nearest
from tmcm34x.toolchain.parser import Command, Constant, Data, Directive, Include, Line, Problem, parse_line
from tmcm34x.toolchain.structure import MODEL, holds, local_labels
from tmcm34x.toolchain.tokens import BLANKS, Token, make, number_value, split_lines

IncludeReader = Callable[[str, str], tuple[str, str]]
"""Called with a file as an `#include` names it and with the name of the including file; returns the full
name and the text of the file.  An `OSError` or `ValueError` becomes a diagnostic."""

INCLUDE_DEPTH: Final = 32
_SUGGESTIONS: Final = 50
"""Misspelt names of one text that get a suggestion: looking for one takes a while."""

_FIELDS: Final = {"type": 1, "motor": 2, "value": 3}
"""Places of the fields in an `Instruction`."""
_VALUE: Final = _FIELDS["value"]
_BYTE: Final = 255
_DATA_FIELDS: Final = ("number", "type", "motor", "value")


@dataclass(slots=True)
class Symbol:
    """A label or a constant: its value, and where it stands in the sources."""

    name: str
    kind: Literal["label", "constant"]
    value: float
    definition: Location
    references: list[Location] = field(default_factory=list[Location])
    comment: str = ""


class Code(NamedTuple):
    """One address of the program.

    row: of the command; None for a DATA line or where the mnemonic is wrong
    instruction: None where the line has mistakes
    line: the parsed source line, number `number` of `file`
    """

    row: Row | None
    instruction: Instruction | None
    file: str
    number: int
    line: Line

    @property
    def appended(self) -> bool:
        """Whether it is the STOP that no source line holds."""
        return self.line.statement is None

    @property
    def location(self) -> Location:
        """Of the command without its labels and comment."""
        statement = self.line.statement
        if isinstance(statement, Command | Data):
            return Location(self.file, self.number, statement.start + 1, statement.end + 1)
        return Location(self.file, self.number, 1, 1)


class Assembly(NamedTuple):
    """What `assemble` found.

    code: one entry an address, also where lines have mistakes
    symbols: by upper-case name
    sources: the lines of each file, by its name, in the order of reading
    lines: each file's parsed lines, by its name
    includes: the file that each `#include` took, by its own file and line
    left_out: files and lines of directives, and of what their conditions leave out
    """

    file: str
    code: tuple[Code, ...]
    symbols: Mapping[str, Symbol]
    diagnostics: tuple[Diagnostic, ...]
    sources: Mapping[str, list[str]]
    lines: Mapping[str, list[Line]]
    includes: Mapping[tuple[str, int], str]
    left_out: Set[tuple[str, int]]

    @property
    def ok(self) -> bool:
        """Whether there is a program."""
        return not has_errors(self.diagnostics)

    @property
    def program(self) -> tuple[Instruction, ...]:
        """The instructions; none at all when there are errors."""
        if not self.ok:
            return ()
        return tuple(code.instruction for code in self.code if code.instruction is not None)

    @property
    def source_map(self) -> tuple[Location, ...]:
        """Where the command of each address stands."""
        return tuple(code.location for code in self.code)

    @property
    def labels(self) -> dict[str, int]:
        """The address of each label, by its name as defined."""
        return {s.name: int(s.value) for s in self.symbols.values() if s.kind == "label"}


def no_includes(name: str, _from: str) -> tuple[str, str]:
    """The `include` function of a text that stands alone."""
    raise FileNotFoundError(f"no include files here: {name}")


def assemble(
    text: str,
    file_name: str = "program.tmc",
    include: IncludeReader = no_includes,
    *,
    append_stop: bool = False,
    parse: Callable[[str], Line] = parse_line,
    model: int = 343,
) -> Assembly:
    """The program in `text`.

    file_name: how diagnostics and the source map call it; the `include` function gets it too
    append_stop: puts a STOP at the end unless the last instruction is one, as the TMCL-IDE does (fidelity TOOL-13)
    parse: `parse_line`, or one that remembers the lines it has seen
    model: the module that it is for, which `#if MODEL == 342` asks
    """
    return _Assembler(include, parse, model).run(text, file_name, append_stop)


class _Shape(NamedTuple):
    """A row of the command table as the second pass wants it: by operands and spare numbers in source order."""

    row: Row
    required: int
    places: tuple[tuple[int, Mapping[str, int] | None, bool], ...]
    """Of each one: the field it fills, its words if it has any, and whether it is an address."""


def _shape(row: Row) -> _Shape:
    operands = [(_FIELDS[o.field], dict(o.words) or None, o.kind == "address") for o in row.operands] + [
        (_FIELDS[name], None, False) for name in row.spare
    ]
    return _Shape(row, sum(o.required for o in row.operands), tuple(operands))


_SHAPES: Final = MappingProxyType({mnemonic: _shape(row) for mnemonic, row in BY_MNEMONIC.items()})


_Pending = tuple[Command | Data, str, int, Line]
"""An instruction between the passes: its statement, file, line number and line."""


class _Assembler:
    def __init__(self, include: IncludeReader, parse: Callable[[str], Line], model: int) -> None:
        self.include = include
        self.parse = parse
        self.model = model
        self.left_out: set[tuple[str, int]] = set()
        self.diagnostics: list[Diagnostic] = []
        self.symbols: dict[str, Symbol] = {}
        self.pending: list[_Pending] = []
        self.sources: dict[str, list[str]] = {}
        self.lines: dict[str, list[Line]] = {}
        self.includes: dict[tuple[str, int], str] = {}
        self.open_files: list[str] = []
        self.suggestions = _SUGGESTIONS
        self.file = ""
        self.number = 0

    def run(self, text: str, file_name: str, append_stop: bool) -> Assembly:
        self.walk(file_name, text)
        code = [self.encode(item) for item in self.pending]
        if append_stop and code and code[-1].row is not _STOP and len(code) < PROGRAM_SIZE:
            last = len(self.sources[file_name])
            code.append(Code(_STOP, Instruction(_STOP.number), file_name, last, self.parse("")))
        if len(code) > PROGRAM_SIZE:
            text = f"the program has {len(code)} instructions; the memory takes {PROGRAM_SIZE}"
            self.diagnostics.append(Diagnostic(code[PROGRAM_SIZE].location, "error", "E601", text))
        if any(item.code in _CAUSES for item in self.diagnostics):
            self.diagnostics = [item for item in self.diagnostics if item.code not in _CONSEQUENCES]
        order = {name: index for index, name in enumerate(self.sources)}
        self.diagnostics.sort(key=lambda item: (order[item.location.file], *item.location[1:]))
        return Assembly(
            file_name,
            tuple(code),
            self.symbols,
            tuple(self.diagnostics),
            self.sources,
            self.lines,
            self.includes,
            self.left_out,
        )

    # First pass

    def walk(self, file_name: str, text: str) -> None:
        self.sources[file_name] = texts = split_lines(text)
        self.lines[file_name] = lines = list(map(self.parse, texts))
        self.file = file_name
        if "." in text:
            for index, changes in local_labels(texts).items():
                lines[index] = moved(self.parse(changed(texts[index], changes)), changes)
        mistakes = mend(texts, lines)
        pending = self.pending
        self.open_files.append(file_name)
        branches: list[tuple[int, bool, bool]] = []
        for number, line in enumerate(lines, 1):
            self.number = number
            if type(line.statement) is Directive:
                self.left_out.add((file_name, number))
                self.directive(line.statement, branches)
                continue
            if branches and not branches[-1][1]:
                self.left_out.add((file_name, number))
                continue
            for problem in _first_kind(line.problems):
                self.report(*problem)
            for label in line.labels:
                self.define(label, "label", len(self.pending), line)
            statement = line.statement
            if statement is None:
                continue
            if isinstance(statement, Command | Data):
                pending.append((statement, file_name, number, line))
            elif isinstance(statement, Constant):
                self.constant(statement, line)
            elif isinstance(statement, Include):
                self.include_file(statement)
                self.file = file_name
        for number, *_ in branches:
            self.number = number
            self.report("E103", 0, len(texts[number - 1]), "this #if has no #endif")
        for mistake in mistakes:
            if (file_name, mistake.number) not in self.left_out:
                self.mistake(mistake)
        self.open_files.pop()

    def directive(self, statement: Directive, branches: list[tuple[int, bool, bool]]) -> None:
        """Follows `#if` to `#endif`: line, whether it counts, and whether its #else would; and checks `#assert`."""
        counts = not branches or branches[-1][1]
        if statement.kind == "if":
            holds = counts and self.condition(statement)
            branches.append((self.number, holds, counts and not holds))
        elif statement.kind == "assert":
            if counts and not self.condition(statement):
                text = self.sources[self.file][self.number - 1][statement.start : statement.end]
                self.report("E402", statement.start, statement.end, f"this does not hold: {shown(text)}")
        elif not branches:
            text = f"#{statement.kind} without an #if above it"
            self.report("E103", 0, len(self.sources[self.file][self.number - 1]), text)
        elif statement.kind == "else":
            number, _, otherwise = branches[-1]
            branches[-1] = (number, otherwise, False)
        else:
            branches.pop()

    def condition(self, statement: Directive) -> bool:
        """Whether the condition of a directive holds; a wrong one does."""
        text = self.sources[self.file][self.number - 1]
        try:
            return holds(text, statement.start, statement.end, self.known)
        except ExpressionError as error:
            self.report(*error.problem)
            return True

    def known(self, name: Token) -> float:
        """The value of a name in a condition."""
        own = name.text.upper() == MODEL and MODEL not in self.symbols
        return float(self.model) if own else self.earlier_constant(name)

    def include_file(self, statement: Include) -> None:
        start, end, name = statement.start, statement.end, shown(statement.file)
        if len(self.open_files) > INCLUDE_DEPTH:
            self.report("E503", start, end, f"more than {INCLUDE_DEPTH} files include each other here")
            return
        try:
            full_name, text = self.include(statement.file, self.file)
        except (OSError, ValueError) as error:
            found = standard(statement.file)
            if found is None:
                reason = getattr(error, "strerror", None) or str(error)
                self.report("E501", start, end, f"cannot read {name}: {shown(reason)}")
                return
            full_name, text = found
        self.includes[self.file, self.number] = full_name
        if full_name in self.open_files:
            self.report("E502", start, end, f"{name} includes itself")
        elif full_name not in self.sources:
            self.walk(full_name, text)

    def constant(self, statement: Constant, line: Line) -> None:
        value = 0.0
        if statement.value is not None:
            try:
                value = evaluate(statement.value, self.earlier_constant)
            except ExpressionError as error:
                self.report(*error.problem)
        self.define(statement.name, "constant", value, line)

    def earlier_constant(self, name: Token) -> float:
        symbol = self.symbols.get(name.text.upper())
        if symbol is None:
            near = self.near(name.text, self.symbols)
            text = f"{shown(name.text)} is not defined above this line{did_you_mean(near)}"
            raise ExpressionError("E303", name.start, name.end, text, only(near))
        return self.constant_value(name, symbol)

    def define(self, name: Token, kind: Literal["label", "constant"], value: float, line: Line) -> None:
        key = name.text.upper()
        known = self.symbols.get(key)
        if known is not None:
            place = known.definition
            where = f"line {place.line}" if place.file == self.file else f"{place.file}, line {place.line}"
            self.report(
                "E302", name.start, name.end, f"{shown(name.text)} is already a {known.kind} ({where})"
            )
            return
        text = self.sources[self.file][self.number - 1]
        comment = "" if line.comment is None else text[line.comment :].lstrip("/! \t").rstrip()
        self.symbols[key] = Symbol(
            name.text, kind, value, self.location(name.start, name.end), comment=comment
        )

    # Second pass

    def encode(self, item: _Pending) -> Code:
        statement, file, number, line = item
        self.file, self.number = file, number
        if isinstance(statement, Data):
            return Code(None, self.data(statement), file, number, line)
        shape = _SHAPES.get(statement.mnemonic.upper())
        if shape is None:
            self.unknown_command(statement)
            self.note_names(statement)
            return Code(None, None, file, number, line)
        return make(
            Code, (shape.row, self.command(statement, shape, whole=not line.problems), file, number, line)
        )

    def command(self, statement: Command, shape: _Shape, *, whole: bool) -> Instruction | None:
        operands, places = statement.operands, shape.places
        if not shape.required <= len(operands) <= len(places) and not self.right_count(
            statement, shape, whole
        ):
            self.note_names(statement)
            return None
        fields: list[int | None] = [shape.row.number, 0, 0, 0]
        for operand, (target, words, address) in zip(operands, places, strict=False):
            if words is None:
                fields[target] = self.integer(operand, target, address)
            else:
                fields[target] = self.word(operand, words, shape.row)
        return None if None in fields else make(Instruction, tuple(fields))

    def note_names(self, statement: Command) -> None:
        """The names in a refused command count as used."""
        for operand in statement.operands:
            for name in names_in(operand):
                symbol = self.symbols.get(name.text.upper())
                if symbol is not None:
                    symbol.references.append(self.location(name.start, name.end))

    def right_count(self, statement: Command, shape: _Shape, whole: bool) -> bool:
        """Whether another number of operands than the row's is still right; reports when not.

        whole: nothing was said of the line yet
        """
        row, operands, first = shape.row, statement.operands, statement.start
        if (
            row is _CALC
            and len(operands) == 1
            and isinstance(operands[0], Token)
            and operands[0].text.upper() == "NOT"
        ):
            return True
        if not whole or self.repaired():
            return False
        if len(operands) > len(shape.places):
            extra = operands[len(shape.places)]
            start = extra.start if extra is not None else first
            self.report("E204", start, statement.end, f"too many operands for {row.mnemonic}: {row.syntax}")
            return False
        missing = article(row.operands[len(operands)].name)
        self.report("E203", first, statement.end, f"{row.mnemonic} needs {missing}: {row.syntax}")
        return False

    def word(self, operand: Operand | None, words: Mapping[str, int], row: Row) -> int | None:
        if operand is None:
            return None
        text = operand.text if isinstance(operand, Token) else ""
        value = words.get(text.upper())
        if value is None:
            meant = meanings.WORDS.get(row.mnemonic, {}).get(text.upper())
            near = (meant,) if meant is not None else self.near(text, words, most=max(1, limit(text)))
            text = f"{row.mnemonic} takes {one_of(words)} here{did_you_mean(near)}"
            self.report("E205", operand.start, operand.end, text, only(near))
        return value

    def integer(self, operand: Operand | None, target: int, address: bool) -> int | None:
        if operand is None:
            return None
        try:
            if isinstance(operand, Token) and operand.kind == "number":
                value = number_value(operand.text)
            elif address and isinstance(operand, Token):
                value = self.jump_target(operand)
            elif address and self.repaired():
                return None
            else:
                value = evaluate(operand, self.named_value)
        except ExpressionError as error:
            self.report(*error.problem)
            return None
        if isinstance(value, int) and 0 <= value <= _BYTE:
            return value
        low, high = (-(2**31), 2**32 - 1) if target == _VALUE else (0, _BYTE)
        if low - 0.5 <= value < high + 0.5:
            number = round(value)
            if low <= number <= high:
                return number - 2**32 if number >= 2**31 else number
        self.report("E206", operand.start, operand.end, f"{value:.15g} does not fit: {low} to {high}")
        return None

    def jump_target(self, name: Token) -> float:
        symbol = self.symbols.get(name.text.upper())
        if symbol is None:
            raise self.unknown_name(name, "label")
        symbol.references.append(self.location(name.start, name.end))
        return symbol.value

    def named_value(self, name: Token) -> float:
        symbol = self.symbols.get(name.text.upper())
        if symbol is None:
            raise self.unknown_name(name, "constant")
        return self.constant_value(name, symbol)

    def constant_value(self, name: Token, symbol: Symbol) -> float:
        symbol.references.append(self.location(name.start, name.end))
        if symbol.kind == "label":
            text = f"{shown(name.text)} is a label; only JA, JC and CSUB take one"
            raise ExpressionError("E304", name.start, name.end, text)
        return symbol.value

    def data(self, statement: Data) -> Instruction | None:
        operands = statement.operands
        if len(operands) != len(_DATA_FIELDS):
            text = f"DATA takes four numbers: {', '.join(_DATA_FIELDS)}"
            self.report("E103", statement.start, statement.end, text)
            return None
        fields = [self.integer(operand, index, address=False) for index, operand in enumerate(operands)]
        return None if None in fields else make(Instruction, tuple(fields))

    # Diagnostics

    def unknown_command(self, statement: Command) -> None:
        name, start = statement.mnemonic.upper(), statement.start
        end = min(start + len(name), statement.end)
        number = FOREIGN_COMMANDS.get(name)
        if number is not None:
            owner, instead = sisters.COMMANDS[name]
            text = f"{name} (command {number}) is of other TMCL firmware: {owner}; a TMCM-34x has {instead}"
            self.report("E202", start, end, text)
            return
        hint = "" if statement.operands else "; a label ends with ':'"
        self.report("E201", start, end, f"no command {shown(statement.mnemonic)}{hint}")

    def unknown_name(self, name: Token, wanted: str) -> ExpressionError:
        key = name.text.upper()
        if key in FUNCTIONS:
            text = f"the function {key} needs its operand in parentheses"
            return ExpressionError("E301", name.start, name.end, text)
        near = self.near(key, (n for n, symbol in self.symbols.items() if symbol.kind == wanted))
        if not near and set(key) <= set("OIL0123456789"):
            near = (key.translate(_DIGITS),)
        comment = None if near else self.comment_before(name)
        if comment is not None:
            return comment
        text = f"no {wanted} {shown(name.text)}{did_you_mean(near)}"
        return ExpressionError("E301", name.start, name.end, text, only(near))

    def comment_before(self, name: Token) -> ExpressionError | None:
        """A name behind `--` or `/` may begin a comment of another language."""
        before = self.sources[self.file][self.number - 1][: name.start].rstrip(BLANKS)
        for marker in ("--", "/"):
            start = len(before) - len(marker)
            if before.endswith((f" {marker}", f"\t{marker}")):
                text = f"no constant {shown(name.text)}; a comment begins with //, not with {marker!r}"
                return ExpressionError("E301", start, len(before), text, "//")
        return None

    def near(self, name: str, candidates: Iterable[str], most: int | None = None) -> tuple[str, ...]:
        """The candidates that `name` may be a misspelling of, as they are defined."""
        if self.suggestions <= 0:
            return ()
        self.suggestions -= 1
        found = nearest(name.upper(), candidates, most)
        return tuple(symbol.name if (symbol := self.symbols.get(one)) else one for one in found)

    def report(self, code: str, start: int, end: int, text: str, replacement: str | None = None) -> None:
        location = self.location(start, end)
        fixes: tuple[Fix, ...] = ()
        if replacement is not None:
            title = f"Change to {shown(replacement)}" if replacement else "Delete this"
            fixes = (Fix(title, (Edit(location, replacement),)),)
        self.diagnostics.append(Diagnostic(location, "error", code, text, fixes))

    def mistake(self, found: Mistake) -> None:
        """Reports what mending found, with the changes that mend it."""
        edits = tuple(
            Edit(Location(self.file, number, start + 1, end + 1), new)
            for number, (start, end, new) in found.changes
        )
        fixes: tuple[Fix, ...] = ()
        if edits:
            text = self.sources[self.file][found.number - 1]
            here = tuple(change for number, change in found.changes if number == found.number)
            right = changed(text, here).partition("//")[0].strip(BLANKS) or "a comment"
            fixes = (Fix(f"Change to {shown(right)}", edits),)
        place = Location(self.file, found.number, found.start + 1, found.end + 1)
        self.diagnostics.append(Diagnostic(place, "error", found.code, found.text, fixes))

    def repaired(self) -> bool:
        """Reports what the present line was meant to be, where that can be told."""
        if self.suggestions <= 0:
            return False
        self.suggestions -= 1
        found = repair(self.sources[self.file][self.number - 1])
        if found is not None:
            changes = tuple((self.number, change) for change in found.changes)
            self.mistake(Mistake(self.number, found.code, found.start, found.end, found.text, changes))
        return found is not None

    def location(self, start: int, end: int) -> Location:
        return Location(self.file, self.number, start + 1, end + 1)


def only(near: tuple[str, ...]) -> str | None:
    """The one name that is meant; None where there are none or several."""
    return near[0] if len(near) == 1 else None


def _first_kind(problems: tuple[Problem, ...]) -> Iterable[Problem]:
    """The mistakes in the characters and words of a line; where there are none, all others."""
    if len(problems) < 2:
        return problems
    return [problem for problem in problems if problem.code in ("E101", "E102")] or problems


_CAUSES: Final = frozenset({"E501", "E503"})
_CONSEQUENCES: Final = frozenset({"E301", "E303"})
"""Names are not missed while a file is missing that may define them."""
_DIGITS: Final = str.maketrans("OIL", "011")
_CALC: Final = BY_MNEMONIC["CALC"]
_STOP: Final = BY_MNEMONIC["STOP"]
