"""What plots show of a virtual module, read beside its line: curves, and marks of what happens.

Source: `wire.CURVES`, which is the order.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

from tmcm34x.firmware.axis import A_ACTUAL, V_ACTUAL, V_TARGET, X_ACTUAL, X_TARGET
from tmcm34x.ide.sampling import BASE, COUNTER, CURVES, OUTPUTS, Value
from tmcm34x.tmcl.commands import BY_MNEMONIC, MOTORS
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.numbers import AP
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.firmware.module import FirmwareModule

_GAP: Final = BY_MNEMONIC["GAP"].number


def curves(module: FirmwareModule) -> dict[int, Value]:
    """All columns but the watched parameters; unknown without power."""
    if not module.powered:
        return dict.fromkeys(range(BASE))
    values: dict[int, Value] = {COUNTER: module.program.counter, OUTPUTS: module.board.outputs}
    for motor in range(MOTORS):
        values.update(enumerate(_of_motor(module, motor), motor * len(CURVES)))
    return values


def _of_motor(module: FirmwareModule, motor: int) -> tuple[Value, ...]:
    axis, board = module.axes[motor], module.board
    on = board.enabled[motor] and board.currents[motor] > 0
    return (
        axis.read(X_ACTUAL), axis.read(X_TARGET), axis.read(V_ACTUAL), axis.read(V_TARGET),
        _peek(module, AP.LOAD_VALUE, motor), board.currents[motor] if on else 0,
        _peek(module, AP.ENCODER_POSITION, motor), axis.read(A_ACTUAL),
    )  # fmt: skip


def _peek(module: FirmwareModule, parameter: int, motor: int) -> Value:
    """An axis parameter, None where the module has none."""
    status, value = module.peek(Instruction(_GAP, parameter, motor))
    return value if status == Status.OK else None


def notable(module: FirmwareModule) -> tuple[int, ...]:
    """What marks are made of: the program's state, the left and right switch of each motor, the power."""
    switches = [module.board.switch(motor, side) for motor in range(MOTORS) for side in _SIDES]
    return (int(module.program.state), *map(int, switches), int(module.powered))


def changes(before: tuple[int, ...], now: tuple[int, ...]) -> Iterator[tuple[str, int, str]]:
    """The marks between two such states, each with kind, motor (-1 is none) and text."""
    if not before:
        return
    for index, (old, new) in enumerate(zip(before, now, strict=True)):
        if old == new:
            continue
        if index == 0:
            yield "program", -1, _STATES[new]
        elif index == len(now) - 1:
            yield "power", -1, "power on" if new else "power off"
        else:
            motor, side = divmod(index - 1, len(_SIDES))
            yield "switch", motor, f"{_SIDES[side]} {'closed' if new else 'open'}"


_SIDES: Final = ("left", "right")
_STATES: Final = ("stop", "run", "step", "reset")
