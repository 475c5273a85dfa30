"""SAP, AAP, GAP, STAP, RSAP and SGP, AGP, GGP, STGP, RSGP.

Source: manual 6.7.5 to 6.7.12, 6.7.30, 6.7.31, chapters 7 and 8; fidelity FW-9, FW-12, FW-50 to FW-55, FW-93.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from tmcm34x.firmware.parameters.bank_0 import EXTENSION, VARIABLES, restore_global, store_global
from tmcm34x.tmcl.commands import USER_VARIABLES
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.firmware.state import ModuleState, Result

OK: Final = Status.OK


def do_sap(core: ModuleState, type_: int, motor: int, value: int) -> Result:
    """SAP: set an axis parameter.  Source: manual 6.7.5."""
    entry = core.tables.axis_writers[type_]
    if entry is None:
        return Status.WRONG_TYPE, value
    row, write = entry
    if not row.low <= value <= row.high:
        return Status.INVALID_VALUE, value
    return write(core, core.axes[motor], type_, value), value


def do_aap(core: ModuleState, type_: int, motor: int, value: int) -> Result:
    """AAP: SAP with the accumulator, in direct mode the program's (fidelity FW-9).  Source: manual 6.7.30."""
    return do_sap(core, type_, motor, core.application.accumulator)[0], value


def do_gap(core: ModuleState, type_: int, motor: int, _value: int) -> Result:
    """GAP: read an axis parameter.  Source: manual 6.7.6."""
    reader = core.tables.axis_readers[type_]
    if reader is None:
        return Status.WRONG_TYPE, 0
    return OK, reader(core, core.axes[motor], type_)


def do_stap(core: ModuleState, type_: int, motor: int, value: int) -> Result:
    """STAP: store the present value of an axis parameter.  Source: manual 6.7.7."""
    eeprom = core.eeprom
    if type_ not in core.tables.stored:
        return Status.WRONG_TYPE, value
    if eeprom.locked:
        return Status.EEPROM_LOCKED, value
    eeprom.set_axis_value(motor, type_, core.axes[motor].values[type_])
    return OK, value


def do_rsap(core: ModuleState, type_: int, motor: int, value: int) -> Result:
    """RSAP: bring the stored value of an axis parameter back.  Source: manual 6.7.8."""
    eeprom = core.eeprom
    if type_ not in core.tables.stored:
        return Status.WRONG_TYPE, value
    return do_sap(core, type_, motor, eeprom.axis_values[motor][type_])[0], value


def do_sgp(core: ModuleState, type_: int, bank: int, value: int) -> Result:
    """SGP: set a global parameter or user variable.  Source: manual 6.7.9."""
    return _set_global(core, type_, bank, value), value


def do_agp(core: ModuleState, type_: int, bank: int, value: int) -> Result:
    """AGP: SGP with the accumulator.  Source: manual 6.7.31."""
    return _set_global(core, type_, bank, core.application.accumulator), value


def _set_global(core: ModuleState, type_: int, bank: int, value: int) -> Status:
    if bank == VARIABLES:
        if type_ >= USER_VARIABLES:
            return Status.WRONG_TYPE
        core.application.wake()
        core.application.variables[type_] = value
        return OK
    if bank:
        return _set_extension(core, type_, bank, value)
    entry = core.tables.global_writers.get(type_)
    if entry is None:
        return Status.WRONG_TYPE
    row, write = entry
    if row.stored and not row.writable_when_locked and core.eeprom.locked:
        return Status.EEPROM_LOCKED
    return write(core, type_, value) if row.low <= value <= row.high else Status.INVALID_VALUE


def _set_extension(core: ModuleState, type_: int, bank: int, value: int) -> Status:
    """Bank 1 has what a customer's extension put there; plain firmware has no bank 1 (fidelity FW-93)."""
    parameters = core.user_parameters
    if bank != EXTENSION or not parameters:
        return Status.INVALID_VALUE
    if type_ not in parameters:
        return Status.WRONG_TYPE
    core.application.wake()
    parameters[type_] = value
    return OK


def do_ggp(core: ModuleState, type_: int, bank: int, _value: int) -> Result:
    """GGP: read a global parameter or user variable.  Source: manual 6.7.10."""
    if bank:
        return _get_variable(core, type_) if bank == VARIABLES else _get_extension(core, type_, bank)
    reader = core.tables.global_readers[type_]
    return (Status.WRONG_TYPE, 0) if reader is None else (OK, reader(core, type_))


def _get_variable(core: ModuleState, type_: int) -> Result:
    return (OK, core.application.variables[type_]) if type_ < USER_VARIABLES else (Status.WRONG_TYPE, 0)


def _get_extension(core: ModuleState, type_: int, bank: int) -> Result:
    parameters = core.user_parameters
    if bank != EXTENSION or not parameters:
        return Status.INVALID_VALUE, 0
    return (OK, parameters[type_]) if type_ in parameters else (Status.WRONG_TYPE, 0)


def do_stgp(core: ModuleState, type_: int, bank: int, value: int) -> Result:
    """STGP: store a user variable, or a chip table.  Source: manual 6.7.11."""
    if bank == VARIABLES:
        if type_ >= USER_VARIABLES:
            return Status.WRONG_TYPE, value
        if core.eeprom.locked:
            return Status.EEPROM_LOCKED, value
        core.eeprom.set_variable(type_, core.application.variables[type_])
        return OK, value
    return (Status.INVALID_VALUE if bank else store_global(core, type_)), value


def do_rsgp(core: ModuleState, type_: int, bank: int, value: int) -> Result:
    """RSGP: bring a stored user variable, or a chip table, back.  Source: manual 6.7.12."""
    if bank == VARIABLES:
        if type_ >= USER_VARIABLES:
            return Status.WRONG_TYPE, value
        core.application.wake()
        core.application.variables[type_] = core.eeprom.variables[type_]
        return OK, value
    return (Status.INVALID_VALUE if bank else restore_global(core, type_)), value
