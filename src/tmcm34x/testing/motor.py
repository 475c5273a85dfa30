"""One motor, as tests see it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Protocol

from tmcm34x.testing.errors import WrongUseError
from tmcm34x.tmcl.axis_parameters import BY_KEY
from tmcm34x.tmcl.commands import BY_MNEMONIC, MOTORS
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.status import STATUS_TEXTS, Status
from tmcm34x.toolchain.mending.spelling import proposal

if TYPE_CHECKING:
    from tmcm34x.bench.world import AxisView

_GAP: Final = BY_MNEMONIC["GAP"].number
_SAP: Final = BY_MNEMONIC["SAP"].number
_FULL_STEP: Final = 1.0
"""Full steps from which on a motor has lost steps: less is how far a rotor lags behind its field."""


class Commanded(Protocol):
    """What a motor needs of its module: see `base.ModuleUnderTest`."""

    def execute(self, instruction: Instruction, module: int = 0) -> tuple[int, int]:
        """Execute a command; status and value of its reply."""
        ...

    def ask(self, instruction: Instruction, module: int = 0) -> tuple[int, int]:
        """Status and value that a reading command gives."""
        ...

    def view(self, motor: int, module: int = 0) -> AxisView:
        """An axis as an onlooker sees it."""
        ...


class Motor:
    """One motor of a module; besides the properties here, every axis parameter is an attribute by its key.

    Reading `motor.max_speed` is a GAP without effects, assigning to it a SAP; neither is a telegram on the line of a
    virtual module.
    """

    __slots__ = ("_module", "_number", "number")
    number: int
    """0..2."""

    def __init__(self, module: Commanded, number: int, module_number: int = 0) -> None:
        if number not in range(MOTORS):
            raise WrongUseError(f"motor is 0..{MOTORS - 1}, not {number!r}")
        object.__setattr__(self, "_module", module)
        object.__setattr__(self, "number", number)
        object.__setattr__(self, "_number", module_number)

    _module: Commanded
    _number: int

    def __repr__(self) -> str:
        return f"<motor {self.number} of {self._module!r}>"

    def __getattr__(self, key: str) -> int:
        return self._ask(_GAP, key)

    def __setattr__(self, key: str, value: int) -> None:
        self._ask(_SAP, key, value)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *BY_KEY]

    def _ask(self, number: int, key: str, value: int = 0) -> int:
        row = BY_KEY.get(key)
        if row is None:
            hint = proposal(key, BY_KEY) or "; dir(motor) lists them"
            raise AttributeError(f"no axis parameter {key!r}{hint}")
        instruction = Instruction(number, row.number, self.number, value)
        module = self._module
        ask = module.ask if number == _GAP else module.execute
        status, answer = ask(instruction, self._number)
        if status != Status.OK:
            raise WrongUseError(f"{key} of motor {self.number}: {STATUS_TEXTS.get(status, 'no reply')}")
        return answer

    @property
    def position(self) -> int:
        """Actual position [microsteps] (axis parameter 1)."""
        return self._ask(_GAP, "actual_position")

    @property
    def target(self) -> int:
        """Target position [microsteps] (axis parameter 0)."""
        return self._ask(_GAP, "target_position")

    @property
    def speed(self) -> int:
        """Actual speed [velocity units] (axis parameter 3)."""
        return self._ask(_GAP, "actual_speed")

    @property
    def at_target(self) -> bool:
        """Whether the motor is at its target position (axis parameter 8)."""
        return bool(self._ask(_GAP, "position_reached"))

    @property
    def moving(self) -> bool:
        """Whether the actual speed is other than 0."""
        return self.speed != 0

    # What only a bench can tell

    @property
    def view(self) -> AxisView:
        """The axis as an onlooker sees it.  Raises `NotOnRealModuleError` on a real module."""
        return self._module.view(self.number, self._number)

    @property
    def load_position(self) -> float:
        """Where the load is [mm or degrees]."""
        return self.view.position

    @property
    def current_ma(self) -> float:
        """Coil current (RMS) [mA]."""
        return self.view.current_ma

    @property
    def lost_steps(self) -> int:
        """Full steps by which the rotor is away from where the chip counts it; 0 without loss."""
        lost = abs(self.view.lost_fullsteps)
        return round(lost) if lost >= _FULL_STEP else 0
