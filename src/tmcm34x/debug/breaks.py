"""Breaks: hold the program when something happens to the module, wherever the program is.

Editors show them as check boxes beside the breakpoints (exception filters of the Debug Adapter Protocol).  A break
holds at the clock at which its event happens, after it; the way back (`reverse`) finds the same clocks.

Source: `BREAKS`, one row each.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Final, NamedTuple

from tmcm34x.debug.control import Stop
from tmcm34x.debug.expressions import Expression, ExpressionError, Read
from tmcm34x.firmware.drivers import peek_flags
from tmcm34x.firmware.program.registers import ERROR_FLAGS
from tmcm34x.tmcl.axis_parameters import BY_NUMBER
from tmcm34x.tmcl.commands import MOTORS
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.mnemonic import format_instruction
from tmcm34x.tmcl.numbers import AP
from tmcm34x.tmcl.status import STATUS_TEXTS
from tmcm34x.world.load_axis import Grip

if TYPE_CHECKING:
    from tmcm34x.bench import World
    from tmcm34x.board.board import Side
    from tmcm34x.firmware.module import FirmwareModule
    from tmcm34x.firmware.program import ProgramError
    from tmcm34x.firmware.roles import Port

Signs = Callable[["FirmwareModule", "World | None"], Iterator[str]]
"""Everything of one kind that is so now, each in words."""

_SIDES: Final[tuple[Side, ...]] = ("left", "right")
_OUT_OF_STEP: Final = frozenset({Grip.STALLED, Grip.BLOCKED})


def _no_signs(_: FirmwareModule, __: World | None) -> Iterator[str]:
    yield from ()


def _error_flags(module: FirmwareModule, _: World | None) -> Iterator[str]:
    errors = module.program.registers.errors
    yield from (f"the flag {word} is set" for word, bit in ERROR_FLAGS.items() if errors & bit)


def _driver_flags(module: FirmwareModule, _: World | None) -> Iterator[str]:
    if not module.powered or not module.board.model.drivers:
        return
    names = BY_NUMBER[AP.DRIVER_ERROR_FLAGS].bits
    for motor in range(MOTORS):
        flags = peek_flags(module.board, motor)
        yield from (f"driver of motor {motor}: {name}" for bit, name in enumerate(names) if flags >> bit & 1)


def _closed_switches(module: FirmwareModule, _: World | None) -> Iterator[str]:
    for motor in range(MOTORS):
        yield from (
            f"the {side} switch of motor {motor} closed"
            for side in _SIDES
            if module.board.switch(motor, side)
        )


def _lost_steps(_: FirmwareModule, world: World | None) -> Iterator[str]:
    for mount in () if world is None else world.mounts:
        if mount.axis.grip in _OUT_OF_STEP:
            yield f"motor {mount.motor} loses steps"


class Break(NamedTuple):
    """One kind of event.

    key: by which editors choose it
    label, meaning: for people
    signs: what is looked at after each event; a sign that was not there before holds the program
    default: whether it is chosen unless the editor says otherwise
    each_command: whether what it looks at may come and go between two events of the bench
    needs_bench: whether a module's motors and loads are looked at, not the module alone
    """

    key: str
    label: str
    meaning: str
    signs: Signs = _no_signs
    default: bool = False
    each_command: bool = False


REFUSED: Final = "refused"
STALL: Final = "stall"

_ROWS: Final = (
    Break(
        REFUSED, "Refused commands",
        "After a command that was answered with an error status, and at an end without STOP", default=True,
    ),
    Break(
        "flag", "Error flags", "When ETO, EAL, EDV, EPO or ESD is set, which JC looks at", _error_flags,
        each_command=True,
    ),
    Break(
        "driver_flag", "Driver error flags",
        "When a motor driver reports an error that was not there before (axis parameter 208)", _driver_flags,
    ),
    Break(STALL, "Stall", "When stall detection stops a motor (axis parameter 205)"),
    Break("switch", "Closed switch", "When the left or right switch of a motor closes", _closed_switches),
    Break(
        "lost_steps", "Lost steps", "When a rotor gets out of step or is blocked; a bench is needed", _lost_steps
    ),
)  # fmt: skip
BREAKS: Final[Mapping[str, Break]] = MappingProxyType({row.key: row for row in _ROWS})
"""All kinds of breaks, by key."""

Wanted = Mapping[str, Expression | None]
"""Keys of breaks, each with its condition, if it has one."""


def error_text(module: FirmwareModule, error: ProgramError) -> str:
    """What went wrong in a program, in one line."""
    stored = module.program.memory.read(error.address)
    if not isinstance(stored, Instruction) or stored.number == 0:
        return "the program ran past its end; is a STOP missing?"
    return f"{format_instruction(stored)}: {STATUS_TEXTS[error.status]} (status {error.status:d})"


class Breaks:
    """The breaks that are in force on one module, and what they saw last.

    read: gives the values of names in conditions
    """

    instruction = None
    """As an observer: single commands need not be shown."""

    def __init__(self, module: FirmwareModule, world: World | None, read: Read) -> None:
        self._module = module
        self._world = world
        self._read = read
        self._wanted: dict[str, Expression | None] = {}
        self._seen: dict[str, frozenset[str]] = {}
        self._stalled: list[int] = []
        self._error = module.program.last_error

    @property
    def wanted(self) -> Wanted:
        """Those that are in force."""
        return self._wanted

    @property
    def each_command(self) -> bool:
        """Whether the program must run command by command for them."""
        return any(BREAKS[key].each_command for key in self._wanted)

    @property
    def besides_refusals(self) -> bool:
        """Whether any other than that of refused commands is in force."""
        return bool(self._wanted.keys() - {REFUSED})

    def set(self, wanted: Wanted) -> None:
        """Take these instead of the present ones."""
        self.close()
        self._wanted = dict(wanted)
        if STALL in self._wanted:
            self._module.observers.append(self)
        self.look_again()

    def look_again(self) -> None:
        """Take things as they are now for known: the program was moved or started, not run."""
        self._error = self._module.program.last_error
        self._stalled.clear()
        self._seen = {key: self._signs(key) for key in self._wanted if BREAKS[key].signs is not _no_signs}

    def close(self) -> None:
        """Look at nothing any more."""
        if self in self._module.observers:
            self._module.observers.remove(self)
        self._wanted, self._seen = {}, {}

    def look(self, address: int) -> Stop | None:
        """A stop for what has happened since the last look, if anything has.

        address: of the program's next command
        """
        refused = self._refused()
        found = [(key, text) for key, text in self._happened() if self._holds(key)]
        if refused is not None or not found:
            return refused
        return Stop("exception", address, "; ".join(text for _, text in found), exception=found[0][0])

    def _refused(self) -> Stop | None:
        error = self._module.program.last_error
        if error is self._error:
            return None
        self._error = error
        if error is None or REFUSED not in self._wanted or not self._holds(REFUSED):
            return None
        return Stop("exception", error.address, error_text(self._module, error), exception=REFUSED)

    def _happened(self) -> Iterator[tuple[str, str]]:
        """Keys and words of what has happened since the last look, refusals aside."""
        stalled, self._stalled = self._stalled, []
        yield from ((STALL, f"stall detection stopped motor {motor}") for motor in stalled)
        for key, before in self._seen.items():
            now = self._signs(key)
            if now != before:
                self._seen[key] = now
                yield from ((key, text) for text in sorted(now - before))

    def _signs(self, key: str) -> frozenset[str]:
        return frozenset(BREAKS[key].signs(self._module, self._world))

    def _holds(self, key: str) -> bool:
        condition = self._wanted[key]
        try:
            return condition is None or bool(condition(self._read))
        except ExpressionError:
            return False

    # An observer of the module

    def telegram(self, port: Port, direction: str, data: bytes, now: int) -> None:
        """Telegrams are not looked at."""

    def event(self, kind: str, motor: int, now: int) -> None:
        """Something happened to a motor."""
        if kind == STALL:
            self._stalled.append(motor)
