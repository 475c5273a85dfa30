"""From a command number to what it does.

Each row of `tmcl.commands` with a mnemonic that makes sense outside a program has a handler `do_<mnemonic>`.
Operand ranges are checked before it is called, by the row: a wrong type is status 3, a wrong motor, bank or value
status 4.  A handler gives back a status and the value of the reply: the command's own value where nothing is
read, 0 where reading fails (fidelity FW-5, FW-6).  A refused command changes nothing.  Program
addresses are the program's to check.

Direct mode and stand-alone programs use the same handlers; a program additionally loads the accumulator with what
a reading command returns.

Source: manual 6.4 to 6.7; order of checks: fidelity FW-7.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from tmcm34x.firmware import io
from tmcm34x.firmware.motion import X_ACTUAL
from tmcm34x.firmware.parameters import (
    EXTENSION,
    GLOBAL_READERS,
    GLOBAL_WRITERS,
    LOCK,
    OK,
    VARIABLES,
    axis_readers,
    axis_writers,
    restore_global,
    store_global,
)
from tmcm34x.firmware.storage import STORED_AXIS_PARAMETERS
from tmcm34x.tmcl.commands import (
    COMMANDS,
    CONTROL_FUNCTIONS,
    COORDINATES,
    INT32_MAX,
    INT32_MIN,
    MOTORS,
    POSITION_MAX,
    POSITION_MIN,
    USER_VARIABLES,
    Command,
)
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.firmware.module import Module

Result = tuple[int, int]
"""Status and value of the reply."""
Handler = Callable[[int, int, int], Result]
"""Takes type, motor and value of a command."""

WRONG_TYPE: Final = Status.WRONG_TYPE
INVALID_VALUE: Final = Status.INVALID_VALUE
NOT_AVAILABLE: Final = Status.NOT_AVAILABLE
LOCKED: Final = Status.EEPROM_LOCKED

ABS: Final = 0
REL: Final = 1
COORD: Final = 2
TOGETHER: Final = 0x80
INTERPOLATED: Final = 0x40
"""Bits of MVP COORD's motor field that make a mask of the others."""
ALL_COORDINATES: Final = 255
"""Motor of SCO and GCO that copies between RAM and EEPROM."""
ALL_MOTORS: Final = 7
"""Motor of CCO that captures all."""

_LIMITS: Final = {"type": (0, 255), "motor": (0, 255), "value": (INT32_MIN, INT32_MAX)}
_FIELD_STATUS: Final = {"type": WRONG_TYPE, "motor": INVALID_VALUE, "value": INVALID_VALUE}
_DIRECT: Final = frozenset({"direct"})


