"""Global parameters of bank 0: what reading and writing each of them does.

A parameter without an entry in `READERS` or `WRITERS` lives in the EEPROM and does nothing else.

Source: manual 6.7.9 to 6.7.12, chapter 8; fidelity FW-50 to FW-55, TMCL-18.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Final

from tmcm34x.board.models import CELLS
from tmcm34x.chips.registers import DATA, FIELDS
from tmcm34x.clock import MS
from tmcm34x.firmware import currents, drivers, encoder, supervision
from tmcm34x.tmcl.datagram import signed32
from tmcm34x.tmcl.global_parameters import LOCK_KEY, UNLOCK_KEY
from tmcm34x.tmcl.numbers import AP, GP
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.firmware.state import GlobalReader, GlobalWriter, ModuleState

OK: Final = Status.OK
EXTENSION: Final = 1
"""Bank of a customer's extension of the firmware."""
VARIABLES: Final = 2
"""Bank of the user variables."""

_COVER_FIELDS: Final = {GP.COVER_POSITION: "COVER_POSITION", GP.COVER_LENGTH: "COVER_LEN"}
_WHOLE_REGISTERS: Final = {GP.COVER_DATAGRAM: FIELDS["COVER_DATAGRAM"][0], GP.SMGP: FIELDS["LSMD"][0]}
"""Common registers that are one number of 24 bits, written to all chips."""
_LONG_WORDS: Final = 16
_TABLES: Final = {GP.DRIVER_CHAIN_0: 0, GP.MICROSTEP_TABLE_0: CELLS}
"""First cell of the tables in the chip's RAM, by the parameter of its first long word."""
_FIRST_CELLS: Final = {
    first + n: start + 4 * n for first, start in _TABLES.items() for n in range(_LONG_WORDS)
}
"""First of the four cells of a long word."""


def _written_cover(core: ModuleState) -> int:
    """The cover register as it was written: the chip reads the position one higher."""
    register, position = FIELDS["COVER_POSITION"]
    data = core.circuit.transfer(0, register.read()) & register.writable
    return position.put(data, position.get(data) - 1)


def _read_cover(core: ModuleState, number: int) -> int:
    return FIELDS[_COVER_FIELDS[number]][1].get(_written_cover(core))


def _write_cover(core: ModuleState, number: int, value: int) -> Status:
    register, field = FIELDS[_COVER_FIELDS[number]]
    data = field.put(_written_cover(core), value)
    for chip in range(len(core.circuit.model.parts)):
        core.circuit.transfer(chip, register.write(data))
    return OK


def _read_whole(core: ModuleState, number: int) -> int:
    return core.circuit.transfer(0, _WHOLE_REGISTERS[number].read()) & DATA


def _write_whole(core: ModuleState, number: int, value: int) -> Status:
    for chip in range(len(core.circuit.model.parts)):
        core.circuit.transfer(chip, _WHOLE_REGISTERS[number].write(value))
    return OK


def _read_cells(core: ModuleState, number: int) -> int:
    return int.from_bytes(drivers.read_cells(core.circuit, _FIRST_CELLS[number], 4), "little")


def _write_cells(core: ModuleState, number: int, value: int) -> Status:
    drivers.write_cells(core.circuit, _FIRST_CELLS[number], (value & 0x3F3F3F3F).to_bytes(4, "little"))
    return OK


def _read_low_word(core: ModuleState, _number: int) -> int:
    return drivers.datagram_words(core.circuit)[0]


def _read_high_word(core: ModuleState, _number: int) -> int:
    return drivers.datagram_words(core.circuit)[1]


def _read_switches(core: ModuleState, _number: int) -> int:
    """The switches of all motors, in the order of one chip that has all of them."""
    return sum((2 * axis.left_switch + axis.right_switch) << 2 * axis.motor for axis in core.axes)


def _read_application(core: ModuleState, _number: int) -> int:
    return core.application.state


def _read_download(core: ModuleState, _number: int) -> int:
    return int(core.application.downloading)


def _read_counter(core: ModuleState, _number: int) -> int:
    return core.application.counter


def _read_last_error(core: ModuleState, _number: int) -> int:
    return core.application.last_status


