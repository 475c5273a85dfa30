"""What a hand may do at the bench of a virtual module."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Literal, cast

from tmcm34x.board.board import ANALOG_MAX, INPUTS
from tmcm34x.chips.tmc246 import FAULTS
from tmcm34x.ide import wire
from tmcm34x.tmcl.commands import MOTORS
from tmcm34x.world.motor import FINENESS
from tmcm34x.world.switch import FAR

if TYPE_CHECKING:
    from tmcm34x.bench import World
    from tmcm34x.world.switch import Line

SHUTDOWN: Final = INPUTS
"""Number of the SHUTDOWN pin among a world's inputs."""
STRONGEST: Final = 2.0
"""Largest torque of a hand, in holding torques."""


class Hands:
    """Somebody at the bench `name`."""

    def __init__(self, world: World, name: str) -> None:
        self._world = world
        self._name = name
        self._held: dict[tuple[int, str], bool] = {}

    def do(self, call: wire.SetBench) -> None:
        """Do one thing; refuses what the bench does not have."""
        world, index, value = self._world, call.index, call.value
        count = INPUTS if call.what in {"input", "analog", "source"} else MOTORS
        if not 0 <= index < count:
            raise wire.RefusalError("range", f"The bench has no {call.what} {index}.")
        match call.what:
            case "left" | "right":
                self._held[index, call.what] = bool(value)
                world.set_switch(index, call.what, True if value else None)
            case "input":
                world.set_level(index, ANALOG_MAX if value else 0)
            case "analog":
                world.set_level(index, max(0, min(ANALOG_MAX, round(value))))
            case "source":
                world.set_level(index, None)
            case "shutdown":
                world.set_level(SHUTDOWN, ANALOG_MAX if value else 0)
            case "load":
                motor = world.mounts[index].axis.motor
                world.push(index, max(-STRONGEST, min(STRONGEST, value)) * motor.holding_torque_nm)
            case "fault":
                self._set_fault(index, call.fault, bool(value))
            case "power":
                world.set_power(bool(value))
            case "line":
                raise ValueError("the line is not at the bench")

    def _set_fault(self, motor: int, name: str, on: bool) -> None:
        try:
            self._world.set_fault(motor, name, on)
        except ValueError as error:
            raise wire.RefusalError("range", f"{error}.") from error

    def shape(self) -> wire.World:
        """What hangs on the module."""
        drivers = self._world.module.board.model.drivers is not None
        faults = [wire.FaultKind(row.name, row.meaning) for row in FAULTS.values()] if drivers else []
        axes = [self._axis(motor) for motor in range(MOTORS)]
        plane = list(self._world.plane or ())
        return wire.World(axes, faults, self._name, self._world.overridden, plane)

    def _axis(self, number: int) -> wire.AxisWorld:
        mount = self._world.mounts[number]
        axis, motor = mount.axis, mount.axis.motor
        return wire.AxisWorld(
            motor=f"{motor.rated_current_ma:g} mA, {motor.holding_torque_nm:g} Nm",
            load=axis.push_nm / motor.holding_torque_nm,
            faults=sorted(mount.driver.faults) if mount.driver else [],
            left_held=self._held.get((number, "left"), False),
            right_held=self._held.get((number, "right"), False),
            unit="°" if axis.load.circular else "mm",
            turn=mount.fitting.sign * FINENESS * motor.steps_per_turn / axis.units,
            fullsteps=motor.steps_per_turn,
            low=axis.load.low,
            high=axis.load.high,
            cams=[*_cams("left", axis.left, axis.units), *_cams("right", axis.right, axis.units)],
            name=mount.fitting.name,
            shape=cast("wire.Drawn", mount.fitting.shape),
        )


def _cams(side: Literal["left", "right"], line: Line, units: float) -> list[wire.Cam]:
    return [wire.Cam(side, _end(switch.low, units), _end(switch.high, units)) for switch in line.switches]


def _end(rotor: int, units: float) -> float | None:
    """A switch's end as a load position."""
    return None if abs(rotor) >= FAR else round(rotor / units, 4)
