"""Status codes: the third byte of every reply.

Source: manual 6.2.1; 128 from 6.7.34.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Final


class Status(IntEnum):
    """What a module answers about a command."""

    OK = 100
    LOADED = 101
    WRONG_CHECKSUM = 1
    INVALID_COMMAND = 2
    WRONG_TYPE = 3
    INVALID_VALUE = 4
    EEPROM_LOCKED = 5
    NOT_AVAILABLE = 6
    POSITION_REACHED = 128


STATUS_TEXTS: Final[dict[int, str]] = {
    Status.OK: "successfully executed",
    Status.LOADED: "command loaded into the program memory",
    Status.WRONG_CHECKSUM: "wrong checksum",
    Status.INVALID_COMMAND: "invalid command",
    Status.WRONG_TYPE: "wrong type",
    Status.INVALID_VALUE: "invalid value",
    Status.EEPROM_LOCKED: "configuration EEPROM locked",
    Status.NOT_AVAILABLE: "command not available",
    Status.POSITION_REACHED: "target position reached (second reply of command 138)",
}
"""One sentence a status code, by its number."""
