"""Loops in which a program asks again and again for what cannot change yet.

A command *repeats* when, executed again before anything else happens, it has no effect and reads the same value: one
that reads what cannot change yet, or one that writes a target which the motor has already.  When a program comes back
to the very state it had at such a command, with nothing but such commands on the way, it goes round in a circle until
something else happens, or until an input is known to change: it need not be run.

All this saves work and changes no result: whatever is not certainly repeated is executed.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from tmcm34x.board.board import INPUTS
from tmcm34x.chips.ramp import RAMP, VELOCITY
from tmcm34x.clock import NEVER
from tmcm34x.firmware.axis import A_ACTUAL, RAMP_MODE, V_ACTUAL, V_TARGET, X_TARGET
from tmcm34x.firmware.io import ANALOG_INPUTS, DIGITAL_INPUTS
from tmcm34x.firmware.program.registers import Contents
from tmcm34x.tmcl.axis_parameters import AXIS_PARAMETERS, BY_KEY
from tmcm34x.tmcl.commands import BY_MNEMONIC, MOTORS, MOVE_TYPES, RFS_TYPES
from tmcm34x.tmcl.global_parameters import GLOBAL_PARAMETERS
from tmcm34x.tmcl.numbers import AP

if TYPE_CHECKING:
    from tmcm34x.clock import Value
    from tmcm34x.firmware.axis import AxisState
    from tmcm34x.firmware.state import ModuleState
    from tmcm34x.tmcl.datagram import Instruction

RAMP_TICK: Final = 32
"""Clocks of a ramp tick at ramp divisor 0."""

_GAP, _GGP, _GIO, _GCO, _SIO, _RFS = (
    BY_MNEMONIC[name].number for name in ("GAP", "GGP", "GIO", "GCO", "SIO", "RFS")
)
_SAP, _AAP, _MVP, _ROR, _ROL, _MST = (
    BY_MNEMONIC[name].number for name in ("SAP", "AAP", "MVP", "ROR", "ROL", "MST")
)
_ABS: Final = dict(MOVE_TYPES)["ABS"]
_TARGETS: Final = {int(AP.TARGET_POSITION): X_TARGET, int(AP.TARGET_SPEED): V_TARGET}
"""Registers that a program may write again and again, by axis parameter."""
_WRITTEN: Final[dict[int, Callable[[int], int]]] = {
    _SAP: int, _AAP: int, _MVP: int, _ROR: int, _ROL: int.__neg__, _MST: lambda _value: 0,
}  # fmt: skip
"""What a command writes into the register of the target, from its value."""
_RFS_STATUS: Final = dict(RFS_TYPES)["STATUS"]
_SETTINGS: Final = frozenset(
    row.number for row in AXIS_PARAMETERS if row.stored or row.key in {
        "target_position", "position_reached", "reference_switch", "left_switch", "right_switch", "ramp_mode",
        "end_switch_distance", "group_index",
    }
)  # fmt: skip
"""Axis parameters that change only by a command, or at an event of the motion chip."""
_POSITION, _SPEEDS, _ACCELERATION = (
    BY_KEY["actual_position"].number,
    frozenset({BY_KEY["target_speed"].number, BY_KEY["actual_speed"].number}),
    BY_KEY["actual_acceleration"].number,
)
"""Axis parameters that follow the motion."""
_RESTLESS: Final = frozenset(
    row.number for row in GLOBAL_PARAMETERS if row.key in {
        "datagram_low_word", "datagram_high_word", "program_counter", "tick_timer", "random_number",
    }
)  # fmt: skip
"""Global parameters that change by themselves."""


class Cycle(NamedTuple):
    """A state that comes back every `period` clocks from `start` on, as long as nothing outside acts."""

    contents: Contents
    start: int
    """The clock at which the command at its counter has its effect for the first time."""
    executed: int
    """Commands executed by the program at `start`."""
    period: int
    commands: int
    """Executed in one period."""
    values: tuple[int | None, ...]
    """What the module commands of one period read, in order; None for nothing."""
    until: int
    """The clock at which something read may be another by itself."""


class Anchor:
    """A state before a repeating command, to compare later ones with, and what was read since."""

    __slots__ = ("contents", "executed", "horizon", "patience", "start", "until", "values")

    def __init__(
        self, contents: Contents, start: int, executed: int, horizon: int, patience: int = 1
    ) -> None:
        self.contents = contents
        self.start = start
        self.executed = executed
        self.horizon = horizon
        """The board's next event then: nothing on it changes before."""
        self.patience = patience
        """Commands after which another anchor is tried; doubles each time."""
        self.until = horizon
        """The clock at which something read since may be another by itself."""
        self.values: list[int | None] = []

    def cycle(self, now: int, executed: int) -> Cycle:
        """The cycle from here to the same state at `now`."""
        return Cycle(
            self.contents, self.start, self.executed, now - self.start, executed - self.executed,
            tuple(self.values), self.until,
        )  # fmt: skip