def _read_tick_timer(core: ModuleState, _number: int) -> int:
    return signed32(core.now // MS - core.tick_origin)


def _read_random(core: ModuleState, _number: int) -> int:
    return core.random_number()


def _read_disable_reply(core: ModuleState, _number: int) -> int:
    return int(core.silent)


def read_stored(core: ModuleState, number: int) -> int:
    """Read a parameter that lives in the EEPROM."""
    return core.eeprom.global_values[number]


READERS: Final[Mapping[int, GlobalReader]] = {
    GP.DATAGRAM_LOW_WORD: _read_low_word,
    GP.DATAGRAM_HIGH_WORD: _read_high_word,
    **dict.fromkeys(_COVER_FIELDS, _read_cover),
    **dict.fromkeys(_WHOLE_REGISTERS, _read_whole),
    **dict.fromkeys(_FIRST_CELLS, _read_cells),
    GP.REFERENCE_SWITCHES: _read_switches,
    GP.APPLICATION_STATUS: _read_application,
    GP.DOWNLOAD_MODE: _read_download,
    GP.PROGRAM_COUNTER: _read_counter,
    GP.LAST_ERROR: _read_last_error,
    GP.TICK_TIMER: _read_tick_timer,
    GP.RANDOM_NUMBER: _read_random,
    GP.DISABLE_REPLY: _read_disable_reply,
}


def write_stored(core: ModuleState, number: int, value: int) -> Status:
    """Write a parameter that lives in the EEPROM."""
    core.eeprom.set_global_value(number, value)
    return OK


def _write_setting(core: ModuleState, number: int, value: int) -> Status:
    """A stored parameter that the module keeps at hand."""
    core.eeprom.set_global_value(number, value)
    core.take_settings()
    supervision.settings_changed(core)
    return OK


def _write_lock(core: ModuleState, number: int, value: int) -> Status:
    if value not in {LOCK_KEY, UNLOCK_KEY}:
        return Status.INVALID_VALUE
    core.eeprom.set_global_value(number, int(value == LOCK_KEY))
    return OK


def _write_encoder_interface(core: ModuleState, number: int, value: int) -> Status:
    core.eeprom.set_global_value(number, value)
    core.encoder_interface = value
    for axis in core.axes:
        encoder.configure(core, axis.motor, axis.values[AP.ENCODER_PRESCALER])
        currents.settings_changed(core, axis)
    return OK


def _write_protection(core: ModuleState, number: int, value: int) -> Status:
    """Giving up the protection against reading erases the program (manual 8.1)."""
    if core.eeprom.global_values[number] & 1 and not value & 1:
        core.application.erase()
    core.eeprom.set_global_value(number, value)
    return OK


def _write_tick_timer(core: ModuleState, _number: int, value: int) -> Status:
    core.tick_origin = core.now // MS - value
    return OK


def _write_disable_reply(core: ModuleState, _number: int, value: int) -> Status:
    core.silent = bool(value)
    return OK


WRITERS: Final[Mapping[int, GlobalWriter]] = {
    **dict.fromkeys(_COVER_FIELDS, _write_cover),
    **dict.fromkeys(_WHOLE_REGISTERS, _write_whole),
    **dict.fromkeys(_FIRST_CELLS, _write_cells),
    **dict.fromkeys(
        (
            GP.BAUD_RATE, GP.SERIAL_ADDRESS, GP.SERIAL_HEARTBEAT, GP.CAN_REPLY_ID, GP.CAN_ID, GP.TELEGRAM_PAUSE,
            GP.HOST_ADDRESS, GP.SHUTDOWN_PIN, GP.CAN_SECONDARY_ID, GP.CAN_HEARTBEAT, GP.SERIAL_SECONDARY_ADDRESS,
        ),
        _write_setting,
    ),
    GP.EEPROM_LOCK: _write_lock,
    GP.ENCODER_INTERFACE: _write_encoder_interface,
    GP.CODE_PROTECTION: _write_protection,
    GP.TICK_TIMER: _write_tick_timer,
    GP.DISABLE_REPLY: _write_disable_reply,
}  # fmt: skip


def store_global(core: ModuleState, number: int) -> Status:
    """STGP in bank 0: the first long words of driver chain and microstep table store the whole table.

    All others are stored by SGP already, or cannot be; nothing happens (manual 6.7.11, fidelity FW-53).
    """
    if number not in core.tables.globals:
        return Status.WRONG_TYPE
    if number in _TABLES:
        if core.eeprom.locked:
            return Status.EEPROM_LOCKED
        cells = drivers.read_cells(core.circuit, _TABLES[number], CELLS)
        if number == GP.MICROSTEP_TABLE_0:
            core.eeprom.set_microstep_table(cells)
        else:
            core.eeprom.set_driver_chain(cells)
    return OK


def restore_global(core: ModuleState, number: int) -> Status:
    """RSGP in bank 0, the counterpart of `store_global`."""
    if number not in core.tables.globals:
        return Status.WRONG_TYPE
    if number in _TABLES:
        table = core.eeprom.microstep_table if number == GP.MICROSTEP_TABLE_0 else core.eeprom.driver_chain
        drivers.write_cells(core.circuit, _TABLES[number], table)
    return OK
