"""Rules about names and about the control flow of the whole program."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Final

from tmcm34x.tmcl import global_parameters
from tmcm34x.tmcl.commands import BY_MNEMONIC, COMMANDS, STACK_DEPTH
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.numbers import COMMAND, GP
from tmcm34x.toolchain.assembler import Code, Symbol
from tmcm34x.toolchain.diagnostics import Edit, Fix, Location, shown
from tmcm34x.toolchain.expressions import FUNCTIONS
from tmcm34x.toolchain.flow import JC, JUMPS, RSUB, STOP, Flow
from tmcm34x.toolchain.linter.findings import Findings, field_location
from tmcm34x.toolchain.linter.fixes import forgetting, insertion

_COORD: Final = dict(BY_MNEMONIC["MVP"].operands[0].words)["COORD"]
_ASKS_ETO: Final = (JC, dict(BY_MNEMONIC["JC"].operands[0].words)["ETO"])
"""Command and type of a JC ETO."""
_ETO_FLAG: Final = dict(BY_MNEMONIC["CLE"].operands[0].words)["ETO"]
_ALL_FLAGS: Final = dict(BY_MNEMONIC["CLE"].operands[0].words)["ALL"]
_WORDS: Final = {word for row in COMMANDS for operand in row.operands for word, _ in operand.words}
_COPY: Final = 255
"""Motor field of SCO and GCO that copies between RAM and EEPROM."""


def check_names(found: Findings) -> None:
    """Report names without use, and names that are words of the language (W401, W402)."""
    routines = set(_routines(found))
    for symbol in found.assembly.symbols.values():
        if symbol.definition.file == found.assembly.file:
            used = symbol.references or symbol.name in routines or _entered(found, symbol)
            if not (used or symbol.name.upper() in found.mistaken):
                text = f"{symbol.kind} {shown(symbol.name)} is never used"
                found.report("W401", symbol.definition, text, forgetting(found, symbol))
            key = symbol.name.upper()
            if symbol.kind == "constant" and (key in _WORDS or key in FUNCTIONS or key in BY_MNEMONIC):
                found.report("W402", symbol.definition, f"{key} is also a TMCL word")


def _routines(found: Findings) -> Iterator[str]:
    """The labels that local labels belong to: `Move` where `.wait` stands for `Move_wait`."""
    for symbol in found.assembly.symbols.values():
        file, line, column, end = symbol.definition
        written = found.assembly.sources[file][line - 1][column - 1 : end - 1]
        if written.startswith("."):
            yield symbol.name[: -len(written)]


def _entered(found: Findings, symbol: Symbol) -> bool:
    """Whether a label names one of several entry points, for hosts to use."""
    return symbol.kind == "label" and len(found.entries) > 1 and symbol.value in found.entries


def check_flow(found: Findings, flow: Flow) -> None:
    """Report what the control flow shows (W101 to W106, W202)."""
    codes = found.assembly.code
    _unreached(found, flow)
    if _runs_past_end(flow):
        found.report("W102", codes[-1].location, "the program runs past its end", [_stop_fix(found)])
    _calls(found, flow)
    for address in sorted(flow.looping):
        if address < flow.end and _writes_eeprom(found, codes[address]):
            found.report("W202", codes[address].location, "the EEPROM is written in each pass of a loop")


def _calls(found: Findings, flow: Flow) -> None:
    codes = found.assembly.code
    for address in sorted(flow.main):
        if address < flow.end and _number_of(codes[address]) == RSUB:
            found.report("W104", codes[address].location, "no call is open here: RSUB is ignored")
    for address in sorted(flow.recursive):
        found.report("W105", codes[address].location, "this call is recursive")
    for address in flow.calls:
        if flow.depth.get(address) == STACK_DEPTH and address not in flow.recursive:
            text = f"{STACK_DEPTH} calls may be open here already; this one is then ignored"
            found.report("W103", codes[address].location, text)


def _unreached(found: Findings, flow: Flow) -> None:
    start = None
    end = flow.end - (
        _number_of(found.assembly.code[-1]) == STOP
    )  # a STOP at the end is a habit, not a mistake
    for address in range(end + 1):
        reached = address in flow.reachable or address == end
        if not reached and start is None:
            start = address
        elif reached and start is not None:
            count = address - start
            text = "unreachable instruction" if count == 1 else f"{count} unreachable instructions"
            found.report("W101", found.assembly.code[start].location, text)
            start = None


def _runs_past_end(flow: Flow) -> bool:
    """Whether the last instruction leads on to the one after it."""
    last = flow.end - 1
    instruction = flow.program[last]
    if last not in flow.reachable or instruction is None or flow.end not in flow.steps[last]:
        return False
    return instruction.number not in JUMPS or instruction.value != flow.end or instruction.number == JC


def _stop_fix(found: Findings) -> Fix:
    last = found.assembly.code[-1].location
    column = len(found.assembly.sources[last.file][last.line - 1]) + 1
    end = Location(last.file, last.line, column, column)
    return Fix("Add STOP", (Edit(end, "\n        STOP"),))


def check_program(found: Findings, flow: Flow) -> None:
    """Report commands that miss another one anywhere in the program (W203, W308)."""
    program = [(code, code.instruction) for code in found.assembly.code if code.instruction is not None]
    settable = _coordinates_set(instruction for _, instruction in program)
    clears = any(i.number == COMMAND.CLE and i.type in (_ETO_FLAG, _ALL_FLAGS) for _, i in program)
    for code, instruction in program:
        if instruction[:2] == (COMMAND.MVP, _COORD):
            if settable is not None and instruction.value not in settable:
                text = f"coordinate {instruction.value} is never set in this program"
                found.report("W308", field_location(code, "value"), text)
        elif instruction[:2] == _ASKS_ETO and not clears:
            found.report("W203", code.location, "no CLE in this program clears ETO", _cleared(found, flow))


def _cleared(found: Findings, flow: Flow) -> tuple[Fix, ...]:
    """The fix that clears ETO wherever a time-out leads to; none where anything else leads there too."""
    asking = {a: i.value for a, i in enumerate(flow.program) if i is not None and i[:2] == _ASKS_ETO}
    targets = sorted(set(asking.values()))
    for address, following in enumerate(flow.edges):
        others = following if address not in asking else following[:1]
        if any(target in others for target in targets):
            return ()
    if targets[0] < 0 or targets[-1] >= flow.end or set(targets) & set(flow.entries):
        return ()
    return insertion(found, [found.assembly.code[target] for target in targets], "CLE   ETO")


def _coordinates_set(program: Iterable[Instruction]) -> set[int] | None:
    """The coordinates that the program sets or reads from the EEPROM; None when that may be all."""
    known: set[int] = set()
    for number, type_, motor, value in program:
        if number == COMMAND.GCO and motor == _COPY:
            if type_ == 0:
                return None
            known.add(type_)
        elif number == COMMAND.SGP and (type_, motor) == (GP.COORDINATE_STORAGE, 0) and value:
            return None
        elif number in (COMMAND.SCO, COMMAND.CCO, COMMAND.ACO) and motor != _COPY:
            known.add(type_)
    return known


def _writes_eeprom(found: Findings, code: Code) -> bool:
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
    return name in ("SCO", "CCO", "ACO") and instruction.type > 0 and _coordinates_in_eeprom(found)


def _coordinates_in_eeprom(found: Findings) -> bool:
    """Whether the program puts the coordinates into the EEPROM."""
    wanted = (COMMAND.SGP, GP.COORDINATE_STORAGE, 0, 1)
    return any(code.instruction == wanted for code in found.assembly.code)


def _number_of(code: Code) -> int:
    return code.instruction.number if code.instruction is not None else -1
