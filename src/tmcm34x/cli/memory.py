"""EEPROM files of the commands that serve modules."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from tmcm34x.cli import CliError
from tmcm34x.firmware.storage import Eeprom, EepromError, without_unfinished
from tmcm34x.server.eeprom_file import EepromFile, EepromFileError
from tmcm34x.server.store import Store

Report = Callable[[str], None]


def open_eeprom(path: Path, report: Report) -> tuple[EepromFile, Eeprom | None]:
    """A file and the memory in it, if there is one yet."""
    try:
        file = EepromFile(path)
    except EepromFileError as error:
        raise CliError(str(error)) from error
    try:
        return file, _read(path, file.load(), report)
    except (EepromFileError, EepromError) as error:
        file.close()
        text = str(error)
        raise CliError(text if isinstance(error, EepromFileError) else f"{path}: {text}") from error


def _read(path: Path, data: bytes | None, report: Report) -> Eeprom | None:
    if data is None:
        return None
    whole = without_unfinished(data)
    eeprom = Eeprom.from_bytes(whole)
    if len(whole) < len(data):
        report(
            f"{path}: left out {len(data) - len(whole)} bytes at the end of a write that was never finished"
        )
    return eeprom


def keep(eeprom: Eeprom, file: EepromFile, report: Report, *, durable: bool = False) -> Store:
    """What writes every change of a memory to its file from now on."""
    store = Store(eeprom, file, report, durable=durable)
    try:
        store.begin()
    except EepromFileError as error:
        raise CliError(str(error)) from error
    return store