class CycleSearch:
    """Looks for the cycle in what a program executes.

    The program calls `meet` before and `passed` after each command that `repeats`, and `forget` whenever anything
    else happens.
    """

    __slots__ = ("_anchor", "_disturbed", "_found", "_module", "_outputs", "_until", "cycle")

    def __init__(self, module: ModuleState) -> None:
        self._module = module
        self.cycle: Cycle | None = None
        """The program goes round in it, from its start until its end, unless something happens."""
        self._anchor: Anchor | None = None
        self._disturbed = 0
        self._found: Cycle | None = None
        self._until = NEVER
        self._outputs = 0

    def forget(self, now: int) -> None:
        """Something happened at `now` that a program may notice."""
        self.cycle = self._anchor = None
        self._disturbed = now

    def leave(self) -> None:
        """What is read may be another from now on; a cycle of registers alone reads nothing."""
        if self.cycle is None or self.cycle.values:
            self.cycle = self._anchor = None

    def expired(self, now: int) -> bool:
        """Whether the cycle has come to its end."""
        return self.cycle is not None and now >= self.cycle.until

    def save(self, *, found: bool) -> Value:
        """The search for a cycle as a plain value; found: whether the program has come to where the cycle was found."""
        anchor = self._anchor
        seen = None if anchor is None else (
            anchor.contents, anchor.start, anchor.executed, anchor.horizon, anchor.patience, anchor.until,
            tuple(anchor.values),
        )  # fmt: skip
        return tuple(self.cycle) if found and self.cycle is not None else None, seen, self._disturbed

    def load(self, value: Any) -> None:
        """Go back to what `save` gave."""
        cycle, seen, self._disturbed = value
        self.cycle = None if cycle is None else Cycle(*cycle)
        self._anchor = None
        if seen is not None:
            *facts, until, values = seen
            self._anchor = Anchor(*facts)
            self._anchor.until, self._anchor.values = until, list(values)

    def repeats(self, instruction: Instruction, accumulator: int, now: int) -> bool:
        """Whether the command has no effect and the same result when repeated before the board's next event."""
        number, type_, motor, value = instruction
        if number in _WRITTEN:
            written = accumulator if number == _AAP else _WRITTEN[number](value)
            return motor < MOTORS and self._written(number, type_, motor, written)
        if number == _GAP:
            return type_ in _SETTINGS or (motor < MOTORS and self._steady(type_, motor, now))
        if number == _GGP:
            return type_ not in _RESTLESS
        if number == _RFS:
            return type_ == _RFS_STATUS
        if number == _GIO:
            return motor != ANALOG_INPUTS or (type_ < INPUTS and self._module.circuit.steady(type_))
        return number in {_GCO, _SIO}

    def _written(self, number: int, type_: int, motor: int, value: int) -> bool:
        """Whether a command sets a target that the motor has, and that it goes on with as it does."""
        axis = self._module.axes[motor]
        if axis.search or not axis.steady:
            return False
        turning = axis.read(RAMP_MODE) == VELOCITY
        if number in {_SAP, _AAP}:
            field = _TARGETS.get(type_)
            return field is not None and turning == (field is V_TARGET) and axis.read(field) == value
        if axis.values[AP.GROUP_INDEX]:
            return False
        if number == _MVP:
            placed = axis.read(RAMP_MODE) == RAMP and not axis.open and not axis.scaled
            return type_ == _ABS and placed and axis.read(X_TARGET) == value
        return turning and axis.open and not axis.scaled and axis.read(V_TARGET) == value

    def _takes_up(self, axis: AxisState, now: int) -> bool:
        """Whether the chip may not have taken up yet what was written: it does with its next ramp tick."""
        return now - self._disturbed <= RAMP_TICK << axis.values[AP.RAMP_DIVISOR]

    def _steady(self, parameter: int, motor: int, now: int) -> bool:
        """Whether a parameter that follows the motion keeps its value until the chip's next event."""
        axis = self._module.axes[motor]
        if self._takes_up(axis, now):
            return False
        speed = axis.read(V_ACTUAL)
        if not speed and not axis.at_rest:
            return False  # it turns round
        if (speed and parameter == _POSITION) or speed != axis.read(V_TARGET):
            return False
        if parameter == _ACCELERATION:
            return not axis.read(A_ACTUAL)
        return parameter in _SPEEDS or parameter == _POSITION

    def meet(self, instruction: Instruction, contents: Contents, executed: int, now: int) -> None:
        """A repeating command is about to be executed, with these contents of the registers."""
        board = self._module.circuit
        horizon, anchor = board.next_event(), self._anchor
        self._outputs, self._found = board.outputs, None
        self._until = self._next_edge(instruction)
        if anchor is None or anchor.horizon != horizon or anchor.until <= now:
            self._anchor = Anchor(contents, now, executed, horizon)
        elif anchor.contents == contents:
            self._found = anchor.cycle(now, executed)
        elif len(anchor.values) == anchor.patience:
            self._anchor = Anchor(contents, now, executed, horizon, 2 * anchor.patience)

    def passed(self, value: int | None, now: int, *, refused: bool) -> None:
        """The command has been executed and has read `value`."""
        anchor, found = self._anchor, self._found
        if anchor is None:
            return
        if refused or self._until <= now or self._module.circuit.outputs != self._outputs:
            self._anchor = None
            return
        anchor.values.append(value)
        anchor.until = min(anchor.until, self._until)
        if found is not None and found.values[0] == value:
            self.cycle = found

    def _next_edge(self, instruction: Instruction) -> int:
        """The next clock at which digital inputs that GIO reads may change by themselves; 0: not known."""
        number, port, bank, _ = instruction
        if number != _GIO or bank != DIGITAL_INPUTS:
            return NEVER
        board = self._module.circuit
        return board.next_edge(port) if port < INPUTS else min(map(board.next_edge, range(INPUTS)))
