"""The EEPROM: settings that outlive power, and the program memory.

What is kept: the storable axis parameters of three motors, the global parameters 64..127, user variables,
coordinates 1..20 of each motor, driver chain and microstep table, and 2,048 instructions of seven bytes.

The image (`to_bytes`), all numbers little endian:

4 bytes   "T34X"
u16       format, 1
u16       module type, 341..343
u32       size of the body
body      u8 count of axis parameters, then for each: u8 number, three i32
          u8 count of global parameters, then for each: u8 number, i32
          56 i32 user variables; 3 times 20 i32 coordinates; 64 bytes driver chain; 64 bytes microstep table;
          2,048 times 7 bytes of program: command, type, motor, value most significant byte first
u32       CRC-32 of everything before
          entries of a journal (`changes`): what was written since

A parameter that an image lacks has its factory default; one that this firmware does not know is an error.
No file is touched here: whoever owns the file is a listener and gets every change, before the command is answered.

Source: manual 2.1, 6.7.7 to 6.7.12 and 8; what is stored and what 137 resets: fidelity FW-10 to FW-12.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Sequence
from typing import Any, Final

from tmcm34x.board.models import CELLS, MICROSTEP_TABLE, MODELS
from tmcm34x.firmware.changes import (
    ENTRY_SIZE,
    TABLE_CELLS,
    Cell,
    Chain,
    EepromWrite,
    JournalError,
    unfinished,
)
from tmcm34x.tmcl.axis_parameters import LATER, STANDARD, axis_rows
from tmcm34x.tmcl.commands import (
    COORDINATES,
    MOTORS,
    POSITION_MAX,
    POSITION_MIN,
    PROGRAM_SIZE,
    USER_VARIABLES,
)
from tmcm34x.tmcl.datagram import INSTRUCTION, Instruction, signed32
from tmcm34x.tmcl.global_parameters import global_rows
from tmcm34x.tmcl.numbers import GP

FORMAT: Final = 1
INSTRUCTION_SIZE: Final = 7

_MAGIC: Final = b"T34X"
_HEADER: Final = struct.Struct("<4sHHI")
_CRC: Final = struct.Struct("<I")
_AXIS: Final = struct.Struct("<B3i")
_GLOBAL: Final = struct.Struct("<Bi")
_VARIABLES: Final = struct.Struct(f"<{USER_VARIABLES}i")
_COORDINATES: Final = struct.Struct(f"<{COORDINATES - 1}i")
_RECORD: Final = struct.Struct(f"{INSTRUCTION_SIZE}s")
_PROGRAM_BYTES: Final = PROGRAM_SIZE * INSTRUCTION_SIZE


class EepromError(ValueError):
    """Bytes that are no EEPROM image of this product; the text says in one line what is wrong with them."""


Listener = Callable[[Sequence[EepromWrite]], object]
"""Gets changes that have just been made."""


class Eeprom:
    """Non-volatile memory of one module of type `model`, fresh from the factory.

    Read the tables freely; write through the methods, which count in `revision` and call the listeners.
    Copies have no listeners.
    """

    __slots__ = (
        "_image",
        "axis_values",
        "coordinates",
        "driver_chain",
        "global_values",
        "listeners",
        "microstep_table",
        "model",
        "profile",
        "program",
        "revision",
        "variables",
    )

    def __init__(self, model: int = 343, profile: str = STANDARD) -> None:
        self.model = model
        self.profile = profile
        """Which parameters there are: "standard" or "later"."""
        self.revision = 0
        self.listeners: list[Listener] = []
        """Called with each write, or with several that belong together."""
        self._image = b""
        """What `to_bytes` has last made, while it holds."""
        self.program = bytearray(_PROGRAM_BYTES)
        self.axis_values: list[dict[int, int]] = []
        """For each motor: value by number of the storable axis parameters."""
        self.global_values: dict[int, int] = {}
        """Value by number of the global parameters 64..127; 73 is 1 while locked."""
        self.variables: list[int] = []
        self.coordinates: list[list[int]] = []
        """For each motor: coordinates 1..20."""
        self.driver_chain = b""
        self.microstep_table = b""
        self.restore_defaults()
        self.revision = 0

    def __reduce__(self) -> tuple[Any, ...]:
        """A copy has no listeners."""
        return _copied, (self.model, self.profile, self.to_bytes(), self.revision)

    def _changed(self, *changes: EepromWrite) -> None:
        self._image = b""
        self.revision += 1
        for listener in self.listeners:
            listener(changes)

    def restore_defaults(self) -> None:
        """Put every setting back to its factory default; the program stays (fidelity FW-11)."""
        axis_defaults, global_defaults = self._defaults()
        self.axis_values = [dict(axis_defaults) for _ in range(MOTORS)]
        self.global_values = global_defaults
        self.variables = [0] * USER_VARIABLES
        self.coordinates = [[0] * (COORDINATES - 1) for _ in range(MOTORS)]
        self.driver_chain = MODELS[self.model].driver_chain
        self.microstep_table = MICROSTEP_TABLE
        self._changed(EepromWrite(Cell.DEFAULTS))

    def _defaults(self) -> tuple[dict[int, int], dict[int, int]]:
        """The factory defaults of axis and global parameters."""
        axis = {row.number: row.default for row in axis_rows(self.model, self.profile) if row.stored}
        return axis, {row.number: row.default for row in global_rows(self.profile) if row.stored}

    def take_profile(self, profile: str) -> None:
        """Have room for the parameters of a profile too; those that are new have their defaults."""
        self.profile = profile
        axis_defaults, global_defaults = self._defaults()
        self.axis_values = [axis_defaults | values for values in self.axis_values]
        self.global_values = global_defaults | self.global_values
        self._image = b""

    @property
    def locked(self) -> bool:
        """Whether the configuration may not be written (global parameter 73)."""
        return self.global_values[GP.EEPROM_LOCK] == 1

    def set_axis_value(self, motor: int, number: int, value: int) -> None:
        """Store an axis parameter."""
        self.axis_values[motor][number] = value
        self._changed(EepromWrite(Cell.AXIS_PARAMETER, motor, number, value))

    def set_global_value(self, number: int, value: int) -> None:
        """Store a global parameter of bank 0."""
        self.global_values[number] = value
        self._changed(EepromWrite(Cell.GLOBAL_PARAMETER, 0, number, value))

    def set_variable(self, number: int, value: int) -> None:
        """Store a user variable."""
        self.variables[number] = value
        self._changed(EepromWrite(Cell.USER_VARIABLE, 0, number, value))

    def set_coordinate(self, coordinate: int, motor: int, position: int) -> None:
        """Store a coordinate, 1..20."""
        self.coordinates[motor][coordinate - 1] = position
        self._changed(EepromWrite(Cell.COORDINATE, motor, coordinate, position))

    def set_driver_chain(self, cells: bytes) -> None:
        """Store the 64 cells of the driver chain."""
        self.driver_chain = cells
        self._changed(*_table(Cell.DRIVER_CHAIN, cells))

    def set_microstep_table(self, cells: bytes) -> None:
        """Store the 64 cells of the microstep table."""
        self.microstep_table = cells
        self._changed(*_table(Cell.MICROSTEP_TABLE, cells))

    def read_instruction(self, address: int) -> Instruction:
        """The instruction at `address`, 0..2047; erased memory is all zero."""
        return Instruction(*INSTRUCTION.unpack_from(self.program, address * INSTRUCTION_SIZE))

    def write_instruction(self, address: int, instruction: Instruction) -> None:
        """Store `instruction` at `address`, 0..2047."""
        number, type_, motor, value = instruction
        record = INSTRUCTION.pack(number, type_, motor, signed32(value))
        _RECORD.pack_into(self.program, address * INSTRUCTION_SIZE, record)
        self._changed(EepromWrite(Cell.INSTRUCTION, 0, address, int.from_bytes(record, "little")))

    def write_program(self, program: Sequence[Instruction]) -> None:
        """Erase the program memory and store `program` from address 0; at most 2,048 instructions."""
        if len(program) > PROGRAM_SIZE:
            raise ValueError(f"a program has at most {PROGRAM_SIZE} instructions, not {len(program)}")
        self.erase_program()
        for address, instruction in enumerate(program):
            self.write_instruction(address, instruction)

    def erase_program(self) -> None:
        """Make the program memory all zero."""
        self.program = bytearray(_PROGRAM_BYTES)
        self._changed(EepromWrite(Cell.PROGRAM_ERASED))

    def to_bytes(self) -> bytes:
        """The image, as the module docstring lays it out: the same object as long as nothing is written."""
        if not self._image:
            self._image = self._make_image()
        return self._image

    def _make_image(self) -> bytes:
        body = bytearray((len(self.axis_values[0]),))
        for number in sorted(self.axis_values[0]):
            body += _AXIS.pack(number, *(values[number] for values in self.axis_values))
        body.append(len(self.global_values))
        for number in sorted(self.global_values):
            body += _GLOBAL.pack(number, self.global_values[number])
        body += _VARIABLES.pack(*self.variables)
        for positions in self.coordinates:
            body += _COORDINATES.pack(*positions)
        body += self.driver_chain + self.microstep_table + self.program
        image = _HEADER.pack(_MAGIC, FORMAT, self.model, len(body)) + bytes(body)
        return image + _CRC.pack(zlib.crc32(image))

    def restore(self, image: bytes) -> None:
        """Become what `to_bytes` of a memory of the same model gave; `revision` counts on where that is a change."""
        if image == self.to_bytes():
            return
        other = Eeprom.from_bytes(image)
        self.axis_values, self.global_values = other.axis_values, other.global_values
        self.variables, self.coordinates = other.variables, other.coordinates
        self.driver_chain, self.microstep_table = other.driver_chain, other.microstep_table
        self.program = other.program
        self.take_profile(self.profile)
        self.revision += 1

    @classmethod
    def from_bytes(cls, data: bytes) -> Eeprom:
        """The memory in an image and the journal behind it; `EepromError` for anything else."""
        image, journal = split_image(data)
        body, model = _open_image(image)
        eeprom = cls(model)
        try:
            _Reader(body).fill(eeprom)
        except (struct.error, IndexError):
            raise EepromError("EEPROM image is incomplete") from None
        eeprom._replay(journal, _crc(image))
        _check_ranges(eeprom)
        if any(number not in eeprom._defaults()[0] for values in eeprom.axis_values for number in values):
            eeprom.take_profile(LATER)
        eeprom.revision = 0
        return eeprom

    def _replay(self, journal: bytes, crc: int) -> None:
        if len(journal) % ENTRY_SIZE:
            raise EepromError(f"EEPROM image has {len(journal) % ENTRY_SIZE} bytes too many")
        try:
            for change in Chain(crc).open(journal):
                _APPLY[change.cell](self, change)
        except (JournalError, IndexError, KeyError, ValueError, OverflowError) as error:
            raise EepromError(f"EEPROM image is damaged: {error}") from None


_APPLY: Final[dict[Cell, Callable[[Eeprom, EepromWrite], None]]] = {
    Cell.AXIS_PARAMETER: lambda eeprom, c: eeprom.set_axis_value(c.motor, c.number, c.value),
    Cell.GLOBAL_PARAMETER: lambda eeprom, c: eeprom.set_global_value(c.number, c.value),
    Cell.USER_VARIABLE: lambda eeprom, c: eeprom.set_variable(c.number, c.value),
    Cell.COORDINATE: lambda eeprom, c: eeprom.set_coordinate(c.number, c.motor, c.value),
    Cell.DRIVER_CHAIN: lambda eeprom, c: eeprom.set_driver_chain(_replaced(eeprom.driver_chain, c)),
    Cell.MICROSTEP_TABLE: lambda eeprom, c: eeprom.set_microstep_table(_replaced(eeprom.microstep_table, c)),
    Cell.INSTRUCTION: lambda eeprom, c: eeprom.write_instruction(c.number, _instruction(c.value)),
    Cell.PROGRAM_ERASED: lambda eeprom, _: eeprom.erase_program(),
    Cell.DEFAULTS: lambda eeprom, _: eeprom.restore_defaults(),
}


def _table(cell: Cell, cells: bytes) -> tuple[EepromWrite, ...]:
    return tuple(
        EepromWrite(cell, 0, start, int.from_bytes(cells[start : start + TABLE_CELLS], "little"))
        for start in range(0, len(cells), TABLE_CELLS)
    )


def _instruction(value: int) -> Instruction:
    return Instruction(*INSTRUCTION.unpack(value.to_bytes(INSTRUCTION_SIZE, "little")))


def _replaced(cells: bytes, change: EepromWrite) -> bytes:
    start = change.number
    return cells[:start] + change.value.to_bytes(TABLE_CELLS, "little") + cells[start + TABLE_CELLS :]


def split_image(data: bytes) -> tuple[bytes, bytes]:
    """An image, as far as its header tells its length, and the journal behind it."""
    if len(data) < _HEADER.size:
        return data, b""
    end = _HEADER.size + _HEADER.unpack_from(data)[3] + _CRC.size
    return data[:end], data[end:]


def without_unfinished(data: bytes) -> bytes:
    """Image and journal without entries at the end that were never written to their end."""
    return data[: len(data) - unfinished(split_image(data)[1])]


def begin_journal(image: bytes) -> Chain:
    """What seals the entries of a journal behind `image`."""
    return Chain(_crc(image))


def _crc(image: bytes) -> int:
    return int(_CRC.unpack_from(image, len(image) - _CRC.size)[0])


def _open_image(data: bytes) -> tuple[bytes, int]:
    if data[:4] != _MAGIC:
        raise EepromError("not an EEPROM image")
    if len(data) < _HEADER.size + _CRC.size:
        raise EepromError("EEPROM image is incomplete")
    _, format_, model, size = _HEADER.unpack_from(data)
    if format_ != FORMAT:
        raise EepromError(f"EEPROM image has format {format_}, this version reads format {FORMAT}")
    if len(data) != _HEADER.size + size + _CRC.size:
        raise EepromError(f"EEPROM image has {len(data)} bytes instead of {_HEADER.size + size + _CRC.size}")
    if _CRC.unpack_from(data, len(data) - _CRC.size)[0] != zlib.crc32(data[: -_CRC.size]):
        raise EepromError("EEPROM image is damaged: wrong CRC")
    if model not in MODELS:
        raise EepromError(f"EEPROM image is of an unknown module type {model}")
    return data[_HEADER.size : -_CRC.size], model


class _Reader:
    """Takes the body of an image apart."""

    def __init__(self, body: bytes) -> None:
        self.body = body
        self.offset = 0

    def take(self, layout: struct.Struct) -> tuple[int, ...]:
        values = layout.unpack_from(self.body, self.offset)
        self.offset += layout.size
        return values

    def count(self) -> int:
        self.offset += 1
        return self.body[self.offset - 1]

    def fill(self, eeprom: Eeprom) -> None:
        for _ in range(self.count()):
            number, *values = self.take(_AXIS)
            for motor, value in enumerate(values):
                eeprom.set_axis_value(motor, number, value)
        for _ in range(self.count()):
            eeprom.set_global_value(*self.take(_GLOBAL))
        eeprom.variables = list(self.take(_VARIABLES))
        eeprom.coordinates = [list(self.take(_COORDINATES)) for _ in range(MOTORS)]
        rest = self.body[self.offset :]
        if len(rest) != 2 * CELLS + _PROGRAM_BYTES:
            raise EepromError("EEPROM image is incomplete")
        eeprom.set_driver_chain(rest[:CELLS])
        eeprom.set_microstep_table(rest[CELLS : 2 * CELLS])
        eeprom.program = bytearray(rest[2 * CELLS :])


def _check_ranges(eeprom: Eeprom) -> None:
    rows = {row.number: row for row in axis_rows(eeprom.model, LATER) if row.stored}
    for values in eeprom.axis_values:
        for number, value in values.items():
            row = rows.get(number)
            if row is None or not row.low <= value <= row.high:
                raise EepromError(f"EEPROM image has an impossible axis parameter {number} = {value}")
    bank_0 = {row.number: row for row in global_rows(LATER) if row.stored}
    for number, value in eeprom.global_values.items():
        setting = bank_0.get(number)
        if setting is None or not setting.low <= value <= setting.high:
            raise EepromError(f"EEPROM image has an impossible global parameter {number} = {value}")
    if any(not POSITION_MIN <= x <= POSITION_MAX for positions in eeprom.coordinates for x in positions):
        raise EepromError("EEPROM image has an impossible coordinate")
    if max(eeprom.driver_chain + eeprom.microstep_table) >= CELLS:
        raise EepromError("EEPROM image has an impossible chip table")


def _copied(model: int, profile: str, image: bytes, revision: int) -> Eeprom:
    """The copy that `Eeprom.__reduce__` describes."""
    eeprom = Eeprom(model, profile)
    eeprom.restore(image)
    eeprom.revision = revision
    return eeprom
