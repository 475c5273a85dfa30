"""What a failed test shows: of a virtual module the last telegrams, the state and a plot, of a real one the state."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from tmcm34x.clock import seconds
from tmcm34x.host import HostError
from tmcm34x.tmcl.commands import MOTORS, PROGRAM_SIZE
from tmcm34x.tmcl.mnemonic import format_instruction
from tmcm34x.tmcl.telegrams import explain

if TYPE_CHECKING:
    from pathlib import Path

    from tmcm34x.firmware.module import FirmwareModule
    from tmcm34x.testing.real import RealModule
    from tmcm34x.testing.virtual import VirtualModule

COLUMNS: Final = 72
BLOCKS: Final = "▁▂▃▄▅▆▇█"
SHOWN: Final = 20
"""Telegrams in a report."""


def telegrams(module: VirtualModule) -> str:
    """The last telegrams, decoded."""
    rows: list[str] = []
    for telegram in list(module.telegrams)[-SHOWN:]:
        text = explain(telegram.direction, telegram.data, telegram.kind).text
        dump = telegram.data.hex(" ")
        rows.append(f"{seconds(telegram.now):12.6f} s  {telegram.direction}  {dump:<26}  {text}")
    return "\n".join(rows) or "none"


def state(module: VirtualModule) -> str:
    """Motors, outputs and program of each module."""
    rows = [f"at {module.now:.6f} s"]
    for number, unit in enumerate(module.rig.modules):
        name = f"module {number}: " if len(module.rig.modules) > 1 else ""
        power = "" if unit.powered else ", without power"
        rows.append(
            f"{name}{unit.board.model.name}{power}, outputs {unit.board.outputs:08b}, {_program(unit)}"
        )
        rows += [_axis(module, number, motor) for motor in range(3)]
    return "\n".join(rows)


def _program(unit: FirmwareModule) -> str:
    """Whether the program runs, and the command that is next or waits."""
    if not unit.program.active:
        return "program stopped"
    address = unit.program.counter
    command = (
        format_instruction(unit.eeprom.read_instruction(address)) if address < PROGRAM_SIZE else "its end"
    )
    return f"program running, at {address}: {command}"


def _axis(module: VirtualModule, number: int, motor: int) -> str:
    axis, view = module.motor(motor, number), module.view(motor, number)
    switches = [side for side, active in (("left", view.left), ("right", view.right)) if active]
    parts = [f"position {axis.position}", f"target {axis.target}", f"speed {axis.speed}"]
    parts += [f"{side} switch active" for side in switches]
    parts += [f"{axis.lost_steps} full steps lost"] if axis.lost_steps else []
    return f"  motor {motor}: {', '.join(parts + list(view.faults))}"


def plot(module: VirtualModule) -> str:
    """The positions of the motors that moved, over time, in a line each."""
    picture = module.picture
    if len(picture.times) < 2:
        return ""
    rows = [_line(picture.label(n), picture.times, picture.positions[n]) for n in picture.moved()]
    start, end = seconds(picture.times[0]), seconds(picture.times[-1])
    return "\n".join([*rows, f"{'':<18} {start:.3f} s to {end:.3f} s, position in microsteps"])


def _line(label: str, times: Sequence[int], values: Sequence[float]) -> str:
    low, high = int(min(values)), int(max(values))
    if low == high:
        return f"{label:<18} {low}"
    span = times[-1] - times[0]
    values = [_at(times[0] + span * column // (COLUMNS - 1), times, values) for column in range(COLUMNS)]
    blocks = "".join(BLOCKS[int((value - low) / (high - low) * (len(BLOCKS) - 1) + 0.5)] for value in values)
    return f"{label:<18} {blocks} {low}..{high}"


def _at(when: int, times: Sequence[int], values: Sequence[float]) -> float:
    """The value at `when`, on a straight line between the samples around it."""
    place = min(max(bisect_right(times, when), 1), len(times) - 1)
    before, after = times[place - 1], times[place]
    share = (when - before) / (after - before) if after > before else 1.0
    return values[place - 1] + share * (values[place] - values[place - 1])


def report(module: VirtualModule) -> str:
    """All of it."""
    parts = [("telegrams", telegrams(module)), ("state", state(module)), ("positions", plot(module))]
    return "\n\n".join(f"{title}\n{text}" for title, text in parts if text)


def real_report(module: RealModule) -> str:
    """What a real module tells when it is asked; why it tells nothing, as while its port is open elsewhere."""
    try:
        return _real_state(module)
    except (HostError, ValueError) as error:
        return f"state unknown: {error}"


def _real_state(module: RealModule) -> str:
    _, application_status = module.command("GGP 128, 0")
    program = "stopped" if application_status in {0, 3} else "running"
    rows = [f"TMCM-{module.model} at {module.where}, program {program}"]
    for motor in range(MOTORS):
        axis = module.motor(motor)
        rows.append(f"  motor {motor}: position {axis.position}, target {axis.target}, speed {axis.speed}")
    return "\n".join(rows)


def save_picture(module: VirtualModule, path: Path, title: str) -> None:
    """Draw positions and speeds over time into an SVG file."""
    from tmcm34x.trace.canvas import SvgCanvas
    from tmcm34x.trace.picture import draw, picture_height

    canvas = SvgCanvas(picture_height(module.picture))
    draw(module.picture, canvas, title)
    path.write_text(canvas.finish(), "utf-8")