class Dispatcher:
    """The handlers of one module, by command number."""

    def __init__(self, module: Module) -> None:
        self._module = module
        self._board = module.board
        self._axes = module.axes
        model = module.board.model.number
        self._axis_readers = axis_readers(model)
        self._axis_writers = axis_writers(model)
        self._stored = frozenset(row.number for row in STORED_AXIS_PARAMETERS[model])
        self._searches = module.searches
        self.handlers: list[Handler] = [self._unknown] * 256
        """What each command number 0..255 does; telegrams of ports take the control functions first."""
        for row in (*COMMANDS, *CONTROL_FUNCTIONS):
            self.handlers[row.number] = self._handler(row)

    def execute(self, instruction: Instruction) -> Result:
        """Do what `instruction` says."""
        number, type_, motor, value = instruction
        return self.handlers[number](type_, motor, value)

    # Checks by the rows

    def _handler(self, row: Command) -> Handler:
        if not row.where & _DIRECT:
            return self._not_here
        if row.mnemonic.startswith("UF"):
            return self._user_function(row.number - 64)
        handler = getattr(self, f"do_{row.mnemonic.lower() or row.number}")
        checks = {
            operand.field: (operand.low, operand.high)
            for operand in row.operands
            if operand.kind != "address" and (operand.low, operand.high) != _LIMITS[operand.field]
        }
        return _checked(handler, checks, reads="reads" in row.where) if checks else handler

    def _unknown(self, _type: int, _motor: int, value: int) -> Result:
        return Status.INVALID_COMMAND, value

    def _not_here(self, _type: int, _motor: int, value: int) -> Result:
        """Commands for programs alone (fidelity FW-8)."""
        return NOT_AVAILABLE, value

    def _user_function(self, n: int) -> Handler:
        """UF0..UF7: plain firmware has none (manual 6.7.33)."""

        def call(type_: int, motor: int, value: int) -> Result:
            function = self._module.user_functions.get(n)
            return function(self._module, type_, motor, value) if function else (NOT_AVAILABLE, value)

        return call

    # Motion

    def _group(self, motor: int) -> tuple[int, ...]:
        """All motors that do what `motor` does: those of its group index, unless that is 0."""
        group = self._axes[motor].values[213]
        if not group:
            return (motor,)
        return tuple(axis.motor for axis in self._axes if axis.values[213] == group)

    def _free(self, motor: int) -> None:
        """A motion command ends a reference search (fidelity FW-26)."""
        self._searches[motor].abort()

    def do_ror(self, _type: int, motor: int, value: int) -> Result:
        """ROR: turn toward rising positions.  Source: manual 6.7.1."""
        for each in self._group(motor):
            self._free(each)
            self._module.motion.rotate(each, value)
        return OK, value

    def do_rol(self, _type: int, motor: int, value: int) -> Result:
        """ROL: turn toward falling positions.  Source: manual 6.7.2."""
        for each in self._group(motor):
            self._free(each)
            self._module.motion.rotate(each, -value)
        return OK, value

    def do_mst(self, _type: int, motor: int, value: int) -> Result:
        """MST: come to rest along the ramp.  Source: manual 6.7.3; fidelity FW-22."""
        for each in self._group(motor):
            self._free(each)
            self._module.motion.stop(each)
        return OK, value

    def do_mvp(self, type_: int, motor: int, value: int) -> Result:
        """MVP: go to a position, by an offset, or to a coordinate.

        Source: manual 6.7.4; the reply echoes the command's value, fidelity FW-5.
        """
        if type_ == COORD and motor & (TOGETHER | INTERPOLATED):
            status = self._move_together(motor, value)
        elif motor >= MOTORS:
            status = INVALID_VALUE
        else:
            status = self._move_group(type_, self._group(motor), value)
        return status, value

    def _move_group(self, type_: int, motors: tuple[int, ...], value: int) -> Status:
        if type_ == COORD:
            if not 0 <= value < COORDINATES:
                return INVALID_VALUE
            targets = [self._coordinate(value, motor) for motor in motors]
        elif type_ == REL:
            targets = [self._axes[motor].read(X_ACTUAL) + value for motor in motors]
        else:
            targets = [value] * len(motors)
        if any(not POSITION_MIN <= target <= POSITION_MAX for target in targets):
            return INVALID_VALUE
        for motor, target in zip(motors, targets, strict=True):
            self._free(motor)
            self._module.motion.move_to(motor, target)
        return OK

    def _move_together(self, field: int, coordinate: int) -> Status:
        mask = field & ~(TOGETHER | INTERPOLATED)
        both = field & TOGETHER and field & INTERPOLATED
        if both or not 0 < mask < 1 << MOTORS or not 0 <= coordinate < COORDINATES:
            return INVALID_VALUE
        motors = [motor for motor in range(MOTORS) if mask >> motor & 1]
        for motor in motors:
            self._free(motor)
        targets = [(motor, self._coordinate(coordinate, motor)) for motor in motors]
        if field & INTERPOLATED:
            self._module.motion.move_interpolated(targets)
        else:
            for motor, target in targets:
                self._module.motion.move_to(motor, target)
        return OK

    def do_rfs(self, type_: int, motor: int, value: int) -> Result:
        """RFS: start or abort a reference search, or tell its state.  Source: manual 6.7.13."""
        if type_ == 2:
            return OK, self._searches[motor].state
        for each in self._group(motor):
            search = self._searches[each]
            if type_ == 0:
                search.start()
            else:
                search.stop()
        return OK, value

    # Axis parameters

    def do_sap(self, type_: int, motor: int, value: int) -> Result:
        """SAP: set an axis parameter.  Source: manual 6.7.5."""
        entry = self._axis_writers[type_]
        if entry is None:
            return WRONG_TYPE, value
        row, write = entry
        if not row.low <= value <= row.high:
            return INVALID_VALUE, value
        return write(self._module, self._axes[motor], value), value

    def do_aap(self, type_: int, motor: int, value: int) -> Result:
        """AAP: SAP with the accumulator, in direct mode the program's (fidelity FW-9).  Source: manual 6.7.30."""
        return self.do_sap(type_, motor, self._module.program.accumulator)[0], value

    def do_gap(self, type_: int, motor: int, _value: int) -> Result:
        """GAP: read an axis parameter.  Source: manual 6.7.6."""
        reader = self._axis_readers[type_]
        if reader is None:
            return WRONG_TYPE, 0
        return OK, reader(self._module, self._axes[motor])

    def do_stap(self, type_: int, motor: int, value: int) -> Result:
        """STAP: store the present value of an axis parameter.  Source: manual 6.7.7."""
        if type_ not in self._stored:
            return WRONG_TYPE, value
        if self._module.eeprom.locked:
            return LOCKED, value
        self._module.eeprom.set_axis_value(motor, type_, self._axes[motor].values[type_])
        return OK, value

    def do_rsap(self, type_: int, motor: int, value: int) -> Result:
        """RSAP: bring the stored value of an axis parameter back.  Source: manual 6.7.8."""
        if type_ not in self._stored:
            return WRONG_TYPE, value
        return self.do_sap(type_, motor, self._module.eeprom.axis_values[motor][type_])[0], value

    # Global parameters

    def do_sgp(self, type_: int, bank: int, value: int) -> Result:
        """SGP: set a global parameter or user variable.  Source: manual 6.7.9."""
        return self._set_global(type_, bank, value), value

    def do_agp(self, type_: int, bank: int, value: int) -> Result:
        """AGP: SGP with the accumulator.  Source: manual 6.7.31."""
        return self._set_global(type_, bank, self._module.program.accumulator), value

    def _set_global(self, type_: int, bank: int, value: int) -> Status:
        module = self._module
        if bank == VARIABLES:
            if type_ >= USER_VARIABLES:
                return WRONG_TYPE
            module.program.wake()
            module.program.variables[type_] = value
            return OK
        if bank:
            return self._set_extension(type_, bank, value)
        entry = GLOBAL_WRITERS.get(type_)
        if entry is None:
            return WRONG_TYPE
        row, write = entry
        if row.stored and type_ != LOCK and module.eeprom.locked:
            return LOCKED
        return write(module, value) if row.low <= value <= row.high else INVALID_VALUE

    def _set_extension(self, type_: int, bank: int, value: int) -> Status:
        """Bank 1 has what a customer's extension put there; plain firmware has no bank 1 (fidelity FW-93)."""
        parameters = self._module.user_parameters
        if bank != EXTENSION or not parameters:
            return INVALID_VALUE
        if type_ not in parameters:
            return WRONG_TYPE
        self._module.program.wake()
        parameters[type_] = value
        return OK

    def _get_extension(self, type_: int, bank: int) -> Result:
        parameters = self._module.user_parameters
        if bank != EXTENSION or not parameters:
            return INVALID_VALUE, 0
        return (OK, parameters[type_]) if type_ in parameters else (WRONG_TYPE, 0)

    def do_ggp(self, type_: int, bank: int, _value: int) -> Result:
        """GGP: read a global parameter or user variable.  Source: manual 6.7.10."""
        if bank == VARIABLES:
            if type_ >= USER_VARIABLES:
                return WRONG_TYPE, 0
            return OK, self._module.program.variables[type_]
        if bank:
            return self._get_extension(type_, bank)
        reader = GLOBAL_READERS.get(type_)
        return (WRONG_TYPE, 0) if reader is None else (OK, reader(self._module))

    def do_stgp(self, type_: int, bank: int, value: int) -> Result:
        """STGP: store a user variable, or a chip table.  Source: manual 6.7.11."""
        module = self._module
        if bank == VARIABLES:
            if type_ >= USER_VARIABLES:
                return WRONG_TYPE, value
            if module.eeprom.locked:
                return LOCKED, value
            module.eeprom.set_variable(type_, module.program.variables[type_])
            return OK, value
        return (INVALID_VALUE if bank else store_global(module, type_)), value

    def do_rsgp(self, type_: int, bank: int, value: int) -> Result:
        """RSGP: bring a stored user variable, or a chip table, back.  Source: manual 6.7.12."""
        module = self._module
        if bank == VARIABLES:
            if type_ >= USER_VARIABLES:
                return WRONG_TYPE, value
            module.program.wake()
            module.program.variables[type_] = module.eeprom.variables[type_]
            return OK, value
        return (INVALID_VALUE if bank else restore_global(module, type_)), value

    # Coordinates

    def _coordinate(self, n: int, motor: int) -> int:
        """Coordinate 0 is in RAM, the others where global parameter 84 says."""
        if n and self._module.eeprom.global_values[84]:
            return self._module.eeprom.coordinates[motor][n - 1]
        return self._module.coordinates[motor][n]

    def _set_coordinates(self, n: int, positions: dict[int, int]) -> Status:
        module = self._module
        if any(not POSITION_MIN <= position <= POSITION_MAX for position in positions.values()):
            return INVALID_VALUE
        if n and module.eeprom.global_values[84]:
            if module.eeprom.locked:
                return LOCKED
            for motor, position in positions.items():
                module.eeprom.set_coordinate(n, motor, position)
        else:
            for motor, position in positions.items():
                module.coordinates[motor][n] = position
        return OK

    def do_sco(self, type_: int, motor: int, value: int) -> Result:
        """SCO: set a coordinate; motor 255 copies one or (0) all from RAM to EEPROM.

        Source: manual 6.7.25; copying: fidelity FW-60.
        """
        if motor == ALL_COORDINATES:
            return self._store_coordinates(type_), value
        if motor >= MOTORS:
            return INVALID_VALUE, value
        return self._set_coordinates(type_, {motor: value}), value

    def _store_coordinates(self, n: int) -> Status:
        module = self._module
        if module.eeprom.locked:
            return LOCKED
        for each in (n,) if n else range(1, COORDINATES):
            for motor, positions in enumerate(module.coordinates):
                module.eeprom.set_coordinate(each, motor, positions[each])
        return OK

    def do_gco(self, type_: int, motor: int, value: int) -> Result:
        """GCO: read a coordinate; motor 255 copies one or (0) all from EEPROM to RAM.

        Source: manual 6.7.26; copying: fidelity FW-60.
        """
        if motor == ALL_COORDINATES:
            for each in (type_,) if type_ else range(1, COORDINATES):
                for positions, stored in zip(
                    self._module.coordinates, self._module.eeprom.coordinates, strict=True
                ):
                    positions[each] = stored[each - 1]
            return OK, value
        return (OK, self._coordinate(type_, motor)) if motor < MOTORS else (INVALID_VALUE, 0)

    def do_cco(self, type_: int, motor: int, value: int) -> Result:
        """CCO: capture the actual position of a motor, or of all (7).  Source: manual 6.7.27; fidelity FW-61."""
        if MOTORS <= motor < ALL_MOTORS:
            return INVALID_VALUE, value
        motors = range(MOTORS) if motor == ALL_MOTORS else (motor,)
        return self._set_coordinates(type_, {each: self._axes[each].read(X_ACTUAL) for each in motors}), value

    def do_aco(self, type_: int, motor: int, value: int) -> Result:
        """ACO: set a coordinate to the accumulator.  Source: manual 6.7.28."""
        return self._set_coordinates(type_, {motor: self._module.program.accumulator}), value

    # Lines and registers

    def do_sio(self, type_: int, bank: int, value: int) -> Result:
        """SIO: set digital outputs.  Source: manual 6.7.14."""
        return io.set_output(self._board, type_, bank, value, self._module.program.accumulator), value

    def do_gio(self, type_: int, bank: int, _value: int) -> Result:
        """GIO: read a line.  Source: manual 6.7.15."""
        return io.get_line(self._board, type_, bank)

    def do_sac(self, type_: int, size: int, value: int) -> Result:
        """SAC: exchange bytes with an external SPI device.  Source: manual 6.7.24."""
        return io.exchange(self._board, type_, size, value, self._module.program.accumulator)

    def do_calc(self, type_: int, motor: int, value: int) -> Result:
        """CALC on the program's accumulator (fidelity FW-9).  Source: manual 6.7.16."""
        return self._module.program.calculate(Instruction(19, type_, motor, value)), value

    def do_calcx(self, type_: int, motor: int, value: int) -> Result:
        """CALCX on the program's registers (fidelity FW-9).  Source: manual 6.7.29."""
        return self._module.program.calculate(Instruction(33, type_, motor, value)), value

    # Control functions that answer like any command; the others are the ports' (module.py)

    def do_128(self, _type: int, _motor: int, value: int) -> Result:
        """Stop the program.  Source: manual 6.7.36."""
        return self._module.program.stop(), value

    def do_129(self, type_: int, _motor: int, value: int) -> Result:
        """Run the program from where it stands (0) or from an address (1).  Source: manual 6.7.36."""
        return self._module.program.run(value if type_ else None), value

    def do_130(self, _type: int, _motor: int, value: int) -> Result:
        """Execute one command of the program.  Source: manual 6.7.36."""
        return self._module.program.step(), value

    def do_131(self, _type: int, _motor: int, value: int) -> Result:
        """Stop the program and go back to its start.  Source: manual 6.7.36."""
        return self._module.program.reset(), value

    def do_132(self, _type: int, _motor: int, value: int) -> Result:
        """Store the commands to come.  Source: manual 6.7.36."""
        return self._module.program.start_download(value), value

    def do_133(self, _type: int, _motor: int, value: int) -> Result:
        """Execute commands again.  Source: manual 6.7.36."""
        return self._module.program.quit_download(), value

    def do_134(self, _type: int, _motor: int, value: int) -> Result:
        """Read the program memory: the value field of the stored command; ports answer with all of it."""
        stored = self._module.program.memory.read(value)
        return (OK, stored.value) if isinstance(stored, Instruction) else (stored, value)

    def do_135(self, _type: int, _motor: int, _value: int) -> Result:
        """What the program is doing.  Source: manual 6.7.36."""
        return OK, self._module.program.state

    def do_136(self, _type: int, _motor: int, _value: int) -> Result:
        """The binary version; ports answer type 0 with the string.  Source: manual 6.7.36; fidelity FW-81."""
        return OK, self._board.model.binary_version

    def do_137(self, _type: int, _motor: int, value: int) -> Result:
        """Restore the factory settings and reset the module.  Source: manual 6.7.36; fidelity FW-11."""
        if self._module.eeprom.locked:
            return LOCKED, value
        self._module.eeprom.restore_defaults()
        self._module.reset()
        return OK, value

    def do_138(self, _type: int, _motor: int, value: int) -> Result:
        """The first reply of the position reached event; ports send the second.  Source: manual 6.7.34."""
        return OK, value

    def do_139(self, _type: int, _motor: int, value: int) -> Result:
        """ASCII mode is a port's; there is none here."""
        return NOT_AVAILABLE, value


def _checked(handler: Handler, checks: dict[str, tuple[int, int]], *, reads: bool) -> Handler:
    """`handler` behind the range checks of its row, type first, then motor, then value."""
    type_low, type_high = checks.get("type", _LIMITS["type"])
    motor_low, motor_high = checks.get("motor", _LIMITS["motor"])
    value_low, value_high = checks.get("value", _LIMITS["value"])

    def call(type_: int, motor: int, value: int) -> Result:
        if not type_low <= type_ <= type_high:
            return WRONG_TYPE, 0 if reads else value
        if not motor_low <= motor <= motor_high or not value_low <= value <= value_high:
            return INVALID_VALUE, 0 if reads else value
        return handler(type_, motor, value)

    return call
