"""Rules about motion: moves that cannot end, targets that move nothing, waits that never end.

They look at a program as it stands, command by command in the order of its addresses, and take no jump back into
account: what they report is wrong on the path that the text shows.

Source: manual 6.7.22, 7.1; fidelity TOOL-16.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from tmcm34x.tmcl import axis_parameters
from tmcm34x.tmcl.commands import BY_MNEMONIC, MOTORS
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.numbers import AP, COMMAND
from tmcm34x.toolchain.flow import JUMPS, Flow
from tmcm34x.toolchain.linter.findings import Findings, Numbered, field_location

_POS: Final = dict(BY_MNEMONIC["WAIT"].operands[0].words)["POS"]
_TURNS: Final = frozenset({COMMAND.ROR, COMMAND.ROL, COMMAND.MST})
_SETS: Final = frozenset({COMMAND.SAP, COMMAND.AAP})
_LIMITS: Final = (AP.MAX_SPEED, AP.MAX_ACCELERATION)
"""What is 0 of a motor that never arrives."""
_DIVIDED: Final = {
    AP.RAMP_DIVISOR: (AP.MAX_ACCELERATION,),
    AP.PULSE_DIVISOR: (AP.MAX_SPEED, AP.MAX_ACCELERATION),
}
"""What each divisor is the unit of."""
_NAMES: Final = {AP.MAX_SPEED: "speed", AP.MAX_ACCELERATION: "acceleration"}


def _motors(instruction: Instruction) -> Iterator[int]:
    """The motors that a command is for."""
    motor = instruction.motor
    if motor < MOTORS:
        yield motor
    elif instruction.number == COMMAND.MVP:
        yield from (n for n in range(MOTORS) if motor >> n & 1)


class _Still:
    """Which motors have a speed or acceleration of 0, and where it was set."""

    def __init__(self, found: Findings) -> None:
        self._found = found
        self._zero: dict[tuple[int, int], int] = {}

    def see(self, address: int, instruction: Instruction) -> None:
        """One more command."""
        number, type_, motor, value = instruction
        if number in _SETS and type_ in _LIMITS:
            self._zero.pop((motor, type_), None)
            if number == COMMAND.SAP and value == 0:
                self._zero[motor, type_] = address
        elif number == COMMAND.MVP:
            for one in _motors(instruction):
                self._moves(address, one)
        elif number in JUMPS:
            self._zero.clear()

    def _moves(self, address: int, motor: int) -> None:
        for parameter in _LIMITS:
            where = self._zero.pop((motor, parameter), None)
            if where is not None:
                name = axis_parameters.BY_NUMBER[parameter].name
                text = f"with a {name} of 0, motor {motor} never reaches the target of address {address}"
                self._found.report("W311", field_location(self._found.assembly.code[where], "value"), text)


def still(found: Findings, _flow: Flow, program: Numbered) -> None:
    """A speed or acceleration of 0 that is in force at a move (W311)."""
    motors = _Still(found)
    for address, instruction in program:
        motors.see(address, instruction)


def divisors(found: Findings, _flow: Flow, program: Numbered) -> None:
    """A divisor set after what it is the unit of (W312)."""
    places: dict[tuple[int, int], list[int]] = {}
    for address, (number, type_, motor, _) in program:
        if number in _SETS:
            places.setdefault((type_, motor), []).append(address)
    for address, (number, type_, motor, _) in program:
        if number != COMMAND.SAP or type_ not in _DIVIDED:
            continue
        before = [(p, places[p, motor]) for p in _DIVIDED[type_] if (p, motor) in places]
        late = [f"{_NAMES[p]} (address {where[0]})" for p, where in before if where[-1] < address]
        if late:
            name = axis_parameters.BY_NUMBER[type_].name
            text = f"the {name} of motor {motor} is set after its {' and '.join(late)}"
            found.report("W312", found.assembly.code[address].location, text)


class _Turning:
    """Which motors are in velocity mode, and what the position of each was set to there."""

    def __init__(self) -> None:
        self.motors: set[int] = set()
        self.positions: dict[int, int] = {}

    def see(self, instruction: Instruction) -> None:
        """One more command."""
        number, type_, motor, value = instruction
        if number in _TURNS or (number == COMMAND.SAP and type_ == AP.TARGET_SPEED):
            self.motors.add(motor)
        elif number == COMMAND.MVP:
            self.motors.difference_update(_motors(instruction))
        elif number == COMMAND.SAP and type_ == AP.ACTUAL_POSITION:
            self.positions[motor] = value
        elif number in JUMPS:
            self.motors.clear()
            self.positions.clear()


def targets(found: Findings, _flow: Flow, program: Numbered) -> None:
    """A target position set in velocity mode (W313), unless the position is set with it or the mode is changed."""
    changed = {i.motor for _, i in program if i.number in _SETS and i.type == AP.RAMP_MODE}
    turning = _Turning()
    for index, (address, instruction) in enumerate(program):
        turning.see(instruction)
        number, type_, motor, value = instruction
        if (number, type_) != (COMMAND.SAP, AP.TARGET_POSITION) or motor not in turning.motors - changed:
            continue
        both = Instruction(COMMAND.SAP, AP.ACTUAL_POSITION, motor, value)
        if turning.positions.get(motor) != value and both not in [
            i for _, i in program[index + 1 : index + 2]
        ]:
            text = (
                f"motor {motor} is in velocity mode here: a target position alone moves nothing; MVP ABS does"
            )
            found.report("W313", found.assembly.code[address].location, text)


def arrivals(found: Findings, _flow: Flow, program: Numbered) -> None:
    """A WAIT POS for a motor that is never sent anywhere (W314)."""
    sent = {motor for _, i in program if i.number == COMMAND.MVP for motor in _motors(i)}
    sent |= {i.motor for _, i in program if i.number in _SETS and i.type == AP.TARGET_POSITION}
    for address, instruction in program:
        waits = instruction.number == COMMAND.WAIT and instruction.type == _POS
        if waits and instruction.motor < MOTORS and instruction.motor not in sent:
            text = f"no command of this program gives motor {instruction.motor} a target"
            found.report("W314", found.assembly.code[address].location, text)
