"""What a debugger can look at and change in a module, by name.

| name                  | what                                                                          |
| --------------------- | ----------------------------------------------------------------------------- |
| `accumulator`, `x`    | the program's registers                                                       |
| `counter`, `depth`    | address of the next command; open CSUBs                                       |
| `zero` ... `esd`      | the flags that JC looks at                                                    |
| `time_ms`             | virtual time                                                                  |
| `gp[n]`, `gp[n][b]`   | user variable n; global parameter n of bank b                                 |
| `ap[n][m]`            | axis parameter n of motor m; n may be a key, as in `ap[max_speed][0]`         |
| `co[n][m]`            | coordinate n of motor m                                                       |
| `in[n]`, `out[n]`     | digital lines; 255 is all eight                                               |
| `adc[n]`, `shutdown`  | analogue inputs; the SHUTDOWN pin                                             |
| labels and constants  | of the program's source                                                       |

Parameters, coordinates and lines are read and written with the module's own commands, so ranges and refusals
are the module's.  Inputs are changed by a hand on the bench.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Final, NamedTuple, cast

from tmcm34x.board.board import ANALOG_MAX, INPUTS
from tmcm34x.clock import MS, NEVER
from tmcm34x.debug.expressions import (
    ExpressionError,
    Reference,
    compile_expression,
    compile_reference,
    values_of,
)
from tmcm34x.firmware.program.registers import ERROR_FLAGS, NOT_COMPARED
from tmcm34x.tmcl import axis_parameters, global_parameters
from tmcm34x.tmcl.axis_parameters import AxisParameter
from tmcm34x.tmcl.commands import (
    BY_MNEMONIC,
    COORDINATES,
    INT32_MAX,
    INT32_MIN,
    MOTORS,
    PROGRAM_SIZE,
    USER_VARIABLES,
)
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.global_parameters import GlobalParameter
from tmcm34x.tmcl.status import STATUS_TEXTS, Status

if TYPE_CHECKING:
    from tmcm34x.bench import World
    from tmcm34x.firmware.module import FirmwareModule
    from tmcm34x.toolchain.assembler import Symbol

Execute = Callable[[Instruction], tuple[int, int]]
"""Has a command executed; gives back status and value of the reply."""

_NUMBERS: Final = {mnemonic: row.number for mnemonic, row in BY_MNEMONIC.items()}
_INPUT_BANK, _ANALOG_BANK, _OUTPUT_BANK = range(3)
_USER_BANK: Final = 2
_SHUTDOWN_PORT: Final = 10
_SHUTDOWN_SOURCE: Final = 8
_ALL: Final = 255
_COMPARISONS: Final = {"equal": 0, "lower": -1, "greater": 1}


class ScopeItem(NamedTuple):
    """One value of a scope.

    expression: by which it can be asked for and assigned to
    meaning: in our words; choices: of some values
    acting: reading it does something in a module at the end of a line, so it is read on demand only
    """

    name: str
    expression: str
    writable: bool
    meaning: str = ""
    choices: tuple[tuple[int, str], ...] = ()
    acting: bool = False


class View:
    """Names to values, both ways.

    read: answers a reading command; a module in this process is looked at without acting (`FirmwareModule.peek`)
    write: has a command executed
    module: in this process, for what no command tells; None for one at the end of a line
    world: its bench, for the levels of the inputs
    """

    def __init__(
        self,
        read: Execute,
        write: Execute,
        *,
        module: FirmwareModule | None = None,
        world: World | None = None,
    ) -> None:
        self._read, self._write = read, write
        self._module, self._world = module, world
        self.symbols: Mapping[str, Symbol] = {}
        """Labels and constants of the program, by upper-case name."""
        self.locked = False
        """The program is in the middle of something: its counter cannot be moved."""
        self.read_only = ""
        """Why nothing can be written; empty where it can."""
        self.on_write: list[Callable[[str, int], None]] = []
        """Called with each value that was changed through this view: its name with indices, and what it was set to."""

    @classmethod
    def of(cls, module: FirmwareModule, world: World | None = None) -> View:
        """The view of a module in this process."""
        return cls(module.peek, module.execute, module=module, world=world)

    # Names

    def read(self, name: str, indices: tuple[int, ...] = ()) -> int:
        """The value of `name`; raises `ExpressionError`."""
        key = name.lower()
        self._check_power(key)
        if key in _COMMANDS:
            return self._ask(*_command(key, "read", indices))
        if key in _REGISTERS:
            _check_count(name, indices, 0)
            return self._register(key)
        if not indices:
            value = self._constant(name)
            if value is not None:
                return value
        raise ExpressionError(f"no value named {name}")

    def reaches(self, motor: int, position: int) -> int:
        """The clock at which a motor comes to a position, as it moves now.

        `NEVER` where it does not before its next event, and on a module whose motion chip is not here.
        """
        if self._module is None or not 0 <= motor < MOTORS:
            return NEVER
        chip, smda = self._module.board.wiring(motor)
        return self._module.board.chips[chip].reaches(smda, position)

    def evaluate(self, text: str) -> int:
        """The value of an expression; raises `ExpressionError`."""
        return int(compile_expression(text)(self.read))

    def assign(self, target: str, value: str) -> int:
        """Change what `target` names to the value of an expression; gives back what it is then."""
        reference = compile_reference(target)
        self.write(reference, self.evaluate(value))
        return reference_value(reference, self)

    def write(self, reference: Reference, value: int) -> None:
        """Change a value; raises `ExpressionError` where module or bench do not allow it."""
        if self.read_only:
            raise ExpressionError(self.read_only)
        name, key = reference.name, reference.name.lower()
        indices = values_of(reference.indices, self.read)
        if not INT32_MIN <= value <= INT32_MAX:
            raise ExpressionError(f"{value} has more than 32 bits")
        self._check_power(key)
        if key in {"in", "adc", "shutdown"}:
            self._set_pin(key, indices, value)
        elif key in _COMMANDS:
            self._ask(*_command(key, "write", indices), value, writing=True)
        elif key in _REGISTERS:
            _check_count(name, indices, 0)
            self._set_register(key, value)
        else:
            raise ExpressionError(f"nothing can be written to {name}")
        for listener in self.on_write:
            listener(key + "".join(f"[{index}]" for index in indices), value)

    def _check_power(self, key: str) -> None:
        if self._module is not None and not self._module.powered and key != "time_ms":
            raise ExpressionError("the module has no power")

    def _ask(self, mnemonic: str, type_: int, motor: int, value: int = 0, *, writing: bool = False) -> int:
        instruction = Instruction(_NUMBERS[mnemonic], type_, motor, value)
        status, result = (self._write if writing else self._read)(instruction)
        if status != Status.OK:
            text = STATUS_TEXTS.get(status, "unknown status")
            raise ExpressionError(f"{mnemonic} {type_}, {motor}: {text} (status {status})")
        return result

    def _constant(self, name: str) -> int | None:
        symbol = self.symbols.get(name.upper())
        if symbol is not None:
            return round(symbol.value)
        row = axis_parameters.BY_KEY.get(name) or global_parameters.BY_KEY.get(name)
        return None if row is None else row.number

    # What no command tells

    def _register(self, key: str) -> int:
        if self._module is None:
            if key == "counter":
                return self._ask("GGP", global_parameters.BY_KEY["program_counter"].number, 0)
            raise ExpressionError(f"the module's firmware does not report {key}")
        program = self._module.program
        if key == "time_ms":
            return self._module.now // MS
        if key == "depth":
            return len(program.stack)
        if key in _FLAGS:
            return int(program.flags[_FLAGS[key]])
        return int(getattr(program, key))

    def _set_register(self, key: str, value: int) -> None:
        if self._module is None:
            raise ExpressionError(f"the module's firmware does not let {key} be set")
        if key == "time_ms":
            raise ExpressionError("time_ms cannot be set")
        program = self._module.program
        if key == "depth" and not 0 <= value <= len(program.stack):
            raise ExpressionError(f"depth can be set to 0 to {len(program.stack)}: inner routines are left")
        if key == "counter" and not 0 <= value < PROGRAM_SIZE:
            raise ExpressionError(f"addresses are 0 to {PROGRAM_SIZE - 1}")
        if key == "counter" and program.waiting:
            raise ExpressionError("the program is in a WAIT; step over it first")
        program.wake()
        if key == "depth":
            del program.registers.stack[value:]
        elif key in _FLAGS:
            self._set_flag(_FLAGS[key], bool(value))
        else:
            setattr(program.registers, key, value)

    def _set_flag(self, flag: str, on: bool) -> None:
        registers = cast("FirmwareModule", self._module).program.registers
        if flag in ERROR_FLAGS:
            bit = ERROR_FLAGS[flag]
            registers.errors = registers.errors | bit if on else registers.errors & ~bit
        elif flag == "zero":
            registers.result = 0 if on else registers.result or 1
        elif on:
            registers.difference = _COMPARISONS[flag]
        elif self._register(flag):
            registers.difference = NOT_COMPARED

    def _set_pin(self, key: str, indices: tuple[int, ...], value: int) -> None:
        if self._world is None:
            raise ExpressionError("there is no bench here: the inputs are the machine's")
        high = ANALOG_MAX if key == "adc" else 1
        _check_count(key, indices, 0 if key == "shutdown" else 1)
        if not 0 <= value <= high:
            raise ExpressionError(f"{key} is 0 to {high}")
        number = indices[0] if indices else _SHUTDOWN_SOURCE
        if indices and not 0 <= number < INPUTS:
            raise ExpressionError(f"inputs are 0 to {INPUTS - 1}")
        self._world.set_level(number, value if key == "adc" else value * ANALOG_MAX)

    # Scopes

    def scopes(self) -> dict[str, Callable[[], list[ScopeItem]]]:
        """All scopes: what each one holds, by its title."""
        scopes: dict[str, Callable[[], list[ScopeItem]]] = {}
        if self._module is not None:
            scopes["Registers"] = _registers
            scopes["Flags"] = lambda: [ScopeItem(key.upper(), key, True) for key in _FLAGS]
        scopes["User variables"] = lambda: [
            ScopeItem(f"gp[{n}]", f"gp[{n}]", True) for n in range(USER_VARIABLES)
        ]
        for motor in range(MOTORS):
            scopes[f"Motor {motor}"] = lambda motor=motor: self._axis(motor)
        scopes["Coordinates"] = lambda: [
            ScopeItem(f"co[{n}][{m}]", f"co[{n}][{m}]", True, f"coordinate {n} of motor {m}")
            for n in range(COORDINATES)
            for m in range(MOTORS)
        ]
        scopes["Inputs and outputs"] = self._lines
        scopes["Global parameters"] = self._globals
        return scopes

    def _axis(self, motor: int) -> list[ScopeItem]:
        rows = [row for row in axis_parameters.AXIS_PARAMETERS if row.readable]
        if self._module is not None:
            rows = [row for row in rows if self._module.board.model.number in row.models]
        return [self._parameter(row, f"ap[{row.number}][{motor}]") for row in rows]

    def _globals(self) -> list[ScopeItem]:
        return [
            self._parameter(row, f"gp[{row.number}][{row.bank}]")
            for row in global_parameters.GLOBAL_PARAMETERS
            if row.bank != _USER_BANK and row.readable
        ]

    def _parameter(self, row: AxisParameter | GlobalParameter, expression: str) -> ScopeItem:
        meaning = f"{row.number} {row.name}" + (f" [{row.unit}]" if row.unit else "")
        acting = self._module is None and bool(row.effect)
        return ScopeItem(row.key, expression, row.writable, meaning, row.choices, acting)

    def _lines(self) -> list[ScopeItem]:
        by_hand = self._world is not None
        items = [ScopeItem(f"in[{n}]", f"in[{n}]", by_hand, "digital input") for n in range(INPUTS)]
        items += [ScopeItem(f"out[{n}]", f"out[{n}]", True, "digital output") for n in range(INPUTS)]
        items += [
            ScopeItem(f"adc[{n}]", f"adc[{n}]", by_hand, "analogue input, 0 to 1023") for n in range(INPUTS)
        ]
        return [*items, ScopeItem("shutdown", "shutdown", by_hand, "SHUTDOWN pin")]


def reference_value(reference: Reference, view: View) -> int:
    """What a reference's value is now."""
    return view.read(reference.name, values_of(reference.indices, view.read))


