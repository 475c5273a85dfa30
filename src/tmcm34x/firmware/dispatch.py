"""From a command number to what it does.

Each row of `tmcl.commands` with a mnemonic that makes sense outside a program has a function `do_<mnemonic>` in
`commands`.  Operand ranges are checked before it is called, by the row: a wrong type is status 3, a wrong motor, bank
or value status 4.  Program addresses are the program's to check.

Direct mode and stand-alone programs use the same table; a program additionally loads the accumulator with what
a reading command returns.

Source: manual 6.4 to 6.7; order of checks: fidelity FW-7.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Final

from tmcm34x.firmware.commands import coordinates, io, motion, parameters
from tmcm34x.firmware.state import CommandEntry
from tmcm34x.tmcl.commands import COMMANDS, CONTROL_FUNCTIONS, INT32_MAX, INT32_MIN, Command
from tmcm34x.tmcl.numbers import COMMAND
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.firmware.state import Handler, ModuleState, Result
    from tmcm34x.tmcl.datagram import Instruction

LIMITS: Final = {"type": (0, 255), "motor": (0, 255), "value": (INT32_MIN, INT32_MAX)}
"""What the fields of a telegram can hold."""
_CONTROL: Final = frozenset(row.number for row in CONTROL_FUNCTIONS)
_USER_FUNCTIONS: Final = range(COMMAND.UF0, COMMAND.UF7 + 1)


def do_unknown(_core: ModuleState, _type: int, _motor: int, value: int) -> Result:
    """A command number that this firmware does not know."""
    return Status.INVALID_COMMAND, value


def do_program_only(_core: ModuleState, _type: int, _motor: int, value: int) -> Result:
    """A command for programs alone (fidelity FW-8)."""
    return Status.NOT_AVAILABLE, value


HANDLERS: Final[Mapping[int, Handler]] = {
    COMMAND.ROR: motion.do_ror,
    COMMAND.ROL: motion.do_rol,
    COMMAND.MST: motion.do_mst,
    COMMAND.MVP: motion.do_mvp,
    COMMAND.SAP: parameters.do_sap,
    COMMAND.GAP: parameters.do_gap,
    COMMAND.STAP: parameters.do_stap,
    COMMAND.RSAP: parameters.do_rsap,
    COMMAND.SGP: parameters.do_sgp,
    COMMAND.GGP: parameters.do_ggp,
    COMMAND.STGP: parameters.do_stgp,
    COMMAND.RSGP: parameters.do_rsgp,
    COMMAND.RFS: motion.do_rfs,
    COMMAND.SIO: io.do_sio,
    COMMAND.GIO: io.do_gio,
    COMMAND.CALC: io.do_calc,
    COMMAND.SAC: io.do_sac,
    COMMAND.SCO: coordinates.do_sco,
    COMMAND.GCO: coordinates.do_gco,
    COMMAND.CCO: coordinates.do_cco,
    COMMAND.CALCX: io.do_calcx,
    COMMAND.AAP: parameters.do_aap,
    COMMAND.AGP: parameters.do_agp,
    COMMAND.ACO: coordinates.do_aco,
    **{number: partial(io.do_user_function, number - COMMAND.UF0) for number in _USER_FUNCTIONS},
}
"""What does each command that a host or a program may give."""


def entry(row: Command, handler: Handler) -> CommandEntry:
    """`handler` with the ranges that `row` sets; addresses are the program's to check."""
    ranges = dict(LIMITS)
    for operand in row.operands:
        if operand.kind != "address":
            ranges[operand.field] = operand.low, operand.high
    type_, motor, value = ranges["type"], ranges["motor"], ranges["value"]
    plain = (type_, (0, motor[1]), value) == (LIMITS["type"], motor, LIMITS["value"])
    return CommandEntry(handler, motor[1], "reads" in row.where, None if plain else (*type_, *motor, *value))


def _entries() -> tuple[CommandEntry, ...]:
    entries = [CommandEntry(do_unknown)] * 256
    for row in COMMANDS:
        handler = HANDLERS.get(row.number)
        entries[row.number] = CommandEntry(do_program_only) if handler is None else entry(row, handler)
    return tuple(entries)


ENTRIES: Final = _entries()
"""Every command number 0..255; control functions are added by the module (`control`)."""


def execute(core: ModuleState, number: int, type_: int, motor: int, value: int) -> Result:
    """Do a command; gives back status and value of the reply."""
    handler, motor_high, reads, ranges = core.entries[number]
    if ranges is not None:
        type_low, type_high, motor_low, motor_high, low, high = ranges
        if not type_low <= type_ <= type_high:
            return Status.WRONG_TYPE, 0 if reads else value
        if motor < motor_low or not low <= value <= high:
            return Status.INVALID_VALUE, 0 if reads else value
    if motor > motor_high:
        return Status.INVALID_VALUE, 0 if reads else value
    return handler(core, type_, motor, value)


def execute_in_program(core: ModuleState, instruction: Instruction) -> Result:
    """Do a command of the stand-alone program; control functions are not for programs."""
    if instruction.number in _CONTROL:
        return Status.NOT_AVAILABLE, instruction.value
    return execute(core, *instruction)
