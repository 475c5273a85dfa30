"""Power-on, power-off and reset of the firmware.

Source: manual 8.1 (64, 77, 84, 85); fidelity FW-90.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from tmcm34x.chips.registers import FIELDS
from tmcm34x.clock import MS
from tmcm34x.firmware import drivers, supervision
from tmcm34x.firmware.parameters.axis import restore_axes
from tmcm34x.tmcl.commands import COORDINATES
from tmcm34x.tmcl.global_parameters import EEPROM_MAGIC
from tmcm34x.tmcl.numbers import GP

if TYPE_CHECKING:
    from tmcm34x.firmware.state import ModuleState

_SMGP: Final = FIELDS["LSMD"][0]
_IF_CONFIGURATION: Final = FIELDS["EN_REFR"][0]


def switch_on(core: ModuleState) -> None:
    """Start the firmware: chips and settings from the EEPROM, all else as new."""
    if core.powered:
        return
    if core.eeprom.global_values[GP.EEPROM_MAGIC] != EEPROM_MAGIC:
        core.eeprom.restore_defaults()
    core.powered = True
    _forget(core)
    _start_chips(core)
    _restore(core)
    for port in core.ports:
        port.power_on()
    core.tell("power", -1)
    core.application.power_on(bool(core.eeprom.global_values[GP.AUTO_START]))
    settle(core)
    if core.boot is not None:
        core.boot.take_over(core)


def switch_off(core: ModuleState) -> None:
    """Cut the power: nothing moves, nothing answers, what is not stored is lost."""
    if core.powered:
        stop_firmware(core)
        core.powered = False


def cycle(core: ModuleState) -> None:
    """Switch off and on."""
    switch_off(core)
    switch_on(core)


def stop_firmware(core: ModuleState) -> None:
    """All motors stand still without current, the program stops, what is not stored is lost."""
    core.application.power_off()
    _forget(core)
    core.silent = False


def settle(core: ModuleState) -> None:
    """Do what follows from a command at once: 138's second reply, another baud rate."""
    motors, core.touched = core.touched, 0
    if core.requests:
        supervision.answer_requests(core, motors)
    if not core.outbox:
        core.baud_index = core.eeprom.global_values[GP.BAUD_RATE]


def _forget(core: ModuleState) -> None:
    core.circuit.reset()
    core.forget()


def _start_chips(core: ModuleState) -> None:
    """Tell the motion chips what board they are on (fidelity FW-90)."""
    model = core.circuit.model
    drivers.write_cells(core.circuit, 0, core.eeprom.driver_chain + core.eeprom.microstep_table)
    for chip in range(len(model.parts)):
        core.circuit.transfer(chip, _SMGP.write(model.smgp))
        core.circuit.transfer(chip, _IF_CONFIGURATION.write(model.if_configuration))


def _restore(core: ModuleState) -> None:
    """RAM from the EEPROM (manual 8.1, parameters 84 and 85)."""
    settings, eeprom = core.eeprom.global_values, core.eeprom
    core.silent = False
    core.tick_origin = core.now // MS
    core.baud_index = settings[GP.BAUD_RATE]
    core.encoder_interface = settings[GP.ENCODER_INTERFACE]
    keep_cleared = settings[GP.KEEP_USER_VARIABLES_CLEARED]
    core.application.variables[:] = [0] * len(eeprom.variables) if keep_cleared else eeprom.variables
    in_eeprom = settings[GP.COORDINATE_STORAGE]
    core.coordinates = [[0, *stored] if in_eeprom else [0] * COORDINATES for stored in eeprom.coordinates]
    restore_axes(core)
    core.take_settings()
    supervision.settings_changed(core)
