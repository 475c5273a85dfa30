"""A session that reaches the moment at which a run ended: `tmcm34x run --save-session`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from tmcm34x.bench.session.world import Unit
from tmcm34x.cli import CliError, outputs
from tmcm34x.files import read_text
from tmcm34x.tmcl.commands import MOTORS
from tmcm34x.tmcl.datagram import Instruction, pack_request
from tmcm34x.tmcl.mnemonic import MnemonicError, format_instruction, parse_instruction
from tmcm34x.tmcl.numbers import CONTROL
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.bench import Rig

_OUTSIDE: Final = {
    "from_state": "what --from-state read",
    "user_functions": "user functions in Python",
}
_IN_BENCH: Final = {"instruction_time": "instruction_us", "parameters": "parameters"}
_US: Final = 16
"""Clocks of a microsecond."""


def check(options: dict[str, Any]) -> None:
    """Refuse what a session cannot hold, before the run."""
    if not options["save_session"]:
        return
    for name, what in _OUTSIDE.items():
        if options[name]:
            raise CliError(f"--save-session: a session cannot hold {what}")
    for name, key in _IN_BENCH.items():
        if options["bench"] and options[name]:
            option = name.replace("_", "-")
            raise CliError(f"--save-session: write `{key}` into {options['bench']} instead of --{option}")


def write(options: dict[str, Any], rig: Rig, program: Sequence[Instruction]) -> None:
    """Write the session of a run of `program` that has ended on `rig`."""
    text = "\n".join([*_head(options, rig), *_way(options, rig, program), *_moment(rig)])
    outputs.write(Path(options["save_session"]), f"{text}\n".encode())


def _head(options: dict[str, Any], rig: Rig) -> Iterator[str]:
    """Where the session is played."""
    yield f"# Reaches the moment at which a run of {Path(options['file']).name} ended, by --save-session."
    yield f"# models: {rig.modules[0].board.model.number}"
    yield "# links: serial"
    bench = read_text(Path(options["bench"])) if options["bench"] else _bare(options, rig)
    yield from (f"| {line}".rstrip() for line in bench.splitlines())
    yield ""


def _bare(options: dict[str, Any], rig: Rig) -> str:
    """The bench file of a module with bare motors."""
    module = rig.modules[0]
    microseconds = module.instruction_clocks / _US
    return (
        f"seed = {options['seed']}\ninstruction_us = {microseconds}\n"
        f'[[module]]\nparameters = "{module.eeprom.profile}"\n'
    )


def _way(options: dict[str, Any], rig: Rig, program: Sequence[Instruction]) -> Iterator[str]:
    """The program into the module, the start, and the time."""
    name = Path(options["file"]).name
    condition = options["condition"]
    yield f"== {name}{f' until {condition}' if condition else ''}"
    yield from _control(CONTROL.START_DOWNLOAD)
    for instruction in program:
        yield f"> {_line(rig, instruction)}"
        yield f"< {Status.LOADED:d}"
    yield from _control(CONTROL.QUIT_DOWNLOAD)
    for number, value in options["variables"]:
        yield f"> SGP {number}, 2, {value}"
        yield f"< {Status.OK:d}"
    yield from _control(CONTROL.RUN_APPLICATION, 1)
    if rig.now:
        yield f"+ {rig.now} clocks"


def _control(number: int, type_: int = 0) -> tuple[str, str]:
    return f"> {number} {type_}, 0, 0", f"< {Status.OK:d}"


def _line(rig: Rig, instruction: Instruction) -> str:
    """A command as a session reads it: its mnemonic, or its telegram where it has none."""
    text = format_instruction(instruction)
    try:
        if parse_instruction(text) == instruction:
            return text
    except MnemonicError:
        pass
    return pack_request(rig.modules[0].address, instruction).hex(" ")


def _moment(rig: Rig) -> Iterator[str]:
    """What is so at the end."""
    unit, module = Unit(rig), rig.modules[0]
    yield f"? power {'on' if module.powered else 'off'}"
    yield f"? program {'running' if module.program.active else 'stopped'}"
    for motor in range(MOTORS):
        position, speed = unit.spot(motor)
        yield f"? motor {motor} at {position}"
        yield f"? motor {motor} speed {speed}"
    yield f"? outputs {module.board.outputs:08b}"
    for number, value in enumerate(module.program.variables):
        if value:
            yield f"? variable {number} {value}"
