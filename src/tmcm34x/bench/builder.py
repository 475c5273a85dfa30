"""From a description to a rig."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Final, cast

import msgspec

from tmcm34x.bench import description as d
from tmcm34x.bench import inputs
from tmcm34x.bench.action import Action, Value
from tmcm34x.bench.mount import Fitting, Mount
from tmcm34x.bench.rig import FREE_SHAFT, BenchError, Expectation, Happening, Rig
from tmcm34x.bench.world import SHUTDOWN, Disc, World
from tmcm34x.board.board import Board
from tmcm34x.board.models import MODELS
from tmcm34x.clock import MS, clocks
from tmcm34x.firmware.boot import BootLoader
from tmcm34x.firmware.module import FirmwareModule
from tmcm34x.firmware.storage import Eeprom
from tmcm34x.world import device, signal
from tmcm34x.world.load import Carriage, Load, Turntable, Zones
from tmcm34x.world.load_axis import LoadAxis, whole_turn
from tmcm34x.world.motor import FINENESS, Motor
from tmcm34x.world.switch import FAR, Contact, Switch, SwitchInput, noise

if TYPE_CHECKING:
    from tmcm34x.board.circuit import SpiDevice

MOTORS: Final = 3
CAN_ADDRESS: Final = 71
"""Global parameter of the CAN identifier a module listens to."""
NULL_LEVELS: Final = {"high": 1, "low": 0, "none": None}
INPUT_NUMBERS: Final = {name: n for n, name in enumerate(inputs.Inputs.__struct_fields__)}
"""Numbers of the inputs as worlds know them: IN_0..IN_7, SHUTDOWN."""
assert INPUT_NUMBERS["SHUTDOWN"] == SHUTDOWN
_SHAPES_OF_CARRIAGES: Final = frozenset({"rail", "belt"})


def load(
    path: str | Path, eeproms: Sequence[Eeprom | None] = (), *, instruction_us: float | None = None
) -> Rig:
    """The rig of a bench file, switched on.  Raises `BenchError`.

    eeproms: memories of the modules in their order; None or a missing one is a new memory
    instruction_us: time of one TMCL instruction, instead of that of the file
    """
    try:
        bench = d.read(path)
        if instruction_us is not None:
            bench = msgspec.structs.replace(bench, instruction_us=instruction_us)
        return build(bench, eeproms)
    except BenchError as error:
        text = str(error)
        raise BenchError(text if text.startswith(str(path)) else f"{path}: {text}") from error


def build(bench: d.Bench, eeproms: Sequence[Eeprom | None] = ()) -> Rig:
    """The rig of a description, switched on; see `load`."""
    worlds = [
        _world(bench, index, eeproms[index] if index < len(eeproms) else None)
        for index in range(len(bench.module))
    ]
    for index, world in enumerate(worlds):
        _connect_inputs(f"module[{index}].input", bench.module[index].input, world, worlds)
    for world, module in zip(worlds, bench.module, strict=True):
        if module.powered:
            world.module.power_on()
    _check_modules(bench)
    numbered = list(enumerate(bench.event))
    happenings = [
        _happening(f"event[{n}]", n, event, worlds) for n, event in numbered if event.do != "expect"
    ]
    expectations = [_expectation(f"event[{n}]", event) for n, event in numbered if event.do == "expect"]
    description = msgspec.json.encode(bench, order="deterministic")
    rig = Rig(worlds, happenings, description=description, recipe=partial(build, bench))
    rig.expectations = tuple(expectations)
    return rig


def _world(bench: d.Bench, index: int, eeprom: Eeprom | None) -> World:
    row = bench.module[index]
    seed = noise(bench.seed, index) if index else bench.seed
    new = eeprom is None
    module = FirmwareModule(
        Board(MODELS[row.model], seed=seed),
        eeprom or Eeprom(row.model),
        seed=seed,
        instruction_clocks=max(1, clocks(bench.instruction_us * 1e-6)),
        address=row.address if new else None,
        host_address=row.host_address if new else None,
        profile=row.parameters,
    )
    if new and row.address is not None:
        module.eeprom.set_global_value(CAN_ADDRESS, row.address)
    BootLoader(module)
    path = f"module[{index}]"
    axes = list(row.axis) + [None] * (MOTORS - len(row.axis))
    fittings = [
        _fitting(f"{path}.axis[{motor}]", axis, noise(seed, motor)) for motor, axis in enumerate(axes)
    ]
    _check_drawing(path, row)
    world = World(module, fittings)
    world.plane = row.plane
    for select, name in enumerate(inputs.Spi.__struct_fields__):
        _attach(select, cast("inputs.Device | None", getattr(row.spi, name)), world, row)
    return world


# Axes


def _fitting(path: str, axis: d.AxisDescription | None, seed: int) -> Fitting:
    if axis is None:
        return Fitting(LoadAxis(Motor(), FREE_SHAFT))
    motor = Motor(**{name: getattr(axis.motor, name) for name in d.Motor.__struct_fields__})
    load = _load(f"{path}.load", axis.load)
    try:
        turn = whole_turn(motor, load)
    except ValueError as error:
        raise BenchError(f"{path}.load.ratio: {error}") from error
    units = load.units_per_position(motor)
    outward = -1 if axis.reverse else 1
    switches = axis.switch
    contact = Contact(switches.contact == "normally_closed", clocks(switches.bounce_ms / 1000))
    make = partial(_switch, units, turn)
    left = [
        make(f"{path}.switch.left", switches.left, -outward),
        make(f"{path}.switch.reference", switches.reference, 0),
    ]
    right = [make(f"{path}.switch.right", switches.right, outward)]
    return Fitting(
        LoadAxis(motor, load, _line(left, contact, noise(seed, 0)), _line(right, contact, noise(seed, 1))),
        outward,
        axis.max_current_ma,
        FINENESS // axis.microsteps,
        axis.name,
        axis.shape or _shape(axis),
    )


def _shape(axis: d.AxisDescription) -> d.Shape:
    """How an axis is drawn whose description does not say so."""
    if isinstance(axis.load, d.Turntable):
        return "turntable"
    switches = axis.switch
    ends = (axis.load.low, axis.load.high, switches.left, switches.right, switches.reference)
    return "shaft" if all(end is None for end in ends) else "rail"


def _check_drawing(path: str, module: d.ModuleDescription) -> None:
    """Refuse a shape that its load does not have, and a plane of anything but two carriages."""
    for motor, axis in enumerate(module.axis):
        if axis.shape in _SHAPES_OF_CARRIAGES and isinstance(axis.load, d.Turntable):
            raise BenchError(f"{path}.axis[{motor}].shape: a turntable is no {axis.shape}")
        if axis.shape == "turntable" and isinstance(axis.load, d.Carriage):
            raise BenchError(f"{path}.axis[{motor}].shape: a carriage is no turntable")
    if module.plane is None:
        return
    if module.plane[0] == module.plane[1]:
        raise BenchError(f"{path}.plane: expected two motors")
    for motor in module.plane:
        if motor >= len(module.axis) or not isinstance(module.axis[motor].load, d.Carriage):
            raise BenchError(f"{path}.plane: motor {motor} drives no carriage")


def _line(switches: Sequence[Switch | None], contact: Contact, seed: int) -> SwitchInput:
    return SwitchInput([switch for switch in switches if switch is not None], contact, seed)


def _load(path: str, load: d.Carriage | d.Turntable) -> Load:
    if isinstance(load, d.Turntable):
        zones = _zones(f"{path}.torque", load.torque)
        if zones and not all(0 <= start < 360 for start, _ in zones):
            raise BenchError(f"{path}.torque: expected positions from 0 to less than 360")
        return Turntable(load.ratio, load.inertia_kgm2, load.friction_nm, load.start, zones)
    if load.low is not None and load.high is not None and load.low >= load.high:
        raise BenchError(f"{path}.high: expected more than low, got {load.high:g}")
    for name, bad in (
        ("low", load.low is not None and load.start < load.low),
        ("high", load.high is not None and load.start > load.high),
    ):
        if bad:
            raise BenchError(f"{path}.start: beyond the hard stop {name}")
    zones = _zones(f"{path}.force", load.force)
    return Carriage(
        load.lead_mm,
        load.mass_kg,
        load.friction_n,
        load.low,
        load.high,
        load.start,
        _zones(f"{path}.force", load.force),
    )


def _zones(path: str, value: float | list[tuple[float, float]]) -> Zones:
    if isinstance(value, list):
        _check_rising(path, [start for start, _ in value])
        return tuple(value)
    return ((0.0, value),) if value else ()


def _check_rising(path: str, starts: Sequence[float]) -> None:
    if any(after <= before for before, after in pairwise(starts)):
        raise BenchError(f"{path}: expected rising positions")


def _switch(units: float, turn: int | None, path: str, row: d.Switch | None, outward: int) -> Switch | None:
    """The switch of a row; without a width it is pressed from its position on `outward`."""
    if row is None:
        return None
    place, late = round(row.position * units), round(row.hysteresis * units)
    if row.width is not None:
        half = row.width * units / 2
        low, high = round(row.position * units - half), round(row.position * units + half)
        if turn is not None and high - low + late + late >= turn:
            raise BenchError(f"{path}.width: the cam is longer than the turn")
        return Switch(low, high, late, turn)
    if turn is not None or not outward:
        where = "on a turntable" if turn is not None else "on a reference switch"
        raise BenchError(f"{path}: object missing required field width, needed {where}")
    return Switch(place, FAR, late) if outward > 0 else Switch(-FAR, place, late)


# Devices and inputs


def _attach(select: int, row: inputs.Device | None, world: World, module: d.ModuleDescription) -> None:
    if isinstance(row, inputs.Tmcm323):
        encoders = {
            motor: Disc(axis.encoder.lines, axis.encoder.slip, NULL_LEVELS[axis.encoder.null])
            for motor, axis in enumerate(module.axis)
            if axis.encoder is not None
        }
        world.attach_encoders(select, encoders)
    elif row is not None:
        world.module.board.attach_spi(select, _device(row))


def _device(row: inputs.Echo | inputs.ShiftRegister | inputs.Buttons) -> SpiDevice:
    match row:
        case inputs.Echo():
            return device.Echo()
        case inputs.ShiftRegister():
            return device.ShiftRegister(row.bytes)
        case inputs.Buttons():
            return device.Buttons(row.bytes, row.inputs)


def _connect_inputs(path: str, described: inputs.Inputs, world: World, worlds: Sequence[World]) -> None:
    for name, number in INPUT_NUMBERS.items():
        row = cast("inputs.Source | None", getattr(described, name))
        if row is not None:
            world.connect(number, _source(f"{path}.{name}", row, number, world, worlds))


def _source(
    path: str, row: inputs.Source, number: int, world: World, worlds: Sequence[World]
) -> signal.Signal:
    match row:
        case inputs.Constant():
            return signal.Constant(row.value)
        case inputs.Square():
            period = max(1, clocks(row.period_ms / 1000))
            return signal.Square(period, round(period * row.duty), _ms(row.delay_ms), row.high, row.low)
        case inputs.Ramp():
            return signal.Ramp(max(1, _ms(row.period_ms)), row.start, row.end, _ms(row.delay_ms))
        case inputs.Sine():
            return signal.Sine(max(4, _ms(row.period_ms)), row.middle, row.amplitude, _ms(row.delay_ms))
        case inputs.Table():
            return _table(path, row)
        case inputs.Output():
            return _wire(path, row, world, worlds)
        case inputs.Position():
            if number == SHUTDOWN:
                raise BenchError(f"{path}: a potentiometer does not drive SHUTDOWN")
            return _potentiometer(path, row, world)


def _ms(value: float) -> int:
    return round(value * MS)


def _table(path: str, row: inputs.Table) -> signal.Signal:
    times = [_ms(time) for time, _ in row.points]
    levels = [level for _, level in row.points]
    _check_rising(f"{path}.points", times)
    if times[0]:
        times.insert(0, 0)
        levels.insert(0, levels[0])
    period = 0 if row.repeat_ms is None else _ms(row.repeat_ms)
    if period and period <= times[-1]:
        raise BenchError(f"{path}.repeat_ms: expected more than the time of the last point")
    return signal.Table(tuple(times), tuple(levels), period, row.interpolated)


def _wire(path: str, row: inputs.Output, world: World, worlds: Sequence[World]) -> signal.Signal:
    if row.module is not None and row.module >= len(worlds):
        raise BenchError(f"{path}.module: there are {len(worlds)} modules")
    board = (world if row.module is None else worlds[row.module]).module.board
    board.on_output.append(world.wire_changed)
    return signal.Wire(partial(_output_level, board, row))


def _potentiometer(path: str, row: inputs.Position, world: World) -> signal.Signal:
    if row.low == row.high:
        raise BenchError(f"{path}.high: expected another position than low")
    return signal.Wire(partial(_potentiometer_level, world.mounts[row.motor], row))


def _output_level(board: Board, row: inputs.Output) -> int:
    """The level of a wire from an output."""
    return signal.MAX if board.outputs >> row.output & 1 != row.invert else 0


def _potentiometer_level(mount: Mount, row: inputs.Position) -> int:
    """The level of a potentiometer on an axis."""
    share = (mount.axis.position(mount.rotor()) - row.low) / (row.high - row.low)
    return round(signal.MAX * min(1.0, max(0.0, share)))


# Events


_OPERANDS: Final[Mapping[str, Callable[[d.Event], tuple[Value, ...]]]] = {
    "fault": lambda event: (event.motor, event.fault, event.on),
    "power": lambda event: (event.on,),
    "unplug": lambda event: (event.motor, event.side, event.on),
    "switch": lambda event: (event.motor, event.side, event.on),
    "push": lambda event: (event.motor, event.value if event.on else 0.0),
    "move": lambda event: (event.motor, event.value),
    "level": lambda event: (INPUT_NUMBERS[event.input], int(event.value) if event.on else None),
}
"""Operands of the action that an event of a bench file stands for."""


def _check_modules(bench: d.Bench) -> None:
    for n, event in enumerate(bench.event):
        if event.module >= len(bench.module):
            raise BenchError(f"event[{n}].module: there are {len(bench.module)} modules")


def _expectation(path: str, event: d.Event) -> Expectation:
    from tmcm34x.bench.session.language import read_expectation
    from tmcm34x.bench.session.phrase import LineError

    try:
        read_expectation(event.expect)
    except LineError as error:
        raise BenchError(f"{path}.expect: column {error.column + 1}: {error.problem}") from None
    return Expectation(_ms(event.at_ms), event.module, path, event.expect)


def _happening(path: str, number: int, event: d.Event, worlds: Sequence[World]) -> Happening:
    world = worlds[event.module]
    if event.do == "fault" and world.module.board.model.drivers is None:
        raise BenchError(f"{path}.fault: a {world.module.board.model.name} has no drivers")
    if event.do == "level" and not 0 <= event.value <= signal.MAX:
        raise BenchError(f"{path}.value: expected a level of 0..{signal.MAX}, got {event.value:g}")
    return Happening(_ms(event.at_ms), number, Action(event.do, event.module, _OPERANDS[event.do](event)))
