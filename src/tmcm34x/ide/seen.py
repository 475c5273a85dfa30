"""What can be seen of a virtual module and its bench, of the present or of the past."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from tmcm34x.board.board import INPUTS
from tmcm34x.firmware.axis import A_ACTUAL, RAMP_MODE, STOP_SWITCHES, V_ACTUAL, V_TARGET, X_ACTUAL, X_TARGET
from tmcm34x.host.polling import COORDINATE_BANK, reader
from tmcm34x.ide import wire
from tmcm34x.ide.state import bits, put
from tmcm34x.tmcl.numbers import AP
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.bench import Rig
    from tmcm34x.ide.state import Groups

_SCALE: Final = (AP.MICROSTEP_RESOLUTION, AP.PULSE_DIVISOR, AP.RAMP_DIVISOR)
"""Axis parameters that make units of numbers: microstep resolution, pulse and ramp divisor."""


class Seen:
    """The first module of `rig`, read beside its line."""

    def __init__(self, rig: Rig) -> None:
        self.module = rig.modules[0]
        self.world = rig.worlds[0]

    def read(self, item: wire.Watched) -> int | None:
        """A parameter or coordinate; None where there is none."""
        if not self.module.powered:
            return None
        command = reader(item.bank, item.number, item.motor)
        if command is None:
            return None
        status, value = self.module.peek(command)
        return value if status == Status.OK else None

    def put_program(self, state: Groups, *, held: bool) -> None:
        """Pack the program."""
        program = self.module.program
        flags = bits(*program.flags.values(), program.downloading)
        put(
            state, "program", program.state, held, flags, program.counter,
            len(program.stack), program.accumulator, program.x,
        )  # fmt: skip

    def put_motor(self, state: Groups, motor: int) -> None:
        """Pack a motor."""
        module, axis = self.module, self.module.axes[motor]
        board = module.board
        view = self.world.mounts[motor].view()
        on = module.powered and board.enabled[motor] and board.currents[motor] > 0
        flags = bits(
            axis.left_switch, axis.right_switch, axis.left_switch, axis.at_target,
            bool(axis.read(STOP_SWITCHES[0])), bool(axis.read(STOP_SWITCHES[1])), on,
            view.grip in {"stalled", "blocked"},
        )  # fmt: skip
        encoder = self._peek(AP.ENCODER_POSITION, motor)
        put(
            state, f"motor{motor}", axis.read(X_ACTUAL), axis.read(X_TARGET), axis.read(V_ACTUAL), axis.read(V_TARGET),
            axis.read(A_ACTUAL), encoder, flags, self._peek(AP.LOAD_VALUE, motor),
            self._peek(AP.DRIVER_ERROR_FLAGS, motor), board.currents[motor] if on else 0, axis.read(RAMP_MODE),
            axis.search, *(axis.values.get(number, 0) for number in _SCALE),
            view.angle_rad, round(view.lost_fullsteps),
            view.load, view.position,
        )  # fmt: skip

    def _peek(self, parameter: int, motor: int) -> int:
        """An axis parameter, 0 where it is not there or not known."""
        return self.read(wire.Watched(-1, parameter, motor)) or 0

    def put_board(self, state: Groups) -> None:
        """Pack inputs and outputs."""
        board = self.module.board
        levels = (board.analog_input(n) for n in range(INPUTS))
        put(state, "board", board.digital_inputs(), board.outputs, board.shutdown_level(), *levels)

    def eeprom(self, file: str) -> wire.Eeprom:
        """The module's memory, which is kept in `file`."""
        eeprom = self.module.eeprom
        values = [
            wire.StoredValue(-1, number, motor, value)
            for motor, stored in enumerate(eeprom.axis_values)
            for number, value in sorted(stored.items())
        ]
        values += [
            wire.StoredValue(0, number, 0, value) for number, value in sorted(eeprom.global_values.items())
        ]
        values += [
            wire.StoredValue(2, number, 0, value) for number, value in enumerate(eeprom.variables) if value
        ]
        values += [
            wire.StoredValue(COORDINATE_BANK, number, motor, value)
            for motor, stored in enumerate(eeprom.coordinates)
            for number, value in enumerate(stored, 1)
            if value
        ]
        return wire.Eeprom(eeprom.to_bytes().hex(), values, file)
