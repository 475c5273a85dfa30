"""What a hand may do at the bench of a virtual module."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Literal, cast

from tmcm34x.bench.action import Action, ActionError, Value
from tmcm34x.bench.world import SHUTDOWN
from tmcm34x.board.board import ANALOG_MAX, INPUTS
from tmcm34x.chips.tmc246 import FAULTS
from tmcm34x.ide import wire
from tmcm34x.tmcl.commands import MOTORS
from tmcm34x.world.motor import FINENESS
from tmcm34x.world.switch import FAR

if TYPE_CHECKING:
    from tmcm34x.bench import Rig, World
    from tmcm34x.bench.mount import Mount
    from tmcm34x.world.switch import SwitchInput

STRONGEST: Final = 2.0
"""Largest torque of a hand, in holding torques."""


class Hands:
    """What a page does to the first module's bench, called `name`, by the actions of the bench."""

    def __init__(self, rig: Rig, name: str) -> None:
        self._rig = rig
        self._name = name

    def do(self, call: wire.SetBench) -> None:
        """Do one thing; refuses what the bench does not have."""
        count = INPUTS if call.what in {"input", "analog", "source"} else MOTORS
        if not 0 <= call.index < count:
            raise wire.RefusalError("range", f"The bench has no {call.what} {call.index}.")
        name, operands = self._action(call)
        try:
            self._rig.act(Action(name, 0, operands))
        except ActionError as error:
            raise wire.RefusalError("range", f"{error}.") from error

    def _action(self, call: wire.SetBench) -> tuple[str, tuple[Value, ...]]:
        """Name and operands of what a page asks for."""
        index, value = call.index, call.value
        match call.what:
            case "left" | "right":
                return "switch", (index, call.what, True if value else None)
            case "input":
                return "level", (index, ANALOG_MAX if value else 0)
            case "analog":
                return "level", (index, max(0, min(ANALOG_MAX, round(value))))
            case "source":
                return "level", (index, None)
            case "shutdown":
                return "level", (SHUTDOWN, ANALOG_MAX if value else 0)
            case "load":
                motor = self._rig.worlds[0].mounts[index].axis.motor
                return "push", (index, max(-STRONGEST, min(STRONGEST, value)) * motor.holding_torque_nm)
            case "fault":
                return "fault", (index, call.fault, bool(value))
            case "power":
                return "power", (bool(value),)
            case "line":
                raise ValueError("the line is not at the bench")

    def shape(self, world: World) -> wire.World:
        """What hangs on the module, of the present or of the past."""
        drivers = world.module.board.model.drivers is not None
        faults = [wire.FaultKind(row.name, row.meaning) for row in FAULTS.values()] if drivers else []
        axes = [*map(_axis, world.mounts)]
        return wire.World(axes, faults, self._name, world.overridden, list(world.plane or ()))


def _axis(mount: Mount) -> wire.AxisWorld:
    axis, motor = mount.axis, mount.axis.motor
    return wire.AxisWorld(
        motor=f"{motor.rated_current_ma:g} mA, {motor.holding_torque_nm:g} Nm",
        load=axis.push_nm / motor.holding_torque_nm,
        faults=sorted(mount.driver.faults) if mount.driver else [],
        left_held=axis.left.override is True,
        right_held=axis.right.override is True,
        unit="°" if axis.load.circular else "mm",
        turn=mount.fitting.sign * FINENESS * motor.steps_per_turn / axis.units,
        fullsteps=motor.steps_per_turn,
        low=axis.load.low,
        high=axis.load.high,
        cams=[*_cams("left", axis.left, axis.units), *_cams("right", axis.right, axis.units)],
        name=mount.fitting.name,
        shape=cast("wire.Drawn", mount.fitting.shape),
    )


def _cams(side: Literal["left", "right"], line: SwitchInput, units: float) -> list[wire.Cam]:
    return [wire.Cam(side, _end(switch.low, units), _end(switch.high, units)) for switch in line.switches]


def _end(rotor: int, units: float) -> float | None:
    """A switch's end as a load position."""
    return None if abs(rotor) >= FAR else round(rotor / units, 4)
