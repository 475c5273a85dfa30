"""The control functions, 128 to 139 and 242: run control, download, version, factory settings, event 138, ASCII mode.

`HANDLERS` are those that answer like any command; `ANSWERS` say how a port answers the others.

Source: manual 6.6, 6.7.34, 6.7.36; fidelity FW-11, FW-48, FW-81 to FW-83, FW-88, PROG-15 to PROG-20.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Final

from tmcm34x.firmware import power, supervision
from tmcm34x.firmware.dispatch import ENTRIES, entry, execute
from tmcm34x.tmcl.commands import BOOT_KEY, CONTROL_FUNCTIONS
from tmcm34x.tmcl.datagram import Instruction, pack_record
from tmcm34x.tmcl.numbers import CONTROL
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.firmware.roles import Port
    from tmcm34x.firmware.state import CommandEntry, Handler, ModuleState, OwnReply, Result

IN_DOWNLOAD: Final = frozenset({CONTROL.QUIT_DOWNLOAD, CONTROL.GET_FIRMWARE_VERSION})
"""Control functions that are executed in download mode too (fidelity PROG-15)."""
VERSION_STRING: Final = 0
"""Type of 136 that is answered with eight characters."""


def stop_application(core: ModuleState, _type: int, _motor: int, value: int) -> Result:
    """128: stop the program.  Source: manual 6.7.36."""
    return core.application.stop(), value


def run_application(core: ModuleState, type_: int, _motor: int, value: int) -> Result:
    """129: run the program from where it stands (0) or from an address (1).  Source: manual 6.7.36."""
    return core.application.run(value if type_ else None), value


def step_application(core: ModuleState, _type: int, _motor: int, value: int) -> Result:
    """130: execute one command of the program.  Source: manual 6.7.36; fidelity PROG-19."""
    return core.application.step(), value


def reset_application(core: ModuleState, _type: int, _motor: int, value: int) -> Result:
    """131: stop the program and go back to its start.  Source: manual 6.7.36."""
    return core.application.reset(), value


def start_download(core: ModuleState, _type: int, _motor: int, value: int) -> Result:
    """132: store the commands to come.  Source: manual 6.7.36."""
    return core.application.start_download(value), value


def quit_download(core: ModuleState, _type: int, _motor: int, value: int) -> Result:
    """133: execute commands again.  Source: manual 6.7.36."""
    return core.application.quit_download(), value


def read_program_memory(core: ModuleState, _type: int, _motor: int, value: int) -> Result:
    """134: the value field of the stored command; ports answer with all of it (fidelity FW-82)."""
    stored = core.application.memory.read(value)
    return (Status.OK, stored.value) if isinstance(stored, Instruction) else (stored, value)


def get_application_status(core: ModuleState, _type: int, _motor: int, _value: int) -> Result:
    """135: what the program is doing.  Source: manual 6.7.36; fidelity PROG-20."""
    return Status.OK, core.application.state


def get_firmware_version(core: ModuleState, _type: int, _motor: int, _value: int) -> Result:
    """136: the binary version; ports answer type 0 with the string.  Source: manual 6.7.36; fidelity FW-81."""
    return Status.OK, core.circuit.model.binary_version


def restore_factory_settings(core: ModuleState, _type: int, _motor: int, value: int) -> Result:
    """137: restore the factory settings and reset the module.  Source: manual 6.7.36; fidelity FW-11."""
    if core.eeprom.locked:
        return Status.EEPROM_LOCKED, value
    core.eeprom.restore_defaults()
    power.cycle(core)
    return Status.OK, value


def request_target_reached(_core: ModuleState, _type: int, _motor: int, value: int) -> Result:
    """138: the first reply of the position reached event; ports send the second.  Source: manual 6.7.34."""
    return Status.OK, value


def enter_ascii_mode(_core: ModuleState, _type: int, _motor: int, value: int) -> Result:
    """139: ASCII mode is a port's; there is none here."""
    return Status.NOT_AVAILABLE, value


HANDLERS: Final[Mapping[str, Handler]] = {
    handler.__name__: handler
    for handler in (
        stop_application, run_application, step_application, reset_application, start_download, quit_download,
        read_program_memory, get_application_status, get_firmware_version, restore_factory_settings,
        request_target_reached, enter_ascii_mode,
    )
}  # fmt: skip
"""What the control functions do, by key."""


def _all_entries() -> tuple[CommandEntry, ...]:
    entries = list(ENTRIES)
    for row in CONTROL_FUNCTIONS:
        entries[row.number] = entry(row, HANDLERS[row.key])
    return tuple(entries)


ALL_ENTRIES: Final = _all_entries()
"""What each command number 0..255 does, control functions included."""

# Control functions that a port answers in a form of their own.


def _answer_plainly(core: ModuleState, port: Port, instruction: Instruction, size: int) -> Result:
    status, value = execute(core, *instruction)
    port.answer(status, instruction.number, value, size)
    return status, value


def _answer_record(core: ModuleState, port: Port, instruction: Instruction, size: int) -> None:
    """134: the whole stored command (fidelity FW-82)."""
    stored = core.application.memory.read(instruction.value)
    if isinstance(stored, Instruction):
        port.answer_record(pack_record(stored)[:-1], size)
    else:
        port.answer(stored, instruction.number, instruction.value, size)


def _answer_version(core: ModuleState, port: Port, instruction: Instruction, size: int) -> None:
    """136: type 0 is answered with eight characters and no checksum (manual 6.7.36)."""
    if instruction.type == VERSION_STRING:
        port.answer_text(core.circuit.model.version.encode("ascii"), size)
    else:
        _answer_plainly(core, port, instruction, size)


def _answer_factory_settings(core: ModuleState, port: Port, instruction: Instruction, size: int) -> None:
    """137: no reply when it is done."""
    status, value = execute(core, *instruction)
    if status != Status.OK:
        port.answer(status, instruction.number, value, size)


def _answer_request(core: ModuleState, port: Port, instruction: Instruction, size: int) -> None:
    """138: one reply now, another when all motors of the mask are at their targets (manual 6.7.34)."""
    status, value = _answer_plainly(core, port, instruction, size)
    if status == Status.OK:
        supervision.request_target_reached(core, port, value, size)


def _answer_ascii_mode(_core: ModuleState, port: Port, instruction: Instruction, size: int) -> None:
    """139: the reply is still binary (manual 6.6; fidelity FW-83)."""
    status = Status.OK if port.takes_text else Status.NOT_AVAILABLE
    port.answer(status, instruction.number, instruction.value, size)
    if port.takes_text:
        port.enter_text(True)


def _answer_boot(core: ModuleState, port: Port, instruction: Instruction, size: int) -> None:
    """242: to the boot loader if there is one and the key fits, else a command like any unknown one."""
    if core.boot is not None and instruction[1:] == BOOT_KEY:
        core.boot.enter(core)
    else:
        port.answer(Status.INVALID_COMMAND, instruction.number, instruction.value, size)


ANSWERS: Final[Mapping[int, OwnReply]] = {
    CONTROL.READ_PROGRAM_MEMORY: _answer_record,
    CONTROL.GET_FIRMWARE_VERSION: _answer_version,
    CONTROL.RESTORE_FACTORY_SETTINGS: _answer_factory_settings,
    CONTROL.REQUEST_TARGET_REACHED: _answer_request,
    CONTROL.ENTER_ASCII_MODE: _answer_ascii_mode,
    CONTROL.ENTER_BOOT_LOADER: _answer_boot,
}
"""How ports answer, by command number; all others are answered with status and value."""
FIRMWARE: Final = (ALL_ENTRIES, ANSWERS)
