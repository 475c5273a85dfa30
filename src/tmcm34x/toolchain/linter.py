"""Likely mistakes in programs that assemble: what the module will refuse, never reach or wear out.

`RULES` is the table: code, severity, what it means and why it matters.  A comment `// lint: ignore W101` on a
line keeps these findings quiet there, `// lint: ignore` all of them.  Rules about the way through the program
wait until the text has no errors; those about single commands do not.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Final, NamedTuple

from tmcm34x.tmcl import axis_parameters, global_parameters
from tmcm34x.tmcl.commands import (
    BY_MNEMONIC,
    COMMANDS,
    COORDINATES,
    MOTORS,
    STACK_DEPTH,
    Field,
    Operand,
)
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.toolchain.assembler import Assembly, Code
from tmcm34x.toolchain.diagnostics import Diagnostic, Edit, Fix, Location, Severity, shown
from tmcm34x.toolchain.expressions import FUNCTIONS
from tmcm34x.toolchain.flow import JC, JUMPS, RSUB, Flow
from tmcm34x.toolchain.parser import Command


class Rule(NamedTuple):
    """One row of `RULES`."""

    severity: Severity
    title: str
    reason: str


RULES: Final[Mapping[str, Rule]] = MappingProxyType({
    "W101": Rule("warning", "code that is never reached",
        "No way through the program leads there. Often a label is missing, or a jump goes elsewhere than meant."),
    "W102": Rule("warning", "the program runs past its end",
        "The last instruction is no STOP, JA or RSUB: the module goes on with whatever an earlier, longer program "
        "left in its memory."),
    "W103": Rule("warning", "more than eight calls open",
        "The stack holds eight return addresses. A ninth CSUB is ignored: the program goes on behind it as if the "
        "subroutine had run."),
    "W104": Rule("warning", "RSUB with no call open",
        "RSUB is ignored when no CSUB is open: the program falls into the code behind it."),
    "W105": Rule("warning", "recursion",
        "A subroutine that calls itself fills the stack of eight return addresses, and further calls are ignored."),
    "W106": Rule("warning", "a jump out of the program",
        "Behind the last instruction the memory holds what an earlier program left there, or nothing."),
    "W201": Rule("warning", "waiting for a switch or reference search without a time-out",
        "A broken switch or a blocked axis holds the program for ever. Give the time-out in ticks of 10 ms and ask "
        "for it with JC ETO."),
    "W202": Rule("warning", "EEPROM written in a loop",
        "An EEPROM cell takes a limited number of writes, and each one takes time: a loop uses them up in hours. Keep "
        "such values in user variables and store them when they are final."),
    "W203": Rule("information", "the time-out flag is asked for but never cleared",
        "ETO stays set until CLE ETO or CLE ALL: the next JC ETO jumps even if its own wait was in time."),
    "W301": Rule("warning", "value out of the parameter's range",
        "The module answers with status 4 and keeps the old value; the program goes on."),
    "W302": Rule("warning", "a parameter that this model does not have",
        "A TMCM-342 has no motor drivers: parameters of currents, loads and decay belong to the 341 and 343."),
    "W303": Rule("warning", "a motor that is not there",
        "The modules have three motors, 0 to 2. MVP COORD also takes $80 + mask and $40 + mask, CCO 7, SCO and GCO "
        "255."),
    "W304": Rule("warning", "a read-only parameter written",
        "The module answers with status 3 and nothing happens."),
    "W305": Rule("warning", "an unknown parameter, bank or port",
        "Firmware V4.36 has no such parameter, bank or port: nothing is set, and reading gives 0."),
    "W306": Rule("warning", "a parameter that is not stored",
        "STAP and RSAP know the parameters marked E; STGP and RSGP the user variables in bank 2, and with numbers 7 "
        "and 23 of bank 0 the two tables of the motion chip. All else in bank 0 is stored by SGP itself."),
    "W307": Rule("warning", "operand out of range",
        "The module refuses the command with status 4 and goes on with the next one."),
    "W308": Rule("warning", "a coordinate that is never set",
        "At power-on coordinates are 0 unless they live in the EEPROM: MVP COORD would go to position 0."),
    "W309": Rule("warning", "division by zero",
        "CALC DIV and CALC MOD with 0 leave the accumulator as it was."),
    "W401": Rule("information", "a name that is never used",
        "A left-over, or a sign that another name was meant."),
    "W402": Rule("information", "a constant called like a word of the language",
        "Where a command takes that word, the word wins."),
    "W403": Rule("warning", "a surplus number that has no effect",
        "The command does not look at this field; a common cause is AAP or AGP written like SAP or SGP, although "
        "they take their value from the accumulator."),
})  # fmt: skip
"""All rules, by code."""

_IGNORE: Final = re.compile(r"lint:\s*ignore\b((?:[\s,]*\bW\d+)*)", re.IGNORECASE)
_TIMEOUT_TICKS: Final = 3000
"""The time-out that the fix for W201 proposes: 30 s."""

_NUMBERS: Final = {row.mnemonic: row.number for row in COMMANDS}
_SPARE: Final = {row.mnemonic: row.spare for row in COMMANDS}
_WAIT_WORDS: Final = dict(BY_MNEMONIC["WAIT"].operands[0].words)
_CALC_WORDS: Final = dict(BY_MNEMONIC["CALC"].operands[0].words)
_COORD: Final = dict(BY_MNEMONIC["MVP"].operands[0].words)["COORD"]
_ETO_CONDITION: Final = dict(BY_MNEMONIC["JC"].operands[0].words)["ETO"]
_ETO_FLAG: Final = dict(BY_MNEMONIC["CLE"].operands[0].words)["ETO"]
_ALL_FLAGS: Final = dict(BY_MNEMONIC["CLE"].operands[0].words)["ALL"]
_WORDS: Final = {word for row in COMMANDS for operand in row.operands for word, _ in operand.words}
_WRITES_PARAMETER: Final = frozenset({"SAP", "AAP", "SGP", "AGP"})
_STORES_PARAMETER: Final = frozenset({"STAP", "RSAP", "STGP", "RSGP"})
_STORED_TABLES: Final = frozenset({7, 23})
"""Bank 0 parameters that STGP and RSGP take for a whole table (fidelity TOOL-9)."""
_COORDINATE_STORAGE: Final = global_parameters.BY_KEY["coordinate_storage"].number
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


def lint(assembly: Assembly, *, model: int = 343) -> tuple[Diagnostic, ...]:
    """The findings about a program, in the order of its files and lines; those of `assemble` are not repeated.

    model: the module that it is for, 341, 342 or 343
    """
    linter = _Linter(assembly, model)
    linter.check_commands()
    linter.check_names()
    if assembly.ok:
        linter.check_flow()
        linter.check_program()
    order = {name: index for index, name in enumerate(assembly.sources)}
    linter.found.sort(key=lambda item: (order[item.location.file], *item.location[1:], item.code))
    return tuple(linter.found)


def ignored_codes(comment: str) -> frozenset[str] | None:
    """The codes that a comment keeps quiet on its line: none, some, or None for all."""
    match = _IGNORE.search(comment)
    if match is None:
        return frozenset()
    codes = re.findall(r"W\d+", match.group(1).upper())
    return frozenset(codes) if codes else None


class _Linter:
    def __init__(self, assembly: Assembly, model: int) -> None:
        self.assembly = assembly
        self.model = model
        self.found: list[Diagnostic] = []
        self.by_kind: Mapping[str, Callable[[Code, Instruction, Operand], None]] = {
            "motor": self.motor, "axis_parameter": self.axis_parameter, "global_parameter": self.global_parameter,
            "port": self.port, "number": self.number, "coordinate": self.coordinate, "address": self.address,
        }  # fmt: skip

    def report(self, code: str, location: Location, text: str, fixes: Iterable[Fix] = ()) -> None:
        line = self.assembly.lines[location.file][location.line - 1]
        if line.comment is not None:
            text_of_line = self.assembly.sources[location.file][location.line - 1]
            ignored = ignored_codes(text_of_line[line.comment :])
            if ignored is None or code in ignored:
                return
        self.found.append(Diagnostic(location, RULES[code].severity, code, text, tuple(fixes)))

    # Single commands

    def check_commands(self) -> None:
        for code in self.assembly.code:
            row, instruction = code.row, code.instruction
            if row is None or instruction is None:
                continue
            for operand in row.operands:
                check = self.by_kind.get(operand.kind)
                if check is not None:
                    check(code, instruction, operand)
            spare = _SPARE[row.mnemonic]
            if spare:
                self.surplus(code, instruction, spare)
            if row.mnemonic == "WAIT":
                self.wait(code, instruction)
            elif row.mnemonic == "CALC":
                self.calculation(code, instruction)

    def motor(self, code: Code, instruction: Instruction, operand: Operand) -> None:
        motor, name = instruction.motor, _name(code)
        if motor < MOTORS or (name in _SPECIAL_MOTORS and _SPECIAL_MOTORS[name](instruction)):
            return
        self.report(
            "W303", field_location(code, operand.field), f"no motor {motor}; there are 0 to {MOTORS - 1}"
        )

    def axis_parameter(self, code: Code, instruction: Instruction, operand: Operand) -> None:
        place, name = field_location(code, operand.field), _name(code)
        row = axis_parameters.BY_NUMBER.get(instruction.type)
        if row is None:
            self.report("W305", place, f"no axis parameter {instruction.type}")
        elif self.model not in row.models:
            self.report("W302", place, f"a TMCM-{self.model} has no parameter {row.number} ({row.name})")
        elif name in _WRITES_PARAMETER and not row.writable:
            self.report("W304", place, f"parameter {row.number} ({row.name}) is read-only")
        elif name in _STORES_PARAMETER and not row.stored:
            self.report("W306", place, f"parameter {row.number} ({row.name}) is not stored")
        elif name == "SAP":
            self.range("W301", code, (row.low, row.high), f"parameter {row.number} ({row.name})")

    def global_parameter(self, code: Code, instruction: Instruction, operand: Operand) -> None:
        place, name = field_location(code, operand.field), _name(code)
        number, bank = instruction.type, instruction.motor
        row = global_parameters.BY_NUMBER.get((bank, number))
        if bank not in (0, 2):
            self.report("W305", field_location(code, "motor"), f"no bank {bank}; there are 0 and 2")
        elif row is None:
            self.report("W305", place, f"no parameter {number} in bank {bank}")
        elif name in _WRITES_PARAMETER and not row.writable:
            self.report("W304", place, f"parameter {number} ({row.name}) is read-only")
        elif name in _STORES_PARAMETER and not (bank == 2 or number in _STORED_TABLES):
            reason = "is stored by SGP itself" if row.stored else "is not stored"
            self.report("W306", place, f"parameter {number} ({row.name}) {reason}")
        elif name == "SGP":
            self.range("W301", code, (row.low, row.high), f"parameter {number} ({row.name})")

    def port(self, code: Code, instruction: Instruction, operand: Operand) -> None:
        name, bank, port = _name(code), instruction.motor, instruction.type
        ports = _PORTS[name].get(bank)
        if ports is None:
            self.report("W305", field_location(code, "motor"), f"{name} has no bank {bank}")
        elif port not in ports:
            self.report("W305", field_location(code, operand.field), f"no port {port} in bank {bank}")

    def number(self, code: Code, instruction: Instruction, operand: Operand) -> None:
        name = _name(code)
        if name in ("SAP", "SGP"):
            return
        low, high = operand.low, operand.high
        if name == "SIO" and instruction.type != _ALL_PORTS:
            low, high = 0, 1
        elif name == "SCO" and instruction.motor == _COPY:
            return
        elif name == "MVP" and instruction.type == _COORD:
            low, high = 0, COORDINATES - 1
        self.range("W307", code, (low, high), f"the {operand.name} of {name}", operand.field)

    def coordinate(self, code: Code, _instruction: Instruction, operand: Operand) -> None:
        self.range("W307", code, (operand.low, operand.high), "the coordinate", operand.field)

    def address(self, code: Code, instruction: Instruction, operand: Operand) -> None:
        count = len(self.assembly.code)
        if not 0 <= instruction.value < count:
            text = f"address {instruction.value} is outside of the program, which ends at {count - 1}"
            self.report("W106", field_location(code, operand.field), text)

    def surplus(self, code: Code, instruction: Instruction, spare: tuple[Field, ...]) -> None:
        for field in spare:
            if getattr(instruction, field):
                name = _name(code)
                text = f"{name} does not look at its {field} field"
                if name in ("AAP", "AGP", "ACO"):
                    text += ": it takes the value from the accumulator"
                self.report("W403", field_location(code, field), text)

    def wait(self, code: Code, instruction: Instruction) -> None:
        if instruction.type in _ENDLESS_WAITS and instruction.value == 0:
            place = field_location(code, "value")
            fix = Fix(f"Wait {_TIMEOUT_TICKS // 100} s at most", (Edit(place, str(_TIMEOUT_TICKS)),))
            self.report("W201", place, f"WAIT {_ENDLESS_WAITS[instruction.type]} without a time-out", [fix])

    def calculation(self, code: Code, instruction: Instruction) -> None:
        if instruction.value == 0 and instruction.type in (_CALC_WORDS["DIV"], _CALC_WORDS["MOD"]):
            self.report("W309", field_location(code, "value"), "division by zero")

    def range(
        self, code: str, where: Code, limits: tuple[int, int], what: str, field: Field = "value"
    ) -> None:
        low, high = limits
        value = getattr(where.instruction, field)
        if low <= value <= high:
            return
        place = field_location(where, field)
        nearest = low if value < low else high
        fix = Fix(f"Change {value} to {nearest}", (Edit(place, str(nearest)),))
        self.report(code, place, f"{value} is out of range for {what}: {low} to {high}", [fix])

    # Names

    def check_names(self) -> None:
        for symbol in self.assembly.symbols.values():
            if symbol.definition.file != self.assembly.file:
                continue
            if not symbol.references:
                self.report("W401", symbol.definition, f"{symbol.kind} {shown(symbol.name)} is never used")
            key = symbol.name.upper()
            if symbol.kind == "constant" and (key in _WORDS or key in FUNCTIONS or key in BY_MNEMONIC):
                self.report("W402", symbol.definition, f"{key} is also a word of the language")

    # The whole program

    def check_flow(self) -> None:
        codes = self.assembly.code
        if not codes:
            return
        flow = Flow([code.instruction for code in codes])
        self.unreached(flow)
        if self.runs_past_end(flow):
            self.report("W102", codes[-1].location, "the program runs past its end", [self.stop_fix()])
        for address in sorted(flow.main):
            if address < flow.end and flow.program[address] is not None and _number(codes[address]) == RSUB:
                self.report("W104", codes[address].location, "no call is open here: RSUB is ignored")
        for address in sorted(flow.recursive):
            self.report("W105", codes[address].location, "this subroutine comes to call itself")
        for address in flow.calls:
            if flow.depth.get(address) == STACK_DEPTH and address not in flow.recursive:
                text = f"{STACK_DEPTH} calls may be open here already: this one is ignored then"
                self.report("W103", codes[address].location, text)
        for address in sorted(flow.looping):
            if address < flow.end and self.writes_eeprom(codes[address]):
                self.report("W202", codes[address].location, "the EEPROM is written at each turn of a loop")

    def unreached(self, flow: Flow) -> None:
        start = None
        for address in range(flow.end + 1):
            reached = address in flow.reachable or address == flow.end
            if not reached and start is None:
                start = address
            elif reached and start is not None:
                count = address - start
                text = (
                    "this is never reached" if count == 1 else f"these {count} instructions are never reached"
                )
                self.report("W101", self.assembly.code[start].location, text)
                start = None

    @staticmethod
    def runs_past_end(flow: Flow) -> bool:
        """Whether the last instruction leads on to the one behind it."""
        last = flow.end - 1
        instruction = flow.program[last]
        if last not in flow.reachable or instruction is None or flow.end not in flow.steps[last]:
            return False
        return instruction.number not in JUMPS or instruction.value != flow.end or instruction.number == JC

    def stop_fix(self) -> Fix:
        last = self.assembly.code[-1].location
        column = len(self.assembly.sources[last.file][last.line - 1]) + 1
        end = Location(last.file, last.line, column, column)
        return Fix("Add STOP", (Edit(end, "\n        STOP"),))

    def check_program(self) -> None:
        program = [(code, code.instruction) for code in self.assembly.code if code.instruction is not None]
        settable = self.coordinates_set(instruction for _, instruction in program)
        clears = any(i.number == _NUMBERS["CLE"] and i.type in (_ETO_FLAG, _ALL_FLAGS) for _, i in program)
        for code, instruction in program:
            number = instruction.number
            if number == _NUMBERS["MVP"] and instruction.type == _COORD:
                if settable is not None and instruction.value not in settable:
                    text = f"coordinate {instruction.value} is never set in this program"
                    self.report("W308", field_location(code, "value"), text)
            elif number == JC and instruction.type == _ETO_CONDITION and not clears:
                self.report("W203", code.location, "no CLE in this program clears ETO")

    def coordinates_set(self, program: Iterable[Instruction]) -> set[int] | None:
        """The coordinates that the program sets or reads from the EEPROM; None when that may be all."""
        known: set[int] = set()
        for number, type_, motor, value in program:
            if number == _NUMBERS["GCO"] and motor == _COPY:
                if type_ == 0:
                    return None
                known.add(type_)
            elif number == _NUMBERS["SGP"] and (type_, motor) == (_COORDINATE_STORAGE, 0) and value:
                return None
            elif number in (_NUMBERS["SCO"], _NUMBERS["CCO"], _NUMBERS["ACO"]) and motor != _COPY:
                known.add(type_)
        return known

    def writes_eeprom(self, code: Code) -> bool:
        instruction = code.instruction
        assert instruction is not None
        name = "" if code.row is None else code.row.mnemonic
        if name in ("SGP", "AGP") and instruction.motor == 0:
            row = global_parameters.BY_NUMBER.get((0, instruction.type))
            return row is not None and row.stored
        if name in ("STAP", "STGP"):
            return True
        if name == "SCO" and instruction.motor == _COPY:
            return True
        return name in ("SCO", "CCO", "ACO") and instruction.type > 0 and self.coordinates_in_eeprom

    @property
    def coordinates_in_eeprom(self) -> bool:
        """Whether the program puts the coordinates into the EEPROM."""
        wanted = (_NUMBERS["SGP"], _COORDINATE_STORAGE, 0, 1)
        return any(code.instruction == wanted for code in self.assembly.code)


def field_location(code: Code, field: Field) -> Location:
    """Where the operand for a field of the instruction stands; the whole command where it has none."""
    statement, row = code.line.statement, code.row
    if isinstance(statement, Command) and row is not None:
        fields = (*(operand.field for operand in row.operands), *row.spare)
        index = fields.index(field)
        operand = statement.operands[index] if index < len(statement.operands) else None
        if operand is not None:
            return Location(code.location.file, code.location.line, operand.start + 1, operand.end + 1)
    return code.location


def _name(code: Code) -> str:
    return code.row.mnemonic if code.row is not None else ""


def _number(code: Code) -> int:
    return code.instruction.number if code.instruction is not None else -1


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
