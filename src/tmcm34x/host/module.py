"""A module as an object: what its tables name becomes attributes.

    with Connection.open("/dev/ttyUSB0") as connection:
        module = Module(connection)
        x = module.axes[0]
        x.max_speed = 1200
        x.move_to(51_200)
        print(x.actual_position, module.tick_timer)

An attribute of an `Axis` is an axis parameter of chapter 7 by its key, one of a `Module` a global parameter of
bank 0 by its key; reading one sends GAP or GGP, assigning to it SAP or SGP.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from tmcm34x.host.connection import FACTORY_RESET, Connection
from tmcm34x.tmcl import axis_parameters, global_parameters
from tmcm34x.tmcl.commands import (
    BY_MNEMONIC,
    COORDINATES,
    MOTORS,
    MOVE_TYPES,
    RFS_TYPES,
    USER_VARIABLES,
)
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.global_parameters import FACTORY_KEY

_NUMBERS: Final = {mnemonic: row.number for mnemonic, row in BY_MNEMONIC.items()}
_MOVES: Final = dict(MOVE_TYPES)
_SEARCHES: Final = dict(RFS_TYPES)
_USER_BANK: Final = 2
_GLOBAL_KEYS: Final = {row.key: row for row in global_parameters.GLOBAL_PARAMETERS if row.bank == 0}
_INPUTS, _ANALOG_INPUTS, _OUTPUTS = range(3)


class Axis:
    """One motor of a module."""

    __slots__ = ("_connection", "motor")
    _connection: Connection
    motor: int

    def __init__(self, connection: Connection, motor: int) -> None:
        object.__setattr__(self, "_connection", connection)
        object.__setattr__(self, "motor", motor)

    def __getattr__(self, key: str) -> int:
        return self._do("GAP", _axis_number(key))

    def __setattr__(self, key: str, value: int) -> None:
        self._do("SAP", _axis_number(key), value)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *axis_parameters.BY_KEY]

    def rotate(self, speed: int) -> None:
        """Turn at `speed`, -2047..2047 [velocity units], toward higher positions if positive (ROR)."""
        self._do("ROR", 0, speed)

    def stop(self) -> None:
        """Come to rest along the ramp (MST)."""
        self._do("MST")

    def move_to(self, position: int) -> None:
        """Start a move to `position` [microsteps] (MVP ABS)."""
        self._do("MVP", _MOVES["ABS"], position)

    def move_by(self, distance: int) -> None:
        """Start a move by `distance` [microsteps] from the actual position (MVP REL)."""
        self._do("MVP", _MOVES["REL"], distance)

    def move_to_coordinate(self, coordinate: int) -> None:
        """Start a move to a stored coordinate, 0..20 (MVP COORD)."""
        self._do("MVP", _MOVES["COORD"], coordinate)

    def start_reference_search(self) -> None:
        """Look for the reference point (RFS START)."""
        self._do("RFS", _SEARCHES["START"])

    def stop_reference_search(self) -> None:
        """Give the search up (RFS STOP)."""
        self._do("RFS", _SEARCHES["STOP"])

    @property
    def searching(self) -> bool:
        """Whether a reference search is going on (RFS STATUS)."""
        return self._do("RFS", _SEARCHES["STATUS"]) != 0

    def store(self, key: str) -> None:
        """Keep the present value of a parameter in the EEPROM (STAP)."""
        self._do("STAP", _axis_number(key))

    def restore(self, key: str) -> None:
        """Take the stored value of a parameter back (RSAP)."""
        self._do("RSAP", _axis_number(key))

    def _do(self, mnemonic: str, type_: int = 0, value: int = 0) -> int:
        return self._connection.command(_NUMBERS[mnemonic], type_, self.motor, value)


class Module:
    """A TMCM-341, 342 or 343 at the other end of `connection`."""

    __slots__ = ("axes", "connection", "coordinates", "variables")
    connection: Connection
    axes: tuple[Axis, ...]
    variables: Variables
    coordinates: Coordinates

    def __init__(self, connection: Connection) -> None:
        for name, value in (
            ("connection", connection),
            ("axes", tuple(Axis(connection, motor) for motor in range(MOTORS))),
            ("variables", Variables(connection)),
            ("coordinates", Coordinates(connection)),
        ):
            object.__setattr__(self, name, value)

    def __getattr__(self, key: str) -> int:
        return self.connection.command(_NUMBERS["GGP"], _global_number(key))

    def __setattr__(self, key: str, value: int) -> None:
        self.connection.command(_NUMBERS["SGP"], _global_number(key), 0, value)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *_GLOBAL_KEYS]

    @property
    def version(self) -> str:
        """Type and version of the firmware: `343V4.36`."""
        return self.connection.version()

    @property
    def model(self) -> int:
        """Type of the module: 341, 342 or 343."""
        return int(self.version[:3])

    def stop_all(self) -> None:
        """Stop the program and all three motors."""
        self.connection.command(_STOP_PROGRAM)
        for axis in self.axes:
            axis.stop()

    def read_input(self, port: int) -> int:
        """A digital input, 0..7, or all eight as bits with port 255 (GIO)."""
        return self.connection.command(_NUMBERS["GIO"], port, _INPUTS)

    def read_analog_input(self, port: int) -> int:
        """An analogue input, 0..1023 (GIO)."""
        return self.connection.command(_NUMBERS["GIO"], port, _ANALOG_INPUTS)

    def read_output(self, port: int) -> int:
        """A digital output as it is set, or all eight as bits with port 255 (GIO)."""
        return self.connection.command(_NUMBERS["GIO"], port, _OUTPUTS)

    def write_output(self, port: int, value: int) -> None:
        """Set a digital output, or all eight with port 255 (SIO)."""
        self.connection.command(_NUMBERS["SIO"], port, _OUTPUTS, value)

    def request_event(self, motors: int) -> None:
        """Have the module tell when all motors of the mask are at their targets (138).

        The second reply ends up in `Connection.events`.
        """
        self.connection.command(_REQUEST_EVENT, 0, 0, motors)

    def restore_factory_settings(self) -> None:
        """Put all stored settings back to their defaults and restart; the module does not answer."""
        self.connection.send(Instruction(FACTORY_RESET, value=FACTORY_KEY))


class Variables:
    """The user variables 0..55 of a module, by index."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def __len__(self) -> int:
        return USER_VARIABLES

    def __getitem__(self, number: int) -> int:
        return self._connection.command(_NUMBERS["GGP"], _index(number, USER_VARIABLES), _USER_BANK)

    def __setitem__(self, number: int, value: int) -> None:
        self._connection.command(_NUMBERS["SGP"], _index(number, USER_VARIABLES), _USER_BANK, value)

    def __iter__(self) -> Iterator[int]:
        return (self[number] for number in range(USER_VARIABLES))

    def store(self, number: int) -> None:
        """Keep the present value of a variable in the EEPROM (STGP)."""
        self._connection.command(_NUMBERS["STGP"], _index(number, USER_VARIABLES), _USER_BANK)


