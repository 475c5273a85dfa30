"""What happens to a module in a session (`!`), and what can be measured on it (`?`).

Lengths and angles are those of the axis, positions and speeds of a motor those of the motion chip.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from tmcm34x.bench.action import Value
from tmcm34x.bench.session.phrase import Phrase, phrase
from tmcm34x.bench.world import SHUTDOWN
from tmcm34x.board.board import ANALOG_MAX
from tmcm34x.chips.tmc246 import FAULTS

if TYPE_CHECKING:
    from tmcm34x.bench.mount import AxisView
    from tmcm34x.bench.rig import Rig
    from tmcm34x.bench.world import World
    from tmcm34x.firmware.module import FirmwareModule

TOLERANCE: Final = 0.02
"""Millimetres or degrees by which a load may be beside where it is said to be."""
MIXED_DECAY: Final = 0x820
"""The bits of a driver's word that switch mixed decay on, one for each bridge."""
FULL_CURRENT: Final = 0x3DE
"""The bits of a driver's word that ask for full current in both bridges."""
LOST: Final = 1.0
"""Full steps from which on a motor has lost steps: less is how far a rotor lags behind its field."""


class Unit(NamedTuple):
    """One module of a rig."""

    rig: Rig
    number: int = 0

    @property
    def world(self) -> World:
        """What hangs on the module."""
        return self.rig.worlds[self.number]

    @property
    def module(self) -> FirmwareModule:
        """The module."""
        return self.rig.modules[self.number]

    def axis(self, motor: int) -> AxisView:
        """One axis as an onlooker sees it."""
        return self.world.mounts[motor].view()

    def spot(self, motor: int) -> tuple[int, int]:
        """Position [microsteps] and speed [velocity units] of a motor, as its motion chip has them."""
        board = self.module.board
        chip, smda = board.wiring(motor)
        return board.chips[chip].position(smda), board.chips[chip].velocity(smda)


Deeds = tuple[tuple[str, tuple[Value, ...]], ...]
"""Names and operands of the bench's actions (`bench.action.ACTIONS`) that an event consists of."""
Look = Callable[..., "MeasuredValue"]
"""Measures something on a unit."""


class MeasuredValue(NamedTuple):
    """What a measurement gave: whether it is as asked, and what it is."""

    holds: bool
    what: str


def _power(what: str) -> Deeds:
    states = {"off": (False,), "on": (True,), "cycle": (False, True)}[what]
    return tuple(("power", (state,)) for state in states)


def _switch(motor: int, side: str, what: str) -> Deeds:
    return (("switch", (motor, side, {"closes": True, "opens": False, "works": None}[what])),)


def _cable(motor: int, side: str, what: str) -> Deeds:
    return (("unplug", (motor, side, what == "breaks")),)


def _fault(motor: int, name: str, what: str) -> Deeds:
    return (("fault", (motor, name, what == "begins")),)


def _move(motor: int, position: float) -> Deeds:
    return (("move", (motor, position)),)


def _push(motor: int, torque_nm: float) -> Deeds:
    return (("push", (motor, torque_nm)),)


def _level(number: int, level: str) -> Deeds:
    return (("level", (number, ANALOG_MAX * (level == "high"))),)


def _analog(number: int, value: int) -> Deeds:
    return (("level", (number, value)),)


def _shutdown(level: str) -> Deeds:
    return _level(SHUTDOWN, level)


def _spi_echo(select: int) -> Deeds:
    return (("spi", (select, "previous", 0)),)


def _spi_constant(select: int, value: int) -> Deeds:
    return (("spi", (select, "constant", value)),)


EVENTS: Final[tuple[Phrase, ...]] = (
    phrase("power {off|on|cycle}", _power),
    phrase("motor {0..2} {left|right} switch {closes|opens|works}", _switch),
    phrase("motor {0..2} {left|right} cable {breaks|heals}", _cable),
    phrase(f"motor {{0..2}} fault {{{'|'.join(FAULTS)}}} {{begins|ends}}", _fault),
    phrase("motor {0..2} moved to {number}", _move),
    phrase("motor {0..2} pushed by {number}", _push),
    phrase("input {0..7} {high|low}", _level),
    phrase("analog {0..7} {0..1023}", _analog),
    phrase("shutdown pin {high|low}", _shutdown),
    phrase("spi {0..2} echo", _spi_echo),
    phrase("spi {0..2} constant {0..4294967295}", _spi_constant),
)


