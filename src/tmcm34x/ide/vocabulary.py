"""The tables of `tmcl` as the page gets them."""

from __future__ import annotations

from functools import cache

from tmcm34x import clock
from tmcm34x.board.models import Model
from tmcm34x.ide import wire
from tmcm34x.tmcl.axis_parameters import AXIS_PARAMETERS, AxisParameter, Choices
from tmcm34x.tmcl.commands import (
    COMMANDS,
    CONTROL_FUNCTIONS,
    COORDINATES,
    PROGRAM_SIZE,
    SISTER_COMMANDS,
    STACK_DEPTH,
    Command,
    Words,
)
from tmcm34x.tmcl.global_parameters import GLOBAL_PARAMETERS, GlobalParameter
from tmcm34x.tmcl.groups import AXIS_GROUP, AXIS_GROUPS, GLOBAL_GROUP, GLOBAL_GROUPS
from tmcm34x.tmcl.status import STATUS_TEXTS


@cache
def tables(model: int) -> wire.Tables:
    """The vocabulary of a module."""
    from tmcm34x.toolchain.expressions import FUNCTIONS

    return wire.Tables(
        commands=[_command(row) for row in COMMANDS],
        control=[_command(row) for row in CONTROL_FUNCTIONS],
        axis=[_parameter(-1, row) for row in AXIS_PARAMETERS if model in row.models],
        globals=[_parameter(row.bank, row) for row in GLOBAL_PARAMETERS],
        axis_groups=[title for title, _ in AXIS_GROUPS],
        global_groups=[title for title, _ in GLOBAL_GROUPS],
        statuses=[wire.Choice(int(number), text) for number, text in STATUS_TEXTS.items()],
        sister_commands=list(SISTER_COMMANDS),
        functions=list(FUNCTIONS),
        clock_hz=clock.HZ,
        program_size=PROGRAM_SIZE,
        coordinates=COORDINATES,
        stack_depth=STACK_DEPTH,
    )


def model_shape(model: Model, *, known: bool) -> wire.ModelShape:
    """A module's kind; `known` when it has said so itself."""
    return wire.ModelShape(
        number=model.number,
        name=model.name,
        version=model.version,
        drivers=model.drivers is not None,
        max_current_ma=model.max_current_ma,
        shutdown_pin=model.shutdown_pin,
        known=known,
    )


def _command(row: Command) -> wire.CommandShape:
    operands = [
        wire.OperandShape(o.name, o.field, o.kind, o.low, o.high, _words(o.words), o.required)
        for o in row.operands
    ]
    return wire.CommandShape(
        row.number, row.mnemonic, row.syntax, row.title, row.meaning, row.section, sorted(row.where), operands
    )


def _parameter(bank: int, row: AxisParameter | GlobalParameter) -> wire.Parameter:
    groups = AXIS_GROUP if bank < 0 else GLOBAL_GROUP
    return wire.Parameter(
        bank, row.number, row.key, row.name, row.access, row.low, row.high, row.default, row.unit, row.meaning,
        row.section, _choices(row.choices), row.kind, "" if bank > 0 else groups[row.number],
        list(row.bits) if isinstance(row, AxisParameter) else [], bool(row.effect),
    )  # fmt: skip


def _words(words: Words) -> list[wire.Choice]:
    return [wire.Choice(number, word) for word, number in words]


def _choices(choices: Choices) -> list[wire.Choice]:
    return [wire.Choice(number, text) for number, text in choices]