class Coordinates:
    """The coordinates of a module [microsteps], by number 0..20 and motor: `coordinates[5, 2]`."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def __getitem__(self, place: tuple[int, int]) -> int:
        number, motor = place
        return self._connection.command(_NUMBERS["GCO"], _index(number, COORDINATES), _index(motor, MOTORS))

    def __setitem__(self, place: tuple[int, int], position: int) -> None:
        number, motor = place
        self._connection.command(
            _NUMBERS["SCO"], _index(number, COORDINATES), _index(motor, MOTORS), position
        )

    def capture(self, number: int, motor: int) -> None:
        """Copy the actual position of a motor, or of all three with motor 7, into a coordinate (CCO)."""
        self._connection.command(_NUMBERS["CCO"], _index(number, COORDINATES), motor)


_STOP_PROGRAM: Final = 128
_REQUEST_EVENT: Final = 138


def _axis_number(key: str) -> int:
    row = axis_parameters.BY_KEY.get(key)
    if row is None:
        raise AttributeError(f"no axis parameter {key!r}")
    return row.number


def _global_number(key: str) -> int:
    row = _GLOBAL_KEYS.get(key)
    if row is None:
        raise AttributeError(f"no global parameter {key!r}")
    return row.number


def _index(number: int, size: int) -> int:
    if not 0 <= number < size:
        raise IndexError(f"{number} is not 0..{size - 1}")
    return number
