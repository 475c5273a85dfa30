"""What virtual and real modules share in tests."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Self

from tmcm34x.bench.session.condition import Condition, read_condition
from tmcm34x.testing.errors import PATIENCE_S, TooLateError
from tmcm34x.testing.motor import Motor
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.mnemonic import parse_instruction

if TYPE_CHECKING:
    from pathlib import Path

    from tmcm34x.bench.session.world import MeasuredValue, Unit
    from tmcm34x.bench.world import AxisView
    from tmcm34x.host.module import Module as HostModule
    from tmcm34x.testing.history import History


class Subject:
    """What a condition in text looks at: see `bench.session.condition.Subject`."""

    def __init__(self, module: ModuleUnderTest) -> None:
        self._module = module

    @property
    def unit(self) -> Unit:
        """The first module on its bench."""
        return self._module.unit

    def ask(self, instruction: Instruction) -> tuple[int, int]:
        """Status and value of a command."""
        return self._module.ask(instruction)


class ModuleUnderTest(ABC):
    """A module, virtual or real, with what a test needs around it; a context manager.

    model: 341, 342 or 343
    real: whether it is a real one
    """

    model: int
    real: bool

    def __repr__(self) -> str:
        return f"<TMCM-{self.model}>"

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @abstractmethod
    def close(self) -> None:
        """Close all lines."""

    # Lines

    @property
    @abstractmethod
    def port(self) -> str:
        """A device name for host code that wants a serial port."""

    @property
    @abstractmethod
    def url(self) -> str:
        """`tcp://HOST:PORT` for host code that wants a socket."""

    @property
    @abstractmethod
    def address(self) -> str:
        """`HOST:PORT` for host code that wants a socket."""

    @property
    @abstractmethod
    def serial_url(self) -> str:
        """What pyserial's `serial_for_url` opens."""

    @abstractmethod
    def open_port(self, link: str | None = None) -> str:
        """A device name like `port`; under the symbolic link `link` if given."""

    @abstractmethod
    def connect(self) -> HostModule:
        """The module through this project's host library."""

    @property
    @abstractmethod
    def can(self) -> dict[str, Any]:
        """Arguments for `can.Bus(**module.can)` of python-can."""

    # Time

    @property
    @abstractmethod
    def now(self) -> float:
        """The module's time [s]."""

    @abstractmethod
    def run(self, seconds: float) -> None:
        """Let `seconds` of the module's time pass."""

    def until(self, condition: Callable[[], Any] | str, timeout: float = PATIENCE_S) -> float:
        """Let time pass until a condition holds; returns how much did [s].

        condition: a function, or text as in sessions, such as `GAP 8, 0 is 100 1` or `motor 0 at 5000`
        timeout: of the module's time [s]
        Raises `TooLateError` when the time is over.
        """
        start_s = self.now
        look = self._compile(condition) if isinstance(condition, str) else None
        holds = condition if callable(condition) else lambda: look is not None and look().holds
        if not self.run_until(holds, timeout):
            name = condition if isinstance(condition, str) else getattr(condition, "__name__", "<lambda>")
            what = "the condition" if name == "<lambda>" else name
            seen = "" if look is None else f"; it is {look().what} now"
            raise TooLateError(f"{what} did not come true within {timeout:g} s{seen}")
        return self.now - start_s

    def _compile(self, text: str) -> Callable[[], MeasuredValue]:
        condition: Condition = read_condition(text)
        subject = Subject(self)
        return lambda: condition.look(subject)

    @abstractmethod
    def run_until(self, holds: Callable[[], Any], timeout: float) -> bool:
        """Let time pass until `holds` returns something true, or the time is over; says whether it did."""

    # The module

    def motor(self, number: int, module: int = 0) -> Motor:
        """Motor 0..2.  Raises `ValueError` for another number."""
        return Motor(self, number, module)

    def command(self, text: str, module: int = 0) -> tuple[int, int]:
        """Execute a command such as `MVP ABS, 0, 1000`, beside the line; status and value of its reply."""
        return self.execute(parse_instruction(text), module)

    @abstractmethod
    def load(self, source: str | Path, *, run: bool = False) -> None:
        """Put a TMCL program, as source text or as a path, into the program memory, and perhaps start it."""

    @abstractmethod
    def covers(self, source: Path) -> None:
        """Count for `pytest --tmcl-coverage` what is executed of a program that a host downloads."""

    @abstractmethod
    def execute(self, instruction: Instruction, module: int = 0) -> tuple[int, int]:
        """Execute a command beside the line; status and value of its reply."""

    @abstractmethod
    def ask(self, instruction: Instruction, module: int = 0) -> tuple[int, int]:
        """Status and value that a reading command gives, without any other effect where that is possible."""

    # The bench: on a real module these raise `NotOnRealModuleError`

    @property
    @abstractmethod
    def unit(self) -> Unit:
        """The first module on its bench."""

    @abstractmethod
    def view(self, motor: int, module: int = 0) -> AxisView:
        """An axis as an onlooker sees it."""

    @abstractmethod
    def act(self, name: str, *operands: Any, module: int = 0) -> None:
        """Do one of the actions of a bench, see docs/testing.md."""

    def press(self, side: str, motor: int = 0, module: int = 0) -> None:
        """Make the switch line `left` or `right` of a motor active."""
        self.act("switch", motor, side, True, module=module)

    def release(self, side: str, motor: int = 0, module: int = 0) -> None:
        """Let the switches of a line work again."""
        self.act("switch", motor, side, None, module=module)

    def unplug(self, side: str, motor: int = 0, module: int = 0) -> None:
        """Break the cable of a switch line."""
        self.act("unplug", motor, side, True, module=module)

    def input(self, number: int, level: int | bool, module: int = 0) -> None:
        """Hold IN_0..IN_7 at a level 0..1023, or low or high with False or True."""
        self.act("level", number, level * 1023 if isinstance(level, bool) else level, module=module)

    def power(self, on: bool, module: int = 0) -> None:
        """Switch the supply."""
        self.act("power", on, module=module)

    def power_cycle(self, module: int = 0) -> None:
        """Switch the supply off and on: what is not stored is lost."""
        self.power(False, module)
        self.power(True, module)

    @abstractmethod
    def fault(self, name: str, value: float | None = None, **options: Any) -> None:
        """Put a fault of the line in force, one of `links.faults.KINDS`.

        options: `count`, `probability`, `duration_s`, `after`
        """

    @abstractmethod
    def clear_faults(self, name: str | None = None) -> None:
        """End the faults of the line that have this name, or all."""

    @property
    @abstractmethod
    def history(self) -> History:
        """The past from when this is first asked for: run on to a condition, go back, ask what wrote a value."""

    @abstractmethod
    def snapshot(self) -> bytes:
        """The whole state of the bench."""

    @abstractmethod
    def restore(self, snapshot: bytes) -> None:
        """Go back to a state of this bench, or of another one made in the same way; lines stay open."""
