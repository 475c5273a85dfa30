"""A module as an object: what its tables name becomes attributes.

    with Module.open("serial:/dev/ttyUSB0?address=1") as module:
        x = module.axes[0]
        x.max_speed = 1200
        x.move_to(51_200, wait=True, timeout_s=10)
        print(x.actual_position, module.tick_timer)

An attribute of an `Axis` is an axis parameter of chapter 7 by its key, one of a `Module` a global parameter of
bank 0 by its key; reading one sends GAP or GGP, assigning to it SAP or SGP.  What the tables know to be wrong is an
exception before anything is sent.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final, Self

from tmcm34x.host import motion
from tmcm34x.host.attributes import ModuleAttributes
from tmcm34x.host.connection import Connection
from tmcm34x.host.exceptions import HostError, RangeError
from tmcm34x.host.parameters import check_model, check_write, row_of
from tmcm34x.host.physical import Driven, Physical
from tmcm34x.host.steps import FACTORY_RESET, NUMBERS, VERSION
from tmcm34x.tmcl import axis_parameters, global_parameters
from tmcm34x.tmcl.axis_parameters import ALL, AxisParameter
from tmcm34x.tmcl.commands import COORDINATES, MOTORS, POSITION_MAX, POSITION_MIN, USER_VARIABLES
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.global_parameters import FACTORY_KEY
from tmcm34x.tmcl.units import FULLSTEPS_PER_TURN, LARGEST

MOVE_S: Final = 60.0
"""Default time limit of a move or a reference search."""
_USER_BANK: Final = 2
_GLOBAL_KEYS: Final = {row.key: row for row in global_parameters.GLOBAL_PARAMETERS if row.bank == 0}
_INPUTS, _ANALOG_INPUTS, _OUTPUTS = range(3)


class Axis(Driven):
    """One motor of a module."""

    __slots__ = ("_module", "motor")

    def __init__(self, module: Module, motor: int) -> None:
        self._module = module
        self.motor = motor

    # Parameters

    def read(self, key: str) -> int:
        """The value of a parameter (GAP)."""
        return self._command("GAP", self._row(key).number)

    def write(self, key: str, value: int) -> None:
        """Set a parameter (SAP).  Raises `RangeError` and `NotAvailableError` before anything is sent."""
        row = self._row(key)
        check_write(row, value)
        self._command("SAP", row.number, value)

    def store(self, key: str) -> None:
        """Keep the present value of a parameter in the EEPROM (STAP)."""
        self._command("STAP", self._row(key).number)

    def restore(self, key: str) -> None:
        """Take the stored value of a parameter back (RSAP)."""
        self._command("RSAP", self._row(key).number)

    def _row(self, key: str) -> AxisParameter:
        row: AxisParameter = row_of(axis_parameters.BY_KEY, key, "axis")
        if row.models != ALL:
            check_model(row, self._module.model)
        return row

    # Motion

    def rotate(self, speed: int) -> None:
        """Turn at `speed`, -2047..2047 [velocity units], toward higher positions if positive (ROR)."""
        _check("speed", speed, -LARGEST, LARGEST)
        self._command("ROR", 0, speed)

    def stop(self) -> None:
        """Come to rest along the ramp (MST); sent until it is acknowledged."""
        self._connection.run(motion.stop(self.motor))

    def move_to(self, position: int, *, wait: bool = False, timeout_s: float = MOVE_S) -> None:
        """Move to `position` [microsteps] (MVP ABS); with `wait`, return when it is there.

        Raises `NotReachedError` where the motor has stopped elsewhere, or is not there in time.
        """
        _check("position", position, POSITION_MIN, POSITION_MAX)
        self._move("ABS", position, wait, timeout_s)

    def move_by(self, distance: int, *, wait: bool = False, timeout_s: float = MOVE_S) -> None:
        """Move by `distance` [microsteps] from the actual position (MVP REL); otherwise like `move_to`."""
        self._move("REL", distance, wait, timeout_s)

    def move_to_coordinate(self, coordinate: int, *, wait: bool = False, timeout_s: float = MOVE_S) -> None:
        """Move to a stored coordinate, 0..20 (MVP COORD); otherwise like `move_to`."""
        _check("coordinate", coordinate, 0, COORDINATES - 1)
        self._move("COORD", coordinate, wait, timeout_s)

    def wait_reached(self, timeout_s: float = MOVE_S) -> None:
        """Wait until the motor is at its target.  Raises `NotReachedError`."""
        self._connection.run(motion.wait_reached(self.motor, timeout_s))

    def home(self, timeout_s: float = MOVE_S) -> None:
        """Search the reference point, and return when it is found (RFS).  Raises `NotReachedError`."""
        self._connection.run(motion.home(self.motor, timeout_s))

    def start_reference_search(self) -> None:
        """Start to search the reference point (RFS START)."""
        self._connection.run(motion.search(self.motor, "START"))

    def stop_reference_search(self) -> None:
        """Give the search up (RFS STOP)."""
        self._connection.run(motion.search(self.motor, "STOP"))

    @property
    def searching(self) -> bool:
        """Whether a reference search is going on (RFS STATUS)."""
        return self._connection.run(motion.search(self.motor, "STATUS")) != 0

    def physical(
        self, *, fullsteps_per_turn: int = FULLSTEPS_PER_TURN, gear: float = 1.0, pitch: float = 360.0
    ) -> Physical[Axis]:
        """The same axis in physical units: `pitch` is way per turn of what the motor drives, mm or degrees."""
        return Physical(self, self._module.model, fullsteps_per_turn, gear, pitch)

    def _move(self, kind: str, target: int, wait: bool, timeout_s: float) -> None:
        if wait:
            self._connection.run(motion.move_and_wait(kind, self.motor, target, timeout_s))
        else:
            self._connection.run(motion.move(kind, self.motor, target))

    @property
    def _connection(self) -> Connection:
        return self._module.connection

    def _command(self, mnemonic: str, type_: int, value: int = 0) -> int:
        return self._module.connection.command(NUMBERS[mnemonic], type_, self.motor, value)


class Module(ModuleAttributes):
    """A TMCM-341, 342 or 343 at the other end of `connection`.

    stop_on_error: as a context manager, stop program and motors when the block ends with an exception
    """

    __slots__ = ("_model", "axes", "connection", "coordinates", "stop_on_error", "variables")

    def __init__(self, connection: Connection, *, stop_on_error: bool = False) -> None:
        self.connection = connection
        self.stop_on_error = stop_on_error
        self.axes = tuple(Axis(self, motor) for motor in range(MOTORS))
        self.variables = UserVariables(connection)
        self.coordinates = Coordinates(connection)
        self._model = 0

    @classmethod
    def open(cls, url: str, *, stop_on_error: bool = False) -> Self:
        """The module that `url` names, see `url`.  Raises `LinkError`."""
        return cls(Connection.open(url), stop_on_error=stop_on_error)

    def close(self) -> None:
        """Hang up; the module goes on with what it does."""
        self.connection.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: Any) -> None:
        try:
            if kind is not None and self.stop_on_error:
                self._stop_after(error)
        finally:
            self.close()

    def _stop_after(self, error: BaseException | None) -> None:
        """Stop all; where that fails too, the first error says so."""
        try:
            self.stop_all()
        except HostError as failure:
            if error is not None:
                error.add_note(f"The motors could not be stopped: {failure}")

    # Parameters

    def read(self, key: str) -> int:
        """The value of a global parameter of bank 0 (GGP)."""
        return self.connection.command(NUMBERS["GGP"], row_of(_GLOBAL_KEYS, key, "global").number)

    def write(self, key: str, value: int) -> None:
        """Set a global parameter of bank 0 (SGP).  Raises `RangeError` before anything is sent."""
        row = row_of(_GLOBAL_KEYS, key, "global")
        check_write(row, value)
        self.connection.command(NUMBERS["SGP"], row.number, 0, value)

    @property
    def version(self) -> str:
        """Type and version of the firmware: `343V4.36`."""
        return self.connection.version()

    @property
    def model(self) -> int:
        """Type of the module: 341, 342 or 343; asked for once."""
        if not self._model:
            self._model = self.connection.command(VERSION, 1) >> 16
        return self._model

    def stop_all(self) -> None:
        """Stop the program and all three motors, each command sent until it is acknowledged."""
        self.connection.run(motion.stop_all())

    def read_input(self, port: int) -> int:
        """A digital input, 0..7, or all eight as bits with port 255 (GIO)."""
        return self.connection.command(NUMBERS["GIO"], port, _INPUTS)

    def read_analog_input(self, port: int) -> int:
        """An analogue input, 0..1023 (GIO)."""
        return self.connection.command(NUMBERS["GIO"], port, _ANALOG_INPUTS)

    def read_output(self, port: int) -> int:
        """A digital output as it is set, or all eight as bits with port 255 (GIO)."""
        return self.connection.command(NUMBERS["GIO"], port, _OUTPUTS)

    def write_output(self, port: int, value: int) -> None:
        """Set a digital output, or all eight with port 255 (SIO)."""
        self.connection.command(NUMBERS["SIO"], port, _OUTPUTS, value)

    def request_event(self, motors: int) -> None:
        """Have the module tell when all motors of the mask are at their targets (138).

        The second reply ends up in `Connection.events`.
        """
        self.connection.run(motion.request_event(motors))

    def restore_factory_settings(self) -> None:
        """Put all stored settings back to their defaults and restart; the module does not answer (137)."""
        self.connection.send(Instruction(FACTORY_RESET, value=FACTORY_KEY))


class UserVariables:
    """The user variables 0..55 of a module, by index."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def __len__(self) -> int:
        return USER_VARIABLES

    def __getitem__(self, number: int) -> int:
        return self._connection.command(NUMBERS["GGP"], _index(number, USER_VARIABLES), _USER_BANK)

    def __setitem__(self, number: int, value: int) -> None:
        self._connection.command(NUMBERS["SGP"], _index(number, USER_VARIABLES), _USER_BANK, value)

    def __iter__(self) -> Iterator[int]:
        return (self[number] for number in range(USER_VARIABLES))

    def store(self, number: int) -> None:
        """Keep the present value of a variable in the EEPROM (STGP)."""
        self._connection.command(NUMBERS["STGP"], _index(number, USER_VARIABLES), _USER_BANK)