_FLAGS: Final = {word.lower(): word for word in ("zero", "equal", "lower", "greater", *ERROR_FLAGS)}
_REGISTERS: Final = frozenset({"accumulator", "x", "counter", "depth", "time_ms", *_FLAGS})


class _Command(NamedTuple):
    """How an indexed name is read and written: mnemonics, number of indices, and where the second one is fixed."""

    read: str
    write: str
    indices: tuple[int, int]
    motor: int | None = None


_COMMANDS: Final = {
    "ap": _Command("GAP", "SAP", (2, 2)),
    "gp": _Command("GGP", "SGP", (1, 2), _USER_BANK),
    "co": _Command("GCO", "SCO", (2, 2)),
    "in": _Command("GIO", "", (1, 1), _INPUT_BANK),
    "adc": _Command("GIO", "", (1, 1), _ANALOG_BANK),
    "out": _Command("GIO", "SIO", (1, 1), _OUTPUT_BANK),
    "shutdown": _Command("GIO", "", (0, 0), _INPUT_BANK),
}


def _command(key: str, what: str, indices: tuple[int, ...]) -> tuple[str, int, int]:
    """Mnemonic, type and motor of the command that reads or writes a name."""
    row = _COMMANDS[key]
    low, high = row.indices
    if not low <= len(indices) <= high:
        _check_count(key, indices, low)
    for index in indices:
        if not 0 <= index <= _ALL:
            raise ExpressionError(f"{key}: {index} is not 0 to {_ALL}")
    if key == "co" and indices[1] >= MOTORS:
        raise ExpressionError(f"motors are 0 to {MOTORS - 1}")
    type_ = indices[0] if indices else _SHUTDOWN_PORT
    motor = indices[1] if len(indices) == 2 else row.motor or 0
    return (row.read if what == "read" else row.write), type_, motor


def _check_count(name: str, indices: tuple[int, ...], count: int) -> None:
    if len(indices) != count:
        raise ExpressionError(
            f"{name}{'[...]' * count} takes {count or 'no'} {'index' if count == 1 else 'indices'}"
        )


def _registers() -> list[ScopeItem]:
    return [
        ScopeItem("accumulator", "accumulator", True),
        ScopeItem("x", "x", True, "the X register"),
        ScopeItem("counter", "counter", True, "address of the next command"),
        ScopeItem("depth", "depth", True, "open CSUBs; a smaller number leaves the inner ones"),
        ScopeItem("time_ms", "time_ms", False, "virtual time [ms]"),
    ]
