"""What the firmware needs of its ports, of the stand-alone program, and of those who look on.

The classes that play these roles are in rooms above; the rooms below know them by these protocols only.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from tmcm34x.clock import Value
    from tmcm34x.tmcl.datagram import Instruction
    from tmcm34x.tmcl.status import Status


class Port(Protocol):
    """What the module needs of a port to answer a command that came through it."""

    @property
    def takes_text(self) -> bool:
        """Whether there is an ASCII interface on it."""
        ...

    def power_on(self) -> None:
        """Begin anew."""
        ...

    def enter_text(self, on: bool, /) -> None:
        """Take lines of text from now on, or telegrams again."""
        ...

    def answer(self, status: int, number: int, value: int, size: int, /) -> None:
        """Send a reply in the normal form, to a request of `size` bytes."""
        ...

    def answer_text(self, text: bytes, size: int, /) -> None:
        """Send the eight characters of the version."""
        ...

    def answer_record(self, record: bytes, size: int, /) -> None:
        """Send the seven bytes of a stored command."""
        ...

    def target_reached(self, mask: int, size: int, /) -> None:
        """Send the second reply of command 138."""
        ...

    def deliver(self, data: bytes, /) -> None:
        """Send bytes now."""
        ...

    def recipe(self) -> Callable[[Any], Port]:
        """Makes a port of the same kind, which leads nowhere, on another module."""
        ...

    def save(self) -> Value:
        """What was received of a telegram that is not complete."""
        ...

    def load(self, value: Any, /) -> None:
        """Go back to what `save` gave."""
        ...


class Observer(Protocol):
    """Looks on at what a module does: a recorder, a debugger."""

    def telegram(self, port: Port, direction: str, data: bytes, now: int) -> None:
        """Bytes came in ("in") or go out ("out")."""
        ...

    @property
    def instruction(self) -> Callable[[int, Instruction, int], object] | None:
        """Called with address, instruction and clock before the program executes one; None: not wanted.

        A program that is looked at in this way runs command by command.
        """
        ...

    def event(self, kind: str, motor: int, now: int) -> None:
        """Something happened to a motor, or (-1) to the module.

        kind: "stall", "deviation", "shutdown", "heartbeat", "reference" (search done), "power"; "no_speed" for a move
            with axis parameter 4 at 0, "no_positioning" for a target position in velocity mode: both move nothing
        """
        ...


class ProgramMemory(Protocol):
    """The program memory as hosts see it."""

    def read(self, address: int) -> Instruction | Status:
        """The stored command at `address`, or the status that refuses it."""
        ...

    def store(self, instruction: Instruction) -> Status:
        """Store the next command of a download."""
        ...


class ProgramControl(Protocol):
    """What commands need of the stand-alone program."""

    @property
    def memory(self) -> ProgramMemory:
        """The program memory."""
        ...

    @property
    def state(self) -> int:
        """What the program is doing (control function 135)."""
        ...

    @property
    def counter(self) -> int:
        """Address of the command being executed."""
        ...

    @property
    def downloading(self) -> bool:
        """Whether commands are stored instead of executed."""
        ...

    @property
    def accumulator(self) -> int:
        """The accumulator."""
        ...

    @property
    def variables(self) -> list[int]:
        """The user variables in RAM."""
        ...

    @property
    def last_status(self) -> int:
        """Status of the command that was refused last, 0 for none."""
        ...

    def wake(self) -> None:
        """Take notice that something a program may look at changes, here and now."""
        ...

    def calculate(self, instruction: Instruction) -> Status:
        """Execute CALC or CALCX on the program's registers."""
        ...

    def raise_error(self, flag: str) -> None:
        """Set one of the flags ETO, EAL, EDV, EPO, ESD."""
        ...

    def erase(self) -> None:
        """Wipe the program memory."""
        ...

    def run(self, address: int | None = None) -> Status:
        """Start the program where it stands, or at `address`."""
        ...

    def step(self) -> Status:
        """Execute one command and stop again."""
        ...

    def stop(self) -> Status:
        """Stop the program where it stands."""
        ...

    def reset(self) -> Status:
        """Stop the program and go back to its start."""
        ...

    def start_download(self, address: int) -> Status:
        """Store all commands to come from `address` on."""
        ...

    def quit_download(self) -> Status:
        """Execute commands again."""
        ...

    def power_on(self, auto_start: bool) -> None:
        """Begin anew."""
        ...

    def power_off(self) -> None:
        """Leave off at once."""
        ...
