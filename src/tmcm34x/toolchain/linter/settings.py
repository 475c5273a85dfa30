"""Rules about parameters, motion and variables: settings that have no effect, or that make a program wait for ever.

They look at a program as it stands, command by command in the order of its addresses, and take no jump back into
account: what they name is wrong on the way that the text shows.

Source: manual 6.7.22, 7.1; fidelity TOOL-16.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from tmcm34x.tmcl import axis_parameters, global_parameters
from tmcm34x.tmcl.commands import COMMANDS, MOTORS, USER_VARIABLES
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.toolchain.flow import JC, JUMPS, Flow
from tmcm34x.toolchain.linter.findings import Findings, field_location, insertion

_NUMBERS: Final = {row.mnemonic: row.number for row in COMMANDS}
_WORDS: Final = {row.mnemonic: dict(row.operands[0].words) for row in COMMANDS if row.operands}
_SAP, _AAP, _GAP = (_NUMBERS[name] for name in ("SAP", "AAP", "GAP"))
_SGP, _AGP, _GGP = (_NUMBERS[name] for name in ("SGP", "AGP", "GGP"))
_MVP, _WAIT, _CSUB = (_NUMBERS[name] for name in ("MVP", "WAIT", "CSUB"))
_TURNS: Final = frozenset(_NUMBERS[name] for name in ("ROR", "ROL", "MST"))
_TARGET, _ACTUAL, _SPEED, _ACCELERATION = (
    axis_parameters.BY_KEY[key].number
    for key in ("target_position", "actual_position", "max_speed", "max_acceleration")
)
_TARGET_SPEED: Final = axis_parameters.BY_KEY["target_speed"].number
_DIVISORS: Final = {axis_parameters.BY_KEY[key].number: key for key in ("ramp_divisor", "pulse_divisor")}
_NEEDY: Final = {row.number: row for row in axis_parameters.AXIS_PARAMETERS if row.needs}
"""Parameters that need hardware beside the module."""
_DEVIATION: Final = axis_parameters.BY_KEY["max_encoder_deviation"].number
_AUTO_START: Final = global_parameters.BY_KEY["auto_start"].number
_VARIABLES: Final = 2
_COORD, _RELATIVE = _WORDS["MVP"]["COORD"], _WORDS["MVP"]["REL"]
_READERS: Final = frozenset(_NUMBERS[name] for name in ("GAP", "GGP", "GIO"))
_STORES: Final = frozenset({_NUMBERS["STAP"], _NUMBERS["STGP"]})

Numbered = list[tuple[int, Instruction]]


def check_settings(found: Findings, flow: Flow) -> None:
    """Report settings and waits that cannot be meant (W204 to W206, W311 to W316, W504)."""
    program = [(address, i) for address, i in enumerate(flow.program) if i is not None]
    for rule in _RULES:
        rule(found, flow, program)


def _motors(instruction: Instruction) -> Iterator[int]:
    """The motors that a command is for."""
    motor = instruction.motor
    if motor < MOTORS:
        yield motor
    elif instruction.number == _MVP:
        yield from (n for n in range(MOTORS) if motor >> n & 1)


def _still(found: Findings, _flow: Flow, program: Numbered) -> None:
    """A speed or acceleration of 0 that is in force at a move (W311)."""
    zero: dict[tuple[int, int], int] = {}
    for address, instruction in program:
        number, type_, motor, value = instruction
        if number in (_SAP, _AAP) and type_ in (_SPEED, _ACCELERATION):
            zero.pop((motor, type_), None)
            if number == _SAP and value == 0:
                zero[motor, type_] = address
        elif number == _MVP:
            for one in _motors(instruction):
                for parameter in (_SPEED, _ACCELERATION):
                    where = zero.pop((one, parameter), None)
                    if where is not None:
                        name = axis_parameters.BY_NUMBER[parameter].name
                        text = (
                            f"with a {name} of 0, motor {one} never arrives where address {address} sends it"
                        )
                        found.report("W311", field_location(found.assembly.code[where], "value"), text)
        elif number in JUMPS:
            zero.clear()


def _divisors(found: Findings, _flow: Flow, program: Numbered) -> None:
    """A divisor set behind the acceleration (W312)."""
    last: dict[tuple[int, int], int] = {}
    for address, (number, type_, motor, _) in program:
        if number in (_SAP, _AAP):
            last[type_, motor] = address
    first: dict[tuple[int, int], int] = {}
    for address, (number, type_, motor, _) in program:
        if number != _SAP:
            continue
        first.setdefault((type_, motor), address)
        before = first.get((_ACCELERATION, motor))
        if type_ in _DIVISORS and before is not None and last[_ACCELERATION, motor] < address:
            name = axis_parameters.BY_NUMBER[type_].name
            text = f"the {name} is set behind the acceleration of motor {motor} (address {before})"
            found.report("W312", found.assembly.code[address].location, text)


def _target(found: Findings, _flow: Flow, program: Numbered) -> None:
    """A target position set in velocity mode (W313)."""
    turning: set[int] = set()
    zeroed: dict[int, int] = {}
    for address, instruction in program:
        number, type_, motor, value = instruction
        if number in _TURNS or (number == _SAP and type_ == _TARGET_SPEED):
            turning.add(motor)
        elif number == _MVP:
            turning.difference_update(_motors(instruction))
        elif number == _SAP and type_ == _ACTUAL:
            zeroed[motor] = value
        elif number == _SAP and type_ == _TARGET and motor in turning and zeroed.get(motor) != value:
            text = (
                f"motor {motor} is in velocity mode here: a target position alone moves nothing; MVP ABS does"
            )
            found.report("W313", found.assembly.code[address].location, text)
        elif number in JUMPS:
            turning.clear()
            zeroed.clear()


def _arrival(found: Findings, _flow: Flow, program: Numbered) -> None:
    """A WAIT POS for a motor that is never sent anywhere (W314)."""
    sent = {motor for _, i in program if i.number == _MVP for motor in _motors(i)}
    sent |= {i.motor for _, i in program if i.number in (_SAP, _AAP) and i.type == _TARGET}
    for address, instruction in program:
        waits = instruction.number == _WAIT and instruction.type == _WORDS["WAIT"]["POS"]
        if waits and instruction.motor < MOTORS and instruction.motor not in sent:
            text = f"nothing in this program sends motor {instruction.motor} to a position"
            found.report("W314", found.assembly.code[address].location, text)


def _absent(found: Findings, _flow: Flow, program: Numbered) -> None:
    """The first use of each parameter that needs hardware which may be absent (W315)."""
    for address, row in needy_parameters(program).items():
        where = field_location(found.assembly.code[address], "type")
        found.report("W315", where, f"the {row.name} needs {row.needs}")


def needy_parameters(program: Numbered) -> dict[int, axis_parameters.AxisParameter]:
    """Parameters that need hardware beside the module, by the address of their first use."""
    first: dict[int, int] = {}
    for address, (number, type_, _, _) in program:
        if number in (_SAP, _AAP, _GAP) and type_ in _NEEDY:
            first.setdefault(type_, address)
    return {address: _NEEDY[type_] for type_, address in first.items()}


def _variables(found: Findings, _flow: Flow, program: Numbered) -> None:
    """User variables that are read and never written (W316)."""
    written = {i.type for _, i in program if i.number in (_SGP, _AGP) and i.motor == _VARIABLES}
    restored = {i.type for _, i in program if i.number == _NUMBERS["RSGP"] and i.motor == _VARIABLES}
    for address, (number, type_, bank, _) in program:
        if (
            number == _GGP
            and bank == _VARIABLES
            and type_ < USER_VARIABLES
            and type_ not in written | restored
        ):
            written.add(type_)
            text = f"user variable {type_} is read and never written in this program"
            found.report("W316", found.assembly.code[address].location, text)


def _flags(found: Findings, _flow: Flow, program: Numbered) -> None:
    """A JC on a flag that nothing in the program can set (W205)."""
    timed = any(i.number == _WAIT and i.type != _WORDS["WAIT"]["TICKS"] and i.value for _, i in program)
    watched = any(i.number in (_SAP, _AAP) and i.type == _DEVIATION for _, i in program)
    causes = {
        _WORDS["JC"]["ETO"]: (timed, "ETO: no WAIT in this program has a time-out"),
        _WORDS["JC"]["EDV"]: (watched, "EDV: no SAP in this program sets the maximum encoder deviation"),
    }
    for address, (number, type_, _, _) in program:
        possible, text = causes.get(type_, (True, ""))
        if number == JC and not possible:
            found.report("W205", field_location(found.assembly.code[address], "type"), text)


def _at_start(found: Findings, flow: Flow, program: Numbered) -> None:
    """EEPROM written whenever the module is switched on (W204)."""
    if not any(i == (_SGP, _AUTO_START, 0, 1) for _, i in program):
        return
    for address, instruction in program:
        once = address in flow.reachable and address not in flow.looping
        if once and (instruction.number in _STORES or instruction[:3] == (_SGP, _AUTO_START, 0)):
            text = "with automatic start the EEPROM is written at each power-on"
            found.report("W204", found.assembly.code[address].location, text)


def _polling(found: Findings, flow: Flow, program: Numbered) -> None:
    """A loop that reads again and again without a WAIT (W206)."""
    for loop in flow.loops:
        inside = [flow.program[address] for address in loop]
        numbers = {i.number for i in inside if i is not None}
        if numbers & _READERS and not numbers & {_WAIT, _CSUB}:
            first = found.assembly.code[min(loop)]
            fixes = insertion(found, first, "WAIT  TICKS, 0, 1")
            found.report("W206", first.location, "this loop polls without a WAIT", fixes)
    del program


def _twice(found: Findings, _flow: Flow, program: Numbered) -> None:
    """A value that is written over before anything can use it (W504)."""
    labels = {symbol.value for symbol in found.assembly.symbols.values() if symbol.kind == "label"}
    written: dict[tuple[int, int, int], int] = {}
    for address, (number, type_, motor, _) in program:
        if address in labels or number not in (_SAP, _SGP, _AGP, _AAP):
            written.clear()
        kind = _SAP if number in (_SAP, _AAP) else _SGP
        if number in (_SAP, _AAP) or (number in (_SGP, _AGP) and motor == _VARIABLES):
            before = written.get((kind, type_, motor))
            if before is not None:
                text = f"this value is overwritten at address {address} before it is used"
                found.report("W504", found.assembly.code[before].location, text)
            written[kind, type_, motor] = address


_RULES: Final = (
    _still, _divisors, _target, _arrival, _absent, _variables, _flags, _at_start, _polling, _twice,
)  # fmt: skip
