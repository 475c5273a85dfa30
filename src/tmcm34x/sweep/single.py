"""The run of one row, and its figures."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Final, NamedTuple

import msgspec

from tmcm34x.bench import BenchError, Rig, simple_rig
from tmcm34x.bench.builder import build
from tmcm34x.bench.description import Bench, from_table
from tmcm34x.bench.run import UNTIL, Run
from tmcm34x.clock import HZ, clocks
from tmcm34x.debug.expressions import Expression, ExpressionError, compile_expression
from tmcm34x.debug.view import View
from tmcm34x.sweep.description import Number, SweepError
from tmcm34x.sweep.measure import LoadRecorder, LossRecorder
from tmcm34x.sweep.plan import SEED, Job, Row, place, reference
from tmcm34x.toolchain.assembler import Assembly
from tmcm34x.trace.figures import FiguresRecorder
from tmcm34x.trace.recorder import Recorder, Trace

_US: Final = HZ // 1_000_000


class RowResult(NamedTuple):
    """What came out of a row.

    figures: in the order of the sweep; none where there was no run
    ending: one of `bench.run.ENDINGS`
    error: why the row has failed, in one line; empty where it has not
    """

    figures: tuple[int, ...] = ()
    ending: str = ""
    error: str = ""


def result_of(job: Job, row: Row, observe: Callable[[Rig], Recorder] | None = None) -> RowResult:
    """Do the run of a row; what its values make impossible is the error of its result.  For `observe` see `Single`."""
    try:
        return Single(job, values_of(job, row), observe).result()
    except (SweepError, BenchError, ExpressionError) as error:
        return RowResult(error=str(error))


def values_of(job: Job, row: Row) -> dict[str, Number]:
    """The values of a row by what they are of."""
    return dict(zip((vary.what for vary in job.sweep.vary), row, strict=True))


class Single:
    """A rig with the program and the values of a row; raises `SweepError`, `BenchError` or `ExpressionError`.

    values: by what they are of, see `sweep.description.Vary`
    observe: gives a further recorder of the run
    """

    def __init__(
        self, job: Job, values: Mapping[str, Number], observe: Callable[[Rig], Recorder] | None = None
    ) -> None:
        assembly = job.sources.assemble(_constants(job, values))
        self.sweep = job.sweep
        self.rig = _rig(job, values)
        self.recorder = FiguresRecorder(self.rig)
        self.losses = LossRecorder(self.rig)
        self.loads = LoadRecorder(self.rig)
        self.view = _view(self.rig, assembly)
        self.rig.modules[0].eeprom.write_program(assembly.program)
        for what, value in values.items():
            self._assign(what, value)
        condition = None if job.sweep.stop is None else _condition("stop", job.sweep.stop, self.read)
        self._figures = [
            (name, _compiled(f"figures.{name}", text)) for name, text in job.sweep.figures.items()
        ]
        recorders = [self.recorder, self.losses, *([observe(self.rig)] if observe else [])]
        if _OF_LOAD.search(" ".join([job.sweep.stop or "", *job.sweep.figures.values()])):
            recorders.append(self.loads)
        self.run = Run(self.rig, Trace(self.rig, recorders), condition)

    def result(self) -> RowResult:
        """Of the run, which is done now."""
        self.run.start()
        ending = self.run.go(clocks(self.sweep.until_s))
        late = (
            f"not over after {self.sweep.until_s:g} s of simulated time (until_s)" if ending == UNTIL else ""
        )
        return RowResult(self.figures(), ending, late)

    def figures(self) -> tuple[int, ...]:
        """Now; raises `SweepError` where one has no value."""
        return tuple([_value(f"figures.{name}", expression, self.read) for name, expression in self._figures])

    def _assign(self, what: str, value: Number) -> None:
        target = None if what == SEED or what.startswith("bench.") else reference(what)
        if target is None:
            return
        if value != int(value):
            raise SweepError(f"{what} takes whole numbers, not {value}")
        try:
            self.view.write(target, int(value))
        except ExpressionError as error:
            raise SweepError(f"{what} = {value}: {error}") from None

    def read(self, name: str, indices: tuple[int, ...]) -> int:
        """The value of a name, of those of a sweep and those of the debugger; raises `ExpressionError`."""
        key = name.lower()
        if key in _OF_RUN and not indices:
            return _OF_RUN[key](self)
        if key in _OF_MOTOR and len(indices) == 1:
            last = len(self.losses.lost) - 1
            if not 0 <= indices[0] <= last:
                raise ExpressionError(f"{name}: motors are 0 to {last}")
            return _OF_MOTOR[key](self, indices[0])
        return self.view.read(name, indices)


_OF_RUN: Final[dict[str, Callable[[Single], int]]] = {
    "time_us": lambda single: single.rig.now // _US,
    "refused": lambda single: sum(single.run.refusals.values()),
}
"""Simulated time [us]; how many commands of the program were refused."""
_OF_MOTOR: Final[dict[str, Callable[[Single, int], int]]] = {
    "lost": lambda single, motor: single.losses.lost[motor],
    "distance": lambda single, motor: single.recorder.figures()[motor].distance,
    "peak_speed": lambda single, motor: single.recorder.figures()[motor].peak_speed,
    "overshoot": lambda single, motor: single.loads.motors[motor].overshoot,
    "margin": lambda single, motor: single.loads.motors[motor].margin,
    "peak_current_us": lambda single, motor: single.loads.motors[motor].peak_current_us,
}
"""Most lost full steps; microsteps made; greatest speed [velocity units]; and see `measure.LoadRecorder`."""
_OF_LOAD: Final = re.compile(r"\b(?:overshoot|margin|peak_current_us)\b", re.IGNORECASE)
"""Names whose recorder costs time, so that it is there only where one is used."""


def check_expressions(job: Job) -> None:
    """Raises `SweepError` or `BenchError` where nothing can be run, whatever the values of a row.

    Figures and the condition must have values before the run too.
    """
    single = Single(job, {})
    single.figures()
    if job.sweep.stop is not None:
        _value("stop", _compiled("stop", job.sweep.stop), single.read)


def _constants(job: Job, values: Mapping[str, Number]) -> dict[str, Number]:
    return {
        job.sources.constant(what): value
        for what, value in values.items()
        if what != SEED and not what.startswith("bench.") and reference(what) is None
    }


def _rig(job: Job, values: Mapping[str, Number]) -> Rig:
    seed = values.get(SEED)
    if job.bench is None:
        return simple_rig(job.sweep.model, seed=int(seed or 0))
    return build(_changed(job.bench, values))


def _changed(bench: Bench, values: Mapping[str, Number]) -> Bench:
    """The bench with the values of a row."""
    table = msgspec.to_builtins(bench)
    for what, value in values.items():
        if what == SEED:
            table[SEED] = value
        elif what.startswith("bench."):
            inner, step = place(table, what)
            inner[step] = value
    return from_table(table)


def _view(rig: Rig, assembly: Assembly) -> View:
    view = View.of(rig.modules[0], rig.worlds[0])
    view.symbols = assembly.symbols
    return view


def _compiled(path: str, text: str) -> Expression:
    try:
        return compile_expression(text)
    except ExpressionError as error:
        raise SweepError(f"{path}: {text}: {error}") from None


def _value(path: str, expression: Expression, read: Callable[[str, tuple[int, ...]], int]) -> int:
    try:
        return int(expression(read))
    except ExpressionError as error:
        raise SweepError(f"{path}: {error}") from None


def _condition(path: str, text: str, read: Callable[[str, tuple[int, ...]], int]) -> Callable[[], bool]:
    """Whether an expression is not 0; where it has no value now, it does not hold."""
    expression = _compiled(path, text)

    def holds() -> bool:
        try:
            return bool(expression(read))
        except ExpressionError:
            return False

    return holds
