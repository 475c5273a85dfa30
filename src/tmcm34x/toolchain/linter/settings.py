"""Rules about parameters, variables, flags and the EEPROM: settings that have no effect or cannot be meant.

They look at a program as it stands, command by command in the order of its addresses, and take no jump back into
account: what they report is wrong on the path that the text shows.

Source: manual 6.7.22, 7.1; fidelity TOOL-16.
"""

from __future__ import annotations

from typing import Final

from tmcm34x.tmcl import axis_parameters
from tmcm34x.tmcl.commands import BY_MNEMONIC, USER_VARIABLES
from tmcm34x.tmcl.numbers import AP, COMMAND, GP
from tmcm34x.toolchain.diagnostics import Fix
from tmcm34x.toolchain.flow import JC, Flow
from tmcm34x.toolchain.linter import motion
from tmcm34x.toolchain.linter.findings import Findings, Numbered, field_location
from tmcm34x.toolchain.linter.fixes import insertion, removal

_CONDITIONS: Final = dict(BY_MNEMONIC["JC"].operands[0].words)
_TICKS: Final = dict(BY_MNEMONIC["WAIT"].operands[0].words)["TICKS"]
_NEEDY: Final = {row.number: row for row in axis_parameters.AXIS_PARAMETERS if row.needs}
"""Parameters that need hardware beside the module."""
_VARIABLES: Final = 2
"""The bank of the user variables."""
_SETS: Final = frozenset({COMMAND.SAP, COMMAND.AAP})
_SETS_GLOBAL: Final = frozenset({COMMAND.SGP, COMMAND.AGP})
_READERS: Final = frozenset({COMMAND.GAP, COMMAND.GGP, COMMAND.GIO})
_STORES: Final = frozenset({COMMAND.STAP, COMMAND.STGP})
_MOVES: Final = frozenset(
    {AP.TARGET_POSITION, AP.ACTUAL_POSITION, AP.TARGET_SPEED, AP.ACTUAL_SPEED, AP.RAMP_MODE}
)
"""Parameters whose first value acts at once, also where another one follows."""


def check_settings(found: Findings, flow: Flow) -> None:
    """Report settings and waits that cannot be meant (W204 to W206, W311 to W316, W504)."""
    program = [(address, i) for address, i in enumerate(flow.program) if i is not None]
    for rule in _RULES:
        rule(found, flow, program)


def _absent(found: Findings, _flow: Flow, program: Numbered) -> None:
    """The first use of each parameter that needs hardware which may be absent (W315)."""
    for address, row in needy_parameters(program).items():
        where = field_location(found.assembly.code[address], "type")
        found.report("W315", where, f"the {row.name} needs {row.needs}")


def needy_parameters(program: Numbered) -> dict[int, axis_parameters.AxisParameter]:
    """Parameters that need hardware beside the module, by the address of their first use."""
    first: dict[int, int] = {}
    for address, (number, type_, _, _) in program:
        if number in (COMMAND.SAP, COMMAND.AAP, COMMAND.GAP) and type_ in _NEEDY:
            first.setdefault(type_, address)
    return {address: _NEEDY[type_] for type_, address in first.items()}


def _variables(found: Findings, _flow: Flow, program: Numbered) -> None:
    """The first reading of each user variable that is never written (W316)."""
    writers = (*_SETS_GLOBAL, COMMAND.RSGP)
    written = {i.type for _, i in program if i.number in writers and i.motor == _VARIABLES}
    for address, (number, type_, bank, _) in program:
        if (number, bank) == (COMMAND.GGP, _VARIABLES) and type_ not in written and type_ < USER_VARIABLES:
            written.add(type_)
            text = f"user variable {type_} is read and never written in this program"
            found.report("W316", found.assembly.code[address].location, text)


def _flags(found: Findings, _flow: Flow, program: Numbered) -> None:
    """A JC on a flag that nothing in the program can set (W205)."""
    timed = any(i.number == COMMAND.WAIT and i.type != _TICKS and i.value for _, i in program)
    watched = any(i.number in _SETS and i.type == AP.MAX_ENCODER_DEVIATION for _, i in program)
    causes = {
        _CONDITIONS["ETO"]: (timed, "ETO: no WAIT in this program has a time-out"),
        _CONDITIONS["EDV"]: (watched, "EDV: no SAP in this program sets the maximum encoder deviation"),
    }
    for address, (number, type_, _, _) in program:
        possible, text = causes.get(type_, (True, ""))
        if number == JC and not possible:
            found.report("W205", field_location(found.assembly.code[address], "type"), text)


def _at_start(found: Findings, flow: Flow, program: Numbered) -> None:
    """EEPROM written whenever the module is switched on (W204)."""
    if not any(i == (COMMAND.SGP, GP.AUTO_START, 0, 1) for _, i in program):
        return
    for address, instruction in program:
        once = address in flow.reachable and address not in flow.looping
        if once and (instruction.number in _STORES or instruction[:3] == (COMMAND.SGP, GP.AUTO_START, 0)):
            text = "with automatic start the EEPROM is written at each power-on"
            found.report("W204", found.assembly.code[address].location, text)


def _polling(found: Findings, flow: Flow, _program: Numbered) -> None:
    """A loop that reads again and again without a WAIT (W206)."""
    for loop in flow.loops:
        inside = [flow.program[address] for address in loop]
        numbers = {i.number for i in inside if i is not None}
        if numbers & _READERS and not numbers & {COMMAND.WAIT, COMMAND.CSUB}:
            first = found.assembly.code[min(loop)]
            fixes = insertion(found, [first], "WAIT  TICKS, 0, 1")
            found.report("W206", first.location, "this loop polls without a WAIT", fixes)


def _twice(found: Findings, _flow: Flow, program: Numbered) -> None:
    """A value that is written over before anything can use it (W504)."""
    labels = {symbol.value for symbol in found.assembly.symbols.values() if symbol.kind == "label"}
    written: dict[tuple[bool, int, int], int] = {}
    for address, (number, type_, motor, _) in program:
        if address in labels or number not in _SETS | _SETS_GLOBAL:
            written.clear()
        if number not in _SETS and (number not in _SETS_GLOBAL or motor != _VARIABLES):
            continue
        if number in _SETS and not _has(found.model, type_):
            continue
        place = (number in _SETS, type_, motor)
        if place in written:
            code = found.assembly.code[written[place]]
            text = f"this value is overwritten at address {address} before it is used"
            found.report("W504", code.location, text, _without(found, place, written[place]))
        written[place] = address


def _has(model: int, parameter: int) -> bool:
    """Whether a model has an axis parameter; where it has not, that is what is reported."""
    row = axis_parameters.BY_NUMBER.get(parameter)
    return row is not None and model in row.models


def _without(found: Findings, place: tuple[bool, int, int], address: int) -> tuple[Fix, ...]:
    """The fix that takes away a write without effect."""
    axis, type_, _ = place
    return () if axis and type_ in _MOVES else removal(found, found.assembly.code[address])


_RULES: Final = (
    motion.still, motion.divisors, motion.targets, motion.arrivals, _absent, _variables, _flags, _at_start, _polling,
    _twice,
)  # fmt: skip
