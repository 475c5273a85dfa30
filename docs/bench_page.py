"""Writes docs/bench.md: the reference of bench files, from the structs that read them."""

from __future__ import annotations

import msgspec
from msgspec import inspect

from tmcm34x.bench import description, inputs

HEAD = """\
# Bench files

A bench file describes what is connected to one or several modules on one line: motors, what they drive, switches,
encoders, signals on the inputs, devices on the SPI bus. `tmcm34x serve --bench FILE` and `tmcm34x run --bench FILE`
read it; in Python it is `tmcm34x.bench.load(path)`. It is TOML; an error is reported in one line with its path,
such as `module[1].axis[0].switch.left.position: expected float, got str`. Examples are in `examples/benches/`.

```toml
[[module]]
model = 343

[[module.axis]]                        # motor 0
load = { kind = "carriage", lead_mm = 5.0, mass_kg = 1.5, friction_n = 4.0, low = -2.0, high = 202.0, start = 60.0 }
switch.left = { position = 0.0, hysteresis = 0.05 }
switch.right = { position = 200.0, hysteresis = 0.05 }

[module.input]
IN_0 = { kind = "position", motor = 0, low = 0.0, high = 200.0 }
```

Positions are those of the load: millimetres of a carriage, degrees of a turntable. The position 0 of the chip is
where the load stands at the first power-on (`start`); a reference search puts it where the manual says. Counting up
moves the load to higher positions unless `reverse` is set; the left switch is the one in the direction of counting
down.

## What is modelled

- Switches close at the exact microstep, and stop the motor at the clock at which the motion chip reads them: modules
  with SPI drivers read their switches through a multiplexer, with the next datagram to the drivers.
- A hard stop holds the rotor; the chip keeps counting. A motor that needs more torque than it has at that speed
  and current loses its steps, stays behind, and catches on again at a multiple of four full steps when the chip is
  slower than `start_speed`. The difference is the axis's `lost_fullsteps`.
- Without current (power off, freewheeling, a fault) an external force that friction and detent torque do not hold
  moves the load to the next position where they do, or to the hard stop. A load without hard stops stays.
- The load value that parameter 206 shows rises with the load; it is useful above half of `load_speed` or so.
- Faults set the driver's flags and, except for the temperature warning, cut the torque.
- Potentiometers, signals and encoders are computed when the module reads them, for that clock.

Not modelled: resonances and elasticity, backlash, the time that a falling load takes, heating, the dependence of the
torque on the supply voltage. The choices are in [fidelity/world.md](fidelity/world.md).

Everything is deterministic: the same file, seed and telegrams at the same clocks give the same run.

## By hand

A running bench can be operated by hand, from Python or the IDE, through the world of each module
(`rig.worlds[0]`): `set_switch(motor, side, active)`, `unplug(motor, side)`, `set_fault(motor, name, on)`,
`set_level(input, level)`, `push(motor, torque_nm)`, `move(motor, position)`, `set_power(on)`, and `view()` returns the
state of every axis. A device of your own on the SPI bus is any object with `exchange(data, nbytes)`:
`rig.modules[0].board.attach_spi(select, device)`.

"""

TABLES = (
    description.Bench,
    description.ModuleDescription,
    description.AxisDescription,
    description.Motor,
    description.Carriage,
    description.Turntable,
    description.Switches,
    description.Switch,
    description.Encoder,
    inputs.Inputs,
    inputs.Constant,
    inputs.Square,
    inputs.Ramp,
    inputs.Sine,
    inputs.Table,
    inputs.Output,
    inputs.Position,
    inputs.Spi,
    inputs.Echo,
    inputs.ShiftRegister,
    inputs.Buttons,
    inputs.Tmcm323,
    description.Event,
)
PLACES = {
    "Bench": "the file",
    "ModuleDescription": "`[[module]]`",
    "AxisDescription": "`[[module.axis]]`",
    "Motor": "`motor` of an axis",
    "Switches": "`switch` of an axis",
    "Switch": "`left`, `right`, `reference` of `switch`",
    "Encoder": "`encoder` of an axis",
    "Inputs": "`[module.input]`",
    "Spi": "`[module.spi]`",
    "Event": "`[[event]]`",
}


def page() -> str:
    """The whole page."""
    parts = [HEAD]
    for struct in TABLES:
        info = inspect.type_info(struct)
        assert isinstance(info, inspect.StructType)
        where = PLACES.get(struct.__name__, f'`kind = "{info.tag}"`')
        parts.append(f"## {_name(struct)}: {where}\n\n{struct.__doc__}\n\n")
        if info.fields:
            parts.append("| key | value | default | meaning |\n| --- | --- | --- | --- |\n")
            parts += [_row(field) for field in info.fields]
            parts.append("\n")
    return "".join(parts).rstrip() + "\n"


def _name(struct: type) -> str:
    """What the page calls a class."""
    return struct.__name__.removesuffix("Description")


def _row(field: inspect.Field) -> str:
    return f"| `{field.name}` | {_type(field.type)} | {_default(field)} | {_meaning(field.type)} |\n"


def _meaning(kind: inspect.Type) -> str:
    return (kind.extra_json_schema or {}).get("description", "") if isinstance(kind, inspect.Metadata) else ""


def _default(field: inspect.Field) -> str:
    if field.required:
        return "needed"
    value = field.default
    if value is msgspec.NODEFAULT or isinstance(value, msgspec.Struct) or value is None or value == "":
        return ""
    return f"`{str(value).lower() if isinstance(value, bool) else value}`"


def _type(kind: inspect.Type) -> str:
    """What a value looks like, in words."""
    match kind:
        case inspect.Metadata(type=inner):
            return _type(inner)
        case inspect.StructType(cls=struct):
            return _name(struct)
        case inspect.LiteralType(values=values):
            return ", ".join(f"`{value}`" for value in values)
        case inspect.UnionType(types=types):
            return " or ".join(_type(one) for one in types if not isinstance(one, inspect.NoneType))
        case inspect.ListType(item_type=item):
            return f"list of {_type(item)}"
        case inspect.TupleType(item_types=items):
            return f"[{', '.join(_type(item) for item in items)}]"
        case inspect.IntType() | inspect.FloatType():
            return ("whole number" if isinstance(kind, inspect.IntType) else "number") + _range(kind)
        case inspect.BoolType():
            return "true or false"
        case _:
            return "text"


def _range(kind: inspect.IntType | inspect.FloatType) -> str:
    if kind.gt is not None:
        return f" > {kind.gt:g}"
    if kind.ge is not None and kind.le is not None:
        return f" {kind.ge:g}..{kind.le:g}"
    return f" >= {kind.ge:g}" if kind.ge is not None else ""