def _equal(what: object, wanted: object) -> MeasuredValue:
    return MeasuredValue(what == wanted, str(what))


def _within(value: float, span: tuple[float, float]) -> MeasuredValue:
    return MeasuredValue(span[0] <= value <= span[1], str(value))


def _either(state: bool, words: tuple[str, str], wanted: str) -> MeasuredValue:
    return MeasuredValue(state == (wanted == words[0]), words[not state])


def _see_load(unit: Unit, motor: int, span: tuple[float, float]) -> MeasuredValue:
    position = unit.axis(motor).position
    return MeasuredValue(span[0] - TOLERANCE <= position <= span[1] + TOLERANCE, f"at {position:.3f}")


def _see_lost_steps(unit: Unit, motor: int) -> MeasuredValue:
    lost = unit.axis(motor).lost_fullsteps
    return MeasuredValue(
        abs(lost) >= LOST, f"{lost:.2f} full steps behind" if abs(lost) >= LOST else "no lost steps"
    )


def _driver_word(unit: Unit, motor: int) -> int:
    """The word of 12 bits that the motion chip sends to a driver."""
    bits, _ = unit.module.board.chips[0].driver_datagram()
    return bits >> 12 * (2 - motor) & 0xFFF


def _see_switch(unit: Unit, motor: int, side: Any, state: str) -> MeasuredValue:
    return _either(unit.module.board.switch(motor, side), ("active", "inactive"), state)


def _see_outputs(unit: Unit, bits: str) -> MeasuredValue:
    return _equal(f"{unit.module.board.outputs:08b}", bits)


def _see_output(unit: Unit, n: int, state: str) -> MeasuredValue:
    return _either(bool(unit.module.board.outputs >> n & 1), ("high", "low"), state)


def _see_current(unit: Unit, motor: int, current: int) -> MeasuredValue:
    return _equal(unit.module.board.currents[motor], current)


def _see_driver(unit: Unit, motor: int, state: str) -> MeasuredValue:
    return _either(unit.module.board.enabled[motor], ("on", "off"), state)


def _see_mixed_decay(unit: Unit, motor: int, bridges: int) -> MeasuredValue:
    return _equal((_driver_word(unit, motor) & MIXED_DECAY).bit_count(), bridges)


def _see_steps(unit: Unit, motor: int, kind: str) -> MeasuredValue:
    return _either(_driver_word(unit, motor) & FULL_CURRENT == FULL_CURRENT, ("full", "micro"), kind)


def _see_position(unit: Unit, motor: int, span: tuple[int, int]) -> MeasuredValue:
    return _within(unit.spot(motor)[0], span)


def _see_speed(unit: Unit, motor: int, span: tuple[int, int]) -> MeasuredValue:
    return _within(unit.spot(motor)[1], span)


def _see_motion(unit: Unit, motor: int, state: str) -> MeasuredValue:
    return _either(unit.spot(motor)[1] != 0, ("turning", "resting"), state)


def _see_program(unit: Unit, state: str) -> MeasuredValue:
    return _either(unit.module.program.active, ("running", "stopped"), state)


def _see_variable(unit: Unit, number: int, span: tuple[int, int]) -> MeasuredValue:
    return _within(unit.module.program.variables[number], span)


def _see_power(unit: Unit, state: str) -> MeasuredValue:
    return _either(unit.module.powered, ("on", "off"), state)


MEASUREMENTS: Final[tuple[Phrase, ...]] = (
    phrase("outputs {bits}", _see_outputs),
    phrase("output {0..7} {high|low}", _see_output),
    phrase("motor {0..2} current {0..255}", _see_current),
    phrase("motor {0..2} driver {on|off}", _see_driver),
    phrase("motor {0..2} mixed decay in {0..2} bridges", _see_mixed_decay),
    phrase("motor {0..2} in {full|micro} steps", _see_steps),
    phrase("motor {0..2} load at {numbers}", _see_load),
    phrase("motor {0..2} at {integers}", _see_position),
    phrase("motor {0..2} speed {integers}", _see_speed),
    phrase("motor {0..2} {turning|resting}", _see_motion),
    phrase("motor {0..2} lost steps", _see_lost_steps),
    phrase("motor {0..2} {left|right} switch {active|inactive}", _see_switch),
    phrase("program {running|stopped}", _see_program),
    phrase("variable {0..55} {integers}", _see_variable),
    phrase("power {on|off}", _see_power),
)