class Coordinates:
    """The coordinates of a module [microsteps], by number 0..20 and motor: `coordinates[5, 2]`."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def __getitem__(self, place: tuple[int, int]) -> int:
        number, motor = place
        return self._connection.command(NUMBERS["GCO"], _index(number, COORDINATES), _index(motor, MOTORS))

    def __setitem__(self, place: tuple[int, int], position: int) -> None:
        number, motor = place
        _check("position", position, POSITION_MIN, POSITION_MAX)
        self._connection.command(NUMBERS["SCO"], _index(number, COORDINATES), _index(motor, MOTORS), position)

    def capture(self, number: int, motor: int) -> None:
        """Copy the actual position of a motor, or of all three with motor 7, into a coordinate (CCO)."""
        self._connection.command(NUMBERS["CCO"], _index(number, COORDINATES), motor)


def connect(url: str, *, stop_on_error: bool = False) -> Module:
    """The module that `url` names: `serial:/dev/ttyUSB0?baud=9600&address=1`, `tcp:HOST:PORT`, `virtual:343`, ...

    See `tmcm34x.host.url` for all forms.  Raises `LinkError` where the line cannot be opened; whether a module is
    there shows at the first command.
    """
    return Module.open(url, stop_on_error=stop_on_error)


def _check(what: str, value: int, low: int, high: int) -> None:
    if not low <= value <= high:
        raise RangeError(f"{what} is {low} to {high}, not {value}")


def _index(number: int, size: int) -> int:
    if not 0 <= number < size:
        raise IndexError(f"{number} is not 0..{size - 1}")
    return number
