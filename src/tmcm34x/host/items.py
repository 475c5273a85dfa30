"""What a module can keep: one item for each value, with the commands that read, write, store and recall it.

table     of a settings file: `axis.0`, `module`, `variables`, `coordinates`, `chip`
key       in that table
motor     of a coordinate, 0..2; else 0
low high  range of the value
read      the command that reads the value in use
write     the command that sets it, value aside
store     the command that copies it to the EEPROM; None where writing stores at once, or nothing does
recall    the command that copies the stored value back into use
name      for people

All of it comes from the tables of `tmcl`; what is only a state (positions, speeds, switches) is no item, nor is what
acts when it is read or written.

Source: manual 6.7.5 to 6.7.12, 6.7.25, 6.7.26, chapters 7 and 8; copying coordinates: fidelity FW-60; storing chip
tables: fidelity FW-53.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, NamedTuple

from tmcm34x.host.steps import NUMBERS
from tmcm34x.tmcl.axis_parameters import AXIS_PARAMETERS
from tmcm34x.tmcl.commands import COORDINATES, INT32_MAX, INT32_MIN, MOTORS, POSITION_MAX, POSITION_MIN
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.global_parameters import BY_KEY as GLOBAL_KEYS
from tmcm34x.tmcl.global_parameters import GLOBAL_PARAMETERS, GlobalParameter

MODELS: Final = (341, 342, 343)
USER_BANK: Final = 2
ALL_MOTORS: Final = 255
"""Motor of SCO and GCO that copies coordinates between RAM and EEPROM."""

COMMUNICATION: Final = (
    "host_address", "telegram_pause", "ascii_mode", "serial_heartbeat", "can_bit_rate", "can_reply_id",
    "can_secondary_id", "can_id", "serial_address", "baud_rate",
)  # fmt: skip
"""Global parameters that could cut the line, in the order in which they are written at the end."""
GUARDED: Final = ("eeprom_magic", "eeprom_lock", "code_protection")
"""Global parameters that could wipe or lock something."""
CHIP_TABLES: Final = ("driver_chain_0", "microstep_table_0")
"""First long words of the chip's two tables: STGP and RSGP of these copy the whole table."""
TABLE_WORDS: Final = 16
_VOLATILE_AXIS: Final = frozenset({"group_index"})
"""Axis parameters that no EEPROM keeps and that are settings all the same."""


class Item(NamedTuple):
    """One value; the module docstring names the columns."""

    table: str
    key: str
    motor: int
    low: int
    high: int
    read: Instruction
    write: Instruction
    store: Instruction | None
    recall: Instruction | None
    name: str

    @property
    def path(self) -> str:
        """The item in texts: `axis.0.max_speed`."""
        motor = f" of motor {self.motor}" if self.table == "coordinates" else ""
        return f"{self.table}.{self.key}{motor}"

    def to(self, value: int) -> Instruction:
        """The command that sets the item to `value`."""
        return self.write._replace(value=value)


def axis_items(model: int) -> Iterator[Item]:
    """The axis parameters that a model keeps, and the group index."""
    for motor in range(MOTORS):
        for row in AXIS_PARAMETERS:
            if model in row.models and (row.stored or row.key in _VOLATILE_AXIS):
                place = row.number, motor
                yield Item(
                    f"axis.{motor}", row.key, 0, row.low, row.high,
                    Instruction(NUMBERS["GAP"], *place), Instruction(NUMBERS["SAP"], *place),
                    Instruction(NUMBERS["STAP"], *place) if row.stored else None,
                    Instruction(NUMBERS["RSAP"], *place) if row.stored else None,
                    f"{row.name} [{row.unit}]" if row.unit else row.name,
                )  # fmt: skip


def module_items() -> Iterator[Item]:
    """The global parameters of bank 0 that live in the EEPROM: writing one stores it."""
    for row in GLOBAL_PARAMETERS:
        if row.bank == 0 and row.stored:
            yield _global("module", row, None, None)


def chip_items() -> Iterator[Item]:
    """Driver chain and microstep table, word by word, and the motion chip's common parameters.

    The first word of a table carries the commands that store and recall all of it.
    """
    yield _global("chip", GLOBAL_KEYS["smgp"], None, None)
    for first in CHIP_TABLES:
        name, number = first.removesuffix("_0"), GLOBAL_KEYS[first].number
        for word in range(TABLE_WORDS):
            yield _global(
                "chip",
                GLOBAL_KEYS[f"{name}_{word}"],
                Instruction(NUMBERS["STGP"], number),
                Instruction(NUMBERS["RSGP"], number),
            )


def variable_items() -> Iterator[Item]:
    """The user variables."""
    for row in GLOBAL_PARAMETERS:
        if row.bank == USER_BANK:
            place = row.number, USER_BANK
            store, recall = Instruction(NUMBERS["STGP"], *place), Instruction(NUMBERS["RSGP"], *place)
            yield _global("variables", row, store, recall)._replace(key=str(row.number))


def coordinate_items(*, stored_in_eeprom: bool = False) -> Iterator[Item]:
    """The coordinates; with global parameter 84 at 1 those from 1 on live in the EEPROM, and writing one stores it."""
    for number in range(COORDINATES):
        volatile = stored_in_eeprom or not number
        store = None if volatile else Instruction(NUMBERS["SCO"], number, ALL_MOTORS)
        recall = None if volatile else Instruction(NUMBERS["GCO"], number, ALL_MOTORS)
        for motor in range(MOTORS):
            yield Item(
                "coordinates", str(number), motor, POSITION_MIN, POSITION_MAX,
                Instruction(NUMBERS["GCO"], number, motor), Instruction(NUMBERS["SCO"], number, motor),
                store, recall, f"coordinate {number} of motor {motor} [microsteps]",
            )  # fmt: skip


def _global(table: str, row: GlobalParameter, store: Instruction | None, recall: Instruction | None) -> Item:
    place = row.number, row.bank
    low, high = (row.low, row.high) if row.bank == 0 else (INT32_MIN, INT32_MAX)
    name = f"{row.name} [{row.unit}]" if row.unit else row.name
    read, write = Instruction(NUMBERS["GGP"], *place), Instruction(NUMBERS["SGP"], *place)
    return Item(table, row.key, 0, low, high, read, write, store, recall, name)


def all_items(model: int, *, stored_in_eeprom: bool = False) -> tuple[Item, ...]:
    """Everything that a backup of `model` holds, the program aside."""
    return (
        *axis_items(model),
        *module_items(),
        *chip_items(),
        *variable_items(),
        *coordinate_items(stored_in_eeprom=stored_in_eeprom),
    )


def settings_items(model: int) -> tuple[Item, ...]:
    """What settings files hold: no chip tables, and nothing that could cut the line or wipe the program."""
    left_out = {*COMMUNICATION, *GUARDED}
    return (
        *(item for item in axis_items(model) if item.store is not None),
        *(item for item in module_items() if item.key not in left_out),
        *variable_items(),
        *(item for item in coordinate_items() if item.key != "0"),
    )
